"""Numba kernels of the searches for tensions: K_θ, the tip stiffness, and their derivatives.

In numpy a plan would take 1.4 times as long (5 joints).

Shapes: C cables, nv joint angles, r rows of the tip Jacobian, n constraints. J_c and H_c are the
gradient (row c of ``length_jacobian``) and the Hessian (entry c of ``hessian``) of the length of
cable c. k_c is its stiffness (``springs``), k′_c = dk_c/dF_c (``slope``) and k″_c = d²k_c/dF_c²
(``bend``). So ∂K_θ/∂F_c = H_c + k′_c J_c J_cᵀ.
"""

from __future__ import annotations

import numpy as np

from cdsm._former.compiling import compiled
from cdsm._former.linear_algebra import eliminate
from cdsm.support.values import Array

_CURVATURE = 1e-6  # curvatures below this part of the largest are raised to it


@compiled
def stiffness_at(
    constant: Array, hessian: Array, length_jacobian: Array, tension: Array, springs: Array
) -> tuple[Array, Array, Array]:
    """Return K_θ = constant + Σ_c (F_c H_c + k_c J_c J_cᵀ), its eigenvalues and its eigenvectors.

    H_c (``hessian``, (C, nv, nv)) and J_c (``length_jacobian``, (C, nv)) are the Hessian and the
    gradient of the length of cable c, F_c (``tension``, (C,)) [N] its tension, and k_c
    (``springs``, (C,)) [N/m] its stiffness. ``constant`` (nv, nv) is the sum of the terms of
    gravity and load. The eigenvalues and eigenvectors are those of the symmetric part of K_θ.
    """
    K = constant.copy()
    count, nv = length_jacobian.shape
    for c in range(count):
        for i in range(nv):
            force = springs[c] * length_jacobian[c, i]
            for j in range(nv):
                K[i, j] += tension[c] * hessian[c, i, j] + force * length_jacobian[c, j]
    values, vectors = np.linalg.eigh((K + K.T) / 2.0)
    return K, values, np.ascontiguousarray(vectors)


@compiled
def _inverse(A: Array) -> Array:
    """Return A⁻¹; unlike ``np.linalg.inv``, it has the same bits in numba and in plain Python."""
    n = len(A)
    M = np.zeros((n, 2 * n, 1))
    for i in range(n):
        M[i, n + i, 0] = 1.0
        for j in range(n):
            M[i, j, 0] = A[i, j]
    eliminate(M, np.empty((4, 1)), None)
    return np.ascontiguousarray(M[:, n:, 0])


@compiled
def tip_stiffness(K: Array, rows: Array) -> tuple[Array, Array, Array, Array]:
    """Return the tip stiffness X, the matrices right and left, and K_θ⁻¹.

    X = (R K_θ⁻¹ Rᵀ)⁻¹ (r, r) with ``rows`` R (r, nv) of the tip Jacobian. right = K_θ⁻¹ Rᵀ X (nv,
    r) is the joint motion per unit motion of the tip, and left = K_θ⁻ᵀ Rᵀ Xᵀ (nv, r). A change ∂K_θ
    changes X by leftᵀ ∂K_θ right.
    """
    inverse = _inverse(K)
    soft = np.dot(inverse, rows.T)
    X = _inverse(np.dot(rows, soft))
    right: Array = np.dot(soft, X)
    left: Array = np.dot(np.ascontiguousarray(np.dot(rows, inverse).T), np.ascontiguousarray(X.T))
    return X, right, left, inverse


@compiled
def _torques_by_tension(
    hessian: Array, length_jacobian: Array, slope: Array, motion: Array
) -> Array:
    """Return (∂K_θ/∂F_c) m (C, nv, b) for joint motions m, the columns of ``motion`` (nv, b).

    ∂K_θ/∂F_c = H_c + k′_c J_c J_cᵀ, with the Hessian H_c and the gradient J_c of the length of
    cable c, and ``slope`` k′ = dk/dF (C,) [1/m] of the cable stiffnesses.
    """
    count, nv = length_jacobian.shape
    columns = motion.shape[1]
    result = np.zeros((count, nv, columns))
    for c in range(count):
        for b in range(columns):
            stretch = 0.0
            for j in range(nv):
                stretch += length_jacobian[c, j] * motion[j, b]
            stretch *= slope[c]
            for i in range(nv):
                total = stretch * length_jacobian[c, i]
                for j in range(nv):
                    total += hessian[c, i, j] * motion[j, b]
                result[c, i, b] = total
    return result


