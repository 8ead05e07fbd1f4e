"""Plot maps of a sweep: filled cells over joints or tips, with what does not hold hatched."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, get_args

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, NullLocator
from numpy.typing import NDArray

from cdsm.plots import style
from cdsm.plots.lines import line_looks, name_lines
from cdsm.plots.map_cells import (
    FAULTS,
    HUGE,
    OTHER,
    Cells,
    Statistic,
    entries_of,
    grid_cells,
    is_grid,
    is_line,
    quantity_of,
    tip_cells,
    unit_of_axis,
)
from cdsm.plots.style import Panels
from cdsm.quantities import display_of, si_of
from cdsm.status import Status
from cdsm.support.format import one_unit
from cdsm.support.status import check_sweep, status_names
from cdsm.support.validation import one_of
from cdsm.support.values import Array

if TYPE_CHECKING:
    import xarray


_WIDE = 8.0  # the colours are logarithmic if the ratio of largest to smallest value exceeds this
_ROBUST: Final = (1.0, 99.0)  # percentiles at the ends of the colours
_EVEN = 1e-9  # a smaller difference of the ends of the colours, over the largest, is rounding


@style.styled
def plot_map(
    dataset: xarray.Dataset,
    quantity: str = "softest",
    axs: Panels | Sequence[Axes] | None = None,
    *,
    section: tuple[str, float, float] | None = None,
    statistic: Statistic = "median",
    title: str | None = None,
) -> Panels:
    """Plot a quantity of a sweep as filled cells, a panel for each case; return the axes.

    The cells of :class:`~cdsm.PlanePoses` are tips in a plane, those of a grid over two joints are
    their angles. Other tips in a plane, tips in a section, and a cloud of tips in three slices
    through its middle are put into square cells, whose size follows from the number of postures.
    Postures of a path and of a grid over one joint are drawn as a curve.

    A cell whose postures have no value is hatched: unstable, no balance, or beyond the law of a
    wire. Directions have a scale of colours each, as other quantities would; it is logarithmic if
    it spans more than 8 : 1, ends at the 1st and 99th percentile, and has its middle at zero if the
    quantity has both signs. Over each panel are the values that 10, 50 and 90 % of the cells do not
    exceed.

    Args:
        dataset: Result of :func:`~cdsm.sweep` with the output ``tip_position``, unless it is a grid
            over two joints or of :class:`~cdsm.PlanePoses`. Use ``sel`` if it has more than 9
            panels.
        quantity: Quantity with one number per entry: ``"softest"``, ``"stiffest"``,
            ``"isotropy"``, ``"margin"``; or ``"along"`` (a panel for each direction).
        axs: Ordinary axes, one or more for each panel; None: a new figure.
        section: Axis, position and half thickness [m] of a slab. Only tips inside it are shown.
        statistic: ``"median"``, ``"min"`` or ``"max"`` of the postures in a square cell.
        title: Title; None: the name of the sweep and the question.

    Raises:
        InvalidInput: ``dataset`` is not a sweep or has too many panels or no such quantity,
            ``quantity`` has more than one number per entry, ``section`` is invalid or contains no
            tip, or the statistic is unknown.
        CdsmError: xarray is not installed.

    Example:
        >>> import cdsm
        >>> data = cdsm.sweep(
        ...     cdsm.presets.virtual_prototype(), cdsm.RandomPoses(50), minimum=5.0, progress=False
        ... )
        >>> cdsm.plots.plot_map(data, "margin").size
        3
    """
    check_sweep(dataset)
    one_of("statistic", statistic, get_args(Statistic))
    value, poses, cases = quantity_of(dataset, quantity)
    name = _words_of_along(dataset) if quantity == "along" else str(value.long_name).split(",")[0]
    unit, _ = display_of(si_of(value.units))
    label = f"{name} [{one_unit(unit) or '-'}]"
    if len(poses) == 1 and section is None and is_line(dataset, poses[0]):
        return _plot_lines(dataset, value, poses[0], cases, label, axs, title)
    if section is None and is_grid(dataset, poses):
        panels = list(grid_cells(dataset, value, poses, cases))
    else:
        remedy = "tip_position must be among outputs of the sweep."
        one_of("quantity", "tip_position", [str(v) for v in dataset.data_vars], remedy)
        panels = list(tip_cells(dataset, value, poses, cases, section, statistic))
        label += f"\n{statistic} of the postures in a cell"
    return _plot_cells(dataset, panels, label, axs, title)


def _words_of_along(dataset: xarray.Dataset) -> str:
    """Return the words of ``along``, with its direction if that is the only one left."""
    alone = "direction" in dataset.coords and not dataset["direction"].ndim
    return f"stiffness along {dataset['direction'].item()}" if alone else "stiffness"


def _plot_cells(
    dataset: xarray.Dataset, cells: list[Cells], label: str, axs: Any, title: str | None
) -> Panels:
    """Draw the panels, a colour bar for each scale, and what the hatches mean."""
    columns = 2 if len(cells) == 4 else min(len(cells), 3)
    rows = -(-len(cells) // columns)
    width = style.ONE_COLUMN if columns == 1 else style.TWO_COLUMNS
    scales = {
        name: _colors([panel.values for panel in cells if panel.scale == name])
        for name in dict.fromkeys(panel.scale for panel in cells)
    }
    shape = max(float(np.ptp(panel.y) / np.ptp(panel.x)) for panel in cells)
    room = (width / columns - 0.75) * float(np.clip(shape, 0.4, 1.3))
    bars = rows if len(scales) > 1 else 1
    height = 0.75 + rows * (room + 0.75) + 0.55 * bars
    chosen = axs
    if axs is None:
        shapes = [float(np.ptp(panel.x) / np.ptp(panel.y)) for panel in cells]
        ratios = np.clip([max(shapes[k::columns]) for k in range(columns)], 0.4, 2.5)
        options: dict[str, Any] = {"width_ratios": ratios.tolist()}
        chosen = style.panels(None, columns, rows, height=height, width=width, **options)
        # without it, panels of equal scales would stand far from each other
        style.figure_of(chosen).set_layout_engine("compressed", h_pad=0.07)
        for ax in chosen[len(cells) :]:
            ax.remove()
    panels = style.panels(chosen[: len(cells)] if axs is None else axs, len(cells), height=height)
    for ax, panel in zip(panels, cells, strict=True):
        _draw(ax, panel, scales[panel.scale][0])
    for scale, (colors, extend) in scales.items():
        users = [ax for ax, panel in zip(panels, cells, strict=True) if panel.scale == scale]
        text = label.replace(" [", f" {scale} [", 1) if scale else label
        if any(np.isfinite(panel.values).any() for panel in cells if panel.scale == scale):
            color_bar_below(users, colors, text, extend)
    _legend_faults(panels, cells, axs)
    finite = [np.isfinite(panel.values).any() for panel in cells]
    about = f"{dataset.attrs['title'].removeprefix('stiffness sweep of ')}"
    question = f"{about}: where is it stiff, where does it hold? {_sentence(dataset)}"
    if not any(finite):
        known = "is finite" if any(np.isinf(panel.values).any() for panel in cells) else "exists"
        question = f"{about}: {label.split(' [')[0]} {known} at none of these postures"
    style.set_heading(panels, axs, title, question)
    return panels


def _sentence(dataset: xarray.Dataset) -> str:
    """Return how the postures were chosen, and what part of the entries holds."""
    codes = {word: code for code, word in status_names(dataset).items()}
    status = dataset["status"].values
    reached = status != codes.get(Status.OUT_OF_REACH.word, -1)
    holds = np.isin(status, [codes["ok"], codes["immobile"]])
    part = 100.0 * holds.sum() / max(int(reached.sum()), 1)
    poses = str(dataset.attrs["poses"])
    tension = "" if "minimum" in dataset.dims else f", tensions from {_least(dataset)} N"
    return f"{poses[:1].upper()}{poses[1:]}{tension}; {part:.3g}\xa0% hold"


def _least(dataset: xarray.Dataset) -> str:
    """Return the least tension that held, as text."""
    for name in ("minimum_held", "minimum"):
        if name in dataset.coords:
            return f"{float(dataset[name].min()):g}"
    return "0"


def _colors(arrays: Sequence[Array]) -> tuple[ScalarMappable, str]:
    """Return a colour scale for values without outliers, and the ends beyond which they are."""
    values = np.concatenate([array.ravel() for array in arrays])
    finite = values[np.isfinite(values)] if np.isfinite(values).any() else np.array([0.0, 1.0])
    low, high = np.percentile(finite, _ROBUST)
    scale = Normalize
    name = style.COLOR_MAP
    if finite.min() < 0.0 < finite.max():  # colours show the sign, zero is in the middle
        high = max(-low, high)
        name = "PuOr"
        low = -high
    elif low > 0.0 and high > _WIDE * low:
        scale = LogNorm
    if high - low <= _EVEN * abs(high):  # differences are rounding
        low = low - 0.05 * abs(low)
        high = high + 0.05 * abs(high)
    beyond = bool((finite < low).any()), bool((values > high).any())
    extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[beyond]
    return ScalarMappable(scale(float(low), float(high)), colormaps[name]), extend


def _draw(ax: Axes, panel: Cells, colors: ScalarMappable) -> None:
    values = np.ma.masked_invalid(np.minimum(panel.values, HUGE))
    look: dict[str, Any] = {"norm": colors.norm, "cmap": colors.cmap, "rasterized": True}
    ax.pcolormesh(panel.x, panel.y, values, gid="cells", zorder=1, **look)
    for words, mask in panel.faults.items():
        _hatch(ax, panel, words, mask)
    ax.set(xlabel=panel.labels[0], ylabel=panel.labels[1], facecolor="0.97")
    ax.set(xlim=(panel.x[0], panel.x[-1]), ylim=(panel.y[0], panel.y[-1]), aspect="equal")
    if colors.cmap.name == "PuOr":  # the middle of the scale is white
        ax.set_facecolor("0.88")
    ax.grid(visible=False)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(4, min_n_ticks=3, steps=[1, 2, 5, 10]))
    lines = [panel.title, panel.heading, _quantiles(panel.values)]
    ax.set_title("\n".join(filter(None, lines)), fontsize=style.NOTE_SIZE, linespacing=1.25)


def _hatch(ax: Axes, panel: Cells, words: str, mask: NDArray[np.bool_]) -> None:
    """Fill cells without a value with the hatch of these words."""
    if not mask.any():
        return
    _, face, hatch, edge = _look_of(words)
    rows, columns = np.nonzero(mask)
    corners = [
        [
            (panel.x[c], panel.y[r]),
            (panel.x[c + 1], panel.y[r]),
            (panel.x[c + 1], panel.y[r + 1]),
            (panel.x[c], panel.y[r + 1]),
        ]
        for r, c in zip(rows, columns, strict=True)
    ]
    plain = PolyCollection(corners, facecolor=face, edgecolor="none", zorder=1.5)
    plain.set_gid(f"fault:{words}")
    ax.add_collection(plain)
    if hatch:
        look: dict[str, Any] = {"facecolor": "none", "edgecolor": edge, "linewidth": 0.0}
        ax.add_collection(PolyCollection(corners, hatch=hatch, zorder=1.6, **look))


def _look_of(words: str) -> tuple[str, str, str, str]:
    return next((look for look in FAULTS.values() if look[0] == words), OTHER)


def _quantiles(values: Array) -> str:
    """Return the values that 10, 50 and 90 % of the cells do not exceed, as text."""
    known = values[~np.isnan(values)]
    if not known.size:
        return "no value"
    # an infinite value counts as largest
    marks = np.quantile(known, (0.1, 0.5, 0.9), method="inverted_cdf")
    return "10/50/90 %: " + " / ".join(f"{x:.3g}" for x in marks)


def color_bar_below(axs: Sequence[Axes], colors: ScalarMappable, label: str, extend: str) -> None:
    """Draw a slim colour bar below panels, with three numbers or more."""
    figure = style.figure_of(axs[0])
    place: dict[str, Any] = {"orientation": "horizontal", "fraction": 0.06, "pad": 0.03}
    place |= {"aspect": 26 * min(len(axs), 2), "shrink": 1.0 if len(axs) < 3 else 0.6}
    bar = figure.colorbar(colors, ax=list(axs), extend=extend, extendfrac=0.03, **place)
    bar.set_label(label, labelpad=2)
    bar.outline.set_linewidth(0.4)
    bar.ax.tick_params(length=2, width=0.5, labelsize=7)
    axis = bar.ax.xaxis
    if isinstance(colors.norm, LogNorm):
        low, high = colors.get_clim()
        places = np.zeros(0)
        for parts in ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1, 1.5, 2, 3, 4, 5, 6, 8)):
            marks = np.asarray(LogLocator(10.0, parts).tick_values(low or 1.0, high or 1.0))
            places = marks[(marks >= (low or 0.0)) & (marks <= (high or 0.0))]
            if places.size >= 3:
                break
        bar.set_ticks(places.tolist(), labels=[f"{x:g}" for x in places])
        axis.set_minor_locator(NullLocator())
    else:
        bar.locator = MaxNLocator(4, min_n_ticks=3)
        bar.update_ticks()
    axis.set_minor_formatter(NullFormatter())
    style.keep_ticks(bar.ax)


def _legend_faults(panels: Panels, cells: list[Cells], axs_of_caller: object) -> None:
    """Draw what the hatches mean: below a figure of this library, else beside the last panel."""
    used = {words for panel in cells for words, mask in panel.faults.items() if mask.any()}
    looks = [look for look in (*FAULTS.values(), OTHER) if look[0] in used]
    keys = []
    for words, face, hatch, edge in looks:
        line: dict[str, Any] = {"ec": edge, "lw": 0.0} if hatch else {"ec": "0.8", "lw": 0.5}
        keys.append(Patch(fc=face, hatch=hatch, label=words, **line))
    if not keys:
        return
    if axs_of_caller is None:
        style.figure_of(panels).legend(
            handles=keys, loc="outside lower left", ncols=4, handleheight=1.1
        )
    else:
        look: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.02, 1.0)}
        panels[-1].legend(handles=keys, handleheight=1.1, **look)  # hides no cell


def _plot_lines(
    dataset: xarray.Dataset,
    value: xarray.DataArray,
    dim: str,
    cases: list[str],
    label: str,
    axs: Any,
    title: str | None,
) -> Panels:
    """Draw a quantity over one joint, or over the way along a path, with a line for each case."""
    names, x, _ = entries_of(dataset, value, [dim], cases)
    coordinate = dataset["distance" if "distance" in dataset.coords else dim]
    unit, size = unit_of_axis(coordinate)
    panels = style.panels(axs, 1, height=2.4, width=style.ONE_COLUMN)
    ax = panels[0]
    place = coordinate.values / size
    ends = []
    for look, case, values in zip(line_looks([""] * len(names)), names, x, strict=True):
        words = ", ".join(case.values())
        ax.plot(place, values, gid=f"line:{words}", **look)
        known = np.flatnonzero(np.isfinite(values))[-1:]
        ends += [(float(values[k]), words, str(look["color"])) for k in known]
    missing = np.isnan(x).all(axis=0)
    if missing.any():
        for k in np.flatnonzero(missing).tolist():
            low = place[max(k - 1, 0)] / 2.0 + place[k] / 2.0
            high = place[min(k + 1, len(place) - 1)] / 2.0 + place[k] / 2.0
            ax.axvspan(low, high, fc="0.9", lw=0.0, zorder=0.4, gid="no value")
    ax.set_ylim(ax.get_ylim())
    ax.set_xlim(place.min(), place.max())
    name_lines(ax, float(place.max()), ends)
    along = "way along the path" if coordinate.name == "distance" else str(coordinate.name)
    ax.set(xlabel=f"{along} [{unit}]", ylabel=textwrap.fill(label, 30))
    about = str(dataset.attrs["title"]).removeprefix("stiffness sweep of ")
    style.set_heading(panels, axs, title, f"{about}: how stiff is it on its way?")
    return panels
