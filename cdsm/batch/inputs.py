"""Check the arguments of a batch, and divide it into ranges of rows (slices)."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import ArrayLike

from cdsm._former.tension import NO_ARM
from cdsm.batch.arguments import Arm
from cdsm.batch.arm_arrays import kernel_arrays
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.support.validation import WRENCH, flag, number_array, whole_number
from cdsm.support.values import Array, frozen

_MOST = 4096
"""Maximum number of postures in a slice; a slice allocates the kernel's scratch once."""


def kernel_arm(arm: Manipulator, check_limits: bool) -> Arm:
    """Return an arm as arrays for the kernel; its joint limits are infinite if not checked."""
    model, endless = kernel_arrays(arm), np.full(arm.nv, np.inf)
    checked = flag("check_limits", check_limits)
    return Arm(
        tree=model.tree,
        routing=model.routing,
        masses=model.masses,
        lowest=model.lowest if checked else frozen(-endless),
        highest=model.highest if checked else frozen(endless),
        blocks=model.blocks,
        smallest_arm=NO_ARM * arm.length,
        linear=frozen(np.stack([arm._laws.constant, arm._laws.linear])),
        series=arm._laws.series,
        rest=arm._laws.rest,
    )


def postures(arm: Manipulator, q: ArrayLike) -> Array:
    """Check joint angles (B, nv) [rad]; return them as a read-only array."""
    array = number_array("q", q)
    if array.ndim != 2 or array.shape[1] != arm.nv:
        raise InvalidInput(
            "q",
            f"shape {array.shape} given, (B, {arm.nv}) needed: a row for each posture, in it one "
            f"angle [rad] per joint, {', '.join(arm.joint_names)}. For one posture there is "
            "Manipulator.at.",
        )
    return frozen(array)


def per_row(name: str, value: ArrayLike, rows: int, width: int, meaning: str, kind: str) -> Array:
    """Check that ``value`` is (width,), for all postures, or (rows, width); return it read-only.

    The message of an error contains ``name`` and ``meaning``. ``kind`` names the physical quantity,
    which determines the allowed range.
    """
    array = number_array(name, value, kind)
    if array.shape not in ((width,), (rows, width)):
        raise InvalidInput(
            name,
            f"shape {array.shape} given, ({width},) for all rows or ({rows}, {width}) needed: "
            f"{meaning}.",
        )
    return frozen(array)


def given_tension(arm: Manipulator, value: ArrayLike, rows: int) -> Array:
    """Check tensions (C,) or (rows, C) [N]; return them as a read-only array."""
    cables = [cable.name for cable in arm.cables]
    tension = per_row("tension", value, rows, len(cables), "one tension [N] per cable", "tension")
    if tension.size and tension.min() < 0.0:
        *row, c = np.unravel_index(int(tension.argmin()), tension.shape)
        where = f" in row {row[0]}" if row else ""
        raise InvalidInput(
            "tension", f"{tension.min():g} N given for {cables[c]}{where}; cables only pull."
        )
    return tension


def given_wrench(value: ArrayLike | None, rows: int) -> Array:
    """Check a wrench (6,) or (rows, 6), zero if None; return it as a read-only array."""
    return per_row("wrench", np.zeros(6) if value is None else value, rows, 6, WRENCH, "wrench")


def run_slices(work: Callable[[slice], None], rows: int, block: int, threads: int) -> None:
    """Call ``work`` for slices that together cover all rows, in several threads.

    These are Python threads; the kernels release the interpreter lock. Parallel loops of numba
    take seconds longer to compile. On some machines two threads cannot enter such a loop at once;
    on others a process that forks later cannot use one.

    Args:
        work: Computes the postures of its slice, and changes no others.
        rows: Number of postures.
        block: Number of postures that the kernel computes at a time.
        threads: Maximum number of threads.
    """
    size = max(1, min(-(-rows // threads), _MOST))
    size += -size % block
    slices = [slice(first, min(first + size, rows)) for first in range(0, rows, size)]
    if threads == 1 or len(slices) < 2:
        for part in slices:
            work(part)
        return
    with ThreadPoolExecutor(min(threads, len(slices))) as pool:
        for _ in pool.map(work, slices):  # an error cancels the slices that have not begun
            pass


def checked_threads(threads: int | None) -> int:
    """Check the number of threads; None gives one for each core that this process may use."""
    if threads is None:
        if hasattr(os, "sched_getaffinity"):
            return len(os.sched_getaffinity(0))
        return os.cpu_count() or 1
    return whole_number("threads", threads, 1)
