"""MuJoCo loads what is exported, computes the same, and holds a stable arm where it is."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.linalg import eigh

import cdsm
from cdsm.interchange.mjcf import write_mjcf
from cdsm.support.values import Array
from tests.support.arms import mixed_arm, random_arm, random_posture, random_wrench, readme_geometry
from tests.support.differences import central_difference
from tests.support.foreign import POSTURE, TENSION, crab, joint_element, link_element
from tests.support.locked import hinge
from tests.support.mujoco_arms import mass, tendon_jacobian

DATA = Path(__file__).parents[1] / "data"
NOTHING = np.zeros(6)
BODIES = {
    "none": "",
    "of a rod": '<inertia ixx="0" iyy="2e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/>',
    "of a plate": '<inertia ixx="3e-4" iyy="1e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/>',
    "of a needle": '<inertia ixx="1e-15" iyy="7e-2" izz="7.00001e-2" ixy="0" ixz="0" iyz="0"/>',
    "of nothing real": '<inertia ixx="1e-4" iyy="1e-4" izz="9e-4" ixy="0" ixz="0" iyz="2e-5"/>',
    "negative": '<inertia ixx="-1e-4" iyy="1e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/>',
}


def loaded(arm: cdsm.Manipulator, *args: Any, **options: Any) -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(arm, *args, **options))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def order(model: Any, arm: cdsm.Manipulator) -> Array:
    """Where MuJoCo has each of our joints."""
    return np.array([model.joint(name).qposadr[0] for name in arm.joint_names])


def net_torque(model: Any, data: Any, q: Array, tip: str, wrench: Array = NOTHING) -> Array:
    """What is out of balance at q, in MuJoCo's order: bias less springs, actuators and wrench."""
    data.qpos[:] = q
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    pulled, body = np.zeros(model.nv), data.body(tip)
    mujoco.mj_applyFT(model, data, wrench[:3], wrench[3:], body.xpos, body.id, pulled)
    return np.asarray(data.qfrc_bias - data.qfrc_passive - data.qfrc_actuator - pulled)


def two_links(
    body: str, mass: float = 0.3, far: float = 0.2, center: float = 0.05
) -> cdsm.Manipulator:
    inertial = (
        f'<inertial><origin xyz="{center} 0 0.01" rpy="0.3 0.2 0.1"/><mass value="{mass}"/>{body}'
        "</inertial>"
    )
    parts = [
        link_element("floor"),
        link_element("middle"),
        f'<link name="hand">{inertial if body else ""}</link>',
        joint_element("a", "revolute", "floor", "middle", "0.1 0 0", "0 0 0", "0 1 0"),
        joint_element(
            "b", "revolute", "middle", "hand", f"{far} 0 0", "0 0 0", "0 0 1" if far else "0 1 0"
        ),
    ]
    ways = [(0.02, 0.02), (-0.02, 0.02), (0.02, -0.02)]
    cables = [
        cdsm.Cable(
            f"{to}{i}",
            (cdsm.Site("floor", (0.05, y, z)), cdsm.Site(to, (0.03, 1.5 * y, 1.2 * z))),
            cdsm.LinearElasticity(2e4),
        )
        for to in ("middle", "hand")
        for i, (y, z) in enumerate(ways)
    ]
    urdf = f'<robot name="two">{"".join(parts)}</robot>'
    return cdsm.Manipulator.from_urdf(urdf, cables, tip="hand", check_inertia=False)


def finger() -> tuple[cdsm.Posture, Array]:
    cables = cdsm.read_cables(DATA / "finger_cables.toml")
    arm = cdsm.Manipulator.from_urdf(DATA / "finger.urdf", cables, tip="fingertip")
    pose = arm.at(np.deg2rad([20.0, 30.0, 20.0]))
    return pose, cdsm.distribute_tension(pose, 5.0).values


def serpentine(kind: str) -> tuple[cdsm.Posture, Array]:
    arm = mixed_arm() if kind == "mixed" else random_arm(3, 4, kind)
    pose = random_posture(arm, 5)
    return pose, cdsm.distribute_tension(pose, 30.0).values


