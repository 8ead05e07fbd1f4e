"""One thread that works for many: what is asked while it works is done once, for the newest."""

from __future__ import annotations

import threading
from collections.abc import Callable


class Newest:
    """Runs a job again and again, in one thread, as long as somebody asks for it.

    Sliders send more values than can be computed, from many threads. The job reads the newest state
    itself when it starts; requests that arrive while it runs make it run once more, not once each.
    """

    def __init__(self, job: Callable[[], None]) -> None:
        self._job = job
        self._changed = threading.Condition()
        self._wanted = self._closed = self._busy = False
        self._thread = threading.Thread(target=self._work, name="cdsm view", daemon=True)
        self._thread.start()

    def ask(self) -> None:
        """Have the job run, soon; from any thread."""
        with self._changed:
            self._wanted = True
            self._changed.notify_all()

    def settle(self) -> None:
        """Wait until everything asked for so far is done."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or not (self._wanted or self._busy))

    def close(self) -> None:
        """Let the running job end, and run no other."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if threading.current_thread() is not self._thread:
            self._thread.join()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._busy = False
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._wanted or self._closed)
                if self._closed:
                    return
                self._wanted, self._busy = False, True
            self._job()
