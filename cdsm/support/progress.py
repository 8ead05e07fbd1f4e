"""Show a bar of rich on standard error for work that takes longer than a second.

Bars are shown in a terminal only: notebooks and programs show nothing.
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

_allowed: ContextVar[bool] = ContextVar("_allowed", default=True)


def show_progress(
    items: Collection[_Item], description: str, *, wanted: bool = True
) -> Iterator[_Item]:
    """Yield the items; if ``wanted``, show a bar with the number of items."""
    with progress_bar(description, len(items), wanted=wanted) as advance:
        for item in items:
            yield item
            advance(1)


@contextmanager
def progress_bar(
    description: str, total: int | None = None, *, wanted: bool = True
) -> Iterator[Callable[[int], None]]:
    """Show a bar, and yield a function that advances it by a number of items.

    ``total`` is the number of items, None if it is unknown. A bar that is opened while another one
    is open is never shown, even if the outer one is not ``wanted``.
    """
    shown = flag("progress", wanted) and _allowed.get() and sys.stderr.isatty()
    with progress_allowed(False):
        if not shown:
            yield lambda count: None
            return
        from rich import progress  # slow to import
        from rich.console import Console

        bar = progress.Progress(
            description,
            progress.BarColumn(),
            progress.MofNCompleteColumn(),
            progress.TimeRemainingColumn(),
            console=Console(stderr=True),
            transient=True,
        )
        task = bar.add_task(description, total=total)
        begun = monotonic()
        done = 0

        def advance(count: int) -> None:
            nonlocal done
            if monotonic() - begun >= DELAY:
                bar.start()
            if done:
                bar.advance(task, count)
            else:  # the first item compiles and starts: the time left is that of the others
                bar.reset(task, completed=count)
            done += count

        try:
            yield advance
        finally:
            bar.stop()


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
