"""The command line speaks its own words: options, units, warnings first, errors as JSON."""

import json
from pathlib import Path

import numpy as np
import pytest

import cdsm
from tests.cli.test_commands import call, geometry

__all__ = ["geometry"]  # a fixture

LAW = cdsm.LinearElasticity(48e3)
STEEL = ("--wire", 48e3)
SOFT = ("--wire", 1e9, "--spring", 0.2, "--min-tension", 60, "--angles", 5)


def said(text: str) -> str:
    """Return the words of a message that may be wrapped and framed."""
    return " ".join(text.replace("│", " ").split())


def test_stiffness_with_tolerances_says_how_sure_it_is(geometry: Path, tmp_path: Path) -> None:
    file = tmp_path / "T.toml"
    file.write_text("rigidity = 0.05\njoint_angle = 0.01\n", encoding="utf-8")
    asked = ("stiffness", geometry, *STEEL, "--angles", 5, "--tolerances", file)
    numbers = json.loads(call(*asked, "--json").stdout)["uncertainty"]
    arm = cdsm.Manipulator(cdsm.Geometry.read(geometry), cdsm.LinearElasticity(48e3))
    pose = arm.at(np.full(arm.nv, np.deg2rad(5.0)))
    budget = cdsm.uncertainty(
        pose, cdsm.distribute_tension(pose, 10.0), cdsm.Tolerances.read(file), direction="z"
    )
    assert numbers["z"]["standard_uncertainty_N_per_m"] == pytest.approx(
        budget.standard_uncertainty
    )
    shown = call(*asked).stdout
    assert budget.shown in shown
    assert "of it joint angle" in shown


def test_check_says_how_sure_its_stiffness_is(geometry: Path, tmp_path: Path) -> None:
    file = tmp_path / "T.toml"
    file.write_text("rigidity = 0.05\n", encoding="utf-8")
    asked = (geometry, *STEEL, "--angles", 5, "--tolerances", file)
    numbers = [json.loads(call(each, *asked, "--json").stdout) for each in ("check", "stiffness")]
    assert numbers[0]["uncertainty"] == numbers[1]["uncertainty"]
    table = call("stiffness", *asked).stdout.split("\n\n")[-1]
    assert table.startswith("uncertainty [N/mm]")
    assert call("check", *asked).stdout.endswith(f"\n\n{table}")


def test_stiffness_in_one_more_direction(geometry: Path, tmp_path: Path) -> None:
    file = tmp_path / "T.toml"
    file.write_text("rigidity = 0.05\n", encoding="utf-8")
    more = ("--friction", 0.1, "--tolerances", file, "--direction", "1,0,-2")
    asked = ("stiffness", geometry, *STEEL, "--angles", 5, *more)
    arm = cdsm.Manipulator(cdsm.Geometry.read(geometry), cdsm.LinearElasticity(48e3))
    pose = arm.with_friction(0.1).at(np.full(arm.nv, np.deg2rad(5.0)))
    tension, u = cdsm.distribute_tension(pose, 10.0), (1.0, 0.0, -2.0)
    along = cdsm.stiffness(pose, tension).along(u)
    first = cdsm.breakaway(pose, tension, u)
    told = json.loads(call(*asked, "--json").stdout)
    assert told["along_direction_N_per_m"] == pytest.approx(along)
    assert told["sticking"]["1,0,-2"]["breakaway_N"] == pytest.approx(first.load)
    assert told["uncertainty"]["1,0,-2"]["value_N_per_m"] == pytest.approx(along)
    text = call(*asked).stdout
    assert f"along 1,0,-2: {along / 1e3:.4g} N/mm\n" in text
    stuck = first.stiffness.along(u) / 1e3
    assert f"along 1,0,-2 {stuck:.4g} N/mm below {first.load:.4g} N\n" in text


@pytest.mark.parametrize(
    ("command", "more"),
    [
        ("stiffness", ()),
        ("check", ()),
        ("weigh", ("--mass", 0.01)),
        ("cycle", ("--mass", 0.01)),
        ("buckle", ()),
        ("plan", ("--direction", "z", "--target", 54.86, "--max-tension", 100)),
    ],
)
def test_posture_and_tip_are_told(geometry: Path, command: str, more: tuple[object, ...]) -> None:
    arm = cdsm.Manipulator(cdsm.Geometry.read(geometry), cdsm.LinearElasticity(48e3))
    x, y, z = 1e3 * arm.at(np.full(arm.nv, np.deg2rad(0.1))).tip[:3, 3]
    told = call(command, geometry, *STEEL, "--angles", 0.1, *more).stdout
    degrees = ", ".join(["0.1°"] * arm.nv)
    assert f"\nat {degrees}; tip at ({x:.4g}, {y:.4g}, {z:.4g}) mm\n" in told


def test_an_infinite_mass_is_refused(geometry: Path) -> None:
    told = call("weigh", geometry, *STEEL, "--mass", "inf")
    assert told.exit_code == 2
    assert "Invalid value for '--mass': " in said(told.stderr)


