"""Run a job in a thread on request. All requests during a run together cause one further run."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from concurrent import futures


class Worker:
    """Thread that runs ``job`` on request. All requests during a run cause one further run."""

    def __init__(self, job: Callable[[], None]) -> None:
        self._job = job
        self._thread = futures.ThreadPoolExecutor(1, "cdsm view")
        self._lock = threading.Lock()
        self._asked = threading.Event()
        self._last: futures.Future[None] | None = None

    def request(self) -> None:
        """Request a run of the job, from any thread; does nothing after :meth:`close`."""
        self._asked.set()
        with self._lock, contextlib.suppress(RuntimeError):  # the thread has ended
            if self._last is None or self._last.running() or self._last.done():
                self._last = self._thread.submit(self._run)

    def wait(self) -> None:
        """Wait until the runs for all earlier requests have ended."""
        futures.wait([self._last] if self._last else [])

    def no_request_within(self, seconds: float) -> bool:
        """Wait up to ``seconds`` [s] for a request; return whether none came since the run began.

        Only the job itself calls this, to see whether its setting is outdated.
        """
        return not self._asked.wait(seconds)

    def close(self) -> None:
        """Wait until the runs for all earlier requests have ended, and ignore later requests."""
        self._thread.shutdown()

    def _run(self) -> None:
        self._asked.clear()
        self._job()
