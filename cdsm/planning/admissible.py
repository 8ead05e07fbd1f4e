"""The set of tensions that balance an arm within limits, and a solver of small quadratic programs.

Admissible tensions balance the arm (Eq. 13). They lie within the bounds of the caller, and within
the domain of each elasticity: the tensions for which EA(F) is defined.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import daqp
import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import ElasticityRangeError
from cdsm.posture import Posture
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension, distribute_tension

_TOLERANCE = 1e-12  # primal tolerance of the solver; all its variables are of order one
_INFINITE, _EQUATION = 1e30, 5  # DAQP's infinity, and its flag for equations
_SOLVED = 1e-9  # largest residual of an equation: the solver may report success with a larger one
_FLAT = 1e-10  # singular values of J_Lᵀ below this part of the largest count as zero


class Optimum(NamedTuple):
    """Solution x of the QP of :func:`solve`, with multipliers y of A x = b and z ≥ 0 of G x ≤ h."""

    x: Array
    y: Array
    z: Array


@dataclass(frozen=True, eq=False)
class Admissible:
    """The set of admissible tensions F (C,) [N] at a posture under a load.

    F balances the arm, J_Lᵀ F = J_Xᵀ W − g (Eq. 13), and low ≤ F ≤ high.
    """

    least: Tension  # the least admissible tensions (Eq. 17), with the bounds of the caller
    low: Array  # lower bounds (C,) [N], within the domains of the elasticities
    high: Array  # upper bounds (C,) [N], within the domains; inf if there is none
    scale: float  # largest of the least tensions [N], or 1 N if all are zero
    rows: Array  # orthonormal basis (r, C) of the row space of J_Lᵀ, whose rank is r
    null: Array  # orthonormal basis (C, p) of the null space of J_Lᵀ, p = C − r

    def imbalance(self, F: Array) -> Array:
        """Return the error (r,) [N] of the balance under F (C,) [N]; zero if F balances the arm.

        It is the least tensions minus F, in the orthonormal basis ``rows`` of the row space of
        J_Lᵀ.
        """
        return np.asarray(self.rows @ (self.least.values - F))

    def nearest(self, wanted: Array, low: Array, high: Array) -> Array | None:
        """Return the tensions (C,) [N] nearest to ``wanted`` (C,) that balance the arm.

        They lie within the bounds ``low`` and ``high`` (C,) [N]. The result is None if no tensions
        within these bounds balance the arm.
        """
        size = max(self.scale, float(abs(wanted).max()))
        found = solve(
            np.eye(wanted.size),
            -wanted / size,
            (self.rows, self.rows @ self.least.values / size),
            (low / size, high / size),
        )
        return None if found is None else np.minimum(np.maximum(found.x * size, low), high)

    def within(self, change: Array, F: Array) -> Admissible | None:
        """Return the set of admissible tensions within F ± ``change`` (C,) [N]; None if empty."""
        low, high = np.maximum(self.low, F - change), np.minimum(self.high, F + change)
        least = self.nearest(np.zeros_like(F), low, high) if (low <= high).all() else None
        if least is None:
            return None
        return replace(self, least=replace(self.least, values=frozen(least)), low=low, high=high)

    def tension(self, F: Array) -> Tension:
        """Return F (C,) [N] as a :class:`Tension`, without the rounding errors of its balance."""
        exact = self.nearest(F, self.low, self.high)  # removes the rounding of short steps
        values = frozen(F if exact is None else exact)
        return replace(self.least, values=values, least=False)


def admissible(
    pose: Posture, minimum: ArrayLike, maximum: ArrayLike, wrench: ArrayLike
) -> Admissible:
    """Find the set of admissible tensions at a posture under a load.

    :func:`~cdsm.distribute_tension` explains the arguments.

    Raises:
        InfeasibleTension: No tensions within the bounds and domains balance the arm.
        ElasticityRangeError: The bounds and the domain of an elasticity do not overlap.
    """
    least = distribute_tension(pose, minimum, maximum, wrench)
    minimum, maximum, cables = least.minimum, least.maximum, pose.arm.cables
    # a force-controlled cable does not use its elasticity, so its domain does not matter
    first = np.array([cable.elasticity.low for cable in cables])
    last = np.array([cable.elasticity.high for cable in cables])
    low = np.where(cables.position_controlled, np.maximum(minimum, first), minimum)
    high = np.where(cables.position_controlled, np.minimum(maximum, last), maximum)
    outside = np.flatnonzero(low > high)
    if outside.size:
        raise ElasticityRangeError(
            f"nothing between minimum= and maximum= is in the domain "
            f"{cables[outside[0]].elasticity._span} of the elasticity. Change minimum= or "
            "maximum=, or use an elasticity that covers them.",
            np.where(maximum < first, maximum, minimum)[outside].tolist(),
            outside.tolist(),
            [cables[c].name for c in outside],
        )
    if ((least.values < low) | (least.values > high)).any():
        least = distribute_tension(pose, low, high, wrench)
        least = replace(least, minimum=minimum, maximum=maximum)
    _, values, right = np.linalg.svd(pose.length_jacobian.T)
    rank = int((values > _FLAT * values.max(initial=0.0)).sum())
    scale = float(least.values.max()) or 1.0
    return Admissible(least, low, high, scale, right[:rank].copy(), right[rank:].T.copy())


def solve(
    P: Array,
    q: Array,
    equations: tuple[Array, Array],
    bounds: tuple[Array, Array],
    cuts: tuple[Array, Array] | None = None,
) -> Optimum | None:
    """Solve min ½xᵀPx + qᵀx with A x = b, low ≤ x ≤ high and G x ≤ h; return None on failure.

    ``equations`` are A and b, ``bounds`` are low and high, ``cuts`` are G and h. P is positive
    definite. DAQP is called directly: through qpsolvers a plan would take a quarter longer.
    """
    (A, b), (low, high) = equations, bounds
    G, h = cuts if cuts is not None else (A[:0], b[:0])
    first, last = len(q), len(q) + len(h)  # multipliers: bounds, cuts, equations
    kind = np.zeros(last + len(b), dtype=np.int32)
    kind[last:] = _EQUATION
    x, _, flag, info = daqp.solve(
        P,
        q,
        np.concatenate([G, A]),
        np.concatenate([high, h, b]),
        np.concatenate([low, np.full(last + len(b) - first, -_INFINITE)]),
        kind,
        primal_tol=_TOLERANCE,
    )
    if flag <= 0 or not np.isfinite(x).all():
        return None
    if abs(A @ x - b).max(initial=0.0) > _SOLVED:  # the solver does not always notice
        return None
    return Optimum(x, info["lam"][last:], info["lam"][first:last])
