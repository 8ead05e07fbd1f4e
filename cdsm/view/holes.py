"""Marks of the holes in which cables stick or slide: short lines along the cable."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cdsm.friction.capstan import can_stick
from cdsm.posture import Posture
from cdsm.support.values import Array

_BEAD = 0.013  # half the length of the mark of a hole, as a fraction of the arm's length


def hole_lines(pose: Posture, sliding: NDArray[np.bool_] | None) -> tuple[Array, Array]:
    """Return lines (n, 2, 3) [m] at the holes where cables stick, and where they slide.

    ``sliding`` (P,) tells which holes slide; None: no cable has moved.
    """
    sticks = can_stick(pose)
    slides = np.zeros_like(sticks) if sliding is None else sliding
    points, along = pose.segments.hole_places(pose.placements)
    beads = _BEAD * pose.arm.length * along
    lines = points[:, None] + np.stack([-beads, beads], axis=1)
    return lines[sticks & ~slides], lines[slides]
