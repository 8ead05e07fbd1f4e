"""``cdsm new`` writes arms that every command takes at once; so are the files of examples/."""

import re
from pathlib import Path

import numpy as np
import pytest

import cdsm
from tests.cli.test_commands import call

EXAMPLES = Path(__file__).parents[2] / "examples"
KINDS = {
    "arm.toml": (),
    "alternating_hinges.toml": ("--type", "hinged", "--joints", 6),
    "two_sections.toml": ("--joints", "3,2"),
}


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.filterwarnings("error::cdsm.CdsmWarning")
def test_new_writes_the_examples_and_they_run(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    told = call("new", path, *KINDS[name])
    assert told.exit_code == 0, told.output
    assert path.read_bytes() == (EXAMPLES / name).read_bytes()
    assert max(map(len, path.read_text(encoding="utf-8").splitlines())) <= 110
    arm = cdsm.Manipulator.read(path)
    for angles in (0.0, 8.0):
        pose = arm.at(np.full(arm.nv, np.deg2rad(angles)))
        assert cdsm.stiffness(pose, cdsm.distribute_tension(pose, 10.0)).is_stable
    assert call("stiffness", path, "--angles", 5, "--check").exit_code == 0


@pytest.mark.parametrize("name", KINDS)
def test_every_key_behind_a_hash_may_be_used(name: str, tmp_path: Path) -> None:
    text = (EXAMPLES / name).read_text(encoding="utf-8")
    keys = [line for line in text.splitlines() if re.match(r"#[a-z\[]", line)]
    assert len(keys) >= 14
    usual = cdsm.Manipulator.read(EXAMPLES / name)
    path = tmp_path / name
    for key in keys[: keys.index("#[cables.cable1_1]")]:
        changed = text.replace(key, key[1:], 1)
        if key.startswith("#hole_angles"):
            changed = re.sub(r"\ncables_per_joint = .*", "", changed, count=1)
        path.write_text(changed, encoding="utf-8")
        same = key.startswith("#control")  # it shows the default
        assert (cdsm.Manipulator.read(path) == usual) == same, key
    rest = text[text.index("#[cables") :]
    path.write_text(text.replace(rest, re.sub(r"(?m)^#(?=[a-z\[])", "", rest)), encoding="utf-8")
    used = cdsm.Manipulator.read(path)
    assert used.cables[0].minimum == 20.0
    assert len(used.tolerances.given) == 8


@pytest.mark.parametrize("joints", ["4", "3,3"])
@pytest.mark.filterwarnings("error::cdsm.CdsmWarning")
def test_new_writes_arms_whose_links_roll(joints: str, tmp_path: Path) -> None:
    path = tmp_path / "roll.toml"
    told = call("new", path, "--type", "rolling", "--joints", joints)
    assert told.exit_code == 0, told.output
    text = path.read_text(encoding="utf-8")
    assert max(map(len, text.splitlines())) <= 110
    assert "from each contact to the disks before and after it" in text
    arm = cdsm.Manipulator.read(path)
    ends = [joint.rolls for joint in arm.geometry.joints]
    assert ends == [(0.025, 0.025)] * 4 if joints == "4" else ends[3] == (0.01875, 0.01875)
    for angles in (0.0, 5.0):
        pose = arm.at(np.full(arm.nv, np.deg2rad(angles)))
        assert cdsm.stiffness(pose, cdsm.distribute_tension(pose, 10.0)).is_stable
    assert call("stiffness", path, "--angles", 5, "--check").exit_code == 0
    # holes are on the rims: a pair straightens the arm
    (joint, *_) = arm.geometry.joints
    assert joint.rolls is not None
    radius = joint.rolls[0]
    hole = (joint.hole_radius or arm.geometry.hole_radius) / radius
    assert joint.disk_offset == pytest.approx(radius * (1.0 - np.sqrt(1.0 - hole**2)))
