"""Vibration: closed forms, MuJoCo's mass matrix, the motion itself, arms that do not vibrate."""

import math
from typing import Any

import mujoco
import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.support.arms import (
    STEEL,
    mixed_arm,
    random_arm,
    random_posture,
    random_wrench,
)
from tests.support.differences import assert_second_order

HINGE: dict[str, Any] = {
    "joints": 1,
    "twist": 0.0,
    "link_length": 0.05,
    "base_length": 0.02,
    "disk_offset": 0.01,
    "hole_radius": 0.03,
    "link_mass": 0.4,
}
# a solid cylinder of the hole radius about its end
INERTIA = 0.4 * (3 * 0.03**2 + 0.05**2) / 12 + 0.4 * (0.05 / 2) ** 2


def hinge(elasticity: cdsm.Elasticity = STEEL, **changes: Any) -> cdsm.Manipulator:
    gravity = changes.pop("gravity", (0.0, 0.0, -9.81))
    geometry = cdsm.Geometry.hinged(**(HINGE | changes))
    return cdsm.Manipulator(geometry, elasticity, gravity=gravity)


def balanced(arm: cdsm.Manipulator, seed: int) -> cdsm.Stiffness:
    """The stiffness of an arm that is at rest, under a force at its tip."""
    pose = random_posture(arm, seed)
    wrench = random_wrench(seed, moment=False)
    return cdsm.stiffness(pose, cdsm.distribute_tension(pose, 20.0, wrench=wrench))


def torque(K: cdsm.Stiffness, q: Array) -> Array:
    """Torque out of balance (nv,) with the motors locked, from lengths and weights alone."""
    pose = K.posture.arm.at(q, check_limits=False)
    tension = K.tension + K.cable_stiffness * (pose.cable_lengths - K.posture.cable_lengths)
    return tension @ pose.length_jacobian + pose.gravity_torque - K.wrench @ pose.jacobian


ARMS = {
    "universal": random_arm(3, 4),
    "hinged": random_arm(4, 5, "hinged"),
    "one hinge": hinge(),
    "mixed": mixed_arm(),
}


# --- the mass matrix ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ARMS)
def test_mujoco_has_the_same_mass_matrix(name: str) -> None:
    K = balanced(ARMS[name], 1)
    model = mujoco.MjModel.from_xml_string(K.posture.arm.urdf)
    data = mujoco.MjData(model)
    data.qpos[:] = K.posture.q
    mujoco.mj_forward(model, data)
    theirs = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, theirs)
    ours = cdsm.modes(K.posture, K).mass
    np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-15 * abs(theirs).max())


# --- frequencies --------------------------------------------------------------------------------


def test_frequency_of_a_hinge_with_a_rod_in_closed_form() -> None:
    arm = hinge()
    pose = arm.at([0.2])
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 30.0))
    found = cdsm.modes(pose, K)
    expected = math.sqrt(K.joint[0, 0] / INERTIA) / (2.0 * math.pi)
    assert found.frequencies == pytest.approx([expected], rel=1e-13)
    assert found.mass == pytest.approx(INERTIA, rel=1e-13)
    assert found.shapes == pytest.approx(1.0 / math.sqrt(INERTIA), rel=1e-13)
    assert found.growth_rates.shape == (0,)
    assert found.growth_shapes.shape == (1, 0)
    assert found.is_stable


def test_pendulum_swings_at_its_textbook_frequency() -> None:
    # force-controlled cables without tension add nothing: what is left is a rod that hangs
    arm = hinge(gravity=(9.81, 0.0, 0.0))
    cables = [cdsm.Cable(cable.name, cable.sites, STEEL, control="force") for cable in arm.cables]
    arm = cdsm.Manipulator(arm.geometry, cables=cables, gravity=(9.81, 0.0, 0.0))
    pose = arm.at([0.0])
    found = cdsm.modes(pose, cdsm.stiffness(pose, [0.0, 0.0]))
    expected = math.sqrt(0.4 * 9.81 * 0.025 / INERTIA) / (2.0 * math.pi)
    assert found.frequencies == pytest.approx([expected], rel=1e-13)
    # and upside down it falls over
    arm = cdsm.Manipulator(arm.geometry, cables=cables, gravity=(-9.81, 0.0, 0.0))
    pose = arm.at([0.0])
    fallen = cdsm.modes(pose, cdsm.stiffness(pose, [0.0, 0.0]))
    assert not fallen.is_stable
    assert fallen.growth_rates == pytest.approx([2.0 * math.pi * expected], rel=1e-13)
    assert fallen.frequencies.shape == (0,)
    assert fallen.shapes.shape == (1, 0)


