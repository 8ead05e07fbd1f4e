"""MuJoCo drives what is exported: motors, damping, and an arm that starts where it is held."""

import math
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from lxml import etree
from scipy.linalg import eigh

import cdsm
from cdsm.support.values import Array
from tests.support.arms import mixed_arm, random_posture, readme_geometry
from tests.support.foreign import POSTURE, TENSION, crab

mujoco: Any = pytest.importorskip("mujoco")

DATA = Path(__file__).parents[1] / "data"


def finger() -> tuple[cdsm.Posture, cdsm.Tension]:
    cables = cdsm.read_cables(DATA / "finger_cables.toml")
    arm = cdsm.Manipulator.from_urdf(DATA / "finger.urdf", cables, tip="fingertip")
    pose = arm.at(np.deg2rad([20.0, 30.0, 20.0]))
    return pose, cdsm.distribute_tension(pose, 5.0)


def eight_joints(
    law: cdsm.Elasticity = cdsm.presets.STRAND_1X19,
) -> tuple[cdsm.Posture, cdsm.Tension]:
    geometry = readme_geometry(joints=8, link_mass=0.05)
    pose = cdsm.Manipulator(geometry, law).at(np.deg2rad(np.tile([5.0, -3.0], 8)))
    return pose, cdsm.distribute_tension(pose, 20.0)


ARMS = {"finger": finger, "8 joints": eight_joints}


def simulated(pose: cdsm.Posture, tension: Any, **options: Any) -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(pose.arm, pose, tension, **options))
    return model, mujoco.MjData(model)


def run(model: Any, data: Any, seconds: float) -> None:
    """Step the model. MuJoCo begins again at zero seconds after numbers that are not finite."""
    end = data.time + seconds
    mujoco.mj_step(model, data, round(seconds / model.opt.timestep))
    assert data.time == pytest.approx(end)


def ours(model: Any, arm: cdsm.Manipulator, values: Array) -> Array:
    """Return values of MuJoCo's joints in the order of the arm's."""
    return np.asarray(values[[model.joint(name).qposadr[0] for name in arm.joint_names]])


@pytest.mark.slow
@pytest.mark.parametrize("name", ARMS)
def test_exported_with_the_defaults_an_arm_stays_for_ten_seconds(name: str) -> None:
    """What diverges, or creeps at 1e-4 rad/s, would show; what holds moves by rounding."""
    pose, pull = ARMS[name]()
    model, data = simulated(pose, pull)
    assert model.nu == len(pose.arm.cables)
    assert (data.ctrl == 0.0).all()
    most = 0.0
    for _ in range(20):
        run(model, data, 0.5)
        most = max(most, float(abs(ours(model, pose.arm, data.qpos) - pose.q).max()))
    assert most < 1e-9 < 1e-3


@pytest.mark.parametrize("robot", ["finger", "8 joints", "mixed", "crab"])
def test_model_starts_at_the_posture_and_its_coordinates_are_ours(robot: str) -> None:
    if robot in ARMS:
        pose, pull = ARMS[robot]()
        tension = pull.values
    else:
        arm = mixed_arm() if robot == "mixed" else crab()
        pose = random_posture(arm, 5) if robot == "mixed" else arm.at(POSTURE)
        tension = TENSION if robot == "crab" else np.full(len(arm.cables), 30.0)
    model, data = simulated(pose, tension)
    order = [model.joint(name).qposadr[0] for name in pose.arm.joint_names]
    assert (data.qpos[order] == pose.q).all()
    there = pose.arm.at(0.5 * pose.arm.lower * np.linspace(0.1, 0.9, pose.arm.nv))
    for each in (pose, there):
        data.qpos[order] = each.q
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.site("tool0").xpos, each.tip[:3, 3], atol=1e-14)
        leads = [cable.lead for cable in pose.arm.cables]
        np.testing.assert_allclose(data.ten_length + leads, each.cable_lengths, atol=1e-14)


