"""MuJoCo's arm against cdsm's: both rest at the same place, and a loop holds both."""

import numpy as np
import pytest

import cdsm
from cdsm import control
from cdsm.control import Command
from tests.support.tracking import paid_out, small_path

pytest.importorskip("mujoco")

PAYLOAD = np.array([0.0, 0.0, -1.5, 0.0, 0.0, 0.0])


def test_both_plants_rest_at_the_same_place() -> None:
    """Far from where the model was linearised, and under a load: within a thousandth."""
    plan = small_path()
    wire = paid_out(plan)[-1] + 2e-5 * np.arange(6)
    command = Command(wire, plan.tensions[-1], np.zeros(6, dtype=np.bool_))
    slow, fast = cdsm.QuasiStaticPlant(plan.arm), cdsm.MuJoCoPlant(plan.arm, damping_ratio=0.7)
    begin = plan.angles[0], plan.tensions[0], np.zeros(6)
    wanted = slow.step_to(slow.initial(*begin), command, PAYLOAD)
    state = fast.initial(*begin)
    for _ in range(40):
        state = fast.step_to(state, command, PAYLOAD)
    moved = wanted.pose.q - plan.angles[0]
    assert np.linalg.norm(moved) > np.deg2rad(2.0)
    assert np.linalg.norm(state.pose.q - wanted.pose.q) < 1e-3 * np.linalg.norm(moved)
    np.testing.assert_allclose(state.true_values.tension, wanted.true_values.tension, rtol=1e-3)
    assert abs(state.velocity).max() < 1e-3


def test_stiffness_loop_holds_an_arm_with_inertia() -> None:
    plan = small_path()
    plant = cdsm.MuJoCoPlant(control.with_rigidity(plan.arm, 0.9))
    sensors = cdsm.Sensors(tension_noise=0.2)
    bounds = {"minimum": 10.0, "maximum": 250.0}
    run = cdsm.track(plan, "stiffness", plant, sensors, steps=10, payload=0.1, **bounds)
    assert run.outcome == "completed"
    assert run.rigidity[-1] == pytest.approx(0.9, abs=5e-3)
    assert abs(run.stiffness_error[8:]).max() < 0.03
    assert run.tip_error[8:].max() < 5e-4


def test_friction_is_refused() -> None:
    with pytest.raises(cdsm.InvalidInput, match="friction"):
        cdsm.MuJoCoPlant(small_path(0.1).arm)
