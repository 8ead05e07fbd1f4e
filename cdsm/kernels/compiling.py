"""Compilation of kernels: four decorators based on numba's njit, and ranges for fast loops."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, TypeVar, cast

import numpy as np
from numba import njit
from numba.core import event
from numba.core.compiler import Compiler

_log = logging.getLogger("cdsm")
_Function = TypeVar("_Function", bound=Callable[..., Any])


class _Disjoint(Compiler):
    """Compile kernels whose array arguments do not overlap where they are written.

    LLVM then needs no loop for the case that they do: kernels compile in two thirds of the time,
    and take three quarters of it to run.
    """

    def define_pipelines(self) -> Any:
        self.state.flags.noalias = True
        return super().define_pipelines()  # type: ignore[no-untyped-call]


def compiled(function: _Function) -> _Function:
    """Compile a kernel; numba caches the result on disk if a folder is writable.

    fastmath is off, since it may remove NaN. Division by zero is not checked: no kernel divides by
    zero.
    """
    return _compile(function)


def inner(function: _Function) -> _Function:
    """Compile a kernel that only kernels call: without an entry for Python, a quarter faster.

    An array that it writes overlaps none of its other arguments.
    """
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return _compile(function, pipeline_class=_Disjoint, **options)


def threaded(function: _Function) -> _Function:
    """Compile a kernel that releases the GIL, for kernels that take milliseconds.

    An array that it writes overlaps none of its other arguments.
    """
    return _compile(function, nogil=True, pipeline_class=_Disjoint)


def inlined(function: _Function) -> _Function:
    """Compile a kernel inline in every kernel that calls it, for kernels that take nanoseconds."""
    return _compile(function, inline="always")


def _compile(function: _Function, **options: Any) -> _Function:
    compiler = partial(njit, error_model="numpy", **options)
    try:
        return cast(_Function, compiler(cache=True)(function))
    except RuntimeError:  # neither the package's folder nor the user's cache is writable
        return cast(_Function, compiler()(function))


class _Announcement(event.Listener):
    """Tell once that kernels are compiled: the first use on a machine takes a minute or two."""

    told = False

    def on_start(self, event: event.Event) -> None:
        module = event.data["dispatcher"].py_func.__module__
        if not self.told and module.startswith("cdsm."):
            self.told = True
            _log.warning("compiling kernels, once on this machine: one or two minutes in all")

    def on_end(self, event: event.Event) -> None:
        pass


event.register("numba:compile", _Announcement())  # type: ignore[no-untyped-call]

Index = int | np.integer[Any]
"""Index in a loop over postures. If it may be negative, numba does not vectorise the loop."""

Width = int | None
"""Number of postures side by side in a block, or None for one posture.

The last axis of all arrays of a block is the posture. A loop over it is vectorised, so a block of
32 postures takes about ten times as long as one. For None, kernels are compiled a second time,
with a constant 1: loops over one posture then vanish. Both give the same bits.
"""


@inner
def lanes(width: Width) -> Iterable[Index]:
    """Return the range of the postures of a block; indices are unsigned, as in :func:`upwards`."""
    return range(np.uint64(1)) if width is None else range(np.uint64(width))


@inlined
def upwards(first: Index, end: Index) -> Iterable[Index]:
    """Return ``range(first, end)`` for indices that are never negative.

    A negative index counts from the end, and numba does not vectorise a loop that must check for
    it.
    """
    return range(np.uint64(first), np.uint64(end))
