"""Check all inputs: native float64, right shape, finite, of a plausible size.

A quantity outside its range in :data:`RANGES` raises an error here, so other code need not guard
against overflow or denormal numbers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import Final, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import InvalidInput, UnknownName
from cdsm.support.values import Array, frozen

_Kind = TypeVar("_Kind")

LARGEST = 1e15
"""Largest magnitude of a number whose quantity is not in :data:`RANGES`."""

SMALLEST = 1e-12
"""Smallest positive number whose quantity is not in :data:`RANGES`."""


class Range(NamedTuple):
    """Range of the nonzero magnitudes of a quantity in real machines, in an SI unit."""

    unit: str
    low: float
    high: float


RANGES: Final = {
    "diameter": Range("m", 1e-6, 0.5),
    "force": Range("N", 1e-9, 1e9),
    "friction": Range("", 1e-6, 2.0),
    "gravity": Range("m/s²", 1e-6, 1e3),
    "length": Range("m", 1e-6, 1e4),
    "mass": Range("kg", 1e-9, 1e6),
    "rigidity": Range("N", 1e-6, 1e12),
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
_ZERO: Final = frozen(np.zeros(6))


def within(quantity: str, value: float, *, zero: bool = False, infinite: bool = False) -> str:
    """Return a message if ``value`` is outside ``RANGES[quantity]``, else an empty text.

    ``zero`` and ``infinite`` also allow 0 and inf.
    """
    unit, low, high = RANGES[quantity]
    if low <= value <= high or (zero and value == 0.0) or (infinite and value == math.inf):
        return ""
    if quantity == "tension" and value < 0.0:
        return f"{value:g} N given; cables only pull"
    words = [*(["0"] if zero else []), f"{low:g} to {high:g} {unit}".rstrip()]
    words += ["inf"] if infinite else []
    return f"{f'{value:g} {unit}'.rstrip()} given; {', or '.join(words)} is needed"


def quantity(
    name: str, value: object, kind: str, *, zero: bool = False, infinite: bool = False
) -> float:
    """Check a positive number against the range ``kind`` of :data:`RANGES`; return a float.

    ``zero`` and ``infinite`` also allow 0 and inf. Other values raise :class:`InvalidInput`.
    """
    if infinite and isinstance(value, float) and value == math.inf:
        return value
    number = scalar(name, value)
    problem = within(kind, number, zero=zero, infinite=infinite)
    if problem:
        raise InvalidInput(name, f"{problem}.")
    return number


_MANY = 5000  # numbers from which BLAS may use threads of its own, which compete with ours


def number_array(name: str, value: ArrayLike, kind: str | None = None) -> Array:
    """Return a new native float64 array of finite numbers, or raise :class:`InvalidInput`.

    ``kind`` is a key of :data:`RANGES`. Only the upper end of this range is checked, since small
    magnitudes may be rounding.
    """
    array = _native(name, value)
    unit, _, largest = ("", 0.0, LARGEST) if kind is None else RANGES[kind]
    if array.size < _MANY:
        # if the sum of squares is small enough, all entries are; twice as fast as two extremes
        small = np.vdot(array, array) <= largest
    else:
        small = -largest <= array.min() and array.max() <= largest
    if small:  # false also for NaN
        return array
    usable = abs(array) <= largest
    if np.count_nonzero(usable) < array.size:
        allowed = f"finite numbers up to {f'{largest:g} {unit}'.rstrip()} are allowed"
        raise InvalidInput(name, f"{_first_of(array, ~usable)}; {allowed}.")
    return array


def _first_of(array: Array, chosen: NDArray[np.bool_]) -> str:
    """Return index and value of the first entry where ``chosen`` is True: ``entry [0, 2] is 5``."""
    at = np.argwhere(chosen)[0]
    where = f"entry [{', '.join(map(str, at))}] is " if array.ndim else ""
    return f"{where}{array[tuple(at)]:g}"


def instance(name: str, value: _Kind, kind: type[_Kind]) -> _Kind:
    """Return the value if it is an instance of ``kind``, else raise :class:`InvalidInput`."""
    if not isinstance(value, kind):
        # a named tuple may hold what is needed
        parts: dict[str, object] = getattr(value, "_asdict", dict)()
        its = "".join(f": its .{key}" for key, part in parts.items() if isinstance(part, kind))
        raise InvalidInput(name, f"{value!r} given; a {kind.__name__} is needed{its}.")
    return value


def sequence_of(name: str, value: Iterable[_Kind], kind: type[_Kind]) -> tuple[_Kind, ...]:
    """Return a list or tuple of ``kind`` as a tuple; else raise :class:`InvalidInput`."""
    entries = tuple(value) if isinstance(value, (list, tuple)) else None
    if entries is None or not all(isinstance(entry, kind) for entry in entries):
        raise InvalidInput(name, f"{value!r} given; a list or tuple of {kind.__name__} is needed.")
    return entries


def vector(name: str, value: ArrayLike, size: int, meaning: str, kind: str | None = None) -> Array:
    """Return a new, read-only, finite vector (size,), or raise :class:`InvalidInput`.

    ``meaning`` says in the message what the vector is. ``kind`` is the key of :data:`RANGES` that
    gives the range of the entries.
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
    _, least, most = RANGES["tension"]
    # one float for all cables is the usual case and must be fast
    number = value if isinstance(value, float) else math.nan
    if least <= number <= most or number in (0.0, math.inf):
        return frozen(np.zeros(size) + number)
    array = _native(name, value)
    if array.ndim == 0:
        array = array.repeat(size)
    if array.shape != (size,) and (rows is None or array.shape != (rows, size)):
        wanted = f"({size},)" if rows is None else f"({size},) or ({rows}, {size})"
        raise InvalidInput(
            name, f"shape {array.shape} given; give one number, or {wanted}: one per cable [N]."
        )
    size_of = abs(array)
    usable = ((size_of <= most) & (size_of >= least)) | (size_of == 0.0) | np.isinf(size_of)
    if np.count_nonzero(usable) < array.size:
        wanted = f"newtons from {least:g} to {most:g}, 0 or inf"
        raise InvalidInput(name, f"{_first_of(array, ~usable)}; give {wanted}.")
    return frozen(array)


