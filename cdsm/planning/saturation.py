"""Find the tension from which on more tension hardly stiffens an arm."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Literal, final

import numpy as np
from numpy.typing import ArrayLike

import cdsm
from cdsm.errors import CdsmError, ElasticityRangeError, InvalidInput
from cdsm.planning.tension_space import FAR, unstable
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.stiffness_matrix.prints import frictionless_model
from cdsm.support.format import coordinates
from cdsm.support.result import Result, unit
from cdsm.support.validation import NO_WRENCH, Direction, bound, instance, scalar, unit_direction
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension, distribute_tension

if TYPE_CHECKING:
    from matplotlib.figure import Figure

End = Literal["buckling", "balance", "elasticity", "maximum", "none"]

_SAMPLES = 200  # of the curve, evenly on a scale of logarithms
_SMALLEST = 1e-4  # second bound of the curve at least, over the last one


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
        stiffness: K_θ under these tensions.
        limit: What ends the curve: ``"buckling"``, ``"balance"`` (no tensions balance the arm),
            ``"elasticity"`` (a tension leaves the domain of its cable), ``"maximum"`` (the upper
            bound of a tension), or ``"none"``.
        minimum: Lower bounds of the curve (n,) [N], ascending, the last but one step before its
            end.
        along: Stiffness along u under the least tensions with these bounds (n,) [N/m].
    """

    _headline, _rows = "bound", "minimum"

    direction: Array = field(metadata=unit("1", "axis"))
    fraction: float = field(metadata=unit("1"))
    bound: float = field(metadata=unit("N"))
    stiffest: float = field(metadata=unit("N"))
    tension: Tension = field(metadata=unit("N", "cable"))
    stiffness: Stiffness
    limit: End = field(metadata=unit("1"))
    minimum: Array = field(metadata=unit("N", "minimum"))
    along: Array = field(metadata=unit("N/m", "minimum"))

    @property
    def posture(self) -> Posture:
        """The posture."""
        return self.tension.posture

    def plot(self) -> Figure:
        """Plot the stiffness [N/mm] against the lower bound of tension [N]."""
        return cdsm.plots.plot_saturation(self)

    def __str__(self) -> str:
        end, along = self.minimum[-1], f"the stiffness along {coordinates(self.direction)}"
        most = f"{along} is at most {self.along.max() / 1e3:.4g} N/mm, at a lower bound of "
        lines = [f"{most}{self.stiffest:.4g} N"]
        if math.isinf(self.bound):
            lines = [f"{along} does not saturate: it still rises at {end:.4g} N"]
        else:
            lines.append(f"saturates at {self.bound:.4g} N: {100.0 * self.fraction:.3g} % of that")
        if self.minimum[0] < self.stiffest < end:
            lines.append(f"above {self.stiffest:.4g} N tension makes the arm softer")
        model = frictionless_model(self.posture.arm)
        return "\n".join([*lines, f"looked at up to {end:.4g} N, limit: {self.limit} ({model})"])


def saturation(
    pose: Posture,
    direction: Direction,
    minimum: float = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: ArrayLike = NO_WRENCH,
    *,
    fraction: float = 0.95,
) -> Saturation:
    """Find the lower bound of tension above which more tension hardly stiffens an arm.

    With F*(b), the least tensions with the lower bound b (Eq. 17), s(b) is the stiffness along u.
    The result is the least b at which s is ``fraction`` of its largest value, interpolated between
    200 bounds. A strand starts soft (Section IV-C). Where its rigidity has levelled off, more
    tension has two small effects: the active part of K_θ (Eq. 16) usually softens the arm, and the
    wires stiffen since their original lengths fall. Series springs and leads weaken the second.

    Args:
        pose: The posture, which stays fixed.
        direction: u: an axis such as ``"z"``, or (3,) in base axes, any length.
        minimum: First lower bound [N]. If the domains of the elasticities begin higher, or the arm
            becomes stable at a higher one, the curve begins there.
        maximum: Upper bound of the tensions [N], for all cables or (C,). Without it, and where no
            elasticity ends, the curve ends at 1000 times the largest of the least tensions.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m].
        fraction: Part of the largest stiffness, above 0, at most 1 [-].

    Raises:
        InvalidInput: ``minimum`` exceeds ``maximum``; or another argument is invalid.
        InfeasibleTension: No tensions balance the arm even at the smallest lower bound.
        ElasticityRangeError: The tensions at the smallest lower bound are outside the elasticities.
        SingularStiffness: The tip cannot move along u, or the arm is stable at no lower bound.
    """
    arm, u = instance("pose", pose, Posture).arm, unit_direction("direction", direction)
    part, start = scalar("fraction", fraction), scalar("minimum", minimum)
    if not 0.0 < part <= 1.0:
        raise InvalidInput("fraction", f"{part:g} given; 0 < fraction <= 1 is needed.")
    ceiling = bound("maximum", maximum, len(arm.cables))

    @cache
    def at(lower: float) -> Stiffness:
        return stiffness(pose, distribute_tension(pose, lower, ceiling, wrench))

    distribute_tension(pose, start, ceiling, wrench)  # raises if minimum exceeds maximum
    laws = [cable.elasticity for cable in arm.cables if cable.control == "position"]
    low = max([start, *(law.low for law in laws)])
    at(low)._require_mobile(u)
    highest: list[tuple[float, End]] = [(FAR * max(float(at(low).tension.max()), 1.0), "none")]
    highest += [(law.high, "elasticity") for law in laws]
    highest += [(float(each), "maximum") for each in arm._laws.narrowed(ceiling, ceiling)[1]]
    high, limit = min(highest, key=lambda each: each[0])
    stable: list[float] = []
    tried = [low, *np.geomspace(max(low, _SMALLEST * high), max(low, high), _SAMPLES)[1:].tolist()]
    for lower in tried:
        try:
            if at(lower).is_stable:
                stable.append(lower)
            elif stable:
                limit = "buckling"
                break
        except CdsmError as error:
            if not error.status:
                raise
            limit = "elasticity" if isinstance(error, ElasticityRangeError) else "balance"
            break
    if not stable:
        found = [at(b) for b in tried if b < lower] or [at(low)]
        least = f"least tensions with lower bounds from {low:.4g} to {lower:.4g} N"
        raise unstable(max(found, key=lambda K: K.margin), least)
    bounds, along = np.array(stable), np.array([at(lower).along(u) for lower in stable])
    top = int(along.argmax())
    first = int((along >= part * along[top]).argmax())
    beside = slice(max(first - 1, 0), first + 1)
    where = float(np.interp(part * along[top], along[beside], bounds[beside]))
    if limit == "none" and top == len(stable) - 1 and first > 0:
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
