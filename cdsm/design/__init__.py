"""Design of an arm: a problem as a value, searches over it, and what they find."""
