"""The command line, as a user calls it."""

import inspect
import json
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import cdsm
from cdsm.cli import app, options
from cdsm.tension import DEFAULT_SOLVER
from tests.interchange.test_caspr import cable, folder, link
from tests.support.patience import HANGS

SHORT = """
wire = "1x19-1.2mm"

[universal]
name = "probe"
joints = 3
cables_per_joint = 3
link_length = 0.05
base_length = 0.02
disk_offset = 0.01
hole_radius = 0.02
link_mass = 0.1
"""


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def geometry(tmp_path: Path) -> Path:
    path = tmp_path / "probe.toml"
    path.write_text(SHORT, encoding="utf-8")
    return path


@pytest.mark.slow
def test_reproduce_writes_figures_table_and_numbers(tmp_path: Path) -> None:
    result = call("reproduce", "--out", tmp_path / "new" / "folder")
    assert result.exit_code == 0, result.output
    written = {path.name: path for path in (tmp_path / "new" / "folder").iterdir()}
    figures = {f"fig{n}.png" for n in (3, 4, 5, 6, 7, 8, 10, 12, 13)} | {"lead.png"}
    assert set(written) == figures | {"reproduction.json", "reproduction.md"}
    assert all(written[name].read_bytes().startswith(b"\x89PNG") for name in figures)
    assert "Fig. 6: increment of stiffness" in result.output
    assert len(result.output.splitlines()) < 35
    assert "4.17, 2.89, 4.53" in written["reproduction.md"].read_text(encoding="utf-8")
    json.loads(written["reproduction.json"].read_text(encoding="utf-8"))


def test_urdf_writes_what_the_api_writes(geometry: Path, tmp_path: Path) -> None:
    out = tmp_path / "probe.urdf"
    result = call("urdf", geometry, "-o", out)
    assert result.exit_code == 0, result.output
    assert out.read_text(encoding="utf-8") == cdsm.to_urdf(cdsm.Geometry.read(geometry))


def test_stiffness_json_holds_the_numbers_of_the_api(geometry: Path) -> None:
    angles = [10.0, -5.0, 8.0, 0.0, 3.0, 12.0]
    result = call(
        *("stiffness", geometry, "--angles", ",".join(map(str, angles)), "--min-tension", 30),
        *("--wrench", "1,0,-2,0,0.1,0", "--wire", 48000, "--json"),
    )
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    arm = cdsm.Manipulator(cdsm.Geometry.read(geometry), cdsm.LinearElasticity(48000.0))
    pose = arm.at(np.deg2rad(angles))
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 30.0, wrench=(1, 0, -2, 0, 0.1, 0)))
    np.testing.assert_array_equal(told["joint_stiffness_Nm_per_rad"], K.joint)
    np.testing.assert_array_equal(told["along_N_per_m"], [K.along(u) for u in np.eye(3)])
    np.testing.assert_array_equal(list(told["tension_N"].values()), K.tension)
    assert told["stable"] is True


def test_check_tells_the_report_of_the_api_and_writes_it_as_a_page(
    geometry: Path, tmp_path: Path
) -> None:
    page = tmp_path / "report.html"
    options = ("check", geometry, "--angles", 8, "--min-tension", 40, "--out", page)
    result = call(*options, "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    arm = cdsm.Manipulator(cdsm.Geometry.read(geometry), cdsm.presets.STRAND_1X19)
    pose = arm.at(np.full(6, np.deg2rad(8.0)))
    report = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 40.0)).report()
    assert told.pop("computed_with") == {
        "wire": "1x19-1.2mm",
        "gravity_m_per_s2": [0.0, 0.0, -9.81],
        "least_tension_N": [40.0],
        "original_length": "unstrained",
        "friction": "none",
    }
    assert told.pop("warnings") == []
    assert told == report.to_dict()
    written = page.read_text(encoding="utf-8")
    told_first = call(*options).stdout.splitlines()[:3]  # wire, gravity, tension; arm; posture
    about = "\n".join([str(geometry), *told_first, f"cdsm {cdsm.__version__}"])
    assert written == report.to_html(about)
    assert "\nwith wire 1x19-1.2mm; gravity 0, 0, -9.81 m/s²; least tension 40 N; " in written
    assert [path.name for path in tmp_path.iterdir() if "report" in path.name] == ["report.html"]
    assert str(report) in call(*options).output


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--min-tension", 2.21), "within 1% of an end of its law"),
        (("--min-tension", 0, "--wire", 48e3, "--gravity", "0,0,0"), "slack (0 N)"),
        (("--min-tension", 20, "--wire", 1e9, "--spring", 1.0), "UNSTABLE"),
    ],
)
def test_check_of_what_cannot_be_trusted_says_why_and_exits_with_3(
    options: tuple[object, ...], said: str, geometry: Path
) -> None:
    result = call("check", geometry, "--angles", 5, *options)
    assert result.exit_code == 3
    assert "FAIL: the report says why." in result.stdout
    assert said in " ".join(result.stdout.split())
    told = call("check", geometry, "--angles", 5, *options, "--json")
    assert told.exit_code == 3
    assert json.loads(told.stdout)["passed"] is False


