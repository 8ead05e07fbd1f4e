"""Numba kernels of tension distribution (Eq. 17): guess or search, then verify the tensions.

    min ½‖F‖²   subject to   J_Lᵀ F = J_Xᵀ W − g   and   low ≤ F ≤ high.

For most postures of a block, a quick guess of the tensions is optimal. The other postures are
solved in blocks of their own, by a kernel that is compiled when it is first needed.
"""

from __future__ import annotations

import numpy as np

from cdsm._former.active_set import empty_state, search
from cdsm._former.compiling import (
    WIDTH,
    Index,
    Width,
    inlined,
    inner,
    lanes,
    threaded,
    upwards,
)
from cdsm._former.records import fetch
from cdsm._former.serpentine_guess import Blocks, Guess, guess_tensions
from cdsm._former.serpentine_multipliers import set_multipliers
from cdsm._former.tension import Balance, Certificate, certificate, set_infeasible, set_optimal
from cdsm._former.tree import Indices
from cdsm.support.values import Array

OPTIMAL, INFEASIBLE, UNDECIDED = range(3)
"""Outcome of a search: OPTIMAL tensions, a proof that there are none (INFEASIBLE), or neither."""

_NUMBERS = 2**17
"""Largest total size of the arrays of a block, so that they fit into the processor's cache."""


@inner
def set_torque(jacobian: Array, force: Array, opposed: Array, torque: Array, width: Width) -> None:
    """Fill ``torque`` (nv, W) with Jᵀ f − τ.

    ``jacobian`` is J (m, nv, W), ``force`` f (m, W) and ``opposed`` τ (nv, W). If these are J_X,
    the wrench and g, the result is the torque that the cables must balance. If they are J_L, F and
    that torque, the result is the residual of Eq. 13.
    """
    for i in upwards(0, torque.shape[0]):
        for w in lanes(width):
            torque[i, w] = -opposed[i, w]
        for a in upwards(0, force.shape[0]):
            for w in lanes(width):
                torque[i, w] += force[a, w] * jacobian[a, i, w]


@inner
def set_arms(J: Array, smallest: float, arms: Array, width: Width) -> None:
    """Copy J_L ``J`` (C, nv, W) to ``arms``; moment arms below ``smallest`` [m] become zero."""
    for c in upwards(0, J.shape[0]):
        for i in upwards(0, J.shape[1]):
            for w in lanes(width):
                arms[c, i, w] = J[c, i, w] if abs(J[c, i, w]) >= smallest else 0.0


@inner
def keep_balance(arms: Array, torque: Array, balance: Balance, row: Index, w: Index) -> None:
    """Keep the balance of posture w for a later search: copy it to a ``row`` of ``balance``.

    ``arms`` is J_L (C, nv, W), and ``torque`` (nv, W) the torque to balance.
    """
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
    """Fill ``tension`` (C, W) with a guess of the least tensions, and verify it.

    The guess is the optimum where ``certificate.certified`` is 1 and ``guess.failed`` is −1. J is
    J_L (C, nv, W), where moment arms that are only rounding errors are zero. b (nv, W) is the
    torque to balance. ``low`` and ``high`` are the bounds (C, W).
    """
    guess_tensions(blocks, J, b, low, high, guess, width)
    set_multipliers(blocks, J, guess.F, guess, guess.y, width)
    set_optimal(J, b, low, high, guess.F, guess.y, certificate, width)
    for c in upwards(0, tension.shape[0]):  # rounding may have moved F slightly beyond the bounds
        for w in lanes(width):
            tension[c, w] = min(max(guess.F[c, w], low[c, w]), high[c, w])


@threaded
def search_tensions(
    J: Array, b: Array, low: Array, high: Array, tension: Array, outcome: Indices
) -> None:
    """Search for the least tensions of r postures for which the guess is not optimal.

    J is J_L (r, C, nv), and b (r, nv) the torque to balance. The bounds ``low`` and ``high`` are
    (r, C), or (1, C) for all postures. Fills ``tension`` (r, C), and ``outcome`` (r,) with OPTIMAL,
    INFEASIBLE or UNDECIDED. Tensions are valid only if the outcome is OPTIMAL.
    """
    rows, count, nv = J.shape
    width = max(1, min(WIDTH, rows, _NUMBERS // (count * (count + nv))))
    arms, torque = np.empty((count * nv, width)), np.empty((nv, width))
    least, most = np.empty((count, width)), np.empty((count, width))
    state, check = empty_state(nv, count, width), certificate(nv, count, width)
    balance = arms.reshape(count, nv, width), torque, least, most
    for first in range(0, rows, width):
        fetch(J.reshape(rows, count * nv), first, arms, width)
        fetch(b, first, torque, width)
        fetch(low, first, least, width)
        fetch(high, first, most, width)
        search(*balance, state, width)
        set_infeasible(*balance, state.y, check, width)
        part = outcome[first : first + width]
        for w in range(part.shape[0]):
            part[w] = INFEASIBLE if check.certified[w] == 1.0 else UNDECIDED
        set_optimal(*balance, state.F, state.y, check, width)
        for w in range(part.shape[0]):
            if check.certified[w] == 1.0:
                part[w] = OPTIMAL
                for c in range(count):
                    tension[first + w, c] = min(max(state.F[c, w], least[c, w]), most[c, w])
