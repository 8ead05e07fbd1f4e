"""Ratios of run times, measured alternately in one run so that a slow machine slows both."""

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
    *,
    slow_repeat: int = 1,
    fast_repeat: int = 200,
    rounds: int = 30,
) -> float:
    """How many times longer ``slow`` takes than ``fast``: best against best of alternating rounds.

    The best round is the one that nothing else on the machine disturbed.
    """
    slow(), fast()  # warm up: compile, fill caches
    times = [(seconds(slow, slow_repeat), seconds(fast, fast_repeat)) for _ in range(rounds)]
    return min(slow for slow, _ in times) / min(fast for _, fast in times)
