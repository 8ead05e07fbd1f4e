"""Compute the multipliers of guessed tensions, or a proof that no tensions balance the arm."""

from __future__ import annotations

import math

import numpy as np

from cdsm._former.compiling import Width, inner, lanes, upwards
from cdsm._former.serpentine_guess import Blocks, Guess
from cdsm.support.values import Array


@inner
def set_multipliers(
    blocks: Blocks, J: Array, F: Array, guess: Guess, y: Array, width: Width
) -> None:
    """Fill the multipliers y (nv, W): J_L y = F for the chosen cables of each block of J_Lᵀ.

    The chosen cables are those whose tensions the guess raised above their lower bounds. J is J_L
    (C, nv, W), and F is (C, W). If a block of ``guess`` failed, y changes only in the blocks after
    it, which are nearer to the tip.
    """
    row, row_start, cable, cable_start = blocks
    failed, chosen, p, q = guess.failed, guess.chosen, guess.best, guess.pair
    for k in range(row_start.shape[0] - 1):
        i, j, block = np.uint64(row[row_start[k]]), np.uint64(row[row_start[k + 1] - 1]), float(k)
        # rows of p and q, the two chosen cables: J at i, J at j, and F − J y of the earlier blocks
        for r in range(3):
            for w in lanes(width):
                p[r, w] = q[r, w] = 0.0
        for s in range(cable_start[k], cable_start[k + 1]):
            c, number = np.uint64(cable[s]), float(s - cable_start[k])
            for w in lanes(width):
                q[3, w] = F[c, w]
            for t in range(row_start[k]):
                before = np.uint64(row[t])
                for w in lanes(width):
                    q[3, w] -= J[c, before, w] * y[before, w]
            for r, taken in ((0, p), (1, q)):
                for w in lanes(width):
                    taken[0, w] = J[c, i, w] if chosen[k, r, w] == number else taken[0, w]
                for w in lanes(width):
                    taken[1, w] = J[c, j, w] if chosen[k, r, w] == number else taken[1, w]
                for w in lanes(width):
                    taken[2, w] = q[3, w] if chosen[k, r, w] == number else taken[2, w]
        if i == j:
            for w in lanes(width):
                y[i, w] = p[2, w] / p[0, w] if failed[w] < block else y[i, w]
            continue
        for w in lanes(width):
            q[3, w] = p[0, w] * q[1, w] - p[1, w] * q[0, w]
        for w in lanes(width):
            part = (p[2, w] * q[1, w] - q[2, w] * p[1, w]) / q[3, w]
            y[i, w] = part if failed[w] < block else y[i, w]
        for w in lanes(width):
            part = (p[0, w] * q[2, w] - q[0, w] * p[2, w]) / q[3, w]
            y[j, w] = part if failed[w] < block else y[j, w]


@inner
def set_proof(
    blocks: Blocks, J: Array, guess: Guess, normal: Array, zero: Array, width: Width
) -> None:
    """Fill ``guess.y`` with a vector y that usually proves that no tensions balance the arm.

    y is 0 in the blocks of J_Lᵀ before the failed one. In the failed block it is t + s n, where t
    is the missing torque, and n is normal to t. In later blocks it makes J_c y = 0 for the chosen
    cables c. y is a proof if J_c y ≤ 0 for all other cables, and s is the number nearest to 0 for
    which this holds, if there is one. The caller must verify y. ``normal`` (nv, W) is scratch,
    ``zero`` (C, W) are zeros.
    """
    row, row_start, cable, cable_start = blocks
    y, failed, missing, chosen = guess.y, guess.failed, guess.missing, guess.chosen
    work, turned, least, most = guess.pair[0], guess.pair[1], guess.best[0], guess.best[1]
    for k in range(row_start.shape[0] - 1):
        i, j, block = np.uint64(row[row_start[k]]), np.uint64(row[row_start[k + 1] - 1]), float(k)
        for w in lanes(width):
            y[i, w] = missing[0, w] if failed[w] == block else 0.0
        for w in lanes(width):
            y[j, w] = missing[1, w] if failed[w] == block else 0.0
        for w in lanes(width):
            normal[i, w] = -missing[1, w] if failed[w] == block else 0.0
        for w in lanes(width):
            normal[j, w] = missing[0, w] if failed[w] == block else 0.0
    set_multipliers(blocks, J, zero, guess, y, width)
    set_multipliers(blocks, J, zero, guess, normal, width)
    for w in lanes(width):
        least[w] = -math.inf
    for w in lanes(width):
        most[w] = math.inf
    for k in range(row_start.shape[0] - 1):
        for s in range(cable_start[k], cable_start[k + 1]):
            c, number, block = np.uint64(cable[s]), float(s - cable_start[k]), float(k)
            for w in lanes(width):
                work[w] = 0.0
            for w in lanes(width):
                turned[w] = 0.0
            for t in range(row_start[k + 1]):
                i = np.uint64(row[t])
                for w in lanes(width):
                    work[w] += J[c, i, w] * y[i, w]
                for w in lanes(width):
                    turned[w] += J[c, i, w] * normal[i, w]
            for w in lanes(width):
                idle = chosen[k, 0, w] == number or chosen[k, 1, w] == number
                turned[w] = 0.0 if failed[w] < block and idle else turned[w]
            for w in lanes(width):
                end = -work[w] / turned[w]
                least[w] = max(least[w], end) if turned[w] < 0.0 else least[w]
            for w in lanes(width):
                end = -work[w] / turned[w]
                most[w] = min(most[w], end) if turned[w] > 0.0 else most[w]
    for m in upwards(0, y.shape[0]):
        for w in lanes(width):
            y[m, w] += min(max(least[w], 0.0), most[w]) * normal[m, w]
