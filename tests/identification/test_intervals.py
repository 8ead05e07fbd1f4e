"""Intervals by profile likelihood: where they can be written down, and how often they hold."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

import cdsm
from cdsm.identification import Measurement, identify
from cdsm.support.values import Array

GEOMETRY = cdsm.Geometry.hinged(
    joints=1,
    twist=0.0,
    link_length=0.1,
    base_length=0.05,
    disk_offset=0.02,
    hole_radius=0.03,
    link_mass=2.0,
    lead=0.3,
)
ANGLES = np.linspace(-0.5, 0.5, 8)
BARELY = (1e-9, 1e-9)
"""Tensions [N] under which cables are taut, but add nothing to the stiffness."""


def hinge(softness: float = 2e-3, gravity: float = 9.81) -> cdsm.Manipulator:
    """One hinge, its cables all but slack, EA = 1/softness: K is A/softness + B·gravity."""
    return cdsm.Manipulator(
        GEOMETRY, cdsm.LinearElasticity(1.0 / softness), gravity=(0.0, 0.0, -gravity)
    )


def stiffnesses(arm: cdsm.Manipulator) -> Array:
    along = [cdsm.stiffness(arm.at([q]), BARELY).along([0, 0, 1]) for q in ANGLES]
    return np.array(along)


def readings(noise: float) -> list[Measurement]:
    true, z = stiffnesses(hinge()), np.random.default_rng(0).normal(size=ANGLES.size)
    pull: Any = {"direction": (0.0, 0.0, 1.0), "tension": BARELY}
    return [
        Measurement(value=K * (1.0 + noise * e), angles=(q,), std=noise * K, **pull)
        for K, e, q in np.c_[true, z, ANGLES].tolist()
    ]


def model() -> tuple[Array, Array]:
    """What 1 N of rigidity and 1 m/s² of gravity add to the stiffnesses."""
    base = stiffnesses(hinge(2e-3, 0.0))
    passive = (stiffnesses(hinge(1e-3, 0.0)) - base) / 500.0
    return passive, stiffnesses(hinge(2e-3, 1.0)) - base


def line(measured: list[Measurement]) -> tuple[Array, Array, float]:
    """Rigidity and gravity by linear least squares, their covariance, and χ²: closed forms."""
    sigma = np.array([each.std for each in measured])
    A = np.column_stack(model()) / sigma[:, None]
    b = np.array([each.value for each in measured]) / sigma
    best = np.linalg.solve(A.T @ A, A.T @ b)
    return best, np.linalg.inv(A.T @ A), float(np.sum((A @ best - b) ** 2))


BOUNDS = {"softness": (1e-4, 1e-1), "gravity": (-500.0, 500.0)}


@pytest.mark.parametrize("noise", [0.05, 0.3])
@pytest.mark.parametrize("level", [0.95, 0.68])
def test_interval_of_a_reciprocal_is_the_reciprocal_of_the_interval(
    noise: float, level: float
) -> None:
    measured = readings(noise)
    (rigidity, gravity), covariance, chi_square = line(measured)
    found = identify(hinge, measured, BOUNDS)
    assert found.chi_square == pytest.approx(chi_square, rel=1e-8)
    width = norm.ppf((1.0 + level) / 2.0) * np.sqrt(np.diag(covariance))
    intervals, near = found.confidence(level), 1e-5
    assert intervals["gravity"] == pytest.approx(
        (gravity - width[1], gravity + width[1]), abs=near * width[1]
    )
    low, high = intervals["softness"]
    assert 1.0 / high == pytest.approx(rigidity - width[0], abs=near * width[0])
    assert 1.0 / low == pytest.approx(rigidity + width[0], abs=near * width[0])
    # the covariance is that of the tangent: symmetric
    assert found.std[0] == pytest.approx(math.sqrt(covariance[0, 0]) / rigidity**2, rel=1e-4)


def test_interval_that_the_measurements_do_not_end_is_open() -> None:
    measured = readings(0.3)
    (rigidity, _), covariance, _ = line(measured)
    least = rigidity - norm.ppf(0.975) * math.sqrt(covariance[0, 0])
    found = identify(hinge, measured, {**BOUNDS, "softness": (1e-4, 0.9 / least)})
    low, high = found.confidence()["softness"]
    assert high == math.inf
    assert 0.0 < low < found.values[0]
    # with less asked the end is within the bounds
    assert math.isfinite(found.confidence(0.6)["softness"][1])
    # and both ends can be missing
    narrow = identify(hinge, measured, {"softness": (1.0 / rigidity, 1.01 / rigidity)})
    assert narrow.confidence()["softness"] == (-math.inf, math.inf)


def test_optimum_on_a_bound_leaves_the_interval_of_the_values_within() -> None:
    measured = readings(0.1)
    (rigidity, _), _, _ = line(measured)
    beyond = 1.2 / rigidity
    found = identify(
        lambda softness: hinge(softness),
        *(measured, {"softness": (beyond, 1e-1)}),
        start={"softness": 2.0 * beyond},
    )
    low, high = found.confidence()["softness"]
    assert found.values[0] == beyond
    assert low == -math.inf
    assert any(each.startswith("softness is at its lower bound") for each in found.warnings)

    def chi_square(softness: float) -> float:
        passive, weight = model()
        return sum(
            ((p / softness + 9.81 * w - each.value) / each.std) ** 2
            for p, w, each in zip(passive, weight, measured, strict=True)
        )

    # Δχ² from the bound on, where it already rises
    assert chi_square(high) - chi_square(beyond) == pytest.approx(norm.ppf(0.975) ** 2, rel=5e-3)
