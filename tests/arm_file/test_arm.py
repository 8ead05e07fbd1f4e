"""An arm as one file: there and back with all bits, wires, and every fault by name."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cdsm
from cdsm import presets
from tests.support import strategies

SHORT = """
gravity = [0.0, -9.81, 0.0]
wire = "1x19-1.2mm"
minimum = 5.0

[universal]
joints = 2
cables_per_joint = 3
link_length = 0.05
base_length = 0.02
disk_offset = 0.01
hole_radius = 0.02
link_mass = 0.1

[cables.cable2_3]
wire = 48e3
control = "force"
maximum = 300.0
"""

ARMS = st.one_of(
    strategies.serpentine_arms(strategies.geometries(most_joints=5)),
    strategies.serpentine_arms(strategies.sectioned_geometries()),
    strategies.routed_arms(strategies.geometries(most_joints=4)),
    strategies.trees(),
)

FINGER = """
<robot name="finger">
  <link name="base"/>
  <link name="tip"><inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4"
    ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="knuckle" type="revolute"><parent link="base"/><child link="tip"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>
"""

CABLES = """
[[cables]]
name = "flexor"
sites = [{link = "base", xyz = [-0.1, 0, -0.01]}, {link = "tip", xyz = [0.03, 0, -0.01]}]
"""


def read(tmp_path: Path, text: str, wire: Any = None) -> cdsm.Manipulator:
    path = tmp_path / "arm.toml"
    path.write_text(text, encoding="utf-8")
    return cdsm.Manipulator.read(path, wire)


def test_file_by_hand_is_the_arm_it_describes(tmp_path: Path) -> None:
    sizes: dict[str, Any] = {"link_length": 0.05, "base_length": 0.02, "disk_offset": 0.01}
    sizes |= {"joints": 2, "cables_per_joint": 3, "hole_radius": 0.02, "link_mass": 0.1}
    geometry, own = cdsm.Geometry.universal(**sizes), cdsm.LinearElasticity(48e3)
    cables = [
        replace(cable, minimum=5.0)
        for cable in cdsm.serpentine_cables(geometry, presets.STRAND_1X19)
    ]
    cables[5] = replace(cables[5], elasticity=own, control="force", maximum=300.0)
    arm = read(tmp_path, SHORT)
    assert arm == cdsm.Manipulator(geometry, cables=cables, gravity=(0.0, -9.81, 0.0))
    assert cdsm.Geometry.read(tmp_path / "arm.toml") == geometry


@settings(max_examples=30, deadline=None, derandomize=True)
@given(arm=ARMS, gravity=strategies.gravities)
def test_written_arm_is_read_back_with_all_bits(
    tmp_path_factory: pytest.TempPathFactory,
    arm: cdsm.Manipulator,
    gravity: tuple[float, float, float],
) -> None:
    path = tmp_path_factory.mktemp("arm") / "arm.toml"
    arm = arm.with_gravity(gravity)
    assert cdsm.Manipulator.read(arm.write(path)) == arm
    by_urdf = cdsm.Manipulator.from_urdf(
        arm.urdf,
        arm.cables,
        tip=arm.tip_link,
        joint_names=arm.joint_names[::-1],
        gravity=gravity,
    )
    again = cdsm.Manipulator.read(by_urdf.write(path))
    assert again == by_urdf
    assert again.joint_names == arm.joint_names[::-1]
    if arm.is_serpentine:
        assert cdsm.Geometry.read(arm.write(path)) == arm.geometry
        assert cdsm.Geometry.from_toml(arm.geometry.to_toml()) == arm.geometry


@pytest.mark.parametrize("text", [FINGER, FINGER.replace("\n", "\r\n")])
def test_urdf_is_a_file_beside_it_or_text_inside(tmp_path: Path, text: str) -> None:
    robots = tmp_path / "robots"
    robots.mkdir()
    (robots / "finger.urdf").write_bytes(text.encode())
    head = 'wire = 48e3\n[urdf]\ntip = "tip"\nfile = "robots/finger.urdf"\n'
    arm = read(tmp_path, head + CABLES)
    assert arm == cdsm.Manipulator.from_urdf(robots / "finger.urdf", arm.cables, tip="tip")
    # what is written holds the text, so it may stand anywhere
    assert cdsm.Manipulator.read(arm.write(robots / "copy.toml")) == arm


def test_reading_of_stretched_lengths_is_gone_from_files(tmp_path: Path) -> None:
    arm = read(tmp_path, SHORT)
    with pytest.warns(cdsm.CdsmWarning, match="original_length.*may be left out"):
        assert read(tmp_path, 'original_length = "unstrained"\n' + SHORT) == arm
    with pytest.raises(cdsm.FileError, match="original_length: 'stretched' given; leave the key"):
        read(tmp_path, 'original_length = "stretched"\n' + SHORT)
    assert "original_length" not in arm.write(tmp_path / "written.toml").read_text()


def test_arm_without_a_wire_asks_for_one(tmp_path: Path) -> None:
    text = SHORT.replace('wire = "1x19-1.2mm"\n', "")
    with pytest.raises(cdsm.FileError, match=r"has no wire for the cables cable1_1, .*--set wire="):
        read(tmp_path, text)
    assert cdsm.Geometry.read(tmp_path / "arm.toml").joints
    law = cdsm.TabulatedElasticity((0.0, 50.0, 400.0), (0.0, 2e-3, 8e-3))
    file = law.write(tmp_path / "wire.toml")
    for wire, expected in (
        ("1x19-1.2mm", presets.STRAND_1X19),
        (48e3, cdsm.LinearElasticity(48e3)),
        (law, law),
        (file, law),
        (str(file), law),
    ):
        arm = read(tmp_path, text, wire)
        assert {cable.elasticity for cable in arm.cables} == {expected}  # also of cable2_3
    with pytest.raises(cdsm.InvalidInput, match=r"did you mean '1x19-1\.2mm'"):
        read(tmp_path, text, "1x9-1.2mm")


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("gravity = [", "gravty = [", "did you mean 'gravity'?"),
        ("-9.81", "-9.81e9", "gravity"),
        ("[0.0, -9.81, 0.0]", "9.81", "gravity in base axes [m/s²], or an axis such as -z"),
        ("minimum = 5.0", "minimum = -5.0", "minimum: -5 N given; cables only pull"),
        ("minimum = 5.0", "minimum = 5.0\nmaximum = 2.0", "maximum: 2 N given, below the minimum"),
        ("minimum = 5.0", "lead = 5.0", "lead: stands outside [universal]"),
        (
            'wire = "1x19-1.2mm"',
            'wire = "1x19"',
            "wire: no wire is called '1x19'; did you mean '1x19-1mm'",
        ),
        ('wire = "1x19-1.2mm"', "wire = {kind = 'linear'}", "wire.rigidity: is missing"),
        ("[cables.cable2_3]", "[cables.cable2_4]", "no cable is called 'cable2_4'; did you mean"),
        ("control =", "contrl =", "cables.cable2_3.contrl: is not a key that is known here; did"),
        ("joints = 2", "joints = 0", "- universal.joints: "),
        ("joints = 2", "# joints", "- universal.joints: is missing"),
        (
            "joints = 2",
            "jonits = 2",
            "universal.jonits: is not a key that is known here; did you mean 'joi",
        ),
        ("[universal]", "[universal", "is not TOML"),
    ],
)
def test_faults_are_named(before: str, after: str, said: str, tmp_path: Path) -> None:
    assert before in SHORT
    with pytest.raises(cdsm.FileError, match=f"arm.toml: (?s:.*){re.escape(said)}"):
        read(tmp_path, SHORT.replace(before, after, 1))


@pytest.mark.parametrize(
    ("stem", "text", "name"),
    [
        ("SNAKE", "[universal]\n", "SNAKE"),
        ("my arm-2", "[universal]\n", "my_arm_2"),
        ("2arm", "[universal]\n", "arm"),  # no name of a robot begins with a digit
        ("SNAKE", '[universal]\nname = "own"\n', "own"),
        ("SNAKE", "[[sections]]\n[sections.universal]\n", "SNAKE"),
    ],
)
def test_an_arm_without_a_name_has_that_of_its_file(
    stem: str, text: str, name: str, tmp_path: Path
) -> None:
    sizes = "joints = 2\ncables_per_joint = 3\nlink_length = 0.05\nbase_length = 0.02\n"
    sizes += "disk_offset = 0.01\nhole_radius = 0.02\nlink_mass = 0.1\n"
    file = tmp_path / f"{stem}.toml"
    file.write_text(f"wire = 48e3\n{text}{sizes}", encoding="utf-8")
    arm = cdsm.Manipulator.read(file)
    assert arm.name == cdsm.Geometry.read(file).name == name
    again = arm.write(tmp_path / "another.toml")  # what is written keeps its name
    assert cdsm.Manipulator.read(again) == arm
    assert arm.at([0.0] * arm.nv).plot().get_title(loc="left").startswith(f"{name}: ")
