"""Measures of one posture: loads that an arm can carry, cable clearance, closure, wire use."""
