"""Segments of cables and wrap angles in their holes, against places in space and differences."""

import math

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.support import foreign
from tests.support.arms import STEEL, mixed_arm, random_arm, random_posture
from tests.support.differences import assert_second_order


def weaver() -> cdsm.Manipulator:
    """The crab with cables that cross its branches to and fro, also joints that slide."""
    ways = [
        ("tail", "hand", "fin", "slider"),
        ("arm", "floor", "hand", "trunk", "tail", "floor"),
        ("floor", "fin", "fin", "slider", "slider", "tip"),
    ]
    rng = np.random.default_rng(5)
    cables = [
        cdsm.Cable(
            name=f"w{i}",
            sites=tuple(cdsm.Site(link, tuple(rng.uniform(-0.08, 0.08, 3))) for link in way),
            elasticity=STEEL,
            lead=0.1 * i,
        )
        for i, way in enumerate(ways)
    ]
    return foreign.crab().with_cables(cables)


ARMS = {
    "universal": lambda: random_posture(random_arm(3, 4), 1),
    "hinged": lambda: random_posture(random_arm(5, 5, "hinged"), 2),
    "mixed": lambda: random_posture(mixed_arm(), 3),
    "crab": lambda: foreign.crab().at(foreign.POSTURE),
    "weaver": lambda: weaver().at(foreign.POSTURE),
}


def places(pose: cdsm.Posture) -> list[Array]:
    """Points of each cable, the actuator included, placed by Pinocchio."""
    paths = []
    for cable in pose.arm.cables:
        path = []
        for i, site in enumerate(cable.sites):
            frame = pose.link_pose(site.link)
            at = frame[:3, :3] @ np.array(site.position) + frame[:3, 3]
            if i == 0 and cable.lead:
                path.append(at - cable.lead * frame[:3, 0])
            path.append(at)
        paths.append(np.array(path))
    return paths


@pytest.mark.parametrize("name", ARMS)
def test_lengths_and_wraps_are_those_of_the_places(name: str) -> None:
    pose = ARMS[name]()
    lengths, wraps = [], []
    for path in places(pose):
        steps = np.diff(path, axis=0)
        size = np.linalg.norm(steps, axis=1)
        lengths += size.tolist()
        wraps += np.arccos(np.sum(steps[1:] * steps[:-1], axis=1) / size[1:] / size[:-1]).tolist()
    found = pose.segments
    np.testing.assert_allclose(found.lengths, lengths, rtol=1e-13)
    np.testing.assert_allclose(found.wrap, wraps, atol=1e-13 / min(wraps))
    sums = np.zeros_like(pose.length_jacobian)
    np.add.at(sums, found.chains.cable, found.length_jacobian)
    np.testing.assert_allclose(sums, pose.length_jacobian, atol=1e-15)


@pytest.mark.parametrize("name", ARMS)
def test_gradients_are_those_of_differences(name: str) -> None:
    pose = ARMS[name]()

    def at(q: Array) -> cdsm.Posture:
        return pose.arm.at(q, check_limits=False)

    found = pose.segments
    assert_second_order(lambda q: at(q).segments.lengths, found.length_jacobian, pose.q)
    # a hinge bends its cables in a plane, and the angle is linear: rounding of u × v is left
    assert_second_order(lambda q: at(q).segments.wrap, found.wrap_jacobian, pose.q, size=10.0)


def test_wrap_of_a_site_adds_to_the_angle() -> None:
    plain = mixed_arm()
    cable = plain.cables[-1]
    sites = list(cable.sites)
    sites[2] = cdsm.Site(sites[2].link, sites[2].position, 0.1, 0.25)
    arm = plain.with_cables([cdsm.Cable("a", tuple(sites), STEEL, lead=cable.lead)])
    q = random_posture(plain, 3).q
    more = arm.at(q).segments.wrap - plain.at(q).segments.wrap[-len(sites) + 1 :]
    np.testing.assert_allclose(more, np.eye(len(sites) - 1)[2] * 0.25, atol=1e-15)
    same = plain.at(q).segments.wrap_jacobian[-len(sites) + 1 :]
    np.testing.assert_array_equal(arm.at(q).segments.wrap_jacobian, same)


def test_straight_cable_has_a_kink_with_gradient_zero() -> None:
    """φ rises on both sides of the straight arm, by half the joint angle at each of its disks."""
    geometry = cdsm.Geometry.hinged(
        joints=1,
        twist=0.0,
        link_length=0.06,
        base_length=0.03,
        disk_offset=0.012,
        hole_radius=0.025,
        link_mass=0.1,
        lead=0.3,
    )
    arm = cdsm.Manipulator(geometry, STEEL)
    straight = arm.at([0.0]).segments
    np.testing.assert_array_equal(straight.wrap, 0.0)
    np.testing.assert_array_equal(straight.wrap_jacobian, 0.0)
    for angle in (1e-6, -1e-6, 0.3, -0.3):
        bent = arm.at([angle]).segments
        np.testing.assert_allclose(bent.wrap, abs(angle) / 2.0, rtol=1e-9)
        np.testing.assert_allclose(bent.wrap_jacobian, math.copysign(0.5, angle), rtol=1e-9)
