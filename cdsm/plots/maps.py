"""Plot workspace maps: reachable tip positions, coloured by stiffness, as dots or as cells."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cdsm.errors import InvalidInput
from cdsm.plots.map_panels import Case, Map, cases_of, drawable, slices_of
from cdsm.plots.style import (
    BLACK,
    BLUE,
    COLOR_MAP,
    MM,
    N_PER_MM,
    ORANGE,
    PURPLE,
    SMALL,
    TEXT,
    TICKS,
    TWO_COLUMNS,
    VERMILLION,
    caption,
    heading,
    panels,
    plain_log_ticks,
)
from cdsm.support.directions import XYZ
from cdsm.support.tidy import check_sweep, status_names
from cdsm.support.validation import one_of, whole_number
from cdsm.support.values import Array

if TYPE_CHECKING:
    import xarray

_UNITS: Final = {
    "N m-1": (N_PER_MM, "N/mm"),
    "N m rad-1": (1.0, "N m/rad"),
    "N m rad-1 or N m-1": (1.0, "N m/rad or N/m"),
    "1": (1.0, "-"),
}
"""Factor and label of the colour bar for each unit of a Dataset."""

_WIDE = 30.0  # the colours are logarithmic if the ratio of largest to smallest value exceeds this

_EQUAL = 1e-9
"""Values that differ by less than this fraction of the largest are drawn as equal.

