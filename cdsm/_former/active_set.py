"""Dual active-set method of Goldfarb and Idnani for the tension problem, for blocks of postures.

    min ½‖F‖²   subject to   J_Lᵀ F = b   and   low ≤ F ≤ high.

F are the tensions of the C cables, and b is the torque that they must balance. The search runs
where the guess of :mod:`cdsm._former.serpentine_guess` is not optimal. It starts at the optimum F₀
without bounds. It adds one violated bound after the other, and drops a bound whose multiplier would
change its sign. It ends at the optimum, or at a proof of infeasibility. A cable is free if it is at
no bound. With multipliers z of the bounds, positive at the lower one, negative at the upper one,

    F = F₀ + T z,    T = 1 − J_L S⁻¹ J_Lᵀ,    S = J_Lᵀ J_L.

A free cable has z = 0, and F is unknown. For a cable at a bound, F is that bound, and z is unknown.
A step exchanges the known and the unknown of one cable: this is a principal pivot in the tableau T.
It costs C² operations; no equations are solved. At the end, tensions and multipliers are computed
again from the bounds found, so errors do not accumulate. The caller verifies optimum or proof.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm._former.compiling import Width, inner, lanes, upwards
from cdsm._former.linear_algebra import eliminate
from cdsm._former.tree import Indices
from cdsm.support.values import Array

_DEPENDENT = 1e-10
"""If T[p, p] is at most this, F_p cannot change while the free cables keep the balance."""

_ROUNDING = 1e-13
"""Rounding of a bound, relative to the largest tension, and of T, relative to its largest entry."""

_STEPS = 20
"""Maximum number of steps per cable; one or two are usual."""

_NONE, _STUCK = -1, -2
"""Values in place of a cable number. _NONE: no cable. _STUCK − p: cable p can't reach its bound."""


class State(NamedTuple):
    """Iterates of a block of W postures, and working memory of the search.

    Attributes:
        F: Tensions (C, W) [N].
        y: Multipliers of the balance J_Lᵀ F = b, or a proof of infeasibility (nv, W).
        side: 1 for a cable at its lower bound, −1 at its upper bound, 0 for a free one (C, W).
        z: Multipliers of the bounds (C, W).
        tableau: T (C, C, W), as explained at the top of the module.
        system: S, b and J_Lᵀ side by side; b and J_Lᵀ become S⁻¹ b and S⁻¹ J_Lᵀ (nv, nv + 1 + C,
            W).
        free: Σ J_cᵀ J_c over the free cables c, and a right-hand side (nv, nv + 1, W).
        cables: Scratch, such as a column and a row of the tableau (2, max(C, nv), W).
        scratch: Scratch (4, W). Entries of T below its last row count as zero.
        chosen: The entering cable, which moves to its bound, and the cable of the pivot (2, W).
    """

    F: Array
    y: Array
    side: Array
    z: Array
    tableau: Array
    system: Array
    free: Array
    cables: Array
    scratch: Array
    chosen: Indices


@inner
def empty_state(nv: int, cables: int, width: int) -> State:
    """Allocate the :class:`State` of :func:`search`, for a block of ``width`` postures."""
    return State(
        np.empty((cables, width)),
        np.empty((nv, width)),
        np.empty((cables, width)),
        np.empty((cables, width)),
        np.empty((cables, cables, width)),
        np.empty((nv, nv + 1 + cables, width)),
        np.empty((nv, nv + 1, width)),
        np.empty((2, max(cables, nv), width)),
        np.empty((4, width)),
        np.empty((2, width), dtype=np.intp),
    )


@inner
def search(J: Array, b: Array, low: Array, high: Array, state: State, width: Width) -> None:
    """Find the least tensions F within bounds that balance the arm; fill F and y of ``state``.

    J is J_L (C, nv, W), b (nv, W) the torque to balance; ``low`` and ``high`` (C, W) are the
    bounds. y becomes the multipliers of the balance, or a proof that no tensions exist. The caller
    must verify both, since rounding or the limit of steps may end the search too early.
    """
    _start(J, b, state, width)
    entering, nothing = state.chosen[0], state.scratch[3]
    for w in lanes(width):
        entering[w], nothing[w] = _NONE, _DEPENDENT
    for _ in range(_STEPS * J.shape[0]):
        _choose(state.F, low, high, state.side, entering, state.scratch[0], width)
        busy = 0
        for w in lanes(width):
            busy += 1 if entering[w] > _NONE else 0
        if busy == 0:
            break
        _step(low, high, state, width)
        _exchange(state, width)
    _finish(J, b, low, high, state, width)


