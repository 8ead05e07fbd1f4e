"""Tensions for a wanted stiffness: hit, measured by a hung weight, least, and start-independent."""

from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import presets
from cdsm.planning.plan import StiffnessPlan
from cdsm.support.values import Array
from tests.planning.test_range import corners
from tests.support import arms
from tests.support.differences import central_difference
from tests.support.locked import (
    LENGTH,
    STRAND,
    hinge,
    original_lengths,
    soft,
    soft_hinge,
    some_arm,
)
from tests.support.paths import DOWN

ARMS: dict[str, tuple[str, int, int, cdsm.Elasticity, float, float]] = {
    "hinged-3-strand": ("hinged", 3, 0, STRAND, 40.0, 300.0),
    "hinged-3-linear": ("hinged", 3, 2, cdsm.LinearElasticity(8e3), 20.0, 300.0),
    "universal-2-strand": ("universal", 2, 3, STRAND, 40.0, 400.0),
    "universal-3-linear": ("universal", 3, 1, cdsm.LinearElasticity(20e3), 10.0, 300.0),
    "universal-5-strand": ("universal", 5, 5, STRAND, 50.0, 700.0),
}


def posture(name: str) -> tuple[cdsm.Posture, float, float]:
    kind, joints, seed, law, low, high = ARMS[name]
    return arms.random_posture(arms.random_arm(seed, joints, kind, law), seed, 0.4), low, high


def assert_admissible(plan: StiffnessPlan, low: float, high: float, floor: float) -> None:
    F, K = plan.tension.values, plan.stiffness
    assert abs(plan.tension.residual).max() <= 1e-12 * F.max()
    np.testing.assert_allclose(K.residual, plan.tension.residual, atol=1e-15 * F.max())
    assert low <= F.min() <= F.max() <= high
    assert K.margin >= floor * (1.0 - 1e-9)


@pytest.mark.parametrize("name", ARMS)
def test_random_targets_are_hit_as_a_hung_weight_measures(name: str) -> None:
    pose, low, high = posture(name)
    rng = np.random.default_rng(len(name))
    for _ in range(3):
        u = rng.normal(size=3)
        u /= np.linalg.norm(u)
        found = cdsm.stiffness_range(pose, u, low, high, starts=6)
        target = found.low + rng.uniform(0.02, 0.98) * (found.high - found.low)
        plan = cdsm.plan_stiffness(pose, u, target, low, high)
        # next to buckling a search comes no nearer: there K_θ⁻¹ amplifies rounding 1e4-fold
        assert plan.achieved == pytest.approx(target, rel=1e-8)
        again = cdsm.stiffness(pose, plan.tension).along(u)
        assert again == pytest.approx(plan.achieved, rel=1e-14)
        assert plan.reached
        assert_admissible(plan, low, high, found.floor)
        # micrometres, up and down: what is left of the curvature is of second order
        force = 1e-6 * target * u
        soft = [
            1.0 / cdsm.weight_test(pose, plan.tension, sign * force).stiffness
            for sign in (1.0, -1.0)
        ]
        assert 2.0 / sum(soft) == pytest.approx(target, rel=1e-4)


