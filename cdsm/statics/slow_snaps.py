"""Where a path of equilibria of an arm with friction ends, and why the arm snaps there.

At a limit point an eigenvalue of K is 0, and the share of the load turns back: it is no good
coordinate there. So the path is followed along the motion φ that K resists least,

    f(x, share) = 0,    φ·(x − x_0) = d,

and the end is where the least real part λ(d) of the eigenvalues is zero. K has a step where a cable
begins to slide or goes slack, and λ may fall through zero there: then this is the cause.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cdsm.readings import least_real_part
from cdsm.statics.crossings import ROUNDING, Watched
from cdsm.statics.events import LIMIT_POINT, event_words
from cdsm.statics.pieces import root
from cdsm.statics.slow_watch import SlowStage
from cdsm.statics.solve import Balance
from cdsm.support.values import Array

SINGULAR = 1e-8
"""Size of an eigenvalue, over the largest diagonal entry of K, below which K is singular."""

_FIRST = 1e-9  # first distance along the path [rad], which is doubled
_FARTHEST = 0.1  # last one [rad]
_RATE = 1e-3  # change of the share for a difference: of a sub-step, which may be very short
_NEWTON = 20  # most steps
_EXACT = 1e-13  # largest |f|, over its scale, and part of the distance that may be missed
_PRECISE = 1e-12  # of a root, relative
_LEAST_APART = 1e-9  # the least of it [rad]
_NEXT = 1e-6  # part of the distance before and behind a step of K


class PathEnd(NamedTuple):
    """Last equilibrium of a path, and why it is the last."""

    stage: SlowStage
    cause: str  # LIMIT_POINT, or words for the event that takes the stiffness; empty: not found


def path_end(
    balance: Callable[[float], Balance], last: SlowStage, watch: Watched[SlowStage]
) -> PathEnd:
    """Follow a path from its ``last`` known equilibrium to its end.

    ``balance`` is the normal map at a share. Where the end is not found, it is ``last`` without a
    cause.
    """
    free = np.flatnonzero(~last.point.out)
    if not free.size:
        return PathEnd(last, "")
    motion = np.zeros(last.point.x.size)
    motion[free] = least_real_part(last.point.slope[np.ix_(free, free)])[1]
    speed = np.linalg.lstsq(last.point.slope, -_change(balance, last))[0]
    motion *= 1.0 if motion @ speed >= 0.0 else -1.0
    stages = dict[float, SlowStage]()

    def at(distance: float) -> SlowStage | None:
        if distance not in stages:
            known = min(stages, key=lambda known: abs(known - distance), default=None)
            near = last if known is None else stages[known]
            found = _on_path(balance, last, near, motion, distance)
            if found is None:
                return None
            stages[distance] = found
        return stages[distance]

    def value(distance: float) -> float:
        stage = at(distance)
        return math.nan if stage is None else _least(stage)

    start = at(0.0)
    if start is None:
        return PathEnd(last, "")
    if abs(_least(start)) <= SINGULAR * start.balance.k:
        return PathEnd(start, LIMIT_POINT)
    # to both sides: beyond a step of K the search may have gone a little too far
    positive = _least(start) > 0.0
    low = 0.0
    high = _FIRST
    while high < _FARTHEST:
        sides = [way * high for way in (1.0, -1.0) if (value(way * high) > 0.0) != positive]
        if sides:
            break
        low = high
        high *= 2.0
    else:
        return PathEnd(last, "")
    if not math.isfinite(value(sides[0])):
        return PathEnd(last, "")
    way = math.copysign(1.0, sides[0])
    end = root(value, way * low, way * high, _PRECISE * high, _PRECISE)
    stage = at(end)
    if stage is None:
        return PathEnd(last, "")
    if abs(_least(stage)) <= SINGULAR * stage.balance.k:
        return PathEnd(stage, LIMIT_POINT)
    # K has a step: what changes its sign there
    apart = max(_NEXT * abs(end), _LEAST_APART)
    near = at(end - apart)
    far = at(end + apart)
    if near is None or far is None:
        return PathEnd(stage, "")
    if _least(far) > 0.0:
        near, far = far, near
    none = ROUNDING * watch.scale(stage)
    before = watch.value(near)
    after = watch.value(far)
    passed = np.flatnonzero((before > after) & (after < 0.0) & (before > -none))
    if not passed.size:
        return PathEnd(stage, "")
    there = abs(watch.value(stage)) / watch.scale(stage)  # of what passes there it is 0
    cause = int(passed[there[passed].argmin()])
    return PathEnd(stage, event_words(watch.kinds[cause], watch.places[cause]))


def _least(stage: SlowStage) -> float:
    """Return the least real part of the eigenvalues of K of the joints off their stops."""
    free = np.flatnonzero(~stage.point.out)
    return least_real_part(stage.point.slope[np.ix_(free, free)])[0] if free.size else math.inf


def _change(balance: Callable[[float], Balance], stage: SlowStage) -> Array:
    """Return ∂f/∂share (nv,) at a stage."""
    values = [balance(stage.share + h)(stage.point.x).value for h in (0.0, _RATE)]
    return np.asarray((values[1] - values[0]) / _RATE)


def _on_path(
    balance: Callable[[float], Balance],
    origin: SlowStage,
    near: SlowStage,
    motion: Array,
    distance: float,
) -> SlowStage | None:
    """Solve f(x, share) = 0 and φ·(x − x_0) = distance by Newton's method; None if it fails."""
    x = near.point.x + (distance - float(motion @ (near.point.x - origin.point.x))) * motion
    share = near.share
    for _ in range(_NEWTON):
        f = balance(share)
        point = f.attempt(x)
        if point is None:
            return None
        stage = SlowStage(share, point, f)
        missed = distance - float(motion @ (x - origin.point.x))
        if point.off <= _EXACT and abs(missed) <= _EXACT + 1e-9 * abs(distance):
            return stage
        border = np.append(motion, 0.0)
        matrix = np.vstack([np.column_stack([point.slope, _change(balance, stage)]), border])
        size = abs(matrix).max(axis=1)
        size[size == 0.0] = 1.0
        step = np.linalg.lstsq(matrix / size[:, None], np.append(-point.value, missed) / size)[0]
        if not np.isfinite(step).all() or abs(step[:-1]).max() > _FARTHEST:
            return None
        x = x + step[:-1]
        share += float(step[-1])
    return None