def test_straight_arm_has_null_for_what_is_infinite(geometry: Path) -> None:
    told = json.loads(call("stiffness", geometry, "--json").stdout)
    assert told["along_N_per_m"][0] is None
    assert told["cartesian_N_per_m"] is None


def test_weigh_json_holds_the_numbers_of_the_api(geometry: Path, tmp_path: Path) -> None:
    png = tmp_path / "weigh.png"
    result = call(
        *("weigh", geometry, "--angles", 8, "--force", "0,0,-3", "--steps", 3),
        *("--min-tension", 30, "--figure", png, "--json"),
    )
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    arm = cdsm.Manipulator(cdsm.Geometry.read(geometry), cdsm.presets.STRAND_1X19)
    pose = arm.at(np.full(6, np.deg2rad(8.0)))
    pull = cdsm.distribute_tension(pose, 30.0)
    test = cdsm.weight_test(pose, pull, [0.0, 0.0, -3.0], steps=3)
    np.testing.assert_array_equal(told["displacements_m"], test.displacements)
    np.testing.assert_array_equal(told["tensions_N"], test.tensions)
    assert told["stiffness_N_per_m"] == test.stiffness
    assert png.read_bytes().startswith(b"\x89PNG")


def test_buckle_finds_tension_and_load_of_the_api(geometry: Path, tmp_path: Path) -> None:
    png = tmp_path / "buckle.png"
    options = ("--angles", 5, "--wire", 1e9, "--spring", 2.5, "--min-tension", 3)
    result = call("buckle", geometry, *options, "--force", "-1,0,0", "--figure", png, "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    described = cdsm.Geometry.read(geometry)
    cables = cdsm.serpentine_cables(described, cdsm.LinearElasticity(1e9), series_stiffness=2500.0)
    pose = cdsm.Manipulator(described, cables=cables).at(np.full(6, np.deg2rad(5.0)))
    assert told["critical_tension"]["minimum_N"] == cdsm.critical_tension(pose).minimum
    load = cdsm.critical_load(pose, [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 3.0)
    assert told["critical_load"] == load.to_dict()
    assert png.read_bytes().startswith(b"\x89PNG")
    text = call("buckle", geometry, *options, "--force", "-1,0,0").output
    assert "buckles at a lower bound of" in text
    assert "there it buckles" in text
    carried = call("buckle", geometry, *options, "--force", "-1,0,0", "--wrench", "-1,0,0,0,0,0")
    assert f"{load.factor - 1.0:.4g}" in carried.output
    without = call("buckle", geometry, "--min-tension", "20")
    assert without.exit_code == 2
    assert "under --force or --mass" in without.stderr


def test_plan_tells_range_and_plan_of_the_api(geometry: Path, tmp_path: Path) -> None:
    png, motors = tmp_path / "plan.png", tmp_path / "motors.csv"
    options = ("plan", geometry, "--angles", 8, "--direction", "0,0,2", "--min-tension", 30)
    written = ("--figure", png, "--out", motors)
    result = call(*options, "--target", 45, "--max-tension", 400, *written, "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    arm = cdsm.Manipulator(cdsm.Geometry.read(geometry), cdsm.presets.STRAND_1X19)
    pose = arm.at(np.full(6, np.deg2rad(8.0)))
    found = cdsm.stiffness_range(pose, [0.0, 0.0, 1.0], 30.0, 400.0)
    assert (told["low_N_per_m"], told["high_N_per_m"]) == (found.low, found.high)
    plan = cdsm.plan_stiffness(pose, [0.0, 0.0, 1.0], 45e3, 30.0, 400.0)
    np.testing.assert_array_equal(list(told["tension_N"].values()), plan.tension.values)
    assert told["achieved_N_per_m"] == plan.achieved == pytest.approx(45e3, rel=1e-9)
    assert png.read_bytes().startswith(b"\x89PNG")
    lines = [row.split(",") for row in motors.read_text(encoding="utf-8").splitlines()]
    assert lines[0] == ["cable", "tension [N]", "cable_lengths [m]", "rest_lengths [m]"]
    told = [float(cell) for _, cell, *_ in lines[1:]]
    np.testing.assert_array_equal(told, plan.tension.values)
    text = call(*options, "--target", 45).output
    for part in ("the stiffness can be", "tension [N]", "cable3_3", "45 N/mm wanted"):
        assert part in text
    assert f"\nsmallest joint stiffness {plan.stiffness.margin:.4g} N m/rad (" in text


PATHS = {
    "angles": "# soft to stiff\n"
    + ",".join(f"joint{k}_{i} [{unit}]" for k, unit in ((1, "deg"), (2, "°")) for i in (1, 2))
    + ",joint3_1 [rad], joint3_2 [rad], target [N/mm], remark\n"
    + "".join(f"8,8,8,8,{math.radians(8)},{math.radians(8)},{K},x\n" for K in (30, 32, 4500, 34)),
    "tips": "x [mm], y [mm], z [mm], target [N/m]\n160,10,-20,20e3\n160,10,-21,21e3\n",
}


@pytest.mark.parametrize("kind", PATHS)
def test_plan_follows_a_path_as_the_api_does(kind: str, geometry: Path, tmp_path: Path) -> None:
    names = ("path.csv", "plan.png", "motors.csv", "arm.gif")
    path, png, motors, film = (tmp_path / name for name in names)
    path.write_text(PATHS[kind], encoding="utf-8")
    options = ("plan", geometry, "--path", path, "--direction", "0,0,1", "--rate", 8)
    result = call(*options, "--figure", png, "-o", motors, "--animation", film, "--json")
    assert result.exit_code == (3 if kind == "angles" else 0), result.output
    told = json.loads(result.stdout)
    arm = cdsm.Manipulator(cdsm.Geometry.read(geometry), cdsm.presets.STRAND_1X19)
    given: dict[str, Any] = {"tips": 1e-3 * np.array([[160, 10, -20], [160, 10, -21]])}
    targets = [20e3, 21e3]
    if kind == "angles":
        given, targets = {"angles": np.deg2rad(np.full((4, 6), 8.0))}, [30e3, 32e3, 4.5e6, 34e3]
    plan = cdsm.plan_path(arm, [0.0, 0.0, 1.0], targets, 10.0, max_change_per_sample=8.0, **given)
    np.testing.assert_allclose(told["tensions_N"], plan.tensions, rtol=1e-12)
    assert told["planned"] == list(plan.planned)
    np.testing.assert_allclose(told["achieved_N_per_m"], plan.achieved, rtol=1e-12)
    assert png.read_bytes().startswith(b"\x89PNG")
    assert film.read_bytes().startswith(b"GIF8")
    assert len(motors.read_text(encoding="utf-8").splitlines()) == len(targets) + 1
    text = call(*options).output
    assert "samples planned" in text
    assert ("sample 2: stiffness: no admissible tensions" in text) == (kind == "angles")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x [mm],y [mm],z [mm]\n", "holds no path"),
        ("x [mm],y [mm]\n1,2\n", "has no column z; call it z [mm] or z [m]"),
        ("x [mm];y [mm];z [mm]\n1;2;3\n", "separated by semicolons; separate them by commas"),
        ("x,y [mm],z [mm]\n1,2,3\n", "the column x has no unit that is known"),
        ("x [mm],y [in],z [mm]\n1,2,3\n", "the column y has no unit that is known"),
        ("a,b\n1,2\n", "has columns for neither of joint angles (joint1_1 [deg], …)"),
        ("x [mm],x [mm],z [mm]\n1,2,3\n", "two columns called x"),
        ("x [mm],y [mm],z [mm]\n1,2,3\n\n1,two,3\n", "line 4: 'two' is not a finite number"),
        ("x [mm],y [mm],z [mm]\n1,2\n", "line 2: '' is not a finite number"),
        ("x [mm],y [mm],z [mm]\n1,5,2,3\n", "line 2: has 4 cells, but the header 3"),
        ("x [mm],y [mm],z [mm],target [N/mm]\n1,2,3,-4\n", "target: -4000 N/m given"),
    ],
)
def test_path_that_cannot_be_read_says_where(
    text: str, said: str, geometry: Path, tmp_path: Path
) -> None:
    path = tmp_path / "path.csv"
    path.write_text(text, encoding="utf-8")
    given = () if "target" in text else ("--target", 20)
    result = call("plan", geometry, "--path", path, "--direction", "0,0,1", *given)
    assert result.exit_code == 1
    assert result.stderr.startswith("error: ")
    assert said in result.stderr


def test_plan_asks_for_one_target_and_for_a_path_with_its_rate(
    geometry: Path, tmp_path: Path
) -> None:
    path = tmp_path / "path.csv"
    path.write_text(PATHS["tips"], encoding="utf-8")
    for arguments, said in (
        ((), "--path"),
        (("--target", 20, "--rate", 3), "--path"),
        (("--target", 20, "--animation", "arm.gif"), "--path"),
        (("--target", 20, "--path", path), "both"),
        (("--path", path, "--angles", "1,2"), "--angles"),
    ):
        result = call("plan", geometry, "--direction", "0,0,1", *arguments)
        assert result.exit_code == 2
        assert said in result.stderr


def test_export_writes_what_the_api_writes(geometry: Path, tmp_path: Path) -> None:
    model, cables = tmp_path / "arm.xml", tmp_path / "cables.toml"
    result = call(
        *("export", geometry, "--angles", 5, "--out", model, "--cables-out", cables),
        *("--min-tension", 20, "--wire", 48e3, "--damping", 0.1),
    )
    assert result.output.count("written: ") == 2
    arm = cdsm.Manipulator(cdsm.Geometry.read(geometry), cdsm.LinearElasticity(48e3))
    pose = arm.at(np.deg2rad(np.full(arm.nv, 5.0)))
    pull = cdsm.distribute_tension(pose, 20.0)
    text = cdsm.to_mjcf(arm, pose, pull, damping=0.1)
    assert model.read_text(encoding="utf-8") == text
    assert cdsm.read_cables(cables) == arm.cables
    nothing = call("export", geometry)
    assert nothing.exit_code == 2
    assert "--out, --cables-out or both" in nothing.stderr


def test_export_of_an_unstable_arm_says_so_first(geometry: Path, tmp_path: Path) -> None:
    model = tmp_path / "arm.xml"
    asked = ("export", geometry, "--out", model, "--angles", 5, "--min-tension")
    soft = ("--wire", 1e9, "--spring", 0.2)
    told = call(*asked, 60, *soft)
    assert told.exit_code == 3
    first, conditions, arm, *_, written = told.stdout.splitlines()
    assert conditions.startswith("with wire EA 1e+09 N on a spring of 0.2 N/mm; ")
    assert first.startswith("UNSTABLE: the arm buckles, ")
    assert (arm.split(":")[0], written) == ("probe", f"written: {model}")
    assert f"<!-- {first} -->" in model.read_text(encoding="utf-8")
    as_json = call(*asked, 60, *soft, "--json")
    assert as_json.exit_code == 3
    assert json.loads(as_json.stdout)["stable"] is False
    held = call(*asked, 5, "--wire", 48e3, "--json")
    assert held.exit_code == 0
    assert json.loads(held.stdout)["stable"] is True
    assert "UNSTABLE" not in model.read_text(encoding="utf-8")


def test_export_states_time_step_damping_and_actuators(geometry: Path, tmp_path: Path) -> None:
    model = tmp_path / "arm.xml"
    asked = ("export", geometry, "--out", model, "--angles", 5, "--wire", 48e3)
    told = call(*asked, "--min-tension", 5, "--damping-ratio", 0.1)
    assert told.exit_code == 0
    chosen = told.stdout.splitlines()[3:7]
    assert [line.split()[0] for line in chosen] == ["time", "damping", "actuators", "friction"]
    assert "ratio 0.1 to " in chosen[1]
    text = model.read_text(encoding="utf-8")
    assert all(f"<!-- {line} -->" in text for line in chosen)
    numbers = json.loads(call(*asked, "--damping", 0.1, "--actuators", "none", "--json").stdout)
    assert f'timestep="{numbers["time_step_s"]!r}"' in model.read_text(encoding="utf-8")
    assert numbers["joint_damping_Nm_s_per_rad"] == 0.1
    assert set(numbers["cable_damping_N_s_per_m"].values()) == {0.0}
    assert numbers["actuators"] == "none"
    loose = call(*asked, "--actuators", "tension")
    assert loose.exit_code == 3
    assert loose.stdout.startswith("UNSTABLE")


def test_wire_file_is_the_elasticity_of_the_cables(geometry: Path, tmp_path: Path) -> None:
    wire = cdsm.LinearElasticity(48e3).write(tmp_path / "wire.toml")
    by_file = call("stiffness", geometry, "--angles", 5, "--wire", wire, "--json")
    by_number = call("stiffness", geometry, "--angles", 5, "--wire", 48e3, "--json")
    assert by_file.stdout == by_number.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("stiffness", "absent.toml"), "absent.toml: does not exist"),
        (
            ("stiffness", "{geometry}", "--angles", "80"),
            "joint1_1 = 80° is outside -53.13°",
        ),
        (("stiffness", "{geometry}", "--min-tension", "1"), "domain [2.2 N, 810 N]"),
        (("stiffness", "{geometry}", "--solver", "dapq"), "did you mean 'daqp'"),
        (("weigh", "{geometry}", "--force", "0,0,0"), "--force: is zero"),
        (("weigh", "{geometry}", "--mass", "0"), "--mass: is zero"),
        (("stiffness", "{geometry}", "--force", "nan,0,0"), "--force: entry [0] is nan"),
        (("weigh", "{geometry}", "--force", "0,0,-1", "--steps", "0"), "--steps: 0 given"),
        (("weigh", "{geometry}", "--force", "0,0,-900"), "810 N"),
        (("buckle", "{geometry}", "--force", "0,0,0"), "--force: is zero"),
        (("plan", "{geometry}", "--direction", "0,0,0", "--target", "9"), "--direction: is the"),
        (("plan", "{geometry}", "--direction", "0,0,1", "--path", "no.csv"), "does not exist"),
        (("check", "{geometry}", "--min-tension", "1"), "domain [2.2 N, 810 N]"),
        (("reproduce", "--out", "{geometry}"), "cannot be created as a folder"),
    ],
)
def test_failure_is_one_message_and_exit_code_1(
    arguments: tuple[str, ...], said: str, geometry: Path
) -> None:
    result = call(*(argument.format(geometry=geometry) for argument in arguments))
    assert result.exit_code == 1
    assert result.stderr.startswith("error: ")
    assert said in result.stderr
    assert "Traceback" not in result.output


