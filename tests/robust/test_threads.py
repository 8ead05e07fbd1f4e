"""Many threads: the numbers of one thread, and nothing shared that could change."""

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np

import cdsm
from tests.support.arms import (
    random_arm,
    random_posture,
    random_tension,
    random_wrench,
)

THREADS = 8
Work = Callable[[cdsm.Manipulator, int], tuple[bytes, ...]]


def stiff(arm: cdsm.Manipulator, seed: int) -> tuple[bytes, ...]:
    """A posture and its stiffness, as bytes."""
    pose = random_posture(arm, seed)
    K = cdsm.stiffness(pose, random_tension(arm, seed), random_wrench(seed))
    arrays = (pose.tip, pose.jacobian, pose.length_jacobian, pose.gravity_torque)
    return tuple(each.tobytes() for each in (*arrays, K.joint, K.compliance, np.array(K.margin)))


def balanced(arm: cdsm.Manipulator, seed: int) -> tuple[bytes, ...]:
    pull = cdsm.distribute_tension(random_posture(arm, seed), 5.0, wrench=random_wrench(seed))
    return pull.values.tobytes(), pull.residual.tobytes()


def batched(arm: cdsm.Manipulator, seed: int) -> tuple[bytes, ...]:
    q = np.array([random_posture(arm, seed + i).q for i in range(5)])
    found = cdsm.evaluate(arm, q, outputs=("tip", "joint", "compliance"), minimum=5.0, threads=2)
    return tuple(each.tobytes() for each in found.values)


def rested(arm: cdsm.Manipulator, seed: int) -> tuple[bytes, ...]:
    pose = random_posture(arm, seed, reach=0.3)
    rest = cdsm.equilibrium(pose, cdsm.distribute_tension(pose, 20.0), 0.1 * random_wrench(seed))
    return rest.stiffness.joint.tobytes(), rest.residual.tobytes()


# many of what is cheap, few of what is dear
MIXED: tuple[Work, ...] = (stiff,) * 20 + (balanced,) * 8 + (batched,) * 2 + (rested, rested)


def test_threads_that_do_different_things_with_two_arms_give_the_serial_bits() -> None:
    """Jobs (what, which arm, seed) from many threads, in an order of their own, and serially."""
    arms = [random_arm(6, 3), random_arm(7, 4, "hinged")]

    @cache
    def serial(i: int) -> tuple[bytes, ...]:
        return MIXED[i % len(MIXED)](arms[i % 2], i % 96)

    started = threading.Barrier(THREADS)
    with ThreadPoolExecutor(THREADS, initializer=started.wait) as pool:
        order = np.random.default_rng(192).permutation(192).tolist()
        found = [(i, pool.submit(serial.__wrapped__, i)) for i in order]
        for i, job in found:
            assert job.result() == serial(i), i
