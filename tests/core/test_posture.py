"""Posture: the lines it is drawn by, and its agreement with Pinocchio."""

import numpy as np
import pytest

import cdsm
from tests.support.arms import mixed_arm, random_posture

POSE = random_posture(mixed_arm(), 4)


def test_cable_lengths_are_lead_and_segments_of_the_paths() -> None:
    for cable, path, length in zip(
        POSE.arm.cables, POSE.cable_paths, POSE.cable_lengths, strict=True
    ):
        assert len(path) == len(cable.sites)
        segments = np.linalg.norm(np.diff(path, axis=0), axis=1)
        assert cable.lead + segments.sum() == pytest.approx(length, rel=1e-14)


def test_sites_are_where_pinocchio_places_their_links() -> None:
    for cable, path in zip(POSE.arm.cables, POSE.cable_paths, strict=True):
        for site, point in zip(cable.sites, path, strict=True):
            expected = POSE.link_pose(site.link) @ (*site.position, 1.0)
            np.testing.assert_allclose(point, expected[:3], rtol=0.0, atol=1e-15)


def test_bones_lead_from_the_first_joint_over_all_others_to_the_tip() -> None:
    ends = np.array([bone[1] for bone in POSE.bones])
    np.testing.assert_array_equal(ends[-1], POSE.tip[:3, 3])
    for joint in POSE.joint_positions[1:]:
        assert np.linalg.norm(ends - joint, axis=1).min() < 1e-15


def test_brackets_join_each_site_to_the_nearest_point_of_its_bones() -> None:
    sites = np.vstack(POSE.cable_paths)
    assert len(POSE.brackets) == len(sites)
    bones = np.array(POSE.bones)
    along = bones[:, :1] + np.linspace(0.0, 1.0, 101)[:, None] * (bones[:, 1:] - bones[:, :1])
    for site, bracket in zip(sites, POSE.brackets, strict=True):
        np.testing.assert_array_equal(bracket[0], site)
        reach = float(np.linalg.norm(bracket[1] - site))
        assert reach >= np.linalg.norm(along.reshape(-1, 3) - site, axis=1).min() - 1e-3


def test_link_that_does_not_exist_is_named() -> None:
    with pytest.raises(cdsm.InvalidInput, match="link9"):
        POSE.link_pose("link9")


def ring(degrees: float) -> cdsm.Posture:
    """Eight links of 60 mm with disks of 22 mm, bent alike in one plane."""
    geometry = cdsm.Geometry.universal(
        joints=8,
        cables_per_joint=3,
        link_length=0.06,
        base_length=0.05,
        disk_offset=0.012,
        hole_radius=0.02,
        link_mass=0.05,
    )
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(2e4))
    return arm.at(np.radians(degrees) * (np.arange(arm.nv) % 2 == 0))


def test_arm_that_closes_to_a_ring_passes_through_itself() -> None:
    assert ring(0.0).self_contacts == ring(40.0).self_contacts == ()
    assert ring(0.0).remarks == ()
    closed = ring(50.0)
    assert closed.self_contacts == (("base_disk", "link8"),)
    assert closed.remarks == ("the arm passes through itself: base_disk and link8",)
    K = cdsm.stiffness(closed, cdsm.distribute_tension(closed, 50.0))
    assert closed.remarks[0] in str(K)
    assert closed.remarks[0] in str(K.report())
    assert "and 4 more" in ring(60.0).remarks[0]
