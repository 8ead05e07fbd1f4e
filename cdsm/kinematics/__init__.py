"""Inverse kinematics: joint angles from tip poses or from cable lengths."""
