"""Payload: the largest force at the tip that tensions balance and a deflection allows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.measures.forces import ForcePolytope, force_polytope
from cdsm.measures.program import Loads
from cdsm.posture import Posture
from cdsm.stiffness_matrix import stiffness
from cdsm.support.directions import Direction, unit_direction
from cdsm.support.format import coordinates, plain
from cdsm.support.validation import NO_WRENCH, instance, quantity, wrench_vector
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import bounds_at, distribute_tension

PayloadLimit = Literal["tension", "deflection", "none"]


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Payload(ReadOnlyState):
    """Largest admissible force at the tip; made by :func:`payload`.

    Attributes:
        posture: The posture.
        direction: Unit direction (3,) of the force, base axes.
        worst: Whether ``direction`` is the worst of all directions.
        force: The largest force [N]: the smallest of ``limits``.
        limit: Which limit gives ``force``, a key of ``limits``; ``"none"`` if the force is inf.
        limits: Largest force [N] that each limit alone allows: ``"tension"`` (the bounds of the
            tensions) and ``"deflection"`` (0 if the arm is unstable without the force); inf for a
            limit that does not restrict it.
    """

    posture: Posture
    direction: Array
    worst: bool
    force: float
    limit: PayloadLimit
    limits: dict[str, float]

    def to_dict(self) -> dict[str, object]:
        """Return force, direction and limits in SI for JSON, with units in the keys."""
        numbers = {
            **self.posture._coordinates,
            "direction": self.direction,
            "worst": self.worst,
            "force_N": self.force,
            "limit": self.limit,
            "limits_N": self.limits,
        }
        return plain(numbers)

    def __repr__(self) -> str:
        return f"<Payload {self}>"

    def __str__(self) -> str:
        along = coordinates(np.round(self.direction, 3) + 0.0, ".3g")
        which = "the worst direction" if self.worst else "the direction"
        return f"{self.force:.4g} N in {which} {along}, limit: {self.limit}"


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

        max f  subject to  J_Lᵀ F = J_Xᵀ W + f J_vᵀ u − g,  minimum ≤ F ≤ maximum.

    The deflection f |C_vv u| is at most ``deflection``. C_vv is the compliance without the force,
    under the least tensions. :func:`critical_load` gives the force at which the arm buckles.

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
        SolverError: A linear program fails.
    """
    instance("pose", pose, Posture)
    allowed = quantity("deflection", deflection, "length", infinite=True)
    W = wrench_vector("wrench", wrench)
    bare = distribute_tension(pose, minimum, maximum, W, worst_friction=worst_friction)
    K = stiffness(pose, bare)
    compliance = K.compliance[:3, :3] if K.is_stable else np.zeros((3, 3))
    low, high = bounds_at(pose, minimum, maximum, worst_friction)
    if direction is None:
        polytope = force_polytope(pose, minimum, maximum, W, worst_friction=worst_friction)
        u, limits = _worst(polytope, compliance, allowed)
    else:
        u = unit_direction("direction", direction)
        limits = {
            "tension": largest_force(Loads.of(pose, low, high, W, u[:, None])),
            "deflection": _ratio(allowed, float(np.linalg.norm(compliance @ u))),
        }
    if not K.is_stable:
        limits["deflection"] = 0.0
    reason = min(limits, key=lambda name: limits[name])
    force = max(limits[reason], 0.0)
    return Payload(
        posture=pose,
        direction=frozen(u),
        worst=direction is None,
        force=force,
        limit="none" if math.isinf(force) else reason,  # type: ignore[arg-type]
        limits=limits,
    )


def largest_force(loads: Loads) -> float:
    """Return the largest force [N] along the one direction of ``loads``; 0 if none is balanced."""
    found = loads.largest(np.ones(1), positive=True)
    return 0.0 if found is None else found[0]


def _worst(
    polytope: ForcePolytope, compliance: Array, allowed: float
) -> tuple[Array, dict[str, float]]:
    """Return the worst direction for tension and deflection, and the forces [N] that they allow.

    ``polytope`` has the forces that tensions balance. ``compliance`` is C_vv (3, 3) [m/N], and
    ``allowed`` the largest deflection [m].
    """
    tension = polytope.margin()
    values, vectors = np.linalg.eigh(compliance.T @ compliance)
    softest = _ratio(allowed, math.sqrt(max(float(values[-1]), 0.0)))
    if softest >= tension:
        u = polytope.worst_direction
        deflection = _ratio(allowed, float(np.linalg.norm(compliance @ u)))
        return u, {"tension": tension, "deflection": deflection}
    u = vectors[:, -1]
    slopes = polytope.normals @ u
    facing = slopes > 0.0
    margin = float((polytope.offsets[facing] / slopes[facing]).min(initial=math.inf))
    return u, {"tension": margin, "deflection": softest}


def _ratio(allowed: float, compliance: float) -> float:
    return allowed / compliance if compliance > 0.0 and math.isfinite(allowed) else math.inf
