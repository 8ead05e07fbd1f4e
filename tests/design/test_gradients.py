"""Derivatives under friction and tolerances: limits of differences of evaluated designs."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.design.goals import KINDS, Measure
from cdsm.design.gradients import rows_and_gradients
from cdsm.support.values import Array
from tests.design.test_problem import BENT, CONTINUOUS, LAW, problem, small_arm

AT = np.array([0.021, 0.011, 0.07, 0.12, 0.1, 2.2, 20.0])
TOLERANCES = cdsm.Tolerances(
    rigidity=0.05, hole_radius=1e-4, hole_angle=5e-3, disk_offset=1e-4, link_length=2e-4,
    joint_angle=2e-3, tension=0.5, lead=1e-3, link_mass=2e-3,
)  # fmt: skip
STEPS = (1e-3, 1e-4)


def rough(arm: cdsm.Manipulator) -> cdsm.Manipulator:
    """Return the arm with another friction coefficient in each hole."""
    rng = np.random.default_rng(5)
    cables = []
    for cable in arm.cables:
        *passed, end = cable.sites
        sites = [replace(site, friction=rng.uniform(0.02, 0.3)) for site in passed]
        cables.append(replace(cable, sites=(*sites, end)))
    return arm.with_cables(cables)


def limit(of: Any) -> cdsm.Constraint:
    """Return a constraint that every design meets: with tolerances, the quantity has a margin."""
    direction = "y" if of == "stiffness" else None
    if KINDS[of].best == "most":
        return cdsm.Constraint(of, direction, at_least=0.0)
    return cdsm.Constraint(of, direction, at_most=1e9)


def errors(task: cdsm.DesignProblem, x: Array, measure: Measure) -> tuple[float, ...]:
    """Return how far differences of evaluated designs are from the derivatives, at each step."""
    values, slopes = rows_and_gradients(task, x, measure)
    worst = values.argmin() if KINDS[measure.of].best == "most" else values.argmax()
    assert cdsm.evaluate_designs(task, [x])[measure.key][0] == pytest.approx(
        values[worst], rel=1e-12
    )
    low, high = task.bounds.T
    exact = slopes[worst] * (high - low)
    found = []
    for step in STEPS:
        moves = step * np.diag(high - low)
        ends = cdsm.evaluate_designs(task, np.vstack([x + moves, x - moves]))[measure.key]
        difference = (ends[: x.size] - ends[x.size :]) / (2.0 * step)
        found.append(float(abs(difference - exact).max() / abs(exact).max()))
    return tuple(found)


@pytest.mark.parametrize("law", [LAW, cdsm.presets.STRAND_1X19])
@pytest.mark.parametrize(
    ("of", "worst", "tolerances"),
    [
        ("stiffness", True, None),
        ("margin", True, None),
        ("deflection", True, None),
        ("motor_force", True, None),
        ("stiffness", False, TOLERANCES),
        ("stiffness", True, TOLERANCES),
        ("margin", True, TOLERANCES),
        ("motor_force", True, TOLERANCES),
    ],
)
def test_gradients_under_friction_and_tolerances(
    law: cdsm.Elasticity, of: Any, worst: bool, tolerances: cdsm.Tolerances | None
) -> None:
    arm = rough(cdsm.Manipulator(small_arm().geometry, law))
    bound = limit(of)
    task = problem(
        arm=arm,
        variables=CONTINUOUS,
        postures=BENT[3:],
        constraints=(bound,),
        worst_friction=worst,
        tolerances=tolerances,
    )
    coarse, fine = errors(task, AT, Measure(bound.of, bound.direction))
    # central differences: the error falls with the square of the step, down to that of dEA/dF in
    # the table of a strand
    small = 1e-6 if law is LAW else 2e-5
    assert fine < small
    assert fine < max(0.02 * coarse, small)


def test_a_deflection_under_a_load_with_a_moment_has_derivatives() -> None:
    loads = (0.5, 0.0, -2.0, 0.0, 0.05, 0.02)
    objectives = (cdsm.Objective("deflection"),)
    task = problem(variables=CONTINUOUS, postures=BENT[3:], loads=loads, objectives=objectives)
    coarse, fine = errors(task, AT, Measure("deflection"))
    assert fine < 1e-6
    assert fine < 0.02 * coarse


def test_upper_bounds_that_friction_lowers_have_derivatives() -> None:
    arm = small_arm(cables_per_joint=5, friction=0.1)
    whole: dict[str, Any] = {"minimum": 10.0, "worst_friction": True, "postures": BENT[3:]}
    task = problem(arm=arm, variables=CONTINUOUS[:5], maximum=22.0, **whole)
    x = np.array([0.02, 0.01, 0.06, 0.1, 0.0])
    pose = task.arm_of(x).at(BENT[3])
    pull = cdsm.distribute_tension(pose, 10.0, 22.0, task.loads[0], worst_friction=True)
    assert (pull.values == pull.maximum).any()
    assert (pull.values == pull.minimum).any()
    coarse, fine = errors(task, x, Measure("stiffness", "z"))
    assert fine < 1e-6
    assert fine < 0.02 * coarse


def test_a_lower_bound_of_a_cable_does_not_follow_the_common_one() -> None:
    arm = small_arm()
    first, *others = arm.cables
    arm = arm.with_cables([replace(first, minimum=60.0), *others])
    task = problem(arm=arm, variables=CONTINUOUS[-1:], postures=BENT[3:], maximum=np.inf)
    # so nearly linear in the bound that only rounding is left
    assert max(errors(task, np.array([20.0]), Measure("stiffness", "z"))) < 1e-7


def test_random_postures_follow_the_joint_limits() -> None:
    task = problem(
        arm=small_arm(disk_offset=0.0025, link_mass=0.01),
        variables=(
            cdsm.Variable("hole_radius", 0.012, 0.04),
            cdsm.Variable("disk_offset", 0.001, 0.02, at=2),
        ),
        postures=cdsm.RandomPoses(1),
        loads=(0.0, 0.0, -0.1, 0.0, 0.0, 0.0),
        worst_friction=True,
        minimum=5.0,
    )
    coarse, fine = errors(task, np.array([0.021, 0.0025]), Measure("stiffness", "z"))
    assert fine < 1e-5
    assert fine < 0.02 * coarse


@pytest.mark.parametrize("end", [0, 1])
def test_margins_have_derivatives_at_the_ends_of_the_ranges(end: int) -> None:
    x = AT[:-1]
    wide = CONTINUOUS[:-1]
    narrow = [
        replace(each, **{("low", "high")[end]: value}) for each, value in zip(wide, x, strict=True)
    ]
    bound = limit("stiffness")
    found = [
        rows_and_gradients(
            problem(
                variables=variables,
                postures=BENT[3:],
                constraints=(bound,),
                tolerances=TOLERANCES,
            ),
            x,
            Measure("stiffness", "y"),
        )[1]
        for variables in (wide, narrow)
    ]
    size = np.array([(each.high or 0.0) - (each.low or 0.0) for each in wide])
    difference = abs((found[1] - found[0]) * size).max()
    assert difference < 1e-6 * abs(found[0] * size).max()


def test_at_a_straight_hole_the_derivative_is_the_mean_of_both_sides() -> None:
    task = problem(
        arm=small_arm(friction=0.2),
        variables=(cdsm.Variable("hole_radius", 0.012, 0.04, at=2),),
        postures=np.zeros((1, 6)),
        worst_friction=True,
    )
    measure, x = Measure("motor_force"), np.array([0.02])
    values, slopes = rows_and_gradients(task, x, measure)
    h = 1e-6
    after, before = (rows_and_gradients(task, x + sign * h, measure)[0] for sign in (1.0, -1.0))
    sides = np.array([after - values, values - before]) / h
    kinks = abs(sides[0] - sides[1])
    assert kinks.max() > 100.0  # [N/m]: the largest tension changes by 1000 N/m
    np.testing.assert_allclose(slopes[:, 0], sides.mean(axis=0), atol=1e-3 * kinks.max())


def test_holes_keep_their_friction_in_every_design() -> None:
    arm = rough(small_arm(friction=0.0))
    more = problem(arm=arm, variables=(cdsm.Variable("end", 1, 3, at="cable2_1"),))
    for end in (1, 2, 3):
        made = more.arm_of([float(end)])
        for old, new in zip(arm.cables, made.cables, strict=True):
            count = min(len(old.friction), len(new.friction))
            assert new.friction[:count] == old.friction[:count]
            # a hole that the cable did not pass before is as its last one
            assert set(new.friction[count:]) <= {old.friction[-1]}
    even = problem(
        arm=small_arm(friction=(0.1, 0.2, 0.3)),
        variables=(cdsm.Variable("cables_per_joint", 3, 5),),
    )
    assert [c.friction[0] for c in even.arm_of([4.0]).cables] == 4 * [0.1] + 4 * [0.2] + 4 * [0.3]
