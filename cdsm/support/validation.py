"""Checks at the border: native float64, right shape, finite, and read-only from there on."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import InvalidInput, UnknownName
from cdsm.support.markup import element

if TYPE_CHECKING:
    from collections.abc import Iterable

Array = NDArray[np.float64]

_Kind = TypeVar("_Kind")
_AnyArray = TypeVar("_AnyArray", bound=NDArray[Any])


def frozen(array: _AnyArray) -> _AnyArray:
    """Return the array itself, made read-only."""
    array.setflags(write=False)
    return array


class Printed:
    """For what prints itself as a table: a notebook shows that, in columns that stay in line."""

    def _repr_html_(self) -> str:
        return str(element("pre", str(self)))


class ReadOnlyState(Printed):
    """For frozen dataclasses of read-only arrays: unpickling and copying keep them read-only."""

    def __getstate__(self) -> dict[str, object]:
        # the fields alone: what is computed from them on first use can be large
        return {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]

    def __setstate__(self, state: dict[str, object]) -> None:
        for value in state.values():
            for array in value if isinstance(value, tuple) else (value,):
                if isinstance(array, np.ndarray):
                    frozen(array)
        self.__dict__.update(state)


LARGEST = 1e15
"""No force, length or rigidity of a real arm comes near this; beyond, products overflow."""


SMALLEST = 1e-12
"""No stiffness or rigidity of a real cable is this small; below, quotients overflow."""


_LEAST = 1e-100
"""No bound of a tension is this small, unless it is zero; below, products vanish."""


def number_array(name: str, value: ArrayLike) -> Array:
    """Return a fresh native float64 array of finite numbers, or raise :class:`InvalidInput`."""
    array = _native(name, value)
    # where the sum of squares is small enough, so is each; four times as fast as to look at each
    if np.vdot(array, array) <= LARGEST:  # false for NaN too
        return array
    usable = abs(array) <= LARGEST
    if np.count_nonzero(usable) < array.size:
        bad = np.argwhere(~usable)[0]
        where = f"entry [{', '.join(map(str, bad))}] is " if array.ndim else ""
        raise InvalidInput(
            name, f"{where}{array[tuple(bad)]:g}; finite numbers up to {LARGEST:g} are allowed."
        )
    return array


def instance(name: str, value: _Kind, kind: type[_Kind]) -> _Kind:
    """Return the value if it is of the kind, else raise :class:`InvalidInput`."""
    if not isinstance(value, kind):
        raise InvalidInput(name, f"{value!r} given; a {kind.__name__} is needed.")
    return value


def sequence_of(name: str, value: Iterable[_Kind], kind: type[_Kind]) -> tuple[_Kind, ...]:
    """Return the values as a tuple if all are of the kind, else raise :class:`InvalidInput`."""
    entries = tuple(value) if isinstance(value, (list, tuple)) else None
    if entries is None or not all(isinstance(entry, kind) for entry in entries):
        raise InvalidInput(name, f"{value!r} given; a list or tuple of {kind.__name__} is needed.")
    return entries


def vector(name: str, value: ArrayLike, size: int, meaning: str) -> Array:
    """Return a fresh, read-only, finite vector of the given size.

    Args:
        name: The argument's name, for the error.
        value: What the user gave.
        size: Required number of entries.
        meaning: What the entries are ("one angle [rad] per joint"), for the error.

    Raises:
        InvalidInput: Not numbers, masked, not finite, or not of shape (size,).
    """
    array = number_array(name, value)
    if array.shape != (size,):
        raise InvalidInput(name, f"shape {array.shape} given, ({size},) needed: {meaning}.")
    array.setflags(write=False)
    return array


def bound(name: str, value: ArrayLike, size: int, rows: int | None = None) -> Array:
    """Return a read-only vector (size,) from a scalar or a vector that may hold ±inf.

    With ``rows`` it may be an array (rows, size) too, and is returned as such.
    """
    # a float for all is the usual case, and a hot one
    array: Array = np.full(size, value) if isinstance(value, float) else _native(name, value)
    if array.ndim == 0:
        array = array.repeat(size)
    if array.shape != (size,) and (rows is None or array.shape != (rows, size)):
        wanted = f"({size},)" if rows is None else f"({size},) or ({rows}, {size})"
        raise InvalidInput(
            name, f"shape {array.shape} given; give one number, or {wanted}: one per cable [N]."
        )
    force = abs(array)
    usable = ((force <= LARGEST) & (force >= _LEAST)) | (force == 0.0) | np.isinf(force)
    if np.count_nonzero(usable) < array.size:
        bad = np.argwhere(~usable)[0]
        raise InvalidInput(
            name,
            f"entry [{', '.join(map(str, bad))}] is {array[tuple(bad)]:g}; give newtons from "
            f"{_LEAST:g} to {LARGEST:g}, 0 or inf.",
        )
    return frozen(array)


def scalar(name: str, value: object) -> float:
    """Return one finite float."""
    array = number_array(name, value)  # type: ignore[arg-type]
    if array.ndim != 0:
        raise InvalidInput(name, f"shape {array.shape} given; one number is needed.")
    return float(array)


def unit_direction(name: str, value: ArrayLike) -> Array:
    """Return a read-only unit vector (3,) along the one given."""
    array = vector(name, value, 3, "a direction in base axes")
    largest = float(abs(array).max())
    if largest == 0.0:
        raise InvalidInput(name, "is the zero vector; give a direction, such as (0, 0, 1).")
    scaled = array / largest  # so that no length over- or underflows
    return frozen(scaled / np.linalg.norm(scaled))


def flag(name: str, value: object) -> bool:
    """Return True or False, or raise :class:`InvalidInput`: many an object is neither."""
    if not isinstance(value, (bool, np.bool_)):
        raise InvalidInput(name, f"{value!r} given; True or False is needed.")
    return bool(value)


def whole_number(name: str, value: object, least: int, most: int | None = None) -> int:
    """Return a whole number within its bounds, or raise :class:`InvalidInput`."""
    if (
        isinstance(value, bool)
        or not isinstance(value, (int, np.integer))
        or value < least
        or (most is not None and value > most)
    ):
        to = "on" if most is None else f"to {most}"
        raise InvalidInput(name, f"{value!r} given; a whole number from {least} {to} is needed.")
    return int(value)


def text(name: str, value: object) -> str:
    """Return a name that every file can hold, or raise :class:`InvalidInput`."""
    if not isinstance(value, str) or not value:
        raise InvalidInput(name, f"{value!r} given; a name is needed, a text that is not empty.")
    try:
        value.encode()
    except UnicodeEncodeError as error:
        raise InvalidInput(
            name, f"{value!r} given; character {error.start + 1} is a lone surrogate, not text."
        ) from None
    return value


def one_of(kind: str, name: object, known: Iterable[str]) -> str:
    """Return the name if it is known, else raise :class:`UnknownName` with near matches."""
    known = tuple(known)
    if not isinstance(name, str) or name not in known:
        raise UnknownName(kind, name, known)
    return name


def _native(name: str, value: ArrayLike) -> Array:
    """A copy in the machine's own byte order: the caller's array may change later."""
    if type(value) is np.ndarray and value.dtype == np.float64:  # the usual case, and a hot one
        copy: Array = value.copy()
        return copy
    if isinstance(value, np.ma.MaskedArray) or (
        isinstance(value, (list, tuple)) and any(entry is np.ma.masked for entry in value)
    ):
        raise InvalidInput(name, "is a masked array; fill or drop the masked entries first.")
    try:
        array = np.asarray(value)
    except Exception as error:  # whatever a foreign __array__ raises
        raise InvalidInput(name, f"is not an array of numbers ({error}).") from None
    if array.dtype.kind not in "iuf":
        raise InvalidInput(name, f"holds {array.dtype} entries; real numbers are needed.")
    if array.dtype == np.float64:
        return np.array(array, order="C")
    with np.errstate(over="ignore"):  # what exceeds float64 becomes inf, which is refused later
        return array.astype(np.float64, order="C")
