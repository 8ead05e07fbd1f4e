"""Check all inputs: native float64, right shape, finite, of a plausible size."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import field, fields
from typing import Any, Final, Literal, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import InvalidInput, unknown
from cdsm.support.values import Array, frozen

_Kind = TypeVar("_Kind")

LARGEST = 1e15
SMALLEST = 1e-12
"""Ends of the magnitudes of a number whose quantity is not in :data:`RANGES`."""


class Range(NamedTuple):
    """Range of the nonzero magnitudes of a quantity in real machines, in an SI unit."""

    unit: str
    low: float
    high: float


RANGES: Final = {
    "bending stiffness": Range("N m²", 1e-9, 1e9),
    "diameter": Range("m", 1e-6, 0.5),
    "force": Range("N", 1e-9, 1e9),
    "friction": Range("", 1e-6, 2.0),
    "gain": Range("", 1e-2, 1e2),
    "gravity": Range("m/s²", 1e-6, 1e3),
    "length": Range("m", 1e-6, 1e4),
    "mass": Range("kg", 1e-9, 1e6),
    "rigidity": Range("N", 1e-6, 1e12),
    "slack": Range("m", SMALLEST, 10.0),
    "spring": Range("N m/rad", 1e-9, 1e12),
    "stiffness": Range("N/m", 1e-6, 1e12),
    "tension": Range("N", 1e-9, 1e9),
    "time": Range("s", 1e-9, 1e9),
    "wrap": Range("rad", 1e-6, 4.0 * math.pi),
    "wrench": Range("N, N m", 1e-9, 1e9),
}
"""Range of each quantity: generous, from a hair of rubber to the cables of a bridge.

