"""Motors in ARM.toml: tables by name or in a list, equal after writing, faults by their key."""

from pathlib import Path

import numpy as np
import pytest

import cdsm
from tests.support.motors import changed, spooled

ARM = """
wire = "1x19-1.2mm"
[universal]
joints = 2
cables_per_joint = 3
link_length = 0.06
base_length = 0.03
disk_offset = 0.012
hole_radius = 0.025
link_mass = 0.12
"""
NAMED = """
[motors.m1]
cables = {cable1_1 = 0.012, cable1_2 = -0.012}
stiffness = 20.0
[motors.m2]
cables = {cable2_1 = 0.012, cable2_2 = 0.012}
control = "torque"
"""
LISTED = """
[[motors]]
name = "m1"
cables = {cable1_1 = 0.012, cable1_2 = -0.012}
stiffness = 20.0
[[motors]]
name = "m2"
cables = {cable2_1 = 0.012, cable2_2 = 0.012}
control = "torque"
"""


def read(folder: Path, text: str, changes: dict[str, object] | None = None) -> cdsm.Manipulator:
    path = folder / "ARM.toml"
    path.write_text(ARM + text)
    return cdsm.Manipulator.read(path, changes=changes)


def test_tables_by_name_and_in_a_list_give_the_same_motors(tmp_path: Path) -> None:
    arm = read(tmp_path, NAMED)
    assert arm == read(tmp_path, LISTED)
    expected = (
        cdsm.Motor("m1", {"cable1_1": 0.012, "cable1_2": -0.012}, stiffness=20.0),
        cdsm.Motor("m2", {"cable2_1": 0.012, "cable2_2": 0.012}, control="torque"),
    )
    assert arm.motors.given == expected
    assert arm.motors.names == ("m1", "m2", "cable1_3", "cable2_3")
    for text in (NAMED, LISTED):
        softer = read(tmp_path, text, {"motors": {"m1": {"stiffness": 5.0}}})
        assert softer.motors.given[0].stiffness == 5.0


def test_a_written_arm_is_read_as_an_equal_one(tmp_path: Path) -> None:
    torque: dict[str, object] = {"control": "torque", "stiffness": np.inf}
    for arm in (spooled(), spooled(20.0), changed(spooled(20.0), {"m2": torque})):
        again = cdsm.Manipulator.read(arm.write(tmp_path / "ARM.toml"))
        assert again == arm
        assert again.motors.given == arm.motors.given
    assert "[motors" not in (spooled().with_motors([]).write(tmp_path / "A.toml")).read_text()


FAULTS = {
    "[motors.m1]\ncables = {}": "motors.m1: cables: none given; a motor moves one cable or more",
    "[motors.m1]\nstiffness = 5.0": "motors.m1.cables: is missing",
    "[motors.m1]\ncables = {cable1_9 = 0.01}": "motors.m1: no cable of motor 'm1' is called 'cab",
    "[motors.m1]\ncables = {cable1_1 = 0.0}": "motors.m1: radius of cable1_1: 0 m takes in no wire",
    "[motors.m1]\ncables = {cable1_1 = 0.01}\nstiffness = -1.0": "motors.m1.stiffness: -1 N m/rad",
    "[motors.m1]\ncables = {cable1_1 = 0.01}\nstifness = 1.0": "did you mean 'stiffness'",
    "[motors.m1]\ncables = {cable1_1 = 0.01}\ncontrol = 'force'": "motors.m1.control",
    "[[motors]]\ncables = {cable1_1 = 0.01}": r"motors\[1\].name: is missing",
    LISTED + LISTED: r"motors\[3\].name: 'm1' is used twice",
    "[motors.m1]\ncables = {cable1_1 = 0.01}\n[motors.m2]\ncables = {cable1_1 = 0.02}": (
        "motors: m1, m2 do the same: turned together they move no cable"
    ),
    "[motors.m1]\ncables = {cable1_1 = 0.01}\n[cables.cable1_1]\ncontrol = 'force'": (
        "motors.m1: cable1_1 has control='force', which belongs to its motor"
    ),
}


@pytest.mark.parametrize("text", FAULTS)
def test_a_fault_is_told_at_its_key(tmp_path: Path, text: str) -> None:
    with pytest.raises(cdsm.FileError, match=FAULTS[text]):
        read(tmp_path, text)
