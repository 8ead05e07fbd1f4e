"""Plot workspace maps: reachable tip positions, coloured by stiffness, as dots or as cells."""

from __future__ import annotations

import itertools
import textwrap
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, get_args

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from numpy.typing import NDArray

from cdsm.errors import InvalidInput
from cdsm.plots import style
from cdsm.plots.style import MM
from cdsm.quantities import display_of, si_of
from cdsm.support.status import check_sweep, status_names
from cdsm.support.validation import one_of, scalar
from cdsm.support.values import Array

if TYPE_CHECKING:
    import xarray

    View = tuple[str, int, NDArray[np.bool_], bool]  # title, normal axis, tips, whether a slice

Statistic = Literal["median", "min", "max"]

_MOST_PANELS = 9
_CELLS = 40  # along the longest side of a map
_WIDE = 30.0  # the colours are logarithmic if the ratio of largest to smallest value exceeds this
_ROBUST: Final = (2.0, 98.0)  # percentiles at the ends of the colours, as in xarray
_FLAT = 1e-9  # tips are in a plane if an extent is below this part of the largest
_THIN = 0.3  # least ratio of the sides of a map, which leaves room for its labels
_MARGIN = 0.05  # around the tips, over their largest extent
_TALLEST = 2.3  # largest height of a map [inch]
_CHARACTERS = 15.0  # of a label in an inch
_TICK = 0.6  # least space for the label of a tick [inch]
_LABELS = 0.75  # space for the labels beside and below a map [inch]
_BAR = 1.0  # width of the colour bar with its label, height of the title [inch]
_HEADING = 0.6
_HUGE = 1e300
_SLICE = 0.04  # half thickness of the slices of a cloud of tips, divided by its extent

_NONE: Final = {"marker": ".", "c": "0.6", "s": 8.0, "label": "no value"}
_UNSTABLE: Final = {"marker": "x", "c": style.VERMILLION, "s": 14.0, "lw": 0.7, "label": "unstable"}


class Map(NamedTuple):
    """The tips in one panel, with their values and whether the arm is unstable there."""

    title: str
    plane: list[int]  # indices of the two base axes that the panel shows
    points: Array  # tips (N, 2) [mm]
    values: Array  # the quantity (N,), NaN if missing
    unstable: NDArray[np.bool_]  # (N,)
    slice: bool  # whether this is one of the slices of a cloud

    def box(self) -> tuple[Array, Array]:
        """Return the middle and the extent (2,) of the box around the tips [mm]."""
        every = self.points if len(self.points) else np.zeros((1, 2))
        extent = np.ptp(every, axis=0)
        return every.min(axis=0) + extent / 2.0, extent if extent.any() else extent + 1.0

    def limits(self) -> Array:
        """Return the ends of both axes of the panel (2, 2) [mm]."""
        middle, extent = self.box()
        half = extent / 2.0 + _MARGIN * extent.max()
        half = np.maximum(half, _THIN * half.max())
        return np.transpose([middle - half, middle + half])


