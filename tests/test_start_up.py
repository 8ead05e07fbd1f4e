"""What is imported when: names of cdsm when touched, heavy libraries where they are used."""

import re
import resource
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer.main
from typer.testing import CliRunner

import cdsm
from cdsm import cli
from tests.support.patience import HANGS
from tests.support.processes import ROOT

SOLVERS = {"qpsolvers", "scipy.optimize", "scipy.sparse.linalg", "daqp"}
SCREEN = {"matplotlib", "rich", "viser", "xarray", "zarr"}
OF_FILES = {"trimesh", "yourdfpy"}
NUMERICS = {"lxml", "numba", "numpy", "pinocchio", "scipy"}

FIRST_STIFFNESS = """
import cdsm
geometry = cdsm.Geometry.universal(
    joints=5, cables_per_joint=3, link_length=0.05, base_length=0.02,
    disk_offset=0.01, hole_radius=0.03, link_mass=0.1,
)
arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(1e5))
pose = arm.at([0.1] * arm.nv)
cdsm.stiffness(pose, cdsm.distribute_tension(pose, 20.0)).along("z")
"""
STRAND = """
import cdsm
pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
print(cdsm.stiffness(pose, [50.0] * 15))
"""
HELP = """
from cdsm.cli import COMMANDS, app
import contextlib, io
for arguments in ["--version"], ["--help"], *([name, "--help"] for name in COMMANDS):
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        app(arguments)
"""


LATER = SOLVERS | SCREEN | OF_FILES


@pytest.mark.parametrize(
    ("program", "absent"),
    [
        ("import cdsm", NUMERICS | LATER | {"pydantic"}),
        (FIRST_STIFFNESS, SCREEN | OF_FILES | {"cdsm.report", "numba", "scipy.optimize"}),
        (STRAND, LATER | {"cdsm.report", "numba"}),
        (HELP, NUMERICS | SOLVERS | OF_FILES | {"matplotlib"}),
    ],
    ids=("cdsm", "stiffness", "strand", "help"),
)
def test_nothing_is_imported_that_is_not_used(program: str, absent: set[str]) -> None:
    command = [sys.executable, "-c", f"{program}\nimport sys; print(*sys.modules)"]
    given = {"capture_output": True, "text": True, "timeout": HANGS, "check": True}
    done = subprocess.run(command, cwd=ROOT, **given)  # type: ignore[call-overload]
    assert not absent & set(done.stdout.split())


def test_each_public_name_is_a_line_of_the_stub() -> None:
    assert dir(cdsm) == sorted({*cdsm.__all__, "control", "paper", "plots", "view"})
    stub = Path(cdsm.__file__).with_name("__init__.pyi").read_text(encoding="utf-8")
    found = re.findall(r"^from (\S+) import (\w+) as \2$", stub, re.MULTILINE)
    assert {name: module for module, name in found} == cdsm._HOME
    assert stub.count("import") - 1 == len(found) == len(cdsm._HOME)


def test_the_list_of_commands_reads_the_options_of_none(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[Any] = []
    parameters = typer.main.get_params_from_function
    monkeypatch.setattr(
        "typer.main.get_params_from_function",
        lambda function: read.append(function) or parameters(function),
    )
    assert "stiffness" in CliRunner().invoke(cli.app, ["--help"]).output
    assert {function.__module__ for function in read} == {cli.__name__}
    assert CliRunner().invoke(cli.app, ["stiffness", "--help"]).exit_code == 0
    assert read[-1].__name__ == "show_stiffness"


def user_seconds(arguments: list[str]) -> float:
    """User time of the processor that Python takes with these arguments."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([sys.executable, *arguments], cwd=ROOT, stdout=subprocess.DEVNULL, check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


@pytest.mark.speed
def test_help_takes_little_more_than_its_libraries() -> None:
    programs = {
        "libraries": ["-c", "import typer, rich"],
        "--help": ["-m", "cdsm", "--help"],
        "--version": ["-m", "cdsm", "--version"],
    }
    # in turn, as a machine slows all of them
    rounds = [{name: user_seconds(words) for name, words in programs.items()} for _ in range(20)]
    middle = {name: statistics.median(each[name] for each in rounds) for name in programs}
    assert middle["--help"] < 1.6 * middle["libraries"]
    assert middle["--version"] < middle["libraries"]
