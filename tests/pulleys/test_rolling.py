"""Links that roll on each other: no slip, and the stiffness of their cables in closed form."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array

R = 0.005
ALPHA = np.deg2rad(30.0)
PULL = 10.0


def _arm(control: Any = "force", n: int = 1, radius: float = R, second: float | None = None) -> Any:
    """Holes on the rims at ±α from the line of centres; no gravity."""
    geometry = cdsm.Geometry.rolling(
        joints=n,
        radius=radius,
        second_radius=second,
        twist=0.0,
        link_length=0.03,
        base_length=0.01,
        disk_offset=radius * (1.0 - np.cos(ALPHA)),
        hole_radius=radius * np.sin(ALPHA),
        link_mass=0.0,
        lead=0.3,
    )
    cables = cdsm.serpentine_cables(geometry, cdsm.LinearElasticity(2e4), control=control)
    return cdsm.Manipulator(geometry, cables=cables, gravity=(0.0, 0.0, 0.0))


@pytest.mark.parametrize(("r1", "r2"), [(0.005, 0.005), (0.004, 0.01)])
def test_the_contact_does_not_slip(r1: float, r2: float) -> None:
    arm = _arm(radius=r1, second=r2)
    centre = np.array([0.01 - r1, 0.0, 0.0])
    for q in (-0.4, 0.1, 0.6):
        h = 1e-6
        before, frame, after = (
            arm.at([x], check_limits=False).link_pose("link1") for x in (q - h, q, q + h)
        )
        contact = centre + r1 * np.array([np.cos(q), 0.0, -np.sin(q)])
        material = np.linalg.inv(frame) @ np.append(contact, 1.0)
        assert np.linalg.norm(material[:3]) == pytest.approx(r2, abs=1e-15)
        assert np.linalg.norm((after - before) @ material) / (2.0 * h) < 1e-11
        turn = np.arctan2(-frame[2, 0], frame[0, 0])
        assert turn == pytest.approx(q * (1.0 + r1 / r2))


@pytest.mark.parametrize(
    ("angle", "active"), [(0.0, 0.043301270), (0.3, 0.042815044), (0.8, 0.039883111)]
)
def test_tension_straightens_a_pair_of_equal_surfaces(angle: float, active: float) -> None:
    """Per whole angle θ: K_active = F r cos α cos(θ/2) in each cable; ℓ = 2r (1 − cos(α ∓ θ/2))."""
    sides = np.array([1.0, -1.0])
    for control in ("force", "position"):
        pose = _arm(control).at([angle / 2.0], check_limits=False)
        lengths = np.sort(2.0 * R * (1.0 - np.cos(ALPHA + sides * angle / 2.0)))
        np.testing.assert_allclose(np.sort(pose.cable_lengths - 0.3), lengths, atol=1e-16)
        K = cdsm.stiffness(pose, [PULL, PULL])
        closed = PULL * R * np.cos(ALPHA) * np.cos(angle / 2.0)
        assert K.active[0, 0] / 4.0 == pytest.approx(closed, abs=1e-14)
        assert K.active[0, 0] / 4.0 == pytest.approx(active, abs=1e-9)
        cosine = 1.0 - (pose.cable_lengths - 0.3) / (2.0 * R)
        passive = K.cable_stiffness @ (R**2 * (1.0 - cosine**2))
        assert K.passive[0, 0] / 4.0 == pytest.approx(passive, rel=1e-12)


def test_the_active_term_of_unequal_surfaces_is_the_derivative_of_the_torque() -> None:
    arm = _arm(radius=0.004, second=0.01)
    F = np.array([PULL, 1.5 * PULL])
    q, errors = 0.2, []

    def torque(x: float) -> Array:
        return arm.at([x]).length_jacobian.T @ F

    K = cdsm.stiffness(arm.at([q]), F).active[0, 0]
    for h in (1e-2, 5e-3):
        errors.append(abs((torque(q + h) - torque(q - h))[0] / (2.0 * h) - K))
    assert 1.9 < np.log2(errors[0] / errors[1]) < 2.1


def test_every_joint_of_a_chain_is_stiffened_alike() -> None:
    arm = _arm(n=10)
    K = cdsm.stiffness(arm.at(np.zeros(10)), np.full(20, PULL))
    # the cables of joint k also run over all joints before it
    expected = PULL * R * np.cos(ALPHA) * np.arange(10, 0, -1)
    np.testing.assert_allclose(np.diag(K.active) / 4.0, expected, rtol=1e-12)
    np.testing.assert_allclose(K.active, np.diag(np.diag(K.active)), atol=1e-15)


def test_masses_are_at_mid_link_and_limits_where_disks_touch() -> None:
    geometry = cdsm.Geometry.rolling(
        joints=2,
        radius=0.01,
        link_length=0.04,
        base_length=0.02,
        disk_offset=0.002,
        hole_radius=0.008,
        disk_radius=0.012,
        link_mass=0.1,
    )
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(2e4))
    assert arm.length == pytest.approx(0.1)
    energy = arm.body.potential_energy(np.zeros(2))
    straight = arm.at([0.0, 0.0])
    assert straight.tip[0, 3] == pytest.approx(0.1, abs=1e-15)
    # hinge 1 at the centre of the first surface, 10 mm before the contact at 20 mm
    lever = (0.04 - 0.01) * 0.1 + (0.08 - 0.01) * 0.1
    slope = (arm.body.potential_energy(np.array([1e-6, 0.0])) - energy) / 1e-6
    follower = (0.04 - 0.03) * 0.1 + (0.08 - 0.03) * 0.1  # about the second centre, at 30 mm
    assert slope == pytest.approx(-9.81 * (lever + follower), rel=1e-3)
    q = arm.upper[0]
    angle = np.arctan2(0.012, 0.008) - np.arccos(0.01 / np.hypot(0.012, 0.008))
    assert q == pytest.approx(angle)


def test_files_keep_rolling_arms(tmp_path: Path) -> None:
    arm = _arm(n=3, second=0.008)
    assert cdsm.Manipulator.read(arm.write(tmp_path / "ARM.toml")) == arm
    file = tmp_path / "short.toml"
    file.write_text(
        "wire = 2e4\n[rolling]\njoints = 2\nradius = 0.005\nlink_length = 0.03\n"
        "base_length = 0.01\ndisk_offset = 0.001\nhole_radius = 0.003\nlink_mass = 0.01\n",
        encoding="utf-8",
    )
    read = cdsm.Manipulator.read(file)
    assert [joint.rolls for joint in read.geometry.joints] == [(0.005, 0.005)] * 2
    cdsm.write_urdf(read.geometry, tmp_path / "arm.urdf")


@pytest.mark.parametrize("radius", [0.0, -0.005])
def test_hollow_surfaces_are_refused(radius: float) -> None:
    with pytest.raises(cdsm.GeometryError, match="radius"):
        _arm(second=radius)


def test_links_that_roll_do_not_bend() -> None:
    with pytest.raises(cdsm.GeometryError, match="cannot bend"):
        cdsm.Geometry.rolling(
            joints=2,
            radius=0.005,
            link_length=0.03,
            base_length=0.01,
            disk_offset=0.001,
            hole_radius=0.003,
            link_mass=0.01,
            bending_stiffness=0.1,
        )
