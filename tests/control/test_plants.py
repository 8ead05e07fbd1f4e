"""Both plants against loads and equilibria; what the observer finds of them."""

import numpy as np
import pytest

import cdsm
from cdsm import Status, control
from cdsm.control import Command
from cdsm.planning.path_plan import PathPlan
from tests.support.tracking import coupled_path, paid_out, small_path

NONE = np.zeros(6)


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_move_is_a_load_and_a_command_of_load_cycle(friction: float) -> None:
    plan = small_path(friction)
    plant, wrench = cdsm.QuasiStaticPlant(plan.arm), np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
    before = plant.initial(plan.angles[0], plan.tensions[0], NONE)
    more = 1e-5 * np.arange(6)
    command = Command(paid_out(plan)[0] + more, plan.tensions[0], np.zeros(6, dtype=np.bool_))
    state = plant.step_to(before, command, wrench)
    pose, pull = plan.arm.at(plan.angles[0]), plan.tensions[0]
    history = cdsm.load_cycle(pose, pull, [wrench], motors=[-more], substeps=plant.substeps)
    np.testing.assert_allclose(state.pose.q, history.angles[0], atol=1e-12)
    np.testing.assert_allclose(state.true_values.paid_out, command.paid_out, rtol=1e-14)
    first = [T[0, 0] for T in history.tensions]
    np.testing.assert_allclose(state.true_values.tension, first, rtol=1e-9)
    np.testing.assert_array_equal(before.pose.q, plan.angles[0])  # a state does not change


def test_arms_that_a_plant_does_not_simulate_are_refused() -> None:
    arm = small_path().arm
    with pytest.raises(cdsm.InvalidInput, match="friction"):
        cdsm.MuJoCoPlant(small_path(0.1).arm)
    for ratio in (np.nan, -0.1, "0.5"):
        with pytest.raises(cdsm.InvalidInput, match="damping_ratio"):
            cdsm.MuJoCoPlant(arm, damping_ratio=ratio)  # type: ignore[arg-type]


pytest.importorskip("mujoco")


@pytest.mark.parametrize("plan", [small_path(), coupled_path()], ids=["free", "coupled"])
def test_both_plants_rest_at_the_same_place(plan: PathPlan) -> None:
    """Far from where the model was linearised, and under a load: within a thousandth."""
    load = np.array([0.0, 0.0, -1.5, 0.0, 0.0, 0.0])
    wire = paid_out(plan)[-1] + 2e-5 * np.arange(len(plan.arm.cables))
    command = Command(wire, plan.tensions[-1], np.zeros(wire.size, dtype=np.bool_))
    slow, fast = cdsm.QuasiStaticPlant(plan.arm), cdsm.MuJoCoPlant(plan.arm, damping_ratio=0.7)
    begin = plan.angles[0], plan.tensions[0], NONE
    wanted, state = slow.step_to(slow.initial(*begin), command, load), fast.initial(*begin)
    for _ in range(40):
        state = fast.step_to(state, command, load)
    moved = wanted.pose.q - plan.angles[0]
    assert np.linalg.norm(moved) > np.deg2rad(2.0)
    assert np.linalg.norm(state.pose.q - wanted.pose.q) < 1e-3 * np.linalg.norm(moved)
    np.testing.assert_allclose(state.true_values.tension, wanted.true_values.tension, rtol=1e-3)
    assert abs(state.joints[1]).max() < 1e-3


def test_stiffness_loop_holds_an_arm_with_inertia() -> None:
    plan = small_path()
    plant = cdsm.MuJoCoPlant(control.with_rigidity(plan.arm, 0.9))
    sensors = cdsm.Sensors(tension_noise=0.2)
    bounds = {"minimum": 10.0, "maximum": 250.0}
    run = cdsm.track(plan, "stiffness", plant, sensors, steps=10, payload=0.1, **bounds)
    assert run.outcome is Status.OK
    assert run.rigidity[-1] == pytest.approx(0.9, abs=5e-3)
    assert abs(run.stiffness_error[8:]).max() < 0.03
    assert run.tip_error[8:].max() < 5e-4
