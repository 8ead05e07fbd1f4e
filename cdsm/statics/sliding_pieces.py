"""Pieces of slow loading on which cables slide in the same holes, in the same ways.

On a piece the equilibrium is a smooth function of the load: Newton's method needs two or three
steps, where a search that lets cables stick and slide meets a wall at each hole. The piece tells
what happens first, and where; an equilibrium with friction in all holes then confirms it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cdsm.friction.capstan import can_stick
from cdsm.statics.crossings import ROUNDING, Watched
from cdsm.statics.pieces import dip
from cdsm.statics.quasi_static import Action, ChainArmState, QuasiStaticArm, QuasiStaticState
from cdsm.statics.slow_watch import SlowStage
from cdsm.statics.solve import Balance, Point, continued
from cdsm.support.validation import SMALLEST
from cdsm.support.values import Array, Flags

_CHANGES = 12  # most times that the ways are changed at one load
_STEPS = 20  # most steps of Newton's method; smooth pieces need three
_BACK = 0.2  # flow with which a cable may slide back before it is said to stick, over the first
_RATE = 1e-5  # change of the share for a flow of wire, or for the rate of a quantity
_STILL = 1e-5  # a flow of wire below this part of the largest is none
_ROUNDING = 1e-9  # a slip below this part of the wire that T stretches is none

Ways = NDArray[np.int8]
"""How the cable slides in the hole after each segment (S,): 1 towards its end, −1, or 0: held."""


def ways_of(state: ChainArmState) -> Ways:
    """Return how cables slide in a state."""
    rises = np.append(np.sign(np.diff(state.tension)), 0.0)
    return np.where(state.chain.slides & _rough(state), rises, 0.0).astype(np.int8)


def on_piece(
    arm: QuasiStaticArm,
    before: QuasiStaticState,
    load: Action,
    ways: Ways,
    keep: Flags,
    guess: Array,
) -> tuple[Balance, Point, Ways] | None:
    """Find the equilibrium under a load that follows ``before``, and how cables slide there.

    Holes that hold cables go on to do so, even beyond what friction can, against the ways ``keep``
    (2, S): towards the end, and towards the motor. Else the ways are those that friction demands.
    None if that is not found.
    """
    for _ in range(_CHANGES):
        f = arm.balance(before, load, ways)
        point = continued(f, (guess,), before.arm_state.pose.q, _STEPS)
        if point is None:
            return None
        state = point.state
        assert isinstance(state, ChainArmState)
        if not np.array_equal(state.tension > 0.0, before.arm_state.tension > 0.0):
            return None
        new = _demanded(state, ways)
        new[(ways == 0) & np.where(new > 0, *keep)] = 0
        if np.array_equal(new, ways):
            return f, point, ways
        ways = new
        guess = point.x
    return None


def stop_of_slip(
    arm: QuasiStaticArm,
    before: QuasiStaticState,
    ways: Ways,
    ends: tuple[SlowStage, SlowStage],
    action: Callable[[float], Action],
) -> float | None:
    """Return about the share between two ends at which a cable stops to slide in a hole, or None.

    There the history is kept: from then on the cable sticks, where it has come to. Cables that stop
    at the first end are held from there: their ``ways`` are set to 0.
    """

    def flow(stage: SlowStage) -> Array:
        return _flows(arm, before, action, ways, stage)

    here, there = ends
    slides = ways != 0
    if not slides.any():
        return None
    after = flow(there)
    state = there.point.state
    assert isinstance(state, ChainArmState)
    turned = slides & ((after < 0.0) | (ways * state.chain.slip <= 0.0))
    if not turned.any():
        return None
    start = flow(here)
    while (back := (ways != 0) & (start < 0.0)).any():
        ways[back] = 0
        start = flow(here)
    turned &= (start > 0.0) & (after < -_BACK * start)
    if not turned.any():
        return None
    begin, end = start[turned], after[turned]
    part = (1.0 + _BACK / 2.0) * float((begin / (begin - end)).min())
    return here.share + min(max(part, 0.02), 0.9) * (there.share - here.share)


def dip_within(
    arm: QuasiStaticArm,
    before: QuasiStaticState,
    action: Callable[[float], Action],
    ways: Ways,
    ends: tuple[SlowStage, SlowStage],
    watch: Watched[SlowStage],
    positive: Flags,
) -> float | None:
    """Return a share between two ends at which a quantity may be negative, or None.

    Cables slide as ``ways`` after the first end. ``positive`` (m,) are those that may dip, positive
    at the first end. They are taken for the cubics through both ends with their slopes.
    """
    here, there = ends
    length = there.share - here.share
    first, last = watch.value(here), watch.value(there)
    may = positive & np.isfinite(last) & (last > ROUNDING * watch.scale(there))
    if length <= _RATE or not may.any():
        return None

    def slope(stage: SlowStage, ways: Ways) -> Array:
        change = watch.value(_next(arm, before, action, ways, stage)) - watch.value(stage)
        return np.asarray(change * length / _RATE)

    falls = slope(here, ways)
    may &= first + falls < 0.0  # a convex quantity lies above its tangent
    if not may.any():
        return None
    state = there.point.state
    assert isinstance(state, ChainArmState)
    rises = slope(there, ways_of(state))
    part = dip((first[may], falls[may]), (last[may], rises[may]))
    return None if part is None else here.share + part * length


def _next(
    arm: QuasiStaticArm,
    before: QuasiStaticState,
    action: Callable[[float], Action],
    ways: Ways,
    stage: SlowStage,
) -> SlowStage:
    """Return the equilibrium :data:`_RATE` of the step after one on a piece, by a Newton step."""
    share = stage.share + _RATE
    f = arm.balance(before, action(share), ways)
    point = f(stage.point.x)
    step = np.linalg.lstsq(point.slope, -point.value)[0]
    return SlowStage(share, f(stage.point.x + step), f)


def _flows(
    arm: QuasiStaticArm,
    before: QuasiStaticState,
    action: Callable[[float], Action],
    ways: Ways,
    stage: SlowStage,
) -> Array:
    """Return the wire (S,) that slips to the next segment from a load to another, nearby.

    Over the way that cables slide: negative where one would slide back.
    """
    here = arm.balance(before, action(stage.share), ways)(stage.point.x)
    states = here.state, _next(arm, before, action, ways, stage).point.state
    first, last = (s.chain.slip for s in states if isinstance(s, ChainArmState))
    flow = ways * (last - first)
    least = _STILL * float(abs(flow).max(initial=0.0))
    return np.asarray(np.where(abs(flow) <= least, 0.0, flow))


def _demanded(state: ChainArmState, ways: Ways) -> Ways:
    """Return the ways that do not contradict a state which was found with ``ways``."""
    T = np.maximum(state.tension, SMALLEST)
    rise = np.append(np.diff(np.log(T)), 0.0)
    grip = np.log(state.pose.segments.ratio)
    begins = np.where(rise > grip + _ROUNDING, 1, np.where(rise < -grip - _ROUNDING, -1, 0))
    back = ways * state.chain.slip < -_ROUNDING * state.chain.compliance * T
    goes_on = np.where(back, 0, ways)
    return np.where(_rough(state), np.where(ways == 0, begins, goes_on), 0).astype(np.int8)


def _rough(state: ChainArmState) -> Flags:
    """Return after which segments (S,) is a hole in which a taut cable can stick."""
    hole = state.pose.segments.chains.hole
    rough = np.zeros(state.tension.size, dtype=np.bool_)
    rough[hole] = can_stick(state.pose) & (state.tension[hole] > 0.0)
    return rough
