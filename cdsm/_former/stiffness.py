"""Numba kernels of the terms of K_θ (Eq. 16), for blocks of W postures (last axis)."""

from __future__ import annotations

import numpy as np

from cdsm._former.compiling import Index, Width, compiled, inner, lanes, upwards
from cdsm._former.records import mirror
from cdsm._former.segments import add_length_hessian, segment_scratch
from cdsm._former.tree import Indices, one_frames
from cdsm.support.values import Array

_Rows = tuple[Array, Array, Array]


@inner
def set_cable_stiffness(
    length: Array,
    tension: Array,
    rigidity: Array,
    series: Array,
    rest: Array,
    stiffness: Array,
    width: Width,
) -> None:
    """Fill ``stiffness`` (C, W) [N/m] with k = 1/(l_0/EA + 1/k_series).

    ``length`` is L [m], ``tension`` F [N] and ``rigidity`` EA (1 + ε) [N], (C, W) each. ``series``
    is 1/k_series (C,) [m/N], and ``rest`` is F_0 (C,) [N], the tension at which the series spring
    is unstrained. The spring is longer by (F − F_0)/k_series, and the wire has the rest of L, the
    length ℓ. So l_0/EA is ℓ/(EA (1 + ε)). If the motor controls the force, EA is given as 0, and k
    becomes 0.
    """
    for c in upwards(0, length.shape[0]):
        for w in lanes(width):
            wire = length[c, w] - series[c] * (tension[c, w] - rest[c])
            k = 1.0 / (wire / rigidity[c, w] + series[c])
            stiffness[c, w] = k if rigidity[c, w] > 0.0 else 0.0


@inner
def add_passive_stiffness(
    length_jacobian: Array, cable_stiffness: Array, passive: Array, scratch: Array, width: Width
) -> None:
    """Add J_Lᵀ K_L J_L to the entries i ≤ j of ``passive`` (nv, nv, W).

    It adds three cables to two rows of the matrix at a time, which needs fewer memory accesses.
    ``scratch`` is (6, W).
    """
    J, k = length_jacobian, cable_stiffness
    count, nv, one = np.uint64(J.shape[0]), np.uint64(J.shape[1]), np.uint64(1)
    for first in range(0, J.shape[0], 3):
        c = np.uint64(first)
        d, e = min(c + one, count - one), min(c + one + one, count - one)
        end = nv  # joints behind the end of a cable do not change its length
        while end > 0 and not _moves(J, c, d, e, end - one, width):
            end -= one
        for m in range(0, np.intp(end), 2):
            i, next_row = np.uint64(m), min(np.uint64(m) + one, end - one)
            for r, row in ((0, i), (3, next_row)):
                for w in lanes(width):
                    scratch[r, w] = k[c, w] * J[c, row, w]
                    scratch[r + 1, w] = k[d, w] * J[d, row, w] if d > c else 0.0
                    scratch[r + 2, w] = k[e, w] * J[e, row, w] if e > d else 0.0
            for w in lanes(width):
                passive[i, i, w] += (
                    scratch[0, w] * J[c, i, w]
                    + scratch[1, w] * J[d, i, w]
                    + scratch[2, w] * J[e, i, w]
                )
            if i < next_row:
                rows = J[c], J[d], J[e]
                _add_rows(scratch, rows, next_row, end, passive[i], passive[next_row], width)


@inner
def _add_rows(
    p: Array, rows: _Rows, first: Index, end: Index, upper: Array, lower: Array, width: Width
) -> None:
    """Add p₀ x + p₁ y + p₂ z to ``upper``, and p₃ x + p₄ y + p₅ z to ``lower``, both (nv, W).

    These are two rows of the passive stiffness. ``rows`` are the rows x, y and z (nv, W) of J_L of
    three cables, and p is (6, W). Only the entries ``first`` to ``end`` − 1 change.
    """
    x, y, z = rows
    for j in upwards(first, end):
        for w in lanes(width):
            upper[j, w] += p[0, w] * x[j, w] + p[1, w] * y[j, w] + p[2, w] * z[j, w]
            lower[j, w] += p[3, w] * x[j, w] + p[4, w] * y[j, w] + p[5, w] * z[j, w]


@inner
def _moves(J: Array, c: Index, d: Index, e: Index, i: Index, width: Width) -> bool:
    """Check whether joint i changes the length of cable c, d or e at some posture of the block."""
    moved = 0.0
    for w in lanes(width):
        moved = max(moved, abs(J[c, i, w]) + abs(J[d, i, w]) + abs(J[e, i, w]))
    return moved > 0.0


