"""Every benchmark is two tests: do both sides compute the same, and how long do they take?

The first is part of the plain run. The second, marked ``speed``, depends on what else the machine
does::

    pytest -m speed            the table of ratios
    pytest -m speed -s         and what was measured besides
"""

from typing import Any

import pytest

from tests.benchmarks.timing import Clock


@pytest.fixture(params=["numbers", pytest.param("speed", marks=pytest.mark.speed)])
def clock(request: pytest.FixtureRequest) -> Clock | None:
    """None where the numbers alone are compared."""
    if request.param == "numbers":
        return None
    said = request.node.user_properties
    return Clock(lambda line: said.append(("ratio", line)))


def pytest_terminal_summary(terminalreporter: Any) -> None:
    reports = [report for found in terminalreporter.stats.values() for report in found]
    lines = [
        value
        for report in reports
        if getattr(report, "when", "") == "call"
        for name, value in report.user_properties
        if name == "ratio"
    ]
    if lines:
        terminalreporter.section("ratios of run times")
        for what, ratio, wanted in lines:
            terminalreporter.write_line(f"{ratio:>9}  {wanted:<15}  {what}")
