"""Vibration: closed forms, MuJoCo's mass matrix, the motion itself, arms that do not vibrate."""

import math
from dataclasses import replace
from typing import Any, cast

import mujoco
import numpy as np
import pytest

import cdsm
from cdsm.statics.modes import _placeholder_matrix
from cdsm.support.values import Array
from tests.support.arms import (
    STEEL,
    mixed_arm,
    random_arm,
    random_posture,
    random_wrench,
    readme_geometry,
)
from tests.support.differences import assert_second_order
from tests.support.locked import R, hinge, unbalanced_torque
from tests.support.mujoco_arms import mass

LENGTH = 0.05
# a solid cylinder of the hole radius about its end
INERTIA = 0.4 * (3 * R**2 + LENGTH**2) / 12 + 0.4 * (LENGTH / 2) ** 2


def rod(gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)) -> cdsm.Manipulator:
    return hinge(link_length=LENGTH, link_mass=0.4, law=STEEL, gravity=gravity)


def balanced(arm: cdsm.Manipulator, seed: int) -> cdsm.Stiffness:
    """The stiffness of an arm that is at rest, under a force at its tip."""
    pose = random_posture(arm, seed)
    wrench = random_wrench(seed, moment=False)
    return cdsm.stiffness(pose, cdsm.distribute_tension(pose, 20.0, wrench=wrench))


ARMS = {
    "universal": random_arm(3, 4),
    "hinged": random_arm(4, 5, "hinged"),
    "one hinge": rod(),
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
    theirs = mass(model, data)
    ours = cdsm.modes(K).mass
    np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-15 * abs(theirs).max())


# --- frequencies --------------------------------------------------------------------------------


def test_frequency_of_a_hinge_with_a_rod_in_closed_form() -> None:
    pose = rod().at([0.2])
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 30.0))
    found = cdsm.modes(K)
    expected = math.sqrt(K.joint[0, 0] / INERTIA) / (2.0 * math.pi)
    assert found.frequencies == pytest.approx([expected], rel=1e-13)
    assert found.mass == pytest.approx(INERTIA, rel=1e-13)
    assert found.shapes == pytest.approx(1.0 / math.sqrt(INERTIA), rel=1e-13)
    assert found.growth_rates.shape == (0,)
    assert found.growth_shapes.shape == (1, 0)
    assert found.is_stable


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_pendulum_swings_at_its_textbook_frequency_and_falls_at_it_upside_down(side: float) -> None:
    # force-controlled cables without tension add nothing: what is left is a rod that hangs
    arm = rod(gravity=(side * 9.81, 0.0, 0.0))
    pose = arm.with_cables([replace(c, control="force") for c in arm.cables]).at([0.0])
    found = cdsm.modes(cdsm.stiffness(pose, [0.0, 0.0]))
    omega = math.sqrt(0.4 * 9.81 * LENGTH / 2.0 / INERTIA)
    assert found.is_stable == (side > 0.0)
    swings, grows = ([omega / math.tau], []) if side > 0.0 else ([], [omega])
    assert found.frequencies == pytest.approx(swings, rel=1e-13)
    assert found.growth_rates == pytest.approx(grows, rel=1e-13)
    assert found.shapes.shape == (1, len(swings))
    assert found.growth_shapes.shape == (1, len(grows))


@pytest.mark.parametrize("name", ARMS)
def test_each_shape_is_driven_back_by_omega_squared(name: str) -> None:
    # M⁻¹ torque along a shape, from lengths and weights at displaced postures: q̈ = −ω² a φ
    K = balanced(ARMS[name], 4)
    found, torque = cdsm.modes(K), unbalanced_torque(K)
    assert abs(torque(K.posture.q)).max() < 1e-12
    assert found.frequencies.size == K.posture.arm.nv
    inverse = np.linalg.inv(found.mass)
    for frequency, shape in zip(found.frequencies, found.shapes.T, strict=True):
        size = float(abs(shape).max())  # so that a step is a step in rad
        back = (2.0 * math.pi * frequency) ** 2 * shape / size

        def acceleration(a: Array, shape: Array = shape, size: float = size) -> Array:
            return inverse @ torque(K.posture.q + a[0] * shape / size)

        # rounding of torques of 1 N m, over the smallest inertia
        small: Any = {"step": 2.0**-7, "size": float(abs(inverse).max()), "tolerance": 1e-7}
        assert_second_order(acceleration, back[:, None], np.zeros(1), **small)


