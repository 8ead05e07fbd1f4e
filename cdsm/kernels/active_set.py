"""Dual active-set method of Goldfarb and Idnani for the tension problem, as a numba kernel.

    min ½‖F‖²   subject to   J_Lᵀ F = b   and   low ≤ F ≤ high.

The search runs where the guess of :mod:`cdsm.kernels.serpentine_guess` fails. It starts at the
optimum without bounds. It adds one violated bound after the other, and drops a bound whose
multiplier would change its sign. It ends at the optimum, or at a proof of infeasibility. A cable is
free if it is at no bound. Each step builds and solves a new linear system, so that errors do not
accumulate. Its matrix is

    S = Σ J_cᵀ J_c over the free cables c, with J_c row c of J_L.

The caller verifies the optimum or the proof.

The alternative is the solver DAQP, with one Python call per posture and a linear program to prove
infeasibility. Mean time per posture of batches, with this search and with DAQP in its place:

    virtual prototype up to nine tenths of its joint limits,
    18 of 400 postures need the search                              7 µs,  75 µs
    arms whose cables join any two links, all postures need it     16 µs, 138 µs
    14 cables, 6 joints, all postures need it                      10 µs, 518 µs
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm.kernels.compiling import inner
from cdsm.kernels.linear_algebra import eliminate
from cdsm.kernels.tension import row_product
from cdsm.kernels.tree import Indices
from cdsm.support.values import Array

FOUND, IMPOSSIBLE, LOST = range(3)
"""Outcome of a search: F and y are the optimum; y proves infeasibility; no result."""

_REGULAR = 1e-13
"""Smallest accepted ratio of smallest to largest pivot of S."""

_DEPENDENT = 1e-10
"""If 1 − J_p S⁻¹ J_pᵀ is at most this, F_p cannot move while the free cables keep the balance."""

_ROUNDING = 1e-13
"""Violations of a bound below this part of the largest tension are rounding, as are such slopes."""

_STEPS = 20
"""Maximum number of steps per cable; one or two are usual."""


class State(NamedTuple):
    """Iterate and working memory of the search.

    Attributes:
        F: Tensions (C,).
        y: Multipliers of balance (nv,).
        side: Of each cable: 1 at its lower bound, −1 at its upper bound, 0 free (C,).
        multiplier: Multipliers of the bounds (C,).
        system: S = Σ J_cᵀ J_c over the free cables, and a right-hand side (nv, nv + 1, 1).
        pivots: Scratch of the elimination (4, 1).
        w: Right-hand side, then solution, of a system with S (nv,).
    """

    F: Array
    y: Array
    side: Indices
    multiplier: Array
    system: Array
    pivots: Array
    w: Array


@inner
def empty_state(nv: int, cables: int) -> State:
    """Allocate the working memory of :func:`search`."""
    return State(
        np.empty(cables),
        np.empty(nv),
        np.empty(cables, dtype=np.intp),
        np.empty(cables),
        np.empty((nv, nv + 1, 1)),
        np.empty((4, 1)),
        np.empty(nv),
    )


@inner
def search(J: Array, b: Array, low: Array, high: Array, state: State) -> int:
    """Find the least tensions within bounds that balance the arm; fill the state.

    J is J_L (C, nv), b the torque to balance (nv,), ``low`` and ``high`` are the bounds (C,).

    Returns:
        FOUND, IMPOSSIBLE, or LOST if rounding or too many steps end the search. If IMPOSSIBLE, y
        (nv,) of the state is the proof of infeasibility.
    """
    F, y, side, multiplier, _, _, w = state
    for c in range(F.shape[0]):
        side[c], multiplier[c] = 0, 0.0
    if not _solve_for_sides(J, b, low, high, state):
        return LOST
    for _ in range(_STEPS * F.shape[0]):
        p, sign = _most_violated(F, low, high, side)
        if p < 0:
            return FOUND if _solve_for_sides(J, b, low, high, state) else LOST
        bound = low[p] if sign > 0.0 else high[p]
        while side[p] == 0:
            # cable p moves towards its bound, and the free cables keep the balance
            for i in range(y.shape[0]):
                w[i] = J[p, i]
            if not _solve_free(J, state):
                return LOST
            # per unit step F_p changes by this; 0 if no other tensions can balance the change
            way = 1.0 - row_product(J, p, w)
            whole = sign * (bound - F[p]) / way if way > _DEPENDENT else math.inf
            # the largest step at which no multiplier changes its sign, and whose bound is dropped
            part, dropped = math.inf, -1
            for c in range(F.shape[0]):
                slope = side[c] * sign * row_product(J, c, w)
                if side[c] != 0 and slope < -_ROUNDING and multiplier[c] < -part * slope:
                    part, dropped = -multiplier[c] / slope, c
            if whole == math.inf and part == math.inf:  # p can never reach its bound
                for i in range(y.shape[0]):
                    y[i] = -sign * w[i]
                return IMPOSSIBLE
            step = min(whole, part)
            for c in range(F.shape[0]):
                change = sign * step * row_product(J, c, w)
                if side[c] != 0:
                    multiplier[c] += side[c] * change
                elif c != p:
                    F[c] -= change
            F[p] += sign * step * way
            multiplier[p] += step
            if whole <= part:
                side[p], F[p] = (1 if sign > 0.0 else -1), bound
            else:
                side[dropped], multiplier[dropped] = 0, 0.0
    return LOST


@inner
def _most_violated(F: Array, low: Array, high: Array, side: Indices) -> tuple[int, float]:
    """Return the free cable farthest outside its bounds ``low`` and ``high``, or −1 if none is.

    Also return 1 if its tension is below the lower bound, else −1. For ``side`` see :class:`State`.
    """
    p, sign, worst = -1, 0.0, 0.0
    for c in range(F.shape[0]):
        worst = max(worst, _ROUNDING * abs(F[c]))
    for c in range(F.shape[0]):
        if side[c] == 0 and low[c] - F[c] > worst:
            p, sign, worst = c, 1.0, low[c] - F[c]
        if side[c] == 0 and F[c] - high[c] > worst:
            p, sign, worst = c, -1.0, F[c] - high[c]
    return p, sign


@inner
def _solve_for_sides(J: Array, b: Array, low: Array, high: Array, state: State) -> bool:
    """Fill F and y of ``state``: cables with a side get their bound, ``low`` or ``high``.

    Free cables get the least tensions that balance the torque b (nv,). The torque that rounding
    leaves is balanced a second time: S squares the condition number of J_L. Returns False if the
    free cables cannot balance every torque.
    """
    F, y, side, _, _, _, w = state
    for c in range(F.shape[0]):
        F[c] = 0.0 if side[c] == 0 else (low[c] if side[c] > 0 else high[c])
    for i in range(b.shape[0]):
        y[i] = 0.0
    for _ in range(2):
        for i in range(b.shape[0]):
            w[i] = b[i]
        for c in range(F.shape[0]):
            for i in range(b.shape[0]):
                w[i] -= J[c, i] * F[c]
        if not _solve_free(J, state):
            return False
        for i in range(b.shape[0]):
            y[i] += w[i]
        for c in range(F.shape[0]):
            if side[c] == 0:
                F[c] = row_product(J, c, y)
    return True


@inner
def _solve_free(J: Array, state: State) -> bool:
    """Replace w (nv,) of ``state`` by S⁻¹ w; return False if S = Σ J_cᵀ J_c is singular.

    The sum is over the free cables c.
    """
    _, _, side, _, system, pivots, w = state
    nv = w.shape[0]
    for i in range(nv):
        for j in range(nv):
            system[i, j, 0] = 0.0
        system[i, nv, 0] = w[i]
    for c in range(side.shape[0]):
        if side[c] == 0:
            for i in range(nv):
                if J[c, i] != 0.0:
                    for j in range(nv):
                        system[i, j, 0] += J[c, i] * J[c, j]
    eliminate(system, pivots, system.shape[2])
    for i in range(nv):
        w[i] = system[i, nv, 0]
    regular: bool = pivots[0, 0] > _REGULAR * pivots[1, 0]
    return regular
