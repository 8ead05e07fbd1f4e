"""Compute measures (clearances, payloads, …) of many postures from the arrays of a batch."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm._former.arm_arrays import kernel_arrays, run_slices
from cdsm._former.chains import grip_rows
from cdsm._former.tree import Routing
from cdsm.batch import evaluate
from cdsm.batch.inputs import checked_threads
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.measures.clearance import KINDS, clearances
from cdsm.measures.closure import tension_factor_of
from cdsm.measures.forces import directions_of
from cdsm.measures.hull import hull_of
from cdsm.measures.payload import largest_force
from cdsm.measures.program import Loads
from cdsm.measures.simplex import payload_rows
from cdsm.support.validation import flag, quantity
from cdsm.support.values import Array
from cdsm.tension import checked_bounds

MEASURED: Final = ("tension_factor", *KINDS)
"""Measures that depend on the joint angles alone."""


def require(
    names: Collection[str],
    arm: Manipulator,
    maximum: ArrayLike,
    *,
    worst_friction: bool,
    diameter: float,
) -> None:
    """Raise InvalidInput if an argument of :func:`~cdsm.sweep` for measures is missing or invalid.

    ``names`` are the measures that the sweep computes.
    """
    if flag("worst_friction", worst_friction) and not arm.has_friction:
        raise InvalidInput(
            "worst_friction",
            f"{arm.name} has no friction in its holes; leave it out, or give them a coefficient: "
            "friction = in ARM.toml, --friction, Manipulator.with_friction.",
        )
    quantity("diameter", diameter, "diameter", zero=True)
    if "capacity_margin" in names and math.isinf(checked_bounds(arm, 0.0, maximum)[1].max()):
        raise InvalidInput("maximum", "capacity_margin needs a finite one [N].")


def measured(
    arm: Manipulator,
    q: Array,
    names: Sequence[str],
    diameter: float = 0.0,
    threads: int | None = None,
) -> dict[str, Array]:
    """Compute measures, (B,) each, at postures q (B, nv) [rad].

    ``names`` are those wanted, out of :data:`MEASURED`. All cables have the ``diameter`` [m].
    """
    found: dict[str, Array] = {}
    if any(name in KINDS for name in names):
        found |= clearances(arm, q, diameter, threads=threads)
    if "tension_factor" in names:
        J = evaluate(arm, q, outputs=("length_jacobian",), threads=threads)["length_jacobian"]
        found["tension_factor"] = np.array([tension_factor_of(each) for each in J])
    return {name: found[name] for name in names}


def friction_losses(arm: Manipulator, q: Array, threads: int | None = None) -> Array:
    """Compute exp(Σ μ φ) (B, C) [-] of each cable at postures q (B, nv) [rad].

    This is the largest ratio of two tensions along the cable. The sum is over its holes, with the
    friction coefficient μ and the wrap angle φ.
    """
    model, grip = kernel_arrays(arm), np.empty((len(q), len(arm.cables)))
    *routing, _, hole, own = model.chain_arrays
    holes = hole, own, arm._chains.cable[hole], arm._chains.friction

    def fill(part: slice) -> None:
        grip_rows(model.tree, Routing(*routing), *holes, q[part], grip[part])

    run_slices(fill, len(q), 1, checked_threads(threads))
    return np.exp(grip)


def narrowed_bounds(
    arm: Manipulator, minimum: ArrayLike, maximum: ArrayLike, loss: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Narrow the bounds of tension so that every segment of a cable stays within the given ones.

    ``loss`` (B, C) is the result of :func:`friction_losses`; bounds are given as (), (B,) or (B, C)
    [N]. Returns the lower and upper bounds (B, C) [N], and at which postures (B,) no lower bound is
    above its upper bound. At the other postures, the given bounds are returned.
    """
    given = _each_bound(arm, minimum, maximum, loss.shape)
    low, high = given[0] * loss, given[1] / loss
    exist = np.asarray((low <= high).all(axis=1))
    narrow = exist[:, None]
    return np.where(narrow, low, given[0]), np.where(narrow, high, given[1]), exist


def payloads(
    arm: Manipulator,
    q: Array,
    wrench: Array,
    minimum: ArrayLike,
    maximum: ArrayLike,
    directions: Array,
    threads: int | None = None,
) -> Array:
    """Compute the largest forces (B, D) [N] at the tip that tensions within the bounds balance.

    The forces act along the unit ``directions`` (D, 3) at postures q (B, nv) [rad], each with its
    own ``wrench`` (B, 6). The bounds are (), (B,) or (B, C) [N]. A force is 0 if tensions balance
    no force in its direction.
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
    """Compute how much more force the arm can balance in any direction, at postures q (B, nv).

    The result (B,) [N] is the distance of the force zero from the nearest facet of the force
    polytope (:meth:`ForcePolytope.margin`). It is 0 if tensions balance no force at all. Wrenches
    and bounds are given as for :func:`payloads`. Each posture takes some milliseconds.
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
    """Return J_X (B, 6, nv), J_L (B, C, nv), J_Xᵀ W − g (B, nv) and both bounds (B, C) [N].

    The arguments are as for :func:`payloads`.
    """
    names = ("jacobian", "length_jacobian", "gravity_torque")
    found = evaluate(arm, q, outputs=names, check_limits=False, threads=threads)
    JX, J, g = (found[name] for name in names)
    low, high = _each_bound(arm, minimum, maximum, (len(q), len(arm.cables)))
    return JX, J, np.einsum("nij,ni->nj", JX, wrench) - g, low, high


def _each_bound(
    arm: Manipulator, minimum: ArrayLike, maximum: ArrayLike, shape: tuple[int, int]
) -> tuple[Array, Array]:
    """Return bounds given as (), (B,) or (B, C) [N], checked and in the ``shape`` (B, C)."""
    bounds = (np.asarray(bound, dtype=np.float64) for bound in (minimum, maximum))
    low, high = (np.broadcast_to(b[:, None] if b.ndim == 1 else b, shape) for b in bounds)
    return checked_bounds(arm, low, high, shape[0])
