"""Measures of many postures, from the arrays of a batch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from cdsm.batch import evaluate
from cdsm.manipulator import Manipulator
from cdsm.measures.clearance import KINDS, clearances
from cdsm.measures.payload import largest_force
from cdsm.measures.program import Loads, tension_ratio
from cdsm.support.values import Array
from cdsm.tension import checked_bounds

MEASURED: Final = ("tension_factor", *KINDS)
"""Measures of joint angles alone."""


def measured(
    arm: Manipulator, q: Array, names: Sequence[str], threads: int | None = None
) -> dict[str, Array]:
    """Compute measures of :data:`MEASURED` at postures (B, nv), (B,) each."""
    found: dict[str, Array] = {}
    if any(name in KINDS for name in names):
        found |= clearances(arm, q, threads=threads)
    if "tension_factor" in names:
        J = evaluate(arm, q, outputs=("length_jacobian",), threads=threads)["length_jacobian"]
        found["tension_factor"] = np.array([tension_ratio(each) for each in J])
    return {name: found[name] for name in names}


def payloads(
    arm: Manipulator, q: Array, wrench: Array, minimum: Array, maximum: float, directions: Array
) -> Array:
    """Compute the largest forces (B, D) [N] within the limits of the tensions.

    Postures q (B, nv) have a wrench (B, 6) and a lower bound (B,) each; the unit directions are
    (D, 3). A linear program for each takes about a millisecond.
    """
    names = ("jacobian", "length_jacobian", "gravity_torque")
    found = evaluate(arm, q, outputs=names, check_limits=False)
    force = np.empty((len(q), len(directions)))
    for n, (JX, J, g) in enumerate(zip(*(found[name] for name in names), strict=True)):
        low, high = checked_bounds(arm, minimum[n], maximum)
        torque = JX.T @ wrench[n] - g
        for d, u in enumerate(directions):
            motion = (JX[:3].T @ u)[:, None]
            loads = Loads.scaled(J, motion, torque, low, high, arm.length)
            force[n, d] = largest_force(loads)
    return force
