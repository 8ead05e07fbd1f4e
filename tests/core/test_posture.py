"""Posture: the lines it is drawn by, and where the arm passes through itself."""

import numpy as np
import pytest

import cdsm
from cdsm.geometry.parts import Disk, overlapping
from cdsm.status import Status
from cdsm.support.values import Array
from tests.support.arms import mixed_arm, random_posture, readme_geometry


def test_bones_lead_from_the_first_joint_over_all_others_to_the_tip() -> None:
    pose = random_posture(mixed_arm(), 4)
    ends = np.array([bone[1] for bone in pose.bones])
    np.testing.assert_array_equal(ends[-1], pose.tip[:3, 3])
    for joint in pose.joint_positions[1:]:
        assert np.linalg.norm(ends - joint, axis=1).min() < 1e-15


R, HALF = 0.02, 0.05
DISKS = [Disk(link, x, 1, 0.01, R) for link in "abc" for x in (-HALF, HALF)]


def placed(x: float, y: float, z: float, axis: Array) -> Array:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    pose[:3, :3] = np.array([np.roll(axis, i) for i in range(3)]).T
    return pose


@pytest.mark.parametrize("gap", [-0.01 * R, 0.01 * R])
@pytest.mark.parametrize(
    ("offset", "towards", "axis"),
    [
        ((0.02, 2.0 * R, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)),  # side by side
        ((2.0 * HALF, 0.5 * R, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0)),  # end to end
        ((0.0, 0.0, 2.0 * R), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),  # crossed
        ((HALF + R, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),  # an end on a side
    ],
)
def test_cylinders_overlap_where_their_gap_is_negative(
    gap: float,
    offset: tuple[float, float, float],
    towards: tuple[float, float, float],
    axis: tuple[float, float, float],
) -> None:
    x, y, z = np.add(offset, gap * np.array(towards)).tolist()
    poses = {
        "a": placed(0.0, 0.0, 0.0, np.eye(3)[0]),
        "b": placed(9.0, 0.0, 0.0, np.eye(3)[0]),
        "c": placed(x, y, z, np.array(axis)),
    }
    assert overlapping(DISKS, poses) == ([("a", "c")] if gap < 0.0 else [])


def test_neighbours_are_left_to_their_joint_limits() -> None:
    poses = {link: placed(0.0, 0.0, 0.0, np.eye(3)[0]) for link in "ab"}
    assert overlapping([disk for disk in DISKS if disk.link in poses], poses) == []


def ring(degrees: float) -> cdsm.Posture:
    """Eight links of 60 mm with disks of 22 mm, bent alike in one plane."""
    sizes = {"base_length": 0.05, "hole_radius": 0.02, "link_mass": 0.05, "lead": 0.0}
    geometry = readme_geometry(joints=8, joint_limit=1.0, **sizes)
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(2e4))
    return arm.at(np.radians(degrees) * (np.arange(arm.nv) % 2 == 0))


def test_arm_that_closes_to_a_ring_passes_through_itself() -> None:
    assert ring(0.0).self_contacts == ring(40.0).self_contacts == ()
    closed = ring(50.0)
    assert closed.self_contacts == (("base_disk", "link8"),)
    assert closed.remarks == ("the arm passes through itself: base_disk and link8",)
    K = cdsm.stiffness(closed, cdsm.distribute_tension(closed, 50.0))
    assert str(K).count(closed.remarks[0]) == 1
    assert closed.remarks[0] in K.warnings
    assert Status.SELF_CONTACT in {finding.status for finding in K.verdict.findings}
    assert closed.remarks[0] in str(K.report())
    assert ring(0.0).remarks == ()
