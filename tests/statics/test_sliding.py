"""Arms whose cables slide: K_θ is not symmetric, and its symmetric part may be indefinite."""

from functools import cache

import numpy as np
import pytest

import cdsm
from cdsm.statics.equilibrium import Equilibrium
from cdsm.statics.load_cycle import LoadHistory
from cdsm.statics.quasi_static import QuasiStaticState
from cdsm.statics.solve import Point
from cdsm.support.values import Array

SIDE = np.array([-0.0105, -0.0406, -0.0254])  # N on disk 7 of the rod


@cache
def pulled_rod() -> Equilibrium:
    """The rod after its tendon was pulled: all ten holes slide towards the motor."""
    return cdsm.forward_statics(cdsm.presets.rod_one_tendon(friction=0.1), tension=[4.5332])


@cache
def loaded_rod(substeps: int) -> LoadHistory:
    """The pulled rod under a load at its side, which turns the slip around in the first hole."""
    rest = pulled_rod()
    load = {"disk7": [[*SIDE, 0.0, 0.0, 0.0]]}
    return cdsm.load_cycle(rest.pose, rest, load, substeps=substeps)


def state_of(history: LoadHistory) -> QuasiStaticState:
    """The state of a history at its only load."""
    way = history.way
    state, _ = way.arm.step_to(way.start, way.loads[0], way.substeps[0], "the load")
    np.testing.assert_array_equal(state.arm_state.pose.q, history.angles[-1])
    return state


def nudged(history: LoadHistory, state: QuasiStaticState, motion: Array) -> Point:
    """Torques after a motion from a state, in which holes slide on or stick."""
    return history.way.arm.balance(state, state.load)(state.x + motion)


def test_a_rod_is_followed_though_the_symmetric_part_of_its_stiffness_is_indefinite() -> None:
    history = loaded_rod(2)
    K = history.stiffness(-1)
    assert history.snaps.tolist() == [False]
    assert K.margin == pytest.approx(-0.0437, abs=5e-4)
    assert np.linalg.eigvals(K.joint).real.min() == pytest.approx(0.114, abs=2e-3)
    assert K.is_stable
    assert abs(K.residual).max() < 1e-9
    (warning,) = history.warnings
    said = (
        "at load 0, cables slide, so K_θ is not symmetric: all its eigenvalues are positive, 0.114"
    )
    assert warning.startswith(said)
    assert "its symmetric part has the eigenvalue -0.0436" in warning
    assert warning.removeprefix("at load 0, ") in K.warnings


def test_its_place_does_not_depend_on_the_steps() -> None:
    """No hole stops sliding within a step, so they are exact."""
    fine = loaded_rod(8)
    np.testing.assert_allclose(loaded_rod(2).tip, fine.tip, rtol=0.0, atol=1e-12)


def test_every_motion_of_it_costs_work_since_holes_stick_where_their_slip_turns_around() -> None:
    """The symmetric part is that of cables that slide on, to both sides."""
    history = loaded_rod(2)
    state = state_of(history)
    joint = history.stiffness(-1).joint
    values, vectors = np.linalg.eigh((joint + joint.T) / 2.0)
    assert values[0] < 0.0 < values[1]
    random = np.random.default_rng(0).normal(size=(20, len(values)))
    motions = [
        *(1e-5 * vectors[:, :3].T),
        *(1e-5 * random / np.linalg.norm(random, axis=1)[:, None]),
    ]
    before = nudged(history, state, 0.0 * motions[0]).value
    for motion in motions:
        for side in (1.0, -1.0):
            torque = nudged(history, state, side * motion).value - before
            assert side * float(torque @ motion) > 1e-2 * float(motion @ motion)


@pytest.mark.parametrize("seed", range(3))
def test_it_does_not_run_away_from_a_kick_when_it_moves_slowly(seed: int) -> None:
    """Explicit steps of a damped motion, in which the holes keep their history, never run away."""
    history = loaded_rod(2)
    start = state = state_of(history)
    kick = np.random.default_rng(seed).normal(size=start.x.size)
    x = start.x + 1e-3 * kick / np.linalg.norm(kick)
    stuck = cdsm.stuck_stiffness(start.arm_state.pose, history.segment_tensions[-1][:1]).joint
    farthest = 0.0
    for _ in range(300):
        point = history.way.arm.balance(state, start.load)(x)
        state = QuasiStaticState(start.load, point.state, x, start.stop_torque)  # type: ignore[arg-type]
        x = x - 0.5 * np.linalg.solve(stuck, point.value)
        farthest = max(farthest, float(np.linalg.norm(x - start.x)))
    assert farthest < 1.01e-3
    assert np.linalg.norm(x - start.x) < 0.9e-3
