"""Breakaway loads, against arms of clamped springs that scipy loads until a hole slips."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, root

import cdsm
from cdsm import presets
from cdsm.paper import law_of_stretched_length
from cdsm.support.values import Array
from tests.friction.test_band import EA, LAW, prototype
from tests.support import arms
from tests.support.locked import hinge
from tests.support.rough import rough


def first_slip(pose: cdsm.Posture, F: Array, u: Array, guess: float) -> tuple[float, int]:
    """Load at which a hole of an arm of clamped linear springs reaches μφ, and the hole."""
    start, chains = pose.segments, pose.segments.chains
    natural = start.lengths / (1.0 + F[chains.cable] / EA)
    held_back = F @ pose.length_jacobian + pose.gravity_torque

    def state(q: Array) -> tuple[Array, cdsm.Posture]:
        moved = pose.arm.at(q, check_limits=False)
        return EA * (moved.segments.lengths / natural - 1.0), moved

    def margin(load: float) -> Array:
        def torque(q: Array) -> Array:
            T, moved = state(q)
            parts = T @ moved.segments.length_jacobian + moved.gravity_torque - held_back
            return np.asarray(parts - load * (u @ moved.jacobian[:3]))

        found = root(torque, pose.q, tol=1e-15, options={"xtol": 1e-14})
        T, moved = state(found.x)
        ratio = np.log(T[chains.hole + 1] / T[chains.hole])
        return np.asarray(abs(ratio) - chains.friction * moved.segments.wrap)

    load = float(brentq(lambda W: margin(W).max(), 0.9 * guess, 1.1 * guess, xtol=1e-13))
    return load, int(margin(load).argmax())


@pytest.mark.parametrize("direction", ["-z", "x"])
def test_load_is_that_of_the_first_slip(direction: str) -> None:
    """First order is off by a part that falls with the load in proportion, 1 % at μ = 0.2."""
    off = []
    for friction in (0.2, 0.1, 0.05):
        pose, F = prototype(friction)
        found = cdsm.breakaway(pose, F, direction)
        load, hole = first_slip(pose, F, found.direction, found.load)
        assert found.load == pytest.approx(load, rel=1e-4)
        off.append(load / found.hole_loads[hole] - 1.0)
        chains = pose.segments.chains
        assert found.cable == pose.arm.cables[chains.cable[chains.hole[hole]]].name
        assert found.site == chains.site[hole] + 1
    assert abs(off[0]) < 0.015
    np.testing.assert_allclose(np.array(off[:-1]) / off[1:], 2.0, rtol=0.1)


@pytest.mark.parametrize("law", [LAW, presets.STRAND_1X19], ids=["linear", "strand"])
def test_simulated_arms_begin_to_slide_at_the_load(law: cdsm.Elasticity) -> None:
    """Random arms at μ = 0.3: under 0.2 % less than the load none slides, under 0.2 % more all."""
    tried = 0
    for seed in range(8):
        arm = rough(
            arms.random_arm(seed, 1 + seed % 4, ("universal", "hinged")[seed % 2], law), 0.3
        )
        pose = arms.random_posture(arm, seed, 0.5)
        u = np.random.default_rng(seed).normal(size=3)
        pull = cdsm.distribute_tension(pose, 40.0)
        found = cdsm.breakaway(pose, pull, u)
        if not 0.0 < found.load < 1e3:
            continue
        for part, slides in ((0.998, False), (1.002, True)):
            W = part * found.load * np.append(found.direction, np.zeros(3))
            assert cdsm.load_cycle(pose, pull, W[None]).sliding.any() == slides
        tried += 1
    assert tried >= 5


def test_planar_arm_of_two_joints() -> None:
    """0.226, 0.453 and 0.905 N to first order by an independent program, for μ = 0.05, 0.1, 0.2."""
    sizes = {"link_length": 0.06, "disk_offset": 0.012, "hole_radius": 0.025, "lead": 0.3}
    plain = hinge(joints=2, law=law_of_stretched_length(LAW), **sizes)
    for mu, expected in ((0.05, 0.226), (0.1, 0.453), (0.2, 0.905)):
        pose = rough(plain, mu).at(np.deg2rad([15.0, 15.0]))
        assert np.rad2deg(pose.segments.wrap[-3:]) == pytest.approx(7.5)
        pull = cdsm.distribute_tension(pose, 50.0)
        assert cdsm.stiffness(pose, pull).along("z") == pytest.approx(27.90e3, rel=2e-4)
        assert cdsm.stuck_stiffness(pose, pull).along("z") == pytest.approx(318.4e3, rel=2e-4)
        found = cdsm.breakaway(pose, pull, "z")
        assert found.hole_loads.min() == pytest.approx(expected, abs=6e-4)
        assert found.load == pytest.approx(expected, rel=0.014)


def test_loads_of_zero_and_infinity() -> None:
    pose, F = prototype(0.0)
    found = cdsm.breakaway(pose, F, "z")
    assert (found.load, found.cable, found.site, found.link) == (0.0, "", 0, "")
    assert str(found) == "breakaway along (0, 0, 1): 0 N"
    straight = presets.virtual_prototype(LAW, friction=0.1).at(np.zeros(10))
    assert cdsm.breakaway(straight, F, "z").load == 0.0
    slack = F.copy()
    slack[-1] = 0.0  # holds nothing
    assert cdsm.breakaway(prototype(0.1)[0], slack, "z").load == 0.0
    arm = hinge()
    rough_arm = rough(arm.with_cables([replace(c, lead=0.2) for c in arm.cables]), 0.1)
    pose = rough_arm.at(np.full(arm.nv, 0.1), check_limits=False)
    across = np.cross(pose.jacobian[:3, 0], (1.0, 2.0, 3.0))
    found = cdsm.breakaway(pose, np.full(len(arm.cables), 20.0), across)
    assert math.isinf(found.load)
    assert found.to_dict()["load_N"] is None


def test_worst_friction_narrows_the_bounds() -> None:
    pose, _ = prototype(0.1)
    pull = cdsm.distribute_tension(pose, 50.0, 400.0, worst_friction=True)
    chains = pose.segments.chains
    grip = np.bincount(chains.cable[chains.hole], pose.segments.grip)
    np.testing.assert_allclose(pull.minimum_held, 50.0 * np.exp(grip), rtol=1e-14)
    np.testing.assert_allclose(pull.maximum_held, 400.0 / np.exp(grip), rtol=1e-14)
    assert (pull.values >= pull.minimum_held * (1.0 - 1e-9)).all()
    with pytest.raises(cdsm.InvalidInput, match=r"worst_friction: .* raise maximum"):
        cdsm.distribute_tension(pose, 50.0, 51.0, worst_friction=True)
    smooth, _ = prototype(0.0)
    plain = cdsm.distribute_tension(smooth, 50.0).values
    same = cdsm.distribute_tension(smooth, 50.0, worst_friction=True).values
    np.testing.assert_array_equal(same, plain)


def test_load_comes_on_top_of_the_wrench() -> None:
    pose = arms.random_posture(rough(arms.random_arm(3, 4), 0.1), 2)
    wrench = arms.random_wrench(3)
    found = cdsm.breakaway(pose, arms.random_tension(pose.arm, 3), "y", wrench)
    np.testing.assert_array_equal(found.stiffness.wrench, wrench)
    assert 0.0 < found.load < math.inf


@pytest.mark.parametrize(("bound", "expected"), [(15.0, 0.27), (50.0, 0.71), (120.0, 1.61)])
def test_numbers_of_the_virtual_prototype(bound: float, expected: float) -> None:
    """First slip in z of an independent program at μ = 0.1, with and without lead: two digits."""
    law = law_of_stretched_length(presets.STRAND_1X19)
    for lead in (0.0, 0.3):
        arm = presets.virtual_prototype(law, lead=lead, friction=0.1)
        pose = arm.at(np.full(10, presets.TEN_DEGREES))
        found = cdsm.breakaway(pose, cdsm.distribute_tension(pose, bound), "z")
        assert found.load == pytest.approx(expected, abs=0.007)
