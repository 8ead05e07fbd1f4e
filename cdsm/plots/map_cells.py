"""Cells of maps: values of a sweep over joints or tips, and why some cells have none."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InvalidInput
from cdsm.plots import style
from cdsm.plots.style import MM
from cdsm.quantities import display_of, si_of
from cdsm.status import Status
from cdsm.support.status import status_names
from cdsm.support.validation import XYZ, one_of, scalar
from cdsm.support.values import Array

if TYPE_CHECKING:
    import xarray


Statistic = Literal["median", "min", "max"]
_MOST_PANELS = 9
_POSTURES = 8  # per cell of a slice, from which the size of its cells follows
_CELLS = (6, 40)  # least and largest number of cells along the longest side of a slice
_FLAT = 1e-9  # tips are in a plane if an extent is below this part of the largest
_SLICE = 0.04  # half thickness of the slices of a cloud of tips, divided by its extent
HUGE = 1e300
_EDGE = 1e-6  # of a cell, so that tips at the last edge are inside
FAULTS: Final = {
    Status.UNSTABLE: ("unstable", style.UNHELD, "//////", style.VERMILLION),
    Status.INFEASIBLE: ("no balance", "0.94", "......", "0.55"),
    Status.OUTSIDE_ELASTICITY: ("beyond the wire", "#e6eef6", "xxxxxx", style.SKY),
    Status.OUT_OF_REACH: ("out of reach", "0.97", "", "0.97"),
}
"""Words, colour, hatch and its colour of cells without a value, by the status of their entries."""
OTHER: Final = ("no value", "0.9", "\\\\\\\\", "0.6")


class Cells(NamedTuple):
    """A panel of a map: edges of its cells, a value in each, and why some have none."""

    title: str
    x: Array  # edges (m + 1,)
    y: Array  # edges (n + 1,)
    values: Array  # (n, m), NaN where none is
    faults: dict[str, NDArray[np.bool_]]  # where no value is (n, m), by words
    labels: tuple[str, str]  # of the two axes
    scale: str  # panels of one scale share their colours
    heading: str = ""  # in words, how many postures are inside


def quantity_of(
    dataset: xarray.Dataset, quantity: str
) -> tuple[xarray.DataArray, list[str], list[str]]:
    """Return the quantity of a sweep, the dimensions of its postures, and those of its cases."""
    remedy = "the quantity must be among outputs of the sweep."
    one_of("quantity", quantity, [str(variable) for variable in dataset.data_vars], remedy)
    value = dataset[quantity]
    dims = [str(dim) for dim in value.dims]
    poses = [str(dim) for dim in dataset["status"].dims if dim not in ("wrench", "minimum")]
    allowed = {*map(str, dataset["status"].dims), "direction"}
    if quantity == "status" or not {*poses} <= {*dims} <= allowed:
        raise InvalidInput(
            "quantity",
            f"{quantity} has the dimensions {', '.join(dims)}; a map shows one number per entry, "
            "such as softest, stiffest, isotropy, margin or along.",
        )
    cases = [dim for dim in dims if dim not in poses]
    count = math.prod(dataset.sizes[dim] for dim in cases)
    if count > _MOST_PANELS:
        listed = ", ".join(f"{dim} ({dataset.sizes[dim]})" for dim in cases)
        raise InvalidInput(
            "dataset",
            f"makes {count} panels, of {listed}; choose up to {_MOST_PANELS}, as in "
            f"dataset.isel({cases[0]}=[0]).",
        )
    return value, poses, cases


def is_grid(dataset: xarray.Dataset, poses: list[str]) -> bool:
    """Whether postures are a grid of two evenly numbered coordinates."""
    return len(poses) == 2 and all(
        dim in dataset.coords and dataset.sizes[dim] > 1 and dataset[dim].dtype.kind == "f"
        for dim in poses
    )


def is_line(dataset: xarray.Dataset, dim: str) -> bool:
    """Return whether postures are one behind the other, along a path or one joint."""
    return "distance" in dataset.coords or (dim != "pose" and dataset.sizes[dim] > 1)


def entries_of(
    dataset: xarray.Dataset, value: xarray.DataArray, poses: list[str], cases: list[str]
) -> tuple[list[dict[str, str]], Array, NDArray[np.int_]]:
    """Return words of each case, values (cases, …poses) for people, and statuses of that shape."""
    names: list[dict[str, str]] = []
    labels = [[(dim, _name(x)) for x in dataset[dim]] for dim in cases]
    for case in itertools.product(*labels):
        names.append(dict(case))
    status = dataset["status"]
    # a dimension that the quantity does not have cannot change its status: take index 0
    dims = [*map(str, value.dims)]
    status = status.isel({dim: 0 for dim in status.dims if dim not in dims}, drop=True)
    status = status.broadcast_like(value)
    shape = (len(names), *(dataset.sizes[dim] for dim in poses))
    x, code = (a.transpose(*cases, *poses).values.reshape(shape) for a in (value, status))
    _, size = display_of(si_of(value.units))
    x = x / size
    words = status_names(dataset)
    codes = {word: k for k, word in words.items()}
    if value.name != "margin":
        x = np.where(code == codes[Status.UNSTABLE.word], np.nan, x)
    numbers = {k: Status[word.upper()] for k, word in words.items()}
    return names, x, np.vectorize(lambda k: int(numbers[int(k)]))(code)


def _name(coordinate: xarray.DataArray) -> str:
    """Write a coordinate of a case: ``minimum 20 N``, ``along z``."""
    value = coordinate.item()
    unit = coordinate.attrs.get("units", "1")
    text = value if isinstance(value, str) else f"{value:g}"
    words = {"direction": "along", "minimum": "tensions from"}.get(
        str(coordinate.name), str(coordinate.name)
    )
    return f"{words} {text}{'' if unit == '1' else f' {unit}'}"


def _faults_of(values: Array, status: NDArray[np.int_]) -> dict[str, NDArray[np.bool_]]:
    """Return where no value is, by the words for its status."""
    missing = np.isnan(values)
    faults: dict[str, NDArray[np.bool_]] = {}
    for code in np.unique(status[missing]).tolist():
        words = FAULTS.get(Status(code), OTHER)[0]
        mask = missing & (status == code)
        faults[words] = mask | faults[words] if words in faults else mask
    return faults


def grid_cells(
    dataset: xarray.Dataset, value: xarray.DataArray, poses: list[str], cases: list[str]
) -> Iterator[Cells]:
    """Yield the cells of a grid over two joints, or of tips in a plane."""
    names, x, status = entries_of(dataset, value, poses, cases)
    first, second = (_axis(dataset, dim) for dim in poses)
    for case, values, code in zip(names, x, status, strict=True):
        cells = values.T
        yield Cells(
            ", ".join(case.values()), first[1], second[1], cells, _faults_of(cells, code.T),
            (first[0], second[0]), case.get("direction", ""),
        )  # fmt: skip


def unit_of_axis(coordinate: xarray.DataArray) -> tuple[str, float]:
    """Return the unit in which people read a coordinate of an axis, and its size in SI."""
    units = {"rad": ("°", math.pi / 180.0), "m": ("mm", 1e-3)}
    return units.get(coordinate.attrs.get("units", "1"), ("-", 1.0))


def _axis(dataset: xarray.Dataset, dim: str) -> tuple[str, Array]:
    """Return the label of a coordinate of cells, and the edges of its cells."""
    coordinate = dataset[dim]
    unit, size = unit_of_axis(coordinate)
    middle = coordinate.values / size
    step = np.diff(middle)
    edges = np.concatenate(
        [[middle[0] - step[0] / 2], middle[:-1] + step / 2, [middle[-1] + step[-1] / 2]]
    )
    name = dim.removeprefix("tip_") if "plane" in dataset.coords else dim
    return f"{name} [{unit}]", edges


def tip_cells(
    dataset: xarray.Dataset,
    value: xarray.DataArray,
    poses: list[str],
    cases: list[str],
    section: Any,
    statistic: Statistic,
) -> Iterator[Cells]:
    """Yield the cells of tips in a plane, in a section, or of a cloud in three slices."""
    names, x, status = entries_of(dataset, value, poses, cases)
    tips = MM * dataset["tip_position"].transpose(*poses, "axis").values.reshape(-1, 3)
    known = np.isfinite(tips).all(axis=1)
    tips = tips[known]
    x = x.reshape(len(names), -1)[:, known]
    status = status.reshape(len(names), -1)[:, known]
    views = list(_views(tips, section))
    if not any(inside.any() for _, _, inside in views):
        problem = "has no tip to show; widen the section, or sweep over other postures."
        raise InvalidInput("section" if section is not None else "dataset", problem)
    for case, values, code in zip(names, x, status, strict=True):
        for view, normal, inside in views:
            plane = [axis for axis in range(3) if axis != normal]
            points = tips[inside][:, plane]
            edges = _edges(points)
            cells = bin_values(points, values[inside], edges, statistic)
            faults = _binned_faults(points, values[inside], code[inside], edges, cells)
            holds = int(np.isfinite(values[inside]).sum())
            heading = f"{holds} of {inside.sum()} postures hold"
            labels = (f"{XYZ[plane[0]]} [mm]", f"{XYZ[plane[1]]} [mm]")
            title = ", ".join(filter(None, (*case.values(), view)))
            shared = case.get("direction", "")
            yield Cells(title, *edges, cells, faults, labels, shared, heading)


def _views(points: Array, section: Any) -> Iterator[tuple[str, int, NDArray[np.bool_]]]:
    """Yield the view of a section or of the plane of all tips, or else three slices."""

    def slab(axis: int, middle: float, half: float) -> tuple[str, int, NDArray[np.bool_]]:
        title = f"{XYZ[axis]} = {round(middle, 1) + 0.0:.3g} ± {half:.2g} mm"
        inside = abs(points[:, axis] - middle) <= half
        return title.replace(" ", "\xa0"), axis, inside  # no line break

    every = np.full(len(points), True)
    extent = np.ptp(np.vstack([points, np.zeros(3)]), axis=0)
    flat = np.ptp(points, axis=0) <= _FLAT * extent.max() if len(points) else np.zeros(3, bool)
    if section is not None:
        if not isinstance(section, (tuple, list)) or len(section) != 3:
            problem = f"{section!r} given; an axis, its place and the half thickness [m] needed."
            raise InvalidInput("section", problem)
        axis = XYZ.index(one_of("axis", section[0], XYZ))
        yield slab(axis, *(MM * scalar("section", number) for number in section[1:]))
    elif flat.any():
        axis = int(np.where(flat, extent, np.inf).argmin())
        off = extent[axis] > _FLAT * extent.max()  # from the base, which is at the origin
        title = f"{XYZ[axis]} = {points[0, axis]:.3g} mm".replace(" ", "\xa0")
        yield title if off else "", axis, every
    else:
        for axis in (1, 2, 0):
            middle = float(np.median(points[:, axis])) if len(points) else 0.0
            half = _SLICE * float(np.ptp(points[:, axis])) if len(points) else 0.0
            yield slab(axis, middle, half)


def _edges(points: Array) -> tuple[Array, Array]:
    """Return edges of square cells around points (N, 2), of a size that follows from N."""
    if not len(points):
        return np.array([0.0, 1.0]), np.array([0.0, 1.0])
    extent = np.ptp(points, axis=0)
    longest = float(extent.max()) or 1.0
    area = float(np.prod(np.maximum(extent, 1e-3 * longest)))
    size = math.sqrt(area * _POSTURES / len(points))
    size = float(np.clip(size, longest / _CELLS[1], longest / _CELLS[0])) * (1.0 + _EDGE)
    count = np.maximum(np.ceil(extent / size - _EDGE), 1.0).astype(int)
    low = points.min(axis=0) + extent / 2.0 - size * count / 2.0
    x, y = (low[i] + size * np.arange(count[i] + 1) for i in range(2))
    return x, y


def bin_values(
    points: Array,
    values: Array,
    edges: tuple[Array, Array],
    statistic: Statistic | Literal["count"],
) -> Array:
    """Return a statistic (n, m) of values (N,) at points (N, 2) in cells; NaN where there is none.

    Infinite values count as the largest.
    """
    from scipy.stats import binned_statistic_2d  # here, because it imports slowly

    x, y = edges
    known = ~np.isnan(values)
    cells = np.full((len(x) - 1, len(y) - 1), 0.0 if statistic == "count" else np.nan)
    if known.any():
        finite = np.minimum(values[known], HUGE)
        cells = binned_statistic_2d(*points[known].T, finite, statistic, [x, y]).statistic
    return np.asarray(np.where(cells >= HUGE / 2.0, np.inf, cells)).T


def _binned_faults(
    points: Array,
    values: Array,
    status: NDArray[np.int_],
    edges: tuple[Array, Array],
    cells: Array,
) -> dict[str, NDArray[np.bool_]]:
    """Return the cells without a value, each by the words for most of its entries."""
    faults = _faults_of(values, status)
    if not faults:
        return {}
    zeros = np.zeros(len(points))
    counts = np.array(
        [bin_values(points[mask], zeros[mask], edges, "count") for mask in faults.values()]
    )
    empty = np.isnan(cells) & (counts.max(axis=0) > 0)
    most = counts.argmax(axis=0)
    return {words: empty & (most == k) for k, words in enumerate(faults)}