@style.styled
def plot_map(
    dataset: xarray.Dataset,
    quantity: str = "softest",
    *,
    section: tuple[str, float, float] | None = None,
    statistic: Statistic | None = None,
) -> Figure:
    """Plot the tips of a sweep in mm, coloured by a quantity, with a panel for each case.

    Tips in a plane and tips in a section are drawn as dots, or as cells if a statistic is given. A
    cloud of tips is drawn in three slices through its middle, as cells; a path is drawn as dots, as
    seen along each axis. Several postures may put the tip into one cell; the statistic determines
    the value that the cell shows. An entry (a posture in a case) without the quantity has a cross
    if it is unstable, else a grey dot. Unstable entries are not coloured, except in a map of the
    margin. The colours end at the 2nd and the 98th percentile.

    Args:
        dataset: Result of :func:`~cdsm.sweep` with the output ``tip_position``. Use ``sel`` if it
            has more than 9 panels.
        quantity: Quantity with one number per entry: ``"softest"``, ``"stiffest"``,
            ``"isotropy"``, ``"margin"``; or ``"along"`` (a panel for each direction).
        section: Axis, position and half thickness [m] of a slab. Only tips inside it are shown.
        statistic: ``"median"``, ``"min"`` or ``"max"`` of the postures in a cell; None: dots where
            the tips are in a plane or a section, else the median.

    Raises:
        InvalidInput: ``dataset`` is not a sweep or has too many panels or no such quantity,
            ``quantity`` has more than one number per entry, ``section`` is invalid or contains no
            tip, or the statistic is unknown.
        CdsmError: xarray is not installed.
    """
    check_sweep(dataset)
    remedy = "tip_position and the quantity must be among outputs of the sweep."
    for name in ("tip_position", quantity):
        one_of("quantity", name, [str(variable) for variable in dataset.data_vars], remedy)
    if statistic is not None:
        one_of("statistic", statistic, get_args(Statistic))
    maps = list(_maps(dataset, quantity, section))
    every = np.concatenate([tip_map.values for tip_map in maps])
    if not len(every):
        raise InvalidInput(
            "section" if section is not None else "dataset",
            "has no tip to show; widen the section, or sweep over other postures.",
        )
    if statistic is None and maps[0].slice:
        statistic = "median"
    limits = [tip_map.limits() for tip_map in maps]
    shapes = [float(np.ptp(x) / np.ptp(y)) for x, y in limits]
    figure, grid, size = _panels(shapes)
    colors, extend = _colors(every)
    for axes in grid.ravel()[len(maps) :]:
        axes.set_axis_off()
    for axes, tip_map, (x, y), shape in zip(grid.ravel(), maps, limits, shapes, strict=False):
        _draw(axes, tip_map, colors, statistic)
        axes.set(xlim=x, ylim=y, aspect="equal")
        axes.locator_params("x", nbins=min(5, max(1, int(size * shape / _TICK))), min_n_ticks=1)
        axes.set_title(textwrap.fill(tip_map.title, round(_CHARACTERS * (size * shape + 0.5))))
    name = dataset[quantity].long_name.split(",")[0]
    title = f"{dataset.attrs['title']}, {dataset.attrs['poses']}"
    if np.isfinite(every).any():
        sign = "; below 0: unstable" if quantity == "margin" else ""
        unit, _ = display_of(si_of(dataset[quantity].units))
        label = f"{f'{statistic} of a cell: ' if statistic else ''}{name} [{unit or '-'}]{sign}"
        label = textwrap.fill(label, round(_CHARACTERS * len(grid) * (size + 0.5)))
        look: dict[str, Any] = {"extend": extend, "extendfrac": 0.02, "aspect": 20 * len(grid)}
        bar = figure.colorbar(colors, ax=grid, label=label, **look)
        if isinstance(colors.norm, LogNorm):
            bar.ax.yaxis.set_major_formatter("{x:g}")
            bar.ax.yaxis.set_minor_formatter(NullFormatter())
    else:
        known = "is finite" if np.isinf(every).any() else "exists"
        title += f": {name} {known} at none of these tips"
    style.legend_below(figure, grid, 2)
    return style.titled(figure, title)


