"""Check the arguments of a sweep that may be one value, several values, or several by name."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import InvalidInput
from cdsm.support.directions import Direction
from cdsm.support.validation import number_array, one_of, scalar, text, vector
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.sweeps.quantities import QUANTITIES
from cdsm.wires.elasticity import Elasticity

_Values = TypeVar("_Values")

Label = tuple[tuple[str, ...], Any, dict[str, str]]
"""Coordinate of a Dataset as xarray takes it: dimensions, values and attributes."""


def label(dims: tuple[str, ...], values: object, long_name: str, units: str = "") -> Label:
    """Build a coordinate of a Dataset along ``dims``, with units in UDUNITS notation."""
    return dims, values, {"long_name": long_name} | ({"units": units} if units else {})


@final
@dataclass(frozen=True, eq=False)
class Choice(ReadOnlyState, Generic[_Values]):
    """Checked values of an argument of a sweep.

    If several values are given, the Dataset has a dimension with the name of the argument.
    """

    name: str  # of the argument
    values: _Values  # all values in order, also if there is only one
    names: NDArray[np.str_] | NDArray[np.int64] | None  # their names or numbers; None for one value

    @property
    def labels(self) -> dict[str, Label]:
        """Return the coordinate of the dimension, by its name; empty if one value is given."""
        if self.names is None:
            return {}
        kind, units = ("name", "") if self.names.dtype.kind == "U" else ("number", "1")
        return {self.name: label((self.name,), self.names, f"{kind} of the {self.name}", units)}

    def label(self, values: Array, dims: tuple[str, ...], long_name: str, units: str) -> Label:
        """Build a further coordinate: along the dimension of the argument, then along ``dims``.

        ``values`` has a row for each value of the argument. If the argument has only one value, the
        coordinate has only the dimensions ``dims``.
        """
        if self.names is None:
            return label(dims, values[0], long_name, units)
        return label((self.name, *dims), values, long_name, units)


def laws_of(
    elasticity: Elasticity | Mapping[str, Elasticity] | None,
) -> Choice[tuple[Elasticity | None, ...]]:
    """Check laws of a sweep: one for all cables, or several by name; None: those of the arm."""
    if elasticity is None or isinstance(elasticity, Elasticity):
        return Choice("elasticity", (elasticity,), None)
    if not isinstance(elasticity, Mapping) or not all(
        isinstance(law, Elasticity) for law in elasticity.values()
    ):
        raise InvalidInput(
            "elasticity",
            f"{elasticity!r} given; give an Elasticity, or a mapping of names to several.",
        )
    if not elasticity:
        raise InvalidInput("elasticity", "is empty; give at least one name and value.")
    return Choice("elasticity", tuple(elasticity.values()), _names("elasticity", elasticity))


def bounds_of(minimum: ArrayLike, maximum: float) -> tuple[Choice[Array], float]:
    """Check and return M lower bounds (M,) [N] and one upper bound [N].

    Each of them holds for the tensions of all cables.
    """
    lows = distinct("minimum", minimum)
    if lows.min() < 0.0:
        raise InvalidInput(
            "minimum", f"{lows.min():g} N given; cables only pull, so it cannot be negative."
        )
    unbounded = isinstance(maximum, (float, np.floating)) and maximum == math.inf
    high = math.inf if unbounded else scalar("maximum", maximum)
    if high < lows.max():
        raise InvalidInput(
            "maximum",
            f"{high:g} N given, below a minimum of {lows.max():g} N; raise maximum or lower "
            "minimum.",
        )
    return Choice("minimum", lows, np.arange(len(lows)) if np.ndim(minimum) else None), high


def distinct(name: str, values: ArrayLike) -> Array:
    """Check and return the values (n,) of a dimension: one or more numbers, no two equal."""
    array = np.atleast_1d(number_array(name, values))
    array = vector(name, array, array.size, "the values of a dimension")
    if not array.size:
        raise InvalidInput(name, "is empty; give at least one number.")
    different, counts = np.unique(array, return_counts=True)
    if counts.max() > 1:
        raise InvalidInput(
            name, f"holds {different[counts.argmax()]:g} twice; give each value once."
        )
    return array


def vectors_of(
    name: str,
    value: Direction | Sequence[Direction] | Mapping[str, Direction],
    checked: Callable[[str, ArrayLike], Array],
) -> Choice[Array]:
    """Check one vector, or several as rows or by name; ``checked`` checks and returns each one.

    The values of the result have a row for each vector: wrenches (W, 6), directions (D, 3).
    """
    if isinstance(value, str):
        return Choice(name, frozen(checked(name, value)[None]), None)
    if isinstance(value, (list, tuple)) and all(isinstance(each, str) for each in value):
        value = dict(zip(value, value, strict=True))  # axes are their own names
    if isinstance(value, Mapping):
        rows = [checked(f"{name}[{key!r}]", each) for key, each in value.items()]
    else:
        array = number_array(name, value)  # type: ignore[arg-type]
        if array.ndim < 2:
            return Choice(name, frozen(checked(name, array)[None]), None)
        rows = [checked(f"{name}[{i}]", each) for i, each in enumerate(array)]
    if not rows:
        raise InvalidInput(name, "is empty; give at least one.")
    names = _names(name, value) if isinstance(value, Mapping) else np.arange(len(rows))
    return Choice(name, frozen(np.array(rows)), names)


def outputs_of(outputs: Iterable[str]) -> tuple[str, ...]:
    """Check and return names of quantities: one or more, each once."""
    if not isinstance(outputs, Iterable):
        raise InvalidInput("outputs", f"{outputs!r} given; names are needed.")
    names = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    if not names:
        raise InvalidInput("outputs", f"is empty; name some of {', '.join(QUANTITIES)}.")
    for name in names:
        one_of("output", name, QUANTITIES)
        if names.count(name) > 1:
            raise InvalidInput("outputs", f"holds {name!r} twice; name it once.")
    return names


def _names(name: str, values: Mapping[str, object]) -> NDArray[np.str_]:
    return np.array([text(f"name of {name}", key) for key in values])
