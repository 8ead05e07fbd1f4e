"""Check the arguments of a batch."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.support.validation import WRENCH, number_array, whole_number
from cdsm.support.values import Array, frozen


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


def checked_threads(threads: int | None) -> int:
    """Check the number of threads; None gives one for each core that this process may use."""
    if threads is None:
        if hasattr(os, "sched_getaffinity"):
            return len(os.sched_getaffinity(0))
        return os.cpu_count() or 1
    return whole_number("threads", threads, 1)
