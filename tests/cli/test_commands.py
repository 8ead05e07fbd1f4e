"""The command line, as a user calls it: each command's JSON is what Python returns."""

from __future__ import annotations

import json
import math
import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner, Result

import cdsm
from cdsm.cli import app
from cdsm.support.format import prepare_json
from tests.interchange.test_caspr import cable, folder, link
from tests.support.arms import readme_geometry

EXAMPLES = Path(__file__).parents[2] / "examples"

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
CABLES = """
wire = 48e3
[[cables]]
name = "left"
sites = [{link = "base", xyz = [0.0, 0.02, 0.0]}, {link = "car", xyz = [0.05, 0.02, 0.0]}]
[[cables]]
name = "right"
sites = [{link = "base", xyz = [0.0, -0.02, 0.0]}, {link = "car", xyz = [0.05, -0.02, 0.0]}]
"""
ROBOT = """<robot name="hinge"><link name="base"/>
<link name="car"><inertial><origin xyz="0.05 0 0"/><mass value="0.1"/>
<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="car"/>
<origin xyz="0.02 0 0"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
</joint></robot>"""


def call(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def told(*arguments: object, code: int = 0) -> dict[str, Any]:
    """Return the JSON of a command, which ends with this exit code."""
    result = call(*arguments, "--json")
    assert result.exit_code == code, result.output
    found: dict[str, Any] = json.loads(result.stdout)
    return found


def assert_holds(answer: dict[str, Any], *results: Any) -> None:
    """Assert that an answer has all numbers of these results."""
    for result in results:
        assert prepare_json(result.to_dict()).items() <= answer.items()


@pytest.fixture
def probe(tmp_path: Path) -> Path:
    (tmp_path / "probe.toml").write_text(SHORT, encoding="utf-8")
    return tmp_path / "probe.toml"


@pytest.fixture
def pose() -> cdsm.Posture:
    """The arm of ``probe`` at ``--angles 8``."""
    geometry = cdsm.Geometry.from_toml(SHORT)
    return cdsm.Manipulator(geometry, cdsm.presets.STRAND_1X19).at(np.full(6, np.deg2rad(8.0)))


def test_stiffness(probe: Path, pose: cdsm.Posture, tmp_path: Path) -> None:
    bounds = ("--angles", 8, "--minimum", 30, "--maximum", 400)
    found = told("stiffness", probe, *bounds, "--load", "1,0,-2,0,0.1,0", "--direction", "1,0,-1")
    wrench = (1, 0, -2, 0, 0.1, 0)
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 30.0, 400.0, wrench))
    assert_holds(found, K)
    assert found["along_direction_N_per_m"] == K.along((1, 0, -1))
    assert found["computed_with"]["least_tension_N"] == [dict.fromkeys(pose.arm.cables.names, 30.0)]
    page = tmp_path / "report.html"
    report = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 30.0, 400.0)).report()
    assert_holds(told("stiffness", probe, *bounds, "--check", "--out", page), report)
    assert "least tension 30 N" in page.read_text(encoding="utf-8")
    named = told("stiffness", probe, *bounds, "--angles", ",".join(f"joint{k}_1=8" for k in "123"))
    assert list(named["angles_rad"].values()) == [*np.deg2rad([8.0, 0.0] * 3)]
    assert told("stiffness", probe, "--minimum", 5)["along_N_per_m"][0] is None  # infinite


def test_stiffness_under_loads_on_links(probe: Path, pose: cdsm.Posture) -> None:
    loads = ("--mass", "0.1@link1", "--load", "0,0.2,0@link1", "--load", "0,0,-0.3")
    answer = told("stiffness", probe, "--angles", 8, "--minimum", 20, *loads)
    W = np.array([*(0.1 * pose.arm.gravity + [0.0, 0.2, 0.0]), 0.0, 0.0, 0.0])
    wrench = {"tool0": [0.0, 0.0, -0.3, 0.0, 0.0, 0.0], "link1": W}
    tension = cdsm.distribute_tension(pose, 20.0, wrench=wrench)
    K = cdsm.stiffness(pose, tension)
    assert answer["loads"] == prepare_json(K.to_dict())["loads"]
    assert answer["along_N_per_m"] == pytest.approx([K.along(u) for u in "xyz"])


