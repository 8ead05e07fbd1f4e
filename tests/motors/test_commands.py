"""Commands with [motors.NAME] in the file: the motors' line, what is answered, what is refused."""

import pickle
from pathlib import Path

import numpy as np
import pytest

import cdsm
from tests.cli.test_commands import call, told
from tests.motors.test_file import ARM, NAMED
from tests.support.motors import BENT, spooled

PAIR = NAMED[: NAMED.index("[motors.m2]")]
NOTE = "needs its own assembly at this posture: 5 motors for 6 cables"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "ARM.toml"
    file.write_text(ARM.replace('wire = "1x19-1.2mm"', "wire = 48e3\nminimum = 5.0") + PAIR)
    return file


def test_stiffness_prints_the_motors_and_takes_another_stiffness(path: Path) -> None:
    found = told("stiffness", path, "--angles", 5)
    arm = cdsm.Manipulator.read(path)
    pose = arm.at(np.full(4, np.deg2rad(5.0)))
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 0.0))
    np.testing.assert_allclose(found["along_N_per_m"], [K.along(u) for u in "xyz"], rtol=1e-12)
    assert found["drives"]["m1"]["stiffness_Nm_per_rad"] == 20.0
    assert any(NOTE in warning for warning in found["warnings"])
    softer = told("stiffness", path, "--angles", 5, "--set", "motors.m1.stiffness=2")
    assert softer["along_N_per_m"][1] < 0.9 * found["along_N_per_m"][1]
    text = " ".join(call("stiffness", path, "--angles", 5).output.split())
    assert "5 motors for 6 cables: m1 (cable1_1 +12 mm, cable1_2 -12 mm): holds its angle" in text
    assert NOTE in text


def test_weigh_tells_by_how_far_motors_yield(path: Path) -> None:
    result = call("weigh", path, "--angles", 5, "--mass", 0.1)
    assert result.exit_code == 0
    text = " ".join(result.output.split())
    assert "motors yield: m1 by " in text
    assert "motors locked: " in text


def test_report_page_has_the_motors_and_says_what_it_cannot_draw(path: Path) -> None:
    page = path.parent / "R.html"
    assert call("stiffness", path, "--angles", 5, "--out", page).exit_code == 0
    text = page.read_text("utf-8")
    assert "5 motors for 6 cables: m1 (cable1_1 +12 mm, cable1_2 -12 mm): holds its angle" in text
    assert NOTE in text
    assert "tensions of 6 cables are not free: 5 motors move them" in text  # no curve over tension


@pytest.mark.parametrize(
    "words",
    [
        "buckle {} --angles 5",
        "plan {} --angles 5 --direction z --target 3",
        "sweep {} --random 5 --minimum 10 --out {}.csv",
        "stiffness {} --tension cable1_1=20",
    ],
)
def test_commands_that_need_free_tensions_are_refused(path: Path, words: str) -> None:
    result = call(*words.replace("{}", str(path)).split())
    assert result.exit_code == 1
    text = " ".join(result.output.split())
    assert "tensions of 6 cables are not free: 5 motors move them" in text


def test_stiffness_and_weigh_take_what_motors_are_told(path: Path) -> None:
    """--motors is forward_statics(motors=), in degrees and mm, from an assembly at --angles."""
    arm = cdsm.Manipulator.read(path)
    pose = arm.at(np.full(4, np.deg2rad(3.0)))
    assembly = arm.assemble(pose, cdsm.distribute_tension(pose, 40.0))
    told_motors = {"m1": np.deg2rad(6.0), "cable2_3": 0.0005}
    rest = cdsm.forward_statics(arm, motors=told_motors, assembly=assembly)
    words = [path, "--motors", "m1=6,cable2_3=0.5", "--angles", 3, "--minimum", 40]
    found = told("stiffness", *words)
    np.testing.assert_allclose([*found["tension_N"].values()], rest.tension, rtol=1e-9)
    np.testing.assert_allclose(found["along_N_per_m"], [rest.along(u) for u in "xyz"], rtol=1e-9)
    assert found["motor_turn_rad"]["m1"] == np.deg2rad(6.0)
    moved = told("weigh", *words, "--mass", 0.1)["displacements_m"][-1]
    test = cdsm.weight_test(rest.pose, rest, [0.0, 0.0, -0.981])
    np.testing.assert_allclose(moved, test.displacement, rtol=1e-6)
    for wrong, said in (
        (["--motors", "m1"], "--motors: 'm1' given; NAME=DEG,..., names of m1, cable1_3"),
        (["--motors", "m9=5"], "no motor is called 'm9'"),
        (["--motors", "m1=a"], "--motors: 'a' given"),
        (["--motors", "m1=5,m1=6"], "--motors: m1 is given twice"),
        (["--motors", "m1=5", "--pull", "cable1_1=5"], "each says what the motors do: give one"),
    ):
        result = call("stiffness", path, *wrong)
        assert result.exit_code
        assert said in " ".join(result.output.split())
    refused = " ".join(call("stiffness", path, "--pull", "cable1_1=5").output.split())
    assert "give --motors, how far they turn, in degrees." in refused


def test_designs_are_refused_by_name() -> None:
    arm = spooled()
    variable = cdsm.Variable("hole_radius", 0.02, 0.03)
    goal = cdsm.Objective("along", "z")
    with pytest.raises(cdsm.InvalidInput, match="designs know one rigid motor for each cable, not"):
        cdsm.DesignProblem(arm=arm, variables=[variable], objectives=[goal], postures=[BENT])


def test_results_survive_pickling() -> None:
    arm = spooled(20.0, cdsm.LinearElasticity(2e4))
    straight = arm.at(np.zeros(8))
    assembly = arm.assemble(straight, cdsm.distribute_tension(straight, 60.0))
    pull = cdsm.distribute_tension(arm.at(0.5 * BENT), 5.0, assembly=assembly)
    rest = cdsm.forward_statics(arm, motors=pull.commands, assembly=assembly)
    for result in (assembly, pull, rest):
        again = pickle.loads(pickle.dumps(result))
        assert str(again) == str(result)
        assert again.to_dict() == result.to_dict()
    assert not pull.commands.flags.writeable


def test_small_loads_are_not_passed_over_where_motors_yield(path: Path) -> None:
    words = ("stiffness", path, "--angles", 5, "--set", "friction=0.1")
    text = " ".join(call(*words).output.split())
    assert "what small loads measure is not told: friction: m1 yields: friction in the" in text
    assert "m1 yields" in told(*words)["sticking"]
