"""What all figures share: names, colours, units and scales of their axes."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.ticker import MaxNLocator

AXES: Final = ("x", "y", "z")
COLORS: Final = ("#3b6fb6", "#c8553d", "#4f8f5b")
STYLES: Final = ("-", "--", "-.", ":")
MM: Final = 1e3
N_PER_MM: Final = 1e-3
TICKS: Final = 5
"""Most intervals between the ticks of an axis of a map or of a picture in space."""


def equal_axes(axes: Any) -> None:
    """Give axes of three dimensions one scale, with room for their labels."""
    ranges = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)
    axes.set_box_aspect(ranges, zoom=0.75)
    for letter, part in zip(AXES, ranges / ranges.max(), strict=True):
        ticks = MaxNLocator(max(1, round(TICKS * part)))  # a short axis has room for few
        getattr(axes, f"{letter}axis").set_major_locator(ticks)
