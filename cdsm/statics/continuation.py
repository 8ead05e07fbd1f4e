"""Follow a stable equilibrium of an arm while its load grows from one share to another.

The branch is followed piece by piece (:mod:`cdsm.statics.pieces`), so no step passes over a loss of
stability that changes back within it. Where the branch ends, K_θ is singular, or jumps to a matrix
that is not positive definite as a cable goes slack. At a singular K_θ the share of the load is no
good coordinate: at a fold it turns back. So the end is found along the arc of the branch (Riks,
J. Appl. Mech. 39, 1972).
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from cdsm.errors import CdsmError
from cdsm.statics.pieces import (
    Model,
    Stage,
    begun,
    equilibrium_near,
    is_held,
    next_on_piece,
    piece_of,
    rate,
    root,
    under,
)
from cdsm.statics.solve import FAR, Balance, least_eigenvalue
from cdsm.support.values import Array

_FINEST = 2.0**-12  # relative precision of the last share of the search; below 1e-9, absolute
_RATE = 1e-6  # change of the share for a difference
_STILL = 1e-9  # an arm that moves by less [rad] while the whole load comes does not move
_NEWTON = 30  # most steps of Newton's method along the arc
_CONVERGED = 1e-12  # largest |f| along the arc, over its scale
_SNAP = 0.02  # largest motion of a joint [rad] of an arm that snaps through and is followed on
_BEYOND = 1e-9  # part of the goal beyond the end of a branch, where the arm snaps through

_LOST = CdsmError("the branch of equilibria cannot be followed to its end.")


def follow(model: Model, start: Stage, goal: float) -> list[Stage]:
    """Follow a stable equilibrium while its share of load and pull grows to ``goal``.

    Returns the equilibria on the way, ``start`` first; among them those where cables go slack or
    taut, and where joints reach or leave their stops. Where the arm loses its stability as a cable
    goes slack, and finds another equilibrium nearby, it goes on from there; else the last one has a
    smaller share than ``goal``: it is the end of the branch, from which the arm jumps.
    """
    branch = [begun(model, start) if start.taut is None else start]
    step = goal - start.share
    changes = 0  # at one share
    while (here := branch[-1]).share < goal:
        ends = changes > 2 * (here.point.x.size + here.pose.cable_lengths.size)
        there = None if ends else next_on_piece(model, here, min(goal, here.share + step))
        if there is not None:
            branch.append(there)
            changes = changes + 1 if there.share == here.share else 0
            step = 2.0 * step
        elif not ends and step > _FINEST * max(here.share, 1e-9):
            step /= 2.0
        else:
            way, breaks = _to_end(model, here)
            branch += way
            snapped = _snapped(model, branch[-1], goal) if breaks else None
            if snapped is None:
                break
            branch.append(snapped)
            step = goal - snapped.share
            changes = 0
    return branch


def _snapped(model: Model, end: Stage, goal: float) -> Stage | None:
    """Return the equilibrium nearby to which an arm snaps where a cable goes slack, or None."""
    share = end.share + _BEYOND * goal
    stage = equilibrium_near(model, share, end) if share < goal else None
    if stage is None or abs(stage.pose.q - end.pose.q).max() > _SNAP:
        return None
    return begun(model, stage)._replace(snapped=True)


def _to_end(model: Model, last: Stage) -> tuple[list[Stage], bool]:
    """Return the equilibria from ``last`` to where the branch loses its stability, and how.

    There the smallest eigenvalue of K_θ is 0; or, the second result, it falls below 0 as a cable
    goes slack. There are none if ``last`` is the end, or if the way there cannot be followed.
    """
    found = list[Stage]()
    here = last
    for _ in range(2 * here.pose.cable_lengths.size + 1):
        if not is_held(model, here):
            return found, True
        try:
            stage, cable = _end_of_piece(model, here)
        except CdsmError:
            break
        assert here.taut is not None
        taut = here.taut if cable is None else here.taut ^ (np.arange(here.taut.size) == cable)
        here = under(model, stage, taut)
        found.append(here)
        if cable is None:
            return found, False
    return [], False


def _end_of_piece(model: Model, last: Stage) -> tuple[Stage, int | None]:
    """Follow a piece to where a cable goes slack or taut, or to λ = 0, along its arc.

    Returns the equilibrium there and the cable; None where the smallest eigenvalue λ of K_θ is 0.
    """
    kept = piece_of(model, last)
    taut = last.taut
    assert taut is not None
    last = under(kept, last, taut)
    speed = rate(kept, last)
    length = float(np.linalg.norm(speed))
    still = length <= _STILL  # as a straight arm does under a load along it
    tangent = speed / (length or 1.0)
    stages = {0.0: last}

    def at(distance: float) -> Stage:
        if distance not in stages and still:
            arm = kept(last.share + distance)
            balance = last.balance.under(arm.at)
            stages[distance] = Stage(last.share + distance, balance(last.point.x), balance, arm)
        if distance not in stages:
            near = stages[min(stages, key=lambda known: abs(known - distance))]
            stages[distance] = _on_arc(kept, last, near, tangent, distance, length)
        return stages[distance]

    def values(distance: float) -> Array:
        stage = at(distance)
        F = stage.arm.continued_tensions(stage.pose)
        F = np.where(stage.arm.locks, np.where(taut, F, -F), math.inf)
        return np.append(F, least_eigenvalue(stage.balance, stage.point))

    def one_value(i: int, distance: float) -> float:
        return float(values(distance)[i])

    low = 0.0
    high = (1.0 if still else length) * _FINEST * max(last.share, 1e-9)
    farthest = last.share if still else FAR
    while (values(high) > 0.0).all():
        low = high
        high = 2.0 * high
        if high > farthest:
            raise _LOST
    before = values(low)
    roots = {
        i: root(partial(one_value, i), low, high, 1e-300, 1e-14) if before[i] > 0.0 else low
        for i in np.flatnonzero(values(high) <= 0.0).tolist()
    }
    first = min(roots, key=lambda i: roots[i])
    return at(roots[first]), first if first < last.pose.cable_lengths.size else None


def _on_arc(
    model: Model, origin: Stage, near: Stage, tangent: Array, distance: float, speed: float
) -> Stage:
    """Solve f(x, share) = 0 and tangent · (x − x_0) = distance; CdsmError if it fails."""
    unit = origin.balance.unit
    ahead = distance - float(tangent @ (near.point.x - origin.point.x))
    x = near.point.x + ahead * tangent
    share = near.share + ahead / speed * (near is origin)
    for _ in range(_NEWTON):
        arm = model(share)
        f = Balance(arm.at, arm.reference, origin.point.state)
        point = f(x)
        missed = distance - float(tangent @ (x - origin.point.x))
        if point.off < _CONVERGED and abs(missed) <= 1e-15 + 1e-12 * abs(distance):
            return Stage(share, point, f, arm)
        beyond = model(share + _RATE).at_pose(point.state.pose).residual
        change = (beyond - point.state.residual) / _RATE * unit
        matrix = np.block([[point.slope, change[:, None]], [tangent[None], np.zeros((1, 1))]])
        size = abs(matrix).max(axis=1)
        size[size == 0.0] = 1.0
        step = np.linalg.lstsq(matrix / size[:, None], np.append(-point.value, missed) / size)[0]
        largest = float(abs(step[:-1]).max())
        if not math.isfinite(largest) or largest > FAR:
            break
        x = x + step[:-1]
        share += float(step[-1])
    raise _LOST
