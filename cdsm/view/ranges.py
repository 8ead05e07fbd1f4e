"""The sliders: where they begin and end, in what unit and in which steps."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, final

import numpy as np

from cdsm.manipulator import Manipulator
from cdsm.support.validation import Array

_STEPS = 500
"""A slider has this many steps at least: a browser shows some hundred pixels of it."""

_TURN: Final = 2.0 * math.pi
_LENGTHS = 10.0
"""Where a joint has no limits to speak of: a turn each way, or so many lengths of the arm."""


@final
@dataclass(frozen=True, kw_only=True)
class Range:
    """One slider, in the unit that is shown.

    Attributes:
        label: Its name and unit.
        low: Left end, in the unit shown.
        high: Right end, in the unit shown.
        step: Smallest move, in the unit shown.
        initial: Where it stands first, in the unit shown.
        unit: The unit in SI: 1 ° is π/180 rad.
    """

    label: str
    low: float
    high: float
    step: float
    initial: float
    unit: float = 1.0


def slider(label: str, low: float, high: float, initial: float, unit: float = 1.0) -> Range:
    """A slider between two values in SI: ends and steps are round numbers within them.

    The value it begins with is kept to the bit, and is within the ends even if they are not.
    """
    low, high, initial = (value / unit for value in (low, high, initial))
    if not high > low:
        return Range(label=label, low=initial, high=initial, step=1.0, initial=initial, unit=unit)
    step = 10.0 ** math.floor(math.log10((high - low) / _STEPS))
    digits = max(0, round(-math.log10(step)))
    # inwards: a value beyond a limit would be refused; 1e-9 for ends that are round already
    low = round(math.ceil(low / step - 1e-9) * step, digits)
    high = round(math.floor(high / step + 1e-9) * step, digits)
    step = round(step, digits)
    low, high = min(low, initial), max(high, initial)
    return Range(label=label, low=low, high=high, step=step, initial=initial, unit=unit)


def joint_sliders(arm: Manipulator, q: Array) -> tuple[Range, ...]:
    """One slider per joint, within its limits: degrees, or mm where it slides."""
    slides = arm.slides
    sliders = []
    most = np.where(slides, _LENGTHS * arm.length, _TURN)
    low, high = np.maximum(arm.lower, -most), np.minimum(arm.upper, most)
    for i, name in enumerate(arm.joint_names):
        sign, unit = ("mm", 1e-3) if slides[i] else ("°", math.pi / 180.0)
        sliders.append(slider(f"{name} [{sign}]", low[i], high[i], float(q[i]), unit))
    return tuple(sliders)