@compiled
def form_by_tension(
    hessian: Array, length_jacobian: Array, slope: Array, left: Array, right: Array
) -> Array:
    """Return leftᵀ (∂K_θ/∂F_c) right (C, a, b) for ``left`` (nv, a) and ``right`` (nv, b).

    ∂K_θ/∂F_c = H_c + k′_c J_c J_cᵀ, with the Hessian H_c and the gradient J_c of the length of
    cable c, and ``slope`` k′ = dk/dF (C,) [1/m] of the cable stiffnesses.
    """
    torques = _torques_by_tension(hessian, length_jacobian, slope, right)
    count, nv, columns = torques.shape
    result = np.zeros((count, left.shape[1], columns))
    for c in range(count):
        for a in range(left.shape[1]):
            for b in range(columns):
                for i in range(nv):
                    result[c, a, b] += left[i, a] * torques[c, i, b]
    return result


@compiled
def constraint_jacobian(
    hessian: Array, length_jacobian: Array, slope: Array, weights: Array, left: Array, right: Array
) -> Array:
    """Return the derivatives (n, C) of n constraints with respect to the tensions.

    Constraint j is Σ_ab E_j,ab X_ab, with ``weights`` E (n, r, r) and the tip stiffness X (r, r).
    So its derivative is Σ_ab E_j,ab (leftᵀ (∂K_θ/∂F_c) right)_ab, with ``left`` and ``right`` (nv,
    r) from :func:`tip_stiffness`.
    """
    rates = form_by_tension(hessian, length_jacobian, slope, left, right)
    result = np.zeros((weights.shape[0], rates.shape[0]))
    for n in range(weights.shape[0]):
        for c in range(rates.shape[0]):
            for a in range(rates.shape[1]):
                for b in range(rates.shape[2]):
                    result[n, c] += weights[n, a, b] * rates[c, a, b]
    return result


@compiled
def constraint_hessian(
    hessian: Array,
    length_jacobian: Array,
    slope: Array,
    bend: Array,
    Y: Array,
    inverse: Array,
    rows: Array,
    left: Array,
    right: Array,
) -> Array:
    """Return ∂²(Σ_ij Y_ij X_ij)/∂F² (C, C) for weights Y (r, r) and the tip stiffness X (r, r).

    ``slope`` and ``bend`` (C,) are the first and second derivative of the cable stiffnesses with
    respect to the tension. ``left``, ``right`` and ``inverse`` come from :func:`tip_stiffness` with
    the same ``rows``.
    """
    left_torques = _torques_by_tension(hessian, length_jacobian, slope, left)
    right_torques = _torques_by_tension(hessian, length_jacobian, slope, right)
    count, nv, r = right_torques.shape
    projected = inverse - np.dot(right, np.dot(rows, inverse))
    one = np.zeros((count, nv, r))
    other = np.zeros((count, nv, r))
    for c in range(count):
        for i in range(nv):
            for b in range(r):
                for a in range(r):
                    one[c, i, b] += left_torques[c, i, a] * Y[a, b]
                for j in range(nv):
                    other[c, i, b] += projected[i, j] * right_torques[c, j, b]
    half = np.dot(one.reshape(count, nv * r), other.reshape(count, nv * r).T)
    result: Array = -(half + half.T)
    for c in range(count):
        for a in range(r):
            for b in range(r):
                left_stretch = right_stretch = 0.0
                for i in range(nv):
                    left_stretch += length_jacobian[c, i] * left[i, a]
                    right_stretch += length_jacobian[c, i] * right[i, b]
                result[c, c] += bend[c] * Y[a, b] * left_stretch * right_stretch
    return result


@compiled
def convex(W: Array, null: Array, normals: Array) -> Array:
    """Return a positive definite matrix (C, C) that replaces the Hessian ``W`` (C, C) in a QP.

    On admissible steps w, wᵀ W w stays the same, except that small and negative curvatures are
    raised. All other steps get a positive curvature. Admissible steps keep the balance, so they are
    combinations of the orthonormal columns of ``null`` (C, p). To first order, they also keep the
    constraints with the gradients ``normals`` (n, C).
    """
    count, p = null.shape
    inner = np.dot(np.ascontiguousarray(null.T), np.dot(W, null))
    fixed = np.zeros((p, p))
    if normals.shape[0] > 0 and p > 0:
        normal = np.ascontiguousarray(
            np.linalg.qr(np.ascontiguousarray(np.dot(normals, null).T))[0]
        )
        fixed = np.dot(normal, normal.T)
        free = np.eye(p) - fixed
        inner = np.dot(free, np.dot(inner, free))
    largest = 1.0
    if p > 0:
        values, vectors = np.linalg.eigh(inner)
        largest = max(abs(values[0]), abs(values[p - 1]))
        if largest == 0.0:
            largest = 1.0
        vectors = np.ascontiguousarray(vectors)
        raised = vectors * np.maximum(values, _CURVATURE * largest)
        inner = np.dot(raised, np.ascontiguousarray(vectors.T)) + largest * fixed
    # steps that break the balance only need some positive curvature
    for i in range(p):
        inner[i, i] -= largest
    result: Array = np.dot(null, np.dot(inner, np.ascontiguousarray(null.T)))
    for c in range(count):
        result[c, c] += largest
    return result
