"""Ratios of run times, measured alternately in one run so that a slow machine slows both."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from cdsm.batch.solution import compiled


def seconds(
    run: Callable[[], object], repeat: int, watch: Callable[[], float] = time.perf_counter
) -> float:
    """Time per call over some calls."""
    start = watch()
    for _ in range(repeat):
        run()
    return (watch() - start) / repeat


@dataclass(frozen=True)
class Clock:
    """Times what a benchmark has shown to be equal.

    Attributes:
        tell: Takes a line of the table of ratios: what, the ratio, and the one that is wanted.
    """

    tell: Callable[[tuple[str, str, str]], None]

    def race(
        self,
        what: str,
        slow: Callable[[], object],
        fast: Callable[[], object],
        *,
        least: float = 0.0,
        most: float = math.inf,
        rows: float = 1.0,
        slow_repeat: int = 1,
        fast_repeat: int = 200,
        rounds: int = 30,
        watch: Callable[[], float] = time.process_time,
    ) -> float:
        """How many times longer ``slow`` takes than ``fast``: best against best of some rounds.

        Time is that of the processor, so that waiting for it does not count; ``watch`` reads it.
        The best round is the one whose caches nothing else emptied. ``rows`` are the postures of a
        call of ``fast`` for each of ``slow``.

        Raises:
            AssertionError: The ratio is below half of ``least`` or above twice ``most``: a smaller
                miss may be what else the machine does.
        """
        compiled(), slow(), fast()  # warm up: compile, fill caches
        best_slow = best_fast = math.inf
        for _ in range(rounds):
            best_slow = min(best_slow, seconds(slow, slow_repeat, watch))
            best_fast = min(best_fast, seconds(fast, fast_repeat, watch))
        ratio = rows * best_slow / best_fast
        wanted = f"at least {least:g}" if math.isinf(most) else f"at most {most:g}"
        self.tell((what, f"{ratio:.3g}", wanted))
        assert least / 2.0 <= ratio <= 2.0 * most, f"{what}: {ratio:.3g} times, wanted {wanted}"
        return ratio
