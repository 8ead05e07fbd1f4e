"""The panel of the page: what the arm does, and the sliders that set it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, final

import numpy as np

from cdsm.manipulator import Manipulator
from cdsm.plots.style import AXES
from cdsm.support.validation import Array
from cdsm.view.ranges import Range, joint_sliders, slider
from cdsm.view.state import Setting, Shown
from cdsm.view.text import page_text

if TYPE_CHECKING:
    import viser

    from cdsm.view.guard import Control

_IN_FOLDER: Final = 10
"""Joints in one folder; only the first folder is open."""


@final
@dataclass(frozen=True)
class Slider:
    """A slider on the page, with the unit it shows."""

    handle: viser.GuiSliderHandle[float]
    range: Range

    @property
    def value(self) -> float:
        """Where it stands, in SI."""
        return float(self.handle.value) * self.range.unit

    def set(self, value: float) -> None:
        """Move it there, given in SI: as far as it goes."""
        ends = self.range
        position = min(max(value / ends.unit, ends.low), ends.high)
        self.handle.value = position  # type: ignore[misc]  # viser's setter hides from mypy


class Controls:
    """The panel of an arm in a viser server.

    Args:
        server: The server, whose panel is empty.
        arm: The arm.
        start: Where the sliders stand first.
        largest_tension: Right end of the slider of the lower bound [N].
        largest_force: Both ends of the sliders of the force [N].
        changed: Called, from any thread, when a slider has moved.
        admit: Called with each control that browsers may use.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        arm: Manipulator,
        start: Setting,
        largest_tension: float,
        largest_force: float,
        changed: Callable[[], None],
        admit: Callable[[Control], None],
    ) -> None:
        self._gui, self._start, self._changed, self._admit = server.gui, start, changed, admit
        self._text = server.gui.add_html("")
        with server.gui.add_folder("Load"):
            high = max(largest_tension, start.minimum)
            self._minimum = self._slider(slider("least tension [N]", 0.0, high, start.minimum))
            self._force = [
                self._slider(slider(f"force {axis} [N]", -largest_force, largest_force, f))
                for axis, f in zip(AXES, start.force.tolist(), strict=True)
            ]
        self._joints = self._joint_folders(joint_sliders(arm, start.q))
        straight = server.gui.add_button("Straight", hint="All joints as near zero as they go.")
        straight.on_click(lambda _: self._move(self._joints, np.zeros(arm.nv)))
        reset = server.gui.add_button("Reset", hint="All sliders as they were at the beginning.")
        reset.on_click(lambda _: self._reset())
        for button in (straight, reset):
            admit(button)

    @property
    def setting(self) -> Setting:
        """Where the sliders stand now."""
        return Setting(
            q=np.array([joint.value for joint in self._joints]),
            minimum=self._minimum.value,
            maximum=self._start.maximum,
            force=np.array([part.value for part in self._force]),
            solver=self._start.solver,
        )

    def update(self, shown: Shown) -> None:
        """Say what is shown."""
        self._text.content = page_text(shown)

    def _joint_folders(self, ranges: Sequence[Range]) -> list[Slider]:
        sliders = []
        for first in range(0, len(ranges), _IN_FOLDER):
            some = ranges[first : first + _IN_FOLDER]
            name = f"Joints {first + 1} to {first + len(some)}" if len(ranges) > 1 else "Joint"
            with self._gui.add_folder(name, expand_by_default=first == 0):
                sliders += [self._slider(joint) for joint in some]
        return sliders

    def _slider(self, range_: Range) -> Slider:
        handle = self._gui.add_slider(
            range_.label, range_.low, range_.high, range_.step, range_.initial
        )
        handle.on_update(lambda _: self._changed())
        self._admit(handle)
        return Slider(handle, range_)

    def _move(self, sliders: Sequence[Slider], values: Array) -> None:
        for each, value in zip(sliders, values.tolist(), strict=True):
            each.set(value)

    def _reset(self) -> None:
        self._move(self._joints, self._start.q)
        self._move(self._force, self._start.force)
        self._minimum.set(self._start.minimum)
