"""Design of an arm: the design problem, searches for the best designs, and their results."""
