"""Play a path of the arm in the live view, sample by sample."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from cdsm.support.values import Array

if TYPE_CHECKING:
    import viser

    from cdsm.view.guard import Control

_FASTEST, _SPEED = 30.0, 10.0
"""Largest speed, and speed at the start [samples/s]."""

_PLAY, _PAUSE = "Play", "Pause"


class PathPlayer:
    """Slider and button that play ``path``: joint angles (S, nv) [rad] or tips (S, 3) [m].

    ``go`` moves the arm to a row of ``path``, and returns when the page shows the arm there.
    ``admit`` is called with every control that browsers may use.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        path: Array,
        go: Callable[[Array], None],
        admit: Callable[[Control], None],
    ) -> None:
        self._last = len(path)
        self._playing, self._closed = threading.Event(), threading.Event()
        with server.gui.add_folder("Path", order=0.0):
            last = float(len(path))
            self._sample = server.gui.add_slider(f"sample of {len(path)}", 1.0, last, 1.0, 1.0)
            self._speed = server.gui.add_slider("samples per s", 1.0, _FASTEST, 1.0, _SPEED)
            self._button = server.gui.add_button(
                _PLAY, hint="From here; from the start at the end."
            )
        self._sample.on_update(lambda _: go(path[round(self._sample.value) - 1]))
        self._button.on_click(lambda _: self._play(not self._playing.is_set()))
        for control in (self._sample, self._speed, self._button):
            admit(control)
        self._thread = threading.Thread(target=self._run, name="cdsm path", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop playing, and end the thread."""
        self._closed.set()
        self._playing.set()
        self._thread.join()

    def _play(self, on: bool) -> None:
        if on and round(self._sample.value) == self._last:
            self._sample.value = 1.0  # type: ignore[misc]
        self._button.label = _PAUSE if on else _PLAY
        (self._playing.set if on else self._playing.clear)()

    def _run(self) -> None:
        while self._playing.wait() and not self._closed.wait(1.0 / self._speed.value):
            if not self._playing.is_set():
                continue
            if round(self._sample.value) >= self._last:
                self._play(False)
            else:
                self._sample.value += 1.0  # type: ignore[misc]
