"""Angles, rigidity and tip force from wire and tension, against arms that know them."""

import numpy as np
import pytest

import cdsm
from cdsm.control import with_rigidity
from cdsm.control.laws import Command
from cdsm.control.plants import QuasiStaticPlantState
from cdsm.control.sensing import Estimate, Observer
from tests.support.tracking import paid_out, small_path

Pairs = list[tuple[QuasiStaticPlantState, Estimate]]

NONE = np.zeros(6)
EXACT = cdsm.Sensors(encoder=0.0)
FORCE = np.array([0.3, -0.5, -1.0, 0.0, 0.0, 0.0])


def observed(friction: float) -> Pairs:
    """What is observed of an arm with another wire that is driven along a plan and then loaded."""
    plan = small_path(friction)
    plant = cdsm.QuasiStaticPlant(with_rigidity(plan.arm, 0.9))
    states = [plant.initial(plan.angles[0], plan.tensions[0], NONE)]
    planned, free = paid_out(plan), np.zeros(6, dtype=np.bool_)
    wires = states[0].true_values.paid_out + planned - planned[0]
    for wire, wrench in (*((each, NONE) for each in wires), (wires[-1], FORCE)):
        command = Command(wire, plan.tensions[0], free)
        states.append(plant.step_to(states[-1], command, wrench))
    true_values, random = [states[0].true_values], np.random.default_rng(0)
    observer, pairs = Observer(plan.arm, EXACT), []
    estimate = observer.initial(plan.angles[0], EXACT.measure(true_values, random))
    for state in states:
        true_values.append(state.true_values)
        estimate = observer.update(estimate, EXACT.measure(true_values, random))
        pairs.append((state, estimate))
    return pairs


def test_without_friction_exact_sensors_give_angles_rigidity_and_force() -> None:
    """Stretch is accounted for although the wire is a tenth softer than its law says."""
    for state, estimate in observed(0.0)[1:]:
        np.testing.assert_allclose(estimate.pose.q, state.pose.q, atol=1e-9)
        assert 1.0 / estimate.softness == pytest.approx(0.9, abs=1e-6)
    np.testing.assert_allclose(estimate.tip_force.force, FORCE[:3], atol=1e-5)
    assert not estimate.tip_force.band.any()


def test_model_of_the_wire_in_the_holes_finds_angles_and_force_under_friction() -> None:
    pairs = observed(0.1)
    for state, estimate in pairs[1:]:
        assert abs(estimate.pose.q - state.pose.q).max() < np.deg2rad(0.05)
        assert 1.0 / estimate.softness == pytest.approx(0.9, abs=2e-3)
    state, estimate = pairs[-1]
    cable = state.pose.segments.chains.cable
    inner = state.state.arm_state.chain.tension
    found = estimate.shares * state.true_values.tension[cable]
    even = state.true_values.tension[cable]
    felt = estimate.tip_force
    assert (abs(felt.force - FORCE[:3]) <= felt.band + 1.96 * felt.std).all()
    assert felt.band.min() > 0.0
    # half of what friction changes is found, and more
    assert np.linalg.norm(found - inner) < 0.5 * np.linalg.norm(even - inner)