def test_weights_hang_on_links(probe: Path, pose: cdsm.Posture, tmp_path: Path) -> None:
    at = ("--angles", 8, "--minimum", 30, "--maximum", 300)
    tension = cdsm.distribute_tension(pose, 30.0, 300.0)
    weight = 0.2 * pose.arm.gravity
    found = told("weigh", probe, *at, "--mass", "0.2@link1", "--steps", 2)
    test = cdsm.weight_test(pose, tension, weight, steps=2, link="link1")
    assert found["displacements_m"][-1] == pytest.approx(test.displacement.tolist())
    held = cdsm.payload(pose, weight, 30.0, 300.0, tension=tension.values, link="link1").locked
    assert held is not None
    assert found["holds"] == prepare_json(held.to_dict())
    rows = {"link1": [[*weight, 0, 0, 0]], "link2": [[0, 0, 0, 0, 0.1, 0]]}
    both = ("--mass", "0.2@link1", "--load", "0,0,0,0,0.1,0@link2", "--cycles", 1, "--steps", 1)
    history = cdsm.load_cycle(pose, tension, rows)
    cycled = told("weigh", probe, *at, *both)
    assert cycled["tip_m"][0] == pytest.approx(history.tip[0].tolist())
    found = told("buckle", probe, *at, "--load", "0,0,-3@link2")
    load = {"link2": [0, 0, -3, 0, 0, 0]}
    critical = cdsm.critical_load(pose, load, 30.0, 300.0)
    assert found["critical_load"]["factor"] == pytest.approx(critical.factor)
    assert found["payload"]["following"]["force_N"] == pytest.approx(
        3.0 * critical.factor, rel=1e-5
    )
    planned = ("plan", probe, *at, "--direction", "z", "--load", "0,0,-3@link2", "--target", 20)
    plan = cdsm.plan_stiffness(pose, "z", 20e3, 30.0, 300.0, load)
    assert told(*planned)["tension_N"] == pytest.approx(dict(plan.tension))
    path = tmp_path / "path.csv"
    path.write_text(f"{pose.arm.joint_names[0]} [deg]\n8\n4\n")
    along = told("plan", probe, "--path", path, *planned[-4:], *at[2:], "--direction", "z")
    q = np.zeros((2, 6))
    q[:, 0] = np.deg2rad([8.0, 4.0])
    expected = cdsm.plan_path(pose.arm, "z", 20e3, 30.0, 300.0, load, angles=q)
    np.testing.assert_allclose(along["tensions_N"], expected.tensions, rtol=1e-6)
    table = tmp_path / "sweep.nc"
    told("sweep", probe, *at, "--load", "0,0,-3@link2", "--out", table)
    swept = xr.load_dataset(table)
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 30.0, 300.0, load))
    np.testing.assert_allclose(swept["along"].values.ravel(), [K.along(u) for u in "xyz"])
    assert swept["load_link"].values.tolist() == ["link2"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("stiffness --load 0,0,1@lnik2", "--load: no link is called 'lnik2'; did you mean 'link2'"),
        ("stiffness --mass 1@base_link", "--mass: 'base_link' is the base"),
        ("stiffness --load 0,0,1@link2 --load 1,0,0@link2", "--load: link2 is given twice; add"),
        ("weigh --mass 1 --mass 2", "--mass: tool0 is given twice; add them up"),
        ("weigh --load 0,0,1@link1 --load 0,0,1@link2", "one weight hangs on one link. --cycles"),
        ("weigh --load 0,0,1,1,0,0@link1", "a weight is a force: FX,FY,FZ. --cycles takes"),
        ("plan --direction z --mass -1@link2", "--mass: -1 kg given; give a mass from 0 kg on"),
        ("sweep --random 2 --load 1,2@link2", "--load: 2 given; give FX,FY,FZ or"),
        ("view --load 0,0,1@link2 --load 0,1,0@link1", "on link2 and link1, but the view has one"),
    ],
)
def test_wrong_links_of_options_are_named(probe: Path, words: str, said: str) -> None:
    command, *options = words.split()
    out = ["--out", probe.with_suffix(".nc")] if command == "sweep" else []
    minimum = ["--minimum", 30] if command != "view" else []
    result = call(command, probe, *options, *minimum, *out)
    assert result.exit_code == 2
    assert said in " ".join(result.stderr.replace("│", " ").split())


