"""Shared by all figures: colours, units, scales of axes, and a check of the input type."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdsm.errors import InvalidInput

AXES: Final = ("x", "y", "z")
COLORS: Final = ("#3b6fb6", "#c8553d", "#4f8f5b")
STYLES: Final = ("-", "--", "-.", ":")
MM: Final = 1e3
KN: Final = 1e-3
N_PER_MM: Final = 1e-3
TICKS: Final = 5
"""Largest number of tick intervals on an axis of a map or a 3D picture."""


def expect(name: str, value: object, kind: str) -> None:
    """Raise :class:`InvalidInput` unless the value is an instance of the class named ``kind``.

    The class is not imported, because results import this package for their ``plot`` methods.
    """
    if kind not in (base.__name__ for base in type(value).__mro__):
        raise InvalidInput(name, f"{value!r} given; a {kind} is needed.")


def panels(
    width: float, height: float, columns: int, rows: int = 1, **options: Any
) -> tuple[Figure, Any]:
    """Build a figure and its panels (rows, columns), each with grid lines; sizes in inches."""
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    for panel in axes.flat:
        panel.grid(alpha=0.3)
    return figure, axes


def legend_below(figure: Figure, axes: Any, columns: int, **options: Any) -> None:
    """Draw one legend below all panels, from the lines of one panel."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, **options)


def equal_axes(axes: Any) -> None:
    """Give 3D axes equal scales, with space for their labels."""
    ranges = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)
    axes.set_box_aspect(ranges, zoom=0.75)
    for letter, part in zip(AXES, ranges / ranges.max(), strict=True):
        ticks = MaxNLocator(max(1, round(TICKS * part)))  # fewer ticks on a short axis
        getattr(axes, f"{letter}axis").set_major_locator(ticks)
