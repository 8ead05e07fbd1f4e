"""Measures of a posture: loads that an arm can carry, cable clearance, wrench closure."""

from cdsm.measures.clearance import Clearance as Clearance
from cdsm.measures.holding import Holding as Holding
from cdsm.measures.payload import Payload as Payload
from cdsm.measures.polytope import ForcePolytope as ForcePolytope