def test_stiffness_with_tolerances_and_friction(probe: Path, pose: cdsm.Posture) -> None:
    changes = ("--set", "tolerances.joint_angle=0.01", "--set", "friction=0.1")
    found = told("stiffness", probe, "--angles", 8, "--minimum", 30, *changes)
    rough, given = pose.arm.with_friction(0.1).at(pose.q), cdsm.Tolerances(joint_angle=0.01)
    tension = cdsm.distribute_tension(rough, 30.0)
    sure = cdsm.uncertainty(rough, tension, given, direction="z")
    assert found["uncertainty"]["z"] == prepare_json(sure.to_dict())
    assert found["sticking"]["z"]["breakaway_N"] == cdsm.breakaway(rough, tension, "z").load


def test_the_posture_follows_from_what_the_motors_do(tmp_path: Path) -> None:
    section = {"length": 0.2, "disks": 4, "hole_angles": [0.0, 2.1, 4.2], "hole_radius": 0.01}
    geometry = cdsm.Geometry.backbone(sections=[section], bending_stiffness=0.01)
    file = cdsm.Manipulator(geometry, cdsm.LinearElasticity(2e4)).write(tmp_path / "rod.toml")
    arm = cdsm.Manipulator.read(file)
    F, weight = [2.0, 0.0, 1.0], [0.0, 0.0, -0.01]
    rest = cdsm.forward_statics(arm, tension=F, wrench=[*weight, 0, 0, 0])
    asked = ("--tension", "2,0,1", "--load", "0,0,-0.01")
    assert_holds(told("stiffness", file, *asked), rest)
    assert_holds(told("stiffness", file, *asked, "--check"), rest.report())
    pulled = cdsm.forward_statics(arm, pull=[0.003, -0.004, 0.0])
    hung = ("weigh", file, "--pull", "3,-4,0", "--load", "0,0,-0.01")
    found = told(*hung)
    assert found["rest"] == prepare_json(pulled.to_dict())
    assert_holds(found, cdsm.weight_test(pulled.pose, pulled, weight, steps=5))
    assert "motors hold lengths" in call(*hung).stdout
    for more in (("--tension", "2,0,1"), ("--angles", 0), ("--minimum", 2)):
        assert "say what the motors do" in call(*hung, *more).stderr


def test_an_arm_on_a_stop_is_as_stiff_as_a_small_weight_measures(tmp_path: Path) -> None:
    """K_θ, which knows no stops, would be unstable there."""
    geometry = readme_geometry(joints=2, hole_radius=0.02, link_mass=0.1, joint_stiffness=0.5)
    file = cdsm.Manipulator(geometry, cdsm.LinearElasticity(2e4)).write(tmp_path / "arm.toml")
    arm, F = cdsm.Manipulator.read(file), [0.0, 80.0, 0.0, 0.0, 0.0, 0.0]
    rest = cdsm.forward_statics(arm, tension=F)
    assert not rest.stiffness.is_stable
    ends = [
        cdsm.forward_statics(arm, tension=F, wrench=[0, 0, f, 0, 0, 0], start=rest.pose.q)
        for f in (1e-3, -1e-3)
    ]
    measured = 2e-3 / (ends[0].pose.tip[2, 3] - ends[1].pose.tip[2, 3])
    found = told("stiffness", file, "--tension", "0,80,0,0,0,0", code=3)
    assert "rest" in found["warnings"][0]
    assert found["stable"] is True
    assert found["along_N_per_m"][2] == pytest.approx(measured, rel=1e-4)
    assert (
        "rests on its own" in call("stiffness", file, "--tension", "0,80,0,0,0,0", "--check").stderr
    )