# --- motors ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("force", "slack"), [((0.1, 0.0, -1.0), False), ((0.0, 0.0, -6.0), True)], ids=["taut", "slack"]
)
def test_locked_motors_hold_a_load_where_the_equilibrium_is(force: Any, slack: bool) -> None:
    """With constant EA a motor holds l_0 as cdsm's does, beyond where its cable goes slack, too."""
    pose, pull = finger()
    rest = cdsm.equilibrium(pose, pull, (*force, 0.0, 0.0, 0.0))
    assert bool(rest.slack) is slack
    assert np.linalg.norm(rest.displacement) > 1e-4
    model, data = simulated(pose, pull, damping_ratio=0.5)
    data.xfrc_applied[model.body("fingertip").id, :3] = force
    run(model, data, 1.0)
    assert abs(data.qvel).max() < 1e-10
    np.testing.assert_allclose(ours(model, pose.arm, data.qpos), rest.pose.q, atol=1e-10)
    np.testing.assert_allclose(-data.actuator_force, rest.tension, atol=1e-7)


@pytest.mark.slow
def test_strand_is_held_with_its_tangent_stiffness() -> None:
    """EA depends on the tension: half the load leaves a quarter of the miss."""
    pose, pull = eight_joints()
    model, data = simulated(pose, pull, damping_ratio=0.5)
    missed = []
    for force in (0.2, 0.1):
        rest = cdsm.equilibrium(pose, pull, (0.0, 0.0, -force, 0.0, 0.0, 0.0))
        mujoco.mj_resetData(model, data)
        data.xfrc_applied[model.body("tool0").id, 2] = -force
        run(model, data, 3.0)
        there = ours(model, pose.arm, data.qpos)
        missed.append(abs(there - rest.pose.q).max() / abs(rest.pose.q - pose.q).max())
    assert missed[0] < 0.03
    assert missed[0] / missed[1] == pytest.approx(2.0, rel=0.1)  # relative to the motion


def test_motor_pays_wire_out() -> None:
    """δq = K_θ⁻¹ J_Lᵀ k u, to first order: paying the flexor out lets the finger stretch."""
    pose, pull = finger()
    K = cdsm.stiffness(pose, pull)
    model, data = simulated(pose, pull, damping_ratio=0.5)
    c = [cable.name for cable in pose.arm.cables].index("middle_flexor")
    k = np.eye(len(pose.arm.cables))[c] * K.cable_stiffness[c]
    slope = np.linalg.solve(K.joint, pose.length_jacobian.T @ k)
    moved = []
    for u in (2e-5, -2e-5):
        mujoco.mj_resetData(model, data)
        data.ctrl[c] = u
        run(model, data, 0.5)
        moved.append(ours(model, pose.arm, data.qpos) - pose.q)
    assert slope[1] < 0.0  # less bent
    np.testing.assert_allclose((moved[0] - moved[1]) / 4e-5, slope, rtol=1e-4, atol=1e-3)


def test_motors_pull_with_the_tension_they_are_told() -> None:
    pose, pull = finger()
    with pytest.warns(UserWarning, match="UNSTABLE"):
        model, data = simulated(pose, pull, actuators="tension")
    mujoco.mj_forward(model, data)
    assert not data.qfrc_actuator.any()
    mujoco.mj_resetDataKeyframe(model, data, 0)
    np.testing.assert_array_equal(data.ctrl, pull.values)
    mujoco.mj_forward(model, data)
    torque = ours(model, pose.arm, data.qfrc_actuator)
    np.testing.assert_allclose(torque, -pose.length_jacobian.T @ pull.values, atol=1e-15)
    assert abs(data.qfrc_actuator - data.qfrc_bias + data.qfrc_passive).max() < 1e-14
    data.ctrl[:] = -1.0
    mujoco.mj_forward(model, data)
    assert not data.qfrc_actuator.any()  # cables only pull


