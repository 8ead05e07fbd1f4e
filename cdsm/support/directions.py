"""Check directions in base axes, given as an axis such as ``"-y"`` or as a vector."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.support.validation import number_array, vector
from cdsm.support.values import Array, frozen

Axis = Literal["x", "y", "z", "-x", "-y", "-z"]

Direction = Axis | ArrayLike
"""Direction in base axes: the name of an axis, or three numbers (3,) of any length."""

AXES: Final[dict[str, tuple[float, float, float]]] = {
    "x": (1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-x": (-1.0, 0.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "-z": (0.0, 0.0, -1.0),
}
"""Directions that have a name, in base axes."""

XYZ: Final = ("x", "y", "z")
"""Names of the base axes."""


def unit_direction(name: str, value: Direction) -> Array:
    """Return the read-only unit vector (3,) along an axis or a vector that is not zero."""
    if isinstance(value, str):
        return frozen(np.array(axis_vector(name, value)))
    array = vector(name, value, 3, "a direction in base axes")
    largest = max(map(abs, array.tolist()))
    if largest == 0.0:
        raise InvalidInput(name, "is the zero vector; give a direction, such as (0, 0, 1).")
    scaled = array / largest  # so that the norm neither overflows nor underflows
    return frozen(scaled / math.sqrt(np.vdot(scaled, scaled)))


def axis_vector(name: str, axis: str) -> tuple[float, float, float]:
    """Return the unit vector of an axis of :data:`AXES`, or raise :class:`InvalidInput`."""
    if axis not in AXES:
        raise InvalidInput(name, f"{axis!r} given; give {', '.join(AXES)} or three numbers.")
    return AXES[axis]


def gravity_vector(name: str, value: Direction) -> Array:
    """Return gravity (3,) [m/s²], read-only, from a vector or an axis (9.81 m/s² along it)."""
    if isinstance(value, str):
        return frozen(9.81 * np.array(axis_vector(name, value)))
    return vector(name, value, 3, "gravity in base axes [m/s²]", "gravity")


def unit_directions(name: str, value: Direction | Iterable[Direction]) -> Array:
    """Return the read-only unit vector (3,) of one direction, or (n, 3) of n directions."""
    if isinstance(value, str):
        return unit_direction(name, value)
    if isinstance(value, (list, tuple)) and any(isinstance(each, str) for each in value):
        return frozen(np.array([unit_direction(f"{name}[{i}]", u) for i, u in enumerate(value)]))
    given = number_array(name, value)  # type: ignore[arg-type]
    if given.ndim < 2:
        return unit_direction(name, given)
    if given.ndim > 2 or given.shape[1] != 3 or not len(given):
        raise InvalidInput(name, f"shape {given.shape} given, (3,) or (n, 3) needed.")
    return frozen(np.array([unit_direction(f"{name}[{i}]", u) for i, u in enumerate(given)]))
