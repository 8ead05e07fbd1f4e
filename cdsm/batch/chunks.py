"""Many rows in chunks that fit a processor's cache, and several chunks at a time."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from cdsm.support.validation import whole_number

_NUMBERS = 2**17
"""Floats per chunk: one megabyte."""

_FEWEST, _MOST = 4, 4096
"""Rows per chunk."""


def run(work: Callable[[slice], None], rows: int, width: int, threads: int) -> None:
    """Call ``work`` for slices that cover all rows, in several threads.

    Threads of Python's own, and kernels that let go of the interpreter meanwhile, in place of
    numba's parallel loops: those cannot be entered from two threads at once on some machines, nor
    in a process that forks later on others, and take seconds longer to compile.

    Args:
        work: What to do; touches the rows of its slice alone.
        rows: How many there are.
        width: Floats that come and go per row.
        threads: How many at most.
    """
    share = max(_FEWEST, -(-rows // threads))
    size = min(share, max(_FEWEST, min(_MOST, _NUMBERS // max(width, 1))))
    slices = [slice(first, min(first + size, rows)) for first in range(0, rows, size)]
    if threads == 1 or len(slices) < 2:
        for part in slices:
            work(part)
        return
    with ThreadPoolExecutor(min(threads, len(slices))) as pool:
        for _ in pool.map(work, slices):  # an error in one cancels those that have not begun
            pass


def checked_threads(threads: int | None) -> int:
    """The number of threads given, or one for each core this process may use.

    Raises:
        InvalidInput: Not a positive integer.
    """
    if threads is None:
        if hasattr(os, "sched_getaffinity"):
            return len(os.sched_getaffinity(0))
        return os.cpu_count() or 1
    return whole_number("threads", threads, 1)