def test_arm_on_tensions_alone_is_judged_without_the_stiffness_of_its_cables() -> None:
    """Hung from its base, a heavy finger is stable on tensions; pointing up it is not."""
    pose, _ = finger()
    for upwards, stable in ((-9.81, True), (9.81, False)):
        arm = cdsm.Manipulator.from_urdf(
            pose.arm.urdf, pose.arm.cables, tip="fingertip", gravity=(-upwards, 0.0, 0.0)
        )
        here = arm.at(np.zeros(3))
        with nullcontext() if stable else pytest.warns(UserWarning, match="UNSTABLE"):
            text = cdsm.to_mjcf(arm, here, np.full(6, 1e-3), actuators="tension")
        assert ("UNSTABLE" in text) is not stable
        assert "UNSTABLE" not in cdsm.to_mjcf(arm, here, np.full(6, 1e-3))


def test_cable_that_holds_its_tension_is_told_what_to_add() -> None:
    pose, pull = finger()
    cables = list(pose.arm.cables)
    cables[2] = cdsm.Cable(
        cables[2].name, cables[2].sites, cables[2].elasticity, control="force", lead=0.2
    )
    pose = pose.arm.with_cables(cables).at(pose.q)
    model, data = simulated(pose, pull.values)
    mujoco.mj_forward(model, data)
    assert abs(data.qfrc_actuator - data.qfrc_bias + data.qfrc_passive).max() < 1e-9
    data.ctrl[2] = 1.5
    data.qpos[:] += 0.01
    mujoco.mj_forward(model, data)
    assert -data.actuator_force[2] == pytest.approx(pull.values[2] + 1.5)


# --- damping --------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [None, 0.01])
@pytest.mark.parametrize("mode", [0, 1, 2])
def test_modes_decay_as_stated(mode: int, ratio: float | None) -> None:
    """Released in the shape of a mode, the energy falls by e^(−2 ζ ω t), with ζ ∝ ω."""
    pose, pull = finger()
    model, data = simulated(pose, pull, damping_ratio=ratio)
    mujoco.mj_forward(model, data)
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    K = cdsm.stiffness(pose, pull).joint
    squares, shapes = eigh(K, M)
    omega, wanted = math.sqrt(squares[mode]), ratio or 0.05
    wanted *= omega / math.sqrt(squares[0])
    data.qpos[:] += 1e-5 * shapes[:, mode] / abs(shapes[:, mode]).max()

    def energy() -> float:
        away = data.qpos - pose.q
        return float(data.qvel @ M @ data.qvel + away @ K @ away) / 2.0

    before = energy()
    mujoco.mj_step(model, data, round(2.0 * math.tau / omega / model.opt.timestep))
    decay = math.log(before / energy()) / (2.0 * omega * data.time)
    # K_θ is the passive part within 3 %, and implicit steps damp up to ω·dt more
    assert decay == pytest.approx(wanted, rel=0.05 + omega * model.opt.timestep)


def test_a_mode_that_cables_do_not_resist_does_not_set_the_damping() -> None:
    """Gravity alone holds the last phalanx, slowly: its mode is left as it is."""
    pose, _ = finger()
    arm = cdsm.Manipulator.from_urdf(
        pose.arm.urdf, pose.arm.cables[:4], tip="fingertip", gravity=(9.81, 0.0, 0.0)
    )
    here = arm.at(np.zeros(3))
    tension = np.full(4, 5.0)
    K = cdsm.stiffness(here, tension)
    frequencies = cdsm.modes(here, K).frequencies
    assert K.is_stable
    assert frequencies[0] < 0.1 * frequencies[1]
    text = cdsm.to_mjcf(arm, here, tension)
    dampers = [float(each.get("damping")) for each in etree.fromstring(text).iter("spatial")]
    with_all = cdsm.to_mjcf(pose.arm, pose.arm.at(np.zeros(3)), np.full(6, 5.0))
    most = max(float(each.get("damping")) for each in etree.fromstring(with_all).iter("spatial"))
    assert 0.0 < max(dampers) < 2.0 * most


def test_damping_may_be_any_number() -> None:
    pose, pull = finger()
    for damping in (1, np.float32(0.5), np.array(0.25)):
        model, _ = simulated(pose, pull, damping=damping)
        assert (model.dof_damping == float(damping)).all()


