"""Measures of many postures, from the arrays of a batch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.batch import evaluate
from cdsm.batch.inputs import checked_threads, run_slices
from cdsm.manipulator import Manipulator
from cdsm.measures.clearance import KINDS, clearances
from cdsm.measures.forces import directions_of
from cdsm.measures.hull import hull_of
from cdsm.measures.payload import largest_force
from cdsm.measures.program import Loads, tension_ratio
from cdsm.measures.simplex import payload_rows
from cdsm.support.values import Array
from cdsm.tension import checked_bounds

MEASURED: Final = ("tension_factor", *KINDS)
"""Measures that depend on the joint angles alone."""


def measured(
    arm: Manipulator, q: Array, names: Sequence[str], threads: int | None = None
) -> dict[str, Array]:
    """Compute measures of :data:`MEASURED` at postures q (B, nv); return (B,) for each name."""
    found: dict[str, Array] = {}
    if any(name in KINDS for name in names):
        found |= clearances(arm, q, threads=threads)
    if "tension_factor" in names:
        J = evaluate(arm, q, outputs=("length_jacobian",), threads=threads)["length_jacobian"]
        found["tension_factor"] = np.array([tension_ratio(each) for each in J])
    return {name: found[name] for name in names}


def payloads(
    arm: Manipulator,
    q: Array,
    wrench: Array,
    minimum: ArrayLike,
    maximum: ArrayLike,
    directions: Array,
    threads: int | None = None,
) -> Array:
    """Compute the largest forces (B, D) [N] within the limits of the tensions.

    Postures q (B, nv) have a wrench (B, 6) and bounds each, (B,) or (B, C); the unit directions are
    (D, 3).
    """
    JX, J, torque, low, high = _balances(arm, q, wrench, minimum, maximum, threads)
    motion = np.einsum("nij,di->ndj", JX[:, :3], directions)
    force = np.empty(motion.shape[:2])

    def fill(part: slice) -> None:
        ends = low[part], high[part]
        payload_rows(J[part], torque[part], motion[part], *ends, arm.length, force[part])

    run_slices(fill, len(q), 1, checked_threads(threads))
    for n, d in np.argwhere(np.isnan(force)).tolist():  # what the kernel does not prove
        loads = Loads.scaled(J[n], motion[n, d][:, None], torque[n], low[n], high[n], arm.length)
        force[n, d] = largest_force(loads)
    return force


def capacity_margins(
    arm: Manipulator, q: Array, wrench: Array, minimum: ArrayLike, maximum: ArrayLike
) -> Array:
    """Compute the distances (B,) [N] of no force from the facets of the force polytopes.

    Arguments are those of :func:`payloads`; a posture takes milliseconds.
    """
    margin = np.empty(len(q))
    rows = zip(*_balances(arm, q, wrench, minimum, maximum, None), strict=True)
    for n, (JX, J, torque, low, high) in enumerate(rows):
        basis, _ = directions_of(JX, arm.length)
        hull = hull_of(Loads.scaled(J, JX[:3].T @ basis, torque, low, high, arm.length))
        margin[n] = 0.0 if hull is None else hull.offsets.min(initial=math.inf)
    return margin


def _balances(
    arm: Manipulator,
    q: Array,
    wrench: Array,
    minimum: ArrayLike,
    maximum: ArrayLike,
    threads: int | None,
) -> tuple[Array, Array, Array, Array, Array]:
    """Return J_X, J_L, the torques J_Xᵀ W − g, and the bounds (B, C) of postures."""
    names = ("jacobian", "length_jacobian", "gravity_torque")
    found = evaluate(arm, q, outputs=names, check_limits=False, threads=threads)
    JX, J, g = (found[name] for name in names)
    shape = len(q), len(arm.cables)
    least, most = (np.asarray(bound, dtype=np.float64) for bound in (minimum, maximum))
    low, high = checked_bounds(arm, _each(least, shape), _each(most, shape), len(q))
    return JX, J, np.einsum("nij,ni->nj", JX, wrench) - g, low, high


def _each(bound: Array, shape: tuple[int, int]) -> Array:
    """Return a bound of each row, (), (B,) or (B, C), for each cable."""
    return np.broadcast_to(bound[:, None] if bound.ndim == 1 else bound, shape)