@inner
def _start(J: Array, b: Array, state: State, width: Width) -> None:
    """Fill the tableau T, and F with the optimum without bounds; all cables are free."""
    F, side, z, T, system = state.F, state.side, state.z, state.tableau, state.system
    nv = np.uint64(J.shape[1])
    for c in upwards(0, J.shape[0]):
        for w in lanes(width):
            side[c, w] = z[c, w] = 0.0
        for i in upwards(0, nv):
            for w in lanes(width):
                system[i, nv + np.uint64(1) + c, w] = J[c, i, w]
    for i in upwards(0, nv):
        for w in lanes(width):
            system[i, nv, w] = b[i, w]
    _set_gram(J, side, system, width)
    eliminate(system, state.scratch, width)
    for c in upwards(0, J.shape[0]):
        for w in lanes(width):
            F[c, w] = 0.0
        for i in upwards(0, nv):
            for w in lanes(width):
                F[c, w] += J[c, i, w] * system[i, nv, w]
        for d in upwards(0, J.shape[0]):
            for w in lanes(width):
                T[c, d, w] = 1.0 if c == d else 0.0
            for i in upwards(0, nv):
                for w in lanes(width):
                    T[c, d, w] -= J[c, i, w] * system[i, nv + np.uint64(1) + d, w]


@inner
def _set_gram(J: Array, side: Array, system: Array, width: Width) -> None:
    """Fill the first nv columns of ``system`` with Σ J_cᵀ J_c over the free cables c."""
    for i in upwards(0, J.shape[1]):
        for j in upwards(i, J.shape[1]):
            for w in lanes(width):
                system[i, j, w] = 0.0
            for c in upwards(0, J.shape[0]):
                for w in lanes(width):
                    system[i, j, w] += J[c, i, w] * J[c, j, w] if side[c, w] == 0.0 else 0.0
            for w in lanes(width):
                system[j, i, w] = system[i, j, w]


@inner
def _choose(
    F: Array, low: Array, high: Array, side: Array, entering: Indices, worst: Array, width: Width
) -> None:
    """Where ``entering`` (W,) is _NONE, set it to the free cable farthest outside its bounds."""
    for w in lanes(width):
        worst[w] = 0.0 if entering[w] == _NONE else math.inf
    for c in upwards(0, F.shape[0]):
        for w in lanes(width):
            worst[w] = max(worst[w], _ROUNDING * abs(F[c, w]))
    for c in upwards(0, F.shape[0]):
        number = np.intp(c)
        for w in lanes(width):
            outside = max(low[c, w] - F[c, w], F[c, w] - high[c, w])
            chosen = side[c, w] == 0.0 and outside > worst[w]
            entering[w] = number if chosen else entering[w]
            worst[w] = outside if chosen else worst[w]


@inner
def _step(low: Array, high: Array, state: State, width: Width) -> None:
    """Move the entering cable of each posture to its violated bound, or less far.

    The move ends earlier where the multiplier z of another cable would change its sign. The second
    row of ``state.chosen`` becomes the cable of the pivot that follows: the entering cable, or that
    other one. It becomes _NONE if there is no pivot.
    """
    F, z, side, T, rate = state.F, state.z, state.side, state.tableau, state.cables[0]
    sign, step, limit = state.scratch[0], state.scratch[1], state.scratch[2]
    nothing = state.scratch[3]
    entering, pivot = state.chosen[0], state.chosen[1]
    for w in lanes(width):
        p = np.uint64(max(entering[w], 0))
        sign[w] = 0.0 if entering[w] < 0 else (1.0 if F[p, w] < low[p, w] else -1.0)
    for w in lanes(width):
        p = np.uint64(max(entering[w], 0))
        outside = max(low[p, w] - F[p, w], F[p, w] - high[p, w])
        step[w] = outside / T[p, p, w] if T[p, p, w] > nothing[w] else math.inf
    for w in lanes(width):
        pivot[w] = entering[w]
    for c in upwards(0, F.shape[0]):
        number = np.intp(c)
        for w in lanes(width):
            rate[c, w] = sign[w] * T[c, np.uint64(max(entering[w], 0)), w]
        for w in lanes(width):
            slope = side[c, w] * rate[c, w]
            limit[w] = -side[c, w] * z[c, w] / slope if slope < -nothing[w] else math.inf
        for w in lanes(width):
            pivot[w] = number if limit[w] < step[w] else pivot[w]
        for w in lanes(width):
            step[w] = min(step[w], limit[w])
    for w in lanes(width):
        pivot[w] = pivot[w] if step[w] < math.inf and pivot[w] >= 0 else _NONE
    for c in upwards(0, F.shape[0]):
        for w in lanes(width):
            moves = pivot[w] >= 0 and side[c, w] == 0.0
            F[c, w] += step[w] * rate[c, w] if moves else 0.0
        for w in lanes(width):
            moves = pivot[w] >= 0 and side[c, w] != 0.0
            z[c, w] += step[w] * rate[c, w] if moves else 0.0
    for w in lanes(width):
        if entering[w] >= 0:
            p, r = np.uint64(entering[w]), np.uint64(max(pivot[w], 0))
            if pivot[w] == _NONE:
                entering[w] = _STUCK - entering[w]
            elif p == r:
                z[p, w] += sign[w] * step[w]
                F[p, w] = low[p, w] if sign[w] > 0.0 else high[p, w]
                side[p, w], entering[w] = sign[w], _NONE
            else:
                z[p, w] += sign[w] * step[w]
                side[r, w], z[r, w] = 0.0, 0.0


