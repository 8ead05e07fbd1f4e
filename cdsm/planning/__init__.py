"""Stiffness control at one posture or along a path: gradients, range, saturation and plans."""
