"""The list of jobs."""

from __future__ import annotations

from collections.abc import Callable

from tests.campaigns.snapshot.environment import Named

JOBS: dict[str, Callable[[], Named]] = {}
SLOW: set[str] = set()


def job(function: Callable[[], Named]) -> Callable[[], Named]:
    """Take a function, which runs in an empty folder, into the list of jobs."""
    JOBS[function.__name__] = function
    return function


def slow(function: Callable[[], Named]) -> Callable[[], Named]:
    """A job that only runs with ``--all``."""
    SLOW.add(function.__name__)
    return job(function)
