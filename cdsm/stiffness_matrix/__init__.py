"""Stiffness of an arm at a posture under given cable tensions.

K_θ = H_L·F + J_Lᵀ K_L J_L + ∂g/∂θ − ∂(J_Xᵀ W)/∂θ                          (Eq. 16)
      active   passive       gravity   load
"""

from cdsm.stiffness_matrix.assembly import assemble_stiffness as assemble_stiffness
from cdsm.stiffness_matrix.assembly import checked_tension as checked_tension
from cdsm.stiffness_matrix.assembly import stiffness as stiffness
from cdsm.stiffness_matrix.report import Comparison as Comparison
from cdsm.stiffness_matrix.report import Remedy as Remedy
from cdsm.stiffness_matrix.report import Report as Report
from cdsm.stiffness_matrix.shares import Shares as Shares
from cdsm.stiffness_matrix.spatial import SpatialStiffness as SpatialStiffness
from cdsm.stiffness_matrix.value import FrictionState as FrictionState
from cdsm.stiffness_matrix.value import Stiffness as Stiffness
