"""Payload: the largest force at the tip that tensions balance and a deflection allows."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.applied import Applied, Loaded, jacobian_at
from cdsm.dead_loads import LinkPoint
from cdsm.errors import InfeasibleTension
from cdsm.loads import LoadsLike, link_point, loads_of
from cdsm.measures.holding import Holding, holding_following, holding_locked
from cdsm.measures.polytope import Farthest, balanced, force_polytope
from cdsm.motors import refuse_shared
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.stiffness_matrix import checked_tension, stiffness
from cdsm.support.format import coordinates
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import (
    NO_WRENCH,
    Direction,
    checked_quantity,
    instance,
    unit_direction,
)
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension, bounds_at, distribute_tension


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Payload(Result, Loaded):
    """Largest admissible force at the tip; made by :func:`payload`.

    The motors decide it. While they *follow*, they re-distribute the tensions, and the arm keeps
    its posture: :attr:`following`. While they are *locked*, they hold the wire, and the arm yields:
    :attr:`locked`. The two can differ by a factor of three.

    ``limits`` are those of an arm whose motors are locked while the load comes, and then follow:
    ``"deflection"`` while it yields, ``"tension"`` after that. ``force`` is the smaller one.

    Attributes:
        posture: The posture.
        direction: Unit direction (3,) of the force, base axes.
        worst: Whether ``direction`` is the worst of all directions.
        limits: Largest force [N] that each limit alone allows: ``"tension"`` (the bounds of the
            tensions) and ``"deflection"`` (to first order; 0 if the arm is unstable without the
            force); inf for a limit that does not restrict it. 0 if no tensions balance the arm
            without the force.
        applied: What always acts: W (6,) at the tip, or loads on links.
        minimum: Lower bounds of the tensions that hold (C,) [N].
        maximum: Upper bounds of the tensions that hold (C,) [N]; inf for none.
        tension: Tensions (C,) [N] without the force at which the motors are locked; None if there
            are none.
        problem: Why no tensions balance the arm without the force; empty if some do.
        point: Where the force acts and the deflection is read; None: the tip.
        deflection: Largest allowed displacement [m]; inf for no limit.
    """

    _headline = "force"

    posture: Posture
    direction: Array = field(metadata=unit("1", "axis"))
    worst: bool = field(metadata=unit("1"))
    limits: dict[str, float] = field(metadata=unit("N"))
    applied: Applied
    minimum: Array
    maximum: Array
    tension: Array | None
    problem: str = ""
    point: LinkPoint | None = None
    deflection: float = field(default=math.inf, metadata=unit("m"))

    @property
    def warnings(self) -> tuple[str, ...]:
        """The sentence why no tensions balance the arm without the force, if none do."""
        return (self.problem,) if self.problem else ()

    @quantity("1")
    def following(self) -> Holding | None:
        """What it holds while motors re-distribute the tensions; computed when first asked for.

        Limits are the bounds of the tensions, the ends of the laws and the stability of the arm
        under the least tensions, as in :func:`~cdsm.critical_load`. None if no tensions balance the
        arm without the force.
        """
        bounds = self.minimum, self.maximum
        return holding_following(self.posture, self.direction, self.applied, *bounds, self.point)

    @quantity("1")
    def locked(self) -> Holding | None:
        """What it holds with locked motors; computed when first asked for.

        The force grows slowly, without friction. The first of these ends it: a tension passes its
        maximum or leaves its law, a joint reaches its stop, the arm buckles. Cables that go slack
        before are among the events. None if no tensions balance the arm without the force.
        """
        if self.tension is None:
            return None
        case = self.posture, self.direction, self.applied
        return holding_locked(*case, self.tension, self.maximum, self.point)

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
        which = "worst direction" if self.worst else "direction"
        cases = [str(case) for case in (self.following, self.locked) if case is not None]
        where = f", force on {self.point.link}" if self.point else ""
        lines = [*self.warnings, f"{which} {along}{where}", *cases]
        if math.isfinite(self.deflection) and not self.problem:
            most = self.limits["deflection"]
            allowed = f"{most:.4g} N" if most < math.inf else "any force, which moves nothing"
            lines.append(f"deflection allows {allowed} with locked motors, to first order")
        return "\n".join(lines)


def payload(
    pose: Posture,
    direction: Direction | None = None,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: LoadsLike = NO_WRENCH,
    *,
    deflection: float = math.inf,
    worst_friction: bool = False,
    tension: Tension | ArrayLike | None = None,
    link: str | None = None,
    point: ArrayLike | None = None,
) -> Payload:
    """Compute the largest admissible force f along u at the tip, added to the wrench W.

    :attr:`Payload.following` and :attr:`Payload.locked` say how much it holds, and what ends it,
    with motors that follow and with locked ones; in kg too where u is the direction of gravity.
    Two limits are numbers of their own. Tension: the motors re-distribute the tensions,

        `max f`  subject to  `J_Lᵀ F = J_Xᵀ W + f J_vᵀ u − g`,  `minimum ≤ F ≤ maximum`.

    Deflection: the motors are locked at the least tensions without the force, and `f |C_vv u|` is
    at most ``deflection``, with their compliance `C_vv`.

    The worst direction has the smallest f. It is the normal of the nearest facet of the
    :func:`force_polytope`, or the softest direction of `C_vv`.

    Args:
        pose: The posture, which stays fixed.
        direction: u: an axis such as ``"-z"``, or (3,), any length; None: the worst direction.
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,); finite if the worst
            direction is wanted.
        wrench: W (6,) at ``tool0`` in base axes that always acts: force [N], then moment [N m]. Or
            loads on links, as for :func:`~cdsm.distribute_tension`.
        deflection: Largest allowed displacement of the tip [m]; inf for no limit.
        worst_friction: Narrow the bounds for friction, as :func:`~cdsm.distribute_tension` does.
        tension: F (C,) [N] at which the motors of :attr:`Payload.locked` are locked. Tensions that
            do not balance the arm move it first. Default: the least ones without the force.
        link: Link on which the force acts and of which the deflection is read; None: the tip.
        point: Where on it (3,) [m], as for :class:`~cdsm.Load`.

    Raises:
        InvalidInput: An argument has the wrong shape or range; or a cable has no upper bound, but
            the worst direction is wanted.
        InfeasibleTension: The worst direction is wanted, and no tensions balance the arm without
            the force. With a direction, the limits are 0 and :attr:`Payload.problem` says why.
        ElasticityRangeError: A tension without the force is outside the domain of its law.
        SingularStiffness: `K_θ` without the force is singular.
        CdsmError: A linear program fails.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> print(cdsm.payload(pose, "-y", minimum=5.0, maximum=100.0))
        direction (0, -1, 0)
        motors follow: 50.24 N (5.121 kg), limit: maximum of cable2_1 (100 N)
        motors locked: 52.05 N (5.306 kg), limit: maximum of cable2_1 (100 N)
    """
    instance("pose", pose, Posture)
    remedy = "weight_test and equilibrium say what it bears with locked motors."
    refuse_shared(pose.arm.motors, "payload", remedy)
    allowed = checked_quantity("deflection", deflection, "length", infinite=True)
    W = loads_of(pose.arm, wrench)
    at = link_point(pose.arm, link, point)
    bounds = bounds_at(pose, minimum, maximum, worst_friction)
    low = bounds.minimum_held
    high = bounds.maximum_held
    locked = None if tension is None else checked_tension(pose, tension, None)[0]
    case: Any = {"posture": pose, "applied": W, "minimum": low, "maximum": high, "point": at}
    case["deflection"] = allowed
    try:
        least = distribute_tension(pose, minimum, maximum, W, worst_friction=worst_friction)
    except InfeasibleTension as error:
        if direction is None:
            raise
        u = frozen(unit_direction("direction", direction))
        none = {"tension": 0.0, "deflection": 0.0}
        why: Any = {"tension": locked, "problem": f"without the force, {error}"}
        return Payload(direction=u, worst=False, limits=none, **case, **why)
    case["tension"] = least.values if locked is None else locked
    K = stiffness(pose, least)
    C = np.zeros((3, 3))
    if K.is_stable:
        J_v = jacobian_at(pose, at)[:3]
        C = K.compliance[:3, :3] if at is None else J_v @ K.joint_compliance() @ J_v.T

    def limits(u: Array) -> dict[str, float]:
        yields = float(np.linalg.norm(C @ u))
        by_deflection = allowed / yields if yields > 0.0 else math.inf
        by_tension = largest_force(balanced(pose, u[:, None], W, low, high, at))
        return {"tension": by_tension, "deflection": by_deflection if K.is_stable else 0.0}

    if direction is not None:
        u = unit_direction("direction", direction)
        return Payload(direction=frozen(u), worst=False, limits=limits(u), **case)
    options: Any = {"worst_friction": worst_friction, "link": link, "point": point}
    polytope = force_polytope(pose, minimum, maximum, W, **options)
    softest = np.linalg.svd(C)[2][0]
    candidates = [(u, limits(u)) for u in (polytope.worst_direction, softest, -softest)]
    u, smallest = min(candidates, key=lambda candidate: sorted(candidate[1].values()))
    return Payload(direction=frozen(u), worst=True, limits=smallest, **case)


def largest_force(farthest: Farthest) -> float:
    """Return the largest force [N] along the one direction of ``farthest``; 0 if there is none."""
    solution = farthest(np.ones(1))
    if solution.status is Status.UNBOUNDED:
        return math.inf
    return max(float(solution.x[0]), 0.0) if solution.ok else 0.0