No machine has a friction coefficient above 2 or a wrap of more than two turns. No arm has a cable
half a metre thick: such a diameter was meant in millimetres.
"""

WRENCH: Final = "force [N], then moment [N m], base axes"
NO_WRENCH: Final = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def within(quantity: str, value: float, *, zero: bool = False, infinite: bool = False) -> str:
    """Return a message if ``value`` is outside ``RANGES[quantity]``, else an empty text.

    ``zero`` and ``infinite`` also allow 0 and inf.
    """
    unit, low, high = RANGES[quantity]
    if low <= value <= high or (zero and value == 0.0) or (infinite and value == math.inf):
        return ""
    if quantity == "tension" and value < 0.0:
        return f"{value:g} N given; cables only pull"
    words = [*["0"] * zero, f"{low:g} to {high:g} {unit}".rstrip(), *["inf"] * infinite]
    return f"{f'{value:g} {unit}'.rstrip()} given; {', or '.join(words)} is needed"


def checked_quantity(
    name: str, value: object, kind: str, *, zero: bool = False, infinite: bool = False
) -> float:
    """Return a number of the range ``kind``, or InvalidInput; options as :func:`within`."""
    if infinite and isinstance(value, float) and value == math.inf:
        return value
    number = scalar(name, value)
    if problem := within(kind, number, zero=zero, infinite=infinite):
        raise InvalidInput(name, f"{problem}.")
    return number


def number(kind: str, default: float, *, zero: bool = False, infinite: bool = False) -> Any:
    """Declare a number of a dataclass that :func:`check_numbers` checks against its range."""
    return field(default=default, metadata={"range": (kind, zero, infinite)})


def check_numbers(value: object) -> None:
    """Check all fields of a frozen dataclass that :func:`number` declares; InvalidInput."""
    for attribute in fields(value):  # type: ignore[arg-type]
        name = attribute.name
        if "range" in attribute.metadata:
            kind, zero, infinite = attribute.metadata["range"]
            size = checked_quantity(name, getattr(value, name), kind, zero=zero, infinite=infinite)
            value.__dict__[name] = size


def number_array(name: str, value: ArrayLike, kind: str | None = None) -> Array:
    """Return a new native float64 array of finite numbers, or raise :class:`InvalidInput`.

    ``kind`` is a key of :data:`RANGES`. Only the upper end of this range is checked, since small
    magnitudes may be rounding.
    """
    array = _native(name, value)
    unit, _, largest = ("", 0.0, LARGEST) if kind is None else RANGES[kind]
    if not (array.min(initial=0.0) >= -largest and array.max(initial=0.0) <= largest):
        unusable = ~(abs(array) <= largest)
        allowed = f"finite numbers up to {f'{largest:g} {unit}'.rstrip()} are allowed"
        raise InvalidInput(name, f"{_first_of(array, unusable)}; {allowed}.")
    return array


def _first_of(array: Array, chosen: NDArray[np.bool_]) -> str:
    """Return index and value of the first entry where ``chosen`` is True: ``entry [0, 2] is 5``."""
    at = tuple(np.argwhere(chosen)[0].tolist())
    where = f"entry [{', '.join(map(str, at))}] is " if at else ""
    return f"{where}{array[at]:g}"


def instance(name: str, value: _Kind, kind: type[_Kind]) -> _Kind:
    """Return the value if it is an instance of ``kind``, else raise :class:`InvalidInput`."""
    if not isinstance(value, kind):
        raise InvalidInput(name, f"{value!r} given; a {kind.__name__} is needed.")
    return value


def sequence_of(name: str, value: Iterable[_Kind], kind: type[_Kind]) -> tuple[_Kind, ...]:
    """Return a list or tuple of ``kind`` as a tuple; else raise :class:`InvalidInput`."""
    if not isinstance(value, (list, tuple)) or not all(isinstance(entry, kind) for entry in value):
        raise InvalidInput(name, f"{value!r} given; a list or tuple of {kind.__name__} is needed.")
    return tuple(value)


def vector(name: str, value: ArrayLike, size: int, meaning: str, kind: str | None = None) -> Array:
    """Return a new, read-only, finite vector (size,), or raise :class:`InvalidInput`.

    ``meaning`` says in the message what the vector is; ``kind`` is as for :func:`number_array`.
    """
    array = number_array(name, value, kind)
    if array.shape != (size,):
        raise InvalidInput(name, f"shape {array.shape} given, ({size},) needed: {meaning}.")
    return frozen(array)


def bound(name: str, value: ArrayLike, size: int, rows: int | None = None) -> Array:
    """Check bounds of tension [N], a number or (size,), and return them as (size,), read-only.

    ±inf is allowed. If ``rows`` is given, an array (rows, size) is also allowed and keeps its
    shape. Raises InvalidInput.
    """
    array = _native(name, value)
    (_, least, most) = RANGES["tension"]
    if array.ndim == 0:
        array = array.repeat(size)
    if array.shape not in ((size,), (rows, size)):
        wanted = f"({size},)" if rows is None else f"({size},) or ({rows}, {size})"
        raise InvalidInput(
            name, f"shape {array.shape} given; give one number, or {wanted}: one per cable [N]."
        )
    big = abs(array)
    usable = ((big <= most) & (big >= least)) | (big == 0.0) | np.isinf(big)
    if not usable.all():
        wanted = f"newtons from {least:g} to {most:g}, 0 or inf"
        raise InvalidInput(name, f"{_first_of(array, ~usable)}; give {wanted}.")
    return frozen(array)


def interval(name: str, value: ArrayLike, unit: str) -> tuple[float, float]:
    """Return two ends (low, high), low below high, or raise InvalidInput; ±inf is allowed."""
    pair = _native(name, value)
    if pair.shape != (2,) or not pair[0] < pair[1]:
        raise InvalidInput(name, f"{value!r} given; give (low, high) in {unit}, low below high.")
    return float(pair[0]), float(pair[1])


def wrench_vector(name: str, value: ArrayLike) -> Array:
    """Check a wrench: force [N], then moment [N m]. Return it as a read-only vector (6,)."""
    items = value if isinstance(value, (list, tuple)) else [value]
    if any(isinstance(item, Mapping) or hasattr(item, "link") for item in items):
        problem = "has loads on links, which are not known here; give one wrench (6,) at the tip."
        raise InvalidInput(name, problem)
    return vector(name, value, 6, WRENCH, "wrench")


def scalar(name: str, value: object) -> float:
    """Check one finite number; return it as a float."""
    array = number_array(name, value)  # type: ignore[arg-type]
    if array.ndim != 0:
        raise InvalidInput(name, f"shape {array.shape} given; one number is needed.")
    return float(array)


def fraction(name: str, value: object) -> float:
    """Return a number between 0 and 1, the ends excluded; raise InvalidInput for any other."""
    number = scalar(name, value)
    if not 0.0 < number < 1.0:
        raise InvalidInput(name, f"{number:g} given; a number between 0 and 1 is needed.")
    return number


def positive(name: str, value: object, unit: str = "") -> float:
    """Return a positive number [``unit``]; raise InvalidInput for any other value."""
    number = scalar(name, value)
    if number < SMALLEST:
        raise InvalidInput(name, f"{f'{number:g} {unit}'.rstrip()} given; it must be positive.")
    return number


def not_negative(name: str, value: object, unit: str = "") -> float:
    """Return a number [``unit``] from 0 on; raise InvalidInput for any other value."""
    number = scalar(name, value)
    if number < 0.0:
        raise InvalidInput(name, f"{f'{number:g} {unit}'.rstrip()} given; it cannot be negative.")
    return number


def flag(name: str, value: object) -> bool:
    """Return the value if it is True or False, else raise :class:`InvalidInput`."""
    if not isinstance(value, (bool, np.bool_)):
        raise InvalidInput(name, f"{value!r} given; True or False is needed.")
    return bool(value)


def whole_number(name: str, value: object, least: int, most: int | None = None) -> int:
    """Return a whole number from ``least`` to ``most``, or raise :class:`InvalidInput`."""
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or value < least or (most is not None and value > most):  # type: ignore[operator]
        to = "on" if most is None else f"to {most}"
        raise InvalidInput(name, f"{value!r} given; a whole number from {least} {to} is needed.")
    return int(value)  # type: ignore[call-overload, no-any-return]


def text(name: str, value: object) -> str:
    """Return ``value`` if it is a text that is not blank; else raise :class:`InvalidInput`."""
    if not isinstance(value, str) or not value.strip():
        raise InvalidInput(name, f"{value!r} given; a name is needed, a text that is not blank.")
    return value


def one_of(kind: str, name: object, known: Iterable[str], remedy: str = "") -> str:
    """Return ``name`` if it is a known name of a ``kind``, e.g. a link; else raise InvalidInput."""
    known = tuple(known)
    if not isinstance(name, str) or name not in known:
        raise unknown(kind, name, known, remedy)
    return name


def _native(name: str, value: ArrayLike) -> Array:
    """Copy ``value`` to a new array of native float64, or raise :class:`InvalidInput`."""
    if isinstance(value, Mapping):
        raise InvalidInput(
            name, f"a {type(value).__name__} given; give its numbers alone, in order, as an array."
        )
    if isinstance(value, np.ma.MaskedArray):
        raise InvalidInput(name, "has a mask; fill or leave out its masked entries first.")
    try:
        array = np.asarray(value)
    except (TypeError, ValueError) as error:  # rows of different lengths
        raise InvalidInput(name, f"is not an array of numbers ({error}).") from None
    if array.dtype.kind not in "iuf":
        such = "".join(f", such as {entry!r:.60}" for entry in array.ravel()[:1].tolist())
        raise InvalidInput(name, f"holds {array.dtype} entries{such}; real numbers are needed.")
    return np.array(array, dtype=np.float64, order="C")


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
    components = axis_vector(name, value) if isinstance(value, str) else value
    array = vector(name, components, 3, "a direction in base axes")
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
    components = 9.81 * np.array(axis_vector(name, value)) if isinstance(value, str) else value
    return vector(
        name, components, 3, "gravity in base axes [m/s²], or an axis such as -z", "gravity"
    )


def unit_directions(name: str, value: Direction | Iterable[Direction]) -> Array:
    """Return the read-only unit vector (3,) of one direction, or (n, 3) of n directions."""
    rows: Any = value
    if isinstance(rows, str):
        return unit_direction(name, rows)
    if not (isinstance(rows, (list, tuple)) and any(isinstance(row, str) for row in rows)):
        rows = number_array(name, rows)
        if rows.ndim < 2:
            return unit_direction(name, rows)
        if rows.ndim > 2 or rows.shape[1] != 3 or not len(rows):
            raise InvalidInput(name, f"shape {rows.shape} given, (3,) or (n, 3) needed.")
    return frozen(np.array([unit_direction(f"{name}[{i}]", row) for i, row in enumerate(rows)]))


# a longer arm, a larger hole radius or disk offset than this [m] was probably given in millimetres
LONGEST = 30.0
WIDEST = 1.0


def doubts_about_units(length: float, sizes: Iterable[tuple[str, float, float]] = ()) -> list[str]:
    """Return a warning text if lengths [m] look as if they are not in metres, else an empty list.

    ``length`` is that of the arm; ``sizes`` are names, values and their largest plausible values.
    """
    if 0.0 < length < 1e-3:
        unit = "another unit; give them in metres, or in mm as options of the command line."
        return [f"the arm is {length:.4g} m long: it looks as if lengths are in {unit}"]
    every = [("the arm", length, LONGEST), *sizes]
    large = ", ".join(f"{what} is {size:.4g} m" for what, size, most in every if size > most)
    return [f"{large}: it looks as if lengths are in mm; give them in metres."] if large else []


def doubts_about_angle(what: str, angle: float, most: float) -> list[str]:
    """Return a warning text if ``angle`` [rad] is larger than any plausible one, ``most`` [rad]."""
    doubt = f"{what} {angle:g} rad: it looks as if it is in degrees; give rad."
    return [doubt] if abs(angle) > most else []
