"""Many threads, many processes: the numbers of one thread, and nothing shared that could change."""

import multiprocessing
import threading
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import cache

import numpy as np

from tests.support.arms import mixed_arm, random_arm
from tests.support.jobs import Work, balanced, batched, one_by_one, rested, solved, stiff

THREADS = 8


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
