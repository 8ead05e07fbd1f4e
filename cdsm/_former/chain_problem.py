"""Numba kernel of the chain problem: tensions along a cable that sticks and slips in its holes.

Segment j of a cable lies between two holes. At a fixed posture it has the length l_j. The wire in
it has the natural length a_j, its length at zero strain. From one posture to the next, a_j changes
only by wire that slips through the holes. Coulomb friction at the hole between segments j and
j + 1, with the capstan ratio ρ_j = exp(μ φ_j), demands

    T_j/ρ_j ≤ T_{j+1} ≤ ρ_j T_j.

Wire s_j > 0 moves from j to j + 1 only if T_{j+1} = ρ_j T_j, and back (s_j < 0) only if
T_j = ρ_j T_{j+1}. A segment of length l_j that has the tension T has the natural length

    A_j(T) = (l_j − c_j (T − T⁰_j))/(1 + ε(T)).

A series spring of compliance c_j, unstrained at T⁰_j, exists only in the first segment. A_j falls
with T. Wire is conserved: A_j(T_j) = a_j − s_j + s_{j−1}. With y = ln T, these conditions are the
optimality (KKT) conditions of

    minimize Σ_j D_j(y_j),   D_j′ = a_j − A_j(e^y),   subject to |y_{j+1} − y_j| ≤ μ φ_j,

and the slips are the multipliers. D_j′ increases with y, so the problem is strictly convex and has
one solution. If one segment of a cable is under tension, all are.

Dynamic programming on the chain solves it exactly ("taut string"). Let V_j(y) be the least sum of
D over the segments from j to the end of the cable if segment j has the value y. Let y*_j be the
minimizer of V_j. If segment j has y, friction allows y_{j+1} from y − μφ_j to y + μφ_j. The best
y_{j+1} is the point z of this interval nearest to y*_{j+1}. Therefore

    V_j′(y) = D_j′(y) + V_{j+1}′(z) if y*_{j+1} is outside the interval,   and D_j′(y) if inside.

From the end of the cable to the motor, the root y*_j of the rising V_j′ is found by Newton's method
inside a bracket. A locked motor makes y_1 = y*_1; a motor that controls the tension prescribes y_1.
Then y_{j+1} = z, segment by segment. The cable slides in a hole if z is not y*_{j+1}; then
s_j = −V_{j+1}′(z). The code uses T instead of y, so that a slack cable, T = 0, is an ordinary case.

V_j′ has one term for each segment up to the next hole in which the cable sticks. So N segments take
O(N) time if the cable slides in few holes, and O(N²) if it slides in all.

In this kernel 1 + ε(T) = base + softness · T. For other laws :mod:`cdsm.friction.chain_problem`
calls the kernel repeatedly with the tangent of the law, which is Newton's method.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm._former.compiling import compiled, inner
from cdsm._former.tree import Indices
from cdsm.support.values import Array

_ROUNDING = 2.0**-52
"""Relative rounding: of V_j′, relative to the natural lengths in its sum, and of a tension."""

_ITERATIONS = 200
"""Maximum number of steps to find a root. Newton's method needs 3 to 6, bisection would need 60."""


class Wire(NamedTuple):
    """Properties of all S segments, (S,) each: cable by cable, from the motor to the end."""

    length: Array  # l [m]
    natural: Array  # a before the slips [m]
    base: Array  # 1 + ε, extrapolated to no tension [-]
    softness: Array  # dε/dT [1/N]
    spring: Array  # compliance of the series spring [m/N]
    rest: Array  # tension at which the spring is at rest [N]
    ratio: Array  # ρ of the hole to the next segment; not used at the end of a cable [-]


@inner
def _surplus(wire: Wire, j: int, T: float) -> tuple[float, float]:
    """Compute the surplus of wire in segment j, D_j′ = a_j − A_j(T) [m], and ∂D_j′/∂T [m/N].

    a_j is the natural length in the segment before wire slips. A_j(T) is the natural length with
    which the segment has the tension T.
    """
    stretch = wire.base[j] + wire.softness[j] * T
    natural = (wire.length[j] - wire.spring[j] * (T - wire.rest[j])) / stretch
    return wire.natural[j] - natural, (wire.spring[j] + natural * wire.softness[j]) / stretch


@inner
def _next(T: float, ratio: float, best: float) -> float:
    """Return the tension [N] nearest to ``best`` that friction at a hole allows after the hole.

    Friction allows T/ratio to T · ratio. T is the tension before the hole, ``ratio`` is exp(μ φ).
    """
    return min(max(best, T / ratio), T * ratio)


@inner
def _slope(
    wire: Wire, best: Array, j: int, last: int, tension: float
) -> tuple[float, float, float]:
    """Compute V_j′ [m] at ``tension`` T of segment j, ∂V_j′/∂T [m/N], and a scale of rounding [m].

    V_j and y*_i are explained at the top of the module. ``best`` (S,) has exp(y*_i) of the segments
    i after j [N]; ``last`` is the cable's last segment. The scale is the sum of the natural lengths
    of the segments up to the next hole in which the cable sticks.
    """
    total, rise = _surplus(wire, j, tension)
    T, size = tension, abs(wire.natural[j])
    for i in range(j + 1, last + 1):
        T = _next(T, wire.ratio[i - 1], best[i])
        if best[i] == T > 0.0:  # V_i is flat; at T = 0 this is the limit T → 0
            break
        value, slope = _surplus(wire, i, T)
        total += value
        rise += slope * (T / tension if tension > 0.0 else 1.0)
        size += abs(wire.natural[i])
    return total, rise, size


