"""The tension above which more tension hardly stiffens the arm."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.arm import ComputedArm
from cdsm.errors import CdsmError, InvalidInput
from cdsm.loads import LoadsLike, loads_of
from cdsm.motors import refuse_shared
from cdsm.planning.tension_space import LARGEST_TENSION, unstable
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.stiffness_matrix.prints import frictionless_model
from cdsm.support.format import coordinates, stiffness_text
from cdsm.support.result import Result, unit
from cdsm.support.validation import NO_WRENCH, Direction, bound, instance, scalar, unit_direction
from cdsm.support.values import Array, draw, frozen
from cdsm.tension import Tension, distribute_tension

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_SAMPLES = 200  # bounds of a curve of saturation, evenly on a scale of logarithms
_SMALLEST = 1e-4  # second bound of such a curve at least, over the last one


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Saturation(Result):
    """Stiffness as a function of the lower bound of the tensions; made by :func:`saturation`.

    Attributes:
        direction: u (3,), a unit direction in base axes.
        fraction: Part of the largest stiffness [-] that counts as saturated.
        bound: The least lower bound [N] at which the stiffness is ``fraction`` of the largest; inf
            if nothing ends the curve, and the stiffness still rises at its last bound.
        stiffest: The lower bound [N] with the largest stiffness: an end of the curve, or one above
            which tension softens the arm.
        tension: The least tensions with the lower bound ``bound`` or, if that is inf, the last one.
        stiffness: `K_θ` under these tensions.
        limit: What ends the curve: UNSTABLE (the arm buckles), INFEASIBLE or SOLVER_FAILED (no
            tensions balance it), OUTSIDE_ELASTICITY (a tension leaves the domain of its cable),
            AT_MAXIMUM (the upper bound of a tension), or OK (nothing).
        minimum: Lower bounds of the curve (n,) [N], ascending, the last but one step before its
            end.
        along: Stiffness along u under the least tensions with these bounds (n,) [N/m].
    """

    _headline = "bound"
    _rows = "minimum"

    direction: Array = field(metadata=unit("1", "axis"))
    fraction: float = field(metadata=unit("1"))
    bound: float = field(metadata=unit("N"))
    stiffest: float = field(metadata=unit("N"))
    tension: Tension = field(metadata=unit("N", "cable"))
    stiffness: Stiffness
    limit: Status = field(metadata=unit("1"))
    minimum: Array = field(metadata=unit("N", "minimum"))
    along: Array = field(metadata=unit("N/m", "minimum"))

    @property
    def posture(self) -> Posture:
        """The posture."""
        return self.tension.posture

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Plot the stiffness and its terms over the lower bound of all tensions; return the axes.

        Other options are those of :func:`cdsm.plots.plot_stiffness_over_tension`.
        """
        axes: Axes = draw("plot_stiffness_over_tension", self, ax=ax, **options)
        return axes

    def __str__(self) -> str:
        end = self.minimum[-1]
        along = f"the stiffness along {coordinates(self.direction)}"
        most = f"{along} is at most {stiffness_text(self.along.max())}, at a lower bound of "
        lines = [f"{most}{self.stiffest:.4g} N"]
        if math.isinf(self.bound):
            lines = [f"{along} does not saturate: it still rises at {end:.4g} N"]
        else:
            lines.append(f"saturates at {self.bound:.4g} N: {100.0 * self.fraction:.3g} % of that")
        if self.minimum[0] < self.stiffest < end:
            lines.append(f"above {self.stiffest:.4g} N tension makes the arm softer")
        model = frictionless_model(self.posture.arm)
        limit = "" if self.limit is Status.OK else f", where {self.limit.message}"
        return "\n".join([*lines, f"looked at up to {end:.4g} N{limit} ({model})"])


