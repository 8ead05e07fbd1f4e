"""What all figures share: colours, units, scales of axes, and the check of what is drawn."""

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
"""Most intervals between the ticks of an axis of a map or of a picture in space."""


def expect(name: str, value: object, kind: str) -> None:
    """Raise :class:`InvalidInput` unless the value is a result of the class of this name.

    The class is named, not imported: results import this package for their ``plot`` methods.
    """
    if kind not in (base.__name__ for base in type(value).__mro__):
        raise InvalidInput(name, f"{value!r} given; a {kind} is needed.")


def panels(
    width: float, height: float, columns: int, rows: int = 1, **options: Any
) -> tuple[Figure, Any]:
    """A figure and its panels (rows, columns), each with a grid; sizes in inches."""
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    for panel in axes.flat:
        panel.grid(alpha=0.3)
    return figure, axes


def legend_below(figure: Figure, axes: Any, columns: int, **options: Any) -> None:
    """One legend under all panels, of the lines of one of them."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, **options)


def equal_axes(axes: Any) -> None:
    """Give axes of three dimensions one scale, with room for their labels."""
    ranges = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)
    axes.set_box_aspect(ranges, zoom=0.75)
    for letter, part in zip(AXES, ranges / ranges.max(), strict=True):
        ticks = MaxNLocator(max(1, round(TICKS * part)))  # a short axis has room for few
        getattr(axes, f"{letter}axis").set_major_locator(ticks)
