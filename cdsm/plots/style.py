"""Give all figures one style: sizes, colours, units, axes and legends that the plots share.

A figure is as wide as one or two columns of a journal, with text of 7 and 8 points. The palette of
Okabe and Ito (2008) is distinct to all kinds of colour vision; lines also differ in style.
"""

from __future__ import annotations

import os
import textwrap
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator
from matplotlib.transforms import Bbox
from mpl_toolkits.mplot3d import Axes3D, proj3d  # type: ignore[import-untyped]

from cdsm.errors import InvalidInput
from cdsm.support.directions import XYZ
from cdsm.support.files import as_path, write_file
from cdsm.support.format import coordinates
from cdsm.support.values import Array

ONE_COLUMN: Final = 3.5
TWO_COLUMNS: Final = 7.16
"""Widths [inch] of figures as wide as one and two columns of an IEEE journal."""

TEXT: Final = 8.0
SMALL: Final = 7.0
"""Sizes of text [pt]: TEXT of labels and titles, SMALL of ticks and legends."""

SCREEN: Final = 150.0
PRINT: Final = 300.0
"""Resolutions [dots per inch]: in a notebook, and of a written PNG."""

BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILLION, PURPLE = PALETTE = (
    *("#000000", "#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7"),
)
"""The eight colours of Okabe and Ito, "Color universal design", 2008."""

COLORS: Final = (BLUE, VERMILLION, GREEN)
"""Colours of the directions x, y and z."""

COLOR_MAP: Final = "viridis"
"""Colour map of numbers, such as tensions and stiffnesses; clear to all kinds of colour vision."""

STYLES: Final = ("-", "--", "-.", ":")
MM: Final = 1e3
KN: Final = 1e-3
N_PER_MM: Final = 1e-3
TICKS: Final = 5
"""Largest number of tick intervals on an axis of a map or a 3D picture."""

ROOM: Final = 1.15
"""Upper limit of an axis that begins at zero, divided by the largest value drawn."""

NAMED: Final = 24
"""Largest number of cables or loops with names. More have colours by their number."""

_CORNER: Final = 0.07
"""Distance of a tick from the corners of a 3D picture, divided by the longest axis."""

_GAP: Final = 0.06  # free space around a picture [inch]

BESIDE: Final = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5), "frameon": False}
"""Options that place a legend at the right of its panel."""

_CABLES: Final = (BLUE, VERMILLION, GREEN, ORANGE, SKY, PURPLE, BLACK, "0.6")
_FORMATS: Final = (".pdf", ".svg", ".png")


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
    if suffix not in _FORMATS:
        raise InvalidInput("path", f"{str(path)!r} given; it must end in {', '.join(_FORMATS)}.")
    dateless = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}.get(suffix)
    with rc_context({"svg.hashsalt": "cdsm", "pdf.fonttype": 42}):
        return write_file(path, lambda aside: figure.savefig(aside, dpi=PRINT, metadata=dateless))


def expect(name: str, value: object, kind: str) -> None:
    """Raise :class:`InvalidInput` unless ``value``, an argument called ``name``, is a ``kind``.

    ``kind`` is the name of a class; instances of derived classes are allowed. The class cannot be
    imported here, since its module imports this package.
    """
    if kind not in (base.__name__ for base in type(value).__mro__):
        raise InvalidInput(name, f"{value!r} given; a {kind} is needed.")


def direction_name(u: Array) -> str:
    """Format a direction (3,) as text, with components below 1e-9 as zero."""
    return coordinates(np.round(u, 9), "z.3g")


