"""``cdsm sweep`` and ``cdsm map``, as a user calls them."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import cdsm
from tests.cli.test_commands import SHORT, call, geometry
from tests.support.sweeps import short_arm

__all__ = ["geometry"]  # a fixture

ARM = ("--wire", 48e3, "--gravity", "0,-2,-9", "--min-tension", "20,40")


def arm() -> cdsm.Manipulator:
    described = cdsm.Geometry.from_toml(SHORT)
    return cdsm.Manipulator(described, cdsm.LinearElasticity(48e3), gravity=(0.0, -2.0, -9.0))


def test_grid_is_what_the_api_computes(
    geometry: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    out, store = tmp_path / "s.nc", tmp_path / "s.zarr"
    grid = ("--grid", "joint1_1=-20:20:5, joint3_2 = 0:10:2,joint2_1=5")
    result = call("sweep", geometry, *grid, *ARM, "--resume", store, "--out", out)
    assert result.exit_code == 0, result.output
    assert "20 ok" in result.output
    assert str(out) in result.output
    assert "resumes" not in caplog.text
    assert call("sweep", geometry, *grid, *ARM, "--resume", store, "--out", out).exit_code == 0
    assert "sweep of probe resumes: 1 of 1 chunks are kept" in caplog.text
    poses = cdsm.GridPoses(
        {
            "joint1_1": np.deg2rad(np.linspace(-20.0, 20.0, 5)),
            "joint3_2": np.deg2rad([0.0, 10.0]),
        },
        {"joint2_1": np.deg2rad(5.0)},
    )
    expected = cdsm.sweep(arm(), poses, minimum=[20.0, 40.0])
    xr.testing.assert_identical(cdsm.read_sweep(out), expected)
    xr.testing.assert_identical(cdsm.read_sweep(store), expected)


def test_random_postures_and_chosen_quantities_as_a_table(geometry: Path, tmp_path: Path) -> None:
    out = tmp_path / "s.csv"
    options = ("--random", 16, "--seed", 3, "--quantities", "tension, margin", "--min-tension", 9)
    result = call("sweep", geometry, *options, "--wire", 48e3, "-o", out)
    assert result.exit_code == 0, result.output
    header, *rows = out.read_text(encoding="utf-8").splitlines()
    assert len(rows) == 16
    assert "tension_cable1_1 [N],tension_cable1_2 [N]" in header
    assert "along" not in header


def test_path_goes_through_its_waypoints_in_degrees(geometry: Path, tmp_path: Path) -> None:
    table, out = tmp_path / "path.csv", tmp_path / "s.nc"
    names = ", ".join(f"{name} [deg]" for name in arm().joint_names)
    rows = "0,0,0,0,0,0\n0,0,0,0,30,0\n\n0,-40,0,0,30,0\n"
    table.write_text(f"{names}\n{rows}", encoding="utf-8")
    result = call("sweep", geometry, "--path", table, "--count", 8, *ARM, "--out", out)
    assert result.exit_code == 0, result.output
    q = cdsm.read_sweep(out).q
    np.testing.assert_allclose(np.rad2deg(q.sel(joint="joint3_1")[:4]), [0, 10, 20, 30], atol=1e-9)
    np.testing.assert_allclose(np.rad2deg(q.sel(joint="joint1_2")[-1]), -40.0, rtol=1e-12)
    assert not q.sel(joint="joint2_1").any()


def test_map_draws_a_sweep(tmp_path: Path) -> None:
    poses = cdsm.RandomPoses(32)
    found = cdsm.sweep(short_arm(), poses, minimum=20.0, store=tmp_path / "s.zarr")
    cdsm.write_sweep(found, tmp_path / "s.nc")
    for source, options in (("s.nc", ()), ("s.zarr", ("--section", "y=0:50"))):
        out = tmp_path / f"{source}.png"
        result = call("map", tmp_path / source, "--quantity", "along", "--out", out, *options)
        assert result.exit_code == 0, result.output
        assert out.read_bytes().startswith(b"\x89PNG")


SOFT = ("--wire", 48e3, "--spring", 0.2)


@pytest.mark.parametrize(
    ("bounds", "more", "code", "said"),
    [
        ("2,100", (*SOFT[:-1], 1.0), 0, "1 ok, 1 unstable"),
        ("50,100", SOFT, 3, "NONE of 2 entries is ok: 2 unstable"),
        (
            "20,20.5",
            ("--wire", 48e3, "--max-tension", 21),
            3,
            "NONE of 2 entries is ok: 2 infeasible",
        ),
    ],
)
def test_a_sweep_exits_with_3_if_no_entry_is_ok(
    bounds: str, more: tuple[object, ...], code: int, said: str, geometry: Path, tmp_path: Path
) -> None:
    asked = ("sweep", geometry, "--grid", "joint1_1=5:5:1", "--min-tension", bounds, *more)
    told = call(*asked, "--out", tmp_path / "s.nc")
    assert told.exit_code == code, told.output
    assert said in told.stdout
    if code == 0:  # a map that shows a posture
        assert call("map", tmp_path / "s.nc", "--out", tmp_path / "s.png").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("--random", "0"), 2, "--random"),
        (("--grid", "joint9=0:1:2"), 1, "no joint is called 'joint9'"),
        (("--grid", "joint1_1=0:1"), 2, "JOINT=LOW:HIGH:N or JOINT=ANGLE is needed"),
        (("--grid", "joint1_1=0:1:2.5"), 2, "joint1_1=0:1:2.5 given"),
        (("--grid", "joint1_1"), 2, "'joint1_1' given; JOINT=LOW:HIGH:N or"),
        (("--grid", "joint1_1=-20:20:1"), 2, "asks for 1 angle; give more, or joint1_1=ANGLE"),
        (("--grid", "joint1_1=a"), 2, "'a' is no number"),
        (("--grid", "joint1_1=3"), 2, "has no joint with several angles"),
        (("--grid", "joint1_1=10:10:3"), 2, "asks for one angle; give joint1_1=ANGLE"),
        (("--path", "{folder}/absent.csv"), 1, "absent.csv: does not exist"),
        (("--path", "{folder}/names.csv"), 1, "has columns for neither of joint angles"),
        (("--path", "{folder}/empty.csv"), 1, "holds no path"),
        (("--path", "{folder}/tips.csv"), 1, "a sweep needs joint angles"),
        (("--random", "8", "--grid", "joint1_1=0:1:2"), 2, "give one of --grid, --path"),
        ((), 2, "give one of --grid, --path"),
        (("--random", "8", "--quantities", "marign"), 1, "did you mean 'margin'"),
    ],
)
def test_failure_is_one_message(
    arguments: tuple[str, ...], code: int, said: str, geometry: Path, tmp_path: Path
) -> None:
    (tmp_path / "names.csv").write_text("a,b\n0,0\n1,1\n", encoding="utf-8")
    (tmp_path / "empty.csv").write_text("\n", encoding="utf-8")
    (tmp_path / "short.csv").write_text("joint1_1 [deg]\n0\n1\n", encoding="utf-8")
    (tmp_path / "tips.csv").write_text("x [mm],y [mm],z [mm]\n1,2,3\n", encoding="utf-8")
    given = ["--out", str(tmp_path / "s.nc"), *arguments]
    result = call("sweep", geometry, *(each.format(folder=tmp_path) for each in given))
    assert result.exit_code == code
    assert said in " ".join(result.stderr.replace("│", " ").split())
    assert "Traceback" not in result.output
    assert not (tmp_path / "s.nc").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--grid", "joint1_1=0:10:3,joint1_1=5"), "joint1_1 is given twice"),
        (("--random", "5", "--count", "3"), "goes with --path only"),
        (("--grid", "joint1_1=0:10:3", "--seed", "3"), "goes with --random only"),
    ],
)
def test_options_that_say_nothing_are_refused(
    arguments: tuple[str, ...], said: str, geometry: Path, tmp_path: Path
) -> None:
    result = call("sweep", geometry, "--out", tmp_path / "s.nc", *arguments)
    assert result.exit_code == 2
    assert said in " ".join(result.stderr.replace("│", " ").split())


def test_a_sweep_says_what_to_do_where_the_solver_failed(
    geometry: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = ("sweep", geometry, "--grid", "joint1_1=5:5:1", *ARM, "--out", tmp_path / "s.nc")
    assert "--solver" not in call(*given).output
    found = cdsm.read_sweep(tmp_path / "s.nc")
    found.status[0, 0] = cdsm.Status.SOLVER_FAILED
    monkeypatch.setattr(cdsm, "sweep", lambda *_, **__: found)
    result = call(*given)
    assert result.exit_code == 0
    assert "1 ok, 1 solver_failed" in result.output
    assert "`cdsm stiffness` says why at such a posture, and takes another --solver" in (
        " ".join(result.output.split())
    )


def test_a_map_without_a_value_is_a_warning(tmp_path: Path) -> None:
    found = cdsm.sweep(short_arm(), cdsm.RandomPoses(64), minimum=20.0, maximum=20.0)
    cdsm.write_sweep(found, tmp_path / "s.nc")
    result = call("map", tmp_path / "s.nc", "--out", tmp_path / "s.png")
    assert result.exit_code == 3
    assert "softest exists at none of 64 entries" in result.output
    assert (tmp_path / "s.png").exists()


def test_map_of_no_sweep_is_one_message(tmp_path: Path) -> None:
    result = call("map", tmp_path / "absent.nc", "--out", tmp_path / "s.png")
    assert result.exit_code == 1
    assert "absent.nc: does not exist" in result.stderr


def test_no_folder_to_resume_from_is_told(geometry: Path, tmp_path: Path) -> None:
    given = ("--random", 2, "--out", tmp_path / "s.nc", "--resume", "")
    result = call("sweep", geometry, *ARM, *given)
    assert result.exit_code == 1
    assert "is an empty path; give a file or folder" in result.stderr
