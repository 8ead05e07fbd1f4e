"""Planning of stiffness against differences, brute force and its own optimality conditions."""

import math
from itertools import combinations, product

import numpy as np
import pytest

import cdsm
from cdsm._checks import Array
from tests.arms import mixed_arm, random_posture

Z = np.array([0.0, 0.0, 1.0])


def hinged() -> cdsm.Posture:
    """Three hinges with a pair of strands each: three tensions are free."""
    arm = cdsm.Manipulator(cdsm.presets.experimental_prototype_geometry(), cdsm.presets.STRAND_1X19)
    return arm.at(np.deg2rad([-12.0, -18.0, -20.0]))


def universal(law: cdsm.Elasticity, seed: int) -> cdsm.Posture:
    arm = cdsm.Manipulator(cdsm.presets.virtual_prototype_geometry(), law)
    return random_posture(arm, seed)


LAWS = {"strand": cdsm.presets.STRAND_1X19, "linear": cdsm.LinearElasticity(48e3)}


# --- gradients ------------------------------------------------------------------------------


@pytest.mark.parametrize("law", LAWS)
def test_gradients_are_central_differences_and_converge_like_them(law: str) -> None:
    pose = universal(LAWS[law], 3)
    F = cdsm.distribute_tension(pose, 50.0).values
    gradient = cdsm.stiffness_gradient(cdsm.stiffness(pose, F))

    def differences(c: int, step: float) -> tuple[float, float, Array]:
        e = step * np.eye(F.size)[c]
        up, down = cdsm.stiffness(pose, F + e), cdsm.stiffness(pose, F - e)
        return (
            (up.along(Z) - down.along(Z)) / (2.0 * step),
            (up.margin - down.margin) / (2.0 * step),
            (up.cartesian - down.cartesian) / (2.0 * step),
        )

    along = gradient.along(Z)
    scale = abs(along).max()
    for c in (0, 4, 14):
        off = [abs(differences(c, step)[0] - along[c]) / scale for step in (2.0, 1.0)]
        assert off[1] < 1e-4
        if off[0] > 1e-7:  # else rounding is near already
            assert off[0] / off[1] == pytest.approx(4.0, rel=0.1)
        _, margin, cartesian = differences(c, 1e-2)
        assert margin == pytest.approx(gradient.margin[c], rel=1e-5, abs=1e-8)
        size = abs(gradient.cartesian).max()
        np.testing.assert_allclose(gradient.cartesian[c], cartesian, atol=1e-6 * size)


@pytest.mark.parametrize(
    "law", [*LAWS.values(), cdsm.TabulatedElasticity((0, 50, 900), (0, 2e-3, 0.02))]
)
def test_slope_of_a_rigidity_is_its_difference(law: cdsm.Elasticity) -> None:
    for F in (20.0, 40.0, 300.0, 700.0):
        h = 1e-3
        expected = float(law.rigidity(F + h) - law.rigidity(F - h)) / (2.0 * h)
        assert float(law.rigidity_slope(F)) == pytest.approx(expected, rel=1e-6, abs=1e-6)


# --- range ----------------------------------------------------------------------------------


def test_brute_force_never_beats_the_range_and_nearly_reaches_it() -> None:
    pose, low, high = hinged(), 15.0, 200.0
    found = cdsm.stiffness_range(pose, Z, low, high)
    balance = pose.length_jacobian.T
    torque = balance @ cdsm.distribute_tension(pose, low, high).values
    corners = []
    for held in combinations(range(6), 3):
        rest = [c for c in range(6) if c not in held]
        for ends in product((low, high), repeat=3):
            F = np.zeros(6)
            F[list(held)] = ends
            if np.linalg.matrix_rank(balance[:, rest]) < 3:
                continue
            F[rest] = np.linalg.solve(balance[:, rest], torque - balance @ F)
            if np.clip(F, low, high) == pytest.approx(F, abs=1e-9):
                corners.append(np.clip(F, low, high))
    # between all corners there is every admissible tension; ever nearer one corner at the end
    random = np.random.default_rng(1)
    spread = [
        random.dirichlet(np.full(len(corners), w)) for w in (0.02, 0.1, 0.5) for _ in range(1500)
    ]
    seen = []
    for F in [*corners, *(np.array(spread) @ np.array(corners))]:
        K = cdsm.stiffness(pose, F)
        if K.margin >= found.floor:
            seen.append(K.along(Z))
    assert min(seen) > found.low * (1.0 - 1e-9)
    assert max(seen) < found.high * (1.0 + 1e-9)
    assert min(seen) < found.low * 1.01
    assert max(seen) > found.high * 0.99
    for pull, value in ((found.low_tension, found.low), (found.high_tension, found.high)):
        assert cdsm.stiffness(pose, pull).along(Z) == pytest.approx(value, rel=1e-12)
        assert abs(pull.residual).max() < 1e-9


