"""MuJoCo loads what is exported, and computes the same."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm._checks import Array
from tests.arms import mixed_arm, random_arm, random_posture, random_wrench
from tests.foreign import POSTURE, TENSION, crab

mujoco: Any = pytest.importorskip("mujoco")

NOTHING = np.zeros(6)


def loaded(arm: cdsm.Manipulator, *args: Any, **options: Any) -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(arm, *args, **options))
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    return model, data


def order(model: Any, arm: cdsm.Manipulator) -> Array:
    """Where MuJoCo has each of our joints."""
    return np.array([model.joint(name).qposadr[0] for name in arm.joint_names])


def net_torque(model: Any, data: Any, q: Array, wrench: Array = NOTHING) -> Array:
    """What is out of balance at q, in MuJoCo's order: bias less springs, actuators and wrench."""
    data.qpos[:] = q
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    tip = data.body("tool0") if "tool0" in names(model) else data.body("tip")
    pulled = np.zeros(model.nv)
    mujoco.mj_applyFT(model, data, wrench[:3], wrench[3:], tip.xpos, tip.id, pulled)
    return np.asarray(data.qfrc_bias - data.qfrc_passive - data.qfrc_actuator - pulled)


def names(model: Any) -> list[str]:
    return [model.body(i).name for i in range(model.nbody)]


def serpentine(kind: str) -> tuple[cdsm.Manipulator, cdsm.Posture, cdsm.Tension]:
    arm = mixed_arm() if kind == "mixed" else random_arm(3, 4, kind)
    pose = random_posture(arm, 5)
    return arm, pose, cdsm.distribute_tension(pose, 30.0)


@pytest.mark.parametrize("kind", ["universal", "hinged", "mixed"])
def test_cables_are_in_balance_and_as_stiff(kind: str) -> None:
    arm, pose, pull = serpentine(kind)
    model, data = loaded(arm, pose, pull)
    place = order(model, arm)
    q = np.empty(arm.nv)
    q[place] = pose.q
    np.testing.assert_array_equal(data.qpos, q)
    for c, cable in enumerate(arm.cables):
        length = float(data.tendon(cable.name).length[0]) + cable.lead
        assert length == pytest.approx(pose.cable_lengths[c], abs=1e-14)
    scale = float(abs(pull.values @ abs(pose.length_jacobian)).max())
    assert abs(net_torque(model, data, q)).max() < 1e-9 * max(1.0, scale)
    check_stiffness(model, data, q, place, cdsm.stiffness(pose, pull).joint, NOTHING)


def check_stiffness(model: Any, data: Any, q: Array, place: Array, K: Array, wrench: Array) -> None:
    def slope(h: float) -> Array:
        columns = [
            net_torque(model, data, q + e, wrench) - net_torque(model, data, q - e, wrench)
            for e in h * np.eye(q.size)
        ]
        return np.stack(columns, axis=1) / (2.0 * h)

    h = 2.0**-12
    extrapolated = (4.0 * slope(h / 2.0) - slope(h)) / 3.0
    np.testing.assert_allclose(extrapolated[np.ix_(place, place)], K, atol=1e-6 * abs(K).max())


def test_robot_of_somebody_elses_agrees_too() -> None:
    arm = crab(gravity=(1.0, -2.0, -9.0))
    pose = arm.at(POSTURE)
    wrench = random_wrench(2, moment=False)
    model, data = loaded(arm, pose, TENSION)
    place = order(model, arm)
    q = np.empty(arm.nv)
    q[place] = POSTURE
    K = cdsm.stiffness(pose, TENSION, wrench=wrench)
    np.testing.assert_allclose(net_torque(model, data, q, wrench)[place], K.residual, atol=1e-10)
    check_stiffness(model, data, q, place, K.joint, wrench)


