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
    RISING,
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


CASES = {
    "strand-0": (0, STRAND, 20.0, 300.0),
    "strand-2": (2, STRAND, 40.0, 200.0),
    "strand-3": (3, STRAND, 20.0, 300.0),
    "linear-4": (4, cdsm.LinearElasticity(5e3), 20.0, 300.0),
    "linear-5": (5, cdsm.LinearElasticity(50e3), 5.0, 400.0),
}


@pytest.mark.parametrize("moment", [False, True])
@pytest.mark.parametrize("case", CASES)
def test_brute_force_beats_neither_end_and_comes_near_both(case: str, moment: bool) -> None:
    seed, law, low, high = CASES[case]
    arm = arms.random_arm(seed, 3, "hinged", law)
    pose = arms.random_posture(arm, seed, reach=0.4)
    assert len(arm.cables) - arm.nv == 3
    wrench = 0.3 * arms.random_wrench(seed, moment)
    u = np.random.default_rng(seed).normal(size=3)
    found = cdsm.stiffness_range(pose, u, low, high, wrench)
    lowest, highest = brute_force(pose, u, low, high, wrench, found.floor)
    assert found.low * (1.0 - 1e-9) <= lowest <= found.low * 1.01
    assert found.high * 0.99 <= highest <= found.high * (1.0 + 1e-9)
    for end, pull in ((found.low, found.low_tension), (found.high, found.high_tension)):
        K = cdsm.stiffness(pose, pull)
        assert K.along(found.direction) == end  # the direction that was asked for, at length 1
        assert K.margin >= found.floor * (1.0 - 1e-9)
        assert abs(pull.residual).max() < 1e-12 * high
        assert (pull.values >= low).all()
        assert (pull.values <= high).all()
        np.testing.assert_array_equal(pull.wrench, wrench)


def test_where_tension_buckles_the_arm_brute_force_along_rays_beats_neither_end() -> None:
    """The softest tensions lie where λ_min is just what stability asks for."""
    arm = arms.random_arm(0, 3, "hinged", cdsm.LinearElasticity(5e3))
    pose = arms.random_posture(arm, 0, reach=0.4)
    low, high = 20.0, 300.0
    u = np.random.default_rng(0).normal(size=3)
    found = cdsm.stiffness_range(pose, u, low, high)
    assert cdsm.stiffness(pose, found.low_tension).margin == pytest.approx(found.floor, rel=1e-9)
    ends = corners(pose, low, high, np.zeros(6))
    start = cdsm.distribute_tension(pose, low).values
    K = cdsm.stiffness(pose, start)
    assert found.floor == pytest.approx(0.01 * K.margin, rel=1e-12)
    # K_θ is affine in F, so a ray leaves the stable tensions once: where λ_min is the floor
    values, softest = [K.along(u)], start

    def judge(end: Array) -> None:
        nonlocal softest
        rate = cdsm.stiffness(pose, end).joint - K.joint
        way = np.where(end == start, 1e-300, end - start)
        a, b = 0.0, float(np.where(way > 0.0, (high - start) / way, (low - start) / way).min())
        for _ in range(40):
            middle = (a + b) / 2.0
            stable = np.linalg.eigvalsh(K.joint + middle * rate)[0] >= found.floor
            a, b = (middle, b) if stable else (a, middle)
        values.append(cdsm.stiffness(pose, start + a * (end - start)).along(u))
        softest = end if values[-1] == min(values) else softest

    rng = np.random.default_rng(2)
    for reach in (1.0, 0.3, 0.1, 0.03, 0.01, 0.003):
        centre = softest
        for end in rng.dirichlet(np.full(len(ends), 0.3), 100) @ ends:
            judge(centre + reach * (end - centre))
    assert found.low * (1.0 - 1e-9) <= min(values) <= 1.01 * found.low
    assert found.high * 0.99 <= max(values) <= found.high * (1.0 + 1e-9)


# --- one hinge: the null space is a line ----------------------------------------------------


def straight(F: float) -> float:
    """along(z) of the straight soft hinge, both cables at F: K over the lever squared."""
    return soft(F) / LENGTH**2


