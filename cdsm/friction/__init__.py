"""Coulomb friction between cables and holes: sticking, sliding, and equilibria after loads.

The capstan law bounds the tensions T and T′ on both sides of a hole: |ln T′ − ln T| ≤ μ φ, with the
friction coefficient μ and the wrap angle φ. The model has no clearance of the cables in their
holes, no dependence on speed (Stribeck, creep), no wear, no continuous sheaths (use many holes), no
bending stiffness of the strand, and one coefficient for static and kinetic friction. Use the static
coefficient to see what may stick, and the kinetic one to see what slides.
"""

from cdsm.friction.stick import Breakaway as Breakaway
from cdsm.friction.stick import RestBand as RestBand
