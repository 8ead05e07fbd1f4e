"""Tension distribution at many postures, and the arguments that batches share."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.applied import Loads
from cdsm.batch.applied_rows import AppliedRows, RowLoads
from cdsm.batch.quantities import Codes, OfPostures
from cdsm.batch.rows import Rows
from cdsm.batch.solution import solve_rows
from cdsm.dead_loads import LinkPoint, Load, placed_loads
from cdsm.errors import InvalidInput
from cdsm.loads import is_tip, loads_in, loads_of
from cdsm.manipulator import Manipulator
from cdsm.support.validation import WRENCH, flag, instance, number_array, whole_number
from cdsm.support.values import Array, frozen
from cdsm.tension import checked_bounds

RowsOfLoads = ArrayLike | Mapping[str, ArrayLike] | Sequence[Load] | Load | Loads | AppliedRows
"""A wrench (6,) or (B, 6) at the tip; or such wrenches by the names of links; or loads."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Tensions(OfPostures):
    """Cable tensions that balance an arm at B postures, with loads, bounds and status.

    Attributes:
        arm: The arm.
        q: Joint angles (B, nv) [rad].
        values: F (B, C) [N], in the order of ``arm.cables``; NaN where no tensions were found.
        wrench: W (6,) at the tip for all postures, or (B, 6): force [N], then moment [N m].
        minimum: Lower bounds (C,) for all postures, or (B, C) [N].
        maximum: Upper bounds (C,) for all postures, or (B, C) [N].
        status: :class:`Status` of each posture (B,).
        loads: Loads on links; None if there are none.
    """

    arm: Manipulator
    q: Array
    values: Array
    wrench: Array
    minimum: Array
    maximum: Array
    status: Codes
    loads: RowLoads | None = None

    @property
    def by_name(self) -> dict[str, Array]:
        """The tensions (B, C) under their name, ``"tension"``."""
        return {"tension": self.values}


def distribute_tensions(
    arm: Manipulator,
    q: ArrayLike,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: RowsOfLoads | None = None,
    *,
    check_limits: bool = True,
    threads: int | None = None,
) -> Tensions:
    """Compute the least tensions that balance an arm at B postures: `min ‖F‖²` (Eqs. 13, 17).

    Tensions are accepted only if they meet the optimality conditions of
    :func:`~cdsm.distribute_tension`. A posture gets the status ``INFEASIBLE`` only with a proof.

    Args:
        arm: The arm.
        q: Joint angles (B, nv) [rad], a row for each posture.
        minimum: Lower bound [N]: one number for all cables, (C,) or (B, C); not negative.
        maximum: Upper bound [N]: one number, (C,) or (B, C); inf for no bound.
        wrench: W (6,) for all postures or (B, 6) at ``tool0`` in base axes: force [N], then moment
            [N m]; zero if not given. Or loads on any links: a dict of such wrenches by link, or a
            list of :class:`~cdsm.Load`.
        check_limits: Skip postures beyond the joint limits; their status is ``BEYOND_LIMITS``.
        threads: Maximum number of threads; by default one for each core.

    Raises:
        InvalidInput: An argument has the wrong shape or is not a number, or bounds contradict each
            other. A failure at a single posture sets :attr:`Tensions.status` instead.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> angles = [[0.0] * 10, [0.1] * 10]
        >>> F = cdsm.distribute_tensions(arm, angles, minimum=5.0)
        >>> F.values.shape, F.values.max(axis=1).round(2).tolist()
        ((2, 15), [34.43, 33.13])
    """
    instance("arm", arm, Manipulator)
    angles = postures(arm, q)
    low, high = checked_bounds(arm, minimum, maximum, len(angles))
    at_tip, loads = check_load_rows(arm, wrench, len(angles))
    rows = Rows(
        arm=arm,
        q=angles,
        wrench=np.atleast_2d(at_tip),
        loads=loads,
        names=("tension",),
        bounds=(np.atleast_2d(low), np.atleast_2d(high)),
        check_limits=flag("check_limits", check_limits),
    )
    quantities, status = solve_rows(rows, checked_threads(threads))
    return Tensions(
        arm=arm,
        q=angles,
        values=frozen(quantities["tension"]),
        wrench=at_tip,
        loads=loads,
        minimum=low,
        maximum=high,
        status=frozen(status),
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


def check_tension_rows(arm: Manipulator, value: ArrayLike, rows: int) -> Array:
    """Check tensions (C,) or (rows, C) [N]; return them as a read-only array."""
    count = len(arm.cables)
    tension = per_row("tension", value, rows, count, "one tension [N] per cable", "tension")
    arm.cables.require_pulling("tension", tension)
    return tension


def check_load_rows(
    arm: Manipulator, value: RowsOfLoads | None, rows: int, name: str = "wrench"
) -> AppliedRows:
    """Check what acts on an arm, in all rows or in each; zero if None."""

    def checked(name: str, value: Any) -> Array:
        return per_row(name, value, rows, 6, WRENCH, "wrench")

    if isinstance(value, AppliedRows):
        return value
    if isinstance(value, Loads):
        at_tip, loads = AppliedRows.of([loads_of(arm, value)])
        return AppliedRows(frozen(at_tip[0].copy()), loads)
    if isinstance(value, Mapping):
        given = [Load(link) for link in value]
        wrenches = [checked(f"{name}[{link!r}]", W) for link, W in value.items()]
    else:
        items = None if value is None else loads_in(value, name)
        if items is None:
            return AppliedRows(checked(name, np.zeros(6) if value is None else value))
        given = items
        wrenches = [load.wrench for load in items]
    at_tip = frozen(np.zeros(6))
    points = list[LinkPoint]()
    on_links = list[Array]()
    placed = placed_loads(given, arm.body, arm.definition.geometry, name)
    for (at, _), W in zip(placed, wrenches, strict=True):
        if is_tip(arm, at):
            at_tip = W
        else:
            points.append(at)
            on_links.append(W)
    if not points:
        return AppliedRows(at_tip)
    shape = (rows if any(W.ndim > 1 for W in on_links) else 1, 6)
    stacked = np.stack([np.broadcast_to(W, shape) for W in on_links], axis=1)
    return AppliedRows(at_tip, RowLoads(tuple(points), frozen(stacked)))


def checked_threads(threads: int | None) -> int:
    """Check the number of threads; None gives one for each core that this process may use."""
    if threads is None:
        if hasattr(os, "sched_getaffinity"):
            return len(os.sched_getaffinity(0))
        return os.cpu_count() or 1
    return whole_number("threads", threads, 1)