@pytest.mark.parametrize("name", ARMS)
def test_strong_damping_needs_no_smaller_step(name: str) -> None:
    pose, pull = ARMS[name]()
    model, data = simulated(pose, pull, damping_ratio=20.0)
    data.qpos[:] += 1e-3
    run(model, data, 0.2)
    assert abs(data.qpos).max() < 2.0
    assert abs(data.qvel).max() < 0.1


# --- drawing and words ----------------------------------------------------------------------


def test_links_without_visuals_are_drawn_and_weigh_nothing() -> None:
    pose, pull = finger()
    model, data = simulated(pose, pull)
    drawn = {model.body(int(body)).name for body in model.geom_bodyid}
    assert {"palm", "proximal", "middle", "distal"} <= drawn
    assert (model.geom_type == mujoco.mjtGeom.mjGEOM_CAPSULE).all()
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    assert model.body_mass.sum() == pytest.approx(0.056, abs=2e-6)  # that of the URDF
    mujoco.mj_forward(model, data)
    half = model.geom_size[:, 1:2] * data.geom_xmat[:, 2::3]  # capsules lie along their z
    sticks = np.stack([data.geom_xpos - half, data.geom_xpos + half], axis=1)
    for bone in pose.bones:
        either = [abs(sticks - way).max(axis=(1, 2)).min() for way in (bone, bone[::-1])]
        assert min(either) < 1e-12
    disks, _ = simulated(*eight_joints())
    assert (disks.geom_type == mujoco.mjtGeom.mjGEOM_CYLINDER).any()


def test_file_states_what_was_chosen() -> None:
    pose, pull = finger()
    for options, said in (
        ({}, ["time step  0.05 ms", "ratio 0.05 to 0.32", "actuators  length", "friction   of"]),
        ({"damping": 0.002}, ["damping    0.002 N m s/rad at every joint"]),
        ({"damping_ratio": 0.2, "actuators": "none"}, ["ratio 0.2 to 1.3", "actuators  none"]),
    ):
        root = etree.fromstring(cdsm.to_mjcf(pose.arm, pose, pull, **options))
        comments = "".join(each.text for each in root.iter(etree.Comment))
        for each in said:
            assert each in comments


def test_file_says_what_is_missing_for_balance() -> None:
    pose, pull = finger()
    assert "balance " not in cdsm.to_mjcf(pose.arm, pose, pull)
    loaded = cdsm.distribute_tension(pose, 5.0, wrench=(0, 0, -1.5, 0, 0, 0))
    text = cdsm.to_mjcf(pose.arm, pose, loaded)
    assert (
        "load       (0, 0, -1.5) N, (0, 0, 0) N m is not in the model: apply it to finger" in text
    )
    assert "balance " not in text
    wrong = pull.values + 3.0 * np.eye(6)[0]
    left = 3.0 * abs(pose.length_jacobian[0, 0])
    text = cdsm.to_mjcf(pose.arm, pose, wrong)
    assert f"balance    {left:.4g} N m are missing, most at proximal_joint" in text
    urdf = pose.arm.urdf.replace("proximal_joint", "proximal--joint")
    arm = cdsm.Manipulator.from_urdf(urdf, pose.arm.cables, tip="fingertip")
    assert "most at proximal- -joint" in cdsm.to_mjcf(arm, arm.at(pose.q), wrong)


def test_bad_choices_are_named() -> None:
    pose, pull = finger()
    for options, said in (
        ({"actuators": "lenght"}, "did you mean 'length'"),
        ({"damping_ratio": -0.1}, "damping_ratio"),
        ({"damping": 0.1, "damping_ratio": 0.1}, "not both"),
    ):
        with pytest.raises(cdsm.CdsmError, match=said):
            cdsm.to_mjcf(pose.arm, pose, pull, **options)
    for options in ({"actuators": "length"}, {"damping_ratio": 0.1}):
        with pytest.raises(cdsm.InvalidInput, match="give pose and tension"):
            cdsm.to_mjcf(pose.arm, **options)
    assert mujoco.MjModel.from_xml_string(cdsm.to_mjcf(pose.arm, actuators="tension")).nu == 6
