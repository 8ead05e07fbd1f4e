"""Show a progress bar in the terminal, on standard error, if work takes longer than a second.

Nothing is shown where there is no terminal: in a pipe, a notebook, a log file.
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


def track(items: Collection[_Item], what: str, *, wanted: bool = True) -> Iterator[_Item]:
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
    if not (wanted and _allowed.get() and sys.stderr.isatty()):
        with progress_allowed(False):
            yield lambda count: None
        return
    from rich import progress  # slow to import
    from rich.console import Console

    class Rate(progress.ProgressColumn):
        def render(self, task: progress.Task) -> str:
            return f"{task.speed:,.0f}/s" if rate and task.speed else ""

    bar = progress.Progress(
        *(what, progress.BarColumn(), progress.MofNCompleteColumn()),
        *(Rate(), progress.TimeRemainingColumn()),
        console=Console(stderr=True),
        transient=True,
    )
    task, begun = bar.add_task(what, total=total, completed=done), monotonic()

    def advance(count: int) -> None:
        if monotonic() - begun >= DELAY:
            bar.start()
        bar.advance(task, count)

    try:
        with progress_allowed(False):
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
