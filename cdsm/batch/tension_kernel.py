"""Kernel of tension distribution: it guesses or searches tensions at every posture, then verifies.

min ½‖F‖²   so that   J_Lᵀ F = J_Xᵀ W − g   and   low ≤ F ≤ high.
"""

from __future__ import annotations

import math

import numpy as np

from cdsm.batch import active_set
from cdsm.batch.active_set import FOUND, IMPOSSIBLE, State
from cdsm.batch.layout import INFEASIBLE, OK, UNDECIDED, Codes, Flags
from cdsm.batch.serpentine_guess import Blocks, guess, is_provably_infeasible, multipliers
from cdsm.kernels.compiling import compiled, threaded
from cdsm.kernels.tension import is_infeasible, is_optimal
from cdsm.support.values import Array


@threaded
def distribute_rows(
    blocks: Blocks,
    postures: Array,
    low: Array,
    high: Array,
    wrench: Array,
    smallest_arm: float,
    tension: Array,
    status: Codes,
) -> None:
    """Fill tensions (b, C) [N], NaN where none were found, and the status of every posture.

    Args:
        blocks: The blocks of the arm.
        postures: J_X, J_L and g of each posture, one after the other, (b, 6 nv + C nv + nv).
        low: Lower bounds (b, C) [N].
        high: Upper bounds (b, C) [N].
        wrench: W (b, 6).
        smallest_arm: Moment arms below this are rounding [m]; they are set to zero.
        tension: Tensions, filled here.
        status: Status, filled here; postures not OK on entry are passed over. UNDECIDED means that
            neither an optimum nor a proof was found.
    """
    count = low.shape[1]
    nv = postures.shape[1] // (count + 7)
    b, lacking, zero = np.empty(nv), np.empty(2), np.zeros(count)
    free, side = np.empty(count, dtype=np.bool_), np.empty(count, dtype=np.intp)
    system = np.empty((nv, nv + 1))
    state = State(np.empty(count), np.empty(nv), side, np.empty(count), system, np.empty(nv))
    for r in range(postures.shape[0]):
        for c in range(count):
            tension[r, c] = math.nan
        if status[r] != OK:
            continue
        JX = postures[r, : 6 * nv].reshape((6, nv))
        J = postures[r, 6 * nv : (6 + count) * nv].reshape((count, nv))
        for c in range(count):
            for i in range(nv):
                if abs(J[c, i]) < smallest_arm:
                    J[c, i] = 0.0
        for i in range(nv):
            b[i] = -postures[r, (6 + count) * nv + i]
            for a in range(6):
                b[i] += wrench[r, a] * JX[a, i]
        status[r] = _distribute(blocks, J, b, low[r], high[r], free, lacking, zero, state)
        if status[r] == OK:
            for c in range(count):  # rounding may not cross an active bound
                tension[r, c] = min(max(state.F[c], low[r, c]), high[r, c])


@compiled
def _distribute(
    blocks: Blocks,
    J: Array,
    b: Array,
    low: Array,
    high: Array,
    free: Flags,
    lacking: Array,
    zero: Array,
    state: State,
) -> int:
    """Fill the tensions of the state; return OK, INFEASIBLE or UNDECIDED."""
    F, y = state.F, state.y
    if blocks.row.shape[0]:
        k = guess(blocks, J, b, low, high, F, free, lacking)
        if k < 0:
            multipliers(blocks, J, F, free, blocks.row_start[0], y)
            if is_optimal(J, b, low, high, F, y, state.w, state.multiplier):
                return OK
        elif is_provably_infeasible(blocks, J, b, low, high, free, lacking, k, zero, y):
            return INFEASIBLE
    outcome = active_set.search(J, b, low, high, state)
    if outcome == FOUND and is_optimal(J, b, low, high, F, y, state.w, state.multiplier):
        return OK
    if outcome == IMPOSSIBLE and is_infeasible(J, b, low, high, y):
        return INFEASIBLE
    return UNDECIDED
