"""Ratios of run times, measured alternately in one run so that a slow machine slows both."""

import math
import time
from collections.abc import Callable


def seconds(run: Callable[[], object], repeat: int) -> float:
    """Time per call over some calls."""
    start = time.perf_counter()
    for _ in range(repeat):
        run()
    return (time.perf_counter() - start) / repeat


def speed_ratio(
    slow: Callable[[], object],
    fast: Callable[[], object],
    settled: Callable[[float], bool],
    *,
    slow_repeat: int = 1,
    fast_repeat: int = 200,
    rounds: int = 30,
) -> float:
    """How many times longer ``slow`` takes than ``fast``: best against best of alternating rounds.

    The best round is the one that nothing else on the machine disturbed. On a busy machine it may
    take long to come: while the ratio is not ``settled``, up to four times the rounds are run.
    """
    slow(), fast()  # warm up: compile, fill caches
    best_slow = best_fast = math.inf
    for round_ in range(4 * rounds):
        best_slow = min(best_slow, seconds(slow, slow_repeat))
        best_fast = min(best_fast, seconds(fast, fast_repeat))
        if round_ >= rounds and settled(best_slow / best_fast):
            break
    return best_slow / best_fast
