"""Arms and postures that the tests of sweeps share."""

from typing import Any

import numpy as np

import cdsm
from cdsm.quantities import names_of
from tests.support.arms import readme_geometry

EVERYTHING = tuple(name for name in names_of("sweep") if name != "force_radius")
"""All quantities that need no upper bound of the tensions."""

STEEL = cdsm.LinearElasticity(48e3)
WRENCHES = {"none": np.zeros(6), "pulled": np.array([1.0, 0.5, -2.0, 0.0, 0.05, 0.1])}


def short_arm(
    elasticity: cdsm.Elasticity = STEEL, spring: float = np.inf, lead: float = 0.0
) -> cdsm.Manipulator:
    """Three universal joints, and limits that a grid can go beyond."""
    sizes = {"link_length": 0.05, "base_length": 0.02, "disk_offset": 0.01, "hole_radius": 0.02}
    geometry = readme_geometry(joints=3, link_mass=0.1, lead=lead, joint_limit=0.92, **sizes)
    cables = cdsm.serpentine_cables(geometry, elasticity, series_stiffness=spring)
    return cdsm.Manipulator(geometry, cables=cables, gravity=(0.0, -2.0, -9.0))


GRID = cdsm.GridPoses(
    {"joint1_1": [-0.4, 0.1, 2.0], "joint3_2": np.linspace(-0.3, 0.3, 4)}, {"joint2_1": 0.2}
)
CASES: dict[str, Any] = {"minimum": [1.0, 20.0, 60.0], "wrench": WRENCHES}
"""Postures within and beyond the limits, bounds below and in the domain of the strand."""
