"""``cdsm design`` on the example, and on problems with faults."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

import cdsm
from cdsm.cli import app

pytest.importorskip("pymoo")

EXAMPLES = Path(__file__).parents[2] / "examples"


def run(*words: str) -> tuple[int, str]:
    found = CliRunner().invoke(app, ["design", *words])
    return found.exit_code, found.output


def written(folder: Path, text: str) -> Path:
    (folder / "arm.toml").write_text((EXAMPLES / "arm.toml").read_text())
    path = folder / "problem.toml"
    path.write_text(text)
    return path


@pytest.mark.slow
def test_the_example_writes_front_figures_and_the_files_of_an_arm(tmp_path: Path) -> None:
    words = [str(EXAMPLES / "design.toml"), "--out", str(tmp_path / "a"), "--jobs", "1"]
    code, text = run(*words, "--generations", "5", "--population", "8")
    assert code == 0, text
    assert "on the front" in text
    assert (
        "asked: largest first-order deflection under the load at most 1 mm\n" in text
    )  # 0.001 m in the file
    names = "designs.csv front.csv front.pdf arm.pdf arm.toml arm.urdf arm.xml holes.csv cables.csv"
    assert {path.name for path in (tmp_path / "a").iterdir()} == {*names.split()}
    head, *rows = (tmp_path / "a" / "designs.csv").read_text().splitlines()
    assert len(rows) == 40
    front = (tmp_path / "a" / "front.csv").read_text().splitlines()
    assert front[0] == head
    assert len(front) <= len(rows)
    arm = cdsm.Manipulator.read(tmp_path / "a" / "arm.toml")
    assert cdsm.to_urdf(arm.geometry) == (tmp_path / "a" / "arm.urdf").read_text()
    code, again = run(*words, "--generations", "5", "--population", "8", "--json")
    assert code == 0
    told = json.loads(again)
    assert told["designs"] == 40
    assert max(told["front"]["deflection [m]"]) <= 0.001
    assert told["chosen"] == told["compromise"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (('of = "hole_radius"', 'of = "hole_radios"'), "variables[1]"),
        (("at_most = 0.001", "at_most = 0.001\nat_least = 0.0"), "constraints[1]"),
        (('arm = "arm.toml"', ""), "arm: is missing"),
        (("[postures]", "[postures]\nrandom = 3"), "one of random, grid and angles"),
        (("population", "populatoin"), "search.populatoin"),
        (("[[0.0, 0.0, -4.905]]", "[[0.0, 0.0]]"), "loads"),
        (
            ("[0.2, 0.0, 0.2, 0.0, 0.2, 0.0, 0.2, 0.0]", "[0.2, 0.0]"),
            "angles[2] has 2 numbers; give 8 [rad], one for each of joint1_1",
        ),
    ],
)
def test_faults_of_a_problem_are_named(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    text = (EXAMPLES / "design.toml").read_text()
    path = written(tmp_path, text.replace(*change, 1))
    code, output = run(str(path), "--out", str(tmp_path / "out"))
    assert code == 1
    assert said in output
    assert "problem.toml" in output


def test_a_number_that_the_front_lacks_is_named_by_its_option(tmp_path: Path) -> None:
    path = str(EXAMPLES / "design.toml")
    words = ["--generations", "2", "--population", "8", "--jobs", "1", "--choose", "99"]
    code, output = run(path, "--out", str(tmp_path / "out"), *words)
    assert code == 1
    assert "--choose: 99" in output


def test_an_infeasible_problem_ends_with_3_and_says_what_it_misses(tmp_path: Path) -> None:
    text = (EXAMPLES / "design.toml").read_text().replace("at_most = 0.001", "at_most = 1e-6")
    path = written(tmp_path, text)
    words = ["--generations", "1", "--population", "4", "--jobs", "1"]
    code, output = run(str(path), "--out", str(tmp_path / "out"), *words)
    assert code == 3
    assert "deflection" in output
    assert "at most 0.001 mm is asked" in output


def test_an_arm_that_no_search_wrote_is_not_overwritten(tmp_path: Path) -> None:
    path = written(tmp_path, (EXAMPLES / "design.toml").read_text())
    code, output = run(str(path), "--out", str(tmp_path))
    assert code == 2
    assert "that no search wrote" in " ".join(output.replace("│", " ").split())
    assert {each.name for each in tmp_path.iterdir()} == {"arm.toml", "problem.toml"}


REFINED = """
arm = "arm.toml"
loads = [[0.0, 0.0, -2.0]]
maximum = 600.0
worst_friction = true
tolerances = "tolerances.toml"
variables = [
    {of = "hole_radius", low = 0.015, high = 0.035},
    {of = "minimum", low = 5.0, high = 150.0},
]
objectives = [{of = "motor_force"}]
constraints = [{of = "stiffness", direction = "z", at_least = 2000.0}]

[postures]
angles = [
    [0.1, 0.05, 0.1, 0.05, 0.1, 0.05, 0.1, 0.05],
    [-0.2, 0.1, -0.2, 0.1, -0.2, 0.1, -0.2, 0.1],
]
"""


@pytest.mark.slow
def test_a_design_is_refined_under_friction_and_tolerances(tmp_path: Path) -> None:
    path = written(tmp_path, REFINED)
    arm = cdsm.Manipulator.read(tmp_path / "arm.toml").with_friction(0.1)
    arm.write(tmp_path / "arm.toml")
    cdsm.Tolerances(rigidity=0.05, hole_radius=1e-4).write(tmp_path / "tolerances.toml")
    words = [str(path), "--generations", "4", "--population", "8", "--jobs", "1", "--json"]
    found = []
    for more in ([], ["--refine"]):
        code, text = run(*words, "--out", str(tmp_path / f"out{len(more)}"), *more)
        assert code == 0, text
        found.append(json.loads(text)["front"])
    assert found[1]["motor_force [N]"][0] < 0.99 * found[0]["motor_force [N]"][0]
    assert found[1]["stiffness (0, 0, 1) - 2 u [N/m]"][0] >= 2000.0
    made = cdsm.Manipulator.read(tmp_path / "out1" / "arm.toml")
    assert set(made.cables[-1].friction) == {0.1}


def test_what_cannot_be_refined_is_named_before_the_search(tmp_path: Path) -> None:
    out = tmp_path / "out"
    code, output = run(str(EXAMPLES / "design.toml"), "--out", str(out), "--refine")
    assert code == 1
    assert "cables_per_joint is not continuous; leave out --refine." in output
    assert not out.exists()