def panels(
    width: float, height: float, columns: int, rows: int = 1, **options: Any
) -> tuple[Figure, Any]:
    """Build a figure, and an array (rows, columns) of its panels with grid lines.

    ``width`` and ``height`` of the figure are in inches. ``options`` are passed to
    ``Figure.subplots`` of matplotlib.
    """
    figure = Figure(figsize=(width, height), dpi=SCREEN, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    for panel in axes.flat:
        styled(panel)
    return figure, axes


def styled(axes: Any) -> Any:
    """Give new axes grid lines and small text; return the axes."""
    axes.grid(alpha=0.3, linewidth=0.6)
    axes.tick_params(which="both", labelsize=SMALL, width=0.6)
    for axis in (axes.xaxis, axes.yaxis):
        axis.label.set_fontsize(TEXT)
        axis.offsetText.set_fontsize(SMALL)
    return axes


def heading(figure: Figure, text: str) -> None:
    """Write a title over a figure, with lines no wider than the figure."""
    figure.suptitle(textwrap.fill(text, round(16 * figure.get_figwidth())), fontsize=TEXT)


def caption(axes: Any, text: str) -> None:
    """Write a title over a panel."""
    axes.set_title(text, fontsize=TEXT)


def from_zero(axes: Any, *values: Array) -> None:
    """Set the range of the y-axis of a panel: from zero to above the largest of all values."""
    highest = max((float(np.nanmax(each, initial=0.0)) for each in values), default=0.0)
    axes.set_ylim(0.0, ROOM * highest or 1.0)


def plain_log_ticks(axis: Any) -> None:
    """Put the ticks of a logarithmic axis at 1, 2 and 5 in each decade, as plain numbers."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(lambda x, _: f"{x:.4g}")
    axis.set_minor_locator(NullLocator())


def legend(axes: Any, **options: Any) -> Any:
    """Draw the legend of a panel in small text."""
    return axes.legend(
        **{"fontsize": SMALL, "title_fontsize": SMALL, "handlelength": 2.2} | options
    )


def legend_below(figure: Figure, axes: Any, columns: int, **options: Any) -> None:
    """Draw one legend below all panels; a label that several of ``axes`` have appears once."""
    found: dict[str, Any] = {}
    for panel in np.ravel(axes):
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    figure.legend(
        found.values(),
        found.keys(),
        loc="outside lower center",
        ncols=columns,
        **{"fontsize": SMALL, "title_fontsize": SMALL, "handlelength": 2.4} | options,
    )


def cable_lines(axes: Any, x: Array, values: Array, names: Sequence[str], **line: Any) -> None:
    """Draw values (N, C) against x (N,), a line for each of C cables.

    Up to 24 cables have a legend with their ``names``. The lines of more cables are coloured by the
    number of the cable, with a colour bar. ``line`` has further options of the lines.
    """
    if len(names) > NAMED:
        for color, own in zip(number_colors(axes, len(names), "cable"), values.T, strict=True):
            axes.plot(x, own, color=color, **line)
        return
    for c, name in enumerate(names):
        color, style = _CABLES[c % len(_CABLES)], STYLES[c // len(_CABLES)]
        axes.plot(x, values[:, c], color=color, linestyle=style, label=name, **line)
    legend(axes, **BESIDE, ncols=1 + (len(names) > NAMED // 2))


def number_colors(axes: Any, count: int, name: str) -> Array:
    """Return an RGBA colour for each number from 1 to ``count`` (count, 4); draw a colour bar.

    ``name`` says on the bar what the numbers count, such as ``cable``.
    """
    colors = ScalarMappable(Normalize(1, count), COLOR_MAP)
    bar = axes.figure.colorbar(colors, ax=axes, aspect=30.0)
    bar.set_label(f"number of the {name}", fontsize=TEXT)
    bar.ax.tick_params(labelsize=SMALL)
    bar.locator = MaxNLocator(TICKS, integer=True)
    return np.asarray(colors.to_rgba(np.arange(1, count + 1)))


def equal_axes(axes: Any, zoom: float = 1.0) -> None:
    """Give 3D axes equal scales, and no ticks near the corners, where two axes meet.

    ``zoom`` < 1 makes the drawing smaller.
    """
    ranges = np.ptp([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()], axis=1)
    axes.set_box_aspect(ranges.tolist(), zoom=zoom)  # an array would be scaled in place
    for letter, part in zip(XYZ, ranges / ranges.max(), strict=True):
        low, high = getattr(axes, f"get_{letter}lim")()
        low, high = low + _CORNER * ranges.max(), high - _CORNER * ranges.max()
        ticks = MaxNLocator(max(1, round(TICKS * part))).tick_values(low, high)
        getattr(axes, f"set_{letter}ticks")(ticks[(ticks >= low) & (ticks <= high)])


class _Picture(Axes3D):  # type: ignore[misc]
    """3D axes without the empty margin that matplotlib adds to a drawing.

    Notebooks crop a figure to the box that its axes report, here a box close around the drawing.
    """

    def get_tightbbox(self, renderer: Any = None, **options: Any) -> Bbox:
        """Return the box around the cube of the axes, with ticks and labels [pixel]."""
        corners = np.array([*product(*np.reshape(self.get_w_lims(), (3, 2)))])
        x, y, _ = proj3d.proj_transform(*corners.T, self.get_proj())
        box = Bbox.null()
        box.update_from_data_xy(self.transData.transform(np.transpose([x, y])))
        return Bbox.union(
            [box, *(each.get_tightbbox(renderer) for each in self._axis_map.values())]
        )


def picture_axes() -> tuple[Figure, Any]:
    """Build a figure of one column with 3D axes."""
    figure = Figure(figsize=(ONE_COLUMN, ONE_COLUMN), dpi=SCREEN)
    axes: Any = figure.add_subplot(axes_class=_Picture)
    axes.view_init(elev=24.0, azim=-62.0)
    return figure, axes


def finish_picture(figure: Figure, axes: Any, title: str, right: float = 1.0) -> None:
    """Write title and legend of a 3D picture, then call :func:`fill_canvas`."""
    heading(figure, title)
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="lower center", ncols=3, fontsize=SMALL, frameon=False)
    fill_canvas(axes, right)


def fill_canvas(axes: Any, right: float = 1.0) -> None:
    """Enlarge a 3D picture to fill its figure, and set the height of the figure to fit.

    ``right`` is the right end of the picture, as a fraction of the figure's width.
    """
    figure = axes.figure
    legends, titles = figure.legends, [figure._suptitle] if figure._suptitle else []
    for _ in range(4):  # text keeps its size, so the right scale is found step by step
        figure.draw_without_rendering()
        width = figure.get_figwidth() * figure.dpi
        below, above = (
            _GAP * figure.dpi + sum(each.get_window_extent().height for each in parts)
            for parts in (legends, titles)
        )
        renderer: Any = FigureCanvasAgg(figure).get_renderer()  # type: ignore[no-untyped-call]
        place = axes.get_window_extent()
        box = axes.get_tightbbox(renderer)
        scale = (right - 2.0 * _GAP / figure.get_figwidth()) * width / box.width
        height = below + scale * box.height + above
        figure.set_figheight(height / figure.dpi)
        corner = (
            _GAP * figure.dpi - scale * (box.x0 - place.x0),
            below - scale * (box.y0 - place.y0),
        )
        size = scale * place.width, scale * place.height
        axes.set_position(
            (corner[0] / width, corner[1] / height, size[0] / width, size[1] / height)
        )
