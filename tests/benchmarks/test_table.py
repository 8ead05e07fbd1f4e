"""The table of what things cost, one posture at a time and many.

pytest -m speed -s tests/benchmarks/test_table.py        prints it, with the machine and its load
"""

import os
import platform
from collections.abc import Callable
from datetime import date
from pathlib import Path

import numpy as np

import cdsm
from cdsm.kernels.compiling import at_once
from tests.benchmarks.test_batch_speed import per_posture, problem
from tests.benchmarks.timing import Clock, seconds

ROWS = {5: 2000, 10: 800, 20: 200, 40: 50}
"""Postures at once, by the number of joints."""

COLUMNS = ("single", "batch", "two threads", "tension, single", "batch", "two threads")


def runs(joints: int, rows: int) -> list[tuple[Callable[[], object], int]]:
    """What is timed, and its postures: K_θ under given tensions, then least tensions.

    One by one, many by one thread and by two; the numbers of each are compared first. Small angles,
    so that every posture can be balanced.
    """
    one, q, tension, wrench = problem(joints, rows)
    q *= 0.5
    K = cdsm.evaluate(one, q, tension, wrench, ("joint",))["joint"]
    pull = cdsm.distribute_tensions(one, q, 20.0)
    assert pull.ok.all()
    single = cdsm.stiffness(one.at(q[0]), tension[0], wrench=wrench[0]).joint
    np.testing.assert_allclose(K[0], single, rtol=0.0, atol=1e-12 * abs(single).max())
    least = cdsm.distribute_tension(one.at(q[0]), 20.0).values
    np.testing.assert_allclose(pull.values[0], least, rtol=0.0, atol=1e-9 * least.max())

    def batch(threads: int) -> tuple[Callable[[], object], int]:
        return lambda: cdsm.evaluate(one, q, tension, wrench, ("joint",), threads=threads), rows

    def tensions(threads: int) -> tuple[Callable[[], object], int]:
        return lambda: cdsm.distribute_tensions(one, q, 20.0, threads=threads), rows

    return [
        (lambda: cdsm.stiffness(one.at(q[0]), tension[0], wrench=wrench[0]).joint, 1),
        batch(1),
        batch(2),
        (lambda: cdsm.distribute_tension(one.at(q[0]), 20.0), 1),
        tensions(1),
        tensions(2),
    ]


def cost(run: Callable[[], object], rows: int) -> float:
    """Microseconds a posture, the best of some rounds."""
    with at_once():
        run()
        return (
            per_posture(run, rows) if rows > 1 else 1e6 * min(seconds(run, 20) for _ in range(30))
        )


def machine() -> str:
    """Its processor, as Linux names it, and how busy it is."""
    about = Path("/proc/cpuinfo")
    lines = about.read_text(encoding="utf-8").splitlines() if about.exists() else []
    names = [line.partition(": ")[2] for line in lines if line.startswith("model name")]
    name = names[0] if names else platform.processor()
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{name}, {os.cpu_count()} cores{load}, {date.today()}"


def test_many_at_once_cost_less_than_one_by_one_at_every_size(clock: Clock | None) -> None:
    sizes = {joints: runs(joints, rows) for joints, rows in ROWS.items()}
    if clock is None:
        return
    print(f"\n{machine()}; microseconds a posture\n")
    costs = {joints: [cost(*run) for run in timed] for joints, timed in sizes.items()}
    print("| joints | " + " | ".join(COLUMNS) + " |")
    print("|---:" * (len(COLUMNS) + 1) + "|")
    for joints, row in costs.items():
        print(f"| {joints} | " + " | ".join(f"{each:.3g}" for each in row) + " |")
    for joints, timed in sizes.items():
        for what, column in (("K_θ", 0), ("tension", 3)):
            (one, _), (many, rows) = timed[column], timed[column + 1]
            told = f"{what}, n = {joints}: batch faster than one by one"
            clock.race(told, one, many, least=1.0, rows=rows, slow_repeat=20, fast_repeat=1)
