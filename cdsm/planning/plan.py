"""Tensions that give an arm the stiffness that is wanted, with the least effort."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.planning.objectives import (
    achieved,
    checked_matrix,
    checked_starts,
    checked_targets,
    misfit,
    stiffness_model,
    target_constraints,
)
from cdsm.planning.planner import REACHED, Planner
from cdsm.planning.range import MARGIN
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.format import MODEL, coordinates
from cdsm.support.validation import Array, ReadOnlyState, frozen, unit_directions
from cdsm.tension import Tension


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StiffnessPlan(ReadOnlyState):
    """Tensions for a wanted stiffness, with the question they answer.

    Attributes:
        tension: The tensions; of those equally near the target the least, by ‖F‖.
        stiffness: K_θ under them.
        direction: Unit directions u in base axes, (3,) or (n, 3); None for a target of
            ``cartesian``.
        target: The target [N/m]: a number, one per direction (n,), or (3, 3).
        achieved: ``stiffness.along`` () or (n,), or ``stiffness.cartesian`` (3, 3) [N/m].
        floor: Smallest eigenvalue of K_θ that counted as stable [N m/rad].
        efforts: ‖F‖ (S,) [N] where each search ended that hit the target, rising; the first is that
            of ``tension``.
        iterations: Iterations of all searches.
        evaluations: How often K_θ was evaluated.
    """

    tension: Tension
    stiffness: Stiffness
    direction: Array | None
    target: float | Array
    achieved: float | Array
    floor: float
    efforts: Array
    iterations: int
    evaluations: int

    @property
    def misfit(self) -> float:
        """‖achieved/target − 1‖ [-], or for ``cartesian`` ‖achieved − target‖/‖target‖.

        With a moment in the wrench ``cartesian`` is not symmetric: its symmetric part counts.
        """
        return misfit(np.asarray(self.achieved), np.asarray(self.target), self.direction)

    @property
    def reached(self) -> bool:
        """Whether the target is hit within 1e-6; with one direction all else is an error."""
        return self.misfit <= REACHED

    @property
    def spread(self) -> float:
        """By how much the largest effort found exceeds the least [-]."""
        return float(self.efforts[-1] / self.efforts[0] - 1.0) if self.efforts.size else 0.0

    def __repr__(self) -> str:
        F = self.tension.values
        state = "" if self.reached else f", missed by {self.misfit:.2g}"
        return f"<StiffnessPlan {F.min():.4g} to {F.max():.4g} N{state}>"

    def __str__(self) -> str:
        rows = [str(self.tension)]
        if self.direction is None:
            rows.append(f"cartesian stiffness within {self.misfit:.2g} of the target")
        else:
            triples = zip(
                self.direction.reshape(-1, 3),
                np.atleast_1d(self.target),
                np.atleast_1d(self.achieved),
                strict=True,
            )
            rows += [
                f"along {coordinates(u)}: {achieved / 1000.0:.6g} N/mm "
                f"({target / 1000.0:.6g} N/mm wanted)"
                for u, target, achieved in triples
            ]
        return "\n".join([*rows, f"({MODEL})"])


def plan_stiffness(
    pose: Posture,
    direction: ArrayLike | None,
    target: ArrayLike,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = np.inf,
    wrench: ArrayLike = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    *,
    margin: float = MARGIN,
    starts: int = 3,
    seed: int = 0,
) -> StiffnessPlan:
    """Least tensions with a wanted stiffness: min ‖F‖² so that along(u) = target (Eqs. 13, 17, 20).

    Over F with J_Lᵀ F = J_Xᵀ W − g, the bounds, the domains of the elasticities of position-
    controlled cables, and λ_min(K_θ), symmetric part, not below ``margin``. One direction is hit
    within 1e-6, or it is an error. Several directions, or ``cartesian``, are hit too if that is
    possible. If not, the sum of their squared relative misses is least, and ``reached`` is false.

    The searches are local. With the laws of this library they mostly end at one effort. With a
    user's own law they need not: with one of them the effort found was 3.6 % above the least. A
    ``spread`` above zero warns of it, one of zero does not rule it out, and more ``starts`` help.

    Args:
        pose: The posture.
        direction: u (3,) in base axes, any length; several (n, 3); or None for ``cartesian``.
        target: The stiffness [N/m] along u; one per direction (n,); or (3, 3).
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,); inf for none but the end
            of the elasticity's domain, and buckling.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m].
        margin: From which part of the largest eigenvalue of K_θ under the least tensions on the
            smallest one counts as stable [-], 1e-9 or more.
        starts: From how many tensions to search, at most 1000.
        seed: Of the random ones among them.

    Raises:
        InvalidInput: No direction, a target that is not positive, bounds the wrong way, or another
            argument out of place.
        UnreachableStiffness: No admissible tensions give this stiffness along the one direction;
            carries what they do give.
        InfeasibleTension: No tension within the bounds and domains balances the arm.
        ElasticityRangeError: The bounds leave nothing of the domain of a cable's elasticity.
        SingularStiffness: The tip cannot move along a direction, or no admissible tension holds the
            arm.
    """
    model = stiffness_model(pose, minimum, maximum, wrench, margin)
    number, seed = checked_starts(starts, seed)
    if direction is None:
        directions, targets = None, checked_matrix(target)
    else:
        directions = unit_directions("direction", direction)
        targets = checked_targets(directions, target)

    planner = Planner(model, target_constraints(model, directions, targets), number, seed)
    found = planner.least()
    if found is None and directions is not None and targets.ndim == 0:
        found = planner.within_range(directions, float(targets))
    elif found is None:
        found = planner.nearest()

    tension = model.region.tension(found.end.evaluation.F)
    K = stiffness(pose, tension)
    value = achieved(K, directions)
    return StiffnessPlan(
        tension=tension,
        stiffness=K,
        direction=directions,
        target=float(targets) if targets.ndim == 0 else targets,
        achieved=float(value) if value.ndim == 0 else value,
        floor=model.floor,
        efforts=frozen(np.array(planner.efforts)),
        iterations=planner.iterations,
        evaluations=model.evaluations,
    )
