"""Vibration: closed forms, MuJoCo's mass matrix, the motion itself, arms that do not vibrate."""

import math
import pickle
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import cdsm
from cdsm.support.values import Array
from cdsm.urdf import CROSS_INERTIA, CROSS_MASS
from tests.support.arms import (
    STEEL,
    mixed_arm,
    random_arm,
    random_posture,
    random_tension,
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


@pytest.mark.parametrize("name", ARMS)
def test_mass_matrix_is_twice_the_kinetic_energy_of_the_links(name: str) -> None:
    # six points on the axes of a cylinder can have its mass, centre and moments of inertia
    K = balanced(ARMS[name], 2)
    arm, q = K.posture.arm, K.posture.q
    speed = np.random.default_rng(1).normal(size=arm.nv)
    step = 2.0**-10

    bodies = []  # name, mass, centre, roots of the second moments by mass
    for k, (joint, link) in enumerate(
        zip(arm.geometry.joints, arm.geometry.links, strict=True), start=1
    ):
        radius, length = arm.geometry.hole_radius, link.length
        spread = [length / math.sqrt(12.0), radius / 2.0, radius / 2.0]
        small = [math.sqrt(CROSS_INERTIA / CROSS_MASS / 2.0)] * 3
        moved = (
            (link.mass, length / 2.0, spread) if link.mass else (CROSS_MASS, length / 2.0, small)
        )
        bodies.append((f"link{k}", *moved))
        if len(joint.axes) == 2:
            bodies.append((f"cross{k}", CROSS_MASS, 0.0, small))

    def places(at: Array) -> Array:
        """The six points of every body, each by the root of its mass."""
        pose, points = arm.at(at, check_limits=False), []
        for name, mass, centre, spread in bodies:
            frame = pose.link_pose(name)
            for axis in range(3):
                for side in (-1.0, 1.0):
                    point = np.array([centre, 0.0, 0.0])
                    point[axis] += side * spread[axis] * math.sqrt(3.0)
                    points.append(math.sqrt(mass / 6.0) * (frame[:3, :3] @ point + frame[:3, 3]))
        return np.concatenate(points)

    def energy(h: float) -> float:
        velocity = (places(q + h * speed) - places(q - h * speed)) / (2.0 * h)
        return 0.5 * float(velocity @ velocity)

    coarse, fine = energy(step), energy(step / 2.0)
    extrapolated = (4.0 * fine - coarse) / 3.0
    expected = 0.5 * float(speed @ cdsm.modes(K.posture, K).mass @ speed)
    assert extrapolated == pytest.approx(expected, rel=1e-10)


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


def test_hinge_set_free_swings_with_that_period() -> None:
    K = balanced(hinge(), 3)
    period = 1.0 / float(cdsm.modes(K.posture, K).frequencies[0])
    start = K.posture.q[0]

    def passes(_: float, state: Array) -> float:
        return float(state[0] - start)

    passes.direction = 1.0  # type: ignore[attr-defined]
    errors = []
    for amplitude in (2.0**-5, 2.0**-6):
        # released at rest; the two upward passes are one period apart
        swing = solve_ivp(
            lambda _, state: [state[1], -torque(K, state[:1])[0] / INERTIA],
            (0.0, 2.2 * period),
            [start + amplitude, 0.0],
            method="DOP853",
            rtol=1e-12,
            atol=1e-14,
            events=passes,
        )
        first, second = swing.t_events[0][:2]
        errors.append(abs((second - first) / period - 1.0))
    assert errors[1] < 1e-3
    # what is left is the nonlinearity, of second order in the amplitude
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.02)


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


@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("moment", [False, True])
def test_shapes_are_orthonormal_in_mass_and_stiffness(name: str, moment: bool) -> None:
    pose = random_posture(ARMS[name], 5)
    K = cdsm.stiffness(pose, random_tension(pose.arm, 5), random_wrench(5, moment))
    found = cdsm.modes(pose, K)
    phi = np.hstack([found.growth_shapes, found.shapes])
    squares = np.concatenate([-(found.growth_rates**2), (2.0 * math.pi * found.frequencies) ** 2])
    symmetric = (K.joint + K.joint.T) / 2.0
    np.testing.assert_allclose(phi.T @ found.mass @ phi, np.eye(pose.arm.nv), rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(
        phi.T @ symmetric @ phi, np.diag(squares), rtol=0.0, atol=1e-11 * squares.max()
    )
    assert (np.diff(found.frequencies) > 0.0).all()
    for shape in phi.T:
        assert shape[abs(shape).argmax()] > 0.0


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


def test_stiffness_from_another_process_fits_the_posture_at_hand() -> None:
    K = balanced(random_arm(3, 3), 1)
    again = pickle.loads(pickle.dumps(K))
    np.testing.assert_array_equal(
        cdsm.modes(K.posture, again).frequencies, cdsm.modes(K.posture, K).frequencies
    )


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
        ((0.0, 0.0, 0.0), True),
        ((0.2, 0.2, 0.0), False),
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


@pytest.mark.parametrize("masses", [(0.2, 0.0, 0.2), (0.2, 0.2, 1e-7)])
def test_massless_link_between_heavy_ones_and_a_light_one_are_no_fault(
    masses: tuple[float, ...],
) -> None:
    pose = random_posture(massless(*masses), 1)
    assert cdsm.modes(pose, cdsm.stiffness(pose, np.full(9, 50.0))).frequencies.size == 3
