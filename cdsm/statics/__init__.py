"""Statics of the loaded arm: equilibrium, hung weights, buckling and natural modes."""
