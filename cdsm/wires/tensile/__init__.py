"""Fit a law of rigidity to the forces and extensions of a tensile test."""
