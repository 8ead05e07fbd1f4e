"""Elasticity of the cable material: axial rigidity EA [N] as a function of tension [N].

A cable of unstretched length l_0 under tension F has the stiffness dF/dL = EA(F)/l_0. EA is the
*tangent* rigidity. This package is independent of the robot; :mod:`cdsm.wires` has more laws.
"""

from cdsm.elasticity.domain import Domain as Domain
from cdsm.elasticity.inverse import tension_at as tension_at
from cdsm.elasticity.law import Elasticity as Elasticity
from cdsm.elasticity.law import ScaledElasticity as ScaledElasticity
from cdsm.elasticity.law import SlackBelow as SlackBelow
from cdsm.elasticity.linear import LinearElasticity as LinearElasticity