@pytest.mark.parametrize(("angles", "said"), [("ten", "ten"), ("1,2", "2 given")])
def test_wrong_angles_are_a_usage_error(angles: str, said: str, geometry: Path) -> None:
    result = call("stiffness", geometry, "--angles", angles)
    assert result.exit_code == 2
    assert said in result.stderr


def test_every_command_tells_json_and_what_it_writes(geometry: Path, tmp_path: Path) -> None:
    told = call("urdf", geometry, "-o", tmp_path / "arm.urdf", "--json")
    assert json.loads(told.stdout)["written"] == [str(tmp_path / "arm.urdf")]
    told = call("export", geometry, "--cables-out", tmp_path / "c.toml", "--json")
    assert json.loads(told.stdout)["written"] == [str(tmp_path / "c.toml")]
    test = tmp_path / "test.csv"
    force = np.linspace(0.0, 400.0, 60)
    rows = "".join(f"{1e3 * F / 48e3 * 0.5},{F}\n" for F in force)
    test.write_text("displacement [mm],force [N]\n" + rows, encoding="utf-8")
    told = call("fit", test, "--gauge-length", 500, "--json")
    rigidity = json.loads(told.stdout)["rigidity_N"]
    np.testing.assert_allclose(rigidity, 48e3, rtol=1e-3)
    for command in app.registered_commands:
        assert command.callback is not None
        assert "as_json" in inspect.signature(command.callback).parameters


