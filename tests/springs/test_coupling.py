"""Joints that follow others: θ = S φ + θ_0."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.sweeps.poses import joint_angles
from tests.support.arms import readme_geometry

pytestmark = pytest.mark.filterwarnings("ignore::cdsm.errors.CdsmWarning")

LAW = cdsm.LinearElasticity(2e4)
PHI = np.array([0.3, -0.4])
WRENCH = np.array([1.0, 2.0, -1.0, 0.1, 0.05, -0.02])
TENSION = np.array([10.0, 12.0, 8.0, 5.0, 7.0])
SPRINGS: dict[str, Any] = {"a": 2.0, "b": (1.0, 0.1), "c": 0.5, "d": 1.0}
FOLLOWS = {
    "b": '<mimic joint="a" multiplier="0.7" offset="0.1"/>',
    "c": '<mimic joint="b" multiplier="-1.2"/>',
}


def robot(follows: dict[str, str], last: str = "continuous") -> cdsm.Manipulator:
    """Four joints in series; b follows a, and c follows b."""
    inertia = '<inertia ixx="1e-4" iyy="2e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/>'
    mass = f'<inertial><origin xyz="0.05 0 0"/><mass value="0.2"/>{inertia}</inertial>'
    parts = ['<link name="l0"/>']
    for i, (name, axis) in enumerate(zip("abcd", ("010", "010", "001", "010"), strict=True)):
        kind = last if name == "d" else "revolute"
        parts += [
            f'<link name="l{i + 1}">{mass}</link><joint name="{name}" type="{kind}">'
            f'<parent link="l{i}"/><child link="l{i + 1}"/><origin xyz="{0.1 if i else 0.03} 0 0"/>'
            f'<axis xyz="{" ".join(axis)}"/><limit lower="-1.5" upper="1.2" effort="1" '
            f'velocity="1"/>{follows.get(name, "")}</joint>'
        ]
    tip = '<link name="tip"/><joint name="t" type="fixed"><parent link="l4"/><child link="tip"/>'
    text = f'<robot name="r">{"".join(parts)}{tip}<origin xyz="0.1 0 0"/></joint></robot>'
    ends = [(0.02, 0.01), (-0.02, 0.015), (0.0, -0.02), (0.015, -0.01), (-0.01, 0.02)]
    cables = []
    for i, (y, z) in enumerate(ends):
        places = [(0.05 if k else 0.01, y * (1.0 + 0.1 * k), z) for k in range(5 if i < 3 else 4)]
        sites = tuple(cdsm.Site(f"l{k}", place) for k, place in enumerate(places))
        cables.append(cdsm.Cable(f"c{i}", sites, LAW, lead=0.1))
    return cdsm.Manipulator.from_urdf(text, cables, tip="tip", springs=SPRINGS)


ARM, FREE = robot(FOLLOWS), robot({}, "revolute")
S = np.array([[1.0, 0.0], [0.7, 0.0], [-0.84, 0.0], [0.0, 1.0]])
THETA = S @ PHI + [0.0, 0.1, -0.12, 0.0]


def test_followers_are_multiplied_out() -> None:
    assert ARM.joint_names == ("a", "d")
    np.testing.assert_allclose(ARM.at(PHI).tip, FREE.at(THETA).tip, atol=1e-15)
    # c follows with −0.84 a − 0.12, within −1.5 … 1.2; d turns without end
    np.testing.assert_allclose(ARM.lower, [-1.5, -np.inf])
    np.testing.assert_allclose(ARM.upper, [1.2, np.inf])


def test_derivatives_are_those_of_all_joints_times_s() -> None:
    pose, free = ARM.at(PHI), FREE.at(THETA)
    K, whole = cdsm.stiffness(pose, TENSION, WRENCH), cdsm.stiffness(free, TENSION, WRENCH)
    for name in ("active", "passive", "gravity", "load", "springs", "joint"):
        expected = S.T @ getattr(whole, name) @ S
        np.testing.assert_allclose(getattr(K, name), expected, atol=1e-12, err_msg=name)
    np.testing.assert_allclose(pose.length_jacobian, free.length_jacobian @ S, atol=1e-15)
    np.testing.assert_allclose(pose.length_hessian, S.T @ free.length_hessian @ S, atol=1e-15)
    np.testing.assert_allclose(K.residual, whole.residual @ S, atol=1e-12)


def test_batches_couple_too() -> None:
    names = ("joint", "springs", "compliance", "margin", "jacobian", "length_jacobian", "tip")
    rows = cdsm.evaluate(ARM, np.tile(PHI, (3, 1)), TENSION, WRENCH, names)
    K = cdsm.stiffness(ARM.at(PHI), TENSION, WRENCH)
    for name in names:
        value = getattr(K if hasattr(K, name) else K.posture, name)
        near = 1e-12 * np.max(abs(value))
        np.testing.assert_allclose(rows[name][0], value, atol=near, err_msg=name)
    least = cdsm.evaluate(ARM, PHI[None], None, WRENCH, ("tension",), minimum=3.0)["tension"][0]
    F = cdsm.distribute_tension(ARM.at(PHI), 3.0, wrench=WRENCH)
    np.testing.assert_allclose(least, F.values, rtol=1e-9)
    assert "PASS" in str(cdsm.stiffness(ARM.at(PHI), F).report())


def test_random_postures_take_one_turn_of_a_joint_without_ends() -> None:
    q = joint_angles(ARM, cdsm.RandomPoses(64))
    assert abs(q[:, 1]).max() == pytest.approx(np.pi, rel=0.1)
    assert abs(q[:, 1]).max() <= np.pi


def test_statics_friction_and_modes_couple() -> None:
    rest = cdsm.forward_statics(ARM, tension=TENSION, wrench=WRENCH)
    assert abs(rest.residual).max() < 1e-10
    rough = ARM.with_friction(0.1)
    pull = cdsm.distribute_tension(rough.at(PHI), 5.0)
    history = cdsm.load_cycle(rough.at(PHI), pull, [[0.0, 0.0, -0.1, 0.0, 0.0, 0.0]])
    assert np.isfinite(history.tip).all()
    M = ARM.body.mass_matrix(PHI)
    np.testing.assert_allclose(M, S.T @ FREE.body.mass_matrix(THETA) @ S, atol=1e-12)


def test_sections_turn_alike() -> None:
    sizes = {"link_length": 0.05, "base_length": 0.02, "disk_offset": 0.01, "hole_radius": 0.015}
    sizes |= {"link_mass": 0.02, "lead": 0.1}
    alike = readme_geometry(**sizes, coupled=True)
    arm = cdsm.Manipulator(cdsm.Geometry.sections([alike, alike]), LAW)
    assert arm.joint_names == ("joint1_1", "joint1_2", "joint5_1", "joint5_2")
    own = [each for each in arm.cables if each.name.startswith(("cable4", "cable8"))]
    arm = arm.with_cables(own)  # six cables hold two sections of four joints
    q = np.array([0.05, 0.02, -0.03, 0.04])
    assert abs(cdsm.distribute_tension(arm.at(q), 2.0).residual).max() < 1e-12
    free = cdsm.Manipulator(cdsm.Geometry.sections([readme_geometry(**sizes)] * 2), LAW)
    every = np.concatenate([np.tile(q[:2], 4), np.tile(q[2:], 4)])
    np.testing.assert_allclose(arm.at(q).tip, free.at(every).tip, atol=1e-14)


def test_files_hold_followers_and_springs(tmp_path: Path) -> None:
    assert cdsm.Manipulator.read(ARM.write(tmp_path / "ARM.toml")) == ARM


@pytest.mark.parametrize(
    ("follows", "said"),
    [
        ({"a": '<mimic joint="b"/>', "b": '<mimic joint="a"/>'}, "in a circle"),
        ({"b": '<mimic joint="e"/>'}, "mimics 'e', which is no joint that moves"),
        ({"b": "<mimic/>"}, "<mimic> has no joint"),
        ({"b": '<mimic joint="a" multiplier="x"/>'}, "multiplier"),
    ],
)
def test_couplings_that_cannot_be_are_named(follows: dict[str, str], said: str) -> None:
    with pytest.raises(cdsm.GeometryError, match=said):
        robot(follows)


def test_joints_follow_in_mujoco_too() -> None:
    """Its equations hold at the posture and along S."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(ARM, ARM.at(PHI), TENSION))
    data, order = mujoco.MjData(model), [model.joint(name).qposadr[0] for name in "abcd"]
    np.testing.assert_allclose(model.qpos0[order], THETA, atol=1e-15)
    for step in np.eye(2):
        data.qpos[:] = model.qpos0
        data.qpos[order] += S @ step
        mujoco.mj_forward(model, data)
        equations = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
        assert equations.sum() == 2
        np.testing.assert_allclose(data.efc_pos[equations], 0.0, atol=1e-14)


@pytest.mark.parametrize("follows", [FOLLOWS, {"b": '<mimic joint="a" multiplier="0"/>'}])
def test_followers_do_not_yield_to_the_cables_in_mujoco(follows: dict[str, str]) -> None:
    mujoco: Any = pytest.importorskip("mujoco")
    arm = robot(follows)
    pose = arm.at(0.3 * np.ones(arm.nv))
    pull = cdsm.distribute_tension(pose, 10.0)
    model = mujoco.MjModel.from_xml_string(cdsm.to_mjcf(arm, pose, pull))
    state = mujoco.MjData(model)
    for _ in range(200):
        mujoco.mj_step(model, state)
    found = [state.qpos[model.joint(name).qposadr[0]] for name in arm.body.all_joints]
    np.testing.assert_allclose(found, arm.body.coupling.angles(pose.q), atol=1e-6)
