"""Joint angles whose tips are at a grid of places, each continued from its neighbour's."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from cdsm.kinematics import inverse_kinematics
from cdsm.manipulator import Manipulator
from cdsm.support.values import Array

_FIRST_TIPS = 30  # number of places from which a plane is entered at most
_FIRST_BEND = 0.02  # of all joints [rad or m], from which the first tip is sought
_NEWTON_STEPS = 60  # for one tip
_FIRST_STEPS = 20  # within which it must be reached
_REACHED = 1e-9  # largest distance of a tip from its target, over the arm's length
_SINGULAR = 1e-6  # smaller singular values of a Jacobian, over the largest, count as zero
_SETTLED = 1e-5  # change of the angles that ends the search [rad or m]
_BACK = 0.5  # part of the way back to the straight arm in one step; all of it may swing
_LARGEST_STEP = 0.3  # of an angle in one step [rad or m]


def reach_tips(arm: Manipulator, targets: Array) -> Array:
    """Return angles (n, m, nv) whose tips are at targets (n, m, 3) [m]; NaN where none is found.

    From the first tip that is found, each one starts at the angles of its neighbour.
    """
    angles = np.full((*targets.shape[:2], arm.nv), np.nan)
    straight = arm.body.straight
    bent = np.clip(_FIRST_BEND, arm.lower, arm.upper)
    away = np.linalg.norm(targets - arm.at(straight).tip[:3, 3], axis=-1)
    order = np.argsort(away, axis=None)[:: max(1, away.size // _FIRST_TIPS)]
    border = deque[tuple[int, int]]()
    for flat in order.tolist():
        cell = divmod(flat, targets.shape[1])
        solution = inverse_kinematics(arm, targets[cell], bent)
        if solution.reachable:
            angles[cell] = solution.angles
            border.append(cell)
            break
    while border:
        row, column = border.popleft()
        for cell in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
            inside = 0 <= cell[0] < targets.shape[0] and 0 <= cell[1] < targets.shape[1]
            if inside and math.isnan(angles[cell][0]):
                q = _nearest_angles(arm, targets[cell], angles[row, column], straight)
                if q is not None:
                    angles[cell] = q
                    border.append(cell)
    return angles


def _nearest_angles(arm: Manipulator, target: Array, start: Array, straight: Array) -> Array | None:
    """Return the angles nearest to the straight arm whose tip is at ``target``, or None.

    The tip is moved to its target by Newton's steps of least length from ``start``. Steps within
    the null space of the Jacobian then lead to θ − θ_0 = Jᵀλ. Joints at limits stay there.
    """
    reached = None
    q = start
    for count in range(_NEWTON_STEPS):
        tip, jacobian = arm.body.tip(q)
        error = target - tip[:3, 3]
        near = float(np.linalg.norm(error)) <= _REACHED * arm.length
        if near:
            reached = q
        elif reached is None and count >= _FIRST_STEPS:
            return None
        free = np.full(arm.nv, True)
        for _ in range(arm.nv):
            change = _step(
                jacobian[:3] * free, error, _BACK * (straight - q) * free, reached is not None
            )
            blocked = ((q <= arm.lower) & (change < 0.0)) | ((q >= arm.upper) & (change > 0.0))
            if not (blocked & free).any():
                break
            free &= ~blocked
        largest = float(abs(change).max(initial=0.0))
        if near and largest <= _SETTLED:
            break
        part = min(1.0, _LARGEST_STEP / max(largest, _SETTLED))
        q = np.clip(q + part * change, arm.lower, arm.upper)
    return reached


def _step(J: Array, error: Array, back: Array, reached: bool) -> Array:
    """Return the least step (nv,) that removes ``error`` (3,), and if ``reached`` goes ``back``."""
    inverse = np.linalg.pinv(J, rcond=_SINGULAR)
    change = inverse @ error
    return change + back - inverse @ (J @ back) if reached else change
