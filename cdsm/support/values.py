"""Values that do not change: read-only arrays, and frozen dataclasses that hold and print them."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from cdsm.support.markup import element

Array = NDArray[np.float64]

_AnyArray = TypeVar("_AnyArray", bound=NDArray[Any])


def frozen(array: _AnyArray) -> _AnyArray:
    """Return the array itself, made read-only."""
    array.setflags(write=False)
    return array


class Printed:
    """A base of classes that print themselves as a table: a notebook shows the same text."""

    def _repr_html_(self) -> str:
        return str(element("pre", str(self)))


class ReadOnlyState(Printed):
    """A base of frozen dataclasses of arrays: unpickling and copying keep the arrays read-only."""

    def __getstate__(self) -> dict[str, object]:
        # the fields alone: what is computed from them on first use can be large
        return {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]

    def __setstate__(self, state: dict[str, object]) -> None:
        for value in state.values():
            for array in value if isinstance(value, tuple) else (value,):
                if isinstance(array, np.ndarray):
                    frozen(array)
        self.__dict__.update(state)
