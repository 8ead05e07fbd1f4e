"""Guess the least tensions of a serpentine arm.

The cables that end at a joint turn this joint and the joints before it, but none after it. So
J_Lᵀ is block triangular; a block is the axes of one joint (at most two) and the cables that end
there. From the last joint to the first, one cable per axis gets a tension above its lower bound, to
balance the joint. From the first joint to the last, the multipliers follow from these cables: see
the optimality conditions. Usually this guess is the optimum: with three cables for
each universal joint, in all of 9000 random postures up to half the joint limits, and in three of
four postures up to nine tenths. A guess takes 0.3 µs, a search by an active-set method
about 4 µs.
"""

from __future__ import annotations

import math
from itertools import chain
from typing import NamedTuple

import numpy as np

from cdsm._former.compiling import Index, Width, inner, lanes, upwards
from cdsm._former.tree import Indices, Routing
from cdsm.support.values import Array

_MOST = 2
"""Maximum number of axes of one joint."""


class Blocks(NamedTuple):
    """Joint axes and cables of the K blocks of J_Lᵀ, from base to tip.

    The arrays are empty (K = 0) if J_Lᵀ is not block triangular.

    Attributes:
        row: Joint axes (columns of J_L), block by block (nv,).
        row_start: Index in ``row`` at which each block begins, and at which the last ends (K+1,).
        cable: Cables (rows of J_L), block by block (C,).
        cable_start: Index in ``cable`` at which each block begins, and the last ends (K+1,).
    """

    row: Indices
    row_start: Indices
    cable: Indices
    cable_start: Indices


def find_blocks(routing: Routing, nv: int) -> Blocks:
    """Find the blocks of J_Lᵀ of an arm with nv joint axes; K = 0 if it is not block triangular.

    A block also needs at most two joint axes, and at least one cable for each.
    """
    turned: list[set[int]] = [set() for _ in routing.fixed]
    ends = routing.segment[1:, 3]
    for (cable, _, _, first, _), end in zip(routing.segment[:-1], ends, strict=True):
        turned[cable] |= set((routing.joint[first:end] - 1).tolist())
    rows: list[list[int]] = []
    cables: list[list[int]] = []
    before: set[int] = set()
    for c in sorted(range(len(turned)), key=lambda c: len(turned[c])):
        if not before <= turned[c]:
            return _NO_BLOCKS
        added = sorted(turned[c] - before)
        if added and (not rows or len(cables[-1]) >= len(rows[-1])):
            rows.append([])
            cables.append([])
        if not rows:  # a cable that turns no joint
            return _NO_BLOCKS
        rows[-1] += added
        cables[-1].append(c)
        before = turned[c]
    solvable = all(len(own) <= min(_MOST, len(by)) for own, by in zip(rows, cables, strict=True))
    return Blocks(*_flat(rows), *_flat(cables)) if len(before) == nv and solvable else _NO_BLOCKS


def _flat(parts: list[list[int]]) -> tuple[Indices, Indices]:
    starts = np.cumsum([0, *map(len, parts)])
    flat = list(chain.from_iterable(parts))
    return np.array(flat, dtype=np.intp), np.asarray(starts, dtype=np.intp)


_NO_BLOCKS = Blocks(*_flat([]), *_flat([]))


class Guess(NamedTuple):
    """Guessed tensions of W postures, and scratch; "block" below is a block of J_Lᵀ.

    Attributes:
        F: Tensions (C, W) [N].
        y: Multipliers (nv, W): J_L y = F for the cables above their lower bounds.
        failed: Number of the first block, from the tip on, that no pair of its cables balances
            (W,); −1 if none.
        lacking: Missing torque of the current block (2, W).
        missing: Missing torque of the block that failed (2, W).
        chosen: The two cables above their lower bounds in each of the K blocks, as numbers within
            the block (K, 2, W).
        best: Best pair of cables so far (5, W): its increase of ‖F‖², the two tensions to add, the
            two cable numbers.
        pair: Scratch for the pair that is tried (4, W).
    """

    F: Array
    y: Array
    failed: Array
    lacking: Array
    missing: Array
    chosen: Array
    best: Array
    pair: Array


@inner
def empty_guess(blocks: Blocks, nv: int, cables: int, width: int) -> Guess:
    """Allocate the :class:`Guess` of a block of ``width`` postures."""
    return Guess(
        np.empty((cables, width)),
        np.empty((nv, width)),
        np.empty(width),
        np.empty((2, width)),
        np.empty((2, width)),
        np.empty((blocks.row_start.shape[0] - 1, 2, width)),
        np.empty((5, width)),
        np.empty((4, width)),
    )


