"""Wires: laws of rigidity over tension, their files, and the fit of a tensile test."""