@pytest.mark.parametrize("part", [0.04, 0.9])
@pytest.mark.parametrize("name", ARMS)
def test_tensions_satisfy_the_conditions_of_first_order(name: str, part: float) -> None:
    """F = J_L λ + μ ∂along/∂F + z: z pushes up at lower bounds, down at upper ones, else not."""
    pose, low, high = posture(name)
    u = np.array([0.2, 0.5, -0.8])
    found = cdsm.stiffness_range(pose, u, low, high, starts=6)
    target = found.low + part * (found.high - found.low)
    plan = cdsm.plan_stiffness(pose, u, target, low, high)
    F = plan.tension.values
    assert plan.stiffness.margin > 1.01 * found.floor  # stability has no say

    def along(F: Array) -> Array:
        return np.array(cdsm.stiffness(pose, F).along(u))

    # the bounds are no end of a domain, so there is something on both sides
    slope = central_difference(along, F, 1e-3) / target
    at_low, at_high = low * (1.0 + 1e-9) >= F, high * (1.0 - 1e-9) <= F
    free = ~(at_low | at_high)
    normals = np.column_stack([pose.length_jacobian, slope])
    scaled = normals / np.linalg.norm(normals, axis=0)
    multipliers = np.linalg.lstsq(scaled[free], F[free], rcond=None)[0]
    z = F - scaled @ multipliers
    # differences over 1e-3 N of a strand leave 1e-8 of its third derivative
    assert abs(z[free]).max() < 1e-6 * np.linalg.norm(F)
    assert z[at_low].min(initial=0.0) > -1e-6 * np.linalg.norm(F)
    assert z[at_high].max(initial=0.0) < 1e-6 * np.linalg.norm(F)
    if not name.startswith("hinged"):
        return
    # smaller tensions are a convex set: if along met the target somewhere, it would on the way
    least = cdsm.distribute_tension(pose, low, high).values
    side, tried = along(least) - target, 0
    ends = corners(pose, low, high, np.zeros(6))
    for there in np.random.default_rng(0).dirichlet(np.full(len(ends), 0.3), 2000) @ ends:
        while np.linalg.norm(there) > 0.9999 * np.linalg.norm(F):
            there = least + 0.9 * (there - least)
        K = cdsm.stiffness(pose, np.clip(there, low, high))
        if K.margin >= found.floor:
            assert (K.along(u) - target) * side > 0.0
            tried += 1
    assert tried > 1000


@pytest.mark.parametrize("name", [name for name in ARMS if name != "universal-5-strand"])
def test_unreachable_targets_are_refused_with_the_range(name: str) -> None:
    pose, low, high = posture(name)
    found = cdsm.stiffness_range(pose, DOWN, low, high)
    for target, end in ((0.99 * found.low, found.low), (1.01 * found.high, found.high)):
        with pytest.raises(cdsm.UnreachableStiffness, match="the range is") as caught:
            cdsm.plan_stiffness(pose, DOWN, target, low, high)
        error = caught.value
        assert error.low == pytest.approx(found.low, rel=1e-9)
        assert error.high == pytest.approx(found.high, rel=1e-9)
        np.testing.assert_allclose(error.nearest, [end], rtol=1e-9)
    for end in (found.low, found.high):
        plan = cdsm.plan_stiffness(pose, DOWN, end, low, high)
        assert plan.achieved == pytest.approx(end, rel=1e-6)


def test_every_stiffness_of_a_hinge_beside_its_kinks_is_reached() -> None:
    """Tensions balance on a line; at 31 N, where Eq. 19 bends, one cable then the other passes."""
    pose = hinge(law=STRAND, joint_limit=0.5).at([0.2])
    above, below = pose.length_jacobian[:, 0]
    kinks = [31.0, -31.0 * below / above]
    for F in (10.0, 20.0, *np.add.outer(kinks, [-1e-3, 1e-3]).ravel(), 45.0, 80.0):
        target = cdsm.stiffness(pose, [F, -F * above / below]).along(DOWN)
        plan = cdsm.plan_stiffness(pose, DOWN, target, 5.0, 100.0)
        assert plan.tension.values[0] == pytest.approx(F, rel=1e-8)
    plan = cdsm.plan_stiffness(soft_hinge().at([0.0]), DOWN, soft(33.0) / LENGTH**2, 10.0)
    np.testing.assert_allclose(plan.tension.values, 33.0, rtol=1e-9)


def test_several_directions_are_hit_at_once_if_they_can_be() -> None:
    arm = presets.virtual_prototype()
    pose = arm.at(np.random.default_rng(0).uniform(-0.3, 0.3, arm.nv))
    least = cdsm.distribute_tension(pose, 60.0)
    K, floor = cdsm.stiffness(pose, least), cdsm.stiffness_range(pose, DOWN, 30.0, 300.0).floor
    for directions in (np.eye(3)[:2], np.eye(3), [[0.0, 2.0, 0.0], [0.0, 1.0, 1.0]]):
        targets = [K.along(u) for u in directions]
        plan = cdsm.plan_stiffness(pose, directions, targets, 30.0, 300.0)
        assert plan.reached
        np.testing.assert_allclose(plan.achieved, targets, rtol=1e-9)
        # there may be smaller tensions than those the targets are from
        assert np.linalg.norm(plan.tension.values) <= np.linalg.norm(least.values) * (1.0 + 1e-9)
        assert_admissible(plan, 30.0, 300.0, floor)