def test_weigh(probe: Path, pose: cdsm.Posture, tmp_path: Path) -> None:
    asked = ("weigh", probe, "--angles", 8, "--minimum", 30)
    tension = cdsm.distribute_tension(pose, 30.0)
    png, table = tmp_path / "weigh.png", tmp_path / "loop.csv"
    found = told(*asked, "--load", "0,0,-3", "--steps", 3, "--figure", png)
    assert_holds(found, cdsm.weight_test(pose, tension, (0, 0, -3), steps=3))
    assert png.read_bytes().startswith(b"\x89PNG")
    hung = cdsm.weight_test(pose, tension, (0, 0, -0.2 * 9.81), steps=5)
    assert_holds(told(*asked, "--mass", 0.2), hung)
    loop = ("--cycles", 1, "--steps", 2, "--set", "friction=0.1", "--out", table)
    found = told(*asked, "--load", "0,0,-3", *loop)
    rough = pose.arm.with_friction(0.1).at(pose.q)
    wrenches = np.outer([0.5, 1.0, 0.5, 0.0, -0.5, -1.0, -0.5, 0.0], [0, 0, -3.0, 0, 0, 0])
    history = cdsm.load_cycle(rough, cdsm.distribute_tension(rough, 30.0), wrenches + 0.0)
    assert_holds(found, history)
    assert found["lost_in_last_cycle_J"] == pytest.approx(history.dissipated.sum())
    rows = table.read_text(encoding="utf-8").splitlines()
    assert len(rows) == 9
    assert rows[0].split(",")[:4] == ["load", "force x [N]", "force y [N]", "force z [N]"]
    assert float(rows[2].split(",")[6]) == pytest.approx(history.displacement[1, 2])
    assert call(*asked, "--load", "0,0,-3").stdout.startswith("motors locked")
    rough_text = call(*asked, "--load", "0,0,-3", "--set", "friction=0.1").stdout
    last = cdsm.weight_test(rough, tension.values, (0, 0, -3), steps=5).displacement
    assert f"{1e3 * last[2]:.4g}) mm" in rough_text.splitlines()[-1]


