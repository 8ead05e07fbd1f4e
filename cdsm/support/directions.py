"""Check directions in base axes, given as an axis such as ``"-y"`` or as a vector."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final, Literal

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
    given = axis_vector(name, value) if isinstance(value, str) else value
    array = vector(name, given, 3, "a direction in base axes")
    length = float(np.linalg.norm(array))
    if length == 0.0:
        raise InvalidInput(name, "is the zero vector; give a direction, such as (0, 0, 1).")
    return frozen(array / length)


def axis_vector(name: str, axis: str) -> tuple[float, float, float]:
    """Return the unit vector of an axis of :data:`AXES`, or raise :class:`InvalidInput`."""
    if axis not in AXES:
        raise InvalidInput(name, f"{axis!r} given; give {', '.join(AXES)} or three numbers.")
    return AXES[axis]


def gravity_vector(name: str, value: Direction) -> Array:
    """Return gravity (3,) [m/s²], read-only, from a vector or an axis (9.81 m/s² along it)."""
    given = 9.81 * np.array(axis_vector(name, value)) if isinstance(value, str) else value
    return vector(name, given, 3, "gravity in base axes [m/s²]", "gravity")


def unit_directions(name: str, value: Direction | Iterable[Direction]) -> Array:
    """Return the read-only unit vector (3,) of one direction, or (n, 3) of n directions."""
    rows: Any = value
    if isinstance(rows, str):
        return unit_direction(name, rows)
    if not (isinstance(rows, (list, tuple)) and any(isinstance(each, str) for each in rows)):
        rows = number_array(name, rows)
        if rows.ndim < 2:
            return unit_direction(name, rows)
        if rows.ndim > 2 or rows.shape[1] != 3 or not len(rows):
            raise InvalidInput(name, f"shape {rows.shape} given, (3,) or (n, 3) needed.")
    return frozen(np.array([unit_direction(f"{name}[{i}]", each) for i, each in enumerate(rows)]))
