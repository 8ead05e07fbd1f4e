"""Posture: the lines it is drawn by, and its agreement with Pinocchio."""

import numpy as np

import cdsm
from tests.support.arms import mixed_arm, random_posture

POSE = random_posture(mixed_arm(), 4)


def test_bones_lead_from_the_first_joint_over_all_others_to_the_tip() -> None:
    ends = np.array([bone[1] for bone in POSE.bones])
    np.testing.assert_array_equal(ends[-1], POSE.tip[:3, 3])
    for joint in POSE.joint_positions[1:]:
        assert np.linalg.norm(ends - joint, axis=1).min() < 1e-15


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
    assert "; and " in ring(61.0).remarks[0]
