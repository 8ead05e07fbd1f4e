"""What it costs to start, as ratios of processes: an import, a first stiffness, a help page.

The floor is Python with numpy, Pinocchio and numba, without which no arm is computed. Python runs
the first calls of kernels itself: a first kernel of the cache would cost two floors alone, since
numba imports scipy.linalg and clears up at exit.
"""

import os
import resource
import subprocess
import sys
from collections.abc import Callable

import pytest

from tests.benchmarks.timing import Clock
from tests.support.patience import HANGS
from tests.support.processes import ROOT

FLOOR = "import numpy, pinocchio, numba"
FIRST_STIFFNESS = """
import cdsm
geometry = cdsm.Geometry.universal(
    joints=5, cables_per_joint=3, link_length=0.05, base_length=0.02,
    disk_offset=0.01, hole_radius=0.03, link_mass=0.1,
)
arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(1e5))
cdsm.stiffness(arm.at([0.1] * arm.nv), [20.0] * len(arm.cables)).joint
"""
HELP_LIBRARIES = "import typer, typer.rich_utils"  # the parts of rich that draw a help page


def children() -> float:
    """Processor time of all processes that were waited for [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def process(*arguments: str) -> Callable[[], object]:
    """A run of Python in a process that may keep its bytecode."""
    kept = {k: value for k, value in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    command = [sys.executable, *arguments]
    return lambda: subprocess.run(
        command, cwd=ROOT, env=kept, stdout=subprocess.DEVNULL, timeout=HANGS, check=True
    )


@pytest.mark.speed
@pytest.mark.parametrize("clock", ["speed"], indirect=True)
@pytest.mark.parametrize(
    ("what", "run", "base", "most"),
    [
        ("import cdsm, in floors", ("-c", "import cdsm"), FLOOR, 0.3),
        ("a first posture and its stiffness, in floors", ("-c", FIRST_STIFFNESS), FLOOR, 2.8),
        ("cdsm --help, over typer and rich", ("-m", "cdsm", "--help"), HELP_LIBRARIES, 2.0),
        ("cdsm --version, over typer", ("-m", "cdsm", "--version"), "import typer, rich", 2.5),
    ],
)
def test_start_up_costs_little_beyond_the_libraries(
    clock: Clock, what: str, run: tuple[str, ...], base: str, most: float
) -> None:
    clock.race(
        what,
        process(*run),
        process("-c", base),
        most=most,
        fast_repeat=1,
        rounds=10,
        watch=children,
    )
