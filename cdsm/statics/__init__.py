"""The loaded arm: equilibrium, hung weights, buckling, modes."""
