"""Bands of rest, against dense linear programs and against load histories of the simulator."""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

import cdsm
from cdsm import presets
from cdsm.friction.neighbourhood import Neighbourhood
from cdsm.friction.remainders import Bends
from cdsm.friction.rest_states import RestStates
from cdsm.support.values import Array
from tests.campaigns import histories as histories_of
from tests.support import arms
from tests.support.rough import rough

LAW = cdsm.LinearElasticity(48e3)


def prototype(friction: float, lead: float = 0.3) -> tuple[cdsm.Posture, cdsm.Tension]:
    arm = presets.virtual_prototype(LAW, lead=lead, friction=friction)
    pose = arm.at(np.full(10, np.deg2rad(10.0)))
    return pose, cdsm.distribute_tension(pose, 50.0)


def small(friction: float) -> tuple[cdsm.Posture, Array]:
    """A bent arm of two joints with unequal tensions."""
    arm = rough(arms.random_arm(5, 2, "universal", cdsm.LinearElasticity(2e4)), friction)
    pose = arm.at(0.5 * arm.upper * np.array([1.0, -0.7, 0.6, 0.9]))
    return pose, cdsm.distribute_tension(pose, 30.0).values


def dense_program(pose: cdsm.Posture, F: Array, u: Array) -> float:
    """Largest u·J δ over the first-order polyhedron, all tensions free, without a neighbourhood."""
    K = cdsm.stiffness(pose, F)
    segments = pose.segments
    cable, hole = segments.chains.cable, segments.chains.hole
    T, nv, size = F[cable], pose.q.size, len(cable)
    k = 48e3 * (1.0 + T / 48e3) / segments.lengths
    wires = [cable == c for c in range(len(F))]
    balance = np.hstack([K.active + K.gravity + K.load, segments.length_jacobian.T])
    wire = [np.concatenate([segments.length_jacobian[of].sum(axis=0), -(of / k)]) for of in wires]
    grip = segments.chains.friction * segments.wrap
    turn = segments.chains.friction[:, None] * segments.wrap_jacobian
    cone = np.zeros((2 * len(hole), nv + size))
    for i, h in enumerate(hole):
        for row, sign in ((i, 1.0), (i + len(hole), -1.0)):
            cone[row, nv + h + 1], cone[row, nv + h] = sign / T[h], -sign / T[h]
            cone[row, :nv] = -turn[i]
    found = linprog(
        -1e3 * np.append(u @ pose.jacobian[:3], np.zeros(size)),
        A_ub=cone * 1e2,
        b_ub=np.tile(grip, 2) * 1e2,
        A_eq=np.vstack([balance, 1e3 * np.array(wire)]),
        b_eq=np.zeros(nv + len(F)),
        bounds=(None, None),
    )
    return float(-found.fun / 1e3)


@pytest.mark.parametrize("direction", ["x", "y", "z"])
def test_first_order_is_that_of_a_dense_program(direction: str) -> None:
    """The closed form has wrap angles that stay; their change is of second order in μ."""
    pose, pull = prototype(0.1)
    found = cdsm.rest_band(pose, pull, direction)
    program = dense_program(pose, pull.values, found.direction)
    assert found.first_order == pytest.approx(program, rel=0.01)
    off = []
    for friction in (0.1, 0.05, 0.025):
        pose, pull = prototype(friction)
        closed = cdsm.rest_band(pose, pull, direction).first_order
        off.append(dense_program(pose, pull.values, found.direction) / closed - 1.0)
    assert abs(off[2]) < 0.6 * abs(off[1]) < 0.36 * abs(off[0])


@pytest.mark.parametrize(
    ("friction", "expected"), [(0.1, (0.081, 0.080, 0.082)), (0.2, (0.162, 0.160, 0.165))]
)
def test_numbers_of_the_virtual_prototype(friction: float, expected: Array) -> None:
    """Half-widths [mm] of an independent program, to first order; what is proved is wider."""
    pose, pull = prototype(friction)
    for axis, half in zip("xyz", expected, strict=True):
        found = cdsm.rest_band(pose, pull, axis)
        assert 1e3 * found.first_order == pytest.approx(half, abs=6e-4)
        for end in (-found.low, found.high):
            assert found.first_order < end < (1.08 if friction == 0.1 else 1.26) * found.first_order


def test_outer_correction_vanishes_with_friction() -> None:
    """It is of second order, but for the cells of the law: its part falls nearly as μ does."""
    off = []
    for friction in (0.04, 0.02, 0.01):
        pose, pull = prototype(friction)
        found = cdsm.rest_band(pose, pull, "z")
        off.append((found.high - found.low) / (2.0 * found.first_order) - 1.0)
    assert 0.0 < off[2] < 0.6 * off[1] < 0.36 * off[0] < 0.03


