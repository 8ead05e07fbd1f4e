"""Find where the stiffness saturates as the lower bound of the least tensions rises."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from cdsm._former.tension import OPTIMALITY
from cdsm.errors import InvalidInput
from cdsm.planning.bound_scan import (
    StiffnessAt,
    failure_at,
    log_samples,
    scan_end,
    sign_change,
    stable_ranges,
    tension_domain,
)
from cdsm.planning.gradient import stiffness_gradient
from cdsm.planning.objectives import unstable
from cdsm.planning.saturation_curve import End, Saturation
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.directions import Direction, unit_direction
from cdsm.support.validation import NO_WRENCH, bound, instance, scalar
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension, distribute_tension

_JUST = 1e-9  # relative distance from a bound to a point just beside it
_INSET = 1e-6  # distance of the curve from an end without a slope, over the length of the curve


def saturation(
    pose: Posture,
    direction: Direction,
    minimum: float = 0.0,
    maximum: ArrayLike = math.inf,
    wrench: ArrayLike = NO_WRENCH,
    *,
    fraction: float = 0.1,
) -> Saturation:
    """Find the lower bound of tension above which more tension hardly stiffens an arm.

    F*(b) are the least tensions with the lower bound b (Eq. 17). The slope of the stiffness is
    d along/db = ∂along/∂F · dF*/db. Tensions at the lower bound rise with b, and tensions between
    the bounds keep the balance. The result is the first b, beyond the b of largest slope, at which
    the slope has fallen to ``fraction`` of the largest. A strand starts soft, so its largest slope
    is large (Section IV-C). Where the rigidity of the strand has levelled off, more tension has two
    small effects: the active part of K_θ (Eq. 16) usually softens the arm, and the wires stiffen
    since their original lengths fall. Series springs and leads (straight cables between actuators
    and base disk) weaken the second effect, so that the arm may soften.

    Args:
        pose: The posture, which stays fixed.
        direction: u: an axis such as ``"z"``, or (3,) in base axes, any length.
        minimum: First lower bound [N]. If the domains of the elasticities begin higher, the first
            lower bound is their low end.
        maximum: Upper bound of the tensions [N], for all cables or (C,); inf for no bound.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m].
        fraction: Part of the largest slope, from 0 to below 1 [-].

    Raises:
        InvalidInput: ``direction`` is neither an axis nor three finite numbers, or is zero;
            ``minimum`` exceeds ``maximum``; or another argument is invalid.
        InfeasibleTension: No tensions balance the arm even at the smallest lower bound.
        ElasticityRangeError: The tensions at the smallest lower bound are outside the elasticities.
        SingularStiffness: The tip cannot move along u, or the arm is stable at no lower bound.
    """
    arm = instance("pose", pose, Posture).arm
    u = unit_direction("direction", direction)
    part, start = scalar("fraction", fraction), scalar("minimum", minimum)
    if not 0.0 <= part < 1.0:
        raise InvalidInput("fraction", f"{part:g} given; 0 <= fraction < 1 is needed.")
    ceiling = bound("maximum", maximum, len(arm.cables))

    @cache
    def at(lower: float) -> Stiffness:
        return stiffness(pose, distribute_tension(pose, lower, ceiling, wrench))

    distribute_tension(pose, start, ceiling, wrench)  # raises if minimum exceeds maximum
    lowest, highest = tension_domain(arm)
    low = max(start, lowest)
    at(low)._require_mobile(u)
    high = max(scan_end(at, low, max(min(highest, float(ceiling.min())), low)), low)
    first, last = _stable(at, low, high)
    limit: End = "buckling"
    if last >= high:
        limit = "maximum" if _least(at(high)).at_maximum else failure_at(at, high * (1.0 + _JUST))
        if limit in ("maximum", "infeasible"):
            last -= _INSET * (last - first)

    def slope(lower: float) -> float:
        return _slope(at(lower), lower, u)

    places = log_samples(first, last)
    bends = _bends(at, places[(places >= first) & (places <= last)])
    beside = np.outer([1.0 - _JUST, 1.0 + _JUST], bends).ravel()
    places = np.unique(np.clip(np.concatenate([places, beside]), first, last))
    curve = np.array([(place, at(place).along(u), slope(place)) for place in places.tolist()])
    steepest, largest = _steepest(curve, slope)
    where = _falls(curve, slope, steepest, part * largest) if largest > 0.0 else first
    K = at(min(where, last))
    return Saturation(
        direction=u,
        fraction=part,
        bound=where,
        tension=_least(K),
        stiffness=K,
        steepest=steepest,
        steepest_slope=largest,
        stiffest=_stiffest(curve, lambda lower: at(lower).along(u), slope),
        limit=limit,
        curve=frozen(curve),
    )


def _stable(at: StiffnessAt, low: float, high: float) -> tuple[float, float]:
    """Return the ends [N] of the first interval of lower bounds under which the arm is stable.

    The lower bounds are between ``low`` and ``high`` [N]. An end at which the arm buckles is moved
    inward by 1e-6 of the interval. Raises SingularStiffness if the arm is stable at no lower bound.
    """
    places, margins, stable = stable_ranges(at, low, high)
    if not stable:
        best = at(float(places[int(margins.argmax())]))
        raise unstable(
            best.posture.arm,
            f"the arm is stable at no lower bound from {low:.4g} to {high:.4g} N: at best the "
            f"smallest eigenvalue of K_θ is {best.margin:.4g} {best.posture.arm.stiffness_unit()}",
            best.critical_direction,
        )
    first, last = stable[0]
    inset = _INSET * (last - first)  # K_θ is singular on the edge
    return first + inset * (first > low), last - inset * (last < high)


def _bends(at: StiffnessAt, places: Array) -> Array:
    """Find the lower bounds b [N], ascending, at which the slope of the stiffness jumps.

    At such a bound, a cable reaches or leaves a limit of its tension. Between two of them the least
    tensions are linear in b. ``places`` are lower bounds, ascending; the search covers the range
    from the first to the last.
    """
    found: list[float] = []
    todo = list(pairwise(places.tolist()))
    smallest = _JUST**2 * float(places.max(initial=0.0))  # for bends at zero
    while todo:
        a, b = todo.pop()
        one, other = at(a), at(b)
        if np.array_equal(_active(one, a), _active(other, b)):
            continue
        if b - a <= max(_JUST * b, smallest):
            found.append((a + b) / 2.0)
        else:
            todo += [(a, (a + b) / 2.0), ((a + b) / 2.0, b)]
    return np.array(sorted(found))


def _least(K: Stiffness) -> Tension:
    assert K.distribution is not None
    return K.distribution


def _active(K: Stiffness, lower: float) -> Array:
    """Return for each cable (C,): 1 at the bound ``lower`` [N], 0 between its bounds.

    It is 2 at a higher lower bound of the cable's own, and −1 at the upper bound.
    """
    least, tight = _least(K), OPTIMALITY * float(K.tension.max())
    own = np.where(least.minimum > lower, 2.0, 1.0)
    low = np.where(K.tension - least.minimum <= tight, own, 0.0)
    return np.where(least.maximum - K.tension <= tight, -1.0, low)


def _slope(K: Stiffness, lower: float, u: Array) -> float:
    """Compute d along/db [1/m] at b = ``lower``, the lower bound of the least tensions.

    Tensions at b rise with it, tensions at other bounds stay, and the others change so that the arm
    stays in balance.
    """
    A, active = K.posture.length_jacobian.T, _active(K, lower)
    rate, free = (active == 1.0).astype(np.float64), active == 0.0
    rate[free] = np.linalg.lstsq(A[:, free], -A[:, active == 1.0].sum(axis=1), rcond=None)[0]
    return float(stiffness_gradient(K).along(u) @ rate)


def _steepest(curve: Array, slope: Callable[[float], float]) -> tuple[float, float]:
    """Return the lower bound [N] with the largest slope of the stiffness, and this slope [1/m].

    ``curve`` has the rows of :attr:`Saturation.curve`; ``slope`` computes the slope at any lower
    bound.
    """
    best = int(curve[:, 2].argmax())
    around = curve[max(best - 1, 0) : best + 2, 0]
    place, value = float(curve[best, 0]), float(curve[best, 2])
    if len(around) > 1:
        options = {"xatol": 1e-9 * around[-1]}
        found = minimize_scalar(
            lambda x: -slope(float(x)), bounds=around[[0, -1]], method="bounded", options=options
        )
        if -found.fun > value:
            place, value = float(found.x), -float(found.fun)
    return place, value


def _falls(curve: Array, slope: Callable[[float], float], start: float, level: float) -> float:
    """Return the first lower bound [N] beyond ``start`` with a slope below ``level`` [1/m], or inf.

    ``curve`` has the rows of :attr:`Saturation.curve`; ``slope`` computes the slope at any lower
    bound.
    """
    for place, _, value in curve[curve[:, 0] > start].tolist():
        if value < level:
            return sign_change(lambda x: slope(x) - level, start, place)
        start = place
    return math.inf


def _stiffest(
    curve: Array, value: Callable[[float], float], slope: Callable[[float], float]
) -> float:
    best = int(curve[:, 1].argmax())
    if 0 < best < len(curve) - 1 and curve[best - 1, 2] > 0.0 > curve[best + 1, 2]:
        top = sign_change(slope, float(curve[best - 1, 0]), float(curve[best + 1, 0]))
        if value(top) >= curve[best, 1]:
            return top
    return float(curve[best, 0])
