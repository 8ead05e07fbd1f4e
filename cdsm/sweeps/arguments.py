"""Arguments of a sweep: each is one value, several values, or several values by name."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.elasticity import Elasticity
from cdsm.errors import InvalidInput
from cdsm.support.validation import (
    Array,
    frozen,
    number_array,
    scalar,
    text,
    unit_direction,
    vector,
    wrench_vector,
)

_Values = TypeVar("_Values")


@final
@dataclass(frozen=True, eq=False)
class Label:
    """Coordinate of a Dataset: values along dimensions, or a single value.

    Attributes:
        dims: Dimensions; empty for a single value.
        values: Numbers or names; one axis for each dimension.
        long_name: Name in words.
        units: SI units in the notation of UDUNITS; empty for names.
    """

    dims: tuple[str, ...]
    values: Array | NDArray[np.int64] | NDArray[np.str_] | float
    long_name: str
    units: str

    @property
    def attributes(self) -> dict[str, str]:
        """Return long name and units as attributes of a Dataset."""
        return {"long_name": self.long_name} | ({"units": self.units} if self.units else {})


@final
@dataclass(frozen=True, eq=False)
class Choice(Generic[_Values]):
    """Value or values of an argument.

    Attributes:
        name: Name of the argument; several values make a dimension of this name.
        values: The values, one entry each; also one entry for a single value.
        names: Names or numbers along the dimension; None for a single value without dimension.
    """

    name: str
    values: _Values
    names: NDArray[np.str_] | NDArray[np.int64] | None

    @property
    def labels(self) -> dict[str, Label]:
        """Return the coordinate of the dimension; empty for a single value."""
        if self.names is None:
            return {}
        kind = "name" if self.names.dtype.kind == "U" else "number"
        units = "" if kind == "name" else "1"
        return {self.name: Label((self.name,), self.names, f"{kind} of the {self.name}", units)}

    def label(self, values: Array, dims: tuple[str, ...], long_name: str, units: str) -> Label:
        """Build a coordinate with one entry for each value, such as its force."""
        if self.names is None:
            return Label(dims, values[0], long_name, units)
        return Label((self.name, *dims), values, long_name, units)


def laws_of(
    elasticity: Elasticity | Mapping[str, Elasticity] | None,
) -> Choice[tuple[Elasticity | None, ...]]:
    """Check the elasticities; each is used for all cables, None keeps those of the arm."""
    if elasticity is None or isinstance(elasticity, Elasticity):
        return Choice("elasticity", (elasticity,), None)
    if not isinstance(elasticity, Mapping) or not all(
        isinstance(law, Elasticity) for law in elasticity.values()
    ):
        raise InvalidInput(
            "elasticity",
            f"{elasticity!r} given; give an Elasticity, or a mapping of names to several.",
        )
    return Choice("elasticity", tuple(elasticity.values()), _names("elasticity", elasticity))


def wrenches_of(wrench: ArrayLike | Mapping[str, ArrayLike]) -> Choice[Array]:
    """Check wrenches (W, 6) at ``tool0`` in base axes: force [N], then moment [N m]."""

    def checked(name: str, value: ArrayLike) -> Array:
        return wrench_vector(name, value)

    return _vectors("wrench", wrench, checked)


def directions_of(direction: ArrayLike | Mapping[str, ArrayLike]) -> Choice[Array]:
    """Check directions; return unit vectors (D, 3) in base axes."""
    return _vectors("direction", direction, unit_direction)


def bounds_of(minimum: ArrayLike, maximum: float) -> tuple[Choice[Array], float]:
    """Check the lower bounds of tension (M,) [N] and the upper bound [N]."""
    several = np.ndim(number_array("minimum", minimum)) > 0
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
    return Choice("minimum", lows, np.arange(len(lows)) if several else None), high


def distinct(name: str, values: ArrayLike) -> Array:
    """Check the labels of a dimension (n,): one or more different numbers."""
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


def _vectors(
    name: str,
    value: ArrayLike | Mapping[str, ArrayLike],
    checked: Callable[[str, ArrayLike], Array],
) -> Choice[Array]:
    if isinstance(value, Mapping):
        rows = [checked(f"{name}[{key!r}]", each) for key, each in value.items()]
        return Choice(name, _rows(name, rows), _names(name, value))
    array = number_array(name, value)
    if array.ndim < 2:
        return Choice(name, _rows(name, [checked(name, array)]), None)
    rows = [checked(f"{name}[{i}]", each) for i, each in enumerate(array)]
    return Choice(name, _rows(name, rows), np.arange(len(rows)))


def _rows(name: str, rows: list[Array]) -> Array:
    if not rows:
        raise InvalidInput(name, "is empty; give at least one.")
    return frozen(np.array(rows))


def _names(name: str, values: Mapping[str, object]) -> NDArray[np.str_]:
    if not values:
        raise InvalidInput(name, "is empty; give at least one name and value.")
    return np.array([text(f"name of {name}", key) for key in values])
