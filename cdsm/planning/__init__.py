"""Plan tensions for a wanted stiffness, at one posture or along a path.

The chapter also computes derivatives of the stiffness with respect to the tensions, the range of
stiffness that the tensions can reach, and saturation: the tension above which more tension hardly
stiffens the arm.
"""

from cdsm.planning.path_plan import InfeasibleSample as InfeasibleSample
from cdsm.planning.path_plan import PathPlan as PathPlan
from cdsm.planning.plan import StiffnessPlan as StiffnessPlan
from cdsm.planning.range import StiffnessRange as StiffnessRange
from cdsm.planning.saturation import Saturation as Saturation
from cdsm.planning.sensitivity import StiffnessGradient as StiffnessGradient
