"""``cdsm new`` writes arms that every command takes at once; so are the files of examples/."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import cdsm
from tests.cli.test_commands import call

EXAMPLES = Path(__file__).parents[2] / "examples"
KINDS = {
    "arm.toml": ("--universal", 4),
    "alternating_hinges.toml": ("--hinged", 6),
    "two_sections.toml": ("--sections", "3,2"),
}


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.filterwarnings("error::cdsm.CdsmWarning")
def test_new_writes_the_examples_and_they_run(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    told = call("new", path, *KINDS[name])
    assert told.exit_code == 0, told.output
    assert path.read_bytes() == (EXAMPLES / name).read_bytes()
    text = path.read_text(encoding="utf-8")
    assert max(map(len, text.splitlines())) <= 110
    arm = cdsm.Manipulator.read(path)
    assert cdsm.Manipulator.read(arm.write(tmp_path / "again.toml")) == arm
    for angles in (0.0, 8.0):
        pose = arm.at(np.full(arm.nv, np.deg2rad(angles)))
        assert cdsm.stiffness(pose, cdsm.distribute_tension(pose, 10.0)).is_stable
    assert call("check", path, "--angles", 5).exit_code == 0


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
        same = key.startswith(("#original_length", "#control"))  # they show the default
        assert (cdsm.Manipulator.read(path) == usual) == same, key
    rest = text[text.index("#[cables") :]
    path.write_text(text.replace(rest, re.sub(r"(?m)^#(?=[a-z\[])", "", rest)), encoding="utf-8")
    used = cdsm.Manipulator.read(path)
    assert used.cables[0].minimum == 20.0
    assert len(used.tolerances.given) == 8


def test_new_takes_sizes_in_mm_and_degrees(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    sizes = ("--link-length", 50, "--base-length", 20, "--disk-offset", 4, "--hole-radius", 15)
    more = ("--link-mass", 0.2, "--lead", 0, "--wire", 48e3, "--gravity", "0,-9.81,0")
    told = call("new", path, "--hinged", 3, "--twist", 30, *sizes, *more, "--json")
    assert json.loads(told.stdout)["written"] == [str(path)]
    geometry = cdsm.Geometry.hinged(
        joints=3,
        twist=np.deg2rad(30.0),
        spread=np.deg2rad(10.0),
        link_length=0.05,
        base_length=0.02,
        disk_offset=0.004,
        hole_radius=0.015,
        link_mass=0.2,
    )
    expected = cdsm.Manipulator(geometry, cdsm.LinearElasticity(48e3), gravity=(0.0, -9.81, 0.0))
    assert cdsm.Manipulator.read(path) == expected


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        ((), 2, "give one of --universal, --hinged and --sections"),
        (("--universal", 3, "--hinged", 2), 2, "give one of --universal, --hinged and --sections"),
        (("--universal", 3, "--twist", 30), 2, "goes with --hinged only"),
        (("--universal", 0), 2, "'--universal': Input should be greater than or equal to 1"),
        (("--universal", 3, "--disk-offset", 40), 2, "--disk-offset: too large"),
        (("--universal", 3, "--link-length", 0.06), 2, "Options take mm and degrees."),
        (("--universal", 3, "--hole-radius", 0), 2, "--hole-radius: 0 m given"),
        (("--universal", 3, "--wire", "1x9-1.2mm"), 1, "did you mean '1x19-1.2mm'"),
        (("--universal", 3, "--gravity", "1,2"), 2, "give 3"),
        (("--sections", "3,x"), 2, "'x' is no number"),
        (("--sections", "3,0"), 2, "joints: input should be greater than or equal to 1"),
    ],
)
def test_bad_options_are_named_and_write_nothing(
    arguments: tuple[object, ...], code: int, said: str, tmp_path: Path
) -> None:
    told = call("new", tmp_path / "arm.toml", *arguments)
    assert told.exit_code == code
    assert said in " ".join(told.stderr.replace("│", " ").split())
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_not_overwritten_unasked(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text("mine", encoding="utf-8")
    told = call("new", path, "--universal", 2)
    assert told.exit_code == 2
    assert "--overwrite" in told.stderr
    assert path.read_text(encoding="utf-8") == "mine"
    assert call("new", path, "--universal", 2, "--overwrite").exit_code == 0
    assert cdsm.Manipulator.read(path).nv == 4


@pytest.mark.filterwarnings("default::cdsm.CdsmWarning")
def test_a_command_shows_a_warning_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    text = (EXAMPLES / "alternating_hinges.toml").read_text(encoding="utf-8")
    path.write_text(text.replace("\nspread", "\n#spread"), encoding="utf-8")
    told = call("stiffness", path, "--angles", 3)
    assert told.exit_code == 0
    (line,) = told.stderr.splitlines()
    assert line.startswith("warning: arm: cables share holes: cable1_1 and cable3_2 and cable5_1; ")
