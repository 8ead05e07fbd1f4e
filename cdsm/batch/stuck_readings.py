"""Readings of an arm whose cables stick: tip stiffness, and the load at which they slide."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, NamedTuple

import numpy as np

from cdsm.batch.layout import BREAKAWAY, STUCK_ALONG, STUCK_COMPLIANCE, STUCK_JOINT
from cdsm.kernels.breakaway import set_breakaway
from cdsm.kernels.read import read
from cdsm.kernels.tree import Indices
from cdsm.manipulator import Manipulator
from cdsm.support.values import Array, frozen

STUCK = (STUCK_JOINT, STUCK_ALONG, STUCK_COMPLIANCE, BREAKAWAY)
"""Numbers of the quantities of the stuck arm."""

WITHOUT_FRICTION = {
    "stuck_joint": "joint",
    "stuck_along": "along",
    "stuck_compliance": "compliance",
}
"""For each quantity of the stuck arm, the one that it equals if there is no friction."""


class Kept(NamedTuple):
    """Arrays from which readings are computed: B blocks of W postures; W is the last axis.

    Arrays that no reading needs have no blocks.
    """

    joint: Array  # K_θ (B, nv, nv, W)
    parts: Array  # sum of the magnitudes of its terms (B, nv, nv, W)
    jacobian: Array  # J_X (B, 6, nv, W)
    stuck: Array  # K_θ while the cables stick (B, nv, nv, W)
    stuck_parts: Array  # sum of the magnitudes of its terms (B, nv, nv, W)

    def first(self, blocks: int) -> Kept:
        """Return the first blocks."""
        return Kept(*(each[:blocks] for each in self))


def read_stuck(
    arm: Manipulator,
    q: Array,
    tension: Array,
    wire: Array,
    kept: Kept,
    directions: Array,
    names: Collection[str],
    status: Indices,
) -> dict[str, Array]:
    """Compute readings of the stuck arm at postures q (b, nv) under tensions F (b, C) [N].

    ``names`` are those of the wanted readings, ``kept`` the arrays from which they follow.
    ``wire`` is EA (1 + ε) of the wires, (b, C) or (1, C) [N]; (0, C) if kernels know all laws.
    ``directions`` (D, 3) are unit vectors, and ``status`` (B, W) is as for
    :func:`~cdsm.kernels.read.read`. The posture is the last axis of all results.
    """
    blocks, width = status.shape
    load, model = np.zeros((status.size, len(directions))), arm._model
    found = {"breakaway": np.moveaxis(load.reshape(blocks, width, -1), 1, 2)}
    if not arm.has_friction:
        return found
    wanted = {WITHOUT_FRICTION.get(name, "along") for name in names}
    values = read(kept.stuck, kept.stuck_parts, kept.jacobian, directions, wanted, status, width)
    if "breakaway" in names:
        arguments: tuple[Any, ...] = (
            model.tree,
            model.routing,
            model.holes,
            model.wire_laws.wires,
            model.laws.series,
            model.laws.rest,
            q,
            frozen(np.ascontiguousarray(tension)),
            wire,
            np.ascontiguousarray(values["motion"]),
            width,
            load[: len(q)],
        )
        set_breakaway(*arguments)
    return found | {name: values[free] for name, free in WITHOUT_FRICTION.items() if free in values}
