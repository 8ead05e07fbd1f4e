"""How kernels are compiled: three decorators over numba's, and a loop it can vectorise."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Literal, TypeVar, cast

import numpy as np
from numba import njit

_Function = TypeVar("_Function", bound=Callable[..., Any])


def compiled(function: _Function) -> _Function:
    """Compile for speed, once for all runs if there is a place to keep the result.

    No fastmath: it may drop NaN. Divisions are not guarded: none here is by zero.
    """
    return _compile(function)


def threaded(function: _Function) -> _Function:
    """Compile, and let Python's other threads run on meanwhile: for what takes milliseconds."""
    return _compile(function, nogil=True)


def inlined(function: _Function) -> _Function:
    """Compile as part of every kernel that calls it: for what is over in nanoseconds."""
    return _compile(function, inline="always")


def _compile(
    function: _Function, inline: Literal["never", "always"] = "never", nogil: bool = False
) -> _Function:
    compiler = partial(njit, error_model="numpy", inline=inline, nogil=nogil)
    try:
        return cast(_Function, compiler(cache=True)(function))
    except RuntimeError:  # neither the package's folder nor the user's cache can be written
        return cast(_Function, compiler()(function))


@inlined
def upwards(first: int, end: int) -> range:
    """``range(first, end)`` of indices that are known not to be negative.

    A negative index counts from the end, and a loop that has to look is not vectorised.
    """
    return range(np.uint64(first), np.uint64(end))