def histories(seeds: range, friction: float = 0.1) -> float:
    """Pull the arm to and fro at random, let go, and return how far of the band it was seen."""
    pose, pull = prototype(friction)
    bands = [cdsm.rest_band(pose, pull, axis) for axis in "xyz"]
    assert all(band.proved for band in bands)
    low = np.array([band.low for band in bands])
    high = np.array([band.high for band in bands])
    farthest = 0.0
    for seed in seeds:
        rng = np.random.default_rng([seed, 77])
        pulls = rng.normal(size=(int(rng.integers(1, 4)), 3))
        pulls *= rng.uniform(5.0, 60.0, len(pulls))[:, None] / np.linalg.norm(
            pulls, axis=1, keepdims=True
        )
        wrenches = np.zeros((len(pulls) + 1, 6))
        wrenches[:-1, :3] = pulls
        history = cdsm.load_cycle(pose, pull, wrenches)
        moved = history.tip[-1] - pose.tip[:3, 3]
        assert (low <= moved).all(), seed
        assert (moved <= high).all(), seed
        farthest = max(farthest, float(np.maximum(moved / high, moved / low).max()))
    return farthest


@pytest.mark.slow
def test_no_history_leaves_the_band() -> None:
    assert 0.2 < histories(range(4)) <= 1.0


@pytest.mark.long
@pytest.mark.parametrize("part", range(10))
def test_no_history_leaves_the_band_ten_thousand(part: int) -> None:
    assert histories(range(1000 * part, 1000 * (part + 1))) > 0.6


@pytest.mark.slow
def test_tensions_of_histories_stay_in_their_bands() -> None:
    pose, F = small(0.2)
    band = cdsm.rest_band(pose, F, "z")
    segments, ends = band.tensions, band.end_tensions
    start = pose.segments.chains.start
    np.testing.assert_allclose(ends, segments[start[1:] - 1], rtol=1e-7)
    rng, seen = np.random.default_rng(3), [np.inf, -np.inf]
    for _ in range(8):
        wrenches = np.zeros((3, 6))
        wrenches[:2, :3] = rng.normal(size=(2, 3)) * 10.0
        history = cdsm.load_cycle(pose, F, wrenches)
        T, moved = history.segment_tensions[-1], history.tip[-1] - pose.tip[:3, 3]
        assert (segments[:, 0] <= T).all()
        assert (segments[:, 1] >= T).all()
        assert band.low <= moved[2] <= band.high
        seen = [min(seen[0], float(moved[2])), max(seen[1], float(moved[2]))]
    assert seen[1] - seen[0] > 0.3 * (band.high - band.low)


def test_loads_of_the_reference_are_those_of_a_capstan() -> None:
    """A hinge with one cable on each side: the torque that friction holds, in closed form."""
    geometry = cdsm.Geometry.hinged(
        joints=1, twist=0.0, link_length=0.06, base_length=0.03, disk_offset=0.012,
        hole_radius=0.025, link_mass=0.0, lead=0.3, friction=0.3,
    )  # fmt: skip
    arm = cdsm.Manipulator(geometry, LAW, gravity=(0.0, 0.0, 0.0))
    pose = arm.at([0.3])
    pull = cdsm.distribute_tension(pose, 40.0)
    band = cdsm.rest_band(pose, pull, "z")
    segments = pose.segments
    grip = 0.3 * segments.wrap
    # lead and segment share the wire: l_1 ε_1 + l_2 ε_2 is kept, and their ratio is at its bound
    parts = []
    for c, F in enumerate(pull.values):
        l1, l2 = segments.lengths[2 * c : 2 * c + 2]
        both = (l1 + l2) / (1.0 + F / 48e3)
        sides = []
        for ratio in (math.exp(grip[c]), math.exp(-grip[c])):
            # l1/(1 + T/EA) + l2/(1 + r T/EA) = both: a quadratic equation in T/EA
            roots = np.roots([both * ratio, both * (1.0 + ratio) - l1 * ratio - l2, both - l1 - l2])
            sides.append(48e3 * ratio * float(roots.max()) - F)
        parts.append(sides)
    g = segments.length_jacobian[1::2, 0]
    torque = sum(max(a * side[0], a * side[1]) for a, side in zip(g, parts, strict=True))
    lever = float(pose.jacobian[2, 0])
    assert band.loads.max() == pytest.approx(abs(torque / lever), rel=5e-3)
    assert band.loads.max() >= abs(torque / lever)


