"""The quasi-static plant against the loads and equilibria that it is made of."""

import numpy as np
import pytest

import cdsm
from cdsm.control import Command
from cdsm.planning.path_plan import PathPlan
from tests.support.tracking import paid_out, small_path

NONE = np.zeros(6)


def moved(plan: PathPlan, by: float) -> Command:
    wire = paid_out(plan)[0] + by * np.arange(6)
    return Command(wire, plan.tensions[0], np.zeros(6, dtype=np.bool_))


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_move_is_a_load_and_a_command_of_load_cycle(friction: float) -> None:
    plan = small_path(friction)
    plant, wrench = cdsm.QuasiStaticPlant(plan.arm), np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
    before = plant.initial(plan.angles[0], plan.tensions[0], NONE)
    command = moved(plan, 1e-5)
    state = plant.step_to(before, command, wrench)
    pose = plan.arm.at(plan.angles[0])
    taken_in = paid_out(plan)[0] - command.paid_out
    history = cdsm.load_cycle(
        pose, plan.tensions[0], [wrench], motors=[taken_in], substeps=plant.substeps
    )
    np.testing.assert_allclose(state.pose.q, history.angles[0], atol=1e-12)
    np.testing.assert_allclose(state.true_values.paid_out, command.paid_out, rtol=1e-14)
    first = [T[0, 0] for T in history.tensions]
    np.testing.assert_allclose(state.true_values.tension, first, rtol=1e-9)
    np.testing.assert_array_equal(before.pose.q, plan.angles[0])  # a state does not change


def test_stretched_lengths_are_refused() -> None:
    arm = small_path().arm
    stretched = cdsm.Manipulator(
        arm.geometry, elasticity=arm.cables[0].elasticity, original_length="stretched"
    )
    with pytest.raises(cdsm.InvalidInput, match="stretched"):
        cdsm.QuasiStaticPlant(stretched)
