"""Measures of one posture: the loads that an arm can carry, and the places of its cables."""
