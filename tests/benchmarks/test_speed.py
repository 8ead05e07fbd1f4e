"""Speed, as ratios against naive baselines in the same run; each compares the numbers first."""

from typing import Any

import numpy as np
import pytest
import qpsolvers

import cdsm
from tests.benchmarks.naive import NaiveArm, naive_joint_stiffness
from tests.benchmarks.timing import Clock

RIGIDITY = 48e3
GRAVITY = np.array([0.0, -9.81, 0.0])
SIZES: dict[str, Any] = {
    "cables_per_joint": 3,
    "link_length": 0.04,
    "base_length": 0.02,
    "disk_offset": 0.01,
    "hole_radius": 0.03,
    "link_mass": 0.5,
}


def arm(joints: int) -> cdsm.Manipulator:
    geometry = cdsm.Geometry.universal(joints=joints, **SIZES)
    return cdsm.Manipulator(geometry, cdsm.LinearElasticity(RIGIDITY), gravity=GRAVITY)


def problem(joints: int) -> tuple[cdsm.Manipulator, np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    one = arm(joints)
    rng = np.random.default_rng(joints)
    return one, rng.uniform(-0.17, 0.17, one.nv), rng.uniform(20.0, 90.0, len(one.cables))


def test_posture_and_stiffness_beat_differences(clock: Clock | None) -> None:
    one, q, tension = problem(5)
    wrench = np.array([1.0, -2.0, 3.0, 0.1, 0.2, -0.1])
    naive = NaiveArm(5, gravity=GRAVITY, **SIZES)

    slow = naive_joint_stiffness(naive, q, tension, wrench, RIGIDITY)
    fast = cdsm.stiffness(one.at(q), tension, wrench=wrench).joint
    # second differences with h = 1e-4 truncate at h² and round at 1e-16/h²; the crosses weigh 1e-6
    np.testing.assert_allclose(fast, slow, atol=1e-6 * abs(fast).max())

    if clock:
        clock.race(
            "posture + stiffness, n = 5: faster than differences",
            lambda: naive_joint_stiffness(naive, q, tension, wrench, RIGIDITY),
            lambda: cdsm.stiffness(one.at(q), tension, wrench=wrench).joint,
            least=200.0,
        )


@pytest.mark.speed
@pytest.mark.parametrize("clock", ["speed"], indirect=True)
def test_cost_grows_less_than_fourfold_from_5_to_20_joints(clock: Clock) -> None:
    small, q5, tension5 = problem(5)
    large, q20, tension20 = problem(20)
    clock.race(
        "posture + stiffness: cost of n = 20 over n = 5",
        lambda: cdsm.stiffness(large.at(q20), tension20),
        lambda: cdsm.stiffness(small.at(q5), tension5),
        most=4.0,
        slow_repeat=50,
    )


# OSQP announces a change of its defaults at every call
@pytest.mark.filterwarnings("ignore:The default value of raise_error")
@pytest.mark.filterwarnings("ignore::qpsolvers.warnings.SparseConversionWarning")
def test_tension_distribution_is_faster_than_osqp_with_defaults(
    clock: Clock | None,
) -> None:
    one, q, _ = problem(5)
    pose = one.at(q)
    count = len(one.cables)
    qp = qpsolvers.Problem(
        np.eye(count),
        np.zeros(count),
        A=pose.length_jacobian.T,
        b=-pose.gravity_torque,
        lb=np.full(count, 20.0),
        ub=np.full(count, np.inf),
    )
    approximate = qpsolvers.solve_problem(qp, "osqp").x
    exact = cdsm.distribute_tension(pose, 20.0).values
    assert approximate is not None
    # what the defaults are worth: within a few newtons
    np.testing.assert_allclose(approximate, exact, atol=3.0)

    if clock:
        clock.race(
            "tension distribution, n = 5: faster than OSQP with its defaults",
            lambda: qpsolvers.solve_problem(qp, "osqp"),
            lambda: cdsm.distribute_tension(pose, 20.0),
            least=4.0,
            slow_repeat=5,
        )
