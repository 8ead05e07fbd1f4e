"""``cdsm track``: a loop from files, its files, and what it says when it fails."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import cdsm
from cdsm.cli.path_file import read_path
from tests.cli.test_commands import call
from tests.support.tracking import small_path


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """The small arm and its path as files."""
    plan = small_path()
    rows = [",".join(f"{name} [deg]" for name in plan.arm.joint_names)]
    rows += [",".join(f"{angle:.10g}" for angle in row) for row in np.rad2deg(plan.angles)]
    path = tmp_path / "path.csv"
    path.write_text("\n".join(rows), encoding="utf-8")
    return plan.arm.write(tmp_path / "arm.toml"), path


def test_track_tells_and_writes_what_the_api_does(files: tuple[Path, Path], tmp_path: Path) -> None:
    out, png, gif = (tmp_path / f"run.{kind}" for kind in ("nc", "png", "gif"))
    options = ["--stiffness", "z=15", "--friction", "0.1", "--tension-noise", "0.5", "--steps", "2"]
    options += ["--max-tension", "250", "--true-rigidity", "0.9", "--payload", "0.1"]
    shown = call("track", *files, *options, "--out", out, "--figure", png, "--animate", gif)
    assert shown.exit_code == 0, shown.output
    assert "law stiffness: 5 steps, completed" in shown.stdout
    assert "\nfrictionless stiffness error, mean and largest  " in shown.stdout
    assert "100 % of 5 proved steps (0 not proved)" in shown.stdout
    plan = small_path(0.1)
    plan = cdsm.plan_path(plan.arm, "z", 15e3, 10.0, 250.0, angles=plan.angles, progress=False)
    run = cdsm.track(
        plan,
        plant=cdsm.SlowPlant(cdsm.control.with_rigidity(plan.arm, 0.9)),
        sensors=cdsm.Sensors(tension_noise=0.5),
        minimum=10.0,
        maximum=250.0,
        payload=0.1,
        steps=2,
        bands=0,
    )
    with xr.open_dataset(out) as data:
        np.testing.assert_allclose(data["tip"], run.tips, atol=1e-9)
        np.testing.assert_allclose(data["stiffness"], run.stiffness, rtol=1e-6)
    assert png.stat().st_size > 10_000
    assert gif.read_bytes()[:3] == b"GIF"


def test_loop_that_fails_is_told_first_and_ends_with_three(files: tuple[Path, Path]) -> None:
    options = ["--stiffness", "z=15", "--payload", "40", "--bands", "0", "--json"]
    shown = call("track", *files, *options)
    assert shown.exit_code == 3
    told = json.loads(shown.stdout)
    assert told["outcome"] != "completed"
    assert told["warnings"][0].startswith(("UNSTABLE", "BUCKLES", "WIRE"))


def test_mujoco_moves_the_arm_and_its_motion_is_a_path(
    files: tuple[Path, Path], tmp_path: Path
) -> None:
    pytest.importorskip("mujoco")
    options = ["--stiffness", "z=15", "--plant", "mujoco", "--felt", "4", "--true-rigidity", "0.9"]
    motion = tmp_path / "motion.csv"
    shown = call("track", *files, *options, "--max-tension", "250", "--animate", motion)
    assert shown.exit_code == 0, shown.output
    assert "% off at 3 steps" in shown.stdout
    path = read_path(motion, small_path().arm)
    assert path.angles is not None
    assert abs(path.angles[-1] - small_path().angles[-1]).max() < np.deg2rad(0.5)
    refused = call("track", *files, *options, "--friction", "0.1")
    assert "has friction" in refused.stderr
    assert "--true-friction 0" in refused.stderr
    allowed = [*options, "--friction", "0.05", "--true-friction", "0", "--steps", "1"]
    assert call("track", *files, *allowed).exit_code == 0


def test_without_mujoco_its_extra_is_named(
    files: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    shown = call("track", *files, "--stiffness", "z=15", "--plant", "mujoco")
    assert shown.exit_code == 1
    assert "mujoco is not installed" in shown.stderr


@pytest.mark.parametrize("stiffness", ["q=15", "z=stiff", "z", "z=-4", "z=nan", "z=inf", "z=0"])
def test_wrong_stiffness_is_refused(stiffness: str, files: tuple[Path, Path]) -> None:
    shown = call("track", *files, "--stiffness", stiffness)
    assert shown.exit_code == 2
    assert "--stiffness" in shown.stderr


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--law", "pid", "no law is called 'pid'"),
        ("--plant", "gazebo", "'gazebo' is not one of 'slow'"),
        ("--payload", "nan", "--payload: nan"),
        ("--payload", "-1", "--payload: -1 kg"),
        ("--payload-from", "2", "--payload-from: 2 given"),
        ("--true-rigidity", "0", "--true-rigidity"),
        ("--true-rigidity", "nan", "--true-rigidity"),
        ("--true-friction", "-0.1", "--true-friction: -0.1"),
        ("--encoder", "-1", "--encoder: -0.001 m"),
        ("--tension-noise", "-1", "--tension-noise: -1 N given; 0, or"),
        ("--tension-bias", "nan", "--tension-bias: nan"),
        ("--delay", "-1", "--delay: -1"),
        ("--steps", "0", "--steps: 0"),
        ("--period", "-1", "--period: -1 s"),
        ("--rate", "0", "--rate: 0 N"),
        ("--bands", "-1", "--bands: -1"),
        ("--felt", "-1", "--felt: -1"),
        ("--seed", "-1", "--seed: -1"),
        ("--max-tension", "5", "--max-tension: 5 N"),
    ],
)
def test_each_wrong_option_is_named(
    option: str, value: str, said: str, files: tuple[Path, Path]
) -> None:
    """And no file is written."""
    shown = call("track", *files, "--stiffness", "z=15", f"{option}={value}")
    assert shown.exit_code in (1, 2)
    assert said in " ".join(shown.stderr.replace("│", " ").split())
    assert sorted(path.name for path in files[0].parent.iterdir()) == ["arm.toml", "path.csv"]


def test_path_without_columns_is_named(files: tuple[Path, Path]) -> None:
    files[1].write_text("a,b\n1,2\n", encoding="utf-8")
    shown = call("track", *files, "--stiffness", "z=15")
    assert shown.exit_code == 1
    assert "path.csv: has columns for neither of joint angles" in shown.stderr


def test_misspelt_columns_and_unknown_joints_are_refused(
    files: tuple[Path, Path],
) -> None:
    path = files[1].read_text(encoding="utf-8")
    for old, new in (("joint2", "joint9"), ("\n", ",targt [N/mm]\n")):
        files[1].write_text(path.replace(old, new, 1), encoding="utf-8")
        shown = call("track", *files, "--stiffness", "z=15")
        assert shown.exit_code == 1
        assert "did you mean" in shown.stderr
    files[1].write_text(path.replace("\n", ",joint3_1 [deg]\n", 1), encoding="utf-8")
    shown = call("track", *files, "--stiffness", "z=15")
    assert "has a column joint3_1, which is not known" in shown.stderr
    files[1].write_text(path.replace("\n", ",time [s]\n", 1), encoding="utf-8")
    assert read_path(files[1], cdsm.Manipulator.read(files[0])).angles is not None


def test_target_out_of_range_is_told_before_anything_moves(files: tuple[Path, Path]) -> None:
    shown = call("track", *files, "--stiffness", "z=900")
    assert shown.exit_code == 3
    assert shown.stdout.startswith("NOT REACHED at 3 of 3 samples")
