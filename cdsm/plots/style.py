"""Give all figures one style: sizes, colours, units, titles and legends that the plots share.

The palette of Okabe and Ito (2008) is distinct to all kinds of colour vision; lines also differ in
style.
"""

from __future__ import annotations

import functools
import os
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, ParamSpec

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdsm.errors import InvalidInput
from cdsm.support.files import as_path, write_file
from cdsm.support.format import coordinates
from cdsm.support.values import Array

P = ParamSpec("P")

ONE_COLUMN: Final = 3.5
TWO_COLUMNS: Final = 7.16
"""Widths [inch] of figures as wide as one and two columns of an IEEE journal."""

BLUE: Final = "#0072b2"
VERMILLION: Final = "#d55e00"
GREEN: Final = "#009e73"
ORANGE: Final = "#e69f00"
SKY: Final = "#56b4e9"
PURPLE: Final = "#cc79a7"
BLACK: Final = "#000000"
COLORS: Final = (BLUE, VERMILLION, GREEN, ORANGE, SKY, PURPLE, BLACK)
"""Colours of Okabe and Ito, "Color universal design", 2008; the first three are x, y and z."""

STYLES: Final = ("-", "--", "-.", ":")
COLOR_MAP: Final = "viridis"
MM: Final = 1e3
KN: Final = 1e-3
N_PER_MM: Final = 1e-3

BESIDE: Final = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5), "frameon": False}
"""Options that place a legend at the right of its panel."""

_NAMED = 24  # largest number of lines with names
_FILE: Final = Path(__file__).with_name("cdsm.mplstyle")
_DATELESS: Final = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}, ".png": None}
_ROOM = 1.15  # upper limit of an axis that begins at zero, over the largest value drawn


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Give the figure that ``draw`` returns the style of this library."""

    @functools.wraps(draw)
    def drawn(*args: P.args, **options: P.kwargs) -> Figure:
        with rc_context(fname=_FILE):
            figure = draw(*args, **options)
            for panel in figure.axes:
                for axis in (panel.xaxis, panel.yaxis):  # matplotlib makes ticks when it draws
                    _ = axis.get_major_ticks(1), axis.get_minor_ticks(1)
            return figure

    return drawn


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> Path:
    """Write a figure: vectors (``.pdf``, ``.svg``) or pixels (``.png``, 300 dpi); return its path.

    Equal figures give equal bytes: no date is written, and names in an SVG are not random.

    Args:
        figure: Figure of a function of :mod:`cdsm.plots`, or any other figure of matplotlib.
        path: The file. It is written completely or not at all.

    Raises:
        InvalidInput: The path ends neither in ``.pdf``, ``.svg`` nor ``.png``.
        FileError: The file cannot be written.
    """
    suffix = as_path(path).suffix.lower()
    if suffix not in _DATELESS:
        raise InvalidInput("path", f"{str(path)!r} given; it must end in {', '.join(_DATELESS)}.")
    with rc_context(fname=_FILE):
        return write_file(path, lambda aside: figure.savefig(aside, metadata=_DATELESS[suffix]))


def direction_name(u: Array) -> str:
    """Format a direction (3,) as text, with components below 1e-9 as zero."""
    return coordinates(np.round(u, 9), "z.3g")


def panels(
    width: float, height: float, columns: int = 1, rows: int = 1, **options: Any
) -> tuple[Figure, Any]:
    """Build a figure [inch], and an array (rows, columns) of its panels."""
    figure = Figure(figsize=(width, height))
    return figure, figure.subplots(rows, columns, squeeze=False, **options)


def titled(figure: Figure, text: str) -> Figure:
    """Write a title over a figure, with lines no wider than the figure, and return the figure."""
    figure.suptitle(textwrap.fill(text, round(16 * figure.get_figwidth())))
    return figure


def from_zero(axes: Any, *values: Array) -> None:
    """Set the range of the y-axis of a panel: from zero to above the largest of all values."""
    highest = max((float(np.nanmax(array, initial=0.0)) for array in values), default=0.0)
    axes.set_ylim(0.0, _ROOM * highest or 1.0)


def whole_numbers(axis: Any) -> None:
    """Put the ticks of an axis at whole numbers."""
    axis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))


def legend_below(figure: Figure, axes: Any, columns: int, **options: Any) -> None:
    """Draw one legend below all panels; a label that several of ``axes`` have appears once."""
    entries: dict[str, Any] = {}
    for panel in np.ravel(axes):
        entries |= dict(zip(*panel.get_legend_handles_labels()[::-1], strict=True))
    if entries:
        options |= {"loc": "outside lower center", "ncols": columns}
        figure.legend(list(entries.values()), list(entries), **options)


def line_looks(names: Sequence[str]) -> list[dict[str, Any]]:
    """Return colour, style and label of a line for each name; above 24 names, a colour only."""
    if len(names) > _NAMED:
        return [{"color": color} for color in colormaps[COLOR_MAP](np.linspace(0, 1, len(names)))]
    color = COLORS * 4
    style = [line_style for line_style in STYLES for _ in COLORS]
    return [{"color": color[i], "ls": style[i], "label": name} for i, name in enumerate(names)]


def cable_lines(axes: Any, x: Array, values: Array, names: Sequence[str], **line: Any) -> None:
    """Draw values (N, C) against x (N,), a line for each of C cables, with their names."""
    for column, look in zip(values.T, line_looks(names), strict=True):
        axes.plot(x, column, **look, **line)
    if len(names) <= _NAMED:
        axes.legend(**BESIDE, ncols=1 + (len(names) > _NAMED // 2))
