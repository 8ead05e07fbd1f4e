"""Design of an arm: a problem as a value, searches over it, and their results."""