def test_debug_shows_where_an_error_comes_from(geometry: Path) -> None:
    quiet = call("stiffness", geometry, "--angles", 80)
    assert isinstance(quiet.exception, SystemExit)
    loud = call("--debug", "stiffness", geometry, "--angles", 80)
    assert isinstance(loud.exception, cdsm.JointLimitError)


def test_version_is_that_of_the_package() -> None:
    assert call("--version").output.strip() == f"cdsm {cdsm.__version__}"


def test_module_is_the_command() -> None:
    command = [sys.executable, "-m", "cdsm", "--help"]
    told = subprocess.run(command, capture_output=True, text=True, timeout=HANGS, check=True)
    assert "reproduce" in told.stdout


STRAND_TEST = Path(__file__).parents[2] / "notebooks" / "data" / "strand_1x19_tensile_test.csv"


def test_fit_reports_and_writes_elasticity_and_figure(tmp_path: Path) -> None:
    toml, png = tmp_path / "strand.toml", tmp_path / "strand.png"
    result = call("fit", STRAND_TEST, "-o", toml, "--figure", png)
    assert result.exit_code == 0, result.output
    for text in ("pre-tensioning", "elastic", "gauge length 500 mm", str(toml), str(png)):
        assert text in result.output
    law = cdsm.Elasticity.read(toml)
    tension = np.geomspace(20.0, 780.0, 30)
    expected = cdsm.presets.STRAND_1X19.rigidity(tension)
    # the example data have no noise; the step of Eq. 19 at 31 N is smoothed over
    np.testing.assert_allclose(law.rigidity(tension), expected, rtol=0.05)
    assert png.read_bytes().startswith(b"\x89PNG")


