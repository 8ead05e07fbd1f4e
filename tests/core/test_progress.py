"""Progress bars: in a terminal, for work that takes a second, one at a time."""

import io
import sys
from collections.abc import Iterable
from typing import Any

import pytest

from cdsm.support import progress


class Terminal(io.StringIO):
    """Standard error of a terminal."""

    def isatty(self) -> bool:
        return True


def shown(monkeypatch: pytest.MonkeyPatch, items: Iterable[object], delay: float) -> str:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setattr(progress, "DELAY", delay)
    assert [*items] == [0, 1, 2]
    return sys.stderr.getvalue()  # type: ignore[attr-defined]


def nested() -> Iterable[int]:
    for item in progress.show_progress(range(3), "outer"):
        list(progress.show_progress(range(3), "inner"))
        yield item


def test_a_bar_is_shown_in_a_terminal_after_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "outer" in shown(monkeypatch, progress.show_progress(range(3), "outer"), 0.0)
    assert shown(monkeypatch, progress.show_progress(range(3), "outer"), 1.0) == ""


def test_no_bar_is_shown_where_none_is_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    quiet = progress.show_progress(range(3), "outer", wanted=False)
    assert shown(monkeypatch, quiet, 0.0) == ""
    with progress.progress_allowed(False):
        assert shown(monkeypatch, progress.show_progress(range(3), "outer"), 0.0) == ""


def test_a_bar_inside_another_is_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    text = shown(monkeypatch, nested(), 0.0)
    assert "outer" in text
    assert "inner" not in text


def test_the_time_left_does_not_count_the_first_item(monkeypatch: pytest.MonkeyPatch) -> None:
    from rich.progress import Progress

    clock = 0.0
    left = list[float | None]()

    def started(bar: Progress, *columns: Any, **options: Any) -> None:
        made(bar, *columns, get_time=lambda: clock, **options)
        tasks.append(bar)

    tasks = list[Progress]()
    made = Progress.__init__
    monkeypatch.setattr(Progress, "__init__", started)
    monkeypatch.setattr(sys, "stderr", Terminal())
    with progress.progress_bar("designs", 10) as advance:
        for seconds in (100.0, 1.0, 1.0, 1.0):
            clock += seconds
            advance(1)
            left.append(tasks[0].tasks[0].time_remaining)
    assert left[0] is None
    assert left[-1] == pytest.approx(6.0)
