"""Speed of the batch, as ratios in the same run; each compares the numbers first."""

import numpy as np
import pytest

import cdsm
from cdsm.batch import Batch, Tensions
from cdsm.support.values import Array
from tests.benchmarks.naive import NaiveArm, naive_joint_stiffness
from tests.benchmarks.test_speed import GRAVITY, RIGIDITY, SIZES, arm
from tests.benchmarks.timing import Clock


def problem(joints: int, rows: int) -> tuple[cdsm.Manipulator, Array, Array, Array]:
    one = arm(joints)
    rng = np.random.default_rng(joints)
    wrench: Array = rng.normal(0.0, 2.0, (rows, 6))
    wrench[:, 3:] *= 0.1
    q: Array = rng.uniform(-0.17, 0.17, (rows, one.nv))
    return one, q, rng.uniform(20.0, 90.0, (rows, len(one.cables))), wrench


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
    what = "batch, n = 5, one core: faster than differences"
    clock.race(what, differences, batch, least=10_000.0, rows=rows, fast_repeat=1)


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
        clock.race(
            "batched tension, n = 5: faster than one by one",
            lambda: cdsm.distribute_tension(pose, 5.0),
            batch,
            least=6.0,
            rows=rows,
            slow_repeat=50,
            fast_repeat=1,
        )


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
