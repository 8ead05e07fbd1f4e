"""Remember past values of the controls, for the button that undoes a change."""

from __future__ import annotations

import time
from collections import deque
from typing import Any, Final, final

_STEPS: Final = 10  # changes that can be undone
_PAUSE: Final = 0.7  # of the controls that ends a change [s]: dragging a slider is one


@final
class History:
    """Values of all controls before each of the last changes."""

    def __init__(self, present: tuple[Any, ...]) -> None:
        self._past: deque[tuple[Any, ...]] = deque(maxlen=_STEPS)
        self._present = present
        self._rested = -_PAUSE

    def note(self, values: tuple[Any, ...]) -> None:
        """Note the values that are shown from now on."""
        if values != self._present:
            if time.monotonic() - self._rested >= _PAUSE:
                self._past.append(self._present)
            self._present = values

    def rest(self) -> None:
        """Note that the values are shown: from now on the controls rest."""
        self._rested = time.monotonic()

    def back(self) -> tuple[Any, ...] | None:
        """Return the values before the last change, which become the present ones; None: none."""
        if not self._past:
            return None
        self._present = self._past.pop()
        return self._present
