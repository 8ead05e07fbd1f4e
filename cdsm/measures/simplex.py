"""Kernels for small linear programs: the simplex method with bounds (Dantzig, 1963).

A result counts only if it is proved to be a maximum, up to rounding.

Programs here have about ten equations and about twenty variables, so a dense inverse of the basis
is fastest. A program takes tens of microseconds; a general solver takes a millisecond to begin.
"""

from __future__ import annotations

import math

import numpy as np

from cdsm._former.compiling import compiled, threaded
from cdsm._former.tension import scaled_balance
from cdsm._former.tree import Indices
from cdsm.support.values import Array

_ROUNDING = 1e-11  # reduced costs and pivots below this are rounding; coefficients are of order one
_PROOF = 1e-10  # violation of a constraint, relative to the bounded quantity, that is rounding

_AT_LOW, _AT_HIGH, _FREE, _BASIC = 0, 1, 2, 3  # states of a variable


@compiled
def single_largest(cost: Array, A: Array, b: Array, low: Array, high: Array, x: Array) -> bool:
    """Maximise cost · x with A x = b, low ≤ x ≤ high; return whether x is a proved maximum.

    Writes the maximum into ``x`` (n,). Returns False if no x is feasible, cost · x is unbounded, or
    rounding is too large; x is then not valid. ``cost`` (n,) and A (m, n) must be of order one.
    """
    m, n = A.shape
    # artificial variables n + i take what is missing of equation i; the first phase removes them
    ends, price, column = np.zeros((2, n + m)), np.empty(m), np.empty(m)
    ends[0, :n], ends[1, :n], ends[1, n:] = low, high, math.inf
    worth, point = np.zeros(n + m), np.zeros(n + m)
    state, basis = np.full(n + m, _FREE), np.arange(n, n + m)
    inverse = np.zeros((m, m))
    for j in range(n):
        if low[j] > -math.inf:
            point[j], state[j] = low[j], _AT_LOW
        elif high[j] < math.inf:
            point[j], state[j] = high[j], _AT_HIGH
    for i in range(m):
        missing = b[i]
        for j in range(n):
            missing -= A[i, j] * point[j]
        point[n + i], worth[n + i], state[n + i] = abs(missing), -1.0, _BASIC
        inverse[i, i] = 1.0 if missing >= 0.0 else -1.0
    first, most = True, 20 * (m + n)
    for step in range(2 * most):
        for k in range(m):
            price[k] = 0.0
            for i in range(m):
                price[k] += worth[basis[i]] * inverse[i, k]
        enters, best, way = -1, _ROUNDING, 1.0
        for j in range(n):
            if state[j] == _BASIC or low[j] == high[j]:
                continue
            gain = worth[j]
            for i in range(m):
                gain -= price[i] * A[i, j]
            sign = 1.0
            if state[j] == _AT_HIGH or (state[j] == _FREE and gain < 0.0):
                gain, sign = -gain, -1.0
            if gain > best:
                enters, way = j, sign
                if step > most:  # Bland's rule, which cannot cycle
                    break
                best = gain
        if enters < 0:
            if not first:
                x[:] = point[:n]
                return _proved(cost, A, b, low, high, x, state, basis, inverse, price)
            if point[n:].max() > _PROOF:
                return False
            first, worth[:n], worth[n:], ends[1, n:] = False, cost, 0.0, 0.0
            continue
        for i in range(m):
            column[i] = 0.0
            for k in range(m):
                column[i] += inverse[i, k] * A[k, enters]
        # how far it may go: to its other bound, or until a basic variable is at one
        far, leaves, pivot = high[enters] - low[enters], -1, 0.0
        for i in range(m):
            rate, value = -way * column[i], point[basis[i]]
            if abs(rate) <= _ROUNDING:
                continue
            room = ends[1, basis[i]] - value if rate > 0.0 else value - ends[0, basis[i]]
            room = max(room / abs(rate), 0.0)
            if room < far or (room == far and abs(rate) > pivot):
                far, leaves, pivot = room, i, abs(rate)
        if far == math.inf:
            return False
        for i in range(m):
            point[basis[i]] -= way * column[i] * far
        point[enters] += way * far
        if leaves < 0:
            state[enters] = _AT_HIGH if way > 0.0 else _AT_LOW
            point[enters] = high[enters] if way > 0.0 else low[enters]
            continue
        old, falls = basis[leaves], way * column[leaves] > 0.0
        state[old] = _AT_LOW if falls else _AT_HIGH
        point[old] = ends[0 if falls else 1, old]
        basis[leaves], state[enters] = enters, _BASIC
        for k in range(m):
            inverse[leaves, k] /= column[leaves]
        for i in range(m):
            if i != leaves:
                for k in range(m):
                    inverse[i, k] -= column[i] * inverse[leaves, k]
    return False


