"""Compile kernels: four decorators based on numba's njit, and ranges for fast loops.

Python runs the first calls of a kernel, since compiling takes half a minute. A posture of five
joints takes 2 ms in Python, or 0.03 ms as part of a wide block. Compiled, it takes 25 µs, or 3 µs
in a block. Python and compiled kernels give the same bits.
"""

from __future__ import annotations

import glob
import hashlib
import logging
import os
import tempfile
import time
import uuid
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from numba import config, njit
from numba.core.caching import IndexDataCacheFile
from numba.core.compiler import Compiler
from numba.core.dispatcher import Dispatcher

from cdsm._former.interpreting import python_kernel

_log = logging.getLogger("cdsm")
_Function = TypeVar("_Function", bound=Callable[..., Any])


class _Disjoint(Compiler):
    """Compiler of kernels that never write to an array which overlaps another argument.

    LLVM then omits code for overlapping arrays. Kernels compile in two thirds of the time, and run
    in three quarters of the time.
    """

    def define_pipelines(self) -> Any:
        self.state.flags.noalias = True
        return super().define_pipelines()  # type: ignore[no-untyped-call]


def compiled(function: _Function) -> _Function:
    """Compile a kernel that Python calls; numba caches the result on disk.

    numba's fastmath is off, since it may remove NaN. Division by zero gives inf or NaN.
    """
    return _patient(_compile(function))


def inner(function: _Function) -> _Function:
    """Compile a kernel that only kernels call: it has no entry for Python and compiles faster.

    An array to which it writes must not overlap another argument.
    """
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return _compile(function, pipeline_class=_Disjoint, **options)


def threaded(function: _Function) -> _Function:
    """Compile a kernel that releases the GIL, for kernels that take milliseconds.

    An array to which it writes must not overlap another argument.
    """
    return _patient(_compile(function, nogil=True, pipeline_class=_Disjoint))


def inlined(function: _Function) -> _Function:
    """Compile a kernel inline in every kernel that calls it, for kernels that take nanoseconds."""
    return _compile(function, inline="always")


def _compile(function: _Function, **options: Any) -> _Function:
    compiler = partial(njit, error_model="numpy", **options)
    try:
        kernel = compiler(cache=True)(function)
    except RuntimeError:  # neither the package's folder nor the user's cache is writable
        chosen = config.CACHE_DIR  # type: ignore[attr-defined]
        try:
            config.CACHE_DIR = _own_folder()  # type: ignore[attr-defined]
            kernel = compiler(cache=True)(function)
        except (RuntimeError, OSError):  # nor is any folder for temporary files
            kernel = compiler()(function)
        finally:
            config.CACHE_DIR = chosen  # type: ignore[attr-defined]
    kept: Any = getattr(kernel, "_cache", None)
    if hasattr(kept, "_cache_file"):
        # numba compares the source of a kernel with its cache, but not that of the kernels it calls
        sources = _sources(__file__), _sources(function.__code__.co_filename)
        stamp = kept._cache_file._source_stamp, sources
        kept._cache_file = CacheFile(kept._cache_path, kept._impl.filename_base, stamp)  # type: ignore[no-untyped-call]
    return cast(_Function, kernel)


class CacheFile(IndexDataCacheFile):
    """Cache of one kernel on disk: an index of signatures, and a file for each.

    numba numbers the files. If two processes compile a kernel for different signatures at the same
    time, both may write the same file, and a third process runs the wrong machine code. This class
    gives each file a unique name.
    """

    def _data_name(self, number: int) -> str:
        return f"{Path(self._index_name).stem}.{uuid.uuid4().hex}.nbc"

    def _save_index(self, overloads: dict[Any, str]) -> None:
        """Save the index, and remove files that it does not name, compiled from older sources."""
        super()._save_index(overloads)  # type: ignore[no-untyped-call]
        for path in Path(self._cache_path).glob(
            f"{glob.escape(Path(self._index_name).stem)}.*.nbc"
        ):
            if path.name not in overloads.values():
                path.unlink(missing_ok=True)