def soft() -> tuple[cdsm.Posture, Array]:
    """Some cables hold their tension, some have springs that stretch by much of the cable."""
    pose, pull = serpentine("universal")
    changes: list[dict[str, Any]] = [
        {"control": "force"},
        {"series_stiffness": 200.0, "lead": 2.0},
        {},
    ]
    cables = [replace(cable, **changes[c % 3]) for c, cable in enumerate(pose.arm.cables)]
    return pose.arm.with_cables(cables).at(pose.q), pull


ARMS: dict[str, Any] = {
    **{kind: lambda kind=kind: serpentine(kind) for kind in ("universal", "hinged", "mixed")},
    "tree with slides": lambda: (crab(gravity=(1.0, -2.0, -9.0)).at(POSTURE), TENSION),
    "soft and force-controlled": soft,
    "finger": finger,
}


@pytest.mark.filterwarnings("ignore:UNSTABLE")
@pytest.mark.parametrize("actuators", ["length", "none"])
@pytest.mark.parametrize("name", ARMS)
def test_balance_and_stiffness_are_those_of_mujoco(name: str, actuators: str) -> None:
    """K_θ by differences of MuJoCo's torque; lengths, moment arms and the tip too."""
    pose, F = ARMS[name]()
    arm, wrench = pose.arm, random_wrench(2, moment=False)
    model, data = loaded(arm, pose, F, actuators=actuators)
    place, q = order(model, arm), np.empty(arm.nv)
    q[place] = pose.q
    np.testing.assert_array_equal(data.qpos, q)  # a new mjData begins at the posture
    np.testing.assert_allclose(data.site("tool0").xpos, pose.tip[:3, 3], atol=1e-14)
    for c, cable in enumerate(arm.cables):
        length = float(data.tendon(cable.name).length[0]) + cable.lead
        assert length == pytest.approx(pose.cable_lengths[c], abs=1e-14)
    np.testing.assert_allclose(
        tendon_jacobian(model, data)[:, place], pose.length_jacobian, atol=1e-14
    )
    K = cdsm.stiffness(pose, F, wrench=wrench)

    def torque(x: Array) -> Array:
        return net_torque(model, data, x, arm.tip_link, wrench)

    missing = torque(q)[place] - K.residual
    scale = float(abs(F @ abs(pose.length_jacobian)).max())
    assert abs(missing).max() < 1e-9 * max(1.0, scale)
    coarse, fine = (central_difference(torque, q, h) for h in (2.0**-12, 2.0**-13))
    extrapolated = (4.0 * fine - coarse) / 3.0
    near = {"rtol": 0.0, "atol": 1e-8 * abs(K.joint).max()}
    np.testing.assert_allclose(extrapolated[np.ix_(place, place)], K.joint, **near)


# --- time step ------------------------------------------------------------------------------


def universal(joints: int, link_mass: float) -> cdsm.Manipulator:
    geometry = readme_geometry(joints=joints, link_mass=link_mass)
    return cdsm.Manipulator(geometry, cdsm.presets.STRAND_1X19)


DOWN = (0.0, 0.0, -9.81)
FINGER = {"link_length": 0.03, "disk_offset": 0.005, "hole_radius": 0.008, "link_mass": 0.02}
HEAVY = {"link_length": 0.4, "disk_offset": 0.05, "hole_radius": 0.1, "link_mass": 20.0}
HELD: dict[str, tuple[cdsm.Manipulator, Array, float]] = {
    "README's arm": (universal(4, 0.12), np.deg2rad([10, 5, 10, 5, -8, 0, -8, 0]), 50.0),
    "finger": (hinge(joints=3, gravity=DOWN, **FINGER), np.deg2rad([20.0, 30.0, 20.0]), 5.0),
    "heavy and soft": (hinge(joints=2, gravity=DOWN, **HEAVY), np.deg2rad([5.0, 5.0]), 10.0),
    "massless links": (universal(2, 0.0), np.deg2rad([5.0, -3, 5, -3]), 20.0),
}
SECONDS = 0.5


