"""Follow a stable equilibrium of an arm while its load grows from one share to another.

Where it ends, K_θ is singular. There the share of the load is no good coordinate: at a fold it
turns back. So the end is found along the arc of the branch (Riks, J. Appl. Mech. 39, 1972).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from cdsm.errors import CdsmError
from cdsm.posture import Posture
from cdsm.statics.locked_arm import LockedArm
from cdsm.statics.solve import FAR, Balance, Point, continued, least_eigenvalue, stable_between
from cdsm.support.values import Array, Flags

_FINEST = 2.0**-12  # relative precision of the last share of the search; below 1e-9, absolute
_RATE = 1e-6  # change of the share for a difference
_STILL = 1e-9  # an arm that moves by less [rad] while the whole load comes does not move
_NEWTON = 30  # most steps of Newton's method along the arc
_CONVERGED = 1e-12  # largest |f| along the arc, over its scale

_LOST = CdsmError("the branch of equilibria cannot be followed to its end.")


Model = Callable[[float], LockedArm]
"""Arm under a share of the load and of the pull."""


class Stage(NamedTuple):
    """Equilibrium of a branch."""

    share: float  # of the load and of the pull [-]
    point: Point
    balance: Balance
    arm: LockedArm  # under this share

    @property
    def pose(self) -> Posture:
        """Its posture."""
        return self.point.state.pose


def stage_at(model: Model, pose: Posture, stop_torque: Array, share: float) -> Stage:
    """Return the equilibrium at a known posture, where the stops push with ``stop_torque``."""
    arm = model(share)
    f = Balance(arm.at, arm.reference, arm.at_pose(pose))
    return Stage(share, f(pose.q / f.unit - stop_torque * f.unit / f.k), f, arm)


def equilibrium_near(model: Model, share: float, before: Stage) -> Stage | None:
    """Find the stable equilibrium near ``before`` under another share; None if there is none."""
    arm = model(share)
    pose = before.pose
    f = Balance(arm.at, arm.reference, arm.at_pose(pose))
    guess = pose.q / f.unit - before.point.stop_torque * f.unit / f.k
    found = continued(f, (guess,), pose.q)
    return None if found is None else Stage(share, found, f, arm)


def follow(model: Model, start: Stage, goal: float) -> list[Stage]:
    """Follow a stable equilibrium while its share of load and pull grows to ``goal``.

    Returns the equilibria on the way, ``start`` first. The last one has a smaller share than
    ``goal`` if the branch ends before: a little beyond, the arm jumps.
    """
    branch = [start]
    step = goal - start.share
    while (here := branch[-1]).share < goal:
        there = equilibrium_near(model, min(goal, here.share + step), here)
        if there is not None and stable_between(model(there.share).at, here.pose.q, there.pose.q):
            branch.append(there)
            step = 2.0 * step
        elif step > _FINEST * max(here.share, 1e-9):
            step /= 2.0
        else:
            break
    return branch


def rate(model: Model, stage: Stage) -> Array:
    """Compute dx/dshare (nv,) of the branch at an equilibrium."""
    residual = [model(stage.share + h).at_pose(stage.pose).residual for h in (0.0, _RATE)]
    change = (residual[1] - residual[0]) / _RATE * stage.balance.unit
    return np.asarray(-np.linalg.lstsq(stage.point.slope, change)[0], np.float64)


class BranchEnd(NamedTuple):
    """Where a branch loses its stability."""

    stage: Stage
    slack: tuple[tuple[int, float], ...]  # cables that go slack on the way there, and the shares


def end_of_branch(model: Model, last: Stage) -> BranchEnd | None:
    """Find where the branch beyond ``last`` loses its stability.

    The smallest eigenvalue of K_θ is 0 there, or falls below 0 as a cable goes slack. Returns None
    if the way there cannot be followed.
    """
    taut = last.arm.continued_tensions(last.pose) >= 0.0
    slack = list[tuple[int, float]]()
    here = last
    for _ in range(taut.size + 1):
        try:
            stage, cable = _end_of_piece(model, here, taut)
        except CdsmError:
            return None
        if cable is not None:
            slack.append((cable, stage.share))
            taut = taut & (np.arange(taut.size) != cable)
        after = _held(model(stage.share), taut, stage)
        if cable is None or least_eigenvalue(after.balance, after.point) <= 0.0:
            return BranchEnd(after, tuple(slack))
        here = after
    return None


def _held(arm: LockedArm, taut: Flags, stage: Stage) -> Stage:
    """Return an equilibrium as that of an arm whose cables stay taut or slack."""
    kept = arm.keeping(taut)
    balance = stage.balance.under(kept.at)
    return Stage(stage.share, balance(stage.point.x), balance, kept)


def _end_of_piece(model: Model, last: Stage, taut: Flags) -> tuple[Stage, int | None]:
    """Follow an arm whose cables stay taut or slack to where one would push, or to λ = 0.

    Returns the equilibrium there and the cable; None where the smallest eigenvalue λ of K_θ is 0.
    """
    from scipy.optimize import brentq  # slow to import

    def kept(share: float) -> LockedArm:
        return model(share).keeping(taut)

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
        F = np.where(taut, stage.arm.continued_tensions(stage.pose), math.inf)
        return np.append(F, least_eigenvalue(stage.balance, stage.point))

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
        i: brentq(lambda way, i=i: values(way)[i], low, high, xtol=1e-300, rtol=1e-14)
        if before[i] > 0.0
        else low
        for i in np.flatnonzero(values(high) <= 0.0).tolist()
    }
    first = min(roots, key=lambda i: roots[i])
    return at(roots[first]), first if first < taut.size else None


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