def wrench_vector(name: str, value: ArrayLike) -> Array:
    """Check a wrench: force [N], then moment [N m]. Return it as a read-only vector (6,)."""
    return _ZERO if value is NO_WRENCH else vector(name, value, 6, WRENCH, "wrench")


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


def flag(name: str, value: object) -> bool:
    """Return the value if it is True or False, else raise :class:`InvalidInput`."""
    if not isinstance(value, (bool, np.bool_)):
        raise InvalidInput(name, f"{value!r} given; True or False is needed.")
    return bool(value)


def whole_number(name: str, value: object, least: int, most: int | None = None) -> int:
    """Return a whole number from ``least`` to ``most``, or raise :class:`InvalidInput`."""
    if (
        isinstance(value, bool)
        or not isinstance(value, (int, np.integer))
        or value < least
        or (most is not None and value > most)
    ):
        to = "on" if most is None else f"to {most}"
        raise InvalidInput(name, f"{value!r} given; a whole number from {least} {to} is needed.")
    return int(value)


_NO_LETTER = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufffe\uffff]")
"""Control characters, line breaks, lone surrogates and other codes that XML cannot hold."""


def text(name: str, value: object) -> str:
    """Return ``value`` if it is a printable, not blank text; else raise :class:`InvalidInput`."""
    if not isinstance(value, str) or not value.strip():
        raise InvalidInput(name, f"{value!r} given; a name is needed, a text that is not blank.")
    wrong = _NO_LETTER.search(value)
    if wrong is not None:
        at = wrong.start() + 1
        raise InvalidInput(name, f"{value!r} given; character {at} cannot be printed.")
    return value


def one_of(kind: str, name: object, known: Iterable[str], remedy: str = "") -> str:
    """Return ``name`` if it is a known name of a ``kind``, e.g. a link; else raise UnknownName."""
    known = tuple(known)
    if not isinstance(name, str) or name not in known:
        raise UnknownName(kind, name, known, remedy)
    return name


def _native(name: str, value: ArrayLike) -> Array:
    """Copy ``value`` to a new array of native float64, or raise :class:`InvalidInput`."""
    if type(value) is np.ndarray and value.dtype == np.float64:  # usual case, must be fast
        copy: Array = value.copy()
        return copy
    if isinstance(value, np.ma.MaskedArray) or (
        isinstance(value, (list, tuple)) and any(entry is np.ma.masked for entry in value)
    ):
        raise InvalidInput(name, "is a masked array; fill or drop the masked entries first.")
    try:
        array = np.asarray(value)
    except Exception as error:  # a user-defined __array__ may raise anything
        raise InvalidInput(name, f"is not an array of numbers ({error}).") from None
    if isinstance(value, Mapping):
        raise InvalidInput(
            name, f"a {type(value).__name__} given; give its numbers alone, in order, as an array."
        )
    if array.dtype.kind not in "iuf":
        such = "".join(f", such as {each!r:.60}" for each in array.ravel()[:1].tolist())
        raise InvalidInput(name, f"holds {array.dtype} entries{such}; real numbers are needed.")
    if array.dtype == np.float64:
        return np.array(array, order="C")
    with np.errstate(over="ignore"):  # numbers beyond float64 become inf, which is refused later
        return array.astype(np.float64, order="C")
