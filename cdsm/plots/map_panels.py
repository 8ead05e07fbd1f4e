"""Choose the tips, values and statuses that each panel of a workspace map shows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InvalidInput
from cdsm.plots.style import MM
from cdsm.support.directions import XYZ
from cdsm.support.validation import one_of, scalar
from cdsm.support.values import Array

if TYPE_CHECKING:
    import xarray

_MOST_PANELS = 9

_FLAT = 1e-9
"""The tips are in a plane if one extent of them is below this fraction of the largest extent."""

_SLICE = 0.04  # half thickness of the slices of a cloud of tips, divided by its extent
_THIN = 0.15  # least ratio of the sides of a map
_ROOM = 0.05  # margin around the tips, divided by their largest extent; at least 1 mm


class Slice(NamedTuple):
    """A slab of the workspace: one panel shows the tips in it, seen along the slab's normal."""

    title: str  # title of the panel
    normal: int  # index of the axis normal to the slab
    place: float  # position of the middle of the slab on this axis [mm]
    half: float  # half the thickness of the slab [mm]
    plane: tuple[int, int]  # indices of the two other axes, which the panel shows

    def contains(self, points: Array) -> NDArray[np.bool_]:
        """Return which points (N, 3) [mm] are in the slab."""
        return np.asarray(abs(points[:, self.normal] - self.place) <= self.half)


class Map(NamedTuple):
    """The tips in one panel of a workspace map, with their values and statuses."""

    title: str
    points: Array  # tips (N, 2) [mm]
    values: Array  # plotted quantity at each tip (N,), NaN if missing
    status: NDArray[np.int8]  # status code of each tip (N,)
    plane: tuple[int, int]  # indices of the two base axes that the panel shows
    base: bool  # whether the slab of the panel contains the base

    @property
    def limits(self) -> Array:
        """Limits (2, 2) [mm] of the two axes of the panel: a row (low, high) for each."""
        if not len(self.points):
            return np.array([[-1.0, 1.0], [-1.0, 1.0]])
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        room = max(_ROOM * float((high - low).max()), 1.0)
        wide = np.maximum(high - low, _THIN * (high - low).max())  # a line of tips needs some room
        middle = (low + high) / 2.0
        return np.array([middle - wide / 2.0 - room, middle + wide / 2.0 + room]).T

    @property
    def shows_base(self) -> bool:
        """Whether the panel shows the base: it is in the slab and within the limits."""
        return self.base and bool((self.limits.prod(axis=1) <= 0.0).all())


class Case(NamedTuple):
    """The plotted quantity at all postures, for one case of a sweep: say, one tension bound."""

    title: str
    values: Array  # at each of N postures (N,), NaN if missing
    status: NDArray[np.int8]  # status code of each posture (N,)


def drawable(dataset: xarray.Dataset, poses: list[str]) -> list[str]:
    """Return the names of the quantities in a sweep that have one number per posture and case.

    ``poses`` are the dimensions of the postures; the other dimensions make the cases.
    """
    allowed = {*map(str, dataset["status"].dims), "direction"}
    return [
        str(name)
        for name, values in dataset.data_vars.items()
        if name != "status" and set(poses) <= {*map(str, values.dims)} <= allowed
    ]


def cases_of(
    dataset: xarray.Dataset, quantity: str, poses: list[str], words: Mapping[int, str]
) -> Iterator[Case]:
    """Yield the values of ``quantity`` at all postures, for each case of a sweep.

    ``poses`` are the dimensions of the postures. A case is one combination of the coordinates of
    all other dimensions, for example one lower bound of tension. ``words`` has the word of each
    status code. Values of unstable entries become NaN, except those of the margin.
    """
    status = dataset["status"]
    dims = [str(dim) for dim in dataset[quantity].dims]
    if quantity not in drawable(dataset, poses):
        raise InvalidInput(
            "quantity",
            f"{quantity} has the dimensions {', '.join(dims)}; a map shows one number per entry, "
            "such as softest, stiffest, isotropy, margin or along.",
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
        yield Case(title, np.where(np.isin(code, hidden), np.nan, values), code)


def _title(dataset: xarray.Dataset, dim: str, place: int) -> str:
    value = dataset[dim].values[place]
    if isinstance(value, str):
        return f"{dim} {value}"
    units = dataset[dim].attrs.get("units", "1")
    return f"{dim} {value:g}" + (f" {units}" if units != "1" else "")


def slices_of(
    points: Array, section: tuple[str, float, float] | None, path: bool
) -> tuple[list[Slice], bool]:
    """Return the slab of tips for each panel, and True if they are three slices of a cloud of tips.

    ``points`` (N, 3) [mm] are the tips. ``section`` is an axis, a position [m] and a half thickness
    [m] of a single slab, or None. Tips in a plane get a single panel. Otherwise, if ``path`` is
    True, three panels show all tips, each seen along another axis.
    """
    if section is not None:
        return [_slab(section)], False
    if not len(points):
        return [Slice("", 0, 0.0, np.inf, _others(0))], False
    extent = np.ptp(np.vstack([points, np.zeros(3)]), axis=0)  # the base is at the origin
    normal = int(extent.argmin())
    if extent[normal] <= _FLAT * extent.max():
        return [Slice("", normal, 0.0, np.inf, _others(normal))], False
    if path:
        seen = (1, 2, 0)
        return [Slice(f"seen along {XYZ[i]}", i, 0.0, np.inf, _others(i)) for i in seen], False
    middle = np.median(points, axis=0)
    half = _SLICE * np.ptp(points, axis=0)
    slices = [_slab((XYZ[axis], middle[axis] / MM, half[axis] / MM)) for axis in (1, 2, 0)]
    return slices, True


def _slab(section: tuple[str, float, float]) -> Slice:
    if not isinstance(section, (tuple, list)) or len(section) != 3:
        raise InvalidInput(
            "section", f"{section!r} given; an axis, its place and the half thickness [m] needed."
        )
    axis = XYZ.index(one_of("axis", section[0], XYZ))
    place, half = MM * scalar("section", section[1]), MM * scalar("section", section[2])
    digits = 2 - math.floor(math.log10(half)) if half > 0.0 else 3  # a tenth of the last of half
    title = f"{section[0]} = {round(place, digits) + 0.0:.3g} ± {half:.2g} mm"
    title = title.replace(" ", "\xa0")  # no line break
    return Slice(title, axis, place, half, _others(axis))


def _others(normal: int) -> tuple[int, int]:
    first, second = (axis for axis in range(3) if axis != normal)
    return first, second
