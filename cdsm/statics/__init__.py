"""Statics of the loaded arm: equilibrium, weights, load cycles, buckling and natural modes."""
