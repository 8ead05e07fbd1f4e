"""Kernel of cables over pulleys: their contacts at many postures.

The formulas are those of :mod:`cdsm.pulleys.contacts`, for W postures side by side as in
:mod:`cdsm.batch.kernels`. Which pulleys touch is known or assumed: it is the same in all postures.
So nothing branches, and the compiler vectorises the tangents too.

Shapes: B blocks of W postures, T pulleys that touch.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cdsm.cable_path import SURFACE
from cdsm.pulleys.contacts import BESIDE, INSIDE, STILL, SWEEPS
from cdsm.support.values import Array

COMPILED = bool(globals().get("COMPILED", True))
"""Whether numba compiles this module, as :mod:`cdsm.batch.kernels`."""

if COMPILED:  # else the loader gives these names
    from cdsm.batch.kernels import add_product, choose, inner_loop, kernel, lanes, place_frames

if TYPE_CHECKING:
    from cdsm.batch.path_arrays import ContactArrays, PathArrays
    from cdsm.batch.rows import ArmArrays


@inner_loop
def _meet(
    point: Array, centre: Array, axis: Array, radius: float, groove: bool, way: float, out: Array
) -> None:
    """Fill contact (3), seen from the centre, free length, height, fault: (6, W) in all."""
    tight = 2.0 * radius * SURFACE
    flank = 4.0 * radius * radius if groove else 0.0
    for w in lanes(out):
        a = axis[0, w]
        b = axis[1, w]
        c = axis[2, w]
        x = point[0, w] - centre[0, w]
        y = point[1, w] - centre[1, w]
        z = point[2, w] - centre[2, w]
        height = x * a + y * b + z * c
        x = x - height * a
        y = y - height * b
        z = z - height * c
        distance2 = x * x + y * y + z * z
        free2 = distance2 - radius * radius
        root = free2 * free2 - flank * height * height
        larger = 0.5 * (free2 + np.sqrt(np.maximum(root, 0.0)))
        on_rim = free2 <= tight
        out[5, w] = choose(root < 0.0, 1.0 * BESIDE, 0.0)
        out[5, w] = choose(on_rim, choose(free2 < -tight, 1.0 * INSIDE, 0.0), out[5, w])
        free2 = choose(on_rim | (root < 0.0), 0.0, larger)
        lever2 = distance2 - free2
        free = np.sqrt(free2)
        turn = way * np.sqrt(lever2) * free
        over = 1.0 / distance2
        out[0, w] = (lever2 * x + turn * (b * z - c * y)) * over
        out[1, w] = (lever2 * y + turn * (c * x - a * z)) * over
        out[2, w] = (lever2 * z + turn * (a * y - b * x)) * over
        out[3, w] = free
        out[4, w] = height


@inner_loop
def _fill_turn(u: Array, v: Array, axis: Array, turn: Array) -> None:
    """Fill sine and cosine, times a positive number, of the angle from u to v about the axis."""
    for w in lanes(turn):
        x = u[1, w] * v[2, w] - u[2, w] * v[1, w]
        y = u[2, w] * v[0, w] - u[0, w] * v[2, w]
        z = u[0, w] * v[1, w] - u[1, w] * v[0, w]
        turn[0, w] = axis[0, w] * x + axis[1, w] * y + axis[2, w] * z
        turn[1, w] = u[0, w] * v[0, w] + u[1, w] * v[1, w] + u[2, w] * v[2, w]


@inner_loop
def _fill_angle(turn: Array, turns: int, out: Array) -> None:
    """Fill Φ in (−90°, 270°], plus whole turns."""
    for w in lanes(out):
        angle = np.arctan2(turn[0, w], turn[1, w])
        out[w] = choose(angle < -0.5 * np.pi, angle + 2.0 * np.pi, angle) + 2.0 * np.pi * turns


@inner_loop
def _climb(u: Array, v: Array, axis: Array, radius: float, angle: Array, slope: Array) -> None:
    """Fill the slope of a helix, and move its contacts along the axis."""
    for w in lanes(slope):
        arc = radius * np.abs(angle[w])
        unrolled = u[3, w] + arc + v[3, w]
        slope[w] = choose(unrolled > 0.0, (v[4, w] - u[4, w]) / unrolled, 0.0)
        u[4, w] += slope[w] * u[3, w]
        v[4, w] = u[4, w] + slope[w] * arc
    for x in range(3):
        add_product(u[4], axis[x], u[x])
        add_product(v[4], axis[x], v[x])


@inner_loop
def _move(centre: Array, apart: Array, settled: Array, contact: Array, moved: Array) -> None:
    """Set a contact, but where it is settled, and add to ``moved`` by how much it moves."""
    for x in range(3):
        for w in lanes(moved):
            new = choose(settled[w] > 0.0, contact[x, w], centre[x, w] + apart[x, w])
            moved[w] += np.abs(new - contact[x, w])
            contact[x, w] = new


@inner_loop
def _keep_larger(a: Array, out: Array) -> None:
    for w in lanes(out):
        out[w] = choose(a[w] > out[w], a[w], out[w])


@inner_loop
def _note_settled(moved: Array, before: Array, settled: Array) -> None:
    for w in lanes(moved):
        enough = (moved[w] < STILL) | (moved[w] * moved[w] < STILL * before[w])
        settled[w] = choose(enough, 1.0, settled[w])
        before[w] = moved[w]


@inner_loop
def _turn(R: Array, a: Array, o: Array, out: Array) -> None:
    """Compute o + R a of a fixed vector a (3,)."""
    for x in range(3):
        for w in lanes(out):
            out[x, w] = o[x, w] + R[x, 0, w] * a[0] + R[x, 1, w] * a[1] + R[x, 2, w] * a[2]


@inner_loop
def _turn_back(R: Array, a: Array, o: Array, out: Array) -> None:
    """Compute Rᵀ (a − o)."""
    for w in lanes(out):
        x = a[0, w] - o[0, w]
        y = a[1, w] - o[1, w]
        z = a[2, w] - o[2, w]
        out[0, w] = R[0, 0, w] * x + R[1, 0, w] * y + R[2, 0, w] * z
        out[1, w] = R[0, 1, w] * x + R[1, 1, w] * y + R[2, 1, w] * z
        out[2, w] = R[0, 2, w] * x + R[1, 2, w] * y + R[2, 2, w] * z


@kernel
def fill_contacts(
    arm: ArmArrays, shift: Array, paths: PathArrays, q: Array, whole: bool, at: ContactArrays
) -> None:
    """Fill ``at`` for joint angles q (B, n, W): contacts while the cables touch all T pulleys.

    With ``whole`` also sites and fixed lengths, from which the pose of the arm is computed. Without
    it, places and contacts may have one block, which keeps those of the last.
    """
    n = len(arm.parent)
    T = len(paths.centre)
    W = q.shape[2]
    R = np.zeros((n + 1, 3, 3, W))
    o = np.zeros((n + 1, 3, W))
    v = np.empty((n, 3, W))
    z = np.empty((n, 3, W))
    turn = np.empty((2, W))
    zero = np.zeros((3, W))
    u = np.empty((2, 6, W))
    moved = np.empty(W)
    farthest = np.empty(W)
    previous = np.empty(W)
    settled = np.empty(W)
    for x in range(3):
        R[0, x, x] = 1.0
    for b in range(len(q)):
        kept = b % len(at.entry)
        entry = at.entry[kept]
        axis = at.axis[kept]
        contact = at.contact[kept]
        angle = at.angle[kept]
        slope = at.slope[kept]
        place_frames(arm, shift[b % len(shift)], q[b], turn, (R, o, v), z)
        for e in range(len(paths.frame)):
            _turn(R[paths.frame[e]], paths.point[e], o[paths.frame[e]], entry[e])
        for t in range(T):
            _turn(R[paths.frame[paths.centre[t]]], paths.axis[t], zero, axis[t])
        slope[:] = 0.0
        at.unsettled[b] = 0.0
        for r in range(len(paths.start)):
            low = paths.low[r]
            high = paths.low[r + 1]
            settled[:] = 0.0
            previous[:] = 0.0
            for t in range(low, high):
                contact[t] = entry[paths.centre[t]]
                contact[T + t] = contact[t]
            for _ in range(SWEEPS):
                farthest[:] = 0.0
                for t in range(low, high):
                    centre = entry[paths.centre[t]]
                    before = entry[paths.start[r]] if t == low else contact[T + t - 1]
                    after = entry[paths.end[r]] if t == high - 1 else contact[t + 1]
                    groove = paths.groove[t]
                    radius = paths.radius[t]
                    _meet(before, centre, axis[t], radius, groove, 1.0, u[0])
                    _meet(after, centre, axis[t], radius, groove, -1.0, u[1])
                    _fill_turn(u[0], u[1], axis[t], at.turn[b, t])
                    if not groove:
                        _fill_angle(at.turn[b, t], paths.turns[t], angle[t])
                        _climb(u[0], u[1], axis[t], radius, angle[t], slope[t])
                    at.fault[b, t] = np.maximum(u[0, 5], u[1, 5])
                    moved[:] = 0.0
                    _move(centre, u[0], settled, contact[t], moved)
                    _move(centre, u[1], settled, contact[T + t], moved)
                    _keep_larger(moved, farthest)
                if high - low == 1:
                    settled[:] = 1.0
                else:
                    _note_settled(farthest, previous, settled)
                if settled.min() > 0.0:
                    break
            at.unsettled[b] = np.maximum(at.unsettled[b], 1.0 - settled)
        if not whole:
            continue

        # sites in the frames of their links, wrap angles and arcs
        at.site[b, :, :] = paths.site.reshape(-1, 3, 1)
        at.fixed[b, :] = paths.fixed.reshape(-1, 1)
        for t in range(T):
            frame = paths.frame[paths.centre[t]]
            for i in (t, T + t):
                _turn_back(R[frame], contact[i], o[frame], at.site[b, paths.node[i]])
            _fill_angle(at.turn[b, t], paths.turns[t], angle[t])
            arc = at.arc[b, t]
            arc[:] = paths.radius[t] * angle[t]
            if not paths.groove[t]:
                arc *= np.sqrt(1.0 + slope[t] * slope[t])
            at.fixed[b, paths.cable[t]] += arc
