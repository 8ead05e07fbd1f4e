"""Plot workspace maps: reachable tip positions, coloured by stiffness."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from cdsm.errors import InvalidInput
from cdsm.plots.style import AXES, COLORS, MM, N_PER_MM, TICKS, equal_axes, panels
from cdsm.support.datasets import check_sweep, status_names
from cdsm.support.validation import one_of, scalar
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

_MOST_PANELS = 9
_WIDE = 30.0
"""The colours are logarithmic if the ratio of largest to smallest value exceeds this."""

_FLAT = 1e-9
"""The tips are in a plane if their extent along an axis is below this fraction of the largest."""

_MARKS: Final[dict[str, tuple[str, str, float]]] = {
    "unstable": ("x", COLORS[1], 18.0),
    "infeasible": (".", "0.75", 8.0),
    "outside_elasticity": ("+", "0.55", 18.0),
}
"""Marker, colour and size of entries without the quantity; any other status uses the last one."""


def plot_map(
    dataset: xarray.Dataset,
    quantity: str = "softest",
    *,
    section: tuple[str, float, float] | None = None,
) -> Figure:
    """Plot the tips of a sweep in mm, coloured by a quantity, with a panel for each case.

    Axes are equal. Tips in a plane and sections are shown in 2D, other tips in 3D. Entries without
    the quantity are marked by their status. Unstable entries are marked too, because their
    stiffness has no meaning, except in a map of the margin. If some values are infinite, the
    colours end at the 99th percentile of the finite ones, and the colour bar ends in an arrow.

    Args:
        dataset: Result of :func:`~cdsm.sweeps.run.sweep` with the output ``tip_position``. Use
            ``sel`` if it has more than 9 panels.
        quantity: Quantity with one number per entry: ``"softest"``, ``"stiffest"``,
            ``"anisotropy"``, ``"margin"``, ``"along"`` (a panel for each direction).
        section: Axis, position and half thickness [m] of a slab. Only tips inside it are shown.

    Raises:
        InvalidInput: ``dataset`` is not a sweep or has too many panels, ``quantity`` has more than
            one number per entry, or ``section`` is invalid or holds no tip.
        UnknownName: The sweep has no such quantity or no tip positions, or the axis is unknown.
        MissingExtra: xarray is not installed.
    """
    check_sweep(dataset)
    one_of("quantity", quantity, [str(name) for name in dataset.data_vars])
    one_of("quantity", "tip_position", [str(name) for name in dataset.data_vars])
    tips = MM * dataset["tip_position"].transpose(..., "axis")
    poses = [str(dim) for dim in tips.dims[:-1]]
    words = status_names(dataset)
    maps = list(_panels(dataset, quantity, poses, words))
    points = tips.values.reshape(-1, 3)
    shown = np.isfinite(points).all(axis=1)
    title = [dataset.attrs["title"], dataset.attrs["poses"]]
    if section is not None:
        inside, slab = _slab(points, section)
        shown &= inside
        title.append(slab)
    if not shown.any():
        raise InvalidInput(
            "section" if section is not None else "dataset",
            "has no tip to show; widen the section, or sweep over other postures.",
        )
    points = points[shown]
    plane = _plane(points, section)
    factor, unit = _UNITS.get(dataset[quantity].units, (1.0, dataset[quantity].units))
    maps = [_Panel(title, factor * values[shown], code[shown]) for title, values, code in maps]
    every = np.concatenate([panel.values for panel in maps])
    colors = _colors(every)

    columns = 2 if len(maps) == 4 else min(len(maps), 3)
    rows = -(-len(maps) // columns)
    size = 1.5 + 3.6 * columns, 0.9 + 3.2 * rows
    projection: dict[str, Any] = {} if plane else {"subplot_kw": {"projection": "3d"}}
    figure, grid = panels(*size, columns, rows, **projection)
    for axes, panel in itertools.zip_longest(grid.flat, maps):
        if panel is None:
            axes.set_axis_off()
            continue
        _draw(axes, points, panel, plane, colors, words)
        axes.set_title(panel.title, fontsize=9)
    name = dataset[quantity].long_name.split(",")[0]
    extend = "max" if np.isposinf(every).any() else "neither"
    bar = figure.colorbar(colors, ax=grid, shrink=0.8, extend=extend)
    sign = "; below 0: unstable" if quantity == "margin" else ""
    bar.set_label(f"{name} [{unit}]{sign}", fontsize=9)
    bar.ax.tick_params(labelsize=8)
    _legend(figure, maps, words)
    figure.suptitle(textwrap.fill(", ".join(title), 30 + 45 * columns), fontsize=9)
    return figure


class _Panel(NamedTuple):
    """One map: values of all tips (NaN if missing) and their status."""

    title: str
    values: Array
    status: NDArray[np.int8]


def _panels(
    dataset: xarray.Dataset, quantity: str, poses: list[str], words: Mapping[int, str]
) -> Iterator[_Panel]:
    """Build a panel for each combination of the dimensions that do not belong to the postures."""
    status = dataset["status"]
    allowed = {*map(str, status.dims), "direction"}
    dims = [str(dim) for dim in dataset[quantity].dims]
    if not set(dims) <= allowed or set(poses) - set(dims):
        raise InvalidInput(
            "quantity",
            f"{quantity} has the dimensions {', '.join(dims)}; a map shows one number per entry, "
            "such as softest, stiffest, anisotropy, margin or along.",
        )
    cases = [dim for dim in dims if dim not in poses]
    sizes = [dataset.sizes[dim] for dim in cases]
    if (count := int(np.prod(sizes))) > _MOST_PANELS:
        listed = ", ".join(f"{dim} ({dataset.sizes[dim]})" for dim in cases)
        raise InvalidInput(
            "dataset",
            f"makes {count} panels, of {listed}; choose up to {_MOST_PANELS}, as in "
            f"dataset.isel({cases[0]}=[0]).",
        )
    # a dimension that the quantity does not have cannot change its status: take index 0
    status = status.isel({dim: 0 for dim in status.dims if dim not in dims}, drop=True)
    codes = status.broadcast_like(dataset[quantity])
    hidden = [] if quantity == "margin" else [v for v, word in words.items() if word == "unstable"]
    for place in np.ndindex(*sizes):
        at = dict(zip(cases, place, strict=True))
        title = ", ".join(_title(dataset, dim, i) for dim, i in at.items())
        values, code = (
            each.isel(at).transpose(*poses).values.ravel() for each in (dataset[quantity], codes)
        )
        yield _Panel(title, np.where(np.isin(code, hidden), np.nan, values), code)


def _title(dataset: xarray.Dataset, dim: str, place: int) -> str:
    value = dataset[dim].values[place]
    if isinstance(value, str):
        return f"{dim} {value}"
    units = dataset[dim].attrs.get("units", "1")
    return f"{dim} {value:g}" + (f" {units}" if units != "1" else "")


def _slab(points: Array, section: tuple[str, float, float]) -> tuple[NDArray[np.bool_], str]:
    """Find the tips inside a section; return their mask and a text about the section."""
    if not isinstance(section, (tuple, list)) or len(section) != 3:
        raise InvalidInput(
            "section", f"{section!r} given; an axis, its place and the half thickness [m] needed."
        )
    axis = AXES.index(one_of("axis", section[0], AXES))
    place, half = scalar("section", section[1]), scalar("section", section[2])
    inside = abs(points[:, axis] - MM * place) <= MM * half
    words = f"{section[0]} = {MM * place:g} ± {MM * half:g} mm"
    return inside, words.replace(" ", "\xa0")  # no line break inside


def _plane(points: Array, section: tuple[str, float, float] | None) -> tuple[int, int] | None:
    """Find the two axes of the section, or of the plane of all tips; None if there is no plane."""
    if section is not None:
        normal = AXES.index(section[0])
    else:
        extent = np.ptp(np.vstack([points, np.zeros(3)]), axis=0)  # the base is at the origin
        normal = int(extent.argmin())
        if extent[normal] > _FLAT * extent.max():
            return None
    first, second = (axis for axis in range(3) if axis != normal)
    return first, second


def _colors(values: Array) -> ScalarMappable:
    """Build the scale of the finite values, up to their 99th percentile if some are infinite."""
    finite = values[np.isfinite(values)] if np.isfinite(values).any() else np.array([0.0, 1.0])
    low = float(finite.min())
    high = float(np.quantile(finite, 0.99 if np.isposinf(values).any() else 1.0))
    scale = Normalize
    if low > 0.0 and high > _WIDE * low:
        scale = LogNorm
    elif low < 0.0 < high:  # a margin: the colour shows its sign first
        low, high = -max(-low, high), max(-low, high)
    name = "coolwarm_r" if low < 0.0 < high else "viridis"
    return ScalarMappable(scale(low, max(high, low + 1e-12 * abs(low))), name)


def _draw(
    axes: Any,
    points: Array,
    panel: _Panel,
    plane: tuple[int, int] | None,
    colors: ScalarMappable,
    words: Mapping[int, str],
) -> None:
    shown = plane or (0, 1, 2)
    known = ~np.isnan(panel.values)
    highest: Any = colors.norm.vmax
    for code in np.unique(panel.status[~known]).tolist():
        mark, color, size = _MARKS.get(words[code], _MARKS["outside_elasticity"])
        marked = points[~known & (panel.status == code)][:, shown]
        axes.scatter(*marked.T, marker=mark, c=color, s=size, linewidths=0.7)
    axes.scatter(
        *points[known][:, shown].T,
        c=np.minimum(panel.values[known], highest + abs(highest)),  # infinities are not drawn
        norm=colors.norm,
        cmap=colors.cmap,
        s=14.0,
        linewidths=0.0,
    )
    axes.scatter(*np.zeros((len(shown), 1)), marker="s", c="0.1", s=28.0)
    for letter, axis in zip(AXES, shown, strict=False):
        getattr(axes, f"set_{letter}label")(f"{AXES[axis]} [mm]", fontsize=8)
    axes.tick_params(labelsize=7)
    if plane:
        axes.locator_params(nbins=TICKS)
        axes.set_aspect("equal", adjustable="datalim")
    else:
        equal_axes(axes)


def _legend(figure: Figure, panels: list[_Panel], words: Mapping[int, str]) -> None:
    """Draw the legend: each marker, and its share of all entries."""
    status = np.concatenate([panel.status[np.isnan(panel.values)] for panel in panels])
    total = sum(panel.status.size for panel in panels)
    handles = [Line2D([], [], marker="s", color="0.1", linestyle="", label="base")]
    for value, count in zip(*np.unique(status, return_counts=True), strict=True):
        word = words[int(value)]
        mark, color, _ = _MARKS.get(word, _MARKS["outside_elasticity"])
        label = f"{word.replace('_', ' ')}: {100.0 * count / total:.3g} %"
        handles.append(Line2D([], [], marker=mark, color=color, linestyle="", label=label))
    figure.legend(handles=handles, loc="outside lower center", ncols=5, fontsize=8)
