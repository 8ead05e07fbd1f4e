"""Checks of what is given row by row."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cdsm.batch.fused_kernel import Arm
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.support.validation import WRENCH, Array, flag, frozen, number_array


def kernel_arm(arm: Manipulator, check_limits: bool) -> Arm:
    """The arm as plain arrays.

    Raises:
        InvalidInput: ``check_limits`` is no flag.
    """
    lowest, highest = arm._model.lowest, arm._model.highest
    if not flag("check_limits", check_limits):
        lowest, highest = np.full_like(lowest, -np.inf), np.full_like(highest, np.inf)
    return Arm(
        arm._model.tree,
        arm._model.routing,
        arm._model.masses,
        frozen(lowest),
        frozen(highest),
        arm._model.laws.series,
        arm._model.laws.rest,
    )


def postures(arm: Manipulator, q: ArrayLike) -> Array:
    """Joint angles (B, nv) [rad], read-only.

    Raises:
        InvalidInput: Not (B, nv) finite real numbers.
    """
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
    """Numbers that are the same for all rows (width,), or different (rows, width); read-only.

    Raises:
        InvalidInput: Not finite real numbers, or of another shape.
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
    """Tensions (C,) or (rows, C) [N], read-only.

    Raises:
        InvalidInput: Not finite real numbers of such a shape, or negative.
    """
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
    """Wrench (6,) or (rows, 6), zero if there is none; read-only.

    Raises:
        InvalidInput: Not finite real numbers of such a shape.
    """
    return per_row("wrench", np.zeros(6) if value is None else value, rows, 6, WRENCH, "wrench")


def of_rows(values: Array, part: slice, rows: int) -> Array:
    """What belongs to a slice of the rows, with a row for each; read-only."""
    whole = np.broadcast_to(values, (rows, *values.shape[-1:]))
    return frozen(np.ascontiguousarray(whole[part]))
