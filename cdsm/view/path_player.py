"""Play a path: its samples one after the other, at a speed that users choose."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, final

import numpy as np

from cdsm.errors import CdsmError, InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.support.values import Array
from cdsm.view.panel import Panel

if TYPE_CHECKING:
    import viser

_FASTEST = 30.0  # largest speed of a path, and its first speed [samples/s]
_SPEED = 10.0


@final
class Player:
    """Controls that play ``path``; ``go`` moves the arm to a row, and returns when it is shown."""

    def __init__(
        self, gui: viser.GuiApi, panel: Panel, path: Array, go: Callable[[Array], None]
    ) -> None:
        self._size = float(len(path))
        self.paused = threading.Event()
        self.paused.set()
        with panel.posture_tab, gui.add_folder("Path", order=0.0):
            self.sample = panel.add_slider(f"sample of {len(path)}", 1.0, self._size, 1.0, 1.0)
            self._speed = panel.add_slider("samples per s", 1.0, _FASTEST, _SPEED, 1.0)
            self.button = gui.add_button("Play")
        self.button.on_click(lambda _: self.play())
        self.sample.on_update(lambda _: go(path[round(self.sample.value) - 1]))

    def play(self) -> None:
        """Play to the end, from the start if it is there; or pause, if it plays."""
        if not self.paused.is_set():
            self.paused.set()
            return
        self.paused.clear()
        self.button.label = "Pause"
        if self.sample.value == self._size:
            self.sample.value = 1.0  # type: ignore[misc]
        while self.sample.value < self._size and not self.paused.wait(1.0 / self._speed.value):
            self.sample.value += 1.0  # type: ignore[misc]
        self.paused.set()
        self.button.label = "Play"


def tips_of(arm: Manipulator, path: Array) -> Array:
    """Return the tip positions (S, 3) [m] at joint angles (S, nv); name a sample that has none."""
    tips = []
    for i, q in enumerate(path):
        try:
            tips.append(arm.at(q).tip[:3, 3])
        except CdsmError as error:
            raise InvalidInput("angles", f"sample {i + 1}: {error}") from None
    return np.array(tips)
