"""Progress bar with rate and time left, shown on a terminal if wanted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text


class _Rate(ProgressColumn):
    """Column with evaluations per second over the last half minute."""

    def render(self, task: Task) -> Text:
        return Text("" if task.speed is None else f"{task.speed:,.0f}/s")


@contextmanager
def progress_bar(total: int, done: int, *, wanted: bool) -> Iterator[Callable[[int], None]]:
    """Yield a function that advances the bar; evaluations ``done`` before do not count as rate."""
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("sweep"),
        BarColumn(),
        MofNCompleteColumn(),
        _Rate(),
        TimeRemainingColumn(),
        console=console,
        disable=not (wanted and console.is_terminal),
    )
    with bar:
        task = bar.add_task("sweep", total=total, completed=done)
        yield lambda count: bar.advance(task, count)
