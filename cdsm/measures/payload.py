"""Payload: the largest force at the tip that tensions balance and a deflection allows."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.measures.polytope import Farthest, balanced, force_polytope
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.stiffness_matrix import stiffness
from cdsm.support.format import coordinates
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import (
    NO_WRENCH,
    Direction,
    checked_quantity,
    instance,
    unit_direction,
    wrench_vector,
)
from cdsm.support.values import Array, frozen
from cdsm.tension import bounds_at, distribute_tension


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Payload(Result):
    """Largest admissible force at the tip, by two limits; made by :func:`payload`.

    The motors do different things at each limit. While the load comes they are locked, and the tip
    yields: ``limits["deflection"]``. Afterwards they re-distribute the tensions, so that the arm is
    in balance at its posture again: ``limits["tension"]``. An arm whose motors do both in turn
    carries ``force``; one whose motors stay locked is not limited by ``limits["tension"]``.

    Attributes:
        posture: The posture.
        direction: Unit direction (3,) of the force, base axes.
        worst: Whether ``direction`` is the worst of all directions.
        limits: Largest force [N] that each limit alone allows: ``"tension"`` (the bounds of the
            tensions) and ``"deflection"`` (0 if the arm is unstable without the force); inf for a
            limit that does not restrict it.
    """

    _headline = "force"

    posture: Posture
    direction: Array = field(metadata=unit("1", "axis"))
    worst: bool = field(metadata=unit("1"))
    limits: dict[str, float] = field(metadata=unit("N"))

    @quantity("N")
    def force(self) -> float:
        """The smallest of ``limits`` [N]; inf if none restricts the force."""
        return min(self.limits.values())

    @quantity("1")
    def limit(self) -> Literal["tension", "deflection", "none"]:
        """Which limit gives ``force``, a key of ``limits``; ``"none"`` if the force is inf."""
        if math.isinf(self.force):
            return "none"
        return "tension" if self.limits["tension"] == self.force else "deflection"

    def __str__(self) -> str:
        along = coordinates(np.round(self.direction, 3) + 0.0, ".3g")
        which = "the worst direction" if self.worst else "the direction"
        by_tension, by_deflection = (f"{self.limits[name]:.4g} N" for name in self.limits)
        return (
            f"{self.force:.4g} N in {which} {along}, limit: {self.limit}\n"
            f"tensions that the motors re-distribute allow {by_tension}, "
            f"the deflection with locked motors {by_deflection}"
        )


def payload(
    pose: Posture,
    direction: Direction | None = None,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: ArrayLike = NO_WRENCH,
    *,
    deflection: float = math.inf,
    worst_friction: bool = False,
) -> Payload:
    """Compute the largest admissible force f along u at the tip, added to the wrench W.

    Two limits are reported apart. Tension: the motors re-distribute the tensions,

        max f  subject to  J_Lᵀ F = J_Xᵀ W + f J_vᵀ u − g,  minimum ≤ F ≤ maximum.

    Deflection: the motors are locked at the least tensions without the force, and f |C_vv u| is at
    most ``deflection``, with their compliance C_vv. :func:`critical_load` gives the force at which
    the arm buckles.

    The worst direction has the smallest f. It is the normal of the nearest facet of the
    :func:`force_polytope`, or the softest direction of C_vv.

    Args:
        pose: The posture, which stays fixed.
        direction: u: an axis such as ``"-z"``, or (3,), any length; None: the worst direction.
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,); finite if the worst
            direction is wanted.
        wrench: W (6,) at ``tool0`` in base axes that always acts: force [N], then moment [N m].
        deflection: Largest allowed displacement of the tip [m]; inf for no limit.
        worst_friction: Narrow the bounds for friction, as :func:`~cdsm.distribute_tension` does.

    Raises:
        InvalidInput: An argument has the wrong shape or range; or a cable has no upper bound, but
            the worst direction is wanted.
        InfeasibleTension: No tensions balance the arm without the force.
        ElasticityRangeError: A tension without the force is outside the domain of its law.
        SingularStiffness: K_θ without the force is singular.
        CdsmError: A linear program fails.
    """
    instance("pose", pose, Posture)
    allowed = checked_quantity("deflection", deflection, "length", infinite=True)
    W = wrench_vector("wrench", wrench)
    K = stiffness(
        pose, distribute_tension(pose, minimum, maximum, W, worst_friction=worst_friction)
    )
    C = K.compliance[:3, :3] if K.is_stable else np.zeros((3, 3))
    bounds = bounds_at(pose, minimum, maximum, worst_friction)
    low = bounds.minimum_held
    high = bounds.maximum_held

    def limits(u: Array) -> dict[str, float]:
        yields = float(np.linalg.norm(C @ u))
        locked = allowed / yields if yields > 0.0 else math.inf
        tension = largest_force(balanced(pose, u[:, None], W, low, high))
        return {"tension": tension, "deflection": locked if K.is_stable else 0.0}

    if direction is not None:
        u = unit_direction("direction", direction)
        return Payload(posture=pose, direction=frozen(u), worst=False, limits=limits(u))
    polytope = force_polytope(pose, minimum, maximum, W, worst_friction=worst_friction)
    softest = np.linalg.svd(C)[2][0]
    tried = [(u, limits(u)) for u in (polytope.worst_direction, softest, -softest)]
    u, least = min(tried, key=lambda trial: sorted(trial[1].values()))
    return Payload(posture=pose, direction=frozen(u), worst=True, limits=least)


def largest_force(farthest: Farthest) -> float:
    """Return the largest force [N] along the one direction of ``farthest``; 0 if there is none."""
    solution = farthest(np.ones(1))
    if solution.status is Status.UNBOUNDED:
        return math.inf
    return max(float(solution.x[0]), 0.0) if solution.ok else 0.0