# --- warnings first -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "first"),
    [
        (("stiffness", *SOFT), "UNSTABLE: the arm buckles"),
        (("check", *SOFT), "FAIL: the report says why."),
        (("export", *SOFT, "--out", "{folder}/arm.xml"), "UNSTABLE: "),
        (("weigh", *SOFT, "--mass", 0.1), "UNSTABLE: the arm buckles"),
        (
            ("sweep", *SOFT[:-2], "--grid", "joint1_1=5:6:2", "--out", "{folder}/s.csv"),
            "NONE of 2 entries is ok: 2 unstable",
        ),
        (
            ("buckle", *SOFT, "--force", "0,0,-1"),
            "UNSTABLE at every lower bound",
        ),
        (
            ("plan", *STEEL, "--direction", "z", "--path", "{folder}/path.csv", "--target", 1e6),
            "NOT REACHED at 1 of 1 sample",
        ),
    ],
)
def test_danger_is_the_first_line_and_exit_code_3(
    arguments: tuple[object, ...], first: str, geometry: Path, tmp_path: Path
) -> None:
    (tmp_path / "path.csv").write_text("joint1_1 [deg]\n5\n", encoding="utf-8")
    command, *rest = (str(each).format(folder=tmp_path) for each in arguments)
    told = call(command, geometry, *rest, *(("--max-tension", 300) if command == "plan" else ()))
    assert told.exit_code == 3, told.output
    assert told.stdout.startswith(first)
    as_json = call(command, geometry, *rest, "--json")
    assert as_json.exit_code == 3
    assert json.loads(as_json.stdout)["warnings"][0].startswith(first)


def test_nothing_is_wrong_with_a_stable_arm(geometry: Path) -> None:
    told = call("stiffness", geometry, *STEEL, "--json")
    assert told.exit_code == 0
    assert json.loads(told.stdout)["warnings"] == []


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (("stiffness", "--max-tension", 10, "--wrench", "0,0,-90,0,0,0"), "InfeasibleTension"),
        (("plan", "--direction", "z", "--target", "9e9", "--max-tension", 99), "UnreachableStiff"),
    ],
)
def test_what_the_arm_cannot_do_is_exit_code_3_too(
    arguments: tuple[object, ...], error: str, geometry: Path
) -> None:
    command, *rest = arguments
    told = call(command, geometry, *STEEL, *rest)
    assert told.exit_code == 3
    assert told.stderr.startswith("error: ")
    as_json = call(command, geometry, *STEEL, *rest, "--json")
    assert as_json.exit_code == 3
    assert json.loads(as_json.stdout)["error"].startswith(error)


# --- errors as JSON -------------------------------------------------------------------------


def test_an_error_is_an_object_if_json_is_asked_for(geometry: Path) -> None:
    told = call("stiffness", geometry, *STEEL, "--angles", "joint2_1=80", "--json")
    assert told.exit_code == 1
    assert told.stderr == ""
    error = json.loads(told.stdout)
    assert error["error"] == "JointLimitError"
    assert error["message"].startswith("joint2_1 = 80° is outside -53.13° to 53.13°")
    assert "Python" not in error["message"]
    assert error["data"]["joints"] == ["joint2_1"]
    np.testing.assert_allclose(error["data"]["angles"], [np.deg2rad(80.0)])


@pytest.mark.parametrize(
    "wrong",
    [("--angles", "1,2"), ("--nothing",), ("--min-tension", "much"), ("--gravity", "up")],
)
def test_an_error_of_usage_is_an_object_too(wrong: tuple[str, ...], geometry: Path) -> None:
    told = call("stiffness", geometry, *STEEL, *wrong, "--json")
    assert told.exit_code == 2
    error = json.loads(told.stdout)
    assert error["error"] == "UsageError"
    assert wrong[0] in error["message"]
    plain = call("stiffness", geometry, *STEEL, *wrong)
    assert plain.exit_code == 2
    assert plain.stdout == ""
    assert wrong[0] in plain.stderr


# --- values ---------------------------------------------------------------------------------


def numbers(*arguments: object) -> dict[str, object]:
    told = call("stiffness", *arguments, "--json")
    assert told.exit_code == 0, told.output
    found: dict[str, object] = json.loads(told.stdout)
    found.pop("computed_with")
    return found


def test_angles_by_name_are_those_in_order(geometry: Path) -> None:
    by_name = numbers(geometry, *STEEL, "--angles", "joint3_1=10, joint1_2=-5")
    in_order = numbers(geometry, *STEEL, "--angles", "0,-5,0,0,10,0")
    assert by_name == in_order
    for wrong, words in (
        ("joint1_1=1,joint1_1=2", "given twice"),
        ("joint1_1=", "1: an angle, as joint1_1=10"),
        ("joint1_1=1,2", "2"),
    ):
        assert words in said(call("stiffness", geometry, *STEEL, "--angles", wrong).stderr)
    unknown = call("stiffness", geometry, *STEEL, "--angles", "joint9=1")
    assert "no joint is called 'joint9'" in unknown.stderr


