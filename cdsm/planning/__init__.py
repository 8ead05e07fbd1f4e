"""Stiffness control: gradients, attainable range, tensions for a wanted stiffness, saturation."""

from cdsm.planning.attainable import StiffnessRange, stiffness_range
from cdsm.planning.gradient import StiffnessGradient, stiffness_gradient
from cdsm.planning.plan import StiffnessPlan, plan_stiffness
from cdsm.planning.saturation import Saturation, saturation

__all__ = [
    "Saturation",
    "StiffnessGradient",
    "StiffnessPlan",
    "StiffnessRange",
    "plan_stiffness",
    "saturation",
    "stiffness_gradient",
    "stiffness_range",
]