def test_fit_of_a_bad_file_is_one_message(tmp_path: Path) -> None:
    path = tmp_path / "bad.csv"
    path.write_text("a,b\n1,2\n", encoding="utf-8")
    result = call("fit", path)
    assert result.exit_code == 1
    assert result.stderr.startswith("error: ")


RAIL = """<robot name="rail"><link name="floor"/><link name="car"><inertial><mass value="0.3"/>
<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="way" type="prismatic"><parent link="floor"/><child link="car"/><axis xyz="1 0 0"/>
<limit lower="-0.1" upper="0.1" effort="1" velocity="1"/></joint></robot>"""
"""One slide between two cables of 2 N/mm each."""


@pytest.fixture
def rail(tmp_path: Path) -> tuple[object, ...]:
    law = cdsm.LinearElasticity(400.0)
    cables = [
        cdsm.Cable(
            name=name,
            sites=(cdsm.Site("floor", (x, 0.0, 0.0)), cdsm.Site("car", (0.0, 0.0, 0.0))),
            elasticity=law,
        )
        for name, x in (("left", -0.2), ("right", 0.2))
    ]
    (tmp_path / "rail.urdf").write_text(RAIL, encoding="utf-8")
    file = cdsm.write_cables(cables, tmp_path / "rail.toml")
    return tmp_path / "rail.urdf", "--cables", file, "--tip", "car"


