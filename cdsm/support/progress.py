"""Show a progress bar in the terminal, on standard error, if work takes longer than a second.

Nothing is shown where there is no terminal: in a pipe, a notebook, a log file.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Protocol, TypeVar

from cdsm.support.validation import flag

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn, Task
    from rich.text import Text

_Item = TypeVar("_Item", covariant=True)

DELAY = 1.0
"""Time [s] before a bar is shown: shorter work shows nothing."""

_outermost: ContextVar[bool] = ContextVar("_outermost", default=True)
"""Whether no other bar is open: a bar inside another one would overwrite it."""


class _Items(Sized, Iterable[_Item], Protocol[_Item]):
    """Type of the items of :func:`track`: an iterable with a length."""


def track(items: _Items[_Item], what: str, *, wanted: bool = True) -> Iterator[_Item]:
    """Yield the items; if ``wanted``, show a bar called ``what`` with the number of items."""
    with progress_bar(what, len(items), wanted=wanted) as advance:
        for item in items:
            yield item
            advance(1)


@contextmanager
def progress_bar(
    what: str, total: int | None = None, done: int = 0, *, wanted: bool = True, rate: bool = False
) -> Iterator[Callable[[int], None]]:
    """Show a bar called ``what``, and yield a function that advances it by a number of items.

    ``done`` of the ``total`` items (None: unknown) are finished already. If ``rate`` is True, the
    bar also shows how many items are finished per second. A bar that is opened while another one
    is open is never shown, even if the outer one is not ``wanted``.
    """
    outermost = _outermost.get()
    token = _outermost.set(False)
    bar = _Bar(what, total, done, rate, shown=wanted and outermost)
    try:
        yield bar.advance
    finally:
        bar.close()
        _outermost.reset(token)


@contextmanager
def progress_allowed(progress: bool) -> Iterator[None]:
    """Hide all bars that are opened inside this context, unless ``progress`` is True.

    Raises InvalidInput if ``progress`` is not a bool.
    """
    token = _outermost.set(flag("progress", progress) and _outermost.get())
    try:
        yield
    finally:
        _outermost.reset(token)


class _Bar:
    """Progress bar that appears after :data:`DELAY` seconds."""

    def __init__(self, what: str, total: int | None, done: int, rate: bool, *, shown: bool) -> None:
        self._what, self._total, self._done, self._rate = what, total, done, rate
        self._progress: Progress | None = None
        self._lock = threading.Lock()
        self._timer = threading.Timer(DELAY, self._show)
        self._timer.daemon = True
        self._open = shown
        if shown and DELAY:
            self._timer.start()
        elif shown:
            self._show()

    def advance(self, count: int) -> None:
        with self._lock:
            self._done += count
            if self._progress is not None:
                self._progress.advance(self._progress.task_ids[0], count)

    def close(self) -> None:
        self._timer.cancel()
        with self._lock:
            self._open = False
            if self._progress is not None:
                self._progress.stop()

    def _show(self) -> None:
        from rich.console import Console  # slow to import
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        console = Console(stderr=True)
        with self._lock:
            if not (self._open and console.is_terminal):
                return
            columns: list[ProgressColumn] = [TextColumn(self._what), BarColumn()]
            if self._total is None:
                columns.append(TimeElapsedColumn())
            else:
                columns += [MofNCompleteColumn(), *([_rate()] if self._rate else [])]
                columns.append(TimeRemainingColumn())
            self._progress = Progress(*columns, console=console, transient=True)
            self._progress.add_task("", total=self._total, completed=self._done)
            self._progress.start()


def _rate() -> ProgressColumn:
    """Return a column of a bar with the items per second in the last half minute."""
    from rich.progress import ProgressColumn
    from rich.text import Text

    class Rate(ProgressColumn):
        def render(self, task: Task) -> Text:
            return Text("" if task.speed is None else f"{task.speed:,.0f}/s")

    return Rate()
