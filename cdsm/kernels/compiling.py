"""Compilation of kernels: three decorators based on numba's njit, and a range for fast loops."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Literal, TypeVar, cast

import numpy as np
from numba import njit

_Function = TypeVar("_Function", bound=Callable[..., Any])


def compiled(function: _Function) -> _Function:
    """Compile a kernel; numba caches the result on disk if a folder is writable.

    fastmath is off, since it may remove NaN. Division by zero is not checked: no kernel divides by
    zero.
    """
    return _compile(function)


def threaded(function: _Function) -> _Function:
    """Compile a kernel that releases the GIL, for kernels that take milliseconds."""
    return _compile(function, nogil=True)


def inlined(function: _Function) -> _Function:
    """Compile a kernel inline in every kernel that calls it, for kernels that take nanoseconds."""
    return _compile(function, inline="always")


def _compile(
    function: _Function, inline: Literal["never", "always"] = "never", nogil: bool = False
) -> _Function:
    compiler = partial(njit, error_model="numpy", inline=inline, nogil=nogil)
    try:
        return cast(_Function, compiler(cache=True)(function))
    except RuntimeError:  # neither the package's folder nor the user's cache is writable
        return cast(_Function, compiler()(function))


@inlined
def upwards(first: int, end: int) -> range:
    """Return ``range(first, end)`` for indices that are never negative.

    A negative index counts from the end, and numba does not vectorise a loop that must check for
    it.
    """
    return range(np.uint64(first), np.uint64(end))
