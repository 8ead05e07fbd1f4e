"""Coulomb friction between cables and holes: sticking, sliding, and the rests after loads.

The capstan law bounds the tensions T and T′ on both sides of a hole: |ln T′ − ln T| ≤ μ φ, with the
wrap angle φ. Not in this model: clearance of the cables in their holes, dependence on speed
(Stribeck, creep), wear, a static coefficient other than the sliding one, sheaths other than as many
holes, and bending stiffness of the strand. Take the static coefficient to see what may stick, the
kinetic one to see what slides.
"""