def test_arm_as_urdf_and_cables_is_the_same_arm(geometry: Path, tmp_path: Path) -> None:
    urdf, cables = tmp_path / "arm.urdf", tmp_path / "cables.toml"
    assert call("urdf", geometry, "-o", urdf).exit_code == 0
    assert call("export", geometry, "--cables-out", cables).exit_code == 0
    given = ("--angles", "10,-5,8,0,3,12", "--min-tension", 30, "--json")
    first = call("stiffness", geometry, *given)
    assert first.exit_code == 0, first.output
    for arm in ((geometry,), (urdf, "--tip", "tool0")):
        other = call("stiffness", *arm, "--cables", cables, *given)
        assert other.exit_code == 0, other.output
        assert other.stdout == first.stdout


def test_robot_that_slides_is_asked_for_and_told_in_millimetres(
    rail: tuple[object, ...], tmp_path: Path
) -> None:
    told = json.loads(call("stiffness", *rail, "--angles", 20, "--json").stdout)
    assert told["ways_m"] == {"way": 0.02}
    assert told["angles_rad"] == {}
    # k = EA/l_0 of both cables, 0.22 and 0.18 m long under 10 N: EA (1 + 10 N/EA) over the length
    np.testing.assert_allclose(told["along_N_per_m"][0], 410 / 0.22 + 410 / 0.18, rtol=1e-12)
    # two ways through the same sum of two cables
    np.testing.assert_allclose(told["margin_N_per_m"], told["along_N_per_m"][0], rtol=1e-12)
    assert "residual_N" in told
    assert told["joint_stiffness_N_per_m"] == [[told["margin_N_per_m"]]]
    checked = call("check", *rail, "--angles", 20)
    assert "stable, smallest joint stiffness 4141 N/m" in checked.stdout
    assert "count with the arm's length, 0.2 m, as lever" in checked.stdout
    text = call("stiffness", *rail, "--angles", 20).stdout
    residual = re.search(r"static residual: (\S+) N\n", text)
    assert residual is not None
    assert float(residual[1]) < 1e-14  # of two tensions of 10 N: rounding
    assert "smallest joint stiffness 4141 N/m" in text
    pulled = call("stiffness", *rail, "--max-tension", 20, "--wrench", "30,0,0,0,0,0")
    assert "20 N are missing, most of it (20 N) at way" in pulled.stderr