def _panels(shapes: list[float]) -> tuple[Figure, Any, float]:
    """Return a figure, its panels, and their height [inch]; ``shapes`` are widths over heights."""
    columns = 2 if len(shapes) == 4 else min(len(shapes), 3)
    rows = -(-len(shapes) // columns)
    shares = [max(shapes[column::columns]) for column in range(columns)]
    width = style.ONE_COLUMN if columns == 1 else style.TWO_COLUMNS
    size = min(_TALLEST, (width - _BAR - _LABELS * columns) / sum(shares))
    height = _HEADING + rows * (size + _LABELS)
    figure, grid = style.panels(width, height, columns, rows, width_ratios=shares)
    figure.set_layout_engine("compressed")  # panels with equal axes stand side by side
    return figure, grid, size


def _maps(dataset: xarray.Dataset, quantity: str, section: Any) -> Iterator[Map]:
    """Yield a map of each view, for each combination of the coordinates besides those of poses."""
    value = dataset[quantity]
    status = dataset["status"]
    tips = MM * dataset["tip_position"].transpose(..., "axis")
    poses = [str(dim) for dim in tips.dims[:-1]]
    dims = [str(dim) for dim in value.dims]
    if quantity == "status" or not {*poses} <= {*dims} <= {*status.dims, "direction"}:
        raise InvalidInput(
            "quantity",
            f"{quantity} has the dimensions {', '.join(dims)}; a map shows one number per entry, "
            "such as softest, stiffest, isotropy, margin or along.",
        )
    cases = [dim for dim in dims if dim not in poses]
    names = list(itertools.product(*([_name(x) for x in dataset[dim]] for dim in cases)))
    if len(names) > _MOST_PANELS:
        listed = ", ".join(f"{dim} ({dataset.sizes[dim]})" for dim in cases)
        raise InvalidInput(
            "dataset",
            f"makes {len(names)} panels, of {listed}; choose up to {_MOST_PANELS}, as in "
            f"dataset.isel({cases[0]}=[0]).",
        )
    # a dimension that the quantity does not have cannot change its status: take index 0
    status = status.isel({dim: 0 for dim in status.dims if dim not in dims}, drop=True)
    points = tips.values.reshape(-1, 3)
    known = np.isfinite(points).all(axis=1)
    points = points[known]
    (x, code) = (
        array.transpose(*cases, *poses).values.reshape(len(names), -1)[:, known]
        for array in (value, status.broadcast_like(value))
    )
    (buckled,) = (code for code, word in status_names(dataset).items() if word == "unstable")
    unstable = code == buckled
    _, size = display_of(si_of(value.units))
    x = x / size
    if quantity != "margin":
        x = np.where(unstable, np.nan, x)
    path = "distance" in dataset.coords and poses == ["pose"]  # a joint may have this name
    views = list(_views(points, section, path))
    for case, values, buckles in zip(names, x, unstable, strict=True):
        for view, normal, seen, cut in views:
            plane = [axis for axis in range(3) if axis != normal]
            title = ", ".join(filter(None, (*case, view)))
            yield Map(title, plane, points[seen][:, plane], values[seen], buckles[seen], cut)


def _name(coordinate: xarray.DataArray) -> str:
    """Write a coordinate of a case: ``minimum 20 N``."""
    value = coordinate.item()
    unit = coordinate.attrs.get("units", "1")
    text = value if isinstance(value, str) else f"{value:g}"
    return f"{coordinate.name} {text}{'' if unit == '1' else f' {unit}'}"


def _views(points: Array, section: Any, path: bool) -> Iterator[View]:
    """Yield the view of a section or of the plane of all tips, or else three slices or views."""

    def slab(axis: int, middle: float, half: float) -> View:
        title = f"{'xyz'[axis]} = {round(middle, 1) + 0.0:.3g} ± {half:.2g} mm"
        inside = abs(points[:, axis] - middle) <= half
        return title.replace(" ", "\xa0"), axis, inside, section is None  # no line break

    every = np.full(len(points), True)
    extent = np.ptp([*points, np.zeros(3)], axis=0)
    flat = np.ptp(points, axis=0) <= _FLAT * extent.max()
    if section is not None:
        if not isinstance(section, (tuple, list)) or len(section) != 3:
            problem = f"{section!r} given; an axis, its place and the half thickness [m] needed."
            raise InvalidInput("section", problem)
        axis = "xyz".index(one_of("axis", section[0], tuple("xyz")))
        yield slab(axis, *(MM * scalar("section", number) for number in section[1:]))
    elif flat.any():
        axis = int(np.where(flat, extent, np.inf).argmin())
        off = extent[axis] > _FLAT * extent.max()  # from the base, which is at the origin
        title = f"{'xyz'[axis]} = {points[0, axis]:.3g} mm".replace(" ", "\xa0")
        yield title if off else "", axis, every, False
    else:
        for axis in (1, 2, 0):
            x = points[:, axis]
            seen = f"seen along {'xyz'[axis]}", axis, every, False
            yield seen if path else slab(axis, float(np.median(x)), _SLICE * float(np.ptp(x)))


def _colors(values: Array) -> tuple[ScalarMappable, str]:
    """Return a colour scale for ``values`` without outliers, and the ends beyond which they are."""
    finite = values[np.isfinite(values)] if np.isfinite(values).any() else np.array([0.0, 1.0])
    low, high = np.percentile(finite, _ROBUST)
    scale = Normalize
    name = style.COLOR_MAP
    if finite.min() < 0.0 < finite.max():  # a margin: colours show its sign, zero is in the middle
        high = max(-low, high)
        name = "PuOr"
        low = -high
    elif low > 0.0 and high > _WIDE * low:
        scale = LogNorm
    if high - low <= _FLAT * abs(high):  # differences are rounding
        low = low - 0.05 * abs(low)
        high = high + 0.05 * abs(high)
    beyond = bool((finite < low).any()), bool((values > high).any())
    extend = {(0, 0): "neither", (1, 0): "min", (0, 1): "max", (1, 1): "both"}[beyond]
    return ScalarMappable(scale(low, high), colormaps[name]), extend


def _draw(axes: Any, shown: Map, colors: ScalarMappable, statistic: Statistic | None) -> None:
    points = shown.points  # inf would not be drawn
    values = np.minimum(shown.values, _HUGE)
    known = ~np.isnan(values)
    look: dict[str, Any] = {"norm": colors.norm, "cmap": colors.cmap}
    for chosen, mark in ((~shown.unstable & ~known, _NONE), (shown.unstable & ~known, _UNSTABLE)):
        if chosen.any():
            axes.scatter(*points[chosen].T, **mark)
    if statistic is None or not known.any():
        axes.scatter(*points[known].T, c=values[known], s=8.0, linewidths=0.0, **look)
    else:
        from scipy.stats import binned_statistic_2d  # here, because it imports slowly

        middle, extent = shown.box()
        size = (1.0 + _FLAT) * extent.max() / _CELLS
        count = np.maximum(np.ceil(extent / size), 1.0)
        ends = np.transpose([middle - size * count / 2.0, middle + size * count / 2.0])
        cells, *edges, _ = binned_statistic_2d(
            *points[known].T, values[known], statistic, count.astype(int), ends
        )
        axes.pcolormesh(*edges, np.ma.masked_invalid(cells.T), zorder=2, **look)
    if look["cmap"].name == "PuOr":  # the middle of the scale is white
        axes.set_facecolor("0.88")
    for letter, axis in zip("xy", shown.plane, strict=True):
        getattr(axes, f"set_{letter}label")(f"{'xyz'[axis]} [mm]")
