"""Compiled kernels of forward kinematics, gravity, cable lengths, stiffness and tensions."""
