"""Kernels of many postures: W of them side by side, on the last axis of every array.

Each `lane` is one loop over postures, which the compiler vectorises. :func:`each` decides how the
same source runs: as such a loop in machine code, or, without the compiler, as one slice, so that
each line is an operation of numpy. The formulas are those of :mod:`cdsm.routing` and of Eq. 16, in
the order in which a block of postures stays in the processor's cache.

Joints come after their parents, which only here is a matter of order: :mod:`cdsm.batch.rows`
sorts them. Frame 0 is the base, frame j + 1 that of joint j. A joint has the twist (v, z) about the
origin of the base: it moves the point x by v + z × x, whether it turns or slides.

``python -m cdsm.batch`` compiles them ahead, in less than half a minute.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm.batch.rows import Arm, Body, Pose

COMPILED = bool(globals().get("COMPILED", True))
"""Whether numba compiles this module; :mod:`cdsm.batch.solution` also loads it without."""

_Function = TypeVar("_Function", bound=Callable[..., Any])

if COMPILED:
    from numba import njit
    from numba.core.compiler import Compiler

    class _Disjoint(Compiler):
        """No argument overlaps an array that is written: a quarter of the time is saved."""

        def define_pipelines(self) -> Any:
            self.state.flags.noalias = True
            return super().define_pipelines()  # type: ignore[no-untyped-call]

    # contraction to a·b + c and no sign of zero; NaN and infinity stay
    _OPTIONS: dict[str, Any] = {
        "error_model": "numpy",
        "pipeline_class": _Disjoint,
        "fastmath": {"contract", "nsz"},
    }


def kernel(function: _Function) -> _Function:
    """Compile a function that Python calls; it releases the GIL. numba keeps it on disk."""
    if not COMPILED:
        return function
    try:
        return cast(_Function, njit(cache=True, nogil=True, **_OPTIONS)(function))
    except RuntimeError:  # no folder is writable
        return cast(_Function, njit(nogil=True, **_OPTIONS)(function))


def lane(function: _Function) -> _Function:
    """Compile a function that only kernels call."""
    options: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return cast(_Function, njit(**_OPTIONS, **options)(function)) if COMPILED else function


def _each(a: NDArray[Any]) -> Iterable[Any]:
    # unsigned, since loops are not vectorised if an index may count from the end
    return range(np.uint64(a.shape[-1])) if COMPILED else (slice(a.shape[-1]),)


def _pick(condition: Any, a: Any, b: Any) -> Any:
    return a if condition else b


each = njit(inline="always")(_each) if COMPILED else _each
pick = njit(inline="always")(_pick) if COMPILED else np.where


@lane
def _turned(r: Array, a: Array, out: Array) -> None:
    for w in each(out):
        out[w] = r[0, w] * a[0] + r[1, w] * a[1] + r[2, w] * a[2]


@lane
def _placed(o: Array, r: Array, p: Array, out: Array) -> None:
    for w in each(out):
        out[w] = o[w] + r[0, w] * p[0, w] + r[1, w] * p[1, w] + r[2, w] * p[2, w]


@lane
def _rotated(r: Array, t: Array, y: int, turn: Array, out: Array) -> None:
    for w in each(out):
        out[w] = (
            r[0, w] * (t[0, 0, y] + turn[0, w] * t[1, 0, y] + turn[1, w] * t[2, 0, y])
            + r[1, w] * (t[0, 1, y] + turn[0, w] * t[1, 1, y] + turn[1, w] * t[2, 1, y])
            + r[2, w] * (t[0, 2, y] + turn[0, w] * t[1, 2, y] + turn[1, w] * t[2, 2, y])
        )


@lane
def _add_cross(a: Array, b: Array, out: Array) -> None:
    for w in each(out):
        out[0, w] += a[1, w] * b[2, w] - a[2, w] * b[1, w]
        out[1, w] += a[2, w] * b[0, w] - a[0, w] * b[2, w]
        out[2, w] += a[0, w] * b[1, w] - a[1, w] * b[0, w]


@lane
def _add_scaled(m: Array, a: Array, out: Array) -> None:
    for w in each(out):
        out[0, w] += m[w] * a[0, w]
        out[1, w] += m[w] * a[1, w]
        out[2, w] += m[w] * a[2, w]


@lane
def _add_dot(a: Array, b: Array, out: Array) -> None:
    for w in each(out):
        out[w] += a[0, w] * b[0, w] + a[1, w] * b[1, w] + a[2, w] * b[2, w]


@lane
def _add_product(a: Array, b: Array, out: Array) -> None:
    for w in each(out):
        out[w] += a[w] * b[w]


@lane
def _less_product(a: Array, b: Array, out: Array) -> None:
    for w in each(out):
        out[w] -= a[w] * b[w]


@lane
def _add(a: Array, out: Array) -> None:
    for w in each(out):
        out[w] += a[w]


@lane
def _quotient(a: Array, b: Array, out: Array) -> None:
    for w in each(out):
        out[w] = a[w] / b[w]


@lane
def _enlarge(a: Array, out: Array) -> None:
    for w in each(out):
        out[w] = np.maximum(out[w], np.abs(a[w]))


@lane
def _straight(a: Array, b: Array, out: Array, length: Array, shortest: Array) -> None:
    for w in each(length):
        x = b[0, w] - a[0, w]
        y = b[1, w] - a[1, w]
        z = b[2, w] - a[2, w]
        distance = np.sqrt(x * x + y * y + z * z)
        length[w] += distance
        shortest[w] = np.minimum(shortest[w], distance)
        over = 1.0 / distance
        out[0, w], out[1, w], out[2, w], out[3, w] = x * over, y * over, z * over, over


@lane
def _moving(u: Array, v: Array, z: Array, b: Array, g: float, d: Array, J: Array) -> None:
    for w in each(J):
        x = g * (v[0, w] + z[1, w] * b[2, w] - z[2, w] * b[1, w])
        y = g * (v[1, w] + z[2, w] * b[0, w] - z[0, w] * b[2, w])
        h = g * (v[2, w] + z[0, w] * b[1, w] - z[1, w] * b[0, w])
        d[0, w], d[1, w], d[2, w] = x, y, h
        J[w] += u[0, w] * x + u[1, w] * y + u[2, w] * h


@lane
def _bent(u: Array, d: Array, z: Array, F: Array, sign: float, out: Array) -> None:
    for w in each(F):
        rate = u[0, w] * d[0, w] + u[1, w] * d[1, w] + u[2, w] * d[2, w]
        h = F[w] * u[3, w]
        g = F[w] * sign
        out[0, w] = h * (d[0, w] - rate * u[0, w]) + g * (u[1, w] * z[2, w] - u[2, w] * z[1, w])
        out[1, w] = h * (d[1, w] - rate * u[1, w]) + g * (u[2, w] * z[0, w] - u[0, w] * z[2, w])
        out[2, w] = h * (d[2, w] - rate * u[2, w]) + g * (u[0, w] * z[1, w] - u[1, w] * z[0, w])


@kernel
def pose(arm: Arm, body: Body, q: Array, wrench: Array, at: Pose) -> None:
    """Fill ``at`` for joint angles q (B, nv, W) and wrenches (B, 6, W)."""
    nv = len(arm.parent)
    P = len(arm.frame)
    W = q.shape[2]
    R = np.zeros((nv + 1, 3, 3, W))
    o = np.zeros((nv + 1, 3, W))
    v = np.empty((nv, 3, W))
    site = np.empty((P, 3, W))
    turn = np.empty((2, W))
    mass = np.empty((nv + 1, W))
    centre = np.empty((3, W))
    first = np.empty((nv + 1, 3, W))
    for x in range(3):
        R[0, x, x] = 1.0
    for b in range(len(q)):
        own = b % len(body.mass)
        z = at.axis[b]
        L = at.length[b]
        J = at.jacobian[b]
        for j in range(nv):
            k = arm.parent[j]
            for w in each(turn):
                turn[0, w], turn[1, w] = np.cos(q[b, j, w]), np.sin(q[b, j, w])
            for x in range(3):
                _turned(R[k, x], arm.axis[j], z[j, x])
                _turned(R[k, x], arm.slide[j], v[j, x])
                _placed(o[k, x], R[k, x], body.shift[own, j], o[j + 1, x])
                _add_product(q[b, j], v[j, x], o[j + 1, x])
                for y in range(3):
                    _rotated(R[k, x], arm.turn[j], y, turn, R[j + 1, x, y])
            _add_cross(o[j + 1], z[j], v[j])

        for p in range(P):
            for x in range(3):
                _placed(o[arm.frame[p], x], R[arm.frame[p], x], body.site[own, p], site[p, x])
        L[:] = body.fixed[own]
        J[:] = 0.0
        at.shortest[b] = np.inf
        for s in range(len(arm.ends)):
            c = arm.ends[s, 0]
            u = at.segment[b, s]
            end = site[arm.ends[s, 2]]
            _straight(site[arm.ends[s, 1]], end, u, L[c], at.shortest[b])
            for t in range(arm.path.shape[1]):
                j = arm.path[s, t]
                g = arm.sign[s, t]
                if g != 0.0:
                    _moving(u, v[j], z[j], end, g, at.motion[b, s, t], J[c, j])

        first[:] = 0.0
        at.moved[b] = 0.0
        mass[:] = body.mass[own]
        for j in range(nv, -1, -1):  # from the tips on: mass and first moment of what j moves
            for x in range(3):
                _placed(o[j, x], R[j, x], body.centre[own, j], centre[x])
            _add_scaled(body.mass[own, j], centre, first[j])
            if j:
                _add_scaled(mass[j], v[j - 1], at.moved[b, j - 1])
                _add_cross(z[j - 1], first[j], at.moved[b, j - 1])
                _turned(at.moved[b, j - 1], -arm.gravity, at.gravity[b, j - 1])
                _add(mass[j], mass[arm.parent[j - 1]])
                for x in range(3):
                    _add(first[j, x], first[arm.parent[j - 1], x])

        tip = at.tip[b]
        JX = at.tip_jacobian[b]
        for x in range(3):
            _placed(o[arm.tip, x], R[arm.tip, x], body.tip[own], tip[3, x])
            for y in range(3):
                _turned(R[arm.tip, x], arm.tip_rotation[:, y], tip[y, x])
        JX[:] = 0.0
        k = arm.tip
        while k > 0:
            JX[0, k - 1], JX[1, k - 1] = v[k - 1], z[k - 1]
            _add_cross(z[k - 1], tip[3], JX[0, k - 1])
            k = arm.parent[k - 1]
        for j in range(nv):
            torque = at.torque[b, j]
            torque[:] = 0.0
            _add_dot(JX[0, j], wrench[b, :3], torque)
            _add_dot(JX[1, j], wrench[b, 3:], torque)
            for w in each(torque):
                turned = body.spring[own, j, w] * (q[b, j, w] - arm.free[j])
                torque[w] -= at.gravity[b, j, w] + turned


@kernel
def stiffness(
    arm: Arm, body: Body, at: Pose, F: Array, k: Array, wrench: Array, K: Array, size: Array
) -> None:
    """Fill K_θ for tensions F and cable stiffnesses k (B, C, W), by Eq. 16.

    K is (B, 5, nv, nv, W) for the active, passive, gravity, load and spring terms, (B, 4, …) of an
    arm without springs, or (B, 1, …) for their sum. ``size`` (B, nv, W) is, then only, the sum of
    the magnitudes of their diagonals.
    """
    nv = len(arm.parent)
    C = F.shape[1]
    W = F.shape[2]
    apart = K.shape[1] // 4
    sum_of = np.empty((nv, W))
    a = np.empty((3, W))
    r = np.empty(W)
    pull = np.empty((3, W))
    c = np.empty((arm.path.shape[1], 3, W))
    for x in range(3):
        pull[x] = arm.gravity[x]
    for b in range(len(F)):
        K[b] = 0.0
        size[b] = 0.0
        sum_of[:] = 0.0
        z = at.axis[b]
        J = at.jacobian[b]
        for s in range(len(arm.ends)):
            u = at.segment[b, s]
            d = at.motion[b, s]
            for t in range(arm.path.shape[1]):
                j = arm.path[s, t]
                g = arm.sign[s, t]
                if g != 0.0:
                    _bent(u, d[t], z[j], F[b, arm.ends[s, 0]], g, c[t])
                    for n in range(t + 1):
                        i = arm.path[s, n]
                        _add_dot(c[n], d[t], K[b, 0, min(i, j), max(i, j)])
        _note(K[b, 0], sum_of, size[b])
        for n in range(C):
            for i in range(nv):
                if arm.pulls[n, i]:
                    for w in each(r):
                        r[w] = k[b, n, w] * J[n, i, w]
                    for j in range(i, nv):
                        if arm.pulls[n, j]:
                            _add_product(r, J[n, j], K[b, apart, i, j])
        _note(K[b, apart], sum_of, size[b])
        for loaded in range(2):  # ∂g/∂θ, then −∂(J_Xᵀ W)/∂θ for the force
            force, of = (wrench[b, :3], at.tip_jacobian[b, 0]) if loaded else (pull, at.moved[b])
            term = K[b, (2 + loaded) * apart]
            for i in range(nv):
                a[:] = 0.0
                _add_cross(z[i], force, a)
                for j in range(i, nv):
                    if arm.moves[j, i]:
                        _add_dot(a, of[j], term[i, j])
            _note(term, sum_of, size[b])
        if K.shape[1] != 4:
            for j in range(nv):
                _add(body.spring[b % len(body.spring), j], K[b, 4 * apart, j, j])
            _note(K[b, 4 * apart], sum_of, size[b])
        for n in range(K.shape[1]):
            for i in range(nv):
                for j in range(i):
                    K[b, n, i, j] = K[b, n, j, i]
        for i in range(nv):
            for j in range(i):
                if arm.moves[i, j]:  # a moment is not symmetric
                    a[:] = 0.0
                    _add_cross(at.tip_jacobian[b, 1, j], wrench[b, 3:], a)
                    _add_dot(a, at.tip_jacobian[b, 1, i], K[b, 3 * apart, i, j])


@lane
def _note(K: Array, before: Array, size: Array) -> None:
    """Add to ``size`` by how much the diagonal of K has changed, and remember it."""
    for j in range(len(size)):
        for w in each(size):
            size[j, w] += np.abs(K[j, j, w] - before[j, w])
            before[j, w] = K[j, j, w]


@kernel
def along(K: Array, size: Array, JX: Array, u: Array, skew: bool, out: Array, pivot: Array) -> None:
    """Fill 1/(uᵀ J_v K_θ⁻¹ J_vᵀ u) (B, D, W) for D directions u; K (B, 1, nv, nv, W) is destroyed.

    K_θ = L U without exchange of rows, which is exact where the arm is stable: where the smallest
    ``pivot`` (B, W), relative to ``size``, is not small. Without ``skew``, K_θ is symmetric, and L
    follows from U. The stiffness is infinite where the tip cannot move.
    """
    nv = K.shape[2]
    W = K.shape[4]
    t = np.empty((nv, W))
    s = np.empty((nv, W))
    r = np.empty(W)
    most = np.empty(W)
    reach = np.empty(W)
    for b in range(len(K)):
        A = K[b, 0]
        pivot[b] = np.inf
        for k in range(nv):
            for w in each(r):
                pivot[b, w] = np.minimum(pivot[b, w], A[k, k, w] / size[b, k, w])
            for i in range(k + 1, nv):
                _quotient(A[i, k] if skew else A[k, i], A[k, k], r)
                for j in range(k + 1 if skew else i, nv):
                    _less_product(r, A[k, j], A[i, j])
                A[i, k] = r
        reach[:] = 0.0
        for j in range(nv):
            for x in range(3):
                _enlarge(JX[b, 0, j, x], reach)
        for n in range(len(u)):
            r[:] = 0.0
            most[:] = 0.0
            for j in range(nv):
                _turned(JX[b, 0, j], u[n], t[j])
                _enlarge(t[j], most)
                s[j] = t[j]
            for k in range(nv):  # t = L⁻¹ J_vᵀ u, s = U⁻ᵀ J_vᵀ u
                s[k] /= A[k, k]
                _add_product(s[k], t[k], r)
                for i in range(k + 1, nv):
                    _less_product(A[i, k], t[k], t[i])
                    _less_product(A[k, i], s[k], s[i])
            for w in each(r):
                out[b, n, w] = pick(most[w] > 1e-10 * reach[w], 1.0 / r[w], np.inf)


@lane
def _paired(J: Array, p: int, q: int, i: int, j: int, least: float, out: Array) -> None:
    """Copy moment arms of cables p, q about axes i, j (p if i = j); below ``least`` is rounding."""
    for n in range(2):
        c = q if n else p
        for m in range(2):
            axis = j if m else i
            for w in each(out):
                lever = J[c, axis, w] if i != j or m == n == 0 else 1.0 * (m == n)
                out[n, m, w] = pick(np.abs(lever) < least, 0.0, lever)


@lane
def _weighed(J: Array, rest: Array, low: Array, other: Array, number: int, best: Array) -> None:
    """Keep the pair of cables that balances a block with the least rise of ‖F‖²."""
    for w in each(rest):
        det = J[0, 0, w] * J[1, 1, w] - J[0, 1, w] * J[1, 0, w]
        x = (rest[0, w] * J[1, 1, w] - rest[1, w] * J[1, 0, w]) / det
        y = (J[0, 0, w] * rest[1, w] - J[0, 1, w] * rest[0, w]) / det
        cost = (2.0 * low[w] + x) * x + (2.0 * other[w] + y) * y
        better = (x >= 0.0) & (y >= 0.0) & (cost < best[0, w])
        best[0, w] = pick(better, cost, best[0, w])
        best[1, w] = pick(better, number, best[1, w])
        best[2, w] = pick(better, x, best[2, w])
        best[3, w] = pick(better, y, best[3, w])


@lane
def _add_chosen(chosen: Array, number: int, x: Array, out: Array) -> None:
    for w in each(out):
        out[w] += pick(chosen[w] == number, x[w], 0.0)


@lane
def _multiplied(J: Array, a: Array, b: Array, chosen: Array, number: int, y: Array) -> None:
    """Solve J y = (a, b) for the chosen pair."""
    for w in each(a):
        det = J[0, 0, w] * J[1, 1, w] - J[0, 1, w] * J[1, 0, w]
        x = (a[w] * J[1, 1, w] - b[w] * J[0, 1, w]) / det
        y[0, w] = pick(chosen[w] == number, x, y[0, w])
        x = (J[0, 0, w] * b[w] - J[1, 0, w] * a[w]) / det
        y[1, w] = pick(chosen[w] == number, x, y[1, w])


@lane
def _verified(z: Array, F: Array, high: Array, good: NDArray[np.bool_]) -> None:
    for w in each(good):
        good[w] &= (z[w] >= -1e-11 * F[w]) & (F[w] <= high[w])


@kernel
def guess(arm: Arm, at: Pose, low: Array, high: Array, F: Array, good: NDArray[np.bool_]) -> None:
    """Fill least tensions F (B, C, W) within bounds; ``good`` (B, W) where they are the optimum.

    J_Lᵀ of a serpentine arm is block triangular: a block has the axes of one joint, and the cables
    that end there. From tip to base, as many cables of the block as it has axes get more than
    their lower bound, at the least rise of ‖F‖²; from base to tip, their multipliers y follow. The
    Karush-Kuhn-Tucker conditions then decide: J_Lᵀ F = τ, and F_c ≥ (J_L y)_c for all others.
    """
    nv = len(arm.parent)
    C = F.shape[1]
    W = F.shape[2]
    y = np.empty((nv, W))
    rest = np.empty((2, W))
    left = np.empty((C + 1, W))
    best = np.empty((4, W))
    both = np.empty((2, W))
    J2 = np.empty((2, 2, W))
    chosen = np.empty((len(arm.pair_ends), W))
    size = np.empty(W)
    left[C] = 0.0  # the second cable of blocks with one axis
    for b in range(len(F)):
        J = at.jacobian[b]
        none = left[C]
        F[b] = low[b]
        good[b] = True
        for n in range(len(arm.pair_ends) - 2, -1, -1):
            i = arm.axes[arm.axis_ends[n]]
            j = arm.axes[arm.axis_ends[n + 1] - 1]
            rest[0], rest[1] = at.torque[b, i], at.torque[b, j]
            if i == j:
                rest[1] = 0.0
            for c in arm.cables[arm.cable_ends[n] :]:
                _less_product(J[c, i], F[b, c], rest[0])
                if i != j:
                    _less_product(J[c, j], F[b, c], rest[1])
            best[0], best[1] = np.inf, -1.0
            for m in range(arm.pair_ends[n], arm.pair_ends[n + 1]):
                p = arm.pairs[m, 0]
                q = arm.pairs[m, 1]
                _paired(J, p, q, i, j, arm.least, J2)
                _weighed(J2, rest, low[b, p], low[b, q] if i != j else none, m, best)
            for m in range(arm.pair_ends[n], arm.pair_ends[n + 1]):
                p = arm.pairs[m, 0]
                q = arm.pairs[m, 1]
                _add_chosen(best[1], m, best[2], F[b, p])
                if i != j:
                    _add_chosen(best[1], m, best[3], F[b, q])
            chosen[n] = best[1]
            for w in each(rest):
                good[b, w] &= best[1, w] >= 0.0

        for n in range(len(arm.pair_ends) - 1):
            i = arm.axes[arm.axis_ends[n]]
            j = arm.axes[arm.axis_ends[n + 1] - 1]
            own = arm.cables[arm.cable_ends[n] : arm.cable_ends[n + 1]]
            for c in own:
                left[c] = F[b, c]
                for t in arm.axes[: arm.axis_ends[n]]:
                    _less_product(J[c, t], y[t], left[c])
            both[:] = 0.0
            for m in range(arm.pair_ends[n], arm.pair_ends[n + 1]):
                p = arm.pairs[m, 0]
                q = arm.pairs[m, 1]
                _paired(J, p, q, i, j, arm.least, J2)
                _multiplied(J2, left[p], left[q] if i != j else none, chosen[n], m, both)
            y[j], y[i] = both[1], both[0]
            for c in own:
                _less_product(J[c, i], y[i], left[c])
                if i != j:
                    _less_product(J[c, j], y[j], left[c])
                _verified(left[c], F[b, c], high[b, c], good[b])

        for i in range(nv):  # rounding, where two cables of a block pull in nearly one direction
            rest[0] = at.torque[b, i]
            size[:] = 0.0
            for c in range(C):
                if arm.pulls[c, i]:
                    _less_product(J[c, i], F[b, c], rest[0])
                    for w in each(size):
                        size[w] += np.abs(J[c, i, w] * F[b, c, w])
            for w in each(size):
                good[b, w] &= np.abs(rest[0, w]) <= 1e-11 * size[w]
