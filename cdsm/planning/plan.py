"""Plan the least tensions with which an arm has a target stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.loads import LoadsLike
from cdsm.planning.goal import REACHED, Goal
from cdsm.planning.tension_space import TensionSpace
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.stiffness_matrix.prints import frictionless_model
from cdsm.support.format import coordinates, stiffness_text
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import (
    NO_WRENCH,
    SMALLEST,
    Direction,
    flag,
    number_array,
    unit_directions,
)
from cdsm.support.values import Array, draw, frozen
from cdsm.tension import Tension

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from cdsm.planning.range import StiffnessRange


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class StiffnessPlan(Result):
    """Tensions for a wanted stiffness, with the target; made by :func:`plan_stiffness`.

    Attributes:
        tension: The planned tensions.
        stiffness: `K_θ` under these tensions.
        direction: Unit directions u in base axes, (3,) or (n, 3).
        target: The target [N/m]: a number, or one per direction (n,).
        achieved: ``stiffness.along`` () or (n,) [N/m].
        at_least: Whether the arm may be stiffer than the target.
    """

    _headline = "tension"
    _rows = "cable"

    tension: Tension = field(metadata=unit("N", "cable"))
    stiffness: Stiffness
    direction: Array = field(metadata=unit("1", "direction", "axis"))
    target: float | Array = field(metadata=unit("N/m", "direction"))
    achieved: float | Array = field(metadata=unit("N/m", "direction"))
    at_least: bool = field(default=False, metadata=unit("1"))

    @property
    def posture(self) -> Posture:
        """The posture."""
        return self.tension.posture

    @quantity("1")
    def misfit(self) -> float:
        """`‖achieved/target − 1‖` [-]; with ``at_least``, of what is missing."""
        missed = np.divide(self.achieved, self.target) - 1.0
        return float(np.linalg.norm(np.minimum(missed, 0.0) if self.at_least else missed))

    @quantity("1")
    def reached(self) -> bool:
        """Whether :attr:`misfit` is at most 1e-6; for one direction, it always is."""
        return self.misfit <= REACHED

    @quantity("joint stiffness")
    def margin(self) -> float:
        """Smallest joint stiffness [N m/rad] under the planned tensions."""
        return self.stiffness.margin

    @quantity("m", "cable")
    def cable_lengths(self) -> Array:
        """Cable lengths L (C,) [m], lead included."""
        return self.posture.cable_lengths

    @quantity("m", "cable")
    def rest_lengths(self) -> Array:
        """Lengths without strain `l_0` (C,) [m] that the motors pay out; L if force-controlled.

        `l_0 + Δl(F, l_0) = L`, with :meth:`~cdsm.Cable.elongation` Δl.
        """
        return self.stiffness.free_lengths

    def plot(
        self, attainable: StiffnessRange | None = None, ax: Axes | None = None, **options: Any
    ) -> Axes:
        """Plot the planned tensions [N] of each cable, and return the axes.

        If ``attainable`` is given, the tensions of the softest and of the stiffest arm are marked
        too. Raises InvalidInput if ``attainable`` is the range of another posture or direction.
        """
        axes: Axes = draw("plot_stiffness_plan", self, attainable, ax, **options)
        return axes

    def __str__(self) -> str:
        pairs = np.reshape([self.achieved, self.target], (2, -1)).T
        wanted = "or more wanted" if self.at_least else "wanted"
        rows = [
            f"along {coordinates(u)}: {stiffness_text(value)} ({stiffness_text(target)} {wanted})"
            for u, (value, target) in zip(self.direction.reshape(-1, 3), pairs, strict=True)
        ]
        margin = f"{self.margin:.4g} {self.posture.arm.stiffness_unit()}"
        model = frictionless_model(self.posture.arm)
        return "\n".join([str(self.tension), *rows, f"smallest joint stiffness {margin} ({model})"])


def plan_stiffness(
    pose: Posture,
    direction: Direction | Sequence[Direction],
    target: ArrayLike,
    minimum: ArrayLike = 0.0,
    maximum: ArrayLike = np.inf,
    wrench: LoadsLike = NO_WRENCH,
    *,
    at_least: bool = False,
) -> StiffnessPlan:
    """Plan least tensions for a stiffness: `min ‖F‖²` with `along(u) = target` (Eqs. 13, 17, 20).

    The constraints on F are `J_Lᵀ F = J_Xᵀ W − g`, the bounds, the domains of the elasticities of
    position-controlled cables, and stability: the smallest eigenvalue of `K_θ` (symmetric part) is
    at least 1 % of what it is under the least tensions, or, if they hardly hold the arm, under the
    most stable ones. The target of one direction is hit within 1e-6 of its value; otherwise an
    error is raised. The targets of several directions are hit if possible. If not, the tensions
    have the least sum of squared relative misses that was found, and ``reached`` is False.

    With ``at_least``, `along(u) ≥ target`. If EA is constant or levels off, ``along`` is concave in
    F, and this problem has one optimum. The equation is not convex: its searches are local. In
    326 of 327 random plans, their effort `‖F‖` was at most 0.2 % above that of an independent
    program, in one by 3 %.

    Args:
        pose: The posture.
        direction: u: an axis such as ``"z"``, or (3,) in base axes, any length; or several
            directions (n, 3).
        target: The stiffness [N/m] along u, or one per direction (n,).
        minimum: Lower bound of the tensions [N], for all cables or (C,).
        maximum: Upper bound of the tensions [N], for all cables or (C,); inf for no bound.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]. Or loads on links,
            as for :func:`~cdsm.distribute_tension`.
        at_least: Whether the arm may be stiffer than the target.

    Raises:
        InvalidInput: ``direction`` is not finite or is zero; a target is not positive; ``minimum``
            exceeds ``maximum``; or another argument is invalid.
        UnreachableStiffness: No admissible tensions give this stiffness along the single direction.
            The error gives the stiffness that is possible.
        InfeasibleTension: No tensions within the bounds balance the arm.
        ElasticityRangeError: None of them are within the domains of the elasticities.
        SingularStiffness: The tip cannot move along a direction, or no admissible tensions make the
            arm stable.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> plan = cdsm.plan_stiffness(pose, "z", 3000.0, minimum=5.0, maximum=300.0)
        >>> round(plan.tension["cable1_1"], 1), round(plan.achieved, 1)
        (33.1, 3000.0)
    """
    directions = unit_directions("direction", direction)
    targets = checked_targets(target, directions.shape[:-1])
    space = TensionSpace(pose, directions, minimum, maximum, wrench)
    return plan_within(space, directions, targets, flag("at_least", at_least))


def plan_within(
    space: TensionSpace, directions: Array, targets: Array, at_least: bool = False
) -> StiffnessPlan:
    """Plan for ``targets`` () or (n,) [N/m] along ``directions`` (3,) or (n, 3) of ``space``."""
    goal = Goal(space, targets.reshape(-1), at_least)
    tension = space.tension(goal.least())
    K = stiffness(space.pose, tension)
    value = achieved(K, directions)
    return StiffnessPlan(
        tension=tension,
        stiffness=K,
        direction=directions,
        target=float(targets) if targets.ndim == 0 else targets,
        achieved=float(value) if value.ndim == 0 else value,
        at_least=goal.at_least,
    )


def achieved(K: Stiffness, directions: Array) -> Array:
    """Return ``K.along(u)`` [N/m] of each of the ``directions`` (3,) or (n, 3): () or (n,)."""
    along = [K.along(u) for u in directions.reshape(-1, 3)]
    return frozen(np.array(along).reshape(directions.shape[:-1]))


def checked_targets(target: ArrayLike, tail: tuple[int, ...], size: int | None = None) -> Array:
    """Check and return targets [N/m] of shape ``tail`` or, with ``size``, (size, *tail)."""
    targets = per_sample("target", target, tail, size)
    if not (targets >= SMALLEST).all():
        problem = f"{targets.min():g} N/m given; stiffness is positive, at least {SMALLEST:g} N/m."
        raise InvalidInput("target", problem)
    return targets


def per_sample(name: str, value: ArrayLike, tail: tuple[int, ...], size: int | None) -> Array:
    """Return an array of shape ``tail`` or, with ``size``, (size, *tail): one for each sample."""
    values = number_array(name, value)
    shape = tail if size is None else (size, *tail)
    if values.shape not in (tail, shape):
        needed = f"{tail}" if size is None else f"{tail} for all samples or {shape}, one for each,"
        raise InvalidInput(name, f"shape {values.shape} given; {needed} is needed.")
    return frozen(np.broadcast_to(values, shape).copy())
