"""What is imported when: names of cdsm when touched, heavy libraries where they are used."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import cdsm
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
from cdsm.cli import app
import contextlib, io
commands = [each.name for each in app.registered_commands]
for arguments in ["--version"], ["--help"], *([name, "--help"] for name in commands):
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
