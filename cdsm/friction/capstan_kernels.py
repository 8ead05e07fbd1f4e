"""Numba kernel of the chain problem: tensions along a cable that sticks and slips in its holes.

Segment j of a cable lies between two holes. At a fixed posture it has the length l_j. Its wire has
the rest length a_j, the length without strain, which changes only by wire that slips through holes.
Friction at the hole between segments j and j + 1, with ρ_j = exp(μ φ_j), demands

    T_j/ρ_j ≤ T_{j+1} ≤ ρ_j T_j.

Wire s_j > 0 moves from j to j + 1 only if T_{j+1} = ρ_j T_j, and back (s_j < 0) only if
T_j = ρ_j T_{j+1}. A segment of length l_j that has the tension T has wire of the rest length

    A_j(T) = (l_j − c_j (T − T⁰_j))/(1 + ε(T)),

with the compliance c_j of a series spring, in the first segment only. Wire is conserved:
A_j(T_j) = a_j − s_j + s_{j−1}. With y = ln T, these are the optimality (KKT) conditions of

    minimize Σ_j D_j(y_j),   D_j′ = a_j − A_j(e^y),   subject to |y_{j+1} − y_j| ≤ μ φ_j,

and the slips are the multipliers. A_j falls with T, so the problem is strictly convex: it has one
solution. If one segment of a cable is under tension, all are.

Dynamic programming solves it exactly ("taut string"). Let V_j(y) be the least sum of D over the
segments from j to the end of the cable if segment j has the value y, and y*_j its minimizer. The
best y_{j+1} that friction allows is the point z of [y − μφ_j, y + μφ_j] nearest to y*_{j+1}, so

    V_j′(y) = D_j′(y) + V_{j+1}′(z) if y*_{j+1} is outside the interval,   and D_j′(y) if inside.

From the end to the motor, the root y*_j of the rising V_j′ is found by Newton's method in a
bracket. A locked motor makes y_1 = y*_1, one that controls the tension prescribes y_1. Then
y_{j+1} = z, segment by segment. The cable slides in a hole if z is not y*_{j+1}; then
s_j = −V_{j+1}′(z). The code uses T instead of y, so that a slack cable, T = 0, is an ordinary case.

Here 1 + ε(T) = base + softness · T; :mod:`cdsm.friction.capstan` does the laws.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np
from numba import njit
from numpy.typing import NDArray

from cdsm.support.values import Array

_Kernel = TypeVar("_Kernel", bound=Callable[..., Any])

_ROUNDING = 2.0**-52  # of V_j′, relative to the rest lengths in its sum, and of a tension
_STEPS = 200  # most steps to a root: Newton's method needs 3 to 6, bisection would need 60


class Wire(NamedTuple):
    """Properties of all S segments, (S,) each: cable by cable, from the motor to the end."""

    length: Array  # l [m]
    rest_length: Array  # a before the slips [m]
    base: Array  # 1 + ε, extrapolated to no tension [-]
    softness: Array  # dε/dT [1/N]
    spring: Array  # compliance c of the series spring [m/N]
    unloaded: Array  # T⁰, at which the spring has no elongation [N]
    ratio: Array  # ρ of the hole to the next segment; not used at the end of a cable [-]


def _compiled(function: _Kernel) -> _Kernel:
    """Compile with numba; its cache on disk is used if a folder for it is writable."""
    try:
        kernel: Any = njit(cache=True, nogil=True)(function)
    except RuntimeError:
        kernel = njit(nogil=True)(function)
    return cast(_Kernel, kernel)


@_compiled
def _surplus(wire: Wire, j: int, T: float) -> tuple[float, float]:
    """Compute the surplus of wire D_j′ = a_j − A_j(T) [m], and ∂D_j′/∂T [m/N]."""
    stretch = wire.base[j] + wire.softness[j] * T
    needed = (wire.length[j] - wire.spring[j] * (T - wire.unloaded[j])) / stretch
    return wire.rest_length[j] - needed, (wire.spring[j] + needed * wire.softness[j]) / stretch


@_compiled
def _slope(
    wire: Wire, best: Array, j: int, last: int, tension: float
) -> tuple[float, float, float]:
    """Compute V_j′ [m], ∂V_j′/∂T [m/N], Σ|l_0| [m] at ``tension``; ``best`` (S,): exp(y*_i) [N]."""
    total, rise = _surplus(wire, j, tension)
    T = tension
    size = abs(wire.rest_length[j])
    for i in range(j + 1, last + 1):
        T = min(max(best[i], T / wire.ratio[i - 1]), T * wire.ratio[i - 1])
        if best[i] == T > 0.0:  # V_i is flat; at T = 0 this is the limit T → 0
            break
        value, slope = _surplus(wire, i, T)
        total += value
        rise += slope * (T / tension if tension > 0.0 else 1.0)
        size += abs(wire.rest_length[i])
    return total, rise, size


@_compiled
def _root(wire: Wire, best: Array, j: int, last: int, near: float) -> float:
    """Find exp(y*_j) [N], the tension at which V_j′ is zero, from ``near`` [N]; 0: slack."""
    if _slope(wire, best, j, last, 0.0)[0] >= 0.0:
        return 0.0
    low = 0.0
    high = math.inf
    T = near if near > 0.0 else 1.0
    for _ in range(_STEPS):
        value, rise, size = _slope(wire, best, j, last, T)
        if value < 0.0:
            low = T
        else:
            high = T
        new = T - value / rise
        if abs(new - T) <= _ROUNDING * T or abs(value) <= _ROUNDING * size:
            return max(new, 0.0)
        if not low < new < high:  # Newton's step leaves the bracket: bisect, or double
            new = (low + high) / 2.0 if math.isfinite(high) else 2.0 * T
        T = new
    return T


@_compiled
def solve_chains(
    start: NDArray[np.intp], forced: Array, wire: Wire, near: Array
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Compute tensions along all cables, and the wire that slips through their holes.

    ``start`` (C+1,) is the index of the first segment of each cable, and S at the end. ``forced``
    (C,) [N] is the tension that a motor keeps in the first segment; NaN if the motor is locked.
    Newton's method starts at the tensions ``near`` (S,) [N]. Returns three arrays (S,): the tension
    of each segment [N]; the rest length [m] of the wire that slips from it to the next segment,
    negative if it slips back; and whether the cable slides in the hole between them. In a hole
    without friction it always slides.
    """
    size = wire.length.shape[0]
    best = np.empty(size)
    T = np.empty(size)
    slip = np.zeros(size)
    slides = np.zeros(size, np.bool_)
    for c in range(start.shape[0] - 1):
        first = start[c]
        last = start[c + 1] - 1
        # minimizers from the end to the motor, tensions back to the end, then the slips
        for j in range(last, first, -1):
            best[j] = _root(wire, best, j, last, near[j])
        held = math.isnan(forced[c])
        best[first] = _root(wire, best, first, last, near[first]) if held else forced[c]
        T[first] = best[first]
        for j in range(first + 1, last + 1):
            ratio = wire.ratio[j - 1]
            T[j] = min(max(best[j], T[j - 1] / ratio), T[j - 1] * ratio)
            slides[j - 1] = T[j] != best[j] or ratio == 1.0
        moved = 0.0
        for j in range(last, first, -1):
            moved = moved - _surplus(wire, j, T[j])[0] if slides[j - 1] else 0.0
            slip[j - 1] = moved if T[first] > 0.0 else 0.0
    return T, slip, slides
