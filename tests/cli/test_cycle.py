"""``cdsm cycle`` and the friction of ``cdsm weigh``."""

import json
from pathlib import Path

import numpy as np
import pytest

import cdsm
from tests.cli.test_commands import SHORT, call

OPTIONS = ("--angles", 12, "--min-tension", 60, "--wire", "48000", "--friction", 0.15)


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    path = tmp_path / "probe.toml"
    path.write_text(SHORT, encoding="utf-8")
    return path


def test_cycle_writes_and_draws_the_loop_of_the_api(arm: Path, tmp_path: Path) -> None:
    csv, png = tmp_path / "loop.csv", tmp_path / "loop.png"
    asked = ("cycle", arm, *OPTIONS, "--force", "0,0,6", "--steps", 3, "--cycles", 1)
    result = call(*asked, "-o", csv, "--figure", png, "--json")
    assert result.exit_code == 0, result.output
    numbers = json.loads(result.stdout)
    wrenches = np.array(numbers["wrenches_N_and_Nm"])
    np.testing.assert_allclose(wrenches[:, 2], [2, 4, 6, 4, 2, 0, -2, -4, -6, -4, -2, 0])
    law = cdsm.LinearElasticity(48e3)
    pose = (
        cdsm.Manipulator(cdsm.Geometry.read(arm), law)
        .with_friction(0.15)
        .at(np.full(6, np.deg2rad(12.0)))
    )
    pull = cdsm.distribute_tension(pose, 60.0)
    history = cdsm.load_cycle(pose, pull, wrenches)
    np.testing.assert_array_equal(numbers["displacement_m"], history.displacement)
    assert numbers["lost_in_last_cycle_J"] == pytest.approx(history.dissipated.sum())
    assert numbers["computed_with"]["friction"] == "included"
    lines = csv.read_text(encoding="utf-8").splitlines()
    assert len(lines) == 13
    assert lines[0].startswith("load,wrenches fx [N and N m]")
    assert png.read_bytes().startswith(b"\x89PNG")
    text = call(*asked).output
    assert "friction 0.15" in text
    assert "the last cycle loses" in text


def test_cycle_writes_netcdf(arm: Path, tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    path = tmp_path / "loop.nc"
    result = call(
        *("cycle", arm, *OPTIONS, "--force", "0,0,4", "--steps", 2, "--one-sided"), "-o", path
    )
    assert result.exit_code == 0, result.output
    with xarray.open_dataset(path) as data:
        np.testing.assert_allclose(data["wrenches"].sel(component="fz"), [2.0, 4.0, 2.0, 0.0] * 2)


def test_weigh_says_which_weights_measure_what(arm: Path) -> None:
    result = call("weigh", arm, *OPTIONS, "--force", "0,0,3")
    assert result.exit_code == 0, result.output
    assert "all cables stick: a weight measures" in result.output
    assert "take the difference of two weights" in result.output
    numbers = json.loads(call("weigh", arm, *OPTIONS, "--force", "0,0,3", "--json").stdout)
    assert 0.0 < numbers["breakaway_load_N"] < numbers["sliding_load_N"] <= 3.0
    assert numbers["stuck_N_per_m"] > numbers["stiffness_N_per_m"]
    assert numbers["stiffness_N_per_m"] > numbers["frictionless_N_per_m"]


def test_friction_beyond_reason_is_refused(arm: Path) -> None:
    result = call("weigh", arm, "--friction", -0.1, "--force", "0,0,3")
    assert result.exit_code == 1
    assert "friction: -0.1 given" in result.output


def test_stiffness_says_below_which_load_the_stuck_arm_is_measured(arm: Path) -> None:
    result = call("stiffness", arm, *OPTIONS, "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)["sticking"]
    law = cdsm.LinearElasticity(48e3)
    pose = (
        cdsm.Manipulator(cdsm.Geometry.read(arm), law)
        .with_friction(0.15)
        .at(np.full(6, np.deg2rad(12.0)))
    )
    pull = cdsm.distribute_tension(pose, 60.0)
    text = call("stiffness", arm, *OPTIONS).output
    assert "small loads measure (cables stuck, μ = 0.15, rigid links, tangent):" in text
    for axis in "xyz":
        found = cdsm.breakaway(pose, pull, axis)
        stuck = found.stiffness.along(axis)
        assert told[axis] == {
            "stuck_N_per_m": pytest.approx(stuck, rel=1e-9),
            "breakaway_N": pytest.approx(found.load, rel=1e-9),
        }
        assert f"along {axis} {stuck / 1000.0:.4g} N/mm below {found.load:.4g} N" in text
    assert "stuck" not in call("stiffness", arm, *OPTIONS[:-2]).output
    straight = ("--angles", 0, *OPTIONS[2:])
    assert "sticking" not in json.loads(call("stiffness", arm, *straight, "--json").stdout)