@inner
def set_load_stiffness(
    jacobian: Array, wrench: Array, tip_joints: Indices, load: Array, scratch: Array, width: Width
) -> None:
    """Fill ``load`` (nv, nv, W) with −∂(J_Xᵀ w)/∂θ for constant wrenches w = ``wrench`` (6, W).

    Its rows are torques, its columns angles.

    Column i of J_X has the linear part v_i and the angular part z_i. ∂v_i/∂θ_j = z_a × v_b, where a
    is the earlier and b the later of the joints i and j. ∂z_i/∂θ_j = z_j × z_i if joint j is before
    joint i, else 0. ``tip_joints`` are the joints that move the tip, from the base on. Entries of
    other joints do not change. ``scratch`` is (6, W).
    """
    J = jacobian
    for s in upwards(0, tip_joints.shape[0]):
        a = np.uint64(tip_joints[s])
        for r in range(6):  # f × z, then m × z
            first, p, q = r - r % 3, (r + 1) % 3, (r + 2) % 3
            for w in lanes(width):
                scratch[r, w] = (
                    wrench[first + p, w] * J[3 + q, a, w] - wrench[first + q, w] * J[3 + p, a, w]
                )
        for t in upwards(s, tip_joints.shape[0]):
            b = np.uint64(tip_joints[t])
            for w in lanes(width):  # f·(z × v) = (f × z)·v
                load[a, b, w] = -(
                    scratch[0, w] * J[0, b, w]
                    + scratch[1, w] * J[1, b, w]
                    + scratch[2, w] * J[2, b, w]
                )
            if t > s:
                for w in lanes(width):  # m·(z × z_b) = (m × z)·z_b
                    load[b, a, w] = load[a, b, w] - (
                        scratch[3, w] * J[3, b, w]
                        + scratch[4, w] * J[4, b, w]
                        + scratch[5, w] * J[5, b, w]
                    )


@inner
def sum_terms(
    active: Array,
    passive: Array,
    gravity: Array,
    load: Array,
    K: Array,
    parts: Array,
    width: Width,
) -> None:
    """Fill ``K`` with K_θ, and ``parts`` with |active| + |passive| + |gravity| + |load|.

    All arrays are (nv, nv, W), but an empty ``parts`` is not filled. Of the terms, only the entries
    with i ≤ j are read, except for ``load``, which is not symmetric.
    """
    for i in upwards(0, K.shape[0]):
        for j in upwards(0, K.shape[0]):
            a, b = min(i, j), max(i, j)
            for w in lanes(width):
                K[i, j, w] = active[a, b, w] + passive[a, b, w] + gravity[a, b, w] + load[i, j, w]
            if parts.shape[0]:
                for w in lanes(width):
                    own = abs(active[a, b, w]) + abs(passive[a, b, w]) + abs(gravity[a, b, w])
                    parts[i, j, w] = own + abs(load[i, j, w])


@compiled
def single_stiffness(
    segment: Indices,
    joint: Indices,
    origin: Array,
    axis: Array,
    slide: Array,
    site: Array,
    jacobian: Array,
    length_jacobian: Array,
    gravity: Array,
    tension: Array,
    cable_stiffness: Array,
    wrench: Array,
    tip_joints: Indices,
) -> Array:
    """Compute five matrices of one posture (5, nv, nv): active, passive and load term, P, and K_θ.

    ``gravity`` (nv, nv) is the gravity term. P is |active| + |passive| + |gravity| + |load|, entry
    by entry: the scale of the rounding errors of K_θ. ``segment`` and ``joint`` are fields of
    :class:`Routing`, the next four arguments are the fields of :class:`Frames`. No array has an
    axis of postures.
    """
    count, nv = length_jacobian.shape
    J, JX = length_jacobian.reshape(count, nv, 1), jacobian.reshape(6, nv, 1)
    F, k = tension.reshape(count, 1), cable_stiffness.reshape(count, 1)
    terms = np.zeros((5, nv, nv, 1))
    active, passive, load, G = terms[0], terms[1], terms[2], gravity.reshape(nv, nv, 1)
    frames, slot = one_frames(origin, axis, slide, site), np.zeros(count, dtype=np.intp)
    add_length_hessian(segment, joint, frames, F, slot, segment_scratch(nv, 1), terms[:1], None)
    mirror(active, None)
    add_passive_stiffness(J, k, passive, np.empty((6, 1)), None)
    mirror(passive, None)
    set_load_stiffness(JX, wrench.reshape(6, 1), tip_joints, load, np.empty((6, 1)), None)
    sum_terms(active, passive, G, load, terms[4], terms[3], None)
    return terms.reshape(5, nv, nv)


@compiled
def single_cable_stiffness(
    length: Array, tension: Array, rigidity: Array, linear: Array, series: Array, rest: Array
) -> Array:
    """Compute the stiffness k of each cable (C,) [N/m]; see :func:`set_cable_stiffness`.

    EA (1 + ε) is ``rigidity`` where ``linear`` (C,) is 0. Where it is 1, the law is linear,
    ``rigidity`` is EA, and EA (1 + ε) = EA + F. No array has an axis of postures.
    """
    count = length.shape[0]
    stretched, stiffness = np.empty((count, 1)), np.empty((count, 1))
    for c in range(count):
        stretched[c, 0] = rigidity[c] + linear[c] * tension[c]
    L, F = length.reshape(count, 1), tension.reshape(count, 1)
    set_cable_stiffness(L, F, stretched, series, rest, stiffness, None)
    return stiffness.reshape(count)