def test_hinge_has_its_closed_form_at_both_ends() -> None:
    found = cdsm.stiffness_range(soft_hinge().at([0.0]), DOWN, 10.0, 70.0)
    assert found.low == pytest.approx(straight(70.0), rel=1e-12)
    assert found.high == pytest.approx(straight(10.0), rel=1e-12)
    np.testing.assert_allclose(found.low_tension.values, 70.0, rtol=1e-12)
    np.testing.assert_allclose(found.high_tension.values, 10.0, rtol=1e-12)
    assert straight(40.0) in found
    assert straight(71.0) not in found


def test_hinge_without_a_lead_has_its_ends_the_other_way_round() -> None:
    """K = 2 k R² − F h, with k = (EA + F)/2h: R²/h is more than h, so that tension stiffens."""
    found = cdsm.stiffness_range(hinge().at([0.0]), DOWN, 10.0, 70.0)
    ends = [(2.0 * (EA + F) / (2.0 * H) * R**2 - F * H) / LENGTH**2 for F in (10.0, 70.0)]
    np.testing.assert_allclose([found.low, found.high], ends, rtol=1e-12)
    np.testing.assert_allclose(found.low_tension.values, 10.0, rtol=1e-12)
    np.testing.assert_allclose(found.high_tension.values, 70.0, rtol=1e-12)


def test_without_a_maximum_buckling_ends_the_range() -> None:
    """K falls with F until it is the margin's part of what it is under the least tensions."""
    found = cdsm.stiffness_range(soft_hinge().at([0.0]), DOWN, 10.0)
    assert found.high == pytest.approx(straight(10.0), rel=1e-12)
    assert found.low == pytest.approx(0.01 * straight(10.0), rel=1e-9)
    expected = BUCKLING - 0.01 * (BUCKLING - 10.0)
    np.testing.assert_allclose(found.low_tension.values, expected, rtol=1e-9)


def stayed() -> cdsm.Posture:
    """A hinge whose cables pull from beyond the tip, straight as a string: K = Σ F H + const."""
    arm = hinge()
    cables = [
        cdsm.Cable(
            f"stay{side:+.0f}",
            (
                cdsm.Site("base_link", (0.4, 0.0, 0.3 * side)),
                cdsm.Site("tool0", (0.0, 0.0, 0.01 * side)),
            ),
            cdsm.LinearElasticity(EA),
        )
        for side in (1.0, -1.0)
    ]
    return cdsm.Manipulator(arm.geometry, cables=cables, gravity=(0.0, 0.0, 0.0)).at([0.1])


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


def test_end_of_the_elasticity_bounds_the_tensions() -> None:
    arm = presets.virtual_prototype(RISING)
    pose = arm.at(np.full(arm.nv, presets.TEN_DEGREES))
    found = cdsm.stiffness_range(pose, DOWN, 50.0)
    assert found.high_tension.values.max() == pytest.approx(810.0, rel=1e-12)


def test_strand_whose_rigidity_levels_off_is_stiffest_before_its_end() -> None:
    """EA of Eq. 19, filled in, has its largest value between 400 N and 810 N."""
    places = np.linspace(400.0, 810.0, 500)
    assert 401.0 < places[STRAND.rigidity(places).argmax()] < 809.0
    arm = presets.virtual_prototype(STRAND)
    pose = arm.at(np.full(arm.nv, presets.TEN_DEGREES))
    found = cdsm.stiffness_range(pose, DOWN, 50.0)
    assert found.high_tension.values.max() < 809.0
    for bound in np.linspace(50.0, 700.0, 60):
        pull = cdsm.distribute_tension(pose, bound)
        if pull.values.max() <= 810.0:
            assert cdsm.stiffness(pose, pull).along(DOWN) < found.high