@inner
def _root(wire: Wire, best: Array, j: int, last: int, near: float) -> float:
    """Find the tension exp(y*_j) [N] of segment j at which V_j′ is zero.

    The result is 0, for a slack segment, if V_j′ is not negative at any tension. The search starts
    at the tension ``near`` [N]. The other arguments are as for :func:`_slope`.
    """
    if _slope(wire, best, j, last, 0.0)[0] >= 0.0:
        return 0.0
    low, high, T = 0.0, math.inf, near if near > 0.0 else 1.0
    for _ in range(_ITERATIONS):
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


@compiled
def solve_chains(
    start: Indices,
    forced: Array,
    length: Array,
    natural: Array,
    base: Array,
    softness: Array,
    spring: Array,
    rest: Array,
    ratio: Array,
    near: Array,
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Compute tensions along all cables, and the wire that slips through their holes.

    The arrays (S,) of the segments are the fields of :class:`Wire`. ``start`` (C+1,) is the index
    of the first segment of each cable, and S at the end. ``forced`` (C,) [N] is the tension that a
    motor keeps in the first segment; NaN if the motor is locked. Newton's method starts at the
    tensions ``near`` (S,) [N].

    Returns:
        Three arrays (S,): the tension T [N] of each segment; the natural length [m] of wire that
        slips from it to the next segment, negative if wire slips back; and whether the cable slides
        in the hole between them. In a hole without friction it always slides.
    """
    wire = Wire(length, natural, base, softness, spring, rest, ratio)
    size = length.shape[0]
    best, T, slip, slides = np.empty(size), np.empty(size), np.zeros(size), np.zeros(size, np.bool_)
    for c in range(start.shape[0] - 1):
        first, last = start[c], start[c + 1] - 1
        held = math.isnan(forced[c])
        # minimizers from the end to the motor, tensions back to the end, then the slips
        for j in range(last, first, -1):
            best[j] = _root(wire, best, j, last, near[j])
        best[first] = _root(wire, best, first, last, near[first]) if held else forced[c]
        T[first] = best[first]
        for j in range(first + 1, last + 1):
            T[j] = _next(T[j - 1], ratio[j - 1], best[j])
            slides[j - 1] = T[j] != best[j] or ratio[j - 1] == 1.0
        moved = 0.0
        for j in range(last, first, -1):
            moved = moved - _surplus(wire, j, T[j])[0] if slides[j - 1] else 0.0
            slip[j - 1] = moved if T[first] > 0.0 else 0.0
    return T, slip, slides


@compiled
def chain_tangent(
    start: Indices,
    forced: Array,
    stretch: Array,
    compliance: Array,
    tension: Array,
    slides: NDArray[np.bool_],
    gradient: Array,
    friction_gradient: Array,
) -> Array:
    """Compute ∂T/∂θ (S, nv) [N/rad] of the tensions from :func:`solve_chains`.

    A block is a run of segments joined by holes in which the cable slides; a is its first segment.
    Within a block, T_j = T_a exp(Σ ± μ φ) over the holes from segment a to segment j, with + where
    T rises at the hole, and wire is conserved. With g = ∂l/∂θ, ψ_j = Σ ± μ ∂φ/∂θ over the same
    holes, and the compliance −∂A/∂T of each segment,

        ∂ln T_a/∂θ = Σ_j (g_j/(1 + ε_j) − compliance_j T_j ψ_j) / Σ_j compliance_j T_j,
        ∂T_j/∂θ = T_j (∂ln T_a/∂θ + ψ_j).

    A motor that controls the tension keeps T_a of the first block constant. A slack cable stays
    slack. ``start`` and ``forced`` are arguments of :func:`solve_chains`, ``tension`` and
    ``slides`` (S,) its results. ``stretch`` is 1 + ε (S,), ``compliance`` is (S,) [m/N],
    ``gradient`` is g (S, nv) [m/rad], and ``friction_gradient`` is μ ∂φ/∂θ (S, nv) [1/rad] of the
    hole to the next segment.
    """
    size, nv = gradient.shape
    result = np.zeros((size, nv))
    for c in range(start.shape[0] - 1):
        a = start[c]
        while a < start[c + 1]:
            end = a + 1  # of the block that begins at segment a
            while end < start[c + 1] and slides[end - 1]:
                end += 1
            if tension[a] > 0.0:
                held = a == start[c] and not math.isnan(forced[c])
                weight = 0.0
                for j in range(a, end):
                    weight += compliance[j] * tension[j]
                for v in range(nv):
                    turned, pull = 0.0, 0.0
                    for j in range(a, end):
                        if j > a:
                            up = tension[j] > tension[j - 1]
                            turned += friction_gradient[j - 1, v] * (1.0 if up else -1.0)
                        result[j, v] = tension[j] * turned
                        pull += gradient[j, v] / stretch[j] - compliance[j] * result[j, v]
                    common = 0.0 if held else pull / weight
                    for j in range(a, end):
                        result[j, v] += tension[j] * common
            a = end
    return result
