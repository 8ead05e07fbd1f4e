"""A weight test with friction in the holes: stuck below, sliding above."""

import numpy as np
import pytest

import cdsm
from cdsm import presets
from tests.support.arms import readme_geometry


def prototype(mu: float) -> tuple[cdsm.Posture, cdsm.Tension]:
    arm = presets.virtual_prototype(cdsm.LinearElasticity(48e3), lead=0.3, friction=mu)
    pose = arm.at(np.full(arm.nv, presets.TEN_DEGREES))
    return pose, cdsm.distribute_tension(pose, 50.0)


def test_small_weights_measure_the_stuck_arm_and_increments_of_large_ones_the_frictionless() -> (
    None
):
    pose, pull = prototype(0.1)
    small = cdsm.weight_test(pose, pull, [0.0, 0.0, 0.3])
    assert small.friction is not None
    limit, slides = small.friction.breakaway.load, small.friction.sliding_load
    # of an independent program: 0.71 N, 257.4 N/mm, 36.2 N/mm
    assert limit == pytest.approx(0.71, abs=0.01)
    assert small.stiffness == pytest.approx(257.4e3, rel=2e-3)
    assert small.stiffness == pytest.approx(small.friction.stuck, rel=1e-3)
    assert small.friction.frictionless == pytest.approx(36.2e3, rel=2e-3)
    assert small.friction.sliding_holes == 0
    for factor, below in ((0.97, False), (1.03, True)):
        W = np.zeros((1, 6))
        W[0, 2] = factor * slides
        tangent = cdsm.load_cycle(pose, pull, W).stiffness(0).along("z")
        assert (tangent < 1.25 * small.friction.frictionless) == below
    large = cdsm.weight_test(pose, pull, [0.0, 0.0, 5.0], steps=2)
    assert large.friction is not None
    assert large.friction.secant == large.stiffness
    assert large.stiffness == pytest.approx(51.75e3, rel=1e-3)
    increment = 2.5 / (large.displacements[1] - large.displacements[0])[2]
    assert increment == pytest.approx(large.friction.frictionless, rel=0.25)
    np.testing.assert_array_equal(large.tensions[-1, 0], large.friction.history.tensions[0][-1, 0])


def test_one_line_says_how_to_measure() -> None:
    pose, pull = prototype(0.1)
    text = str(cdsm.weight_test(pose, pull, [0.0, 0.0, 2.0]))
    assert "below 0.7027 N all cables stick: a weight measures 257.6 N/mm" in text
    assert "the tangent there is at most 25 % above the frictionless 36.23 N/mm" in text
    assert "take the difference of two weights above" in text
    told = cdsm.weight_test(pose, pull, [0.0, 0.0, 2.0]).to_dict()["friction"]
    assert isinstance(told, dict)
    assert told["stuck_below_N"] == pytest.approx(0.7027, rel=1e-3)


def test_a_weight_is_compared_with_the_same_weight_without_friction() -> None:
    # strands at low tension stiffen: the secant of 5 N is 60 % above the tangent before it
    geometry = readme_geometry(lead=0.3)
    arm = cdsm.Manipulator(geometry, presets.STRAND_1X19)
    pose = arm.at(np.deg2rad([10, 5, 10, 5, -8, 0, -8, 0]))
    loose = cdsm.distribute_tension(pose, 5.0)
    same = cdsm.weight_test(pose, loose, [0.0, 0.0, -5.0])
    held = cdsm.weight_test(arm.with_friction(0.05).at(pose.q), loose.values, [0.0, 0.0, -5.0])
    assert held.friction is not None
    assert same.stiffness > 1.5 * same.linear.stiffness
    assert held.friction.frictionless_secant == pytest.approx(same.stiffness, rel=1e-9)
    said = f"this weight alone would measure {same.stiffness / 1e3:.4g} N/mm without friction"
    assert said in str(held)


def test_straight_arm_holds_no_cable() -> None:
    arm = presets.virtual_prototype(
        cdsm.LinearElasticity(48e3), lead=0.3, friction=0.2, gravity=(0.0, 0.0, 0.0)
    )
    pose = arm.at(np.zeros(arm.nv))
    test = cdsm.weight_test(pose, np.full(15, 50.0), [0.0, 0.0, 0.01])
    assert test.friction is not None
    assert test.friction.breakaway.load == test.friction.sliding_load == 0.0
    assert test.friction.stuck == pytest.approx(test.friction.frictionless, rel=1e-9)
    assert "straight through all holes" in str(test)


def test_arm_that_only_friction_holds_at_its_reference_says_so() -> None:
    geometry = cdsm.Geometry.universal(
        joints=4,
        cables_per_joint=3,
        base_length=0.02,
        link_length=0.05,
        hole_radius=0.01,
        disk_offset=0.005,
        link_mass=0.05,
    )
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(3000.0)).with_friction(0.2)
    pose = arm.at(np.full(arm.nv, 0.1))
    pull = cdsm.distribute_tension(pose, 150.0)
    assert not cdsm.stiffness(pose, pull).is_stable
    test = cdsm.weight_test(pose, pull, [0.0, 0.0, 0.2])
    assert test.friction is not None
    np.testing.assert_allclose(test.friction.history.tip[0], pose.tip[:3, 3], atol=1e-9)
    (said,) = test.warnings
    assert said.startswith("LEFT ITS REFERENCE: without friction the arm does not stay there")
    assert said.endswith("With friction it moves by (0, 0, 0) mm")
