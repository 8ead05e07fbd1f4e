"""Exit codes and messages of the command line, --set and help."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
import typer.main
from typer.testing import CliRunner

import cdsm
from cdsm.cli import app
from tests.cli.test_commands import EXAMPLES, call, probe, told

__all__ = ["probe"]  # a fixture

COMMANDS = typer.main.get_command(app).commands  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (
            "stiffness PROBE --set universal.lead=0.4 --set series_stiffness=200 --minimum 60",
            3,
            "UNSTABLE",
        ),
        ("stiffness PROBE --load 0,0,-1 --set wire=48e3 --angles 5", 0, "along"),
        ("stiffness PROBE --maximum 2 --load 0,0,-50", 3, "no tension within the bounds"),
        ("stiffness PROBE --minimum 2.21 --angles 5 --check", 3, "NOT CHECKED"),
        ("stiffness PROBE --angles 5", 1, "Give a minimum of 2.2 N or more"),
        ("stiffness PROBE --angles 80", 1, "joint1_1 = 80° is outside"),
        ("stiffness PROBE --angles 1,2", 2, "one for each of joint1_1"),
        ("stiffness PROBE --angles joint9_1=2", 1, "no joint is called 'joint9_1'"),
        ("stiffness PROBE --load 1,2", 2, "give FX,FY,FZ or"),
        ("stiffness PROBE --load 1,2,nan", 1, "--load: "),
        ("stiffness PROBE --mass 1 --set gravity=[0,0,0]", 2, "has no weight without gravity"),
        ("stiffness PROBE --minimum 50 --maximum 20", 1, "maximum: 20 N"),
        ("stiffness PROBE --out report.pdf", 2, "does not end in .html or .txt"),
        ("stiffness absent.toml", 1, "does not exist"),
        ("stiffness sweep.nc", 1, "is a sweep or a table, no arm"),
        ("weigh PROBE", 2, "give it or --mass"),
        ("weigh PROBE --minimum 30 --load 0,0,1,0,1,0", 2, "a weight is a force"),
        ("buckle PROBE --minimum 5", 2, "--load or --mass"),
        ("plan PROBE --direction z", 0, "the stiffness can be"),
        ("plan PROBE --direction z --target 3 --max-change-per-sample 1", 2, "needs --path"),
        ("sweep PROBE --random 5", 2, "where the answer goes"),
        ("sweep PROBE --out s.csv", 2, "give one of them"),
        ("sweep PROBE --grid joint1_1=-9:9:1 --out s.csv", 2, "2 to 10^6 angles"),
        ("sweep PROBE --random 5 --out s.csv", 3, "no posture could be evaluated"),
        ("new arm.toml --from PROBE", 2, "is no robot"),
        ("view PROBE --port 70000", 1, "port: 70000"),
        ("stiffness PROBE --angles joint2_1=nan", 1, "--angles of joint2_1: nan"),
        ("sweep PROBE --random 5 --out s.csv --quantity margin", 2, "is of --figure"),
        ("export PROBE arm.urdf --minimum 5", 2, "are those of a MuJoCo model"),
        ("new arm.toml --no-check-inertia", 2, "goes with --from only"),
        ("new arm.toml --from . --cables c.toml --tip a", 2, "are those of the CASPR model"),
        ("buckle PROBE --load 0,0,-1e-4 --minimum 9", 0, "half a million times it was tried"),
    ],
)
def test_exit_codes_and_messages(
    words: str, code: int, said: str, probe: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(probe.parent)
    result = call(*words.replace("PROBE", "probe.toml").split())
    assert result.exit_code == code, result.output
    assert said in " ".join(result.output.split())
    assert "in Python" not in result.stderr
    if code == 1 or "--load" in words:
        error = told(*words.replace("PROBE", "probe.toml").split(), code=code)
        assert said in error.get("message", said)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("minimum=a", "minimum: input should be a valid number, but is 'a'"),
        (
            "universal.link_mas=1",
            "universal.link_mas: is not a key that is known here; did you mean",
        ),
        ("cables.cable9_1.wire=3", "no cable is called 'cable9_1'"),
        (
            "universal.minimum=3",
            "universal.minimum: is not a key that is known here; it belongs at the top",
        ),
        ("lead=3", "write it below [universal]"),
        ("link_length=3", "write it below [universal]"),
        ("minmum=3", "minmum: is not a key that is known here; did you mean 'minimum'?"),
        ("hinged.joints=3", "hinged: stands beside [universal]; an arm has one of them"),
        ("minimum=-3", "cannot be read as an arm with these changes"),
        ("springs.joint9=3", "probe.toml: no joint is called 'joint9'"),
        ("wire=probe.toml", "probe.toml: is not an elasticity:\n  - kind"),
        ("cables=[]", "cables: none given"),
        ("minimum", "'minimum' given; give KEY=VALUE"),
        ("no key", "give KEY=VALUE, such as minimum=5"),
    ],
)
def test_set_reports_the_faults_of_the_file(change: str, said: str, probe: Path) -> None:
    assert said in call("stiffness", probe, "--set", change).stderr


def test_angles_that_an_unset_variable_left_empty_are_refused(probe: Path) -> None:
    for words in (("stiffness",), ("weigh", "--mass", 1), ("plan", "--direction", "z"), ("view",)):
        result = call(words[0], probe, *words[1:], "--angles", "", "--minimum", 9)
        assert result.exit_code == 2


def test_set_is_what_stands_in_the_file(tmp_path: Path) -> None:
    path, file = EXAMPLES / "two_sections.toml", tmp_path / "arm.toml"
    changes: dict[str, Any] = {
        "wire": 48e3,
        "gravity": "-y",
        "slack_below": False,
        "friction": 0.1,
        "sections": {"2": {"universal": {"hole_radius": 0.02}}},
        "cables": {"cable1_1": {"minimum": 20.0, "friction": 0.3}},
    }
    words = "wire=48e3 gravity=-y slack_below=false friction=.1 cables.cable1_1.minimum=20.0"
    words += " sections.2.universal.hole_radius=0.02 cables.cable1_1.friction=0.3"
    expected = cdsm.Manipulator.read(path, changes=changes)
    assert expected.cables[0].friction[0] == 0.3
    assert {*expected.cables[1].friction} == {0.1}
    assert expected.gravity.tolist() == [0.0, -9.81, 0.0]
    expected.write(file)
    sets = [word for each in words.split() for word in ("--set", each)]
    changed = told("stiffness", path, *sets, "--angles", 5)
    assert changed == told("stiffness", file, "--angles", 5)


def test_a_folder_that_must_not_be_written_is_refused_first(
    probe: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.access", lambda path, mode: not mode & os.W_OK)
    monkeypatch.setattr(cdsm, "distribute_tension", None)  # nothing is computed
    page, folder = probe.with_name("page.html"), probe.with_name("new")
    for words in (
        ("stiffness", probe, "--check", "--out", page),
        ("reproduce", "--out", folder),
        ("sweep", probe, "--random", 5, "--minimum", 9, "--store", folder / "s.zarr"),
    ):
        result = call(*words)
        assert result.exit_code in (1, 2)
        assert "you may not write to" in " ".join(result.stderr.split())


def test_too_little_memory_is_told(probe: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr(cdsm, "stiffness", full)
    assert "out of memory" in told("stiffness", probe, "--minimum", 9, code=1)["message"]


def test_a_damaged_store_is_named_and_its_status_computed_again(probe: Path) -> None:
    store = probe.with_name("s.zarr")
    table = probe.with_name("s.csv")
    words = ("sweep", probe, "--random", 5, "--minimum", 9, "--store", store)
    assert call(*words, "--out", table).exit_code == 0
    whole = table.read_text(encoding="utf-8")
    (store / "margin" / "c" / "0").write_bytes(b"no chunk")
    result = call(*words, "--out", table)
    assert result.exit_code == 1
    assert "s.zarr: is damaged: margin" in result.stderr
    assert "Delete status/c/0" in result.stderr
    (store / "status" / "c" / "0").write_bytes(b"no chunk")  # as if deleted
    assert call(*words, "--out", table).exit_code == 0
    assert table.read_text(encoding="utf-8") == whole


def test_help_fits_a_terminal() -> None:
    wanted = "new stiffness weigh buckle plan sweep design view fit identify estimate export "
    wanted += "reproduce"
    assert [*COMMANDS] == wanted.split()
    for name in COMMANDS:
        page = CliRunner().invoke(app, [name, "--help"], terminal_width=80).output.splitlines()
        assert len(page) <= 80
        assert max(map(len, page)) <= 80


def test_the_list_of_commands_has_their_whole_first_lines() -> None:
    page = CliRunner().invoke(app, ["--help"], terminal_width=80).output
    assert "..." not in page.partition("Commands:")[2]
    for command in COMMANDS.values():  # the page of the site is made of these
        line = command.get_short_help_str()
        assert line == command.help.partition("\n")[0]
        assert line in " ".join(page.split())


def test_an_arm_that_buckles_under_a_weight_says_what_following_motors_hold() -> None:
    arm = [
        "--angles",
        "8",
        "--minimum",
        "1",
        "--maximum",
        "130",
        "--set",
        "wire=2000",
        "--mass",
        "4",
    ]
    result = call("weigh", str(EXAMPLES / "arm.toml"), *arm)
    assert result.exit_code == 3
    robot = cdsm.Manipulator.read(EXAMPLES / "arm.toml")
    soft = robot.with_cables(
        [
            cdsm.Cable(**{**vars(cable), "elasticity": cdsm.LinearElasticity(2000.0)})
            for cable in robot.cables
        ]
    ).at([0.13962634015954636] * robot.nv)
    following = cdsm.payload(soft, "-z", 1.0, 130.0).following
    assert following is not None
    assert f"motors follow: {following.force:.4g} N ({following.mass:.4g} kg)" in result.output
