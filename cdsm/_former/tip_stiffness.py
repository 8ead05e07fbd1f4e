"""Numba kernels of compliance, Cartesian stiffness and pseudo-inverse at the tip.

Arrays hold B blocks of W postures. With the linear rows J_v of J_X, and C = J_X K_θ⁻¹ J_Xᵀ with its
linear part C_vv,

    compliance = C,    cartesian = (C_vv)⁻¹,    pseudoinverse = J_v⁺ᵀ K_θ J_v⁺.

Where the tip can hardly move in some direction, C_vv is too ill-conditioned for inversion. With the
singular value decomposition J_v = U S V and O = U S⁻¹,

    cartesian = O (V K_θ⁻¹ Vᵀ)⁻¹ Oᵀ,    pseudoinverse = O (V K_θ Vᵀ) Oᵀ.
"""

from __future__ import annotations

import math

import numpy as np

from cdsm._former.compiling import Index, Width, inner, lanes, threaded, upwards
from cdsm._former.linear_algebra import eliminate
from cdsm._former.readings import FLAT, IMMOBILE, READ, SINGULAR
from cdsm._former.records import copy
from cdsm._former.singular_values import singular_values
from cdsm._former.tree import Indices
from cdsm.support.values import Array


@threaded
def decompose(JX: Array, left: Array, right: Array, status: Indices, width: Width) -> None:
    """Decompose J_v = U S V (singular values S); fill ``left`` with O = U S⁻¹ and ``right`` with V.

    ``left`` is (B, 3, 3, W) and ``right`` (B, 3, nv, W). JX is J_X (B, 6, nv, W), and J_v its first
    three rows. Where the tip is immobile, the status (B, W) changes from READ to IMMOBILE.
    """
    scratch, S = np.empty((5, JX.shape[3])), np.empty((3, JX.shape[3]))
    for b in range(JX.shape[0]):
        copy(JX[b], right[b], width)
        singular_values(right[b], left[b], S, scratch, width)
        factor, state = left[b], status[b]
        for w in lanes(width):
            smallest = min(S[0, w], S[1, w], S[2, w])
            if state[w] == READ and not smallest > FLAT * max(S[0, w], S[1, w], S[2, w]):
                state[w] = IMMOBILE
        for i in upwards(0, factor.shape[0]):
            for a in upwards(0, factor.shape[0]):
                for w in lanes(width):
                    factor[i, a, w] /= S[a, w]


@threaded
def set_pseudoinverses(
    K: Array, left: Array, right: Array, status: Indices, out: Array, width: Width
) -> None:
    """Fill ``out`` (B, 3, 3, W) with J_v⁺ᵀ K J_v⁺ = O (V K Vᵀ) Oᵀ; NaN where the tip is immobile.

    ``left`` is O and ``right`` is V of :func:`decompose`.
    """
    image, middle = np.empty((K.shape[1], 3, K.shape[3])), np.empty((3, 3, K.shape[3]))
    for b in range(K.shape[0]):
        _set_product(K[b], right[b], image, width)
        _project(right[b], image, np.intp(0), middle, width)
        _congruence(left[b], middle, np.intp(0), status[b], out[b], width)


@inner
def _set_product(K: Array, right: Array, image: Array, width: Width) -> None:
    """Fill image (nv, 3, W) with K Vᵀ; ``right`` is V (3, nv, W)."""
    for i in upwards(0, K.shape[0]):
        for c in upwards(0, right.shape[0]):
            for w in lanes(width):
                image[i, c, w] = 0.0
            for j in upwards(0, K.shape[0]):
                for w in lanes(width):
                    image[i, c, w] += K[i, j, w] * right[c, j, w]


@threaded
def set_compliances(JX: Array, system: Array, first: int, out: Array, width: Width) -> None:
    """Fill ``out`` (B, 6, 6, W) with the compliance J_X K_θ⁻¹ J_Xᵀ.

    The six columns of ``system`` from ``first`` on are K_θ⁻¹ J_Xᵀ.
    """
    for b in range(JX.shape[0]):
        _project(JX[b], system[b], first, out[b], width)


@threaded
def set_cartesians(
    left: Array, right: Array, system: Array, status: Indices, out: Array, width: Width
) -> None:
    """Fill ``out`` (B, 3, 3, W) with (C_vv)⁻¹ = O (V K_θ⁻¹ Vᵀ)⁻¹ Oᵀ; NaN if the tip is immobile.

    ``left`` is O and ``right`` is V of :func:`decompose`. K_θ⁻¹ Vᵀ are the last three columns of
    the system. Where V K_θ⁻¹ Vᵀ is singular, the ``status`` (B, W) becomes SINGULAR.
    """
    both, pivots = np.empty((3, 6, right.shape[3])), np.empty((4, right.shape[3]))
    for b in range(right.shape[0]):
        _project(right[b], system[b], system.shape[2] - 3, both, width)
        _set_unit(both, width)
        eliminate(both, pivots, width)
        for w in lanes(width):
            if pivots[0, w] == 0.0 and status[b, w] == READ:
                status[b, w] = SINGULAR
        _congruence(left[b], both, np.intp(3), status[b], out[b], width)


@inner
def _set_unit(both: Array, width: Width) -> None:
    """Fill the right half of ``both`` (n, 2 n, W) with the identity matrix."""
    n = np.uint64(both.shape[0])
    for a in upwards(0, n):
        for c in upwards(0, n):
            for w in lanes(width):
                both[a, n + c, w] = 1.0 if a == c else 0.0


@inner
def _project(A: Array, B: Array, first: Index, out: Array, width: Width) -> None:
    """Fill out (m, m, W) with A (m, nv, W) times the m columns of B from ``first`` on."""
    m = A.shape[0]
    for a in upwards(0, m):
        for c in upwards(0, m):
            column = np.uint64(first) + c
            for w in lanes(width):
                out[a, c, w] = 0.0
            for i in upwards(0, A.shape[1]):
                for w in lanes(width):
                    out[a, c, w] += A[a, i, w] * B[i, column, w]


@inner
def _congruence(
    factor: Array, middle: Array, first: Index, status: Indices, out: Array, width: Width
) -> None:
    """Fill out (3, 3, W) with O X Oᵀ, or NaN where the tip is immobile.

    O is ``factor`` (3, 3, W); X (3, 3, W) are the three columns of ``middle`` from ``first`` on.
    """
    for i in upwards(0, factor.shape[0]):
        for j in upwards(0, factor.shape[0]):
            for w in lanes(width):
                out[i, j, w] = math.nan if status[w] == IMMOBILE else 0.0
            for k in upwards(0, factor.shape[0]):
                for m in upwards(0, factor.shape[0]):
                    for w in lanes(width):
                        out[i, j, w] += (
                            factor[i, k, w] * middle[k, np.uint64(first) + m, w] * factor[j, m, w]
                        )