@cache
def _sources(file: str) -> str:
    """Return a digest of all Python files in the folder of ``file``.

    A cached kernel is valid only if the digest is unchanged.
    """
    digest = hashlib.sha256()
    for path in sorted(Path(file).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


@cache
def _own_folder() -> str:
    """Return a temporary folder for compiled kernels, where only this user can write.

    It is used if no folder of numba's cache is writable; a warning says so.
    """
    user = os.getuid() if hasattr(os, "getuid") else "user"
    folder = Path(tempfile.gettempdir()) / f"cdsm-kernels-{user}"
    folder.mkdir(mode=0o700, exist_ok=True)
    seen = folder.lstat()
    if hasattr(os, "getuid") and (seen.st_uid != user or seen.st_mode & 0o022):
        folder = Path(tempfile.mkdtemp(prefix="cdsm-kernels-"))  # another user made the first
    _log.warning("no cache folder of numba is writable, compiled kernels go to %s", folder)
    return str(folder)


_NEW, _KEPT = (0.5, 2**15), (0.02, 2**12)
"""Largest total time [s] that Python runs a kernel, and largest array size in such a call.

The first pair is for a new kernel, the second for one whose compiled form is on the disk.
"""

_PATIENCE = 8.0
"""Largest total time [s] that Python runs a new kernel on wide blocks; see :func:`is_new`."""

_at_once = False


@contextmanager
def at_once() -> Iterator[None]:
    """Within the context, compile each kernel at its first call."""
    global _at_once
    before, _at_once = _at_once, True
    try:
        yield
    finally:
        _at_once = before


def _patient(function: _Function) -> _Function:
    """Let Python run the first calls of a kernel, until loading or compiling it is worth the time.

    A kernel in the cache on the disk is loaded; another one is compiled.
    """
    if not isinstance(function, Dispatcher):  # compilation is switched off
        return function
    kernel: Any = function
    load_or_compile, spent = kernel._compile_for_args, 0.0
    stored = getattr(kernel._cache, "_cache_file", None)
    names = kernel.py_func.__code__.co_varnames

    @cache
    def kept() -> dict[Any, str]:
        return stored._load_index() if stored is not None else {}

    @cache
    def is_kept(*types: Any) -> bool:
        key = kernel._cache._index_key(types, kernel.targetctx.codegen()) if kept() else None
        return key in kept()

    def is_new() -> bool:
        return not (kernel.signatures or kept() or _at_once) and spent < _PATIENCE

    def run(start: float, wide: bool, *arguments: Any) -> Any:
        nonlocal spent
        try:
            with np.errstate(all="ignore"):
                return _native(python_kernel(kernel.py_func, wide)(*arguments))
        finally:
            spent += time.thread_time() - start

    def choose(*arguments: Any) -> Callable[..., Any]:
        """Return the function that runs this call: a Python function or the compiled kernel.

        numba calls this when the kernel is not compiled for these types of arguments.
        """
        start = time.thread_time()
        wide = (dict(zip(names, arguments, strict=False)).get("width") or 1) >= WIDTH
        known = is_kept(*map(kernel.typeof_pyval, arguments))
        seconds, numbers = _KEPT if known else _NEW
        few = _largest(arguments) <= numbers and spent < seconds
        patient = not known and spent < _PATIENCE if wide else few
        if patient and not _at_once:
            return partial(run, start, wide)
        if not known:
            _announce()
        return cast(Callable[..., Any], load_or_compile(*arguments))

    kernel._compile_for_args, kernel.is_new = choose, is_new
    return function


def is_new(kernel: Callable[..., Any]) -> bool:
    """Return whether ``kernel`` is not compiled yet, so that numpy would run a wide block.

    A block is wide if it has :data:`WIDTH` postures or more.
    """
    new: Callable[[], bool] = getattr(kernel, "is_new", lambda: False)
    return new()


def _largest(values: Any) -> int:
    """Return the size of an array, or of the largest one in nested tuples of arrays."""
    if isinstance(values, tuple):
        return max(map(_largest, values), default=0)
    return getattr(values, "size", 0)


def _native(result: Any) -> Any:
    """Replace numpy scalars by numbers of Python, as a compiled kernel returns them."""
    if isinstance(result, tuple):
        return tuple(map(_native, result))
    return result.item() if isinstance(result, np.generic) else result


@cache
def _announce() -> None:
    """Log once that kernels are compiled: the first use on a machine takes two or three minutes."""
    _log.warning("compiling kernels, once on this machine: two or three minutes in all")


WIDTH = 64
"""Largest number of postures in a block of a compiled kernel: it fills several vector registers."""

FULL = cast(int, np.int32(WIDTH))
"""WIDTH, with a type of its own: for this type kernels are compiled with a constant.

Loops over a constant number of postures take a tenth less time.
"""

Index = int | np.integer[Any]
"""Index in a loop over postures. If it may be negative, numba does not vectorise the loop."""

Width = int | np.int32 | None
"""Number of postures side by side in a block, or None for one posture.

The last axis of all arrays of a block is the posture. A loop over it is vectorised, so a block of
32 postures takes only about ten times as long as one. Kernels are compiled once for any number of
postures, once for :data:`FULL`, and once for None, with the constant 1, which removes the loops
over postures. All give the same bits.
"""


@inner
def lanes(width: Width) -> Iterable[Index]:
    """Return the range of the postures of a block; its indices are unsigned (:func:`upwards`)."""
    if isinstance(width, np.int32):  # FULL
        return range(np.uint64(WIDTH))
    return range(np.uint64(1)) if width is None else range(np.uint64(width))


@inner
def axes(count: int, width: Width) -> Iterable[Index]:
    """Return range(3), for loops over x, y and z that LLVM unrolls for one posture only.

    LLVM unrolls loops of a constant length. For one posture (``width`` None) they then run two or
    three times as fast. For a block they would not run faster, but take half as long again to
    compile. There the length is ``count``, which must be 3, but is not a constant for LLVM.
    """
    return range(np.uint64(3)) if width is None else range(np.uint64(count))


@inlined
def upwards(first: Index, end: Index) -> Iterable[Index]:
    """Return ``range(first, end)`` for indices that are never negative.

    A negative index counts from the end, and numba does not vectorise a loop that must check for
    it.
    """
    return range(np.uint64(first), np.uint64(end))
