"""Many threads, many processes: the numbers of one thread, and nothing shared that could change."""

import multiprocessing
import threading
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import cache

import numpy as np

import cdsm
from tests.support.arms import (
    mixed_arm,
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


def solved(arm: cdsm.Manipulator, seed: int) -> tuple[bytes, ...]:
    found = cdsm.solve_joint_angles(arm, random_posture(arm, seed, reach=0.3).cable_lengths)
    return found.angles.tobytes(), found.posture.cable_lengths.tobytes()


def one_by_one(arm: cdsm.Manipulator, work: Work, seeds: range) -> list[tuple[bytes, ...]]:
    return [work(arm, seed) for seed in seeds]


# many of what is cheap, few of what is dear
MIXED: tuple[Work, ...] = (stiff,) * 20 + (balanced,) * 8 + (batched,) * 2 + (rested, solved)


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


def test_processes_with_a_pickled_arm_give_the_same_bits() -> None:
    arm, seeds = mixed_arm(), range(6)
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        jobs = {w: pool.submit(one_by_one, arm, w, seeds) for w in dict.fromkeys(MIXED)}
        for work, job in jobs.items():
            assert job.result() == one_by_one(arm, work, seeds)