def test_what_cannot_be_hit_is_missed_by_less_than_any_sample() -> None:
    pose, low, high = posture("hinged-3-strand")
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 80.0, 300.0))
    directions = np.eye(3)
    target = np.array([K.along(u) for u in directions]) * [1.0, 1.5, 0.7]
    plan = cdsm.plan_stiffness(pose, directions, target, low, high)
    assert not plan.reached
    floor = cdsm.stiffness_range(pose, DOWN, low, high).floor
    assert_admissible(plan, low, high, floor)

    def misfit(F: Array) -> float:
        K = cdsm.stiffness(pose, np.clip(F, low, high))
        return float(np.linalg.norm([K.along(u) for u in directions] / target - 1.0))

    assert misfit(plan.tension.values) == pytest.approx(plan.misfit, rel=1e-12)
    ends = corners(pose, low, high, np.zeros(6))
    rng = np.random.default_rng(0)
    mixtures = rng.dirichlet(np.full(len(ends), 0.3), 800) @ ends
    best = min(misfit(F) for F in mixtures)
    assert plan.misfit <= best <= 1.3 * plan.misfit
    centre = plan.tension.values
    for reach in (0.1, 0.01, 1e-3):
        assert min(misfit(centre + reach * (F - centre)) for F in mixtures[:100]) >= plan.misfit


@pytest.mark.parametrize(
    ("direction", "target", "message"),
    [
        (DOWN, 0.0, "target: 0 N/m given"),
        (DOWN, [1e4], "target: shape"),
        (np.eye(3), [1e4, 1e4, 0.0], "target: 0 N/m"),
        (np.eye(3)[:, :2], [1e4] * 3, "direction: shape"),
        (None, 1e4, "direction"),
    ],
)
def test_targets_that_make_no_sense_are_named(direction: Any, target: Any, message: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=message):
        cdsm.plan_stiffness(hinge().at([0.1]), direction, target, 50.0)


def test_rest_lengths_are_those_of_the_wire_without_strain() -> None:
    """Springs, strands, drives: the motor pays out what the tension has not stretched."""
    arm = some_arm("universal-3-8-all")
    pose = arms.random_posture(arm, 11, reach=0.25)
    attainable = cdsm.stiffness_range(pose, DOWN, 40.0, 300.0, starts=4)
    target = 0.5 * (attainable.low + attainable.high)
    plan = cdsm.plan_stiffness(pose, DOWN, target, 40.0, 300.0)
    expected = original_lengths(pose, plan.tension.values)
    np.testing.assert_allclose(plan.rest_lengths, expected, rtol=1e-12)
    assert (plan.rest_lengths < plan.cable_lengths)[arm.cables.position_controlled].all()
    path = cdsm.plan_path(arm, DOWN, target, 40.0, 300.0, angles=[pose.q])
    held = original_lengths(pose, path.tensions[0])[arm.cables.position_controlled]
    np.testing.assert_allclose(path.rest_lengths[0], held, rtol=1e-12)


def test_a_plan_says_which_bounds_were_asked_for_and_which_held() -> None:
    pose = (
        soft_hinge()
        .with_cables([cdsm.Cable(cable.name, cable.sites, STRAND) for cable in soft_hinge().cables])
        .at([0.1])
    )
    attainable = cdsm.stiffness_range(pose, DOWN, 0.0, 900.0, starts=4)
    for tension in (attainable.low_tension, attainable.high_tension):
        np.testing.assert_array_equal(tension.minimum, 0.0)
        np.testing.assert_array_equal(tension.minimum_held, STRAND.low)
        np.testing.assert_array_equal(tension.maximum_held, STRAND.high)
