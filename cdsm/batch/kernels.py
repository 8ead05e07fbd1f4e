"""Kernels of many postures: W of them side by side, on the last axis of every array.

An inner loop goes over the postures, and the compiler vectorises it. :func:`lanes` decides how the
same source runs: as such a loop in machine code, or, without the compiler, as one slice, so that
each line is an operation of numpy. The formulas are those of :mod:`cdsm.routing` and of Eq. 16, in
the order in which a block of postures stays in the processor's cache.

Joints are sorted so that a parent precedes its children (:mod:`cdsm.batch.rows`). Frame 0 is the
base, frame j + 1 that of joint j. A joint has the twist (v, z) about the origin of the base: it
moves the point x by v + z × x, whether it turns or slides.

Shapes: B blocks of W postures, n joints, C cables, S segments, P sites.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm.batch.rows import ArmArrays, BodyArrays, LoadArrays, PoseArrays

COMPILED = bool(globals().get("COMPILED", True))
"""Whether numba compiles this module; :mod:`cdsm.batch.solution` also loads it without."""

_BALANCED = 1e-11  # largest error of balance, and of a multiplier, relative to its terms

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


def inner_loop(function: _Function) -> _Function:
    """Compile a function that only kernels call."""
    options: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return cast(_Function, njit(**_OPTIONS, **options)(function)) if COMPILED else function


def _lanes(a: NDArray[Any]) -> Iterable[Any]:
    # unsigned, since loops are not vectorised if an index may count from the end
    return range(np.uint64(a.shape[-1])) if COMPILED else (slice(a.shape[-1]),)


def _choose(condition: Any, a: Any, b: Any) -> Any:
    return a if condition else b


lanes = njit(inline="always")(_lanes) if COMPILED else _lanes
choose = njit(inline="always")(_choose) if COMPILED else np.where


@inner_loop
def _rotate(r: Array, a: Array, out: Array) -> None:
    """Compute a component of R a from a row r of R (3, W) and a fixed vector a (3,)."""
    for w in lanes(out):
        out[w] = r[0, w] * a[0] + r[1, w] * a[1] + r[2, w] * a[2]


@inner_loop
def _place(o: Array, r: Array, p: Array, out: Array) -> None:
    """Compute a component of the point o + R p from a row r of R (3, W)."""
    for w in lanes(out):
        out[w] = o[w] + r[0, w] * p[0, w] + r[1, w] * p[1, w] + r[2, w] * p[2, w]


@inner_loop
def _compose_rotation(r: Array, t: Array, y: int, turn: Array, out: Array) -> None:
    """Compute entry y of a row of R (A + B cos q + C sin q) from a row r of R (3, W)."""
    for w in lanes(out):
        out[w] = (
            r[0, w] * (t[0, 0, y] + turn[0, w] * t[1, 0, y] + turn[1, w] * t[2, 0, y])
            + r[1, w] * (t[0, 1, y] + turn[0, w] * t[1, 1, y] + turn[1, w] * t[2, 1, y])
            + r[2, w] * (t[0, 2, y] + turn[0, w] * t[1, 2, y] + turn[1, w] * t[2, 2, y])
        )


@inner_loop
def _add_cross(a: Array, b: Array, out: Array) -> None:
    for w in lanes(out):
        out[0, w] += a[1, w] * b[2, w] - a[2, w] * b[1, w]
        out[1, w] += a[2, w] * b[0, w] - a[0, w] * b[2, w]
        out[2, w] += a[0, w] * b[1, w] - a[1, w] * b[0, w]


@inner_loop
def _add_scaled(m: Array, a: Array, out: Array) -> None:
    for w in lanes(out):
        out[0, w] += m[w] * a[0, w]
        out[1, w] += m[w] * a[1, w]
        out[2, w] += m[w] * a[2, w]


@inner_loop
def _add_dot(a: Array, b: Array, out: Array) -> None:
    for w in lanes(out):
        out[w] += a[0, w] * b[0, w] + a[1, w] * b[1, w] + a[2, w] * b[2, w]


@inner_loop
def add_product(a: Array, b: Array, out: Array) -> None:
    """Add a b."""
    for w in lanes(out):
        out[w] += a[w] * b[w]


@inner_loop
def _subtract_product(a: Array, b: Array, out: Array) -> None:
    for w in lanes(out):
        out[w] -= a[w] * b[w]


@inner_loop
def _add(a: Array, out: Array) -> None:
    for w in lanes(out):
        out[w] += a[w]


@inner_loop
def _divide(a: Array, b: Array, out: Array) -> None:
    for w in lanes(out):
        out[w] = a[w] / b[w]


@inner_loop
def _keep_larger_size(a: Array, out: Array) -> None:
    """Keep the larger magnitude."""
    for w in lanes(out):
        out[w] = np.maximum(out[w], np.abs(a[w]))


@inner_loop
def _segment_direction(a: Array, b: Array, out: Array, length: Array, shortest: Array) -> None:
    """Compute u = (b − a)/ℓ and 1/ℓ; add ℓ to the length of the cable."""
    for w in lanes(length):
        x = b[0, w] - a[0, w]
        y = b[1, w] - a[1, w]
        z = b[2, w] - a[2, w]
        distance = np.sqrt(x * x + y * y + z * z)
        length[w] += distance
        shortest[w] = np.minimum(shortest[w], distance)
        over = 1.0 / distance
        out[0, w] = x * over
        out[1, w] = y * over
        out[2, w] = z * over
        out[3, w] = over


@inner_loop
def _segment_rate(u: Array, v: Array, z: Array, b: Array, g: float, d: Array, J: Array) -> None:
    """Compute ∂b/∂θ_j of the end b of a segment, with its sign; add u·∂b/∂θ_j to J_L."""
    for w in lanes(J):
        x = g * (v[0, w] + z[1, w] * b[2, w] - z[2, w] * b[1, w])
        y = g * (v[1, w] + z[2, w] * b[0, w] - z[0, w] * b[2, w])
        h = g * (v[2, w] + z[0, w] * b[1, w] - z[1, w] * b[0, w])
        d[0, w] = x
        d[1, w] = y
        d[2, w] = h
        J[w] += u[0, w] * x + u[1, w] * y + u[2, w] * h


@inner_loop
def _hessian_row(u: Array, d: Array, z: Array, F: Array, sign: float, out: Array) -> None:
    """Compute F ∂u/∂θ_j, of which the product with ∂b/∂θ_i is an entry of F ∂²ℓ/∂θ²."""
    for w in lanes(F):
        rate = u[0, w] * d[0, w] + u[1, w] * d[1, w] + u[2, w] * d[2, w]
        h = F[w] * u[3, w]
        g = F[w] * sign
        out[0, w] = h * (d[0, w] - rate * u[0, w]) + g * (u[1, w] * z[2, w] - u[2, w] * z[1, w])
        out[1, w] = h * (d[1, w] - rate * u[1, w]) + g * (u[2, w] * z[0, w] - u[0, w] * z[2, w])
        out[2, w] = h * (d[2, w] - rate * u[2, w]) + g * (u[0, w] * z[1, w] - u[1, w] * z[0, w])


@inner_loop
def _add_spread(p: Array, f: Array, out: Array) -> None:
    """Add p fᵀ to a matrix (3, 3, W)."""
    for x in range(3):
        for y in range(3):
            add_product(p[x], f[y], out[x, y])


@inner_loop
def _add_turned(f: Array, v: Array, z: Array, P: Array, out: Array) -> None:
    """Add f × v + tr(P) z − P z, how Σ f × (v + z × p) follows from f = Σ f and P = Σ p fᵀ."""
    _add_cross(f, v, out)
    for x in range(3):
        for w in lanes(out):
            out[x, w] += (P[0, 0, w] + P[1, 1, w] + P[2, 2, w]) * z[x, w]
            out[x, w] -= P[x, 0, w] * z[0, w] + P[x, 1, w] * z[1, w] + P[x, 2, w] * z[2, w]


@inner_loop
def _add_loads(
    arm: ArmArrays, loads: LoadArrays, b: int, frames: tuple[Array, Array, Array], at: PoseArrays
) -> None:
    """Add the torques of loads on links, and fill what their stiffness needs.

    ``frames`` are rotations (n+1, 3, 3, W) and origins (n+1, 3, W) of all frames, and v (n, 3, W).
    """
    R, o, v = frames
    n = len(arm.parent)
    W = o.shape[2]
    force = np.zeros((n + 1, 3, W))
    about = np.zeros((n + 1, 3, W))  # Σ p × f + m
    moment = np.zeros((n + 1, 3, W))
    spread = np.zeros((n + 1, 3, 3, W))  # Σ p fᵀ
    point = np.empty((3, W))
    for k in range(len(loads.frame)):
        frame = loads.frame[k]
        f = loads.wrench[b, k, :3]
        m = loads.wrench[b, k, 3:]
        for x in range(3):
            _rotate(R[frame, x], loads.point[k], point[x])
            _add(o[frame, x], point[x])
            _add(f[x], force[frame, x])
            _add(m[x], about[frame, x])
            _add(m[x], moment[frame, x])
        _add_cross(point, f, about[frame])
        _add_spread(point, f, spread[frame])
    at.turned[b] = 0.0
    for j in range(n, 0, -1):
        z = at.axis[b, j - 1]
        _add_dot(force[j], v[j - 1], at.torque[b, j - 1])
        _add_dot(about[j], z, at.torque[b, j - 1])
        _add_turned(force[j], v[j - 1], z, spread[j], at.turned[b, j - 1])
        at.moment[b, j - 1] = moment[j]
        k = arm.parent[j - 1]
        for x in range(3):
            _add(force[j, x], force[k, x])
            _add(about[j, x], about[k, x])
            _add(moment[j, x], moment[k, x])
            for y in range(3):
                _add(spread[j, x, y], spread[k, x, y])


@inner_loop
def place_frames(
    arm: ArmArrays,
    shift: Array,
    q: Array,
    turn: Array,
    frames: tuple[Array, Array, Array],
    z: Array,
) -> None:
    """Fill frames and twists, from the base on: R, o and v of all frames, and z (n, 3, W).

    ``turn`` (2, W) is scratch. The base's frame is given.
    """
    R, o, v = frames
    for j in range(len(arm.parent)):
        k = arm.parent[j]
        for w in lanes(turn):
            turn[0, w] = np.cos(q[j, w])
            turn[1, w] = np.sin(q[j, w])
        for x in range(3):
            _rotate(R[k, x], arm.axis[j], z[j, x])
            _rotate(R[k, x], arm.slide[j], v[j, x])
            _place(o[k, x], R[k, x], shift[j], o[j + 1, x])
            add_product(q[j], v[j, x], o[j + 1, x])
            for y in range(3):
                _compose_rotation(R[k, x], arm.turn[j], y, turn, R[j + 1, x, y])
        _add_cross(o[j + 1], z[j], v[j])


@kernel
def fill_pose(
    arm: ArmArrays,
    body: BodyArrays,
    q: Array,
    wrench: Array,
    loads: LoadArrays,
    at: PoseArrays,
) -> None:
    """Fill ``at`` for joint angles q (B, n, W), wrenches (B, 6, W) at the tip, and loads on links.

    Without loads, ``at.turned`` and ``at.moment`` are empty.
    """
    n = len(arm.parent)
    P = len(arm.frame)
    W = q.shape[2]
    R = np.zeros((n + 1, 3, 3, W))
    o = np.zeros((n + 1, 3, W))
    v = np.empty((n, 3, W))
    site = np.empty((P, 3, W))
    turn = np.empty((2, W))
    mass = np.empty((n + 1, W))
    centre = np.empty((3, W))
    first = np.empty((n + 1, 3, W))
    for x in range(3):
        R[0, x, x] = 1.0
    for b in range(len(q)):
        # one block of dimensions for all postures, or one for each; contacts are sites
        shared = b % len(body.mass)
        z = at.axis[b]
        L = at.length[b]
        J = at.jacobian[b]
        place_frames(arm, body.shift[shared], q[b], turn, (R, o, v), z)

        # sites, segments between them, L and J_L
        for p in range(P):
            for x in range(3):
                _place(
                    o[arm.frame[p], x],
                    R[arm.frame[p], x],
                    body.site[b % len(body.site), p],
                    site[p, x],
                )
        L[:] = body.fixed[b % len(body.fixed)]
        J[:] = 0.0
        at.shortest[b] = np.inf
        for s in range(len(arm.ends)):
            c = arm.ends[s, 0]
            u = at.segment[b, s]
            end = site[arm.ends[s, 2]]
            _segment_direction(site[arm.ends[s, 1]], end, u, L[c], at.shortest[b])
            for t in range(arm.path.shape[1]):
                j = arm.path[s, t]
                g = arm.sign[s, t]
                if g != 0.0:
                    _segment_rate(u, v[j], z[j], end, g, at.motion[b, s, t], J[c, j])

        # gravity torque, from the tips on: mass and first moment of what joint j moves
        first[:] = 0.0
        at.moved[b] = 0.0
        mass[:] = body.mass[shared]
        for j in range(n, -1, -1):
            for x in range(3):
                _place(o[j, x], R[j, x], body.centre[shared, j], centre[x])
            _add_scaled(body.mass[shared, j], centre, first[j])
            if j:
                _add_scaled(mass[j], v[j - 1], at.moved[b, j - 1])
                _add_cross(z[j - 1], first[j], at.moved[b, j - 1])
                _rotate(at.moved[b, j - 1], -arm.gravity, at.gravity[b, j - 1])
                _add(mass[j], mass[arm.parent[j - 1]])
                for x in range(3):
                    _add(first[j, x], first[arm.parent[j - 1], x])

        # pose of the tip, and J_X
        tip = at.tip[b]
        JX = at.tip_jacobian[b]
        for x in range(3):
            _place(o[arm.tip, x], R[arm.tip, x], body.tip[shared], tip[3, x])
            for y in range(3):
                _rotate(R[arm.tip, x], arm.tip_rotation[:, y], tip[y, x])
        JX[:] = 0.0
        k = arm.tip
        while k > 0:
            JX[0, k - 1] = v[k - 1]
            JX[1, k - 1] = z[k - 1]
            _add_cross(z[k - 1], tip[3], JX[0, k - 1])
            k = arm.parent[k - 1]

        # J_Xᵀ W − g − k (q − q_0), which the cables balance
        for j in range(n):
            torque = at.torque[b, j]
            torque[:] = 0.0
            _add_dot(JX[0, j], wrench[b, :3], torque)
            _add_dot(JX[1, j], wrench[b, 3:], torque)
            for w in lanes(torque):
                turned = body.spring[shared, j, w] * (q[b, j, w] - arm.free[j])
                torque[w] -= at.gravity[b, j, w] + turned
        if len(loads.frame):
            _add_loads(arm, loads, b, (R, o, v), at)


@kernel
def fill_stiffness(
    arm: ArmArrays,
    body: BodyArrays,
    at: PoseArrays,
    F: Array,
    k: Array,
    wrench: Array,
    K: Array,
    size: Array,
) -> None:
    """Fill K_θ for tensions F and cable stiffnesses k (B, C, W), by Eq. 16.

    The shape of K says what is wanted: (B, 5, n, n, W) the active, passive, gravity, load and
    spring terms, (B, 4, …) the same of an arm without springs, (B, 1, …) their sum. ``size``
    (B, n, W) is, of the sum only, the sum of the magnitudes of the terms' diagonals.
    """
    n = len(arm.parent)
    C = F.shape[1]
    W = F.shape[2]
    count = K.shape[1]
    has_springs = count != 4
    passive = 1 if count > 1 else 0  # where each term is added: all to the first if only the sum
    gravity = 2 * passive  # is wanted; the active term is the first
    load = 3 * passive
    springs = 4 * passive
    diagonal = np.empty((n, W))
    moment = np.empty((3, W))
    row = np.empty(W)
    weight = np.empty((3, W))
    bent = np.empty((arm.path.shape[1], 3, W))
    for x in range(3):
        weight[x] = arm.gravity[x]
    for b in range(len(F)):
        K[b] = 0.0
        size[b] = 0.0
        diagonal[:] = 0.0
        z = at.axis[b]
        J = at.jacobian[b]

        # active: H_L F, segment by segment; terms are filled above the diagonal
        for s in range(len(arm.ends)):
            u = at.segment[b, s]
            d = at.motion[b, s]
            for t in range(arm.path.shape[1]):
                j = arm.path[s, t]
                g = arm.sign[s, t]
                if g != 0.0:
                    _hessian_row(u, d[t], z[j], F[b, arm.ends[s, 0]], g, bent[t])
                    for m in range(t + 1):
                        i = arm.path[s, m]
                        _add_dot(bent[m], d[t], K[b, 0, min(i, j), max(i, j)])
        _accumulate_diagonal(K[b, 0], diagonal, size[b])

        # passive: J_Lᵀ K_L J_L
        for c in range(C):
            for i in range(n):
                if arm.pulls[c, i]:
                    for w in lanes(row):
                        row[w] = k[b, c, w] * J[c, i, w]
                    for j in range(i, n):
                        if arm.pulls[c, j]:
                            add_product(row, J[c, j], K[b, passive, i, j])
        _accumulate_diagonal(K[b, passive], diagonal, size[b])

        # gravity and load: ∂g/∂θ, then −∂(J_Xᵀ W)/∂θ for the force
        for loaded in range(2):
            force = wrench[b, :3] if loaded else weight
            moved = at.tip_jacobian[b, 0] if loaded else at.moved[b]
            term = K[b, load if loaded else gravity]
            for i in range(n):
                moment[:] = 0.0
                _add_cross(z[i], force, moment)
                for j in range(i, n):
                    if arm.moves[j, i]:
                        _add_dot(moment, moved[j], term[i, j])
            if loaded and at.turned.shape[1]:  # loads on links
                for i in range(n):
                    for j in range(i, n):
                        if arm.moves[j, i]:
                            _add_dot(z[i], at.turned[b, j], term[i, j])
            _accumulate_diagonal(term, diagonal, size[b])

        if has_springs:
            for j in range(n):
                _add(body.spring[b % len(body.spring), j], K[b, springs, j, j])
            _accumulate_diagonal(K[b, springs], diagonal, size[b])

        for term_number in range(count):
            for i in range(n):
                for j in range(i):
                    K[b, term_number, i, j] = K[b, term_number, j, i]

        # load, for the moment: not symmetric, below the diagonal alone
        for i in range(n):
            for j in range(i):
                if arm.moves[i, j]:
                    moment[:] = 0.0
                    _add_cross(at.tip_jacobian[b, 1, j], wrench[b, 3:], moment)
                    _add_dot(moment, at.tip_jacobian[b, 1, i], K[b, load, i, j])
                    if at.moment.shape[1]:
                        moment[:] = 0.0
                        _add_cross(z[j], at.moment[b, i], moment)
                        _add_dot(moment, z[i], K[b, load, i, j])


@inner_loop
def _accumulate_diagonal(K: Array, before: Array, size: Array) -> None:
    """Add to ``size`` by how much the diagonal of K has changed, and remember it."""
    for j in range(len(size)):
        for w in lanes(size):
            size[j, w] += np.abs(K[j, j, w] - before[j, w])
            before[j, w] = K[j, j, w]


@kernel
def fill_along(
    K: Array,
    size: Array,
    JX: Array,
    u: Array,
    skew: bool,
    unmoved: float,
    out: Array,
    pivot: Array,
) -> None:
    """Fill 1/(uᵀ J_v K_θ⁻¹ J_vᵀ u) (B, D, W) for D directions u; K (B, 1, n, n, W) is destroyed.

    K_θ = L U without exchange of rows, which is exact where the arm is stable: where the smallest
    ``pivot`` (B, W), relative to ``size``, is not small. Without ``skew``, K_θ is symmetric, and L
    follows from U. The stiffness is infinite where the tip cannot move: where all entries of J_vᵀ u
    are below the part ``unmoved`` of those of J_v.
    """
    n = K.shape[2]
    W = K.shape[4]
    t = np.empty((n, W))
    s = np.empty((n, W))
    r = np.empty(W)
    largest = np.empty(W)
    reach = np.empty(W)
    for b in range(len(K)):
        A = K[b, 0]
        pivot[b] = np.inf
        for k in range(n):
            for w in lanes(r):
                pivot[b, w] = np.minimum(pivot[b, w], A[k, k, w] / size[b, k, w])
            for i in range(k + 1, n):
                _divide(A[i, k] if skew else A[k, i], A[k, k], r)
                for j in range(k + 1 if skew else i, n):
                    _subtract_product(r, A[k, j], A[i, j])
                A[i, k] = r
        reach[:] = 0.0
        for j in range(n):
            for x in range(3):
                _keep_larger_size(JX[b, 0, j, x], reach)
        for m in range(len(u)):
            r[:] = 0.0
            largest[:] = 0.0
            for j in range(n):
                _rotate(JX[b, 0, j], u[m], t[j])
                _keep_larger_size(t[j], largest)
                s[j] = t[j]
            for k in range(n):  # t = L⁻¹ J_vᵀ u, s = U⁻ᵀ J_vᵀ u
                s[k] /= A[k, k]
                add_product(s[k], t[k], r)
                for i in range(k + 1, n):
                    _subtract_product(A[i, k], t[k], t[i])
                    _subtract_product(A[k, i], s[k], s[i])
            for w in lanes(r):
                out[b, m, w] = choose(largest[w] > unmoved * reach[w], 1.0 / r[w], np.inf)


@inner_loop
def _copy_moment_arms(J: Array, p: int, q: int, i: int, j: int, least: float, out: Array) -> None:
    """Copy moment arms of cables p, q about axes i, j (p if i = j); below ``least`` is rounding."""
    for cable in range(2):
        c = q if cable else p
        for column in range(2):
            axis = j if column else i
            for w in lanes(out):
                single = i == j and cable + column > 0  # of one axis: the other row is (0, 1)
                lever = 1.0 * (cable == column) if single else J[c, axis, w]
                out[cable, column, w] = choose(np.abs(lever) < least, 0.0, lever)


@inner_loop
def _keep_cheaper_pair(
    J: Array, rest: Array, low: Array, other: Array, number: int, best: Array
) -> None:
    """Solve Jᵀ (x, y) = rest for a pair; keep it in ``best`` if ‖F‖² rises least, and it pulls.

    ``best`` (4, W) has the rise of ‖F‖², the number of the pair, x and y: what its cables get more
    than their lower bounds ``low`` and ``other``.
    """
    for w in lanes(rest):
        det = J[0, 0, w] * J[1, 1, w] - J[0, 1, w] * J[1, 0, w]
        x = (rest[0, w] * J[1, 1, w] - rest[1, w] * J[1, 0, w]) / det
        y = (J[0, 0, w] * rest[1, w] - J[0, 1, w] * rest[0, w]) / det
        cost = (2.0 * low[w] + x) * x + (2.0 * other[w] + y) * y
        better = (x >= 0.0) & (y >= 0.0) & (cost < best[0, w])
        best[0, w] = choose(better, cost, best[0, w])
        best[1, w] = choose(better, number, best[1, w])
        best[2, w] = choose(better, x, best[2, w])
        best[3, w] = choose(better, y, best[3, w])


@inner_loop
def _add_chosen(chosen: Array, number: int, x: Array, out: Array) -> None:
    """Add x where the pair ``number`` is chosen."""
    for w in lanes(out):
        out[w] += choose(chosen[w] == number, x[w], 0.0)


@inner_loop
def _solve_multipliers(J: Array, a: Array, b: Array, chosen: Array, number: int, y: Array) -> None:
    """Solve J y = (a, b) where the pair ``number`` is chosen."""
    for w in lanes(a):
        det = J[0, 0, w] * J[1, 1, w] - J[0, 1, w] * J[1, 0, w]
        x = (a[w] * J[1, 1, w] - b[w] * J[0, 1, w]) / det
        y[0, w] = choose(chosen[w] == number, x, y[0, w])
        x = (J[0, 0, w] * b[w] - J[1, 0, w] * a[w]) / det
        y[1, w] = choose(chosen[w] == number, x, y[1, w])


@inner_loop
def _check_optimality(multiplier: Array, F: Array, high: Array, optimal: NDArray[np.bool_]) -> None:
    """Check that the multiplier of a lower bound is not negative, and that F is within bounds."""
    for w in lanes(optimal):
        optimal[w] &= (multiplier[w] >= -_BALANCED * F[w]) & (F[w] <= high[w])


@kernel
def guess_tensions(
    arm: ArmArrays,
    at: PoseArrays,
    low: Array,
    high: Array,
    F: Array,
    optimal: NDArray[np.bool_],
) -> None:
    """Fill least tensions F (B, C, W) within bounds; ``optimal`` (B, W) where they are the optimum.

    J_Lᵀ of a serpentine arm is block triangular: a block has the axes of one joint, and the cables
    that end there. A cable of a block turns all joints before it too, and none behind it. So

    1. from tip to base, each block is balanced: all cables have their lower bound but as many as
       the block has axes. Of the pairs (or single cables) that balance it, the one with the least
       rise of ‖F‖² is chosen;
    2. from base to tip, the Lagrange multipliers y of the balance follow: F_c = (J_L y)_c for the
       chosen cables;
    3. the Karush-Kuhn-Tucker conditions decide: J_Lᵀ F = τ, and F_c ≥ (J_L y)_c for all others.

    The choice in 1 looks at its own block only. It is a guess, which 3 proves or rejects.
    """
    n = len(arm.parent)
    C = F.shape[1]
    W = F.shape[2]
    blocks = len(arm.pair_ends) - 1
    y = np.empty((n, W))
    rest = np.empty((2, W))
    left = np.empty((C + 1, W))
    best = np.empty((4, W))
    pair_y = np.empty((2, W))
    J_pair = np.empty((2, 2, W))
    chosen = np.empty((blocks, W))
    size = np.empty(W)
    left[C] = 0.0
    for b in range(len(F)):
        J = at.jacobian[b]
        none = left[C]  # of the second cable of a block with one axis
        F[b] = low[b]
        optimal[b] = True

        # 1. balance the blocks, from tip to base
        for block in range(blocks - 1, -1, -1):
            i = arm.axes[arm.axis_ends[block]]
            j = arm.axes[arm.axis_ends[block + 1] - 1]  # i, if the block has one axis
            # torque that remains beside the cables of the blocks behind, and the lower bounds here
            rest[0] = at.torque[b, i]
            rest[1] = at.torque[b, j]
            if i == j:
                rest[1] = 0.0
            for c in arm.cables[arm.cable_ends[block] :]:
                _subtract_product(J[c, i], F[b, c], rest[0])
                if i != j:
                    _subtract_product(J[c, j], F[b, c], rest[1])
            # the cheapest pair of cables
            best[0] = np.inf
            best[1] = -1.0
            for m in range(arm.pair_ends[block], arm.pair_ends[block + 1]):
                p = arm.pairs[m, 0]
                q = arm.pairs[m, 1]
                _copy_moment_arms(J, p, q, i, j, arm.least, J_pair)
                _keep_cheaper_pair(J_pair, rest, low[b, p], low[b, q] if i != j else none, m, best)
            # postures of a block may have chosen different pairs
            for m in range(arm.pair_ends[block], arm.pair_ends[block + 1]):
                p = arm.pairs[m, 0]
                q = arm.pairs[m, 1]
                _add_chosen(best[1], m, best[2], F[b, p])
                if i != j:
                    _add_chosen(best[1], m, best[3], F[b, q])
            chosen[block] = best[1]
            for w in lanes(rest):
                optimal[b, w] &= best[1, w] >= 0.0

        # 2. multipliers y of the balance, from base to tip
        for block in range(blocks):
            i = arm.axes[arm.axis_ends[block]]
            j = arm.axes[arm.axis_ends[block + 1] - 1]
            cables = arm.cables[arm.cable_ends[block] : arm.cable_ends[block + 1]]
            # F − J_L y of the blocks before, which the y of this block must cancel
            for c in cables:
                left[c] = F[b, c]
                for axis in arm.axes[: arm.axis_ends[block]]:
                    _subtract_product(J[c, axis], y[axis], left[c])
            pair_y[:] = 0.0
            for m in range(arm.pair_ends[block], arm.pair_ends[block + 1]):
                p = arm.pairs[m, 0]
                q = arm.pairs[m, 1]
                _copy_moment_arms(J, p, q, i, j, arm.least, J_pair)
                other = left[q] if i != j else none
                _solve_multipliers(J_pair, left[p], other, chosen[block], m, pair_y)
            y[j] = pair_y[1]
            y[i] = pair_y[0]  # last, since i may be j
            # 3. multipliers F_c − (J_L y)_c of the lower bounds
            for c in cables:
                _subtract_product(J[c, i], y[i], left[c])
                if i != j:
                    _subtract_product(J[c, j], y[j], left[c])
                _check_optimality(left[c], F[b, c], high[b, c], optimal[b])

        # 3. balance, which rounding spoils where two cables of a block pull in nearly one direction
        for i in range(n):
            rest[0] = at.torque[b, i]
            size[:] = 0.0
            for c in range(C):
                if arm.pulls[c, i]:
                    _subtract_product(J[c, i], F[b, c], rest[0])
                    for w in lanes(size):
                        size[w] += np.abs(J[c, i, w] * F[b, c, w])
            for w in lanes(size):
                optimal[b, w] &= np.abs(rest[0, w]) <= _BALANCED * size[w]