def test_buckle(probe: Path, pose: cdsm.Posture) -> None:
    soft = ("--set", "wire=1e9", "--set", "series_stiffness=2500", "--angles", 8)
    found = told("buckle", probe, *soft, "--load", "-1,0,0", "--minimum", 3)
    law, geometry = cdsm.LinearElasticity(1e9), pose.arm.geometry
    cables = cdsm.serpentine_cables(geometry, law, series_stiffness=2500.0)
    arm = cdsm.Manipulator(geometry, cables=cables).at(pose.q)
    load = cdsm.critical_load(arm, [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 3.0)
    assert found["critical_tension"] == prepare_json(cdsm.critical_tension(arm).to_dict())
    assert found["critical_load"] == prepare_json(load.to_dict())
    held = cdsm.payload(arm, "-x", 3.0)
    assert held.following is not None
    assert found["payload"]["following"]["force_N"] == held.following.force
    assert held.following.force == pytest.approx(load.factor, rel=1e-6)
    assert call("buckle", probe, *soft).stdout.startswith("motors follow")


def test_plan_at_a_posture(probe: Path, pose: cdsm.Posture, tmp_path: Path) -> None:
    motors = tmp_path / "motors.csv"
    asked = ("plan", probe, "--angles", 8, "--direction", "z", "--minimum", 30, "--maximum", 400)
    found = told(*asked, "--target", 45, "--out", motors)
    reach = cdsm.stiffness_range(pose, "z", 30.0, 400.0)
    best = cdsm.plan_stiffness(pose, "z", 45e3, 30.0, 400.0)
    assert (found["low_N_per_m"], found["high_N_per_m"]) == (reach.low, reach.high)
    assert_holds(found, best)
    assert motors.read_text(encoding="utf-8").startswith("cable,tension [N],")
    assert call(*asked, "--target", 4500).exit_code == 3


def test_plan_along_a_path(probe: Path, pose: cdsm.Posture, tmp_path: Path) -> None:
    path, change = tmp_path / "path.csv", {"max_change_per_sample": 8.0}
    names = [f"joint{k}_{i} [{'rad' if k == 3 else 'deg'}]" for k in (1, 2, 3) for i in (1, 2)]
    rows = [f"8,8,8,8,{math.radians(8)},{math.radians(8)},{K}" for K in (30, 32)]
    tips = np.array([[160, 10, -20], [160, 10, -21]])
    asked = ("plan", probe, "--direction", "z", "--minimum", 30, "--max-change-per-sample", 8)
    given: dict[str, Any]
    for text, more, target, given in (
        (
            "\n".join(["# up", ",".join([*names, "target [N/mm]"]), *rows]),
            *((), [30e3, 32e3], {"angles": np.array([pose.q, pose.q])}),
        ),
        (
            "x [mm],y [mm],z [mm]\n160,10,-20\n160,10,-21\n",
            *(("--target", 20), 20e3, {"tips": 1e-3 * tips}),
        ),
    ):
        path.write_text(text)
        found = told(*asked, "--path", path, *more)
        planned = cdsm.plan_path(pose.arm, "z", target, 30.0, **given, **change)
        np.testing.assert_allclose(found["tensions_N"], planned.tensions, rtol=1e-12)


def test_sweep(probe: Path, pose: cdsm.Posture, tmp_path: Path) -> None:
    out, store, figure, table = (tmp_path / each for each in ("s.nc", "s.zarr", "m.pdf", "s.csv"))
    asked = ("sweep", probe, "--minimum", "20,40", "--store", store)
    grid = ("--grid", "joint1_1=-20:20:5, joint3_2=0:10:2,joint2_1=5")
    found = told(*asked, *grid, "--out", out, "--figure", figure)
    assert found["entries"]["ok"] == 20
    first, last = np.deg2rad(np.linspace(-20.0, 20.0, 5)), np.deg2rad([0.0, 10.0])
    poses = cdsm.GridPoses({"joint1_1": first, "joint3_2": last}, {"joint2_1": np.deg2rad(5.0)})
    expected = cdsm.sweep(pose.arm, poses, minimum=[20.0, 40.0])
    for written in (out, store):
        xr.testing.assert_identical(cdsm.read_sweep(written)["along"], expected["along"])
    assert figure.read_bytes().startswith(b"%PDF")
    call("sweep", probe, "--random", 16, "--minimum", 9, "--outputs", "margin", "--out", table)
    head, *rows = table.read_text(encoding="utf-8").splitlines()
    assert len(rows) == 16
    assert ("margin" in head, "along" in head) == (True, False)


@pytest.mark.parametrize(
    ("options", "arguments"),
    [
        ((), {"diameter": 1.2e-3}),  # that of the strand, by its name
        (("--diameter", 2), {"diameter": 2e-3}),
        (("--direction", "-y"), {"diameter": 1.2e-3, "direction": "-y"}),
        (
            ("--set", "friction=0.1", "--worst-friction"),
            {"diameter": 1.2e-3, "worst_friction": True},
        ),
    ],
)
def test_options_of_a_sweep_are_arguments_of_python(
    options: tuple[object, ...], arguments: dict[str, Any], probe: Path, tmp_path: Path
) -> None:
    out = tmp_path / "s.nc"
    words = ("sweep", probe, "--random", 4, "--minimum", 9, "--out", out)
    told(*words, "--outputs", "cable_clearance,disk_clearance,along", *options)
    changes = {"friction": 0.1} if "--set" in options else {}
    arm = cdsm.Manipulator.read(probe, changes=changes)
    outputs = ("cable_clearance", "disk_clearance", "along")
    expected = cdsm.sweep(arm, cdsm.RandomPoses(4), minimum=9.0, outputs=outputs, **arguments)
    assert expected["cable_clearance"].notnull().any()
    xr.testing.assert_allclose(cdsm.read_sweep(out), expected)


def test_clearances_of_cables_of_unknown_diameter_are_refused(probe: Path, tmp_path: Path) -> None:
    words = ("sweep", probe, "--random", 4, "--minimum", 9, "--out", tmp_path / "s.nc")
    run = call(*words, "--outputs", "disk_clearance", "--set", "wire=48e3")
    assert run.exit_code == 2
    assert "give the diameter of the cables" in " ".join(run.stderr.split())
    told(*words, "--outputs", "disk_clearance", "--set", "wire=48e3", "--diameter", 0)


def test_new_writes_the_arm_of_the_readme(tmp_path: Path) -> None:
    path = tmp_path / "ARM.toml"
    found = told("new", path)
    sizes: dict[str, Any] = {"link_length": 0.06, "base_length": 0.03, "disk_offset": 0.012}
    sizes |= {"hole_radius": 0.025, "link_mass": 0.12, "lead": 0.3, "joints": 4}
    sizes |= {"joint_limit": 0.35, "name": "ARM"}
    arm = cdsm.Manipulator.read(path)
    assert arm.geometry == cdsm.Geometry.universal(cables_per_joint=3, **sizes)
    assert {cable.minimum for cable in arm.cables} == {10.0}
    assert found == {"warnings": [], "name": "ARM", "length_m": arm.length, "written": [str(path)]}
    assert call("new", path).exit_code == 2
    assert call("new", path, "--overwrite", "--joints", "2.6").exit_code == 2


def test_new_makes_an_arm_file_of_a_robot_and_of_a_caspr_model(tmp_path: Path) -> None:
    robot, cables, arm = (tmp_path / name for name in ("r.urdf", "c.toml", "ARM.toml"))
    robot.write_text(ROBOT, encoding="utf-8")
    cables.write_text(CABLES, encoding="utf-8")
    asked = ("new", arm, "--overwrite", "--from", robot)
    assert call(*asked).exit_code == 2
    asked = (*asked, "--cables", cables, "--tip", "car")
    assert call(*asked).exit_code == 0
    expected = cdsm.Manipulator.from_urdf(robot, cables, tip="car")
    assert cdsm.Manipulator.read(arm) == expected
    told("export", arm, tmp_path / "again.urdf")
    assert (tmp_path / "again.urdf").read_text(encoding="utf-8") == expected.urdf
    robot.write_text(ROBOT.replace('izz="1e-4"', 'izz="9e-4"'), encoding="utf-8")
    said = "check_inertia = false in [urdf] of ARM.toml, or cdsm new --no-check-inertia"
    assert said in call(*asked).stderr
    assert call(*asked, "--no-check-inertia").exit_code == 0
    assert call("stiffness", arm, "--minimum", 1).exit_code == 0
    links = link(1, "R_Z") + link(2, "U_XY")
    model = folder(tmp_path, links, "".join(cable(name=f"c{i}") for i in range(2)))
    assert call("new", arm, "--overwrite", "--from", model, "--wire", "2e4").exit_code == 0
    law = cdsm.LinearElasticity(2e4)
    assert cdsm.Manipulator.read(arm) == cdsm.read_caspr(model, elasticity=law)


def test_export(probe: Path, pose: cdsm.Posture, tmp_path: Path) -> None:
    urdf, model = tmp_path / "arm.urdf", tmp_path / "arm.xml"
    told("export", probe, urdf)
    assert urdf.read_text(encoding="utf-8") == cdsm.to_urdf(pose.arm.geometry)
    found = told("export", probe, model, "--angles", 8, "--minimum", 20, "--actuators", "none")
    text = cdsm.to_mjcf(pose.arm, pose, cdsm.distribute_tension(pose, 20.0), actuators="none")
    assert model.read_text(encoding="utf-8") == text
    assert found["actuators"] == "none"
    soft = ("--set", "universal.lead=0.4", "--set", "series_stiffness=200", "--minimum", 60)
    assert told("export", probe, model, "--angles", 5, *soft, code=3)["stable"] is False


def test_fit_and_its_law_as_wire(probe: Path, tmp_path: Path) -> None:
    test, law = tmp_path / "test.csv", tmp_path / "WIRE.toml"
    force = np.linspace(0.0, 300.0, 60)
    rows = [f"{500.0 * F / 48e3},{F}" for F in force.tolist()]
    test.write_text("\n".join(["displacement [mm],force [N]", *rows]), encoding="utf-8")
    found = told("fit", test, "--gauge-length", 500, "--out", law)
    fitted = cdsm.fit_tensile_test(500e-3 * force / 48e3, force, 0.5)
    assert found["domain_N"] == pytest.approx([fitted.elasticity.low, fitted.elasticity.high])
    asked = ("stiffness", probe, "--angles", 5, "--minimum", 20)
    K = told(*asked, "--set", "wire=WIRE.toml")  # from the folder of the arm
    np.testing.assert_allclose(
        K["along_N_per_m"], told(*asked, "--set", "wire=48e3")["along_N_per_m"], rtol=0.01
    )
    assert call("fit", test).exit_code == 1
    given = ["--columns", "displacement,force", "--units", "mm,N", "--gauge-length", "500"]
    part = told("fit", test, *given, "--between", "50,250")
    assert 50.0 <= part["domain_N"][0] < part["domain_N"][1] <= 250.0


LOOPS_ARM = """
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


def test_identify(tmp_path: Path) -> None:
    """The loops are those of another arm than the one that is described."""
    arm, loops = tmp_path / "arm.toml", tmp_path / "loops.csv"
    arm.write_text(LOOPS_ARM, encoding="utf-8")
    true = {"friction": 0.1, "rigidity": 1.1}
    truth = cdsm.ArmParameters(cdsm.Manipulator.read(arm), tuple(true))(**true)
    random, forces = np.random.default_rng(2), (0.0, 12.0, 24.0, 12.0, 0.0)
    lines = ["test,joint1 [deg],direction,minimum [N],force [N],displacement [mm]"]
    for angle in (25.0, -23.0):
        bent: Any = {"direction": "-z", "angles": (np.deg2rad(angle),), "minimum": 200.0}
        loop = cdsm.WeightLoop(forces=forces, displacement_std=5e-6, **bent)
        rows = zip(forces, loop.simulated(truth, random).displacements or (), strict=True)
        lines += [f"at {angle:g},{angle},-z,200,{F},{1e3 * x:.4f}" for F, x in rows]  # type: ignore[operator]
    loops.write_text("\n".join(lines) + "\n", encoding="utf-8")
    asked = ("identify", arm, loops, "--displacement-std", 0.005, "--free", "friction")
    found = told(*asked, "--free", "rigidity=0.5:2")
    rows = zip(found["names"], found["values_own_unit"], found["std_own_unit"], strict=True)
    for name, value, std in rows:
        assert abs(value - true[name]) < 2.0 * std
        assert value == pytest.approx(true[name], rel=0.05)
    bounded = told(*asked, "--free", "rigidity=0.5:0.9", code=3)["warnings"]
    assert any(sentence.startswith("rigidity is at its upper bound, 0.9") for sentence in bounded)
    # the command of the warning finds what these bounds exclude
    (advice,) = (s for s in bounded if s.startswith("Next, with wider bounds: "))
    _, command, *rest = shlex.split(advice.partition(": ")[2])
    wider = told(command, *rest)
    assert wider["values_own_unit"] == pytest.approx(found["values_own_unit"], rel=1e-3)
    # of deviations that were guessed too small, the command of the warning explains the rest
    asked_of = list(asked)
    asked_of[4] = 0.0008
    doubted = told(*asked_of, "--free", "rigidity=0.5:2", code=3)
    assert doubted["chi_square"] > 4.0 * doubted["freedom"]
    (advice,) = (s for s in doubted["warnings"] if s.startswith("Next, if 0.0008 mm was a guess"))
    _, command, *rest = shlex.split(advice.partition(": ")[2])
    likely = told(command, *rest)
    assert likely["chi_square"] == pytest.approx(likely["freedom"], rel=1e-3)
    # from a friction of 0 in the file, and from another start, it is the same
    again = told(
        *asked, "--free", "rigidity=0.5:2", "--set", "friction=0", "--start", "rigidity=0.7"
    )
    assert again["values_own_unit"] == pytest.approx(found["values_own_unit"], rel=1e-3)
    for start, problem in (
        ("rigidity=1", "rigidity is not free"),
        ("friction", "give NAME=VALUE"),
        ("friction=2", "outside the bounds 0 to 1"),
    ):
        assert problem in " ".join(call(*asked, "--start", start).stderr.split())
    assert sum(told(*asked, "--tests", 1)["counts"]) == 1
    assert "give bounds, spring=LOW:HIGH" in call(*asked, "--free", "spring").stderr
    assert "slack changes no weight test" in call(*asked, "--free", "slack=0:1").stderr


def test_design(tmp_path: Path) -> None:
    (tmp_path / "arm.toml").write_bytes((EXAMPLES / "arm.toml").read_bytes())
    problem, out = tmp_path / "design.toml", tmp_path / "out"
    text = (EXAMPLES / "design.toml").read_text(encoding="utf-8")
    for key, value in (("generations", 2), ("population", 8)):
        text = re.sub(rf"(?m)^#?\s*{key} =.*", f"{key} = {value}", text)
    problem.write_text(text, encoding="utf-8")
    found = told("design", problem, "--out", out)
    names = "designs.csv front.csv front.pdf arm.pdf arm.toml arm.urdf arm.xml holes.csv cables.csv"
    assert {path.name for path in out.iterdir()} == {*names.split()}
    assert found["designs"] == 16
    assert found["chosen"] == found["compromise"]
    assert max(found["front"]["deflection [m]"]) <= 0.001
    result = call("design", problem, "--out", tmp_path / "again", "--choose", 99)
    assert result.exit_code == 2
    assert "repeat the command with one of them" in " ".join(result.stderr.split())
    table = (tmp_path / "again" / "front.csv").read_text(encoding="utf-8")
    assert table == (out / "front.csv").read_text(encoding="utf-8")


def test_a_design_is_chosen_from_a_finished_folder_without_a_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "arm.toml").write_bytes((EXAMPLES / "arm.toml").read_bytes())
    problem, out = tmp_path / "design.toml", tmp_path / "out"
    text = (EXAMPLES / "design.toml").read_text(encoding="utf-8")
    text = re.sub(r"(?m)^(generations|population) =.*", r"\1 = 8", text)
    text = text.replace("#[[variables]]", "[[variables]]").replace('#of = "wire"', 'of = "wire"')
    problem.write_text(text.replace("#choices", "choices"), encoding="utf-8")
    searched = told("design", problem, "--out", out)
    front = searched["front"]
    count = len(front["wire"])
    assert count > 1
    other = (searched["chosen"] + 1) % count
    monkeypatch.setattr(cdsm, "search_designs", None)
    chosen = told("design", problem, "--out", out, "--choose", other)
    assert {key: chosen[key] for key in ("designs", "feasible", "front", "chosen")} == {
        **{key: searched[key] for key in ("designs", "feasible", "front")},
        "chosen": other,
    }
    arm = cdsm.Manipulator.read(out / "arm.toml")
    assert arm.geometry.hole_radius == front["hole_radius [m]"][other]
    result = call("design", problem, "--out", out, "--choose", count)
    assert result.exit_code == 2
    assert f"the designs 0 to {count - 1}" in " ".join(result.stderr.split())
    problem.write_text(problem.read_text("utf-8").replace("-4.905", "-4.9"), encoding="utf-8")
    result = call("design", problem, "--out", out, "--choose", 0)
    assert result.exit_code == 1
    assert "holds no designs of this problem" in " ".join(result.stderr.split())


def test_reproduce_writes_figures_table_and_numbers(tmp_path: Path) -> None:
    result = call("reproduce", "--out", tmp_path / "new")
    assert result.exit_code == 0, result.output
    written = {path.name: path for path in (tmp_path / "new").iterdir()}
    figures = {f"fig{n}.png" for n in (3, 4, 5, 6, 7, 8, 10, 12, 13)} | {"lead.png"}
    assert set(written) == figures | {"reproduction.json", "reproduction.md"}
    assert "Fig. 6: increment of stiffness" in result.output
    json.loads(written["reproduction.json"].read_text(encoding="utf-8"))


def test_answers_say_which_least_tension_held(tmp_path: Path) -> None:
    """The arm's own minimum of 10 N, although 0 N was asked for."""
    arm = tmp_path / "ARM.toml"
    assert call("new", arm, "--joints", 3).exit_code == 0
    names = cdsm.Manipulator.read(arm).cables.names
    held = [dict.fromkeys(names, 10.0)]
    for command in ("stiffness", "plan --direction z --target 4"):
        words = [*command.split(), "--angles", 10, "--minimum", 0]
        answer = told(words[0], arm, *words[1:])
        assert answer["computed_with"]["least_tension_N"] == held
        assert "least tension 10 N" in call(words[0], arm, *words[1:]).stdout
