"""Numba kernels of tension distribution (Eq. 17): guess or search, then verify the tensions.

    min ½‖F‖²   subject to   J_Lᵀ F = J_Xᵀ W − g   and   low ≤ F ≤ high.

Most guesses of a block of postures are optimal. The other postures are solved in blocks of their
own, by a kernel that is compiled when it is first needed.
"""

from __future__ import annotations

import numpy as np

from cdsm.kernels.active_set import empty_state, search
from cdsm.kernels.compiling import (
    WIDTH,
    Index,
    Width,
    compiled,
    inlined,
    inner,
    lanes,
    threaded,
    upwards,
)
from cdsm.kernels.serpentine_guess import (
    Blocks,
    Guess,
    empty_guess,
    guess_tensions,
    set_multipliers,
    set_proof,
)
from cdsm.kernels.tension import (
    Balance,
    Certificate,
    certificate,
    set_infeasible,
    set_optimal,
)
from cdsm.kernels.tree import Indices
from cdsm.support.values import Array

OPTIMAL, INFEASIBLE, UNDECIDED = range(3)
"""Outcome: certified tensions; a proof that there are none; neither."""

_NUMBERS = 2**17
"""Count of numbers in the memory of a block that is searched, so that the cache holds it."""


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

    The guess is the optimum where ``certificate.certified`` is 1 and ``guess.failed`` is −1. J is
    J_L (C, nv, W), with moment arms of rounding set to zero; b is the torque to balance (nv, W);
    ``low`` and ``high`` are the bounds (C, W).
    """
    guess_tensions(blocks, J, b, low, high, guess, width)
    set_multipliers(blocks, J, guess.F, guess, guess.y, width)
    set_optimal(J, b, low, high, guess.F, guess.y, certificate, width)
    set_within(guess.F, low, high, tension, width)


@inner
def refuse(
    blocks: Blocks,
    J: Array,
    b: Array,
    low: Array,
    high: Array,
    guess: Guess,
    certificate: Certificate,
    zero: Array,
    width: Width,
) -> None:
    """Set ``certificate.certified`` to 1 where the guess gives a proof of infeasibility, else to 0.

    ``zero`` (C, W) are zeros; the other arguments are those of :func:`distribute`, after it.
    """
    set_proof(blocks, J, guess, certificate.y, zero, width)
    set_infeasible(J, b, low, high, guess.y, certificate, width)


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
    return tension.reshape(count), check.certified[0] == 1.0 and guess.failed[0] < 0.0


@threaded
def search_tensions(
    J: Array, b: Array, low: Array, high: Array, rows: Indices, tension: Array, outcome: Indices
) -> None:
    """Solve for the tensions of the postures ``rows`` (r,), whose guess is wrong.

    J is (B, C, nv) and b (B, nv); ``low`` and ``high`` are (B, C), or (1, C) for all postures: as
    in :func:`distribute`. Fills the tensions (B, C) and the outcome (r,). Without an outcome
    OPTIMAL, the tensions are meaningless.
    """
    count, nv = J.shape[1], J.shape[2]
    width = max(1, min(WIDTH, rows.shape[0], _NUMBERS // (count * (count + nv))))
    arms, torque = np.empty((count, nv, width)), np.empty((nv, width))
    least, most = np.empty((count, width)), np.empty((count, width))
    state, check = empty_state(nv, count, width), certificate(nv, count, width)
    at = np.empty(width, dtype=np.intp)
    for first in range(0, rows.shape[0], width):
        part = rows[first : first + width]
        _gather(J, b, low, high, part, at, arms, torque, least, most, width)
        search(arms, torque, least, most, state, width)
        set_infeasible(arms, torque, least, most, state.y, check, width)
        for w in range(part.shape[0]):
            outcome[first + w] = INFEASIBLE if check.certified[w] == 1.0 else UNDECIDED
        set_optimal(arms, torque, least, most, state.F, state.y, check, width)
        for w in range(part.shape[0]):
            if check.certified[w] == 1.0:
                outcome[first + w] = OPTIMAL
                for c in range(count):
                    tension[part[w], c] = min(max(state.F[c, w], least[c, w]), most[c, w])


@inner
def _gather(
    J: Array,
    b: Array,
    low: Array,
    high: Array,
    rows: Indices,
    at: Indices,
    arms: Array,
    torque: Array,
    least: Array,
    most: Array,
    width: Width,
) -> None:
    """Fill a block of postures with ``rows``, repeating the last; ``at`` (W,) is scratch."""
    for w in lanes(width):
        at[w] = rows[min(np.intp(w), rows.shape[0] - 1)]
    for i in upwards(0, b.shape[1]):
        for w in lanes(width):
            torque[i, w] = b[at[w], i]
    for c in upwards(0, J.shape[1]):
        for i in upwards(0, b.shape[1]):
            for w in lanes(width):
                arms[c, i, w] = J[at[w], c, i]
        for w in lanes(width):
            least[c, w] = low[at[w] if low.shape[0] > 1 else 0, c]
        for w in lanes(width):
            most[c, w] = high[at[w] if high.shape[0] > 1 else 0, c]