def saturation(
    pose: Posture,
    direction: Direction,
    minimum: float = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: LoadsLike = NO_WRENCH,
    *,
    fraction: float = 0.95,
) -> Saturation:
    """Find the lower bound above which more tension adds little stiffness.

    With F*(b), the least tensions with the lower bound b (Eq. 17), s(b) is the stiffness along u.
    The result is the least b at which s is ``fraction`` of its largest value, interpolated between
    200 bounds. A strand starts soft (Section IV-C). Where its rigidity has levelled off, more
    tension has two small effects: the active part of `K_θ` (Eq. 16) usually softens the arm, and
    the wires stiffen since their original lengths fall. Series springs and leads weaken the second.

    Args:
        pose: The posture, which stays fixed.
        direction: u: an axis such as ``"z"``, or (3,) in base axes, any length.
        minimum: First lower bound [N]. If the domains of the elasticities begin higher, or the arm
            becomes stable at a higher one, the curve begins there.
        maximum: Upper bound of the tensions [N], for all cables or (C,). Without it, and where no
            elasticity ends, the curve ends at 1000 times the largest of the least tensions.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]; or loads on links.
        fraction: Part of the largest stiffness, above 0, at most 1 [-].

    Raises:
        InvalidInput: ``minimum`` exceeds ``maximum``; or another argument is invalid.
        InfeasibleTension: No tensions balance the arm even at the smallest lower bound.
        ElasticityRangeError: The tensions at the smallest lower bound are outside the elasticities.
        SingularStiffness: The tip cannot move along u, or the arm is stable at no lower bound.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> saturated = cdsm.saturation(pose, "z")
        >>> f"with {saturated.bound:.0f} N {1e-3 * saturated.stiffness.along('z'):.2f} N/mm"
        'with 213 N 86.85 N/mm'
    """
    arm = instance("pose", pose, Posture).arm
    u = unit_direction("direction", direction)
    refuse_shared(arm.motors, "saturation")
    part = scalar("fraction", fraction)
    start = scalar("minimum", minimum)
    if not 0.0 < part <= 1.0:
        raise InvalidInput("fraction", f"{part:g} given; 0 < fraction <= 1 is needed.")
    load = loads_of(arm, wrench)
    ceiling = bound("maximum", maximum, len(arm.cables))

    @cache
    def at(lower: float) -> Stiffness:
        return stiffness(pose, distribute_tension(pose, lower, ceiling, load))

    distribute_tension(pose, start, ceiling, load)  # raises if minimum exceeds maximum
    low = max(start, float(arm.laws.low.max()))
    at(low).require_mobile(u)
    high, limit = _end(arm, ceiling, at(low))
    tried = [low, *np.geomspace(max(low, _SMALLEST * high), max(low, high), _SAMPLES)[1:].tolist()]
    stable, limit = _stable_range(at, tried, limit)
    bounds = np.array(stable)
    along = np.array([at(lower).along(u) for lower in stable])
    top = int(along.argmax())
    first = int((along >= part * along[top]).argmax())
    beside = slice(max(first - 1, 0), first + 1)
    where = float(np.interp(part * along[top], along[beside], bounds[beside]))
    if limit is Status.OK and top == len(stable) - 1 and first > 0:
        where = math.inf
    K = at(min(where, stable[-1]))
    assert K.distribution is not None
    return Saturation(
        direction=u,
        fraction=part,
        bound=where,
        stiffest=stable[top],
        tension=K.distribution,
        stiffness=K,
        limit=limit,
        minimum=frozen(bounds),
        along=frozen(along),
    )


def _end(arm: ComputedArm, maximum: Array, least: Stiffness) -> tuple[float, Status]:
    """Return the largest lower bound [N] that makes sense, and what ends the curve there."""
    ends = [(LARGEST_TENSION * max(float(least.tension.max()), 1.0), Status.OK)]
    ends += [(end, Status.OUTSIDE_ELASTICITY) for end in arm.laws.high.tolist()]
    own_maximum = arm.laws.narrowed(maximum, maximum)[1]
    ends += [(float(tension), Status.AT_MAXIMUM) for tension in own_maximum]
    return min(ends, key=lambda end: end[0])


def _stable_range(
    at: Callable[[float], Stiffness], tried: Sequence[float], limit: Status
) -> tuple[list[float], Status]:
    """Return the first bounds in a row with which the arm is stable, and what ends them.

    ``limit`` is what ends them if nothing does before. Raises SingularStiffness if there are none.
    """
    stable: list[float] = []
    for lower in tried:
        try:
            if at(lower).margin_without_slack > 0.0:
                stable.append(lower)
            elif stable:
                return stable, Status.UNSTABLE
        except CdsmError as error:
            if error.status.is_fault:
                raise
            limit = error.status
            break
    if not stable:
        stiffnesses = [at(b) for b in tried if b < lower] or [at(tried[0])]
        least = f"least tensions with lower bounds from {tried[0]:.4g} to {lower:.4g} N"
        raise unstable(max(stiffnesses, key=lambda K: K.margin), least)
    return stable, limit
