"""Speed of the batch, as ratios in the same run; each compares the numbers first."""

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm.batch import Batch, Tensions
from cdsm.presets import STRAND_1X19
from cdsm.support.values import Array
from tests.benchmarks.naive import NaiveArm, naive_joint_stiffness
from tests.benchmarks.test_speed import GRAVITY, RIGIDITY, SIZES, arm
from tests.benchmarks.timing import Clock, seconds


def problem(joints: int, rows: int) -> tuple[cdsm.Manipulator, Array, Array, Array]:
    one = arm(joints)
    rng = np.random.default_rng(joints)
    wrench: Array = rng.normal(0.0, 2.0, (rows, 6))
    wrench[:, 3:] *= 0.1
    q: Array = rng.uniform(-0.17, 0.17, (rows, one.nv))
    return one, q, rng.uniform(20.0, 90.0, (rows, len(one.cables))), wrench


def per_posture(run: Callable[[], object], rows: int) -> float:
    """Microseconds, the best of some rounds."""
    return min(seconds(run, 1) for _ in range(30)) / rows * 1e6


def test_batch_is_ten_thousand_times_faster_than_differences(clock: Clock | None) -> None:
    rows = 4000
    one, q, tension, wrench = problem(5, rows)
    naive = NaiveArm(5, gravity=GRAVITY, **SIZES)

    def differences() -> Array:
        return naive_joint_stiffness(naive, q[0], tension[0], wrench[0], RIGIDITY)

    def batch(threads: int = 1, outputs: tuple[str, ...] = ("joint",)) -> Batch:
        return cdsm.evaluate(one, q, tension, wrench, outputs, threads=threads)

    K = batch()["joint"][0]
    # second differences with h = 1e-4 truncate at h² and round at 1e-16/h²; the crosses weigh 1e-6
    np.testing.assert_allclose(K, differences(), atol=1e-6 * abs(K).max())
    if clock is None:
        return
    print("\nbatch, n = 5:")
    for outputs in (("joint",), ("compliance",), ("joint", "margin")):
        cost = [per_posture(lambda t=t: batch(t, outputs), rows) for t in (1, 2)]  # type: ignore[misc]  # noqa: B023
        # not asserted: other work may hold the second core
        print(
            f"    {' and '.join(outputs)}: {cost[0]:.2f} us a posture, two threads "
            f"{cost[0] / cost[1]:.2f} times faster"
        )
    what = "batch, n = 5, one core: faster than differences"
    clock.race(what, differences, batch, least=10_000.0, rows=rows, fast_repeat=1)


def test_measured_wires_cost_little_more_than_linear_ones(clock: Clock | None) -> None:
    one, q, _, _ = problem(5, 4000)
    points = np.geomspace(2.3, 800.0, 20)
    table = cdsm.TabulatedElasticity(tuple(points), tuple(STRAND_1X19.strain(points)))
    laws = cdsm.LinearElasticity(RIGIDITY), STRAND_1X19.slack_below(), table

    def batch(law: cdsm.Elasticity) -> Callable[[], Array]:
        own = one.with_cables([replace(each, elasticity=law) for each in one.cables])
        return lambda: cdsm.evaluate(
            own, q, minimum=20.0, outputs=("along",), direction="z", threads=1
        )["along"]

    linear, strand, tabulated = map(batch, laws)
    # the table has points of the strand; the median error of EA between them is below 1 %
    np.testing.assert_allclose(np.median(tabulated() / strand()), 1.0, atol=0.02)
    if clock:
        for what, run in (("Eq. 19", strand), ("a table", tabulated)):
            name = f"batch, n = 5: {what}, cost over linear wires"
            clock.race(name, run, linear, most=1.75, fast_repeat=1, rounds=10)


def test_batched_tension_is_six_times_faster_than_one_by_one(clock: Clock | None) -> None:
    rows = 4000
    one, q, _, _ = problem(5, rows)
    pose = one.at(q[0])

    def batch() -> Tensions:
        return cdsm.distribute_tensions(one, q, 5.0, threads=1)

    pull = batch()
    assert pull.ok.all()
    single = cdsm.distribute_tension(pose, 5.0).values
    np.testing.assert_allclose(pull.values[0], single, rtol=0.0, atol=1e-9 * single.max())
    if clock:
        print(f"\nbatched tension, n = 5: {per_posture(batch, rows):.2f} us")
        clock.race(
            "batched tension, n = 5: faster than one by one",
            lambda: cdsm.distribute_tension(pose, 5.0),
            batch,
            least=6.0,
            rows=rows,
            slow_repeat=50,
            fast_repeat=1,
        )


def test_sweep_into_a_store_costs_little_more_than_its_batch(
    tmp_path: Path, clock: Clock | None
) -> None:
    # half of these postures cannot be held: their tensions are searched
    one, poses = cdsm.presets.virtual_prototype(), cdsm.RandomPoses(20_000 if clock else 200)
    q = cdsm.sweep(one, poses, outputs="tip_position").q.values
    stores = (tmp_path / f"{number}.zarr" for number in itertools.count())

    def batch() -> Batch:
        outputs = ("tip", "along", "margin", "compliance")
        return cdsm.evaluate(one, q, minimum=50.0, outputs=outputs, direction=np.eye(3))

    def sweep() -> Any:
        return cdsm.sweep(one, poses, minimum=50.0, store=next(stores), progress=False)

    found, stored = batch(), sweep()
    np.testing.assert_allclose(stored.along, found["along"], rtol=1e-10)
    np.testing.assert_allclose(stored.tip_position, found["tip"][:, :3, 3], rtol=1e-10)
    if clock:
        what = "20 000 postures, sweep into a store: cost over the batch"
        clock.race(what, sweep, batch, most=2.8, fast_repeat=1, rounds=3)


@pytest.mark.parametrize(("joints", "most", "least"), [(5, 4.0, 18.0), (20, 4.0, 3.3)])
def test_one_posture_to_its_reading_costs_little_more_than_its_stiffness(
    joints: int, most: float, least: float, clock: Clock | None
) -> None:
    rows, low = 800, 20.0 if joints == 5 else 60.0
    one, q, tension, _ = problem(joints, rows)

    def single() -> float:
        pose = one.at(q[0])
        return cdsm.stiffness(pose, cdsm.distribute_tension(pose, low)).along("z")

    def stiffness() -> cdsm.Stiffness:
        return cdsm.stiffness(one.at(q[0]), tension[0])

    def batch() -> Array:
        outputs = ("along",)
        return cdsm.evaluate(one, q, minimum=low, outputs=outputs, direction="z", threads=1)[
            "along"
        ]

    assert single() == pytest.approx(batch()[0], rel=1e-9)
    if clock:
        what = f"at, tension, stiffness, along, n = {joints}"
        over, times = f"{what}: cost over posture + stiffness", f"{what}: batch, times faster"
        clock.race(over, single, stiffness, most=most, slow_repeat=20, fast_repeat=20, rounds=10)
        clock.race(
            times, single, batch, least=least, rows=rows, slow_repeat=20, fast_repeat=1, rounds=10
        )