def test_range_of_an_arm_without_redundancy_is_a_point() -> None:
    """Bounds that pin one cable of each pair leave nothing to choose."""
    arm = arms.random_arm(2, 3, "hinged", STRAND)
    pose = arms.random_posture(arm, 2, reach=0.4)
    pull = cdsm.distribute_tension(pose, 60.0)
    pinned = np.array([cable.name.endswith("_1") for cable in arm.cables])
    low = np.where(pinned, pull.values, 0.0)
    high = np.where(pinned, pull.values, 800.0)
    found = cdsm.stiffness_range(pose, DOWN, low, high)
    expected = cdsm.stiffness(pose, pull).along(DOWN)
    assert found.low == pytest.approx(expected, rel=1e-9)
    assert found.high == pytest.approx(expected, rel=1e-9)
    np.testing.assert_allclose(found.high_tension.values, pull.values, rtol=1e-9)


def test_domain_of_a_force_controlled_cable_bounds_nothing() -> None:
    """Its elasticity does not matter; a tension beyond it is no fault."""
    arm = presets.experimental_prototype(gravity=(0.0, 0.0, 9.81))
    pose = arm.at(np.zeros(3))
    held = np.array([cable.control == "position" for cable in arm.cables])
    low = np.full(6, 50.0)
    low[3] = 815.0
    assert not held[3]
    found = cdsm.stiffness_range(pose, DOWN, low, 1000.0)
    for pull in (found.low_tension, found.high_tension):
        assert pull.values[held].max() <= 810.0 < 815.0 <= pull.values[3]


BAD: list[tuple[dict[str, Any], type[cdsm.CdsmError], str]] = [
    ({"direction": (0.0, 1.0)}, cdsm.InvalidInput, "direction"),
    ({"minimum": 80.0, "maximum": 70.0}, cdsm.InvalidInput, "maximum: 70 N"),
    ({"minimum": -1.0}, cdsm.InvalidInput, "minimum"),
    ({"wrench": (1.0, 2.0)}, cdsm.InvalidInput, "wrench"),
    ({"wrench": (0.0, 0.0, 1e5, 0.0, 0.0, 0.0)}, cdsm.InfeasibleTension, "balances the arm"),
    ({"minimum": 50.0, "maximum": 50.1}, cdsm.InfeasibleTension, "balances the arm"),
    ({"minimum": 1000.0, "maximum": 2e3}, cdsm.ElasticityRangeError, "lower minimum="),
    ({"maximum": 2.0}, cdsm.CdsmError, "minimum|balances"),
    ({"starts": 0}, cdsm.InvalidInput, "starts"),
    ({"pose": "here"}, cdsm.InvalidInput, "pose"),
]


@pytest.mark.parametrize(("change", "error", "message"), BAD)
def test_bad_input_is_named(
    change: dict[str, Any], error: type[cdsm.CdsmError], message: str
) -> None:
    arm = presets.virtual_prototype()
    pose = arm.at(np.full(arm.nv, 0.1))
    given = {"pose": pose, "direction": DOWN, "minimum": 50.0, "maximum": 500.0, **change}
    with pytest.raises(error, match=message):
        cdsm.stiffness_range(**given)
    if "starts" not in change:
        with pytest.raises(error, match=message):
            cdsm.plan_stiffness(**given, target=1e5)


def test_direction_in_which_the_tip_cannot_move_has_no_range() -> None:
    pose = hinge().at([0.0])
    for ask in (cdsm.stiffness_range, cdsm.saturation):
        with pytest.raises(cdsm.SingularStiffness, match="cannot move along"):
            ask(pose, (1.0, 0.0, 0.0), 10.0, 50.0)
    with pytest.raises(cdsm.SingularStiffness, match="cannot move along"):
        cdsm.plan_stiffness(pose, (1.0, 0.0, 0.0), 1e4, 10.0, 50.0)


# --- laws of which nothing is known ---------------------------------------------------------


def bump(F: Array) -> Array:
    """A rigidity that rises to 120 N and falls from there on."""
    return np.asarray(5e3 + 2e4 * np.exp(-(((F - 120.0) / 40.0) ** 2)))


BUMP = cdsm.Elasticity.from_rigidity(bump, 0.0, 500.0)


