"""A weight test with friction in the holes: stuck below, sliding above."""

import numpy as np
import pytest

import cdsm
from cdsm import presets
from tests.support import arms


def prototype(mu: float) -> tuple[cdsm.Posture, cdsm.Tension]:
    return arms.prototype(cdsm.LinearElasticity(48e3), lead=0.3, friction=mu)


def test_small_weights_measure_the_stuck_arm_and_increments_of_large_ones_the_frictionless() -> (
    None
):
    pose, pull = prototype(0.1)
    small = cdsm.weight_test(pose, pull, [0.0, 0.0, 0.3])
    assert small.history is not None
    # of an independent program: 0.71 N, 257.4 N/mm, 36.2 N/mm
    assert small.breakaway_load == pytest.approx(0.71, abs=0.01)
    assert small.stiffness == pytest.approx(257.4e3, rel=2e-3)
    assert small.stiffness == pytest.approx(small.stuck, rel=1e-3)
    assert small.tangent == pytest.approx(36.2e3, rel=2e-3)
    assert not small.history.sliding[-1].any()
    assert small.sliding_load == np.inf
    large = cdsm.weight_test(pose, pull, [0.0, 0.0, 5.0], steps=2)
    assert large.history is not None
    assert large.stiffness == pytest.approx(51.75e3, rel=1e-3)
    increment = 2.5 / (large.displacements[1] - large.displacements[0])[2]
    assert increment == pytest.approx(large.tangent, rel=0.25)
    np.testing.assert_array_equal(large.tensions[-1, 0], large.history.tensions[0][-1, 0])


def test_from_the_sliding_load_on_the_tangent_is_near_the_frictionless_one_of_the_same_load() -> (
    None
):
    pose, pull = prototype(0.1)
    test = cdsm.weight_test(pose, pull, [0.0, 0.0, 5.0], steps=20)
    assert test.history is not None
    assert test.sliding_load is not None
    assert 0.7 < test.sliding_load < 3.0
    for k, state in enumerate(test.states):
        ratio = test.history.stiffness(k + 1).along("z") / state.along("z")
        assert (ratio <= 1.25) == (test.loads[k] >= test.sliding_load)
    # strands stiffen with the load: the tangent without the weight is no measure of sliding
    geometry = arms.readme_geometry(lead=0.3, friction=0.05)
    arm = cdsm.Manipulator(geometry, presets.STRAND_1X19)
    pose = arm.at(np.deg2rad([10, 5, 10, 5, -8, 0, -8, 0]))
    loose = cdsm.distribute_tension(pose, 5.0)
    stiffening = cdsm.weight_test(pose, loose, [0.0, 0.0, -5.0], steps=8)
    assert stiffening.history is not None
    assert stiffening.sliding_load is not None
    assert stiffening.sliding_load < 5.0
    assert stiffening.history.stiffness(-1).along("z") > 1.5 * stiffening.tangent


def test_straight_arm_holds_no_cable() -> None:
    arm = presets.virtual_prototype(
        cdsm.LinearElasticity(48e3), lead=0.3, friction=0.2, gravity=(0.0, 0.0, 0.0)
    )
    pose = arm.at(np.zeros(arm.nv))
    test = cdsm.weight_test(pose, np.full(15, 50.0), [0.0, 0.0, 0.01])
    assert test.breakaway_load == test.sliding_load == 0.0
    assert test.stuck == pytest.approx(test.tangent, rel=1e-9)
