"""The attainable range against brute force on small null spaces, and against closed forms."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

import cdsm
from cdsm import presets
from cdsm.support.values import Array
from tests.support import arms
from tests.support.locked import (
    BUCKLING,
    EA,
    LENGTH,
    STRAND,
    H,
    R,
    hinge,
    soft,
    soft_hinge,
)
from tests.support.paths import DOWN


def corners(pose: cdsm.Posture, low: float, high: float, wrench: Array) -> Array:
    """Every tension in balance that has as many cables at a bound as the null space dimensions."""
    A, torque = pose.length_jacobian.T, pose.jacobian.T @ wrench - pose.gravity_torque
    nv, count = A.shape
    found = []
    for free in itertools.combinations(range(count), nv):
        at = [c for c in range(count) if c not in free]
        if abs(np.linalg.det(A[:, free])) < 1e-12 * abs(A).max() ** nv:
            continue
        for sides in itertools.product((low, high), repeat=len(at)):
            F = np.empty(count)
            F[at] = sides
            F[list(free)] = np.linalg.solve(A[:, free], torque - A[:, at] @ sides)
            if (low - 1e-9 <= F).all() and (high + 1e-9 >= F).all():
                found.append(np.clip(F, low, high))
    return np.unique(np.round(found, 9), axis=0)


def brute_force(
    pose: cdsm.Posture, u: ArrayLike, low: float, high: float, wrench: Array, floor: float
) -> tuple[float, float]:
    """The extremes of ``along`` over dense samples: corners, mixtures, and ever nearer the best."""
    rng = np.random.default_rng(1)
    ends = corners(pose, low, high, wrench)
    extremes = [math.inf, -math.inf]
    places = [ends[0], ends[0]]

    def judge(F: Array) -> None:
        K = cdsm.stiffness(pose, np.clip(F, low, high), wrench)
        if K.margin >= floor:
            value = K.along(u)
            for i, sign in enumerate((1.0, -1.0)):
                if sign * value < sign * extremes[i]:
                    extremes[i], places[i] = value, F

    for F in ends:
        judge(F)
    # few shares large: along edges and faces too
    for F in rng.dirichlet(np.full(len(ends), 0.3), 1200) @ ends:
        judge(F)
    for reach in (0.3, 0.1, 0.03, 0.01):
        for i in range(2):
            centre = places[i].copy()
            for F in rng.dirichlet(np.full(len(ends), 0.3), 100) @ ends:
                judge(centre + reach * (F - centre))
    return extremes[0], extremes[1]


def bump(F: Array) -> Array:
    """A rigidity that rises to 120 N and falls from there on."""
    return np.asarray(5e3 + 2e4 * np.exp(-(((F - 120.0) / 40.0) ** 2)))


BUMP = cdsm.Elasticity.from_rigidity(bump, 0.0, 500.0)
CASES = {
    "strand-0": (0, STRAND, 20.0, 300.0),
    "strand-2": (2, STRAND, 40.0, 200.0),
    "strand-3": (3, STRAND, 20.0, 300.0),
    "linear-4": (4, cdsm.LinearElasticity(5e3), 20.0, 300.0),
    "linear-5": (5, cdsm.LinearElasticity(50e3), 5.0, 400.0),
    "bump-19": (19, BUMP, 10.0, 400.0),  # the stiffest tensions lie inside
}


@pytest.mark.parametrize("moment", [False, True])
@pytest.mark.parametrize("case", CASES)
def test_brute_force_beats_neither_end_and_comes_near_both(case: str, moment: bool) -> None:
    seed, law, low, high = CASES[case]
    arm = arms.random_arm(seed, 3, "hinged", law)
    pose = arms.random_posture(arm, seed, reach=0.4)
    assert len(arm.cables) - arm.nv == 3
    wrench, u = 0.3 * arms.random_wrench(seed, moment), np.random.default_rng(seed).normal(size=3)
    found = cdsm.stiffness_range(pose, u, low, high, wrench)
    lowest, highest = brute_force(pose, u, low, high, wrench, found.floor)
    near = 2.0 if case == "bump-19" else 1.01  # which ends where it is barely stable
    assert found.low * (1.0 - 1e-9) <= lowest <= found.low * near
    assert found.high * 0.99 <= highest <= found.high * (1.0 + 1e-9)
    for end, pull in ((found.low, found.low_tension), (found.high, found.high_tension)):
        K = cdsm.stiffness(pose, pull)
        assert K.along(found.direction) == end  # the direction that was asked for, at length 1
        assert K.margin >= found.floor * (1.0 - 1e-9)
        assert abs(pull.residual).max() < 1e-12 * high
        assert low <= pull.values.min() <= pull.values.max() <= high
        np.testing.assert_array_equal(pull.wrench, wrench)


def test_hinge_has_its_closed_form_at_both_ends() -> None:
    """Soft cables: tension softens. Without a lead k = (EA + F)/2h, and 2 k R² outweighs F h.

    Without a maximum K falls until it is a hundredth of what it is under the least tensions.
    """
    soft_end = BUCKLING - 0.01 * (BUCKLING - 10.0)
    stiff = [(2.0 * (EA + F) / (2.0 * H) * R**2 - F * H) / LENGTH**2 for F in (10.0, 70.0)]
    falling = [soft(F) / LENGTH**2 for F in (70.0, 10.0, soft_end)]
    for arm, high, ends, tensions in (
        (soft_hinge(), 70.0, falling[:2], (70.0, 10.0)),
        (hinge(), 70.0, stiff, (10.0, 70.0)),
        (soft_hinge(), math.inf, falling[:0:-1], (soft_end, 10.0)),
    ):
        found = cdsm.stiffness_range(arm.at([0.0]), DOWN, 10.0, high)
        np.testing.assert_allclose([found.low, found.high], ends, rtol=1e-9)
        for pull, F in zip((found.low_tension, found.high_tension), tensions, strict=True):
            np.testing.assert_allclose(pull.values, F, rtol=1e-9)
        assert sum(ends) / 2.0 in found
        assert 1.01 * max(ends) not in found


def stayed() -> cdsm.Posture:
    """A hinge whose cables pull from beyond the tip, straight as a string: K = Σ F H + const."""
    ways = [
        (cdsm.Site("base_link", (0.4, 0.0, 0.3 * s)), cdsm.Site("tool0", (0.0, 0.0, 0.01 * s)))
        for s in (1.0, -1.0)
    ]
    law = cdsm.LinearElasticity(EA)
    cables = [cdsm.Cable(f"stay{i}", way, law) for i, way in enumerate(ways)]
    return cdsm.Manipulator(hinge().geometry, cables=cables, gravity=(0.0, 0.0, 0.0)).at([0.1])


def test_stiffness_that_tension_raises_without_end_asks_for_a_maximum() -> None:
    pose = stayed()
    with pytest.raises(cdsm.InvalidInput, match="maximum: none given"):
        cdsm.stiffness_range(pose, DOWN, 10.0)
    found = cdsm.stiffness_range(pose, DOWN, 10.0, 1e4)
    assert found.high_tension.values.max() == pytest.approx(1e4, rel=1e-12)
    plan = cdsm.plan_stiffness(pose, DOWN, 10.0 * found.high, 10.0)
    assert plan.achieved == pytest.approx(10.0 * found.high, rel=1e-9)
    with pytest.raises(cdsm.UnreachableStiffness, match="to inf N/m"):
        cdsm.plan_stiffness(pose, DOWN, 0.9 * found.low, 10.0)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"direction": (0.0, 1.0)}, cdsm.InvalidInput, "direction"),
        ({"minimum": 80.0, "maximum": 70.0}, cdsm.InvalidInput, "maximum: 70 N"),
        ({"wrench": (0.0, 0.0, 1e5, 0.0, 0.0, 0.0)}, cdsm.InfeasibleTension, "balances the arm"),
        ({"minimum": 50.0, "maximum": 50.1}, cdsm.InfeasibleTension, "balances the arm"),
        ({"minimum": 1000.0, "maximum": 2e3}, cdsm.ElasticityRangeError, "lower minimum"),
        ({"pose": hinge().at([0.0]), "direction": "x"}, cdsm.SingularStiffness, "cannot move alo"),
    ],
)
def test_bad_input_is_named(
    change: dict[str, Any], error: type[cdsm.CdsmError], message: str
) -> None:
    pose = presets.virtual_prototype().at(np.full(10, 0.1))
    given = {"pose": pose, "direction": DOWN, "minimum": 50.0, "maximum": 500.0, **change}
    with pytest.raises(error, match=message):
        cdsm.stiffness_range(**given)
    with pytest.raises(error, match=message):
        cdsm.plan_stiffness(**given, target=1e5)
    with pytest.raises(cdsm.InvalidInput, match="starts"):
        cdsm.stiffness_range(pose, DOWN, 50.0, starts=0)


@pytest.mark.parametrize("seed", [11, 23, 103])
def test_stiffest_tensions_of_arms_that_their_least_tensions_do_not_hold(seed: int) -> None:
    """Where λ_min limits the stiffness; the tensions of an independent program are no stiffer."""
    known = {11: 25106.119, 23: 929.280, 103: 3809.113}  # N/m
    rng = np.random.default_rng([seed, 90])
    kind = str(rng.choice(["universal", "hinged"]))
    rng.uniform()
    arm = arms.random_arm(seed, int(rng.integers(2, 6)), kind, STRAND)
    joint, radius = arm.geometry.joints[0], arm.geometry.hole_radii[0]
    reach = 0.4 * 2.0 * math.atan(joint.disk_offset / radius) / arm.upper[0]
    pose, u = arms.random_posture(arm, seed, reach), rng.normal(size=3)
    low, high = float(rng.choice([10.0, 35.0])), float(rng.choice([200.0, 500.0]))
    found = cdsm.stiffness_range(pose, u, low, high)
    assert found.high >= known[seed] * (1.0 - 1e-4)
    assert cdsm.stiffness(pose, found.high_tension).margin >= found.floor * (1.0 - 1e-9)