def test_soft_springs_and_held_forces_are_actuators() -> None:
    arm, pose, pull = serpentine("universal")
    cables = [
        replace(cable, control="force")
        if c % 3 == 0
        else replace(cable, series_stiffness=200.0 if c % 3 == 1 else np.inf)
        for c, cable in enumerate(arm.cables)
    ]
    soft = arm.with_cables(cables)
    pose = soft.at(pose.q)
    K = cdsm.stiffness(pose, pull.values)
    model, data = loaded(soft, pose, pull.values)
    held = sum(cable.control == "force" for cable in cables)
    assert model.nu > held  # and springs whose rest length would be negative
    place = order(model, soft)
    q = np.empty(soft.nv)
    q[place] = pose.q
    scale = float(abs(pull.values @ abs(pose.length_jacobian)).max())
    assert abs(net_torque(model, data, q)[place] - K.residual).max() < 1e-9 * max(1.0, scale)
    check_stiffness(model, data, q, place, K.joint, NOTHING)


def test_simulation_under_a_weight_settles_where_the_weight_test_says() -> None:
    """Stiff linear cables that stay taut: MuJoCo's springs and ours are the same far away, too."""
    arm = cdsm.Manipulator(
        cdsm.Geometry.hinged(
            joints=3,
            twist=0.5,
            link_length=0.05,
            base_length=0.02,
            disk_offset=0.01,
            hole_radius=0.02,
            link_mass=0.3,
        ),
        cdsm.LinearElasticity(2e3),
    )
    pose = arm.at([0.1, -0.1, 0.2])
    pull = cdsm.distribute_tension(pose, 20.0)
    force = np.array([0.0, 1.0, -2.0])
    test = cdsm.weight_test(pose, pull, force)
    model, data = loaded(arm, pose, pull, damping=0.05)
    model.opt.timestep = 1e-3
    data.xfrc_applied[model.body("tool0").id, :3] = force
    mujoco.mj_step(model, data, 8000)
    assert abs(data.qvel).max() < 1e-9
    np.testing.assert_allclose(data.body("tool0").xpos, test.loaded[-1].pose.tip[:3, 3], atol=1e-8)


def test_without_a_posture_the_tendons_only_lie_there() -> None:
    arm = cdsm.presets.virtual_prototype()
    model, data = loaded(arm)
    assert model.nkey == 0
    assert not model.tendon_stiffness.any()
    assert model.ntendon == 15
    lengths = arm.at(np.zeros(10)).cable_lengths
    np.testing.assert_allclose(data.ten_length, lengths, atol=1e-15)
    assert model.site("tool0").id >= 0


def test_file_is_the_text(tmp_path: Path) -> None:
    arm, pose, pull = serpentine("hinged")
    path = cdsm.write_mjcf(arm, tmp_path / "arm.xml", pose, pull)
    assert path.read_text(encoding="utf-8") == cdsm.to_mjcf(arm, pose, pull)
    mujoco.MjModel.from_xml_path(str(path))


def test_bad_input_is_named() -> None:
    arm, pose, pull = serpentine("hinged")
    with pytest.raises(cdsm.InvalidInput, match="pose and tension, or neither"):
        cdsm.to_mjcf(arm, pose)
    with pytest.raises(cdsm.InvalidInput, match="another arm"):
        cdsm.to_mjcf(mixed_arm(), pose, pull)
    with pytest.raises(cdsm.InvalidInput, match="damping"):
        cdsm.to_mjcf(arm, damping=-1.0)


def test_names_are_those_of_the_text_whatever_its_declaration_says() -> None:
    """A declaration speaks of bytes on a disk; the text has been decoded already."""
    urdf = (
        '<?xml version="1.0" encoding="ISO-8859-1"?><robot name="r"><link name="ä"/>'
        '<link name="ö"/><joint name="j" type="revolute"><parent link="ä"/><child link="ö"/>'
        '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    sites = cdsm.Site("ä", (0.0, 0.0, 0.1)), cdsm.Site("ö", (0.1, 0.0, 0.1))
    rope = cdsm.Cable("c", sites, cdsm.LinearElasticity(1e4))
    model, _ = loaded(cdsm.Manipulator.from_urdf(urdf, [rope], tip="ö"))
    assert {"ä", "ö"} <= set(names(model))