# --- plan -----------------------------------------------------------------------------------


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("seed", range(4))
def test_plan_hits_its_target_and_the_loaded_arm_agrees(law: str, seed: int) -> None:
    pose = universal(LAWS[law], seed)
    random = np.random.default_rng(seed)
    u = random.normal(size=3)
    u /= np.linalg.norm(u)
    possible = cdsm.stiffness_range(pose, u, 20.0, 300.0)
    target = possible.low + random.uniform(0.1, 0.9) * (possible.high - possible.low)
    plan = cdsm.plan_stiffness(pose, u, target, 20.0, 300.0)
    assert plan.reached
    assert cdsm.stiffness(pose, plan.tension).along(u) == pytest.approx(target, rel=1e-6)
    assert abs(plan.tension.residual).max() < 1e-9
    assert plan.tension.values.min() >= 20.0
    assert plan.tension.values.max() <= 300.0
    if law == "strand" and abs(plan.tension.values - 31.0).min() < 1e-3:
        return  # it stands where EA jumps: what a weight finds depends on which way it pulls
    weighed = cdsm.weight_test(pose, plan.tension, 1e-3 * u)
    assert weighed.stiffness == pytest.approx(target, rel=1e-4)


def test_plan_is_the_least_effort_by_the_conditions_of_optimality() -> None:
    """F + J λ + μ ∂along/∂F = 0 for cables within their bounds; bounds only push."""
    pose = universal(LAWS["strand"], 1)
    possible = cdsm.stiffness_range(pose, Z, 20.0, 300.0)
    plan = cdsm.plan_stiffness(pose, Z, 0.5 * (possible.low + possible.high), 20.0, 300.0)
    F = plan.tension.values
    slope = cdsm.stiffness_gradient(plan.stiffness).along(Z)
    columns = np.column_stack([pose.length_jacobian, slope])
    columns = columns / np.linalg.norm(columns, axis=0)
    inner = (F > 20.0 + 1e-6) & (F < 300.0 - 1e-6)
    weights, *_ = np.linalg.lstsq(columns[inner], -F[inner], rcond=None)
    left = F + columns @ weights
    assert abs(left[inner]).max() < 1e-5 * F.max()
    assert (left[F <= 20.0 + 1e-6] >= -1e-5 * F.max()).all()


def test_plan_does_not_depend_on_where_it_starts() -> None:
    pose = universal(LAWS["strand"], 2)
    possible = cdsm.stiffness_range(pose, Z, 20.0, 300.0)
    target = 0.4 * possible.low + 0.6 * possible.high
    efforts = [
        np.linalg.norm(cdsm.plan_stiffness(pose, Z, target, 20.0, 300.0, seed=seed).tension.values)
        for seed in range(3)
    ]
    np.testing.assert_allclose(efforts, efforts[0], rtol=1e-6)


def test_two_directions_at_once() -> None:
    pose = random_posture(mixed_arm(), 2)
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 40.0))
    targets = [K.along(u) for u in np.eye(3)[1:]]
    plan = cdsm.plan_stiffness(pose, np.eye(3)[1:], targets, 10.0, 200.0)
    assert plan.reached
    np.testing.assert_allclose(plan.achieved, targets, rtol=1e-6)
    assert np.linalg.norm(plan.tension.values) <= np.linalg.norm(K.tension) * (1.0 + 1e-9)


@pytest.mark.parametrize("times", [0.5, 1.5])
def test_out_of_range_is_refused_with_the_range(times: float) -> None:
    pose = universal(LAWS["strand"], 1)
    possible = cdsm.stiffness_range(pose, Z, 20.0, 300.0)
    target = times * (possible.low if times < 1.0 else possible.high)
    with pytest.raises(cdsm.UnreachableStiffness) as caught:
        cdsm.plan_stiffness(pose, Z, target, 20.0, 300.0)
    assert caught.value.target == target
    assert caught.value.low == pytest.approx(possible.low, rel=1e-6)
    assert caught.value.high == pytest.approx(possible.high, rel=1e-6)


# --- saturation -----------------------------------------------------------------------------


def test_beyond_saturation_tension_pays_less_than_the_fraction() -> None:
    pose = universal(LAWS["strand"], 5)
    found = cdsm.saturation(pose, Z, fraction=0.1)

    def slope(lower: float, step: float = 1e-3) -> float:
        up, down = (
            cdsm.stiffness(pose, cdsm.distribute_tension(pose, b)).along(Z)
            for b in (lower + step, lower - step)
        )
        return (up - down) / (2.0 * step)

    text = str(found)
    assert "pays less than 10 %" in text
    assert slope(found.bound) == pytest.approx(0.1 * found.steepest_slope, rel=1e-4)
    assert max(found.curve[:, 2]) <= found.steepest_slope * (1.0 + 1e-9)


@pytest.mark.parametrize(
    ("direction", "target"),
    [((0.0, 0.0, 0.0), 1e3), (tuple(Z), -1.0), (tuple(Z), math.nan), ((math.nan, 0, 1), 1e3)],
)
def test_bad_questions_are_refused(direction: tuple[float, ...], target: float) -> None:
    with pytest.raises(cdsm.InvalidInput):
        cdsm.plan_stiffness(hinged(), direction, target, 15.0, 200.0)


def test_bounds_that_leave_no_balance_are_infeasible() -> None:
    with pytest.raises(cdsm.InfeasibleTension):
        cdsm.stiffness_range(hinged(), Z, 15.0, 16.0, wrench=(0, 0, -50.0, 0, 0, 0))
