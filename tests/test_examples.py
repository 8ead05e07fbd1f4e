"""The programs of examples/: each runs, and says what cdsm says."""

from pathlib import Path

import generate
import mujoco_weight
import numpy as np
import pytest
from ros2_stiffness_node import answer, arm_of_description
from scipy.spatial.transform import Rotation

import cdsm

EXAMPLES = Path(__file__).parents[1] / "examples"
ARM = cdsm.Manipulator.read(EXAMPLES / "arm.toml")
RNG = np.random.default_rng(6)


def test_the_ros_node_says_what_cdsm_says_whatever_the_order_of_the_joints() -> None:
    q = RNG.uniform(-0.1, 0.1, ARM.nv)
    measured = dict(zip(ARM.joint_names, q.tolist(), strict=True))
    shuffled = {"gripper": 1.0} | dict(reversed(measured.items()))
    said = answer(ARM, shuffled, 10.0)
    pose = ARM.at(q)
    tension = cdsm.distribute_tension(pose, 10.0)
    K = cdsm.stiffness(pose, tension)
    assert said.problem == ""
    assert dict(said.tensions) == dict(tension)
    assert said.margin == K.margin
    np.testing.assert_array_equal(said.tip, pose.tip[:3, 3])
    turn = Rotation.from_quat(said.orientation).as_matrix()
    np.testing.assert_allclose(  # rounding of eigenvectors and of a quaternion
        turn @ np.diag(said.axes) @ turn.T, K.compliance[:3, :3], rtol=1e-9, atol=1e-15
    )


def test_the_ros_node_names_what_is_wrong() -> None:
    straight, first = dict.fromkeys(ARM.joint_names, 0.0), ARM.joint_names[0]
    for wrong in ({k: v for k, v in straight.items() if k != first}, {first: 5.0}, {first: np.nan}):
        said = answer(ARM, straight | wrong if len(wrong) == 1 else wrong, 10.0)
        assert first in said.problem
        assert not said.tensions
    assert answer(ARM, straight, 1e5).problem


def test_the_ros_node_takes_the_robot_of_robot_description(tmp_path: Path) -> None:
    arm = cdsm.presets.virtual_prototype()
    cables = cdsm.write_cables(arm.cables, tmp_path / "CABLES.toml")
    urdf = (EXAMPLES.parent / "urdf" / "virtual_prototype.urdf").read_text()
    described = arm_of_description(urdf, str(cables), "tool0")
    straight = dict.fromkeys(arm.joint_names, 0.0)
    assert answer(described, straight, 10.0).margin == pytest.approx(
        answer(arm.with_gravity(described.gravity), straight, 10.0).margin, rel=1e-9
    )


def test_mujoco_comes_to_rest_where_cdsm_says() -> None:
    arm = mujoco_weight.posture()
    theirs, ours = mujoco_weight.simulate(*arm), mujoco_weight.compute(*arm)
    assert np.linalg.norm(theirs - ours) < 1e-4 * np.linalg.norm(ours)


def test_the_files_of_urdf_are_those_that_its_generator_writes() -> None:
    written = generate.files()
    assert {path.name for path in generate.FOLDER.glob("*.[tu]*")} == set(written)
    for name, text in written.items():
        assert (generate.FOLDER / name).read_bytes() == text.encode(), name


@pytest.mark.parametrize(
    ("name", "q", "cables"),
    [
        ("sjtu_snake", [0.02] * 24, 36),
        ("carex", [0.1, 0.16, 0.58, 0.39], 6),
        ("myo_shoulder", [0.5, -0.26, 0.06], 9),
        ("bm_arm", [-0.08, -0.48, -0.16, -0.17], 6),
        ("simplex", [0.0] * 12, 12),
    ],
)
def test_known_arms_are_read_and_name_their_source(name: str, q: list[float], cables: int) -> None:
    path = generate.FOLDER / f"{name}.toml"
    arm = cdsm.Manipulator.read(path)
    assert (arm.nv, len(arm.cables)) == (len(q), cables)
    assert arm.urdf == (generate.FOLDER / f"{name}.urdf").read_text(encoding="utf-8")
    comment = [line for line in path.read_text(encoding="utf-8").splitlines() if line[:1] == "#"]
    assert any("20" in line for line in comment)
    assert any("osen here" in line for line in comment)
    if name != "simplex":  # which stands by its prestress: test_tensegrity.py
        pose = arm.at(q)
        assert cdsm.stiffness(pose, cdsm.distribute_tension(pose, 20.0 * (len(q) > 20))).is_stable


@pytest.mark.parametrize(("name", "along_z"), [("backbone", 7.078), ("bending_links", 347.7e3)])
def test_beams_hold_arms(name: str, along_z: float) -> None:
    arm = cdsm.Manipulator.read(EXAMPLES / f"{name}.toml").with_gravity((0.0, 0.0, 0.0))
    straight = arm.at(np.zeros(arm.nv))
    K = cdsm.stiffness(straight, cdsm.distribute_tension(straight))
    # all tendons of the backbone are at 0 N: on one side one of them pulls
    assert K.along("z") == pytest.approx(along_z, rel=1e-3)
    assert "links that bend" in str(K)