@inner
def guess_tensions(
    blocks: Blocks, J: Array, b: Array, low: Array, high: Array, guess: Guess, width: Width
) -> None:
    """Fill ``guess`` with tensions that balance the arm, one cable per axis above its lower bound.

    J is J_L (C, nv, W), b (nv, W) the torque to balance; ``low`` and ``high`` (C, W) are the
    bounds. The search ends early if the guess has failed for all W postures.
    """
    row, row_start, cable, cable_start = blocks
    F, failed, lacking, best = guess.F, guess.failed, guess.lacking, guess.best
    missing = guess.missing
    for c in upwards(0, F.shape[0]):
        for w in lanes(width):
            F[c, w] = low[c, w]
    for w in lanes(width):
        failed[w] = -1.0 if row.shape[0] else 0.0  # without blocks there is no guess
    for k in range(row_start.shape[0] - 2, -1, -1):
        i, j = np.uint64(row[row_start[k]]), np.uint64(row[row_start[k + 1] - 1])
        for r, axis in ((0, i), (1, j)):
            for w in lanes(width):
                lacking[r, w] = b[axis, w]
            for s in range(cable_start[k], cable.shape[0]):
                c = np.uint64(cable[s])
                for w in lanes(width):
                    lacking[r, w] -= J[c, axis, w] * F[c, w]
        own = cable[cable_start[k] : cable_start[k + 1]]
        _set_best(J, low, high, own, i, j, guess, width)
        balanced = 0.0
        for r in range(2):
            for w in lanes(width):
                fails = best[0, w] == math.inf and failed[w] < 0.0
                missing[r, w] = lacking[r, w] if fails else missing[r, w]
        for w in lanes(width):
            fails = best[0, w] == math.inf and failed[w] < 0.0
            failed[w] = float(k) if fails else failed[w]
            balanced += 1.0 if failed[w] < 0.0 else 0.0
        if balanced == 0.0:
            break
        for r in range(2):
            for w in lanes(width):
                guess.chosen[k, r, w] = best[3 + r, w]
            for s in range(own.shape[0]):
                c, number = np.uint64(own[s]), float(s)
                for w in lanes(width):
                    F[c, w] += best[1 + r, w] if best[3 + r, w] == number else 0.0


@inner
def _set_best(
    J: Array, low: Array, high: Array, own: Indices, i: Index, j: Index, guess: Guess, width: Width
) -> None:
    """Find the pair of cables that gives the missing torque about axes i and j at the least ‖F‖².

    If i is j, the joint has one axis, and the best single cable is found. ``own`` are the cables of
    the block of J_Lᵀ, ``low`` and ``high`` the bounds (C, W). Stores the result in ``guess.best``.
    """
    lacking, best, pair = guess.lacking, guess.best, guess.pair
    for r in range(5):
        for w in lanes(width):
            best[r, w] = math.inf if r == 0 else -1.0
    for s in range(own.shape[0]):
        for t in range(s if i == j else s + 1, s + 1 if i == j else own.shape[0]):
            c, d = np.uint64(own[s]), np.uint64(own[t])
            x, y, chosen = pair[0], pair[1], -1.0 if i == j else float(t)
            if i == j:
                for w in lanes(width):
                    x[w] = lacking[0, w] / J[c, i, w]
                for w in lanes(width):
                    y[w] = 0.0
            else:
                _solve_pair(J[c, i], J[c, j], J[d, i], J[d, j], lacking, x, y, width)
            least, most = (low[c], low[d]), (high[c], high[d])
            rows = best[0], best[1], best[2], best[3], best[4]
            _keep_better(x, y, *least, *most, float(s), chosen, *rows, width)


@inner
def _solve_pair(
    a: Array, b: Array, c: Array, d: Array, torque: Array, x: Array, y: Array, width: Width
) -> None:
    """Fill the tensions x and y (W,) of two cables: x (a, b) + y (c, d) = ``torque`` (2, W).

    The first cable has the moment arms a and b about two axes, the second c and d, (W,) each.
    """
    for w in lanes(width):
        determinant = a[w] * d[w] - b[w] * c[w]
        x[w] = (torque[0, w] * d[w] - torque[1, w] * c[w]) / determinant
        y[w] = (a[w] * torque[1, w] - b[w] * torque[0, w]) / determinant


@inner
def _keep_better(
    x: Array,
    y: Array,
    least_x: Array,
    least_y: Array,
    most_x: Array,
    most_y: Array,
    p: float,
    q: float,
    cost: Array,
    best_x: Array,
    best_y: Array,
    best_p: Array,
    best_q: Array,
    width: Width,
) -> None:
    """Make the cables p and q the best pair where they are admissible and cost less than it.

    x and y (W,) are the tensions that p and q need beyond their lower bounds ``least``. They are
    admissible if they are not negative and the sums do not exceed the upper bounds ``most``. The
    ``cost`` (W,) is the increase of ‖F‖².
    """
    for w in lanes(width):
        # cables that cannot give the torque have infinite x and y, or NaN
        within = 0.0 <= x[w] < math.inf and 0.0 <= y[w] < math.inf
        fits = least_x[w] + x[w] <= most_x[w] and least_y[w] + y[w] <= most_y[w]
        added = (2.0 * least_x[w] + x[w]) * x[w] + (2.0 * least_y[w] + y[w]) * y[w]
        better = within and fits and added < cost[w]
        cost[w] = added if better else cost[w]
        best_x[w] = x[w] if better else best_x[w]
        best_y[w] = y[w] if better else best_y[w]
        best_p[w] = p if better else best_p[w]
        best_q[w] = q if better else best_q[w]