def test_joints_may_have_any_name(rail: tuple[object, ...], tmp_path: Path) -> None:
    file, *cables = rail
    odd = tmp_path / "odd.urdf"
    odd.write_text(Path(str(file)).read_text().replace('name="way"', 'name="a, way (x)= 1"'))
    name, out = "a, way (x)= 1", tmp_path / "s.nc"
    told = json.loads(call("stiffness", odd, *cables, "--angles", f"{name}=20", "--json").stdout)
    assert told["ways_m"] == {name: 0.02}
    swept = call("sweep", odd, *cables, "--grid", f" {name} = 10:20:2", "--out", out)
    assert swept.exit_code == 0, swept.output
    np.testing.assert_allclose(cdsm.read_sweep(out)[name], [0.01, 0.02], rtol=1e-15)
    for wrong in (f"{name}=20,way=3", f"{name}=20 way=3", "way=3"):
        wrongly = call("stiffness", odd, *cables, "--angles", wrong)
        assert "no joint is called 'way'" in wrongly.stderr


def test_sweep_along_a_slide(rail: tuple[object, ...], tmp_path: Path) -> None:
    out, path = tmp_path / "s.nc", tmp_path / "path.csv"
    names = "along,margin,gravity_torque"
    result = call("sweep", *rail, "--grid", "way=-20:20:3", "--quantities", names, "-o", out)
    assert result.exit_code == 0, result.output
    found = cdsm.read_sweep(out)
    assert (found.margin.units, found.gravity_torque.units) == ("N m-1", "N")
    np.testing.assert_allclose(found.way, [-0.02, 0.0, 0.02], rtol=1e-15)
    assert found.way.attrs["units"] == "m"
    k = [410 / 0.22 + 410 / 0.18, 4100.0, 410 / 0.22 + 410 / 0.18]  # EA/l_0 under 10 N
    np.testing.assert_allclose(found.along.sel(direction="x").values.ravel(), k, rtol=1e-12)
    path.write_text("way [mm]\n-20\n0.0\n20\n", encoding="utf-8")
    result = call("sweep", *rail, "--path", path, "--quantities", "along", "-o", out)
    assert result.exit_code == 0, result.output
    found = cdsm.read_sweep(out)
    np.testing.assert_allclose(found.q.values.ravel(), [-0.02, 0.0, 0.02], rtol=1e-15)
    assert found.q.attrs["units"] == "rad or m"
    path.write_text("way [deg]\n-20\n20\n", encoding="utf-8")
    result = call("sweep", *rail, "--path", path, "-o", out)
    assert "call it way [mm] or way [m]" in result.stderr


