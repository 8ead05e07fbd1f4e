"""Shortest and longest lengths of the cables of an arm within its joint limits."""

from __future__ import annotations

import numpy as np

from cdsm.batch.rows import tables_of
from cdsm.manipulator import Manipulator
from cdsm.support.values import Array

_STARTS = 32  # corners, and as many random angles; more find the same in all arms of the tests
_SWEEPS = 20  # after this number of sweeps, only the best of them go on
_BEST = 4
_SAME = 1e-9  # change of a length [m] at which a search ends


def length_bounds(arm: Manipulator) -> tuple[Array, Array]:
    """Return lower and upper bounds (C,) [m] of the lengths of cables within the joint limits.

    They are the sums of the extremes of all segments. A posture attains them if no two segments of
    a cable cross the same joint, or a joint and its follower; else they may be too wide.
    """
    routing = arm.routing
    table = tables_of(arm)
    ends = np.array([arm.lower, arm.upper])
    low, high = np.sort(table.coupling.angles(ends) if table.coupling else ends, axis=0)
    paths = dict[tuple[int, ...], list[int]]()
    for s, (path, sign) in enumerate(zip(routing.path, routing.sign, strict=True)):
        paths.setdefault(tuple(path[sign != 0.0].tolist()), []).append(s)
    bounds = np.tile(routing.fixed, (2, 1))
    for path, segments in paths.items():
        a = routing.point[routing.first[segments]]
        b = routing.point[routing.second[segments]]
        j = list(path)
        joints = table.arm.turn[j], table.dimensions.shift[j], low[j], high[j]
        for sign, total in zip((-1.0, 1.0), bounds, strict=True):
            np.add.at(total, routing.cable[segments], sign * _longest(a, b, *joints, sign))
    return bounds[0], bounds[1]


def _longest(
    a: Array, b: Array, turn: Array, shift: Array, low: Array, high: Array, sign: float
) -> Array:
    """Find the largest ``sign`` · distance (S,) [m] of sites a and b (S, 3) with m joints between.

    The square of a distance is a sinusoid of each angle, whose best value is known. So one angle
    after the other is moved there, from corners of the limits and random angles, until it stays.
    """
    rng = np.random.default_rng(0)
    m = len(low)
    corners = [*np.ndindex(*[2] * m)] if 2**m <= _STARTS else rng.integers(2, size=(_STARTS, m))
    starts = np.vstack([corners, rng.uniform(size=(_STARTS, m))])
    q = np.repeat((low + (high - low) * starts).T[:, None], len(a), axis=1)  # (m, S, N)
    first, last = (np.repeat(site[:, None], q.shape[2], axis=1) for site in (a, b))
    length = np.zeros(q.shape[1:])
    change = np.inf
    sweeps = 0
    while change > _SAME:
        if (sweeps := sweeps + 1) == _SWEEPS:
            best = np.argsort(-sign * length, axis=1)[:, :_BEST]
            q = np.take_along_axis(q, best[None], 2)
            length = np.take_along_axis(length, best, 1)
            first = first[:, :_BEST]
            last = last[:, :_BEST]
        carried = [last]  # by each joint, from the last one
        for j in range(m - 1, 0, -1):
            carried.append(shift[j] + _turned(turn[j], q[j], carried[-1]))
        seen = first
        for j in range(m):
            seen = seen - shift[j]
            (_, B, C) = turn[j]
            p = carried[m - 1 - j]
            x, y = (-sign * (seen * (p @ matrix.T)).sum(axis=2) for matrix in (B, C))
            best = np.arctan2(y, x)
            nearer = np.where(np.cos(best - low[j]) > np.cos(best - high[j]), low[j], high[j])
            q[j] = np.where((low[j] <= best) & (best <= high[j]), best, nearer)
            seen = _turned(turn[j].transpose(0, 2, 1), q[j], seen)
        before = length
        length = np.linalg.norm(last - seen, axis=2)
        change = abs(length - before).max()
    return np.asarray((sign * length).max(axis=1))


def _turned(turn: Array, q: Array, p: Array) -> Array:
    """Turn points p (…, 3) by (A + B cos q + C sin q)."""
    A, B, C = (p @ matrix.T for matrix in turn)
    return np.asarray(A + np.cos(q)[..., None] * B + np.sin(q)[..., None] * C)