def test_modes_of_an_arm_that_buckles_grow_and_say_how_fast() -> None:
    soft = cdsm.LinearElasticity(100.0)
    arm = random_arm(3, 3, elasticity=soft)
    pose = arm.at(np.full(6, 0.05))
    K = cdsm.stiffness(pose, np.full(len(arm.cables), 2000.0))
    assert not K.is_stable
    found = cdsm.modes(K)
    assert not found.is_stable
    assert found.frequencies.size + found.growth_rates.size == 6
    # Sylvester: as many grow as K_θ has negative eigenvalues
    assert found.growth_rates.size == (np.linalg.eigvalsh(K.joint) < 0.0).sum()
    assert (np.diff(found.growth_rates) < 0.0).all()
    for rate, shape in zip(found.growth_rates, found.growth_shapes.T, strict=True):
        off = 1e-12 * float(abs(K.joint).max() * abs(shape).max())
        np.testing.assert_allclose(K.joint @ shape, -(rate**2) * found.mass @ shape, atol=off)
    assert f"grows by e in {1.0 / found.growth_rates[0]:.4g} s" in str(found)


# --- what is refused ----------------------------------------------------------------------------

K = balanced(ARMS["universal"], 1)


def test_something_else_than_a_stiffness_is_refused() -> None:
    with pytest.raises(cdsm.InvalidInput, match="a Stiffness is needed"):
        cdsm.modes(cast(Any, K.joint))


@pytest.mark.parametrize(
    "arm",
    [
        hinge(joints=3, twist=1.2, link_mass=0.0),
        cdsm.Manipulator(readme_geometry(joints=3, link_mass=[0.2, 0.2, 0.0]), STEEL),
        # less than the cross it hangs on
        cdsm.Manipulator(readme_geometry(joints=3, link_mass=[0.2, 0.2, 1e-7]), STEEL),
    ],
)
def test_motion_without_mass_is_an_error_that_names_the_joint(arm: cdsm.Manipulator) -> None:
    pose = random_posture(arm, 1)
    K = cdsm.stiffness(pose, np.full(len(arm.cables), 50.0))
    with pytest.raises(cdsm.SingularStiffness, match=r"no mass.*link_mass") as caught:
        cdsm.modes(K)
    direction = caught.value.direction
    assert np.linalg.norm(direction) == pytest.approx(1.0)
    worst = arm.joint_names[int(abs(direction).argmax())]
    assert worst in str(caught.value)
    assert worst.startswith("joint3")


def backbone(length: float, disks: int, EI: float, density: float) -> cdsm.Manipulator:
    section = {"length": length, "disks": disks, "hole_radius": 0.01, "hole_angles": [0, 2, 4]}
    geometry = cdsm.Geometry.backbone(
        sections=[section], bending_stiffness=EI, mass_per_length=density
    )
    return cdsm.Manipulator(geometry, cdsm.LinearElasticity(2e4), gravity=(0.0, 0.0, 0.0))


NITINOL = {  # E, inner and outer diameter, density of the preset
    "EI": 83e9 * math.pi / 64.0 * (1.22e-3**4 - 0.954e-3**4),
    "density": 6450.0 * math.pi / 4.0 * (1.22e-3**2 - 0.954e-3**2),
}


@pytest.mark.parametrize(
    ("arm", "length", "EI", "density", "frequency"),
    [
        (backbone(0.12, 4, 0.03, 2.0), 0.12, 0.03, 2.0, 4.759),
        (backbone(0.25, 10, 0.02, 2.9e-3), 0.25, 0.02, 2.9e-3, 23.5),
        (cdsm.presets.nitinol_segment(), 0.25, *NITINOL.values(), 12.4),
    ],
    ids=["thick", "thin", "Nitinol"],
)
def test_a_rod_without_disks_of_mass_swings_as_a_cantilever(
    arm: cdsm.Manipulator, length: float, EI: float, density: float, frequency: float
) -> None:
    """1.8751² √(EI/(ρA L⁴))/2π of a slender beam; the pieces of the model are too slow."""
    rest = cdsm.forward_statics(arm, tension=np.zeros(len(arm.cables)))
    expected = 1.8751**2 * np.sqrt(EI / (density * length**4)) / (2.0 * np.pi)
    assert expected == pytest.approx(frequency, rel=5e-3)
    found = cdsm.modes(rest.stiffness).frequencies[0]
    assert found == pytest.approx(expected, rel=0.01)


def test_a_rod_without_mass_is_refused() -> None:
    arm = backbone(0.12, 4, 0.03, 0.0)
    rest = cdsm.forward_statics(arm, tension=np.zeros(3))
    with pytest.raises(cdsm.SingularStiffness, match=r"no mass.*mass_per_length"):
        cdsm.modes(rest.stiffness)


@pytest.mark.parametrize("joints", ["universal", "hinged"])
def test_placeholders_are_the_mass_of_an_arm_without_mass(joints: str) -> None:
    geometry = random_arm(3, 4, joints).geometry
    links = tuple(replace(link, mass=0.0) for link in geometry.links)
    pose = random_posture(cdsm.Manipulator(geometry.replace(links=links), STEEL), 1)
    M = pose.arm.body.mass_matrix(pose.q)
    np.testing.assert_allclose(_placeholder_matrix(pose), M, rtol=0.0, atol=1e-12 * abs(M).max())
