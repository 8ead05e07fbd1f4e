"""Between two samples the arm is where the mean of all commands leaves it."""

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import root

import cdsm
from cdsm import presets
from cdsm.support.values import Array
from tests.support import arms
from tests.support.locked import (
    EA,
    LENGTH,
    H,
    R,
    hinge,
    some_arm,
)
from tests.support.paths import ARM, DOWN, waving


def resting(
    arm: cdsm.Manipulator, q: Array, l_0: Array, F: Array, W: Array
) -> tuple[Array, Callable[[Array], Array]]:
    """Where locked motors leave the arm, by the law of each cable and scipy alone, and its tip."""

    def torque(q: Array, W: Array) -> Array:
        pose, free = arm.at(q), iter(l_0.tolist())
        pulls = [
            F[c]
            if cable.control == "force"
            else float(
                cable.tension(pose.cable_lengths[c] - (unstrained := next(free)), unstrained)
            )
            for c, cable in enumerate(arm.cables)
        ]
        return np.asarray(
            pose.length_jacobian.T @ pulls + pose.gravity_torque - pose.jacobian.T @ W
        )

    def at(more: Array) -> Array:
        found = root(torque, q, args=(W + np.append(more, np.zeros(3)),), tol=1e-14).x
        assert abs(torque(found, W + np.append(more, np.zeros(3)))).max() < 1e-9
        return np.asarray(found)

    return at(np.zeros(3)), lambda force: arm.at(at(force)).tip[:3, 3]


def test_half_way_the_arm_is_where_the_mean_of_all_commands_leaves_it() -> None:
    """Strands, springs and drives, cables under force control, and a load that changes."""
    arm = some_arm("universal-3-8-all")
    assert {cable.control for cable in arm.cables} == {"position", "force"}
    q = np.outer([0.8, 0.9], arms.random_posture(arm, 11, reach=0.25).q)
    W = np.array([[0.0, 0.0, -4.0, 0.0, 0.0, 0.0], [1.0, 0.0, 2.0, 0.0, 0.0, 0.0]])
    found = cdsm.stiffness_range(arm.at(q[0]), DOWN, 40.0, 300.0, W[0], starts=4)
    targets = [x * found.low + (1.0 - x) * found.high for x in (0.6, 0.5)]
    plan = cdsm.plan_path(arm, DOWN, targets, 40.0, 300.0, W, angles=q)
    assert plan.complete
    (between,) = plan.between
    K = between.stiffness
    assert K is not None
    means = [x.mean(axis=0) for x in (q, plan.unstrained_lengths, plan.tensions, W)]
    rest, tip = resting(arm, *means)
    np.testing.assert_allclose(K.posture.q, rest, rtol=0.0, atol=1e-11)
    assert abs(rest - means[0]).max() > 1e-4
    errors = []
    for force in (0.4, 0.2):  # a finite weight is of second order
        moved = tip(force * np.array(DOWN)) - tip(-force * np.array(DOWN))
        errors.append(2.0 * force / float(moved @ DOWN) / float(between.achieved or 0.0) - 1.0)
    assert abs(errors[1]) < 1e-6
    assert abs(errors[1]) < 0.3 * abs(errors[0]) + 1e-8
    assert between.index == 0
    assert float(between.target) == pytest.approx(np.mean(targets), rel=1e-15)
    assert between.misfit == pytest.approx(
        abs(float(between.achieved or 0.0) / np.mean(targets) - 1.0), rel=1e-12
    )


def test_half_way_a_straight_hinge_has_the_tension_of_the_mean_length() -> None:
    """L = l_0 (1 + F/EA), and K = 2 R² (EA + F)/L − F h of both cables, where h is half of L."""
    F = np.array([20.0, 500.0])

    def along(F: Array | float) -> Array:
        return np.asarray((R**2 * (EA + F) / H - F * H) / LENGTH**2)

    plan = cdsm.plan_path(hinge(), DOWN, along(F), 10.0, angles=np.zeros((2, 1)))
    np.testing.assert_allclose(plan.tensions, np.transpose([F, F]), rtol=1e-9)
    middle = float(EA / np.mean(1.0 / (1.0 + F / EA)) - EA)
    (between,) = plan.between
    assert between.stiffness is not None
    np.testing.assert_allclose(between.stiffness.tension, middle, rtol=1e-9)
    assert float(between.achieved or 0.0) == pytest.approx(float(along(middle)), rel=1e-9)
    assert between.misfit == pytest.approx(1.0 - along(middle) / along(F).mean(), rel=1e-7)
    assert f"up to {100.0 * between.misfit:.2g} % off (samples 0 and 1)" in str(plan)


