"""Examples with pulleys and with links that roll; equilibria and Newton across lift-offs."""

from pathlib import Path

import numpy as np
import pytest

import cdsm
from tests.support.pulleys import finger

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_moment_arms_of_the_finger_are_its_radii() -> None:
    arm = cdsm.Manipulator.read(EXAMPLES / "finger_with_pulleys.toml")
    pose = arm.at(np.deg2rad([0.0, 30.0, 40.0, 20.0]))
    arms = 1e3 * pose.moment_arms.values[:4, 1:]
    expected = [[8.0, 6.0, 4.0], [8.0, 6.0, 0.0], [8.0, 0.0, 0.0], [-7.0, -4.0, -2.0]]
    np.testing.assert_allclose(arms, expected, rtol=0.0, atol=1e-12)
    pull = cdsm.distribute_tension(pose)
    K = cdsm.stiffness(pose, pull)
    np.testing.assert_allclose(K.active[1:, 1:], 0.0, atol=1e-12)
    assert K.report().passed


def test_the_rolling_arm_is_straightened_by_its_cables() -> None:
    arm = cdsm.Manipulator.read(EXAMPLES / "rolling_arm.toml")
    K = cdsm.stiffness(arm.at(np.zeros(6)), np.full(12, 10.0))
    # of q, the turn of the line of centres: 4 F r cos α per pair, less what spread takes off
    assert K.active[5, 5] == pytest.approx(
        4.0 * 2.0 * 10.0 * 0.005 * np.cos(np.deg2rad(35.0)) / 2.0, rel=0.05
    )
    assert np.linalg.eigvalsh(K.active).min() > 0.1


@pytest.mark.parametrize("groove", [True, False])
def test_grooves_hold_sideways_and_smooth_cylinders_do_not(groove: bool) -> None:
    """At one posture and one set of tensions the kind of the pulleys changes K about abduction."""
    arm = finger(plane=False, groove=groove)
    F = np.array([20.0, 15.0, 21.0, 22.0, 6.0, 8.0, 5.0, 12.0, 12.0])
    K = cdsm.stiffness(arm.at(np.deg2rad([5.0, 8.0, 10.0, 6.0])), F)
    assert K.active[0, 0] == pytest.approx(-0.936 if groove else -1.718, abs=1e-3)
    if groove:
        np.testing.assert_allclose(K.active[1:, 1:], 0.0, atol=1e-6)


def test_newtons_method_passes_lift_offs() -> None:
    """Four pulleys lift off on the way; few steps or many end at the same angles."""
    arm = finger(plane=False)
    spring = np.array([0.6, 0.5, 0.4, 0.4])
    ends = []
    for count, most in ((41, 4), (9, 5), (2, 8)):
        q = np.zeros(4)
        for load in np.linspace(0.0, 0.4, count):
            torque = load * np.array([0.0, 1.0, 0.8, 0.6])
            steps = 0
            while True:
                pose = arm.at(q, check_limits=False)
                K = cdsm.stiffness(pose, np.full(9, 3.0))
                r = pose.length_jacobian.T @ np.full(9, 3.0) + pose.gravity_torque + spring * q
                if abs(r - torque).max() < 1e-12:
                    break
                move = -np.linalg.solve(K.active + K.gravity + np.diag(spring), r - torque)
                q = q + move * min(1.0, 0.2 / abs(move).max())
                steps += 1
                assert steps <= most
        ends.append(q)
        lifted = set(np.flatnonzero(~pose.wraps.touches).tolist())
    assert len(lifted) == 4
    np.testing.assert_allclose(ends[1:], [ends[0]] * 2, rtol=0.0, atol=1e-12)


def test_locked_motors_find_the_equilibrium_of_the_finger() -> None:
    arm = finger(plane=False)
    pose = arm.at(np.deg2rad([5.0, 8.0, 10.0, 6.0]))
    F = np.array([20.0, 15.0, 21.0, 22.0, 6.0, 8.0, 5.0, 12.0, 12.0])
    rest = cdsm.equilibrium(pose, F)
    np.testing.assert_allclose(np.rad2deg(rest.pose.q), [5.335, 8.122, 11.284, 3.742], atol=2e-3)
    assert rest.stiffness.report().passed
