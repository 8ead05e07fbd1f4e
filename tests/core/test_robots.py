"""Robots from URDFs that are built or written wrongly: messages name the joint and the cure."""

import re
from pathlib import Path

import numpy as np
import pytest

import cdsm
from cdsm.sweeps.poses import joint_angles
from tests.cli.test_commands import call

DATA = Path(__file__).parents[1] / "data"
FINGER = DATA / "mimic_cables.toml"


def slider(one_sided: bool, **changes: str) -> cdsm.Manipulator:
    """A hinge on a slider; the cable at the end of the slide pulls it out, the others in."""
    inertial = '<inertial><origin xyz="0.05 0 0"/><mass value="0.2"/>'
    inertial += '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" '
    inertial += 'ixy="0" ixz="0" iyz="0"/></inertial>'
    limit = '<limit lower="-0.5" upper="0.5" effort="1" velocity="1"/>'
    rpy = changes.get("rpy", "0 0 0")
    text = f"""<robot name="slider"><link name="base"/><link name="sled">{inertial}</link>
      <link name="arm">{inertial}</link>
      <joint name="slide" type="prismatic"><parent link="base"/><child link="sled"/>
        <origin xyz="0.1 0 0"/><axis xyz="1 0 0"/>{limit}</joint>
      <joint name="turn" type="revolute"><parent link="sled"/><child link="arm"/>
        <origin xyz="0.1 0 0" rpy="{rpy}"/><axis xyz="0 1 0"/>{limit}</joint></robot>"""
    places = {
        "up": (("base", (0.0, 0.0, 0.03)), ("arm", (0.1, 0.0, 0.03))),
        "down": (("base", (0.0, 0.0, -0.03)), ("arm", (0.1, 0.0, -0.03))),
        "out": (("base", (0.5, 0.0, 0.0)), ("sled", (0.0, 0.0, 0.0))),
    }
    law = cdsm.LinearElasticity(4e4)
    cables = [
        cdsm.Cable(name, tuple(cdsm.Site(*site) for site in sites), law)
        for name, sites in places.items()
        if not (one_sided and name == "out")
    ]
    return cdsm.Manipulator.from_urdf(text, cables, tip="arm")


def test_a_joint_that_all_cables_pull_to_one_side_is_named() -> None:
    pose = slider(one_sided=True).at([0.0, 0.0])
    with pytest.raises(cdsm.InfeasibleTension, match="All cables pull slide to the same") as told:
        cdsm.distribute_tension(pose, 5.0)
    assert told.value.joint == "slide"
    assert "add one that pulls the other way" in str(told.value)
    level = slider(one_sided=True).with_gravity((0.0, 0.0, 0.0)).at([0.0, 0.0])
    with pytest.raises(cdsm.InfeasibleTension, match=r"All cables pull slide .* Widening") as told:
        cdsm.distribute_tension(level, 5.0)  # at 0 N it rests
    assert told.value.joint == "slide"
    balanced = cdsm.distribute_tension(slider(one_sided=False).at([0.0, 0.0]), 5.0)
    assert abs(balanced.residual).max() < 1e-9


def test_each_number_has_one_unit() -> None:
    pose = slider(one_sided=True).at([0.0, 0.0])
    with pytest.raises(cdsm.InfeasibleTension) as told:
        cdsm.distribute_tension(pose, 5.0)
    assert re.search(r"[\d.]+ N at slide", str(told.value))
    assert " or N" not in str(told.value)
    pose = slider(one_sided=False).at([0.0, 0.0])
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 5.0))
    assert f"{K.margin:.4g} N m/rad" in str(K)
    assert "as lever" in str(K)
    assert " or N" not in str(K) + str(K.distribution)
    assert pose.arm.stiffness_unit(0) == "N/m"


def test_an_rpy_in_degrees_is_doubted() -> None:
    with pytest.warns(cdsm.CdsmWarning, match=r"joint turn: rpy 0 0 90 .* 0 0 1.571 rad"):
        slider(one_sided=False, rpy="0 0 90")


def test_limits_that_a_follower_narrows_name_it() -> None:
    arm = cdsm.Manipulator.from_urdf(DATA / "mimic_narrows.urdf", FINGER, tip="nail")
    b2 = arm.joint_names.index("b2")
    low, high = arm.lower[b2], arm.upper[b2]
    assert (low, high) == pytest.approx((0.125, 1.0))  # 0.8 b2 + 0.5 is 0.6 to 2, b2 is ±1
    with pytest.raises(cdsm.InvalidInput, match="narrowed by a3"):
        arm.at(np.full(2, 0.05))
    q = joint_angles(arm, cdsm.RandomPoses(64))
    assert not arm.beyond_limits(q).any()


def test_a_robot_without_a_possible_angle_is_refused() -> None:
    with pytest.raises(cdsm.GeometryError, match="b2 has no possible angle: a3"):
        cdsm.Manipulator.from_urdf(DATA / "mimic_no_angle.urdf", FINGER, tip="nail")


def test_a_lead_at_the_top_is_that_of_all_cables_without_their_own(tmp_path: Path) -> None:
    path = tmp_path / "cables.toml"
    sites = 'sites = [{link = "base", xyz = [0, 0, 0]}, {link = "tip", xyz = [1, 0, 0]}]'
    text = "wire = 4e4\nlead = 0.3\n" + "".join(
        f'[[cables]]\nname = "{name}"\n{sites}\n{lead}\n'
        for name, lead in (("a", "lead = 0.45"), ("b", ""), ("c", "lead = 0.0"))
    )
    path.write_text(text, encoding="utf-8")
    assert [cable.lead for cable in cdsm.read_cables(path)] == [0.45, 0.3, 0.0]


def test_degrees_given_for_radians_are_doubted() -> None:
    arm = cdsm.presets.virtual_prototype()
    with pytest.raises(cdsm.InvalidInput, match=r"radians: np\.deg2rad"):
        arm.at([10.0, 5.0] * 5)


def test_radians_given_for_degrees_and_orders_of_branches_are_noted(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    call("new", path, "--joints", 2)
    assert "in degrees, not in radians" in call("stiffness", path, "--angles", 0.14).stderr
    assert "note" not in call("stiffness", path, "--angles", 5).stderr
    robot = tmp_path / "gripper.urdf"
    joints = "".join(
        f'''<link name="{name}"><inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4"
        izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="{name}_joint"
        type="revolute"><parent link="palm"/><child link="{name}"/><origin xyz="0.1 0 0"/>
        <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'''
        for name in ("thumb", "finger")
    )
    robot.write_text(f'<robot name="hand"><link name="palm"/>{joints}</robot>', encoding="utf-8")
    cables = tmp_path / "cables.toml"
    cables.write_text(
        "wire = 4e4\n"
        + "".join(
            f'''[[cables]]\nname = "{name}{i}"\nsites = [{{link = "palm", xyz = [0, 0, {z}]}},
            {{link = "{name}", xyz = [0.1, 0, {z}]}}]\n'''
            for name in ("thumb", "finger")
            for i, z in enumerate((0.02, -0.02))
        ),
        encoding="utf-8",
    )
    arm = tmp_path / "hand.toml"
    assert call("new", arm, "--from", robot, "--cables", cables, "--tip", "thumb").exit_code == 0
    order = ", ".join(cdsm.Manipulator.read(arm).joint_names)
    assert f"those of {order}, in this order" in call("stiffness", arm, "--angles", "5,5").stderr
    assert "order" not in call("stiffness", arm, "--angles", "thumb_joint=5").stderr
