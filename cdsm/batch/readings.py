"""Readings of many K_θ by numpy: margin, compliance and Cartesian stiffness.

The formulas and thresholds are those of :mod:`cdsm.stiffness_matrix.value`.
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from cdsm.stiffness_matrix.value import FLAT, REGULAR, UNMOVED
from cdsm.support.status import Status
from cdsm.support.values import Array

INVERSE = ("along", "compliance", "cartesian")
"""Readings of K_θ⁻¹."""


def read(
    names: Collection[str], K: Array, parts: Array, jacobian: Array, directions: Array
) -> tuple[dict[str, Array], NDArray[np.uint8]]:
    """Compute readings of N postures, and their status; NaN where a reading does not exist.

    Args:
        names: Any of ``margin``, ``along``, ``compliance``, ``cartesian``, ``pseudoinverse``.
        K: K_θ (N, nv, nv).
        parts: Sum of the magnitudes of its terms (N, nv, nv).
        jacobian: J_X (N, 6, nv).
        directions: Unit vectors u (D, 3) of ``along``.
    """
    Jv = jacobian[:, :3]
    status = np.zeros(len(K), dtype=np.uint8)
    found: dict[str, Array] = {}
    if "margin" in names:
        found["margin"] = np.asarray(np.linalg.eigvalsh((K + _transposed(K)) / 2.0)[:, 0])
    if not {"cartesian", "pseudoinverse"}.isdisjoint(names):
        B, S, V = np.linalg.svd(Jv, full_matrices=False)
        still = S[:, -1] <= FLAT * S[:, 0] if S.shape[1] == 3 else np.ones(len(K), np.bool_)
        status[still] = Status.IMMOBILE
        with np.errstate(all="ignore"):
            A = B / S[:, None]
    if "pseudoinverse" in names:
        found["pseudoinverse"] = _between(A, V @ K @ _transposed(V), still)
    if not set(INVERSE).isdisjoint(names):
        inverse, singular = _inverse(K, parts)
        status[singular] = Status.SINGULAR
        if "along" in names:
            torque = directions @ Jv  # (N, D, nv)
            compliance = (torque @ inverse * torque).sum(axis=2)
            moves = abs(torque).max(axis=2) > UNMOVED * abs(Jv).max(axis=(1, 2))[:, None]
            with np.errstate(divide="ignore"):
                found["along"] = np.where(moves, 1.0 / compliance, np.inf)
            found["along"][singular] = np.nan
        if "compliance" in names:
            found["compliance"] = jacobian @ inverse @ _transposed(jacobian)
        if "cartesian" in names:
            held = ~(still | singular)
            inner = np.full((len(K), V.shape[1], V.shape[1]), np.nan)
            inner[held] = np.linalg.inv((V @ inverse @ _transposed(V))[held])
            found["cartesian"] = _between(A, inner, ~held)
    return found, status


def _inverse(K: Array, parts: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return K_θ⁻¹ and where it does not exist; there it is NaN."""
    D = np.diagonal(parts, axis1=1, axis2=2)
    with np.errstate(all="ignore"):
        scale = 1.0 / np.sqrt(D)
        both = scale[:, :, None] * scale[:, None]
        A = K * both
        least = REGULAR * (parts * both).max(axis=(1, 2))
        try:
            inverse = np.linalg.inv(A)
        except np.linalg.LinAlgError:  # at least one of them is singular to the last bit
            least_values = np.array([np.linalg.svd(each, compute_uv=False)[-1] for each in A])
            inverse = np.full_like(A, np.nan)
            inverse[least_values > least] = np.linalg.inv(A[least_values > least])
        # 1/|A⁻¹| is a lower bound of the smallest singular value of A
        singular = ~(least * np.sqrt((inverse**2).sum(axis=(1, 2))) < 1.0)
    regular = np.flatnonzero(singular & (D.min(axis=1) > 0.0))
    if regular.size:
        values = np.linalg.svd(A[regular], compute_uv=False)[:, -1]
        singular[regular] = ~(values > least[regular])
    inverse[singular] = np.nan
    return inverse * both, singular


def _between(A: Array, inner: Array, missing: NDArray[np.bool_]) -> Array:
    """Compute A K Aᵀ (N, 3, 3), NaN where it is missing or the tip has fewer than three joints."""
    if A.shape[2] < 3:
        return np.full((len(A), 3, 3), np.nan)
    found = A @ inner @ _transposed(A)
    found[missing] = np.nan
    return np.asarray(found)


def _transposed(a: Array) -> Array:
    return a.swapaxes(-1, -2)
