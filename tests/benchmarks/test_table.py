"""The table of what things cost, one posture at a time and many.

pytest tests/benchmarks/test_table.py -s        prints it, with the machine and its load
"""

import os
import platform
from collections.abc import Callable
from datetime import date
from pathlib import Path

import numpy as np

import cdsm
from tests.benchmarks.test_batch_speed import per_posture, problem
from tests.benchmarks.timing import seconds

COLUMNS = ("single", "batch", "two threads", "tension, single", "batch", "two threads")


def costs(joints: int, rows: int) -> list[float]:
    """Microseconds a posture, best of some rounds: K_θ under given tensions, then least tensions.

    Small angles, so that every posture can be balanced.
    """
    one, q, tension, wrench = problem(joints, rows)
    q *= 0.5
    K = cdsm.evaluate(one, q, tension, wrench, ("joint",))["joint"]
    pull = cdsm.distribute_tensions(one, q, 20.0)
    assert pull.ok.all()
    single = cdsm.stiffness(one.at(q[0]), tension[0], wrench=wrench[0]).joint
    np.testing.assert_allclose(K[0], single, rtol=0.0, atol=1e-12 * abs(single).max())
    least, pose = cdsm.distribute_tension(one.at(q[0]), 20.0).values, one.at(q[0])
    np.testing.assert_allclose(pull.values[0], least, rtol=0.0, atol=1e-9 * least.max())

    def stiffness() -> None:
        cdsm.stiffness(one.at(q[0]), tension[0], wrench=wrench[0]).joint  # noqa: B018

    def best(run: Callable[[], object]) -> float:
        return 1e6 * min(seconds(run, 20) for _ in range(30))

    def batch(threads: int) -> float:
        def run() -> None:
            cdsm.evaluate(one, q, tension, wrench, ("joint",), threads=threads)

        return per_posture(run, rows)

    def tensions(threads: int) -> float:
        def run() -> None:
            cdsm.distribute_tensions(one, q, 20.0, threads=threads)

        return per_posture(run, rows)

    distribution = best(lambda: cdsm.distribute_tension(pose, 20.0))
    return [best(stiffness), batch(1), batch(2), distribution, tensions(1), tensions(2)]


def machine() -> str:
    """Its processor, as Linux names it, and how busy it is."""
    about = Path("/proc/cpuinfo")
    lines = about.read_text(encoding="utf-8").splitlines() if about.exists() else []
    names = [line.partition(": ")[2] for line in lines if line.startswith("model name")]
    name = names[0] if names else platform.processor()
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{name}, {os.cpu_count()} cores{load}, {date.today()}"


def test_many_at_once_cost_less_than_one_by_one_at_every_size() -> None:
    before = machine()
    rows = {joints: costs(joints, count) for joints, count in ((5, 2000), (10, 800), (20, 200))}
    rows[40] = costs(40, 50)
    print(f"\n{before}; microseconds a posture\n")
    print("| joints | " + " | ".join(COLUMNS) + " |")
    print("|---:" * (len(COLUMNS) + 1) + "|")
    for joints, cost in rows.items():
        print(f"| {joints} | " + " | ".join(f"{each:.3g}" for each in cost) + " |")
    for cost in rows.values():
        assert cost[1] < cost[0]
        assert cost[4] < cost[3]