@inner
def _exchange(state: State, width: Width) -> None:
    """Make the principal pivot in the tableau T that frees the pivot cable or fixes its tension."""
    T, pivot, inverse, nothing = state.tableau, state.chosen[1], state.scratch[0], state.scratch[3]
    column, row = state.cables[0], state.cables[1]
    for w in lanes(width):
        r = np.uint64(max(pivot[w], 0))
        inverse[w] = 1.0 / T[r, r, w] if pivot[w] >= 0 else 0.0
    for w in lanes(width):
        nothing[w] = max(nothing[w], _ROUNDING * inverse[w])
    for c in upwards(0, T.shape[0]):
        for w in lanes(width):
            column[c, w] = T[c, np.uint64(max(pivot[w], 0)), w] * inverse[w]
        for w in lanes(width):
            row[c, w] = T[np.uint64(max(pivot[w], 0)), c, w]
    for c in upwards(0, T.shape[0]):
        for d in upwards(0, T.shape[0]):
            for w in lanes(width):
                T[c, d, w] -= column[c, w] * row[d, w]
    for c in upwards(0, T.shape[0]):
        for w in lanes(width):
            if pivot[w] >= 0:
                T[c, np.uint64(pivot[w]), w] = column[c, w]
                T[np.uint64(pivot[w]), c, w] = -inverse[w] * row[c, w]
    for w in lanes(width):
        if pivot[w] >= 0:
            T[np.uint64(pivot[w]), np.uint64(pivot[w]), w] = inverse[w]


@inner
def _finish(J: Array, b: Array, low: Array, high: Array, state: State, width: Width) -> None:
    """Compute F and y of ``state`` from the bounds that the search found.

    Cables at a bound get this bound, ``low`` or ``high``. Free cables get the least tensions that
    balance the rest of the torque b (nv, W). If the search ended because cable p cannot reach its
    bound, y is the proof of infeasibility: J_c y = 0 for the other free cables c, and J_p y is −1
    if F_p is too low, 1 if it is too high. The solution is refined twice, because the matrix
    Σ J_cᵀ J_c has the square of the condition number of J_L.
    """
    F, y, side, system, entering = state.F, state.y, state.side, state.free, state.chosen[0]
    sign, torque, nv = state.cables[0, 0], state.cables[1], np.uint64(y.shape[0])
    for w in lanes(width):
        p = np.uint64(max(_STUCK - entering[w], 0))
        sign[w] = -1.0 if F[p, w] < low[p, w] else 1.0
    for i in upwards(0, nv):
        for w in lanes(width):
            p = np.uint64(max(_STUCK - entering[w], 0))
            torque[i, w] = sign[w] * J[p, i, w] if entering[w] < _NONE else b[i, w]
        for w in lanes(width):
            y[i, w] = 0.0
    for c in upwards(0, F.shape[0]):
        for w in lanes(width):
            bound = low[c, w] if side[c, w] > 0.0 else high[c, w]
            F[c, w] = bound if side[c, w] != 0.0 and entering[w] >= _NONE else 0.0
    for _ in range(3):
        _set_gram(J, side, system, width)
        for i in upwards(0, nv):
            for w in lanes(width):
                system[i, nv, w] = torque[i, w]
            for c in upwards(0, F.shape[0]):
                for w in lanes(width):
                    system[i, nv, w] -= J[c, i, w] * F[c, w]
        eliminate(system, state.scratch, width)
        for i in upwards(0, nv):
            for w in lanes(width):
                y[i, w] += system[i, nv, w]
            for c in upwards(0, F.shape[0]):
                for w in lanes(width):
                    F[c, w] += J[c, i, w] * system[i, nv, w] if side[c, w] == 0.0 else 0.0
