"""First-order bands of rest, against linear programs and load histories of the simulator."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

import cdsm
from cdsm.support.values import Array
from tests.support import arms
from tests.support.locked import hinge
from tests.support.rough import rough

EA = 48e3
LAW = cdsm.LinearElasticity(EA)
Posed = tuple[cdsm.Posture, Array]


def prototype(friction: float) -> Posed:
    pose, pull = arms.prototype(LAW, lead=0.3, friction=friction)
    return pose, pull.values


def two_hinges(friction: float) -> Posed:
    sizes = {"link_length": 0.06, "disk_offset": 0.012, "hole_radius": 0.025, "lead": 0.3}
    arm = hinge(joints=2, law=LAW, spread=0.02, friction=friction, **sizes)
    pose = arm.at(np.deg2rad([15.0, 15.0]))
    return pose, cdsm.distribute_tension(pose, 50.0).values


def unequal(friction: float) -> Posed:
    arm = rough(arms.random_arm(5, 2, "universal", LAW), friction)
    pose = arm.at(0.5 * arm.upper * np.array([1.0, -0.7, 0.6, 0.9]))
    return pose, cdsm.distribute_tension(pose, 30.0).values


def forced(friction: float) -> Posed:
    pose, F = unequal(friction)
    cables = [replace(c, control="force") if i % 2 else c for i, c in enumerate(pose.arm.cables)]
    return pose.arm.with_cables(cables).at(pose.q), F


def linear_program(pose: cdsm.Posture, F: Array, u: Array) -> float:
    """Largest u·J δ over all δ and all tensions that balance, keep the wire and obey Coulomb."""
    K, segments = cdsm.stiffness(pose, F), pose.segments
    cable, hole = segments.chains.cable, segments.chains.hole
    T, nv, size = F[cable], pose.q.size, len(cable)
    k = (EA + T) / segments.lengths
    rows = [np.hstack([K.active + K.gravity + K.load, segments.length_jacobian.T])]
    for c, each in enumerate(pose.arm.cables):
        of = cable == c
        if each.control == "force":
            first = np.arange(size) == of.argmax()
            rows.append(np.append(np.zeros(nv), first)[None])
        else:
            rows.append(
                np.append(1e3 * segments.length_jacobian[of].sum(axis=0), -1e3 * of / k)[None]
            )
    equations = np.vstack(rows)
    cone = np.zeros((len(hole), nv + size))
    cone[np.arange(len(hole)), nv + hole + 1] = 100.0 / T[hole]
    cone[np.arange(len(hole)), nv + hole] = -100.0 / T[hole]
    found = linprog(
        -1e3 * np.append(u @ pose.jacobian[:3], np.zeros(size)),
        A_ub=np.vstack([cone, -cone]),
        b_ub=np.tile(100.0 * segments.grip, 2),
        A_eq=equations,
        b_eq=np.zeros(len(equations)),
        bounds=(None, None),
    )
    return float(-found.fun / 1e3)


@pytest.mark.parametrize("posed", [prototype, two_hinges, unequal, forced])
@pytest.mark.parametrize("direction", ["x", "z"])
def test_closed_form_is_the_optimum_of_a_linear_program(
    posed: Callable[[float], Posed], direction: str
) -> None:
    pose, F = posed(0.1)
    found = cdsm.rest_band(pose, F, direction)
    assert found.high == pytest.approx(linear_program(pose, F, found.direction), rel=1e-6)
    assert found.low == -found.high


def farthest(posed: Posed, largest: float, seeds: range) -> float:
    """Pull an arm to and fro at random, let go, and return how far of the band the tip rests."""
    pose, F = posed
    half = np.array([cdsm.rest_band(pose, F, axis).half_width for axis in "xyz"])
    far = 0.0
    for seed in seeds:
        rng = np.random.default_rng([seed, 77])
        pulls = rng.normal(size=(int(rng.integers(1, 4)), 3))
        pulls /= np.linalg.norm(pulls, axis=1, keepdims=True)
        wrenches = np.zeros((len(pulls) + 1, 6))
        wrenches[:-1, :3] = pulls * rng.uniform(0.1, 1.0, (len(pulls), 1)) * largest
        moved = abs(cdsm.load_cycle(pose, F, wrenches).displacement[-1])
        far = max(far, float((moved[half > 0.0] / half[half > 0.0]).max()))
    return far


def test_histories_stay_within_the_band() -> None:
    assert 0.6 < farthest(two_hinges(0.1), 12.0, range(12)) < 1.02


@pytest.mark.long
@pytest.mark.parametrize(("friction", "limit", "beyond"), [(0.1, 1.02, 0.0), (0.2, 1.1, 0.01)])
def test_random_arms_stay_within_the_band(friction: float, limit: float, beyond: float) -> None:
    far = []
    for seed in range(40):
        plain = arms.random_arm(seed, 1 + seed % 3, ("universal", "hinged")[seed % 2], LAW)
        pose = arms.random_posture(rough(plain, friction), seed, 0.5)
        pull = cdsm.distribute_tension(pose, 50.0)
        bands = [cdsm.rest_band(pose, pull, axis) for axis in "xyz"]
        if cdsm.stiffness(pose, pull).is_stable and not any(each.warnings for each in bands):
            largest = 15.0 * max(each.breakaway for each in bands if each.breakaway < 1e6)
            far += [farthest((pose, pull.values), largest, range(k, k + 1)) for k in range(12)]
    assert len(far) > 300
    assert np.mean(np.array(far) > limit) <= beyond


def test_band_near_buckling_warns() -> None:
    geometry = arms.readme_geometry(friction=0.1)
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(1000.0))
    pose = arm.at(np.full(arm.nv, 0.1))
    critical = cdsm.critical_tension(pose).minimum
    near = cdsm.rest_band(pose, cdsm.distribute_tension(pose, 0.99 * critical), "z")
    assert near.warnings[0].startswith("FAR TOO WIDE")


def test_without_friction_there_is_one_rest() -> None:
    pose, F = prototype(0.0)
    band = cdsm.rest_band(pose, F, "z")
    assert band.low == band.high == band.breakaway == 0.0


@pytest.mark.parametrize(
    ("friction", "expected"), [(0.1, (0.081, 0.080, 0.082)), (0.2, (0.162, 0.160, 0.165))]
)
def test_numbers_of_the_virtual_prototype(friction: float, expected: Array) -> None:
    """Half-widths [mm] of an independent program."""
    found = [1e3 * cdsm.rest_band(*prototype(friction), axis).high for axis in "xyz"]
    np.testing.assert_allclose(found, expected, atol=6e-4)
