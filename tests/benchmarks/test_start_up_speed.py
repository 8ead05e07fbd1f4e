"""What it costs to start, as ratios of processes: an import, a first stiffness, a help page.

The floor is Python with numpy, Pinocchio and qpsolvers, without which no arm is computed.
"""

import os
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.benchmarks.timing import Clock
from tests.support.patience import HANGS
from tests.support.processes import ROOT

FLOOR = "import numpy, pinocchio, qpsolvers"
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
FIRST_DAY = f"""
import numpy as np
{FIRST_STIFFNESS}
print(cdsm.stiffness(pose, cdsm.distribute_tension(pose, 20.0)))
q = np.random.default_rng(0).uniform(-0.1, 0.1, (1000, arm.nv))
cdsm.evaluate(arm, q, minimum=20.0, outputs=("along",), direction="z")
"""
HELP_LIBRARIES = "import typer"


def children() -> float:
    """Processor time of all processes that were waited for [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def process(cache: Path, *arguments: str) -> Callable[[], object]:
    """A run of Python in a process that may keep its bytecode, and has no compiled kernels."""
    kept = {k: value for k, value in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    kept["NUMBA_CACHE_DIR"] = str(cache)
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
        ("a first posture and its stiffness, in floors", ("-c", FIRST_STIFFNESS), FLOOR, 1.5),
        ("a first print and a first batch of 1000, in floors", ("-c", FIRST_DAY), FLOOR, 3.0),
        ("cdsm --help, over typer", ("-m", "cdsm", "--help"), HELP_LIBRARIES, 2.0),
        (
            "cdsm --version, over typer",
            ("-m", "cdsm", "--version"),
            "import typer",
            2.0,
        ),
    ],
)
def test_start_up_costs_little_beyond_the_libraries(
    clock: Clock, what: str, run: tuple[str, ...], base: str, most: float, tmp_path: Path
) -> None:
    clock.race(
        what,
        process(tmp_path, *run),
        process(tmp_path, "-c", base),
        most=most,
        fast_repeat=1,
        rounds=4,
        watch=children,
    )
    assert not list(tmp_path.rglob("*.nbi")), "a kernel took so long that it was compiled"
