"""``cdsm identify``: friction and rigidity from a file of loops, and a plan of tests."""

import json
from pathlib import Path

import numpy as np
import pytest

import cdsm
from tests.cli.test_commands import call

ARM = """
wire = 48e3

[hinged]
joints = 1
twist = 0.0
link_length = 0.15
base_length = 0.02
disk_offset = 0.02
hole_radius = 0.025
link_mass = 0.1
lead = 0.3
friction = 0.2
"""
TRUE = {"friction": 0.1, "rigidity": 1.1}
STD = ("--reading-std", 0.005)
FREE = ("--free", "friction", "--free", "rigidity=0.5:2")


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """An arm as described, and loops that another one gave."""
    arm, loops = tmp_path / "arm.toml", tmp_path / "loops.csv"
    arm.write_text(ARM, encoding="utf-8")
    truth = cdsm.ArmParameters(cdsm.Manipulator.read(arm), tuple(TRUE))(**TRUE)
    random, forces = np.random.default_rng(2), (0.0, 8.0, 16.0, 24.0, 16.0, 8.0, 0.0)
    lines = ["test,joint1 [deg],direction,minimum [N],force [N],displacement [mm]"]
    for angle in (25.0, -23.0):
        loop = cdsm.WeightLoop(
            direction="-z",
            angles=(np.deg2rad(angle),),
            forces=forces,
            minimum=200.0,
            displacement_std=5e-6,
        ).simulated(truth, random)
        for force, read in zip(forces, np.array(loop.displacements), strict=True):
            lines.append(f"at {angle:g},{angle},-z,200,{force},{1e3 * read:.4f}")
    loops.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return arm, loops


def test_identify_finds_the_arm_that_gave_the_loops(
    files: tuple[Path, Path], tmp_path: Path
) -> None:
    png = tmp_path / "fit.png"
    result = call("identify", *files, *STD, *FREE, "--figure", png, "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert told["warnings"] == []
    for name, value in zip(told["names"], told["values_own_unit"], strict=True):
        low, high = told["interval_95"][name]
        assert low < TRUE[name] < high
        assert value == pytest.approx(TRUE[name], rel=0.05)
    assert told["freedom"] == 10
    assert png.read_bytes().startswith(b"\x89PNG")


def test_what_is_wrong_in_the_arm_is_told(files: tuple[Path, Path]) -> None:
    """The friction of the file is not that of the loops, and is not free here."""
    result = call("identify", *files, *STD, "--free", "hole_radius")
    assert result.exit_code == 3
    assert result.stdout.startswith("warning: the model does not explain the measurements")
    assert "hole_radius [mm]" in result.stdout


def test_plan_says_which_tests_to_make(files: tuple[Path, Path]) -> None:
    result = call("identify", *files, *STD, *FREE, "--plan", 4)
    assert result.exit_code == 0, result.output
    assert "times" in result.stdout
    assert "expected" in result.stdout
    told = json.loads(call("identify", *files, *STD, *FREE, "--plan", 4, "--json").stdout)
    assert sum(told["repetitions"].values()) == 4


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--free", "fricton"), "fricton"),
        (("--free", "friction=0"), "friction=0:0.5"),
        (("--free", "friction", "--free", "friction=0:1"), "given twice"),
        (("--free", "spring"), "spring=LOW:HIGH"),
        (("--free", "lead@2"), "joints 1 to 1"),
        (("--free", "friction", "--min-tension", 100), "leave out --min-tension"),
    ],
)
def test_bad_options_are_named(
    files: tuple[Path, Path], options: tuple[object, ...], said: str
) -> None:
    result = call("identify", *files, *STD, *options)
    assert result.exit_code in (1, 2)
    assert said in " ".join(result.output.replace("│", " ").split())
    wrong = call("identify", *files, "--reading-std", -1, "--free", "friction")
    assert "displacement_std" not in wrong.output
    assert "--reading-std" in wrong.output