@compiled
def _proved(
    cost: Array,
    A: Array,
    b: Array,
    low: Array,
    high: Array,
    x: Array,
    state: Indices,
    basis: Indices,
    inverse: Array,
    price: Array,
) -> bool:
    """Correct x so that A x = b up to rounding; return whether x is then proved to be a maximum.

    The proof: x meets A x = b and its bounds, and the reduced costs show that no change of a
    variable increases cost · x. ``price`` (m,) are the multipliers of the equations, from which the
    reduced costs follow. ``state``, ``basis``, ``inverse`` and ``price`` are the values with which
    :func:`single_largest` ends.
    """
    m, n = A.shape
    left, size = b.copy(), np.abs(b)
    for i in range(m):
        for j in range(n):
            left[i] -= A[i, j] * x[j]
            size[i] = max(size[i], abs(A[i, j] * x[j]))
    for i in range(m):
        if basis[i] < n:
            for k in range(m):
                x[basis[i]] += inverse[i, k] * left[k]
    for i in range(m):
        missing = b[i]
        for j in range(n):
            missing -= A[i, j] * x[j]
        if not abs(missing) <= _PROOF * max(size[i], 1.0):
            return False
    for j in range(n):
        slack = _PROOF * max(abs(x[j]), 1.0)
        if not low[j] - slack <= x[j] <= high[j] + slack:
            return False
        gain = cost[j]
        for i in range(m):
            gain -= price[i] * A[i, j]
        # a variable at a bound gains nothing by leaving it; the others gain nothing at all
        rises = state[j] != _AT_HIGH and low[j] < high[j]
        falls = state[j] != _AT_LOW and low[j] < high[j]
        if (rises and gain > _PROOF) or (falls and gain < -_PROOF):
            return False
    return True


@threaded
def payload_rows(
    J: Array,
    torque: Array,
    motion: Array,
    low: Array,
    high: Array,
    reach: float,
    force: Array,
) -> None:
    """Fill ``force`` (B, D) [N]: the largest tip forces that tensions balance, in D directions u.

    J is J_L (B, C, nv) of B postures, ``torque`` J_Xᵀ W − g (B, nv) [N m], ``motion`` J_vᵀ u
    (B, D, nv), ``reach`` the length of the arm [m]. The bounds of the tensions are (B, C) [N].
    A force is NaN if it is not proved to be the largest.
    """
    rows, count, nv = J.shape
    columns, x = np.empty((nv, count + 1)), np.empty(count + 1)
    ends, cost = np.empty((2, count + 1)), np.zeros(count + 1)
    cost[count] = 1.0
    for n in range(rows):
        A, b, least, most, arm, unit = scaled_balance(J[n], torque[n], low[n], high[n], reach)
        ends[0, count], ends[1, count] = 0.0, math.inf
        for d in range(motion.shape[1]):
            for c in range(count + 1):
                size = 0.0
                for i in range(nv):
                    columns[i, c] = A[i, c] if c < count else -motion[n, d, i] / arm
                    size = max(size, abs(columns[i, c]))
                lever = size if size > 0.0 else 1.0
                for i in range(nv):
                    columns[i, c] /= lever
                if c < count:
                    ends[0, c], ends[1, c] = least[c] * lever, most[c] * lever
            proved = single_largest(cost, columns, b, ends[0], ends[1], x)
            force[n, d] = x[count] / lever * unit if proved else math.nan
