"""Every benchmark is two tests: do both sides compute the same, and how long do they take?

The first is part of the plain run. The second, marked ``speed``, depends on what else the machine
does; ``pytest -m speed`` prints the table of ratios.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

from cdsm.batch.solution import compiled_kernels


def seconds(run: Callable[[], object], repeat: int) -> float:
    """Time per call over some calls: that of the processor, so waiting for it does not count."""
    start = time.process_time()
    for _ in range(repeat):
        run()
    return (time.process_time() - start) / repeat


@dataclass(frozen=True)
class Clock:
    """Times what a benchmark has shown to be equal; both sides in turn, as a machine slows both.

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
    ) -> None:
        """How many times longer ``slow`` takes than ``fast``: best against best of some rounds.

        ``rows`` are the postures of a call of ``fast`` for each of ``slow``.

        Raises:
            AssertionError: The ratio is below half of ``least`` or above twice ``most``: a smaller
                miss may be what else the machine does.
        """
        compiled_kernels(), slow(), fast()  # warm up: compile, fill caches
        best_slow = best_fast = math.inf
        for _ in range(rounds):
            best_slow = min(best_slow, seconds(slow, slow_repeat))
            best_fast = min(best_fast, seconds(fast, fast_repeat))
        ratio = rows * best_slow / best_fast
        wanted = f"at least {least:g}" if math.isinf(most) else f"at most {most:g}"
        self.tell((what, f"{ratio:.3g}", wanted))
        assert least / 2.0 <= ratio <= 2.0 * most, f"{what}: {ratio:.3g} times, wanted {wanted}"


@pytest.fixture(params=["numbers", pytest.param("speed", marks=pytest.mark.speed)])
def clock(request: pytest.FixtureRequest) -> Clock | None:
    """None where the numbers alone are compared."""
    if request.param == "numbers":
        return None
    said = request.node.user_properties
    return Clock(lambda line: said.append(("ratio", line)))


def pytest_terminal_summary(terminalreporter: Any) -> None:
    reports = [report for found in terminalreporter.stats.values() for report in found]
    called = [report for report in reports if getattr(report, "when", "") == "call"]
    told = [value for each in called for name, value in each.user_properties if name == "ratio"]
    if told:
        terminalreporter.section("ratios of run times")
        for what, ratio, wanted in told:
            terminalreporter.write_line(f"{ratio:>9}  {wanted:<15}  {what}")
