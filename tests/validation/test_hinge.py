"""One hinge between two disks in closed form."""

import numpy as np
import pytest

import cdsm


@pytest.mark.parametrize("lead", [0.0, 0.2])
@pytest.mark.parametrize("angle", [0.0, 0.05, 0.3, 0.6])
@pytest.mark.parametrize(("h", "R"), [(0.012, 0.025), (0.002, 0.008)])
def test_a_hinge_between_two_disks(h: float, R: float, angle: float, lead: float) -> None:
    """ℓ² = 2 (h² + R²) − 2 (R² − h²) cos θ ∓ 4 h R sin θ, differentiated twice by hand.

    Straight, under one tension in both cables, it is K = 2 EA/l_0 R² − F h.
    """
    F, rigidity = np.array([40.0, 90.0]), 48e3
    geometry = cdsm.Geometry.hinged(
        joints=1, twist=0.0, link_length=0.05, base_length=0.03, disk_offset=h, hole_radius=R,
        link_mass=0.0, lead=lead, joint_limit=1.0,
    )  # fmt: skip
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(rigidity), gravity=(0, 0, 0))
    pose = arm.at([angle])
    c, s = np.cos(angle), np.sin(angle)
    side = np.sign(arm.at([0.0]).length_jacobian[:, 0])
    free = np.sqrt(2 * (h**2 + R**2) - 2 * (R**2 - h**2) * c + side * 4 * h * R * s)
    first = ((R**2 - h**2) * s + side * 2 * h * R * c) / free
    second = ((R**2 - h**2) * c - side * 2 * h * R * s - first**2) / free
    np.testing.assert_allclose(pose.cable_lengths, lead + free, rtol=1e-13)
    K = cdsm.stiffness(pose, F)
    assert K.active[0, 0] == pytest.approx(F @ second, rel=1e-12)
    k = rigidity * (1.0 + F / rigidity) / (lead + free)
    assert K.passive[0, 0] == pytest.approx(k @ first**2, rel=1e-12)


@pytest.mark.parametrize("tension", [1.0, 50.0, 400.0])
def test_a_straight_hinge_softens_with_its_tension(tension: float) -> None:
    geometry = cdsm.Geometry.hinged(
        joints=1, twist=0.0, link_length=0.05, base_length=0.03, disk_offset=0.01,
        hole_radius=0.03, link_mass=0.0, lead=0.2,
    )  # fmt: skip
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(48e3), gravity=(0, 0, 0))
    expected = 2.0 * (48e3 + tension) / 0.22 * 0.03**2 - tension * 0.01
    K = cdsm.stiffness(arm.at([0.0]), np.full(2, tension)).joint
    assert K[0, 0] == pytest.approx(expected, rel=1e-12)