def test_half_the_step_leaves_a_quarter_of_the_error_half_way() -> None:
    worst = []
    for count in (9, 17, 33):
        s = np.linspace(0.0, math.pi, count)
        plan = cdsm.plan_path(ARM, DOWN, 70e3 + 20e3 * np.sin(s), 50.0, angles=waving(count))
        assert [each.index for each in plan.between] == list(range(count - 1))
        worst.append(max(each.misfit for each in plan.between))
    assert worst[0] < 2e-3
    for coarse, fine in itertools.pairwise(worst):
        assert 3.5 < coarse / fine < 4.5


def test_only_neighbours_have_something_between_them() -> None:
    plan = cdsm.plan_path(ARM, DOWN, [80e3, 80e3, 1e7, 80e3], 50.0, angles=waving(4))
    assert [each.index for each in plan.between] == [0]
    assert cdsm.plan_path(ARM, DOWN, 80e3, 50.0, angles=waving(1)).between == ()
    at_once = cdsm.plan_path(ARM, None, np.eye(3) * 1e9, 50.0, angles=waving(2))
    assert at_once.between == ()


def test_several_targets_are_missed_by_their_norm_half_way() -> None:
    q = waving(3)[:2]
    held = [cdsm.stiffness(ARM.at(a), cdsm.distribute_tension(ARM.at(a), 60.0)) for a in q]
    directions = np.eye(3)[1:]
    several = np.array([[K.along(u) for u in directions] for K in held])
    (two,) = cdsm.plan_path(ARM, directions, several, 30.0, 300.0, angles=q).between
    assert two.stiffness is not None
    along = [two.stiffness.along(u) for u in directions]
    np.testing.assert_array_equal(two.achieved, along)
    np.testing.assert_allclose(two.target, several.mean(axis=0), rtol=1e-15)
    assert two.misfit == pytest.approx(np.linalg.norm(along / several.mean(axis=0) - 1.0))
    matrices = np.array([K.cartesian for K in held])
    (full,) = cdsm.plan_path(ARM, None, matrices, 30.0, 300.0, angles=q).between
    assert full.stiffness is not None
    off = full.stiffness.cartesian - matrices.mean(axis=0)
    assert full.misfit == pytest.approx(np.linalg.norm(off) / np.linalg.norm(matrices.mean(axis=0)))
    assert 0.0 < full.misfit < 0.1


def test_arm_that_does_not_come_to_rest_half_way_says_why() -> None:
    """A hinge K = 1.8 + 0.08 F − 0.1 P: tensions fall faster than the load that they hold."""
    arm, F, P = hinge(law=cdsm.LinearElasticity(20.0)), [100.0, 1.0], np.array([90.0, 15.0])
    W = np.outer(P, [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    straight = arm.at([0.0])
    stiff = [
        cdsm.stiffness(straight, [f, f], wrench=w).along(DOWN) for f, w in zip(F, W, strict=True)
    ]
    plan = cdsm.plan_path(arm, DOWN, stiff, 0.5, 200.0, W, angles=np.zeros((2, 1)))
    np.testing.assert_allclose(plan.tensions, np.transpose([F, F]), rtol=1e-6)
    (between,) = plan.between
    assert between.stiffness is None
    assert between.achieved is None
    assert between.misfit == math.inf
    assert "the arm buckles" in between.reason
    assert f"half-way between samples 0 and 1: {between.reason}" in str(plan)
    assert "smaller steps" in between.reason
    assert repr(between) == "<HalfWay from sample 0 to 1, misfit inf>"


def test_cable_that_leaves_its_law_half_way_is_named() -> None:
    law = cdsm.TabulatedElasticity((15.0, 100.0, 400.0), (0.0, 2e-3, 8e-3))
    arm = presets.virtual_prototype(law)
    q = np.outer([2.0, -2.0], np.full(10, presets.TEN_DEGREES))
    targets = [1.02 * cdsm.stiffness_range(arm.at(a), DOWN, 15.0, 300.0).low for a in q]
    plan = cdsm.plan_path(arm, DOWN, targets, 15.0, 300.0, angles=q)
    (between,) = plan.between
    assert between.misfit == math.inf
    assert "cable1_1" in between.reason
    assert "[15 N, 400 N]" in between.reason
