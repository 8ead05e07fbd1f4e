"""Tensile tests: from forces and extensions to a law of rigidity."""
