"""Compute ranges of sliders with round ends and steps, in degrees, mm and N."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, final

import numpy as np

from cdsm.manipulator import Manipulator
from cdsm.support.format import JointUnits
from cdsm.support.values import Array

if TYPE_CHECKING:
    import viser

_STEPS = 500
"""Smallest number of steps of a slider, which is a few hundred pixels long."""

_TURN: Final = 2.0 * math.pi
_LENGTHS = 10.0
"""Largest coordinate of a prismatic joint on its slider, divided by the arm length."""

_DECIMALS: Final = 9
"""Decimals to which a position between two steps is rounded, in degrees, mm or N."""

_ROUND = 1e-9  # largest difference of an end from a round number, as a fraction of a step


@final
@dataclass(frozen=True, kw_only=True)
class Range:
    """Ends, step and first position of a slider, in a unit whose size in SI is ``unit``.

    ``digits`` is the number of decimals that the page shows.
    """

    label: str
    low: float
    high: float
    step: float
    initial: float
    unit: float = 1.0
    digits: int = 0


def slider_range(label: str, low: float, high: float, initial: float, unit: float = 1.0) -> Range:
    """Return a range with round ends and steps in the unit that the user sees.

    ``low``, ``high``, the first position ``initial`` and the size of this ``unit`` are in SI. The
    ends are rounded inwards. ``initial`` is not rounded; the range always contains it.
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
    return Range(
        label=label, low=low, high=high, step=step, initial=initial, unit=unit, digits=digits
    )


def joint_ranges(arm: Manipulator, q: Array) -> tuple[Range, ...]:
    """Return the slider range of each joint in degrees or mm; q (nv,) is the first position.

    q is in rad, or in m for prismatic joints.
    """
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
    """A slider on the page, read and moved in SI units."""

    handle: viser.GuiSliderHandle[float]
    range: Range

    @property
    def value(self) -> float:
        """Current value in SI units."""
        return float(self.handle.value) * self.range.unit

    def move(self, value: float) -> None:
        """Move the slider to a value in SI units, which may lie between two steps."""
        position = round(value / self.range.unit, _DECIMALS) + 0.0  # no -0
        self.handle.value = position  # type: ignore[misc]

    def straighten(self) -> None:
        """Move the slider to zero, or to the end nearest to zero."""
        self.handle.value = min(max(0.0, self.range.low), self.range.high)  # type: ignore[misc]

    def reset(self) -> None:
        """Move the slider to its first position."""
        self.handle.value = self.range.initial  # type: ignore[misc]
