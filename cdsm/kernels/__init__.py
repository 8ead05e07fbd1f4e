"""Compiled kernels of the single path: forward kinematics, gravity, stiffness, tensions."""
