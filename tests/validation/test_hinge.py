"""One hinge between two disks in closed form."""

import numpy as np
import pytest

import cdsm


def one_hinge(h: float, R: float, lead: float = 0.0) -> cdsm.Geometry:
    """A hinge between two disks at ±h, with holes at ±R."""
    return cdsm.Geometry.hinged(
        joints=1,
        twist=0.0,
        link_length=0.05,
        base_length=0.03,
        disk_offset=h,
        hole_radius=R,
        link_mass=0.0,
        lead=lead,
    )


@pytest.mark.parametrize("tension", [1.0, 50.0, 400.0])
@pytest.mark.parametrize(("h", "R"), [(0.01, 0.03), (0.012, 0.025), (0.002, 0.008)])
def test_a_straight_hinge(h: float, R: float, tension: float) -> None:
    """K = 2 EA/l_0 R² − F h: two cables at ±R, and −F h/2 for each segment of 2 h."""
    geometry = one_hinge(h, R, lead=0.2)
    rigidity = 48e3
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(rigidity), gravity=(0, 0, 0))
    K = cdsm.stiffness(arm.at([0.0]), np.full(2, tension)).joint
    original = (0.2 + 2.0 * h) / (1.0 + tension / rigidity)
    expected = 2.0 * rigidity / original * R**2 - tension * h
    assert K[0, 0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("angle", [0.05, 0.3, 0.6])
def test_a_bent_hinge(angle: float) -> None:
    """ℓ² = 2 (h² + R²) − 2 (R² − h²) cos θ ∓ 4 h R sin θ, differentiated twice by hand."""
    h, R, F, rigidity = 0.012, 0.025, np.array([40.0, 90.0]), 48e3
    geometry = one_hinge(h, R)
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(rigidity), gravity=(0, 0, 0))
    pose = arm.at([angle])
    side = np.sign(pose.length_jacobian[:, 0] - pose.length_jacobian[:, 0].mean())
    length = np.sqrt(
        2 * (h**2 + R**2) - 2 * (R**2 - h**2) * np.cos(angle) + side * 4 * h * R * np.sin(angle)
    )
    first = ((R**2 - h**2) * np.sin(angle) + side * 2 * h * R * np.cos(angle)) / length
    second = ((R**2 - h**2) * np.cos(angle) - side * 2 * h * R * np.sin(angle) - first**2) / length
    np.testing.assert_allclose(pose.cable_lengths, length, rtol=1e-13)
    K = cdsm.stiffness(pose, F)
    assert K.active[0, 0] == pytest.approx(F @ second, rel=1e-12)
    k = rigidity * (1.0 + F / rigidity) / length
    assert K.passive[0, 0] == pytest.approx(k @ first**2, rel=1e-12)
