"""The tensions that balance an arm within bounds and domains. The one that asks for small QPs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple, NoReturn

import numpy as np
import qpsolvers
from numpy.typing import ArrayLike

from cdsm.arm_model import kinks
from cdsm.errors import ElasticityRangeError
from cdsm.posture import Posture
from cdsm.support.validation import Array, frozen
from cdsm.tension import Tension, distribute_tension

_TOLERANCE = 1e-12
"""Primal tolerance of the solver; all its variables are of the order of one."""

_KEPT = 1e-9
"""By how much an equation is missed at most; the solver may call found what misses it by far."""

_FLAT = 1e-10
"""Singular values of J_Lᵀ below this part of the largest do not count."""


class Optimum(NamedTuple):
    """The answer of a quadratic program.

    Attributes:
        x: Its variables.
        y: Multipliers of the equations.
        z: Multipliers of the cuts, not negative.
    """

    x: Array
    y: Array
    z: Array


@dataclass(frozen=True, eq=False)
class Admissible:
    """Tensions F with J_Lᵀ F = τ and low ≤ F ≤ high, in the domains of their elasticities.

    Attributes:
        least: The least of them (Eq. 17).
        asked: Bounds (C,) [N] that were asked for.
        low: Lower bounds (C,) [N], the domains included.
        high: Upper bounds (C,) [N], the domains included; may hold inf.
        scale: A tension of the size of the least ones [N].
        rows: Orthonormal rows (r, C) that span those of J_Lᵀ.
        null: Orthonormal basis (C, p) of what changes no torque.
        jumps: For each cable the tensions [N] at which its rigidity jumps, or its slope does.
    """

    least: Tension
    asked: tuple[Array, Array]
    low: Array
    high: Array
    scale: float
    rows: Array
    null: Array
    jumps: tuple[tuple[float, ...], ...]

    def piece(self, F: Array) -> tuple[Array, Array]:
        """Bounds (C,) [N] around tensions F (C,) [N] between which no rigidity jumps or bends."""
        low, high = self.low.copy(), self.high.copy()
        for c, jumps in enumerate(self.jumps):
            for jump in jumps:
                if F[c] <= jump:
                    high[c] = min(high[c], jump)
                else:
                    low[c] = max(low[c], np.nextafter(jump, np.inf))
        return low, high

    def imbalance(self, F: Array) -> Array:
        """What rows·F misses (r,) [N]."""
        missing: Array = self.rows @ (self.least.values - F)
        return missing

    def nearest(self, wanted: Array, low: Array, high: Array) -> Array | None:
        """The balancing tensions (C,) [N] between bounds nearest to those wanted, if there are."""
        size = max(self.scale, float(abs(wanted).max()))
        found = solve(
            np.eye(wanted.size),
            -wanted / size,
            (self.rows, self.rows @ self.least.values / size),
            (low / size, high / size),
        )
        return None if found is None else np.minimum(np.maximum(found.x * size, low), high)

    def capped(self, limit: float) -> Admissible:
        """The same with no tension above a limit [N]."""
        return replace(self, high=np.minimum(self.high, limit))

    def within(self, reach: Array, of: Array) -> Admissible | None:
        """The same within a reach (C,) [N] of tensions (C,) [N], if any of them balance the arm."""
        low, high = np.maximum(self.low, of - reach), np.minimum(self.high, of + reach)
        least = self.nearest(np.zeros_like(of), low, high) if (low <= high).all() else None
        if least is None:
            return None
        moved = (least - self.least.values) @ self.least.posture.length_jacobian
        residual = frozen(self.least.residual + moved)
        return replace(
            self,
            least=replace(self.least, values=frozen(least), residual=residual),
            low=low,
            high=high,
            jumps=tuple(
                tuple(jump for jump in jumps if a <= jump < b)
                for jumps, a, b in zip(self.jumps, low, high, strict=True)
            ),
        )

    def tension(self, F: Array) -> Tension:
        """Tensions F (C,) [N], their balance exact again, with the question they answer."""
        least = self.least
        exact = self.nearest(F, *self.piece(F))  # steps far shorter than F leave a rounding of F
        F = F if exact is None else exact
        torque = least.values @ least.posture.length_jacobian - least.residual
        return replace(
            least,
            values=frozen(F),
            minimum=self.asked[0],
            maximum=self.asked[1],
            residual=frozen(F @ least.posture.length_jacobian - torque),
            least=False,
        )


def admissible(
    pose: Posture, minimum: ArrayLike, maximum: ArrayLike, wrench: ArrayLike
) -> Admissible:
    """The admissible tensions of an arm at a posture.

    Raises:
        InvalidInput: As for :func:`~cdsm.distribute_tension`.
        InfeasibleTension: No tension within the bounds and domains balances the arm.
        ElasticityRangeError: The bounds leave nothing of the domain of a cable's elasticity.
    """
    asked = distribute_tension(pose, minimum, maximum, wrench)
    cables = pose.arm.cables
    # an elasticity says nothing about a cable whose motor holds the force
    held = np.array([cable.control == "position" for cable in cables])
    first = np.array([cable.elasticity.domain.first for cable in cables])
    last = np.array([cable.elasticity.domain.high for cable in cables])
    low = np.where(held, np.maximum(asked.minimum, first), asked.minimum)
    high = np.where(held, np.minimum(asked.maximum, last), asked.maximum)
    outside = np.flatnonzero(low > high).tolist()
    if outside:
        _refuse(asked, outside)
    least = asked
    if ((asked.values < low) | (asked.values > high)).any():
        least = distribute_tension(pose, low, high, wrench)
    _, values, right = np.linalg.svd(pose.length_jacobian.T)
    rank = int((values > _FLAT * values.max(initial=0.0)).sum())
    return Admissible(
        least=least,
        asked=(asked.minimum, asked.maximum),
        low=low,
        high=high,
        scale=float(least.values.max()) or 1.0,
        rows=right[:rank].copy(),
        null=right[rank:].T.copy(),
        jumps=tuple(
            tuple(jump for jump in kinks(cable.elasticity) if a <= jump < b) if fixed else ()
            for cable, fixed, a, b in zip(cables, held, low, high, strict=True)
        ),
    )


def solve(
    P: Array,
    q: Array,
    equations: tuple[Array, Array],
    bounds: tuple[Array, Array],
    cuts: tuple[Array, Array] | None = None,
) -> Optimum | None:
    """Min ½xᵀPx + qᵀx so that A x = b, low ≤ x ≤ high and G x ≤ h; None if none is found.

    Args:
        P: Positive definite (n, n).
        q: (n,).
        equations: A and b.
        bounds: low and high, may be infinite.
        cuts: G and h.
    """
    (A, b), (low, high) = equations, bounds
    G, h = cuts if cuts is not None else (None, None)
    problem = qpsolvers.Problem(P, q, G=G, h=h, A=A, b=b, lb=low, ub=high)
    solution = qpsolvers.solve_problem(problem, "daqp", primal_tol=_TOLERANCE)
    x, y, z = solution.x, solution.y, solution.z
    if not solution.found or x is None or y is None or not np.isfinite(x).all():
        return None
    if abs(A @ x - b).max(initial=0.0) > _KEPT:  # it is not always told that there is none
        return None
    return Optimum(x, y, np.zeros(0) if z is None else z)


def _refuse(asked: Tension, outside: list[int]) -> NoReturn:
    cables = [asked.posture.arm.cables[c] for c in outside]
    domains = [cable.elasticity.domain for cable in cables]
    raise ElasticityRangeError(
        f"nothing between minimum and maximum is in the domain {domains[0]} of the elasticity. "
        "Change minimum= or maximum=, or use an elasticity that covers them.",
        [
            asked.maximum[c] if asked.maximum[c] < domain.first else asked.minimum[c]
            for c, domain in zip(outside, domains, strict=True)
        ],
        outside,
        [cable.name for cable in cables],
    )
