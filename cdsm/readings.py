"""What is read off K_θ at the tip, of one posture or of many: all arrays may have leading axes.

K_θ is (..., n, n), J_X is (..., 6, n), and J_v, its linear rows, is (..., 3, n). A reading that
does not exist is NaN, and a mask (...) says where: the caller raises an error or sets a status.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.support.values import Array

REGULAR = 1e-8  # least relative singular value of K_θ; its inverse has 6 correct digits there
FLAT = 1e-6  # least relative singular value of J_v; a 3×3 stiffness has 4 correct digits there
SLACK = 1e-9  # a cable is at 0 N if its tension is at most this part of the largest one
UNMOVED = 1e-10  # the tip cannot move along u if all entries of J_vᵀ u are below this part of J_v's
_ROUNDING = 1e-12  # a length changes if it does by more than this part of its summands
_EXCHANGES = 10  # exchanges of all cables at once, without progress, before one at a time

Mask = NDArray[np.bool_]


class TipMotions(NamedTuple):
    """Decomposition U J_v = B S V of the tip's motion in D directions U (D, 3).

    With A = B S⁻¹, (U C_vv Uᵀ)⁻¹ = A (V K_θ⁻¹ Vᵀ)⁻¹ Aᵀ, in which a stiff direction costs no digits.
    """

    A: Array  # B S⁻¹ (..., D, m), m = min(D, n); NaN where immobile
    V: Array  # orthonormal joint motions (..., m, n)
    immobile: Mask  # whether the tip hardly moves in some direction (...)


def margin(K: Array) -> Array:
    """Compute the smallest eigenvalue (...) of the symmetric part of K_θ."""
    return np.asarray(np.linalg.eigvalsh((K + _transposed(K)) / 2.0)[..., 0])


def least_real_part(K: Array) -> tuple[float, Array]:
    """Compute the smallest real part of the eigenvalues of K_θ (n, n), and its motion (n,).

    Where cables slide K_θ is not symmetric, and this decides if the arm comes back.
    """
    values, vectors = np.linalg.eig(K)
    k = int(values.real.argmin())
    motion = vectors[:, k].real
    return float(values[k].real), np.asarray(motion / (np.linalg.norm(motion) or 1.0))


def invert(K: Array, magnitudes: Array) -> tuple[Array, Mask]:
    """Compute K_θ⁻¹ (..., n, n), and where K_θ is singular (...).

    K_θ is singular if the smallest singular value of D^-½ K_θ D^-½ is at most REGULAR times the
    largest entry of D^-½ P D^-½. P (..., n, n) are the ``magnitudes`` of the terms, which may
    cancel; its diagonal D makes the test free of units.
    """
    both = _scale(magnitudes)
    scaled = K * both
    least = np.asarray(REGULAR * (magnitudes * both).max(axis=(-2, -1), initial=0.0))
    try:
        inverse = np.linalg.inv(scaled)
    except np.linalg.LinAlgError:  # at least one of them is singular to the last bit
        regular = _smallest_singular_value(scaled) > least
        inverse = np.full_like(scaled, np.nan)
        inverse[regular] = np.linalg.inv(scaled[regular])
    # 1/|A⁻¹| is a lower bound of the smallest singular value of A
    singular = np.asarray(~(least * np.sqrt((inverse**2).sum(axis=(-2, -1))) < 1.0))
    if singular.any():
        singular[singular] = ~(_smallest_singular_value(scaled[singular]) > least[singular])
        inverse[singular] = np.nan
    return inverse * both, singular


def singular_motion(K: Array, magnitudes: Array) -> Array:
    """Compute the unit joint motion (n,) that a singular K_θ (n, n) resists least."""
    both = _scale(magnitudes)
    motion = np.linalg.svd(K * both)[2][-1] * np.sqrt(both.diagonal())
    return np.asarray(motion / np.linalg.norm(motion))


def compliance(inverse: Array, jacobian: Array) -> Array:
    """Compute C = J_X K_θ⁻¹ J_Xᵀ (..., 6, 6)."""
    return np.asarray(jacobian @ inverse @ _transposed(jacobian))


def moves_tip(torque: Array, J_v: Array) -> Mask:
    """Return whether unit forces with joint torques J_vᵀ u (..., D, n) move any joint (..., D)."""
    largest = abs(J_v).max(axis=(-2, -1))[..., None]
    return np.asarray(abs(torque).max(axis=-1, initial=0.0) > UNMOVED * largest)


def along(inverse: Array, torque: Array, moves: Mask) -> tuple[Array, Array]:
    """Compute 1/(uᵀ C_vv u) (..., D) for D directions, inf where the tip cannot move.

    ``torque`` are the joint torques J_vᵀ u (..., D, n) of unit forces, ``moves`` is what
    :func:`moves_tip` says of them. The second result is the motion K_θ⁻¹ J_vᵀ u (..., D, n) of the
    joints per force.
    """
    motion = torque @ _transposed(inverse)
    softness = (motion * torque).sum(axis=-1)
    with np.errstate(divide="ignore"):
        return np.where(moves, 1.0 / softness, np.inf), motion


def slack_cables(tension: Array, cable_stiffness: Array) -> Mask:
    """Return which cables (..., C) are at 0 N and have a stiffness: they can only add tension."""
    largest = tension.max(axis=-1, keepdims=True, initial=0.0)
    return np.asarray((tension <= SLACK * largest) & (cable_stiffness > 0.0))


def remove_cables(K: Array, J_L: Array, cable_stiffness: Array) -> Array:
    """Compute K_θ − J_Lᵀ diag(k) J_L (..., n, n) for the stiffnesses k (..., C) of some cables."""
    return np.asarray(K - (_transposed(J_L) * cable_stiffness[..., None, :]) @ J_L)


def loose_cables(J_L: Array, slack: Mask, motion: Array) -> Mask:
    """Return which of the ``slack`` cables (..., C) a joint motion (..., n) does not stretch."""
    return np.asarray(slack & ((J_L @ motion[..., None])[..., 0] <= 0.0))


def one_sided_along(
    K: Array, magnitudes: Array, J_L: Array, slack: Array, torque: Array, moves: Mask
) -> tuple[Array, Array, Mask]:
    """Compute the stiffness (N, D) against forces along +u, where some cables are at 0 N.

    These cables resist only what makes them longer. With K_0, which is K_θ without their
    stiffnesses k, the motion x of the joints under the torque τ = J_vᵀ u solves

        K_0 x + Σ_c k_c max(J_c x, 0) J_c = τ,        along = 1/(τᵀ x).

    It is the least of ½ xᵀ K_0 x + ½ Σ_c k_c max(J_c x, 0)² − τᵀ x. With a moment in W, K_0 is not
    symmetric and the equation has no potential; with c = k max(J x, 0) it is the linear
    complementarity problem c ≥ 0, M c − J K_0⁻¹ τ ≥ 0 of M = diag(1/k) + J K_0⁻¹ Jᵀ. If the
    symmetric part of K_0 is positive definite, M is a P-matrix and the solution is unique. It is
    found by block pivoting (Júdice, Pires, Comput. Oper. Res. 21, 1994): cables that contradict
    what was assumed of them change sides, all at once or, if that does not help, one by one.

    Args:
        K: K_θ (N, n, n).
        magnitudes: Sum of the magnitudes of its terms (N, n, n).
        J_L: Jacobian of the cable lengths (N, C, n).
        slack: Stiffnesses k (N, C) of the cables at 0 N; 0 for all others.
        torque: Joint torques τ = J_vᵀ u (N, D, n) of unit forces.
        moves: What :func:`moves_tip` says of them (N, D).

    Returns:
        The stiffness (N, D), inf where the tip cannot move; the motion x (N, D, n) per force; and
        where K_0 is not positive definite (N): there both are NaN.
    """
    K_0 = remove_cables(K, J_L, slack)
    both = _scale(magnitudes)
    least = REGULAR * (magnitudes * both).max(axis=(-2, -1), initial=0.0)
    buckles = np.asarray(~(margin(K_0 * both) > least))
    motion = np.full(torque.shape, np.nan)
    pulls = np.zeros((*moves.shape, slack.shape[-1]), dtype=np.bool_)
    fewest = np.full(moves.shape, slack.shape[-1] + 1)
    patience = np.full(moves.shape, _EXCHANGES)
    rows, ways = np.nonzero(moves & ~buckles[:, None])
    while rows.size:
        J = J_L[rows]
        k = slack[rows]
        assumed = pulls[rows, ways]
        stiffness = remove_cables(K_0[rows], J, np.where(assumed, -k, 0.0))
        x = np.linalg.solve(stiffness, torque[rows, ways][..., None])
        change = (J @ x)[..., 0]
        counts = (k > 0.0) & (abs(change) > _ROUNDING * (abs(J) @ abs(x))[..., 0])
        wrong = counts & (assumed != (change > 0.0))
        motion[rows, ways] = x[..., 0]
        number = wrong.sum(axis=-1)
        better = number < fewest[rows, ways]
        fewest[rows, ways] = np.minimum(number, fewest[rows, ways])
        patience[rows, ways] = np.where(better, _EXCHANGES, patience[rows, ways] - 1)
        last = wrong & (np.cumsum(wrong, axis=-1) == number[:, None])
        single = patience[rows, ways] < 0
        pulls[rows, ways] ^= np.where(single[:, None], last, wrong)
        rows, ways = rows[number > 0], ways[number > 0]
    with np.errstate(divide="ignore"):
        along = 1.0 / (motion * torque).sum(axis=-1)
    along = np.where(moves, along, np.inf)
    motion[~moves] = 0.0
    along[buckles] = np.nan
    motion[buckles] = np.nan
    return along, motion, buckles


def tip_motions(J_v: Array, directions: Array | None = None) -> TipMotions:
    """Decompose the motion of the tip in D directions (D, 3), or in all: x, y and z."""
    rows = J_v if directions is None else directions @ J_v
    B, S, V = np.linalg.svd(rows, full_matrices=False)
    if S.shape[-1] < rows.shape[-2]:  # two joints cannot move the tip in three directions
        immobile = np.ones(S.shape[:-1], dtype=np.bool_)
    else:
        largest = S[..., 0] if directions is None else np.linalg.norm(J_v, 2, axis=(-2, -1))
        immobile = np.asarray(~(S[..., -1] > FLAT * largest))
    with np.errstate(divide="ignore", invalid="ignore"):
        A = B / S[..., None, :]
    A[immobile] = np.nan
    return TipMotions(A, V, immobile)


def immobile_direction(J_v: Array, directions: Array) -> Array:
    """Compute the unit direction (3,) within U (D, 3) in which the tip moves least."""
    return np.asarray(np.linalg.svd(directions @ J_v)[0][:, -1] @ directions)


def cartesian(inverse: Array, motions: TipMotions) -> Array:
    """Compute (U C_vv Uᵀ)⁻¹ (..., D, D); NaN where K_θ⁻¹ is, or where the tip is immobile."""
    A, V, _ = motions
    return np.asarray(A @ np.linalg.inv(V @ inverse @ _transposed(V)) @ _transposed(A))


def pseudoinverse(K: Array, motions: TipMotions) -> Array:
    """Compute J⁺ᵀ K J⁺ (..., 3, 3) with the pseudoinverse of J_v; NaN where the tip is immobile."""
    A, V, _ = motions
    return np.asarray(A @ (V @ K @ _transposed(V)) @ _transposed(A))


def _scale(magnitudes: Array) -> Array:
    """Compute (d dᵀ)^-½ (..., n, n) of the diagonal d of ``magnitudes``, with 1 in place of 0."""
    d = np.diagonal(magnitudes, axis1=-2, axis2=-1)
    scale = 1.0 / np.sqrt(np.where(d > 0.0, d, 1.0))
    return np.asarray(scale[..., :, None] * scale[..., None, :])


def _smallest_singular_value(matrix: Array) -> Array:
    return np.asarray(np.linalg.svd(matrix, compute_uv=False)[..., -1])


def _transposed(matrix: Array) -> Array:
    return matrix.swapaxes(-1, -2)