@pytest.mark.parametrize("name", HELD)
def test_stable_arm_stays_where_it_is_at_a_tenth_of_the_longest_time_step(name: str) -> None:
    """MuJoCo's own mass matrix; semi-implicit Euler diverges from ω·dt = 2 on.

    Half a second is a hundred periods: what diverges has grown from rounding by then.
    """
    arm, q, least = HELD[name]
    pose = arm.at(q)
    pull = cdsm.distribute_tension(pose, least)
    K = cdsm.stiffness(pose, pull)
    assert K.is_stable
    model, data = loaded(arm, pose, pull, damping=0.0)
    theirs, step = np.argsort(order(model, arm)), model.opt.timestep
    squares = eigh(K.joint[np.ix_(theirs, theirs)], mass(model, data), eigvals_only=True)
    phase = math.sqrt(squares[-1]) * step
    assert step <= 2e-3
    assert phase <= 0.2 * (1.0 + 1e-9)
    assert phase > 0.2 / 2.5 or step == 2e-3  # of 1, 2, 5, 10, … the next is too long
    assert f"{step:e}"[0] in "125"
    assert float(f"{step:.0e}") == step
    steps = min(round(SECONDS / step), 40_000)
    mujoco.mj_step(model, data, steps)
    assert data.time == pytest.approx(steps * step)  # it never began again
    assert abs(data.qpos - model.key_qpos[0]).max() < 1e-9
    assert abs(data.qvel).max() < 1e-6


@pytest.mark.parametrize("body", [*BODIES, "crab", "mixed", "massless"])
def test_mass_matrix_is_that_of_mujoco(body: str) -> None:
    """MuJoCo loads whatever the inertia of the URDF; what it had to change is small."""
    others = {"crab": crab(), "mixed": mixed_arm(), "massless": universal(2, 0.0)}
    arm = others.get(body) or two_links(BODIES[body])
    pose = arm.at(0.9 * arm.upper * np.random.default_rng(7).uniform(-1.0, 1.0, arm.nv))
    model, data = loaded(arm, pose, np.full(len(arm.cables), 20.0))
    stand_ins = model.body_gravcomp > 0.0  # of bodies without mass
    model.body_mass[stand_ins] = model.body_inertia[stand_ins] = 0.0
    mujoco.mj_forward(model, data)
    place, own = order(model, arm), arm.body.mass_matrix(pose.q)
    theirs = mass(model, data)[np.ix_(place, place)]
    exact = {"crab": 1e-12, "mixed": 1e-12, "of a plate": 1e-8}
    most = exact | {"of a rod": 1e-5, "of a needle": 1e-5}  # they get a moment of 1e-9 kg m²
    if body in most:
        units = np.sqrt(np.outer(theirs.diagonal(), theirs.diagonal()))
        np.testing.assert_allclose(own / units, theirs / units, atol=most[body])


# --- motors and damping ---------------------------------------------------------------------


def ours(model: Any, arm: cdsm.Manipulator, values: Array) -> Array:
    """Return values of MuJoCo's joints in the order of the arm's."""
    return np.asarray(values[order(model, arm)])


@pytest.mark.parametrize(
    ("force", "slack"), [((0.1, 0.0, -1.0), False), ((0.0, 0.0, -6.0), True)], ids=["taut", "slack"]
)
def test_locked_motors_hold_a_load_where_the_equilibrium_is(force: Any, slack: bool) -> None:
    """With constant EA a motor holds l_0 as cdsm's does, beyond where its cable goes slack, too."""
    pose, pull = finger()
    rest = cdsm.equilibrium(pose, pull, (*force, 0.0, 0.0, 0.0))
    assert bool(rest.slack) is slack
    assert np.linalg.norm(rest.displacement) > 1e-4
    model, data = loaded(pose.arm, pose, pull, damping_ratio=0.5)
    data.xfrc_applied[model.body("fingertip").id, :3] = force
    steps = round(1.0 / model.opt.timestep)
    mujoco.mj_step(model, data, steps)
    # MuJoCo begins again at zero seconds after numbers that are not finite
    assert data.time == pytest.approx(steps * model.opt.timestep)
    assert abs(data.qvel).max() < 1e-10
    np.testing.assert_allclose(ours(model, pose.arm, data.qpos), rest.pose.q, atol=1e-10)
    np.testing.assert_allclose(-data.actuator_force, rest.tension, atol=1e-7)


