"""Intervals of budgets cover the truth in 95 of a hundred cases."""

import math

import numpy as np
import pytest
from scipy.stats import binom

import cdsm
from cdsm.support.progress import show_progress
from cdsm.support.values import Array
from tests.support.arms import README_SIZES, readme_geometry

ANGLE = math.radians(0.5)
COMMON = {
    "link_length": 1e-4,
    "disk_offset": 1e-4,
    "hole_radius": 1e-4,
    "link_mass": 6e-3,
    "lead": 5e-3,
}
TOLERANCES = cdsm.Tolerances(
    rigidity=0.05,
    joint_angle=math.radians(0.5),
    tension=2.0,
    **{name: cdsm.Tolerance(u, correlation=1.0) for name, u in COMMON.items()},
)


def covered(count: int, seed: int, axis: str) -> int:
    """How many of so many intervals hold the truth.

    The truth is one arm under known tensions. Each experimenter describes it with errors of his
    own, computes the stiffness and its 95 % interval from his description, and knows nothing else.
    """
    rng = np.random.default_rng(seed)
    q, F = np.deg2rad([10, 5, 10, 5, -8, 4, -8, 3]), np.linspace(50.0, 90.0, 12)

    def pose(sizes: dict[str, float], rigidity: float, angles: Array) -> cdsm.Posture:
        law = cdsm.LinearElasticity(rigidity)
        return cdsm.Manipulator(readme_geometry(**sizes), law).at(angles)

    truth = cdsm.stiffness(pose({}, 48e3, q), F).along(axis)
    held = 0
    for _ in show_progress(range(count), "arms"):
        sizes = {name: README_SIZES[name] + rng.normal(0.0, u) for name, u in COMMON.items()}
        rigidity, angles = 48e3 * (1.0 + rng.normal(0.0, 0.05)), rng.normal(0.0, ANGLE, 8)
        described, tension = pose(sizes, rigidity, q + angles), F + rng.normal(0.0, 2.0, 12)
        low, high = cdsm.uncertainty(described, tension, TOLERANCES, direction=axis).interval()
        held += low <= truth <= high
    return held


@pytest.mark.parametrize(
    ("count", "axis"), [(200, "y"), pytest.param(3000, "z", marks=pytest.mark.long)]
)
def test_intervals_cover_the_truth(count: int, axis: str) -> None:
    """Within what so many arms of 95 % may give, once in 10⁴ runs less."""
    low, high = binom.interval(1.0 - 1e-4, count, 0.95)
    assert low <= covered(count, 1, axis) <= high