def test_path_along_a_slide_of_which_nothing_can_be_planned(
    rail: tuple[object, ...], tmp_path: Path
) -> None:
    path, out, picture = tmp_path / "path.csv", tmp_path / "motors.csv", tmp_path / "path.png"
    path.write_text("way [mm]\n-20\n20\n", encoding="utf-8")
    wanted = ("--direction", "1,0,0", "--target", 9e3, "--max-tension", 100)
    result = call("plan", *rail, *wanted, "--path", path, "-o", out, "--figure", picture)
    assert result.exit_code == 3, result.output
    assert "0 of 2 samples planned" in result.stdout
    head = out.read_text(encoding="utf-8")
    assert head.startswith("sample,status,way [m],tensions left [N]")
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_folder_of_a_caspr_model_is_an_arm(tmp_path: Path) -> None:
    model = folder(
        tmp_path, link(1, "R_Z") + link(2, "U_XY"), "".join(cable(name=f"c{i}") for i in range(2))
    )
    result = call("sweep", model, "--random", 4, "--wire", 2e4, "-o", tmp_path / "s.csv")
    assert result.exit_code == 3, result.output  # two cables balance none of three joints
    assert "stiffness sweep of toy" in result.output


def test_default_solver_of_the_commands_is_that_of_the_library() -> None:
    assert options.DEFAULT_SOLVER == DEFAULT_SOLVER


@pytest.mark.parametrize(
    ("arguments", "option", "said"),
    [
        (("rail.urdf",), "--cables", "a robot in a .urdf needs it"),
        (("rail.urdf", "--cables", "rail.toml"), "--tip", "a robot in a .urdf needs it"),
        (("probe.toml", "--tip", "car"), "--tip", "leave it out"),
        ((".", "--cables", "rail.toml"), "--cables", "a CASPR model has its own cables"),
    ],
)
def test_options_that_this_kind_of_arm_does_not_heed_are_refused(
    arguments: tuple[str, ...],
    option: str,
    said: str,
    rail: tuple[object, ...],
    geometry: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    result = call("stiffness", *arguments)
    assert result.exit_code == 2
    assert option in result.stderr
    assert said in " ".join(result.stderr.replace("│", " ").split())


@pytest.mark.parametrize("command", ["stiffness", "check", "buckle"])
def test_an_arm_without_a_wire_asks_for_one(command: str, geometry: Path, tmp_path: Path) -> None:
    geometry.write_text(SHORT.replace('wire = "1x19-1.2mm"', ""), encoding="utf-8")
    (tmp_path / "model").mkdir()
    model = folder(tmp_path / "model", link(1, "R_Z") + link(2, "U_XY"), cable())
    for arm in (geometry, model):
        told = call(command, arm)
        assert told.exit_code == 2
        assert "--wire" in told.stderr
        assert "1x19-1.2mm" in told.stderr
    assert call(command, geometry, "--wire", "1x19-1.2mm").exit_code in (0, 3)
    wrong = call(command, geometry, "--wire", "1x9-1.2mm")
    assert wrong.exit_code == 1
    assert "did you mean '1x19-1.2mm'" in wrong.stderr
    assert call("urdf", geometry, "-o", tmp_path / "arm.urdf").exit_code == 0


def test_a_finger_of_two_files_is_one(rail: tuple[object, ...], tmp_path: Path) -> None:
    urdf, _, cables, *_ = rail
    arm = cdsm.Manipulator.from_urdf(str(urdf), str(cables), tip="car")
    file = arm.write(tmp_path / "one.toml")
    assert call("stiffness", file).stdout == call("stiffness", *rail).stdout
