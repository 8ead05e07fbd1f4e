"""Stiffness control at one posture or along a path: gradients, range, saturation and plans."""

from cdsm.planning.gradient import StiffnessGradient, stiffness_gradient
from cdsm.planning.half_way import HalfWay
from cdsm.planning.path import plan_path
from cdsm.planning.path_plan import InfeasibleSample, PathPlan
from cdsm.planning.plan import StiffnessPlan, plan_stiffness
from cdsm.planning.range import StiffnessRange, stiffness_range
from cdsm.planning.tension_growth import Saturation, saturation

__all__ = [
    "HalfWay",
    "InfeasibleSample",
    "PathPlan",
    "Saturation",
    "StiffnessGradient",
    "StiffnessPlan",
    "StiffnessRange",
    "plan_path",
    "plan_stiffness",
    "saturation",
    "stiffness_gradient",
    "stiffness_range",
]
