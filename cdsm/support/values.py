"""Immutable values: read-only arrays, and base classes of frozen dataclasses of arrays."""

from __future__ import annotations

import html
from collections.abc import Iterator, Sequence
from dataclasses import fields
from importlib import import_module
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_AnyArray = TypeVar("_AnyArray", bound=NDArray[Any])
_Accepted = TypeVar("_Accepted", contravariant=True)
_Kept = TypeVar("_Kept", covariant=True)


def frozen(array: _AnyArray) -> _AnyArray:
    """Make an array read-only, and return this array (not a copy)."""
    array.setflags(write=False)
    return array


def total(parts: Sequence[Array]) -> Array:
    """Compute the sum of arrays of one shape, in their order."""
    if len(parts) == 1:
        return parts[0]
    result = parts[0] + parts[1]
    for part in parts[2:]:
        result += part  # in place, which is faster
    return result


class Converted(Protocol[_Accepted, _Kept]):
    """Type of a dataclass field that accepts another type than it keeps; only type checkers ask."""

    def __get__(self, owner: Any, kind: type) -> _Kept: ...

    def __set__(self, owner: Any, value: _Accepted) -> None: ...


class Printed:
    """Base class for values that print as a table; a notebook shows the printed text."""

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(str(self))}</pre>"


def draw(function: str, *values: object, **options: Any) -> Any:
    """Draw ``values`` by a function of :mod:`cdsm.plots`, a chapter above that knows all others."""
    return getattr(import_module("cdsm.plots"), function)(*values, **options)


class Plotted:
    """Base class of values with a picture."""

    _figure: ClassVar[str]
    """Name of the function of :mod:`cdsm.plots` that draws it."""

    def plot(self, ax: Any = None, **options: Any) -> Any:
        """Plot this value, and return the axes: an array of them if there are several panels.

        Args:
            ax: Axes of matplotlib to draw on, or several for a picture of several panels; None: a
                new figure, which is ``ax.figure`` of the result.
            **options: Other options of the function of :mod:`cdsm.plots` for this class, such as
                :func:`~cdsm.plots.plot_stiffness_range`. What it shows stands there.
        """
        return draw(self._figure, self, ax, **options)


class IndexedByName:
    """Base class of results that are indexed by name: iteration and ``in`` go over the names."""

    def keys(self) -> tuple[Any, ...]:
        """Return the names, in the order of the arrays."""
        raise NotImplementedError

    def __iter__(self) -> Iterator[Any]:
        return iter(self.keys())

    def __contains__(self, name: object) -> bool:
        return name in self.keys()


class ReadOnlyState(Printed):
    """Base class of frozen dataclasses whose arrays stay read-only after copying and pickling."""

    def __getstate__(self) -> dict[str, object]:
        # only fields: cached properties can be large
        return {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]

    def __setstate__(self, state: dict[str, object]) -> None:
        for value in state.values():
            parts = tuple(value.values()) if isinstance(value, dict) else value
            for array in parts if isinstance(parts, tuple) else (parts,):
                if isinstance(array, np.ndarray):
                    frozen(array)
        self.__dict__.update(state)