def test_motors_pull_with_the_tension_they_are_told() -> None:
    pose, pull = finger()
    with pytest.warns(UserWarning, match="UNSTABLE"):
        model, data = loaded(pose.arm, pose, pull, actuators="tension")
    mujoco.mj_forward(model, data)
    assert not data.qfrc_actuator.any()
    mujoco.mj_resetDataKeyframe(model, data, 0)
    np.testing.assert_array_equal(data.ctrl, pull)
    mujoco.mj_forward(model, data)
    torque = ours(model, pose.arm, data.qfrc_actuator)
    np.testing.assert_allclose(torque, -pose.length_jacobian.T @ pull, atol=1e-15)
    data.ctrl[:] = -1.0
    mujoco.mj_forward(model, data)
    assert not data.qfrc_actuator.any()  # cables only pull


@pytest.mark.parametrize(("mode", "ratio"), [(0, None), (2, 0.01)])
def test_modes_decay_as_stated(mode: int, ratio: float | None) -> None:
    """Released in the shape of a mode, the energy falls by e^(−2 ζ ω t), with ζ ∝ ω."""
    pose, pull = finger()
    model, data = loaded(pose.arm, pose, pull, damping_ratio=ratio)
    M, K = mass(model, data), cdsm.stiffness(pose, pull).joint
    squares, shapes = eigh(K, M)
    omega = math.sqrt(squares[mode])
    wanted = (ratio or 0.05) * omega / math.sqrt(squares[0])
    data.qpos[:] += 1e-5 * shapes[:, mode] / abs(shapes[:, mode]).max()

    def energy() -> float:
        away = data.qpos - pose.q
        return float(data.qvel @ M @ data.qvel + away @ K @ away) / 2.0

    before = energy()
    mujoco.mj_step(model, data, round(2.0 * math.tau / omega / model.opt.timestep))
    decay = math.log(before / energy()) / (2.0 * omega * data.time)
    # K_θ is the passive part within 3 %, and implicit steps damp up to ω·dt more
    assert decay == pytest.approx(wanted, rel=0.05 + omega * model.opt.timestep)


FINGER_POSE, FINGER_PULL = finger()


@pytest.mark.parametrize(
    ("given", "options", "said"),
    [
        ((FINGER_POSE, FINGER_PULL), {"actuators": "lenght"}, "did you mean 'length'"),
        ((FINGER_POSE, FINGER_PULL), {"damping_ratio": -0.1}, "damping_ratio: -0.1 given"),
        ((FINGER_POSE, FINGER_PULL), {"damping": 0.1, "damping_ratio": 0.1}, "not both"),
        ((), {"actuators": "length"}, "give pose and tension"),
        ((), {"actuators": ""}, "no kind of actuators"),
        ((random_posture(mixed_arm(), 1), FINGER_PULL), {}, "another arm"),
    ],
)
def test_bad_input_is_named(given: Any, options: dict[str, Any], said: str) -> None:
    with pytest.raises(cdsm.CdsmError, match=said):
        cdsm.to_mjcf(FINGER_POSE.arm, *given, **options)


def test_what_is_written_says_what_it_lacks(tmp_path: Path) -> None:
    pose, pull = finger()
    path = write_mjcf(pose.arm, tmp_path / "arm.xml", pose, pull)
    assert path.read_text(encoding="utf-8") == cdsm.to_mjcf(pose.arm, pose, pull)
    bare = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(pose.arm))  # its tendons only lie there
    assert not bare.tendon_stiffness.any()
    wrong = cdsm.to_mjcf(pose.arm, pose, pull + 3.0 * np.eye(6)[0])
    assert f"balance    {3.0 * abs(pose.length_jacobian[0, 0]):.4g} N m are missing" in wrong
