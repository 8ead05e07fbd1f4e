"""Plan the least tensions with which an arm has a target stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import ArrayLike

import cdsm
from cdsm.planning.objectives import (
    achieved,
    checked_starts,
    checked_targets,
    target_constraints,
)
from cdsm.planning.planner import REACHED, Planner
from cdsm.planning.range import MARGIN
from cdsm.planning.stiffness_model import StiffnessModel
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.directions import Direction, unit_directions
from cdsm.support.format import MODEL, coordinates, key, plain
from cdsm.support.progress import progress_allowed
from cdsm.support.validation import NO_WRENCH
from cdsm.support.values import Array, ReadOnlyState
from cdsm.tension import Tension

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdsm.planning.range import StiffnessRange


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StiffnessPlan(ReadOnlyState):
    """Tensions for a wanted stiffness, with the target; made by :func:`plan_stiffness`.

    Attributes:
        tension: The planned tensions: of those equally near to the target, the ones of least ‖F‖.
        stiffness: K_θ under these tensions.
        direction: Unit directions u in base axes, (3,) or (n, 3).
        target: The target [N/m]: a number, or one per direction (n,).
        achieved: ``stiffness.along`` () or (n,) [N/m].
    """

    tension: Tension
    stiffness: Stiffness
    direction: Array
    target: float | Array
    achieved: float | Array

    @property
    def misfit(self) -> float:
        """‖achieved/target − 1‖ [-]."""
        return float(np.linalg.norm(np.divide(self.achieved, self.target) - 1.0))

    @property
    def reached(self) -> bool:
        """Whether :attr:`misfit`, which is relative to the target, is at most 1e-6.

        It is always True for one direction: otherwise :func:`plan_stiffness` raises an error.
        """
        return self.misfit <= REACHED

    def plot(self, attainable: StiffnessRange | None = None) -> Figure:
        """Plot the planned tensions [N] of each cable.

        If ``attainable`` is given, the tensions of the softest and of the stiffest arm are plotted
        too. Raises InvalidInput if ``attainable`` is the range of another posture or direction.
        """
        return cdsm.plots.plot_stiffness_plan(self, attainable)

    def to_dict(self) -> dict[str, object]:
        """Return target, stiffness and tensions in SI for JSON, with units in the keys."""
        pose = self.tension.posture
        numbers = {
            "direction": self.direction,
            "target_N_per_m": self.target,
            "achieved_N_per_m": self.achieved,
            "reached": self.reached,
            "tension_N": dict(self.tension),
            "cable_length_m": dict(zip(self.tension, pose.cable_lengths, strict=True)),
            **pose._coordinates,
            key("margin", pose.arm.stiffness_unit()): self.stiffness.margin,
        }
        return plain(numbers)

    def __repr__(self) -> str:
        F = self.tension.values
        state = "" if self.reached else f", missed by {self.misfit:.2g}"
        return f"<StiffnessPlan {F.min():.4g} to {F.max():.4g} N{state}>"

    def __str__(self) -> str:
        pairs = np.reshape([self.achieved, self.target], (2, -1)).T / 1000.0
        rows = [
            f"along {coordinates(u)}: {value:.4g} N/mm ({wanted:.4g} N/mm wanted)"
            for u, (value, wanted) in zip(self.direction.reshape(-1, 3), pairs, strict=True)
        ]
        margin = f"{self.stiffness.margin:.4g} {self.tension.posture.arm.stiffness_unit()}"
        return "\n".join([str(self.tension), *rows, f"smallest joint stiffness {margin} ({MODEL})"])


def plan_stiffness(
    pose: Posture,
    direction: Direction | Sequence[Direction],
    target: ArrayLike,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = np.inf,
    wrench: ArrayLike = NO_WRENCH,
    *,
    margin: float = MARGIN,
    starts: int = 3,
    seed: int = 0,
    progress: bool = True,
) -> StiffnessPlan:
    """Plan least tensions for a wanted stiffness: min ‖F‖², along(u) = target (Eqs. 13, 17, 20).

    The constraints on F are J_Lᵀ F = J_Xᵀ W − g, the bounds, the domains of the elasticities of
    position-controlled cables, and the limit of the smallest eigenvalue λ_min of K_θ (symmetric
    part) that follows from ``margin``. The target of one direction is hit within 1e-6 of its value;
    otherwise an error is raised. The targets of several directions are hit if possible. If not, the
    tensions have the least sum of squared relative misses that was found, and ``reached`` is False.

    The searches are local. With laws that stiffen they usually end at the same effort ‖F‖. With one
    law that rises and falls, the effort found was 3.6 % above the least; more ``starts`` help.

    Args:
        pose: The posture.
        direction: u: an axis such as ``"z"``, or (3,) in base axes, any length; or several
            directions (n, 3).
        target: The stiffness [N/m] along u, or one per direction (n,).
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,). With inf, only the domain
            of the elasticity and buckling limit the tensions.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m].
        margin: Smallest eigenvalue of K_θ that counts as stable, as a part of the largest
            eigenvalue under the least tensions [-], 1e-9 or more. A prismatic joint counts in
            lengths of the arm.
        starts: Number of starting tensions, at most 1000.
        seed: Seed of the random starting tensions.
        progress: Show a bar on the standard error, if that is a terminal.

    Raises:
        InvalidInput: ``direction`` is not finite or is zero; a target is not positive; ``minimum``
            exceeds ``maximum``; or another argument is invalid.
        UnreachableStiffness: No admissible tensions give this stiffness along the single direction.
            The error gives the stiffness that is possible.
        InfeasibleTension: No tensions within the bounds and domains balance the arm.
        ElasticityRangeError: The bounds and the domain of an elasticity do not overlap.
        SingularStiffness: The tip cannot move along a direction, or no admissible tensions make the
            arm stable.
    """
    model = StiffnessModel(pose, minimum, maximum, wrench, margin)
    number, seed = checked_starts(starts, seed)
    directions = unit_directions("direction", direction)
    targets = checked_targets(directions, target)
    planner = Planner(model, target_constraints(model, directions, targets), number, seed)
    with progress_allowed(progress):
        found = planner.least() or planner.nearest()
    tension = model.region.tension(found.evaluation.F)
    K = stiffness(pose, tension)
    value = achieved(K, directions)
    return StiffnessPlan(
        tension=tension,
        stiffness=K,
        direction=directions,
        target=float(targets) if targets.ndim == 0 else targets,
        achieved=float(value) if value.ndim == 0 else value,
    )
