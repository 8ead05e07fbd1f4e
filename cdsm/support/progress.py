"""Show on standard error how far work is that takes longer than a second.

In a terminal that is a bar. Where there is none, a command prints a line now and then; in a
notebook or a program nothing is shown.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from time import monotonic
from typing import TypeVar

from cdsm.support.validation import flag

_Item = TypeVar("_Item")

DELAY = 1.0
"""Time [s] before a bar is shown: shorter work shows nothing."""

_PAUSE = 10.0
"""Time [s] between two lines where there is no terminal."""

_allowed: ContextVar[bool] = ContextVar("_allowed", default=True)
_lines_wanted: ContextVar[bool] = ContextVar("_lines_wanted", default=False)


def track(items: Collection[_Item], what: str, *, wanted: bool = True) -> Iterator[_Item]:
    """Yield the items; if ``wanted``, show a bar called ``what`` with the number of items."""
    with progress_bar(what, len(items), wanted=wanted) as advance:
        for item in items:
            yield item
            advance(1)


@contextmanager
def progress_bar(
    what: str, total: int | None = None, *, wanted: bool = True
) -> Iterator[Callable[[int], None]]:
    """Show a bar called ``what``, and yield a function that advances it by a number of items.

    ``total`` is the number of items, None if it is unknown. A bar that is opened while another one
    is open is never shown, even if the outer one is not ``wanted``.
    """
    terminal = sys.stderr.isatty()
    shown = wanted and _allowed.get() and (terminal or _lines_wanted.get())
    with progress_allowed(False):
        if shown and terminal:
            with _bar(what, total) as advance:
                yield advance
        else:
            yield _lines(what, total) if shown else lambda count: None


@contextmanager
def _bar(what: str, total: int | None) -> Iterator[Callable[[int], None]]:
    from rich import progress  # slow to import
    from rich.console import Console

    columns = what, progress.BarColumn(), progress.MofNCompleteColumn()
    console = Console(stderr=True)
    left = progress.TimeRemainingColumn()
    bar = progress.Progress(*columns, left, console=console, transient=True)
    task = bar.add_task(what, total=total)
    begun = monotonic()

    def advance(count: int) -> None:
        if monotonic() - begun >= DELAY:
            bar.start()
        bar.advance(task, count)

    try:
        yield advance
    finally:
        bar.stop()


def _lines(what: str, total: int | None) -> Callable[[int], None]:
    """Return a function that counts items, and prints a line if the last one is long ago."""
    begun = monotonic()
    printed = monotonic() - _PAUSE + DELAY
    done = 0

    def advance(count: int) -> None:
        nonlocal done, printed
        done = done + count
        now = monotonic()
        if now - printed < _PAUSE or done == total:
            return
        printed = now
        speed = done / (now - begun)
        left = f", {(total - done) / speed:.0f} s left" if total and speed else ""
        print(f"{what}: {done}{f' of {total}' if total else ''}{left}", file=sys.stderr, flush=True)

    return advance


@contextmanager
def progress_allowed(progress: bool) -> Iterator[None]:
    """Hide all bars that are opened inside this context, unless ``progress`` is True.

    Raises InvalidInput if ``progress`` is not a bool.
    """
    token = _allowed.set(flag("progress", progress) and _allowed.get())
    try:
        yield
    finally:
        _allowed.reset(token)


@contextmanager
def lines_allowed() -> Iterator[None]:
    """Print lines inside this context where there is no terminal."""
    token = _lines_wanted.set(True)
    try:
        yield
    finally:
        _lines_wanted.reset(token)
