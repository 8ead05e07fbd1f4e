"""Stiffness felt by the motors: against the arm that they excite, and what it may not do."""

from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.control import Command, with_rigidity
from cdsm.control.felt import virtual_force
from cdsm.control.plant import SlowState
from cdsm.support.values import Array
from tests.support.tracking import small_path

BOUNDS: Any = {"minimum": 10.0, "maximum": 250.0, "bands": 0, "steps": 3}
EXACT = cdsm.Sensors(encoder=0.0)


def soft(plan: cdsm.PathPlan) -> cdsm.SlowPlant:
    return cdsm.SlowPlant(with_rigidity(plan.arm, 0.9))


def test_virtual_force_loads_the_joints_as_a_force_at_the_tip() -> None:
    plan = small_path()
    pose, gain = plan.arm.at(plan.angles[0]), np.array([3e4, 4e4, 2e4, 5e4, 0.0, 3e4])
    force = np.array([0.3, -1.0, 2.0])
    tension = -gain * virtual_force(pose, gain, force)  # wire that is taken in raises the tension
    assert tension[4] == 0.0
    np.testing.assert_allclose(
        -pose.length_jacobian.T @ tension, pose.jacobian[:3].T @ force, rtol=1e-12, atol=1e-12
    )


def test_without_friction_exact_sensors_feel_the_true_stiffness() -> None:
    """Of an arm with another wire and a load that nobody told of; the law of its wire is curved."""
    plan = small_path()
    run = cdsm.track(plan, "mixed", soft(plan), EXACT, payload=0.2, felt=1, **BOUNDS)
    np.testing.assert_allclose(run.felt[1:], run.stiffness[1:], rtol=5e-3)
    assert abs(run.stiffness_error).max() > 0.05


def test_noise_leaves_a_few_percent_and_friction_some_more() -> None:
    noisy = cdsm.Sensors(encoder=1e-5, tension_noise=0.5)
    for friction, most in ((0.0, 0.03), (0.1, 0.2)):
        plan = small_path(friction)
        run = cdsm.track(plan, "stiffness", soft(plan), noisy, felt=3, **BOUNDS)
        tried = np.arange(0, 7, 3)
        np.testing.assert_allclose(run.felt[tried], run.stiffness[tried], rtol=most)
        assert np.isnan(np.delete(run.felt, tried)).all()
        alone = cdsm.track(plan, "stiffness", soft(plan), noisy, **BOUNDS)
        np.testing.assert_array_equal(run.tips, alone.tips)
        np.testing.assert_array_equal(run.measured_tension, alone.measured_tension)
    assert f"{100 * abs(run.felt / run.stiffness - 1)[tried].max():.3g} % off at 3 steps" in str(
        run
    )


def test_excitation_keeps_the_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Least tensions a little above their bound: the motors dare less."""
    plan, seen = small_path(), []
    move = cdsm.SlowPlant.move

    def watched(
        self: cdsm.SlowPlant, state: SlowState, command: Command, wrench: Array
    ) -> SlowState:
        after = move(self, state, command, wrench)
        seen.append(after.true.tension)
        return after

    monkeypatch.setattr(cdsm.SlowPlant, "move", watched)
    least = float(plan.tensions.min()) - 2.0
    run = cdsm.track(plan, "feedforward", None, EXACT, felt=1, **BOUNDS | {"minimum": least})
    assert len(seen) == 3 * len(run.time)
    assert np.array(seen).min() > least
    np.testing.assert_allclose(run.felt, run.stiffness, rtol=5e-3)
    over = cdsm.track(plan, "feedforward", None, EXACT, felt=1, **BOUNDS | {"minimum": least + 2.5})
    assert np.isnan(over.felt).any()  # at its bound a tension leaves no room