The colour scale then extends 5 % to either side of them.
"""

_MIDDLE = (0.05, 0.95)
"""Probabilities of two quantiles. If these are d apart, values more than d outside are outliers."""

_TALLEST = 4.0  # largest height of a panel [inch]
_BAR = 0.17  # width of the colour bar [inch]
_NARROWEST = 1.2  # least width of a title, and of a panel without its ticks [inch]

Statistic = Literal["median", "min", "max"]

_MARKS: Final[dict[str, tuple[str, str, float]]] = {
    "unstable": ("x", VERMILLION, 14.0),
    "infeasible": (".", "0.75", 8.0),
    "outside_elasticity": ("+", PURPLE, 18.0),
    "solver_failed": ("^", ORANGE, 14.0),
    "singular": ("d", VERMILLION, 14.0),
    "immobile": ("s", "0.5", 10.0),
    "beyond_limits": ("v", "0.6", 10.0),
    "coincident_sites": ("*", BLACK, 18.0),
    "pending": ("2", "0.5", 20.0),
}
"""Marker, colour and size [pt²] of entries without the quantity, by status."""


def plot_map(
    dataset: xarray.Dataset,
    quantity: str = "softest",
    *,
    section: tuple[str, float, float] | None = None,
    statistic: Statistic | None = None,
    bins: int = 40,
) -> Figure:
    """Plot the tips of a sweep in mm, coloured by a quantity, with a panel for each case.

    Tips in a plane and tips in a section are drawn as dots, or as cells if a statistic is given. A
    cloud of tips is drawn in three slices through its middle, as cells; a path is drawn as dots, as
    seen along each axis. Several postures may put the tip into one cell; the statistic determines
    the value that the cell shows. An entry (a posture in a case) without the quantity is marked by
    its status; in a map of cells, no mark is drawn in a cell that has a value. Unstable entries are
    marked instead of coloured, except in a map of the margin. Outliers, far from the middle 90 % of
    the values, and infinite values have a colour of their own, at the ends of the colour bar.

    Args:
        dataset: Result of :func:`~cdsm.sweep` with the output ``tip_position``. Use
            ``sel`` if it has more than 9 panels.
        quantity: Quantity with one number per entry: ``"softest"``, ``"stiffest"``,
            ``"isotropy"``, ``"margin"``; or ``"along"`` (a panel for each direction).
        section: Axis, position and half thickness [m] of a slab. Only tips inside it are shown.
        statistic: ``"median"``, ``"min"`` or ``"max"`` of the postures in a cell; None: dots where
            the tips are in a plane or a section, else the median.
        bins: Number of cells along the longest side of a map.

    Raises:
        InvalidInput: ``dataset`` is not a sweep or has too many panels, ``quantity`` is the status
            or has more than one number per entry, ``section`` is invalid or contains no tip, or
            ``bins`` is not a whole number from 2 to 500.
        UnknownName: The sweep has no such quantity or no tip positions, or the axis or the
            statistic is unknown.
        MissingExtra: xarray is not installed.
    """
    check_sweep(dataset)
    if quantity == "status":
        raise InvalidInput(
            "quantity", "status given; a map of any other quantity marks each status at its tips."
        )
    remedy = "tip_position and the quantity must be among outputs= of the sweep."
    one_of("quantity", "tip_position", [str(each) for each in dataset.data_vars], remedy)
    tips = MM * dataset["tip_position"].transpose(..., "axis")
    poses = [str(dim) for dim in tips.dims[:-1]]
    if quantity not in [*dataset.data_vars]:
        one_of("quantity", quantity, drawable(dataset, poses), remedy)
    if statistic is not None:
        one_of("statistic", statistic, get_args(Statistic))
    whole_number("bins", bins, 2, 500)
    words = status_names(dataset)
    cases = list(cases_of(dataset, quantity, poses, words))
    points = tips.values.reshape(-1, 3)
    known = np.isfinite(points).all(axis=1)
    path = "distance" in dataset.coords and poses == ["pose"]  # a joint may have this name
    slices, cloud = slices_of(points[known], section, path)
    factor, unit = _UNITS.get(dataset[quantity].units, (1.0, dataset[quantity].units))
    maps = [
        Map(
            ", ".join(filter(None, [case.title, part.title])),
            points[inside][:, part.plane],
            factor * case.values[inside],
            case.status[inside],
            part.plane,
            bool(part.contains(np.zeros((1, 3)))[0]),
        )
        for case in cases
        for part in slices
        for inside in [known & part.contains(points)]
    ]
    if not any(len(each.points) for each in maps):
        raise InvalidInput(
            "section" if section is not None else "dataset",
            "has no tip to show; widen the section, or sweep over other postures.",
        )
    every = np.concatenate([each.values for each in maps])
    colors, extend = _colors(every)
    shown = statistic or ("median" if cloud else None)
    beside = 2 if cloud and len(cases) > 3 else 1  # cases in a row
    columns = beside * len(slices) if cloud else 2 if len(maps) == 4 else min(len(maps), 3)
    rows = -(-len(cases) // beside) if cloud else -(-len(maps) // columns)
    ratio = max(np.ptp(each.limits[1]) / np.ptp(each.limits[0]) for each in maps)
    height = min((TWO_COLUMNS - 1.3) / columns * ratio, _TALLEST)
    titled = max(height / ratio, _NARROWEST)
    width = max(height / ratio, _NARROWEST + 0.4)
    size = 1.3 + width * columns + 0.5, 0.9 + (0.45 + height) * rows
    figure, grid = panels(*size, columns, rows)
    order = grid.reshape(rows, beside, -1).swapaxes(0, 1).ravel()  # the first cases on the left
    for axes, each in itertools.zip_longest(order, maps):
        if each is None:
            axes.set_axis_off()
            continue
        _draw(axes, each, colors, words, shown, bins)
        caption(axes, textwrap.fill(each.title, round(16 * titled)))
        axes.locator_params("x", nbins=min(TICKS, round(2.4 * height / ratio)))
    title = f"{dataset.attrs['title']}, {dataset.attrs['poses']}"
    name = dataset[quantity].long_name.split(",")[0]
    if not np.isfinite(every).any():
        found = "exists at none" if np.isnan(every).all() else "is infinite at all"
        title += f": {name} {found} of these tips"
    else:
        bar = figure.colorbar(colors, ax=grid, extend=extend, aspect=size[1] / _BAR)
        sign = "; below 0: unstable" if quantity == "margin" else ""
        of = f"{shown} of a cell: " if shown else ""
        bar.set_label(textwrap.fill(f"{of}{name} [{unit}]{sign}", 45), fontsize=TEXT)
        if isinstance(colors.norm, LogNorm):
            plain_log_ticks(bar.ax.yaxis)
        bar.ax.tick_params(which="both", labelsize=SMALL)
    # slices show a part of the entries, and some entries have no tip
    _legend(figure, cases if section is None else maps, maps, words)
    heading(figure, title)
    return figure


def _colors(values: Array) -> tuple[ScalarMappable, str]:
    """Return a colour scale for ``values`` without outliers, and the ends beyond which they are.

    The ends are ``"neither"``, ``"min"``, ``"max"`` or ``"both"``.
    """
    finite = values[np.isfinite(values)] if np.isfinite(values).any() else np.array([0.0, 1.0])
    low, high = float(finite.min()), float(finite.max())
    wide = low > 0.0 and high > _WIDE * low
    measure = np.log(finite) if low > 0.0 else finite
    near, far = np.quantile(measure, _MIDDLE)
    inner = finite[(measure >= 2.0 * near - far) & (measure <= 2.0 * far - near)]
    low, high = float(inner.min()), float(inner.max())
    scale, name = LogNorm if wide and high > _WIDE * low else Normalize, COLOR_MAP
    over = VERMILLION
    if finite.min() < 0.0 < finite.max():  # a margin: colours show its sign, zero is in the middle
        high, name = max(-low, high), "PuOr"
        low, over = -high, BLUE
    below, above = bool((finite < low).any()), bool((values > high).any())
    cmap = colormaps[name].with_extremes(under=BLACK, over=over)
    extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[below, above]
    if high - low <= _EQUAL * abs(high):
        low, high = low - 0.05 * abs(low), high + 0.05 * abs(high)
    return ScalarMappable(scale(low, high), cmap), extend


def _draw(
    axes: Any,
    shown: Map,
    colors: ScalarMappable,
    words: Mapping[int, str],
    statistic: Statistic | None,
    bins: int,
) -> None:
    known = ~np.isnan(shown.values)
    limits, marked = shown.limits, ~known
    highest: Any = colors.norm.vmax
    finite = np.minimum(shown.values, 2.0 * abs(highest))  # infinities are not drawn
    if statistic is not None and known.any():
        from scipy.stats import binned_statistic_2d  # here, because it imports slowly

        size = np.ptp(limits, axis=1).max() / bins
        edges = [np.arange(low, high + size, size) for low, high in limits]
        cells, *_, cell = binned_statistic_2d(
            *shown.points[known].T, finite[known], statistic, edges, expand_binnumbers=True
        )
        axes.pcolormesh(*edges, np.ma.masked_invalid(cells.T), norm=colors.norm, cmap=colors.cmap)
        taken = {tuple(each) for each in cell.T.tolist()}
        places = np.stack([np.digitize(x, e) for x, e in zip(shown.points.T, edges, strict=True)])
        marked &= [tuple(each) not in taken for each in places.T.tolist()]
    for code in np.unique(shown.status[marked]).tolist():
        mark, color, area = _MARKS[words[code]]
        chosen = shown.points[marked & (shown.status == code)]
        axes.scatter(*chosen.T, marker=mark, c=color, s=area, linewidths=0.7)
    if statistic is None:
        axes.scatter(
            *shown.points[known].T,
            c=finite[known],
            norm=colors.norm,
            cmap=colors.cmap,
            s=8.0,
            linewidths=0.0,
        )
    axes.set(xlim=limits[0], ylim=limits[1])
    if colors.norm.vmin == -highest:  # the middle of the scale is white
        axes.set_facecolor("0.88")
    if shown.shows_base:
        axes.plot(0.0, 0.0, "s", color="0.1", markersize=4)
    for letter, axis in zip("xy", shown.plane, strict=True):
        getattr(axes, f"set_{letter}label")(f"{XYZ[axis]} [mm]")
    axes.locator_params(nbins=TICKS)
    axes.set_aspect("equal")


def _legend(
    figure: Figure, counted: Sequence[Case | Map], maps: Sequence[Map], words: Mapping[int, str]
) -> None:
    """Draw the legend of the statuses: marker, name, and percentage of the entries of ``counted``.

    It lists the statuses of entries without a value, and the base if one of ``maps`` shows it.
    """
    status = np.concatenate([each.status[np.isnan(each.values)] for each in counted])
    total = sum(each.status.size for each in counted)
    handles = []
    if any(each.shows_base for each in maps):
        handles.append(Line2D([], [], marker="s", color="0.1", linestyle="", label="base"))
    for value, count in zip(*np.unique(status, return_counts=True), strict=True):
        word = words[int(value)]
        mark, color, _ = _MARKS[word]
        label = f"{word.replace('_', ' ')}: {100.0 * count / total:.3g} %"
        handles.append(Line2D([], [], marker=mark, color=color, linestyle="", label=label))
    if handles:
        figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=SMALL)
