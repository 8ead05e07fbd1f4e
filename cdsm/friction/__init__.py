"""Coulomb friction between cables and holes: sticking, sliding, and equilibria after loads.

The capstan law bounds the tensions T and T′ on both sides of a hole: |ln T′ − ln T| ≤ μ φ, with the
friction coefficient μ and the wrap angle φ. Not in this model: clearance of the cables in their
holes, dependence on speed (Stribeck, creep), wear, a static coefficient that differs from the
kinetic one, continuous sheaths (use many holes), and bending stiffness of the strand. Use the
static coefficient to see what may stick, and the kinetic one to see what slides.
"""
