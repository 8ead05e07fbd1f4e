"""Build the panel of the page: sliders that set the arm, and text about the arm."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, final

import numpy as np

from cdsm.manipulator import Manipulator
from cdsm.plots.style import AXES
from cdsm.support.format import JointUnits
from cdsm.support.values import Array
from cdsm.view.panel import page_text
from cdsm.view.state import Setting, Shown

if TYPE_CHECKING:
    import viser

    from cdsm.view.guard import Control

_STEPS = 500
"""Smallest number of steps of a slider. A slider is some hundred pixels long."""

_TURN: Final = 2.0 * math.pi
_LENGTHS = 10.0
"""Range of a sliding joint without limits, in lengths of the arm; others turn once each way."""

_IN_FOLDER: Final = 10
"""Number of joints in one folder. Only the first folder is open."""

_ROUND = 1e-9
"""Largest difference of an end from a round number, as a fraction of a step."""


@final
@dataclass(frozen=True, kw_only=True)
class Range:
    """Ends, step and first position of a slider, in a unit of the SI value ``unit`` (° = π/180)."""

    label: str
    low: float
    high: float
    step: float
    initial: float
    unit: float = 1.0


def slider_range(label: str, low: float, high: float, initial: float, unit: float = 1.0) -> Range:
    """Compute a slider between two SI values; its ends and its step are round numbers.

    The ends lie within the two values, but they always include the unrounded ``initial``.
    """
    low, high, initial = (value / unit for value in (low, high, initial))
    if not high > low:
        return Range(label=label, low=initial, high=initial, step=1.0, initial=initial, unit=unit)
    step = 10.0 ** math.floor(math.log10((high - low) / _STEPS))
    digits = max(0, round(-math.log10(step)))
    # round inwards: a value beyond a limit would be refused
    low = round(math.ceil(low / step - _ROUND) * step, digits)
    high = round(math.floor(high / step + _ROUND) * step, digits)
    step = round(step, digits)
    low, high = min(low, initial), max(high, initial)
    return Range(label=label, low=low, high=high, step=step, initial=initial, unit=unit)


def joint_ranges(arm: Manipulator, q: Array) -> tuple[Range, ...]:
    """Compute one slider per joint within the joint limits, in degrees, or mm if it slides."""
    most = np.where(arm.slides, _LENGTHS * arm.length, _TURN)
    low, high = np.maximum(arm.lower, -most), np.minimum(arm.upper, most)
    units = JointUnits(arm.slides).shown
    return tuple(
        slider_range(f"{name} [{symbol.replace('deg', '°')}]", low[i], high[i], float(q[i]), unit)
        for i, (name, (symbol, unit)) in enumerate(zip(arm.joint_names, units, strict=True))
    )


@final
@dataclass(frozen=True)
class Slider:
    """A slider on the page, with its value in SI."""

    handle: viser.GuiSliderHandle[float]
    range: Range

    @property
    def value(self) -> float:
        """Current value in SI."""
        return float(self.handle.value) * self.range.unit

    def move(self, position: float) -> None:
        """Move the slider to a position in its own unit, or to the nearest end."""
        ends = self.range
        self.handle.value = min(max(position, ends.low), ends.high)  # type: ignore[misc]


class Controls:
    """Controls and text of an arm in the empty panel of a viser server.

    ``limits`` [N] are the largest lower bound of tension and the largest force of the sliders.
    A moved slider calls ``changed`` from any thread. ``admit`` receives every control that
    browsers may use.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        arm: Manipulator,
        start: Setting,
        limits: tuple[float, float],
        changed: Callable[[], None],
        admit: Callable[[Control], None],
    ) -> None:
        self._gui, self._start, self._changed, self._admit = server.gui, start, changed, admit
        self._text = server.gui.add_html("")
        with server.gui.add_folder("Load"):
            tension, force = limits
            high = max(tension, start.minimum)
            self._minimum = self._add(slider_range("least tension [N]", 0.0, high, start.minimum))
            self._force = [
                self._add(slider_range(f"force {axis} [N]", -force, force, f))
                for axis, f in zip(AXES, start.force.tolist(), strict=True)
            ]
        ranges = joint_ranges(arm, start.q)
        self._joints: list[Slider] = []
        for first in range(0, len(ranges), _IN_FOLDER):
            group = ranges[first : first + _IN_FOLDER]
            name = f"Joints {first + 1} to {first + len(group)}" if len(ranges) > 1 else "Joint"
            with server.gui.add_folder(name, expand_by_default=first == 0):
                self._joints += [self._add(joint) for joint in group]
        for label, hint, act in (
            ("Straight", "All joints as near zero as they go.", self._straighten),
            ("Reset", "All sliders as they were at the beginning.", self._reset),
        ):
            button = server.gui.add_button(label, hint=hint)
            button.on_click(act)
            admit(button)

    @property
    def setting(self) -> Setting:
        """Current values of all sliders."""
        return replace(
            self._start,
            q=np.array([joint.value for joint in self._joints]),
            minimum=self._minimum.value,
            force=np.array([component.value for component in self._force]),
        )

    def update(self, shown: Shown) -> None:
        """Write the text about these results."""
        self._text.content = page_text(shown)

    def _add(self, ends: Range) -> Slider:
        handle = self._gui.add_slider(ends.label, ends.low, ends.high, ends.step, ends.initial)
        handle.on_update(lambda _: self._changed())
        self._admit(handle)
        return Slider(handle, ends)

    def _straighten(self, _: object) -> None:
        for joint in self._joints:
            joint.move(0.0)

    def _reset(self, _: object) -> None:
        for slider in (*self._joints, *self._force, self._minimum):
            slider.move(slider.range.initial)
