"""Guess of the tensions of a serpentine arm, or a proof that no tensions balance it.

The cables that end at a joint turn this joint and the joints before it, but no joint behind it. So
J_Lᵀ is block triangular. From the last joint to the first, one cable per axis (at most two) is
raised above its lower bound to balance the joint. From the first joint to the last, the multipliers
follow from these cables. Mostly this guess is the optimum. With three cables for each universal
joint, it was the optimum in all of 9000 random postures up to half the joint limits. Up to nine
tenths of the limits, it was the optimum in three of four postures. A guess takes 0.3 to 1.5 µs, a
search by :mod:`cdsm.batch.active_set` 9 to 16 µs.
"""

from __future__ import annotations

import math
from itertools import chain
from typing import NamedTuple

import numpy as np

from cdsm.batch.layout import Flags
from cdsm.kernels.compiling import compiled
from cdsm.kernels.tension import is_infeasible
from cdsm.kernels.tree import Indices, Routing
from cdsm.support.values import Array

_MOST = 2
"""Maximum number of axes of one joint."""


class Blocks(NamedTuple):
    """Joint axes and cables of all blocks from base to tip; empty if the guess cannot be used.

    Attributes:
        row: Columns of J_L, block by block (nv,).
        row_start: Index in ``row`` at which each block begins, and where the last ends.
        cable: Rows of J_L, block by block (C,).
        cable_start: Index in ``cable`` at which each block begins, and where the last ends.
    """

    row: Indices
    row_start: Indices
    cable: Indices
    cable_start: Indices


def blocks(routing: Routing, nv: int) -> Blocks:
    """Find the blocks of an arm with nv joint coordinates."""
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


@compiled
def guess(
    blocks: Blocks,
    J: Array,
    b: Array,
    low: Array,
    high: Array,
    F: Array,
    free: Flags,
    lacking: Array,
) -> int:
    """Fill tensions F (C,) that balance the arm with the fewest cables above their lower bounds.

    Returns:
        −1, or the block that no two cables balance; ``lacking`` (2,) is then its missing torque.
    """
    row, row_start, cable, cable_start = blocks
    for c in range(F.shape[0]):
        F[c], free[c] = low[c], False
    for k in range(row_start.shape[0] - 2, -1, -1):
        i, j = row[row_start[k]], row[row_start[k + 1] - 1]
        lacking[0], lacking[1] = b[i], b[j]
        for s in range(cable_start[k], cable.shape[0]):
            lacking[0] -= J[cable[s], i] * F[cable[s]]
            lacking[1] -= J[cable[s], j] * F[cable[s]]
        p, q, x, y = _cheapest(
            J, lacking, low, high, cable[cable_start[k] : cable_start[k + 1]], i, j
        )
        if p < 0:
            return k
        F[p] += x
        free[p] = True
        if i != j:
            F[q] += y
            free[q] = True
    return -1


@compiled
def _cheapest(
    J: Array, lacking: Array, low: Array, high: Array, own: Indices, i: int, j: int
) -> tuple[int, int, float, float]:
    """Return cables p, q (or −1) that give the lacking torque at least ‖F‖², and added tensions."""
    best, p, q, x, y = math.inf, -1, -1, 0.0, 0.0
    for s in range(own.shape[0]):
        c = own[s]
        if i == j:
            more = lacking[0] / J[c, i] if J[c, i] != 0.0 else -1.0
            cost = (2.0 * low[c] + more) * more
            if more >= 0.0 and low[c] + more <= high[c] and cost < best:
                best, p, x = cost, c, more
            continue
        for t in range(s + 1, own.shape[0]):
            d = own[t]
            det = J[c, i] * J[d, j] - J[c, j] * J[d, i]
            if det == 0.0:
                continue
            more = (lacking[0] * J[d, j] - lacking[1] * J[d, i]) / det
            also = (J[c, i] * lacking[1] - J[c, j] * lacking[0]) / det
            cost = (2.0 * low[c] + more) * more + (2.0 * low[d] + also) * also
            within = low[c] + more <= high[c] and low[d] + also <= high[d]
            if more >= 0.0 and also >= 0.0 and within and cost < best:
                best, p, q, x, y = cost, c, d, more, also
    return p, q, x, y


@compiled
def multipliers(blocks: Blocks, J: Array, F: Array, free: Flags, first: int, y: Array) -> None:
    """Fill y (nv,) from block ``first`` on so that J_L y = F for the free cables there."""
    row, row_start, cable, cable_start = blocks
    for k in range(first, row_start.shape[0] - 1):
        i, j = row[row_start[k]], row[row_start[k + 1] - 1]
        p = q = -1
        for s in range(cable_start[k], cable_start[k + 1]):
            if free[cable[s]]:
                p, q = q, cable[s]
        y[i] = y[j] = 0.0
        right = F[q]
        for s in range(row_start[k]):
            right -= J[q, row[s]] * y[row[s]]
        if i == j:
            y[i] = right / J[q, i]
            continue
        left = F[p]
        for s in range(row_start[k]):
            left -= J[p, row[s]] * y[row[s]]
        det = J[p, i] * J[q, j] - J[p, j] * J[q, i]
        y[i] = (left * J[q, j] - right * J[p, j]) / det
        y[j] = (J[p, i] * right - J[q, i] * left) / det


@compiled
def is_provably_infeasible(
    blocks: Blocks,
    J: Array,
    b: Array,
    low: Array,
    high: Array,
    free: Flags,
    lacking: Array,
    k: int,
    zero: Array,
    v: Array,
) -> bool:
    """Check whether a proof shows that no tensions balance block k, which lacks torque.

    The proof is a vector v. In block k, v is normal to a line that separates the lacking torque
    from the torques of the block's cables; mostly the line is along one of these torques. For the
    joints behind block k, v is such that their free cables do no work.

    J is J_L (C, nv), b the torque to balance (nv,). ``free`` (C,) marks the free cables behind
    block k, ``lacking`` (2,) is its missing torque, ``zero`` (C,) holds zeros, v (nv,) is filled.
    """
    row, row_start, cable, cable_start = blocks
    i, j = row[row_start[k]], row[row_start[k + 1] - 1]
    for s in range(cable_start[k] - 1, cable_start[k + 1]):
        x, y = lacking[0], lacking[1]
        if s >= cable_start[k]:
            x, y = -J[cable[s], j], J[cable[s], i]
            if x * lacking[0] + y * lacking[1] < 0.0:
                x, y = -x, -y
        for m in range(v.shape[0]):
            v[m] = 0.0
        v[j] = y
        v[i] = x
        multipliers(blocks, J, zero, free, k + 1, v)
        if is_infeasible(J, b, low, high, v):
            return True
        if i == j:
            break
    return False