def test_force_controlled_cables_keep_their_tension_at_the_motor() -> None:
    arm = presets.experimental_prototype(LAW, friction=0.1)
    pose = arm.at(np.deg2rad([10.0, -8.0, 12.0]))
    F = cdsm.distribute_tension(pose, 40.0).values
    band = cdsm.rest_band(pose, F, "y")
    first = band.tensions[pose.segments.chains.start[:-1]]
    np.testing.assert_allclose(first[1::2], F[1::2, None] * np.ones(2), rtol=1e-9)
    assert (first[::2, 0] < F[::2]).all()
    assert band.first_order < band.high < 1.5 * band.first_order


@pytest.mark.slow
def test_an_adversary_comes_near_the_ends_of_the_band() -> None:
    """Who chooses loads and motor commands gets farther than chance, and never beyond."""
    outside, far = histories_of.adversary(*histories_of.two_hinges(0.2), 12.0, 120)
    assert not outside
    assert 0.7 < far <= 1.0


def test_much_friction_is_proved_too() -> None:
    """Ratios of tensions are exponential: a neighbourhood must hold rises of expm1(Σ μ φ)."""
    for friction in (0.25, 0.3):
        band = cdsm.rest_band(*prototype(friction), "z")
        assert band.proved
        assert band.first_order < band.high < 1.7 * band.first_order
    strand = presets.virtual_prototype(lead=0.3, friction=0.1).at(np.full(10, np.deg2rad(10.0)))
    assert cdsm.rest_band(strand, cdsm.distribute_tension(strand, 50.0), "z").proved


@pytest.mark.parametrize(
    ("friction", "bound"), [(0.1, 30.0), (0.1, 80.0), (0.05, 15.0), (0.05, 120.0)]
)
def test_bands_are_proved_while_friction_turns_joints_by_less_than_a_degree(
    friction: float, bound: float
) -> None:
    arm = presets.virtual_prototype(lead=0.3, friction=friction)
    pose = arm.at(np.full(10, presets.TEN_DEGREES))
    pull = cdsm.distribute_tension(pose, bound)
    band = cdsm.rest_band(pose, pull, "z")
    assert band.proved
    assert band.first_order < min(-band.low, band.high)
    assert max(-band.low, band.high) < 2.0 * band.first_order
    turned = Neighbourhood(cdsm.stiffness(pose, pull), 1.0).joints.max()
    assert np.rad2deg(turned) < 0.8


def test_without_friction_there_is_one_rest() -> None:
    pose, pull = prototype(0.0)
    band = cdsm.rest_band(pose, pull, "z")
    assert (band.low, band.high, band.first_order) == (0.0, 0.0, 0.0)
    F = pull.values[pose.segments.chains.cable]
    np.testing.assert_array_equal(band.tensions, np.c_[F, F])
    np.testing.assert_array_equal(band.loads, 0.0)
    assert str(band) == "at rest from 0 to 0 mm along (0, 0, 1), whatever came before"


def test_bounds_are_proved_by_the_multipliers_alone() -> None:
    """Weak duality: the bound of any multipliers is at least the optimum."""
    pose, pull = prototype(0.1)
    K = cdsm.stiffness(pose, pull)
    states = RestStates(K, Neighbourhood(K, 1.25), Bends(K))
    for u in np.eye(3):
        end = states.displacement(u)
        assert end.bound > end.value > 0.0


def test_bad_input_is_named() -> None:
    pose, pull = prototype(0.1)
    with pytest.raises(cdsm.InvalidInput, match="direction"):
        cdsm.rest_band(pose, pull, (0.0, 0.0, 0.0))
    with pytest.raises(cdsm.InvalidInput, match="tension: shape"):
        cdsm.rest_band(pose, pull.values[1:], "z")


@pytest.mark.parametrize("bound", [5.0, 120.0])
def test_what_is_not_proved_says_so(bound: float) -> None:
    """Eq. 19 bends too much for two lines: the band is that to first order, and named so."""
    strand = presets.virtual_prototype(lead=0.3, friction=0.1).at(np.full(10, np.deg2rad(10.0)))
    band = cdsm.rest_band(strand, cdsm.distribute_tension(strand, bound), "z")
    assert not band.proved
    assert band.high == -band.low == band.first_order
    assert str(band).endswith("(to first order, not proved)")
    assert cdsm.rest_band(*prototype(0.1), "z").proved


@pytest.mark.parametrize("bound", [1.0, 50.0, 800.0])
def test_friction_that_may_hold_the_arm_anywhere_proves_nothing(bound: float) -> None:
    """Tensions beyond all machines, bounds that overflow and sites that meet are no errors here."""
    pose, _ = prototype(2.0)
    band = cdsm.rest_band(pose, cdsm.distribute_tension(pose, bound), "z")
    assert not band.proved
    assert band.high == -band.low == band.first_order
