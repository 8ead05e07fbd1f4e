"""``cdsm track``: a loop from files, its files, and what it says when it fails."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import cdsm
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
    assert "100 % of 5 steps" in shown.stdout
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


@pytest.mark.parametrize("stiffness", ["q=15", "z=stiff", "z"])
def test_wrong_stiffness_is_refused(stiffness: str, files: tuple[Path, Path]) -> None:
    shown = call("track", *files, "--stiffness", stiffness)
    assert shown.exit_code == 2
    assert "--stiffness" in shown.stderr


def test_target_out_of_range_is_told_before_anything_moves(files: tuple[Path, Path]) -> None:
    shown = call("track", *files, "--stiffness", "z=900")
    assert shown.exit_code == 3
    assert shown.stdout.startswith("NOT REACHED at 3 of 3 samples")
