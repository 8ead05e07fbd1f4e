"""Measures of a posture: loads an arm can carry, cable clearance, wrench closure, wire life."""