def measured_bump() -> cdsm.TabulatedElasticity:
    """The same as a table of the library."""
    F = np.array([0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0, 220.0, 300.0, 400.0, 500.0])
    EA = bump(F)
    strain = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(F) / (EA[1:] + EA[:-1]))])
    return cdsm.TabulatedElasticity(tuple(F), tuple(strain))


@pytest.mark.parametrize("law", [BUMP, measured_bump()], ids=["own", "table"])
def test_no_sample_is_stiffer_where_the_rigidity_falls_again(law: cdsm.Elasticity) -> None:
    """The stiffest tensions lie inside, and many searches stop at others."""
    pose = arms.random_posture(arms.random_arm(19, 3, "hinged", law), 19, 0.4)
    u = np.array([1.0, -0.5, 0.3])
    found = cdsm.stiffness_range(pose, u, 10.0, 400.0)
    values = []
    F = cdsm.distribute_tension(pose, 20.0, 300.0).values  # inside: no way leads out of a corner
    null = np.linalg.svd(pose.length_jacobian.T)[2][pose.arm.nv :].T
    rng = np.random.default_rng(0)
    for _ in range(800):  # hit and run
        way = null @ rng.normal(size=null.shape[1])
        with np.errstate(divide="ignore"):
            ends = np.sort([(10.0 - F) / way, (400.0 - F) / way], axis=0)
        F = np.clip(F + rng.uniform(ends[0].max(), ends[1].min()) * way, 10.0, 400.0)
        K = cdsm.stiffness(pose, F)
        if K.margin >= found.floor:
            values.append(K.along(u))
    assert len(values) > 100
    values += [  # where all cables are near the stiffest tension of the law
        cdsm.stiffness(pose, cdsm.distribute_tension(pose, bound, 400.0)).along(u)
        for bound in np.linspace(90.0, 130.0, 41)
    ]
    assert found.low * (1.0 - 1e-9) <= min(values)
    assert max(values) <= found.high * (1.0 + 1e-9)


@pytest.mark.parametrize("seed", [11, 23, 103])
def test_stiffest_tensions_of_arms_that_their_least_tensions_do_not_hold(seed: int) -> None:
    """Where λ_min limits the stiffness; the tensions of an independent program are no stiffer."""
    known = {11: 25106.119, 23: 929.280, 103: 3809.113}  # N/m
    rng = np.random.default_rng([seed, 90])
    kind = str(rng.choice(["universal", "hinged"]))
    rng.uniform()
    arm = arms.random_arm(seed, int(rng.integers(2, 6)), kind, STRAND)
    pose, u = arms.random_posture(arm, seed, 0.4), rng.normal(size=3)
    low, high = float(rng.choice([10.0, 35.0])), float(rng.choice([200.0, 500.0]))
    found = cdsm.stiffness_range(pose, u, low, high)
    assert found.high >= known[seed] * (1.0 - 1e-4)
    assert cdsm.stiffness(pose, found.high_tension).margin >= found.floor * (1.0 - 1e-9)


def test_corners_beside_the_softest_one_are_searched() -> None:
    """Tension can buckle this arm, so that it is softest at the limit of stability."""
    geometry = cdsm.Geometry.hinged(
        joints=5,
        twist=0.6,
        cables_per_joint=2,
        link_length=0.04,
        base_length=0.02,
        disk_offset=0.01,
        hole_radius=0.036,
        link_mass=0.38,
        lead=0.3,
    )
    arm = cdsm.Manipulator(geometry, elasticity=cdsm.presets.STRAND_1X19)
    pose = arm.at([0.03, 0.13, 0.06, 0.0, -0.13])
    found = cdsm.stiffness_range(pose, (-1.1, 1.5, -0.1), 10.0, 600.0)
    assert found.low == pytest.approx(713.84, rel=5e-4)  # of 200 searches, one came as low
    assert found.limited_by_stability == (True, False)
    assert "limited by stability" in str(found)
    K = cdsm.stiffness(pose, found.low_tension)
    assert K.margin == pytest.approx(found.floor, rel=1e-6)
    least = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 10.0, 600.0))
    assert found.floor == pytest.approx(0.01 * least.margin, rel=1e-12)
