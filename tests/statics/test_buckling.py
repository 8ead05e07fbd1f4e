"""Buckling against closed forms of one hinge, and against a scan of the margin on any arm."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import cdsm
from tests.support.arms import mixed_arm, random_posture
from tests.support.locked import LENGTH, H, hinge

SPRING, RADIUS, OFFSET = 1890.0, 0.02, H


def pair(angle: float = 0.0, **changes: Any) -> cdsm.Posture:
    """One hinge about y with a pair of cables that are springs of one stiffness [N/m]."""
    arm = hinge(hole_radius=RADIUS, law=cdsm.LinearElasticity(1e12), lead=0.15, **changes)
    springs = [replace(cable, series_stiffness=SPRING) for cable in arm.cables]
    return arm.with_cables(springs).at([angle])


def margin(pose: cdsm.Posture, minimum: float) -> float:
    return cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum)).margin


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_weight_above_the_joint_lowers_it_and_below_raises_it(up: float) -> None:
    # gravity along ∓x: the link stands on its joint, or hangs from it
    mass = 2.0
    pose = pair(gravity=(-9.81 * up, 0.0, 0.0), link_mass=mass)
    expected = (2.0 * SPRING * RADIUS**2 - up * mass * 9.81 * LENGTH / 2.0) / OFFSET
    assert cdsm.critical_tension(pose).minimum == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("minimum", [5.0, 60.0])
def test_tip_force_along_the_link_buckles_it_at_its_closed_form(minimum: float) -> None:
    pose = pair()
    found = cdsm.critical_load(pose, [-2.0, 0.0, 0.0, 0.0, 0.0, 0.0], minimum)
    left = 2.0 * SPRING * RADIUS**2 - minimum * OFFSET
    assert found.limit == "buckling"
    assert 2.0 * found.factor == pytest.approx(left / LENGTH, rel=1e-9)
    pulled = cdsm.critical_load(pose, [2.0, 0.0, 0.0, 0.0, 0.0, 0.0], minimum)
    assert (pulled.factor, pulled.limit) == (math.inf, "none")
    assert pulled.factors[-1] == 10.0
    for load in (found, pulled):  # K falls by P · LENGTH
        expected = LENGTH * load.load[0] * load.factors + left
        np.testing.assert_allclose(load.margins, expected, rtol=1e-9, atol=1e-9 * left)


def test_side_load_ends_where_the_cable_can_pull_no_more() -> None:
    pose = pair()
    found = cdsm.critical_load(pose, [0.0, 0.0, -1.0, 0.0, 0.0, 0.0], 1.0, 51.0)
    # the force −z turns the hinge by the moment P·LENGTH, which one cable more of 50 N holds
    assert found.limit == "infeasible"
    assert found.factor == pytest.approx(50.0 * RADIUS / LENGTH, rel=1e-9)


def test_wire_at_the_end_of_its_elasticity_says_so() -> None:
    pose = cdsm.presets.virtual_prototype().at(np.full(10, 0.1))
    found = cdsm.critical_load(pose, [0.0, 0.0, -1.0, 0.0, 0.0, 0.0], 100.0)
    assert found.limit == "elasticity"
    assert found.tension.max() == pytest.approx(810.0, rel=1e-9)


@pytest.mark.parametrize("up_to", [1e-5, 1e-3, 2e-3])
def test_no_bound_beyond_the_end_of_the_scan_is_examined(up_to: float) -> None:
    found = cdsm.critical_tension(pair(), up_to=up_to)
    assert found.examined == (0.0, up_to)
    assert found.bounds[[0, -1]] == pytest.approx([0.0, up_to], rel=1e-12)
    assert found.stable == ((0.0, pytest.approx(up_to)),)


def soft_arms() -> list[cdsm.Posture]:
    geometries = [
        mixed_arm().geometry,
        cdsm.presets.virtual_prototype_geometry(),
        cdsm.paper.experimental_prototype_geometry(),
    ]
    poses = []
    for i, geometry in enumerate(geometries):
        cables = cdsm.serpentine_cables(geometry, cdsm.LinearElasticity(30e3), series_stiffness=4e3)
        poses.append(random_posture(cdsm.Manipulator(geometry, cables=cables), 7 + i))
    return poses


@pytest.mark.parametrize("pose", soft_arms(), ids=lambda pose: pose.arm.geometry.name)
def test_margin_changes_its_sign_there_and_nowhere_below(pose: cdsm.Posture) -> None:
    found = cdsm.critical_tension(pose)
    low = found.stable[0][0]
    assert 0.0 < found.minimum < math.inf
    # the eigenvalue is zero to rounding of the largest
    K = cdsm.stiffness(pose, found.tension)
    assert abs(K.margin) < 1e-9 * np.linalg.norm(K.joint, 2)
    below, above = (margin(pose, found.minimum * part) for part in (1.0 - 1e-6, 1.0 + 1e-6))
    assert below > 0.0 > above
    for part in np.linspace(0.01, 0.99, 50):
        assert margin(pose, low + part * (found.minimum - low)) > 0.0


def test_strand_arm_stands_between_two_tensions() -> None:
    """Eq. 19 starts at a hundredth of its rigidity: too slack below, too much tension above."""
    geometry = cdsm.paper.experimental_prototype_geometry(link_mass=0.6, lead=2.0)
    arm = cdsm.Manipulator(geometry, cdsm.presets.STRAND_1X19, gravity=(-9.81, 0.0, 0.0))
    found = cdsm.critical_tension(arm.at(np.zeros(3)))
    ((low, high),) = found.stable
    assert found.examined[0] < low < high == found.minimum < found.examined[1]
    for place, sign in ((low, 1.0), (high, -1.0)):
        assert sign * margin(found.posture, place * (1.0 + 1e-6)) > 0.0
        assert sign * margin(found.posture, place * (1.0 - 1e-6)) < 0.0


@pytest.mark.parametrize("degrees", [-40.0, 0.0, 7.0, 25.0])
def test_pair_across_a_hinge_buckles_at_its_closed_form(degrees: float) -> None:
    """Across one hinge L± = 2 h cos θ/2 ± 2 R sin θ/2, so all of K is known at any angle.

    Straight, K = 2 k R² − F h. The wire of 1e12 N takes 3e-10 of the compliance.
    """
    angle = math.radians(degrees)
    cosine, sine = math.cos(angle / 2.0), math.sin(angle / 2.0)
    slope = np.array([-OFFSET * sine - RADIUS * cosine, -OFFSET * sine + RADIUS * cosine])
    curvature = np.array([-OFFSET * cosine + RADIUS * sine, -OFFSET * cosine - RADIUS * sine]) / 2.0
    # balance: F J = 0 with the smaller tension at the bound
    ratio = np.array([abs(slope[1]), abs(slope[0])])
    ratio /= ratio.min()
    critical = SPRING * float(slope @ slope) / -float(ratio @ curvature)
    found = cdsm.critical_tension(pair(angle))
    assert found.minimum == pytest.approx(critical, rel=1e-9)
    assert found.stable == ((0.0, found.minimum),)
    np.testing.assert_allclose(found.mode, [1.0])
    assert sorted(found.tension) == pytest.approx(sorted(critical * ratio), rel=1e-9)


@pytest.mark.parametrize("pose", soft_arms(), ids=lambda pose: pose.arm.geometry.name)
def test_an_arm_with_locked_motors_leaves_its_posture_just_beyond(pose: cdsm.Posture) -> None:
    """The equilibrium knows nothing of eigenvalues: below it stays, above it goes far away."""
    found = cdsm.critical_tension(pose)
    push = np.zeros(6)
    push[:3] = 1e-4 * pose.jacobian[:3] @ found.mode
    moved = []
    for part in (0.98, 1.05):
        pull = cdsm.distribute_tension(pose, part * found.minimum)
        rest = cdsm.equilibrium(pose, pull, push)
        assert rest.stable
        moved.append(float(np.linalg.norm(rest.pose.q - pose.q)))
    assert moved[0] < 1e-2
    assert moved[1] > 20.0 * moved[0]
