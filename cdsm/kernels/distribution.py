"""Numba kernels of tension distribution (Eq. 17): guess or search, then verify the tensions.

    min ½‖F‖²   subject to   J_Lᵀ F = J_Xᵀ W − g   and   low ≤ F ≤ high.

Most guesses of a block of postures are optimal. The other postures are solved one by one, by a
kernel that is compiled when it is first needed.
"""

from __future__ import annotations

import numpy as np

from cdsm.kernels.active_set import FOUND, IMPOSSIBLE, empty_state, search
from cdsm.kernels.compiling import Index, Width, compiled, inlined, inner, lanes, threaded, upwards
from cdsm.kernels.serpentine_guess import (
    Blocks,
    Guess,
    empty_guess,
    guess_tensions,
    is_provably_infeasible,
    set_multipliers,
)
from cdsm.kernels.tension import Balance, Certificate, certificate, is_infeasible, set_optimal
from cdsm.kernels.tree import Indices
from cdsm.support.values import Array

OPTIMAL, INFEASIBLE, UNDECIDED = range(3)
"""Outcome: certified tensions; a proof that there are none; neither."""


@inner
def set_torque(
    jacobian: Array, gravity_torque: Array, wrench: Array, torque: Array, width: Width
) -> None:
    """Fill ``torque`` (nv, W) with J_Xᵀ W − g, which the cables must balance."""
    for i in upwards(0, torque.shape[0]):
        for w in lanes(width):
            torque[i, w] = -gravity_torque[i, w]
        for a in range(6):
            for w in lanes(width):
                torque[i, w] += wrench[a, w] * jacobian[a, i, w]


@inner
def set_arms(J: Array, smallest: float, arms: Array, width: Width) -> None:
    """Copy J_L (C, nv, W); moment arms below ``smallest`` [m] are rounding and become zero."""
    for c in upwards(0, J.shape[0]):
        for i in upwards(0, J.shape[1]):
            for w in lanes(width):
                arms[c, i, w] = J[c, i, w] if abs(J[c, i, w]) >= smallest else 0.0


@inner
def keep_balance(arms: Array, torque: Array, balance: Balance, row: Index, w: Index) -> None:
    """Copy moment arms (C, nv, W) and torque (nv, W) of posture w of a block to a row."""
    for i in upwards(0, torque.shape[0]):
        balance.torque[row, i] = torque[i, w]
    for c in upwards(0, arms.shape[0]):
        for i in upwards(0, arms.shape[1]):
            balance.arms[row, c, i] = arms[c, i, w]


@inlined
def distribute(
    blocks: Blocks,
    J: Array,
    b: Array,
    low: Array,
    high: Array,
    guess: Guess,
    certificate: Certificate,
    tension: Array,
    width: Width,
) -> None:
    """Fill the tensions (C, W) with a guess of the least ones, and verify it.

    The guess is the optimum where ``certificate.optimal`` is 1 and ``guess.failed`` is −1. J is J_L
    (C, nv, W), with moment arms of rounding set to zero; b is the torque to balance (nv, W);
    ``low`` and ``high`` are the bounds (C, W).
    """
    guess_tensions(blocks, J, b, low, high, guess, width)
    set_multipliers(blocks, J, guess.F, guess, np.intp(0), width)
    set_optimal(J, b, low, high, guess.F, guess.y, certificate, width)
    set_within(guess.F, low, high, tension, width)


@inner
def set_within(F: Array, low: Array, high: Array, tension: Array, width: Width) -> None:
    """Fill ``tension`` (C, W) with F limited to the bounds ``low`` and ``high`` (C, W).

    Rounding may have moved F slightly beyond them.
    """
    for c in upwards(0, F.shape[0]):
        for w in lanes(width):
            tension[c, w] = min(max(F[c, w], low[c, w]), high[c, w])


@compiled
def single_guess(
    row: Indices,
    row_start: Indices,
    cable: Indices,
    cable_start: Indices,
    jacobian: Array,
    length_jacobian: Array,
    gravity_torque: Array,
    wrench: Array,
    low: Array,
    high: Array,
    smallest: float,
) -> tuple[Array, bool]:
    """Guess the least tensions (C,) [N] of one posture, and say whether they are optimal.

    The first four arguments are the fields of :class:`Blocks`; the others are J_X, J_L, g, W, the
    bounds, and the least moment arm that counts [m]. The bits are those of a block of postures.
    """
    count, nv = length_jacobian.shape
    blocks = Blocks(row, row_start, cable, cable_start)
    JX, J = jacobian.reshape(6, nv, 1), length_jacobian.reshape(count, nv, 1)
    g, W = gravity_torque.reshape(nv, 1), wrench.reshape(6, 1)
    torque, arms, tension = np.empty((nv, 1)), np.empty((count, nv, 1)), np.empty((count, 1))
    # copies are writable like the scratch, so one compilation serves both
    least, most = low.copy().reshape(count, 1), high.copy().reshape(count, 1)
    guess, check = empty_guess(blocks, nv, count, 1), certificate(nv, count, 1)
    set_torque(JX, g, W, torque, None)
    set_arms(J, smallest, arms, None)
    distribute(blocks, arms, torque, least, most, guess, check, tension, None)
    return tension.reshape(count), check.optimal[0] == 1.0 and guess.failed[0] < 0.0


@threaded
def search_tensions(
    blocks: Blocks,
    J: Array,
    b: Array,
    low: Array,
    high: Array,
    tension: Array,
    outcome: Indices,
) -> None:
    """Solve for the tensions (r, C) of postures whose guess is wrong; fill the outcome (r,).

    J is (r, C, nv) and b (r, nv); ``low`` and ``high`` are (r, C): as in :func:`distribute`.
    Without an outcome OPTIMAL, the tensions are meaningless.
    """
    for r in range(J.shape[0]):
        outcome[r] = _search_one(blocks, J[r], b[r], low[r], high[r], tension[r])


@inner
def _search_one(
    blocks: Blocks, rows: Array, torque: Array, lowest: Array, highest: Array, tension: Array
) -> int:
    """Fill the tensions (C,) of one posture and return the outcome.

    ``rows`` is J_L (C, nv), ``torque`` (nv,) is to be balanced; ``lowest`` and ``highest`` are the
    bounds (C,).
    """
    count, nv = rows.shape
    J, b = rows.reshape(count, nv, 1), torque.reshape(nv, 1)
    low, high = lowest.reshape(count, 1), highest.reshape(count, 1)
    one = J.shape[2]  # numba would compile kernels once more for a literal 1
    guess, state = empty_guess(blocks, nv, count, one), empty_state(nv, count)
    guess_tensions(blocks, J, b, low, high, guess, one)
    if (
        blocks.row.shape[0]
        and guess.failed[0] >= 0.0
        and is_provably_infeasible(blocks, J, b, low, high, guess, np.zeros((count, 1)))
    ):
        return INFEASIBLE
    found = search(rows, torque, lowest, highest, state)
    if found == FOUND:
        F, y, check = state.F.reshape(count, 1), state.y.reshape(nv, 1), certificate(nv, count, one)
        set_optimal(J, b, low, high, F, y, check, one)
        if check.optimal[0] == 1.0:
            for c in range(count):
                tension[c] = min(max(state.F[c], lowest[c]), highest[c])
            return OPTIMAL
    if found == IMPOSSIBLE and is_infeasible(rows, torque, lowest, highest, state.y):
        return INFEASIBLE
    return UNDECIDED