def test_force_mass_and_wrench_add_up(geometry: Path) -> None:
    one = numbers(geometry, *STEEL, "--angles", 5, "--force", "1,0,0", "--mass", 0.2)
    other = numbers(geometry, *STEEL, "--angles", 5, "--wrench", f"1,0,{0.2 * -9.81!r},0,0,0")
    assert one == other
    both = numbers(
        *(geometry, *STEEL, "--angles", 5, "--force", "1,0,0"),
        *("--wrench", f"0,0,{0.2 * -9.81!r},0,0,0"),
    )
    assert both == other
    afloat = call("weigh", geometry, *STEEL, "--mass", 0.2, "--gravity", "0,0,0")
    assert afloat.exit_code == 2
    assert "has no weight without gravity" in said(afloat.stderr)


def test_a_weight_is_a_force_or_a_mass(geometry: Path) -> None:
    mass = call("weigh", geometry, *STEEL, "--angles", 5, "--mass", 0.2, "--json")
    force = call(
        "weigh", geometry, *STEEL, "--angles", 5, "--force", f"0,0,{0.2 * -9.81!r}", "--json"
    )
    assert mass.stdout == force.stdout
    neither = call("weigh", geometry, *STEEL)
    assert neither.exit_code == 2
    assert "give it or --mass" in said(neither.stderr)


def test_axes_are_directions_and_gravity(geometry: Path) -> None:
    for axis, vector in (("-y", "0,-9.81,0"), ("z", "0,0,9.81")):
        along = numbers(geometry, *STEEL, "--angles", 5, "--gravity", axis)
        assert along == numbers(geometry, *STEEL, "--angles", 5, "--gravity", vector)
    asked = ("plan", geometry, *STEEL, "--angles", 8, "--max-tension", 400, "--json")
    K = json.loads(call("stiffness", geometry, *STEEL, "--angles", 8, "--json").stdout)
    target = K["along_N_per_m"][2] / 1000.0
    by_name = call(*asked, "--direction", "-z", "--target", target)
    assert by_name.exit_code == 0, by_name.output
    by_vector = call(*asked, "--direction", "0,0,-1", "--target", target)
    assert json.loads(by_name.stdout) == json.loads(by_vector.stdout)
    wrong = call(*asked[:-1], "--direction", "up", "--target", 9)
    assert wrong.exit_code == 2


def test_gravity_along_an_axis_in_python(geometry: Path) -> None:
    arm = cdsm.Manipulator(cdsm.Geometry.read(geometry), LAW, gravity="-y")
    np.testing.assert_array_equal(arm.gravity, [0.0, -9.81, 0.0])
    np.testing.assert_array_equal(arm.with_gravity("x").gravity, [9.81, 0.0, 0.0])
    with pytest.raises(cdsm.InvalidInput, match="gravity: 'down' given; give x, y, z"):
        arm.with_gravity("down")


@pytest.mark.parametrize(
    ("name", "words"),
    [("s.nc", "is no arm; cdsm map reads sweeps"), (".", "is a folder without a CASPR model")],
)
def test_what_is_no_arm_is_told_what_reads_it(name: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "s.nc").write_bytes(b"CDF")
    told = call("stiffness", tmp_path / name)
    assert told.exit_code == 2
    assert words in said(told.stderr)


def test_joints_without_a_column_stay_at_zero(geometry: Path, tmp_path: Path) -> None:
    path, out = tmp_path / "path.csv", tmp_path / "s.nc"
    path.write_text("joint3_1 [deg]\n0\n10\n", encoding="utf-8")
    told = call("sweep", geometry, *STEEL, "--path", path, "--out", out)
    assert told.exit_code == 0, told.output
    q = cdsm.read_sweep(out).q
    np.testing.assert_allclose(np.rad2deg(q.sel(joint="joint3_1").values), [0.0, 10.0])
    assert not q.drop_sel(joint="joint3_1").values.any()


@pytest.mark.parametrize(
    ("command", "option"),
    [
        ("stiffness", "--spring=-3"),
        ("stiffness", "--friction=-1"),
        ("stiffness", "--wire=-1"),
        ("stiffness", "--wire=nan"),
        ("stiffness", "--wire=0"),
        ("sweep", "--diameter=-1"),
    ],
)
def test_wrong_number_is_told_by_the_option_that_was_typed(
    geometry: Path, tmp_path: Path, command: str, option: str
) -> None:
    sweep = ("--out", tmp_path / "s.csv", "--random", 2, "--quantities", "disk_clearance")
    result = call(command, geometry, *(sweep if command == "sweep" else ()), option)
    assert result.exit_code == 1
    assert said(result.stderr).startswith(f"error: {option.split('=')[0]}: ")