@pytest.mark.parametrize("name", ARMS)
def test_each_shape_is_driven_back_by_omega_squared(name: str) -> None:
    # M⁻¹ torque along a shape, from lengths and weights at displaced postures: q̈ = −ω² a φ
    K = balanced(ARMS[name], 4)
    found = cdsm.modes(K.posture, K)
    assert abs(torque(K, K.posture.q)).max() < 1e-12
    assert found.frequencies.size == K.posture.arm.nv
    inverse = np.linalg.inv(found.mass)
    for frequency, shape in zip(found.frequencies, found.shapes.T, strict=True):
        size = float(abs(shape).max())  # so that a step is a step in rad
        back = (2.0 * math.pi * frequency) ** 2 * shape / size

        def acceleration(a: Array, shape: Array = shape, size: float = size) -> Array:
            return inverse @ torque(K, K.posture.q + a[0] * shape / size)

        # rounding of torques of 1 N m, over the smallest inertia
        assert_second_order(
            acceleration,
            back[:, None],
            np.zeros(1),
            step=2.0**-7,
            size=float(abs(inverse).max()),
            tolerance=1e-7,
        )


def test_modes_of_an_arm_that_buckles_grow_and_say_how_fast() -> None:
    soft = cdsm.LinearElasticity(100.0)
    arm = random_arm(3, 3, elasticity=soft)
    pose = arm.at(np.full(6, 0.05))
    K = cdsm.stiffness(pose, np.full(len(arm.cables), 2000.0))
    assert not K.is_stable
    found = cdsm.modes(pose, K)
    assert not found.is_stable
    assert found.frequencies.size + found.growth_rates.size == 6
    # Sylvester: as many grow as K_θ has negative eigenvalues
    assert found.growth_rates.size == (np.linalg.eigvalsh(K.joint) < 0.0).sum()
    assert (np.diff(found.growth_rates) < 0.0).all()
    for rate, shape in zip(found.growth_rates, found.growth_shapes.T, strict=True):
        np.testing.assert_allclose(
            K.joint @ shape,
            -(rate**2) * found.mass @ shape,
            rtol=0.0,
            atol=1e-12 * float(abs(K.joint).max() * abs(shape).max()),
        )
    assert "UNSTABLE: a deflection, most of it at joint" in str(found)
    assert f"grows by e in {1.0 / found.growth_rates[0]:.4g} s" in str(found)
    assert "UNSTABLE" in repr(found)


# --- what is refused, and what is said ----------------------------------------------------------


def test_stiffness_of_another_posture_is_refused() -> None:
    arm = random_arm(3, 3)
    K = balanced(arm, 1)
    with pytest.raises(cdsm.InvalidInput, match="stiffness: belongs to another posture or arm"):
        cdsm.modes(random_posture(arm, 2), K)
    with pytest.raises(cdsm.InvalidInput, match="stiffness: belongs to another posture or arm"):
        cdsm.modes(arm.with_gravity("-x").at(K.posture.q), K)
    with pytest.raises(cdsm.InvalidInput, match="a Stiffness is needed"):
        cdsm.modes(K.posture, K.joint)  # type: ignore[arg-type]
    with pytest.raises(cdsm.InvalidInput, match="a Posture is needed"):
        cdsm.modes(K, K)  # type: ignore[arg-type]


def massless(*masses: float, universal: bool = False) -> cdsm.Manipulator:
    """An arm of links of these masses."""
    axes = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    count = len(masses)
    geometry = cdsm.Geometry(
        name="massless",
        base_length=0.02,
        hole_radius=0.03,
        joints=tuple(
            cdsm.Joint(axes=axes if universal else axes[k % 2 : k % 2 + 1], disk_offset=0.01)
            for k in range(count)
        ),
        links=tuple(cdsm.Link(length=0.05, mass=mass) for mass in masses),
        cables=tuple(
            cdsm.CableRoute(joint=k + 1, angle=angle)
            for k in range(count)
            for angle in (0.3, 2.4, 4.5)
        ),
    )
    return cdsm.Manipulator(geometry, STEEL)


@pytest.mark.parametrize(
    ("masses", "universal"),
    [
        ((0.0, 0.0, 0.0), False),
        ((0.2, 0.2, 0.0), True),
        ((0.2, 0.2, 1e-7), True),  # less than the cross it hangs on
    ],
)
def test_motion_without_mass_is_an_error_that_names_the_joint(
    masses: tuple[float, ...], universal: bool
) -> None:
    arm = massless(*masses, universal=universal)
    pose = random_posture(arm, 1)
    K = cdsm.stiffness(pose, np.full(9, 50.0))
    with pytest.raises(cdsm.SingularStiffness, match=r"no mass.*link_mass") as caught:
        cdsm.modes(pose, K)
    direction = caught.value.direction
    assert np.linalg.norm(direction) == pytest.approx(1.0)
    assert not direction.flags.writeable
    if masses[0]:
        assert arm.joint_names[int(abs(direction).argmax())].startswith("joint3")
        assert "joint3" in str(caught.value)
