"""The admissible tensions: bounds, domains, balance, and pieces without kinks."""

import numpy as np
import pytest

import cdsm
from cdsm.planning.admissible import admissible, solve
from tests.support import arms
from tests.support.locked import STRAND

POSE = arms.random_posture(arms.random_arm(1, 3, "universal", STRAND), 1, 0.3)
REGION = admissible(POSE, 0.0, np.inf, np.zeros(6))


def test_bounds_are_those_of_the_domains_and_the_least_tensions_are_within() -> None:
    np.testing.assert_array_equal(REGION.low, STRAND.low)
    np.testing.assert_array_equal(REGION.high, 810.0)
    F = REGION.least.values
    assert ((REGION.low <= F) & (REGION.high >= F)).all()
    np.testing.assert_allclose(F @ POSE.length_jacobian, -POSE.gravity_torque, atol=1e-10)
    assert abs(REGION.null.T @ POSE.length_jacobian).max() < 1e-12
    with pytest.raises(cdsm.ElasticityRangeError, match="nothing between minimum= and maximum="):
        admissible(POSE, 900.0, np.inf, np.zeros(6))


def test_nearest_balances_and_no_balancing_tensions_are_nearer() -> None:
    rng = np.random.default_rng(0)
    wanted = rng.uniform(20.0, 60.0, REGION.low.size)
    low, high = np.full_like(wanted, 15.0), np.full_like(wanted, 90.0)
    F = REGION.nearest(wanted, low, high)
    assert F is not None
    assert abs(REGION.imbalance(F)).max() < 1e-10 * F.max()
    for step in rng.normal(size=(50, REGION.null.shape[1])):
        there = F + 0.1 * REGION.null @ step
        if ((low <= there) & (high >= there)).all():
            assert np.linalg.norm(there - wanted) > np.linalg.norm(F - wanted)
    assert REGION.nearest(wanted, low + 800.0, low + 800.0) is None


def test_within_keeps_to_the_change_and_the_bounds() -> None:
    F = REGION.least.values
    near = REGION.within(np.full_like(F, 5.0), F)
    assert near is not None
    np.testing.assert_array_equal(near.low, np.maximum(REGION.low, F - 5.0))
    np.testing.assert_array_equal(near.high, F + 5.0)
    assert np.linalg.norm(near.least.values) <= np.linalg.norm(F) * (1.0 + 1e-12)
    assert REGION.within(np.full_like(F, 5.0), F + 1000.0) is None


def test_tension_balances_exactly_and_keeps_the_bounds_of_the_caller() -> None:
    start = cdsm.distribute_tension(POSE, 40.0).values
    tension = REGION.tension(start * (1.0 + 1e-9))
    assert abs(tension.residual).max() < 1e-12 * start.max()
    np.testing.assert_array_equal(tension.minimum, 0.0)
    np.testing.assert_array_equal(tension.maximum, np.inf)


def test_program_without_a_solution_has_none() -> None:
    eye, none = np.eye(2), np.zeros((0, 2))
    box = np.zeros(2), np.ones(2)
    assert solve(eye, np.zeros(2), (np.ones((1, 2)), np.array([3.0])), box) is None
    found = solve(eye, -np.ones(2), (none, np.zeros(0)), box, (np.ones((1, 2)), np.ones(1)))
    assert found is not None
    np.testing.assert_allclose(found.x, 0.5, atol=1e-9)
    np.testing.assert_allclose(found.z, 0.5, atol=1e-9)
