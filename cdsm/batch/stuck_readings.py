"""Readings of a stuck arm, whose cables stick in their holes: tip stiffness and breakaway load."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from cdsm.batch.arguments import Arm, Kept, Rows
from cdsm.batch.layout import BREAKAWAY, STUCK_ALONG, STUCK_COMPLIANCE, STUCK_JOINT
from cdsm.kernels.breakaway import set_breakaway
from cdsm.kernels.read import read
from cdsm.kernels.tree import Indices
from cdsm.support.values import Array, frozen

STUCK = (STUCK_JOINT, STUCK_ALONG, STUCK_COMPLIANCE, BREAKAWAY)
"""Numbers, in a record, of the quantities of the stuck arm."""

WITHOUT_FRICTION = {
    "stuck_joint": "joint",
    "stuck_along": "along",
    "stuck_compliance": "compliance",
}
"""For each quantity of the stuck arm, the one that it equals if there is no friction."""


def read_stuck(
    arm: Arm,
    rows: Rows,
    tension: Array,
    kept: Kept,
    directions: Array,
    names: Collection[str],
    status: Indices,
    width: int,
) -> dict[str, Array]:
    """Compute the readings ``names`` of the stuck arm at the postures ``rows``.

    ``tension`` is F (b, C) [N], and ``kept`` has K_θ and J_X of the postures. ``directions`` (D, 3)
    are unit vectors. ``status`` is READ or UNREAD for B blocks of W postures (B, W); it becomes
    SINGULAR where K_θ is singular. ``width`` is W. The last axis of all results is the posture.
    Without friction, no cable sticks: the only result is a breakaway load of 0.
    """
    load = np.zeros((status.size, len(directions)))
    found = {"breakaway": np.moveaxis(load.reshape(*status.shape, -1), 1, 2)}
    if not arm.holes.friction.any():
        return found
    wanted = {WITHOUT_FRICTION.get(name, "along") for name in names}
    values = read(kept.stuck, kept.stuck_parts, kept.jacobian, directions, wanted, status, width)
    if "breakaway" in names:
        F, motion = frozen(np.ascontiguousarray(tension)), np.ascontiguousarray(values["motion"])
        own, linear = (arm.tree, arm.routing, arm.holes), arm.stuck[0] + arm.stuck[1] * F
        wire = rows.wire if len(rows.wire) else frozen(linear)
        set_breakaway(*own, rows.q, F, wire, motion, width, load[: len(rows.q)])
    return found | {name: values[free] for name, free in WITHOUT_FRICTION.items() if free in values}
