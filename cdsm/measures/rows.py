"""Compute measures (clearances, payloads, …) of many postures, for sweeps and designs."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.measures.clearance import KINDS, distances
from cdsm.measures.indices import tension_factor
from cdsm.measures.payload import largest_force
from cdsm.measures.polytope import balanced, polytope_of
from cdsm.posture import Posture
from cdsm.support.validation import flag, quantity
from cdsm.support.values import Array
from cdsm.tension import checked_bounds, grip

MEASURED: Final = ("tension_factor", *KINDS)
"""Measures that depend on the joint angles alone."""

SLOW: Final = frozenset((*MEASURED, "payload", "force_radius"))
"""Measures that take some milliseconds a posture."""


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
            "friction = in ARM.toml, --set friction=0.1, Manipulator.with_friction.",
        )
    quantity("diameter", diameter, "diameter", zero=True)
    if "force_radius" in names and math.isinf(checked_bounds(arm, 0.0, maximum)[1].max()):
        raise InvalidInput("maximum", "force_radius needs a finite one [N].")


def measured(
    arm: Manipulator, q: Array, names: Sequence[str], diameter: float = 0.0
) -> dict[str, Array]:
    """Compute measures, (B,) each, at postures q (B, nv) [rad], some milliseconds each.

    ``names`` are those wanted, out of :data:`MEASURED`. All cables have the ``diameter`` [m].
    """
    kinds = [name for name in names if name in KINDS]
    found = {name: np.empty(len(q)) for name in names}
    for n, row in enumerate(q if names else ()):
        pose = arm.at(row)
        if kinds:
            for kind, nearest in distances(pose, diameter, kinds=kinds).items():
                found[kind][n] = nearest.distance
        if "tension_factor" in found:
            found["tension_factor"][n] = tension_factor(pose)
    return found


def friction_losses(arm: Manipulator, q: Array) -> Array:
    """Compute exp(Σ μ φ) (B, C) [-] of each cable at postures q (B, nv) [rad].

    This is the largest ratio of two tensions along the cable. The sum is over its holes, with the
    friction coefficient μ and the wrap angle φ.
    """
    found = [grip(arm.at(row)) for row in q]
    return np.exp(np.reshape(found, (len(q), len(arm.cables))))


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
) -> Array:
    """Compute the largest forces (B, D) [N] at the tip that tensions within the bounds balance.

    The forces act along the unit ``directions`` (D, 3) at postures q (B, nv) [rad], each with its
    own ``wrench`` (B, 6). The bounds are (), (B,) or (B, C) [N]. A force is 0 if tensions balance
    no force in its direction.
    """
    rows = _balances(arm, q, wrench, minimum, maximum)
    found = [
        [largest_force(balanced(pose, u[:, None], *row)) for u in directions] for pose, *row in rows
    ]
    return np.reshape(found, (len(q), len(directions)))


def force_radii(
    arm: Manipulator, q: Array, wrench: Array, minimum: ArrayLike, maximum: ArrayLike
) -> Array:
    """Compute how much more force the arm can balance in any direction, at postures q (B, nv).

    The result (B,) [N] is :attr:`ForcePolytope.radius`, or 0 if tensions balance no force at all.
    Wrenches and bounds are given as for :func:`payloads`. Each posture takes some 20 ms.
    """
    found = [polytope_of(*row) for row in _balances(arm, q, wrench, minimum, maximum)]
    return np.array([each.offsets.min(initial=math.inf) if each else 0.0 for each in found])


def _balances(
    arm: Manipulator, q: Array, wrench: Array, minimum: ArrayLike, maximum: ArrayLike
) -> Iterator[tuple[Posture, Array, Array, Array]]:
    """Yield the posture, the wrench (6,) and both bounds (C,) of each of ``q`` (B, nv)."""
    bounds = _each_bound(arm, minimum, maximum, (len(q), len(arm.cables)))
    for row, *given in zip(q, wrench, *bounds, strict=True):
        yield arm.at(row, check_limits=False), *given


def _each_bound(
    arm: Manipulator, minimum: ArrayLike, maximum: ArrayLike, shape: tuple[int, int]
) -> tuple[Array, Array]:
    """Return bounds given as (), (B,) or (B, C) [N], checked and in the ``shape`` (B, C)."""
    bounds = (np.asarray(bound, dtype=np.float64) for bound in (minimum, maximum))
    low, high = (np.broadcast_to(b[:, None] if b.ndim == 1 else b, shape) for b in bounds)
    return checked_bounds(arm, low, high, shape[0])
