"""The balance of an arm, solved for loads and for what is wrong with readings.

Unknown are the loads W, of which nothing is known before, and z = (δF of the load cells, s of the
holes, δq of the encoders), whose covariance P is known:

    T_j = (F_c + δF_c) exp(Σ s_i over the holes between the motor and segment j)
    Σ_j T_j g_j + g + springs − Σ_k J_kᵀ W_k = 0

With D = ∂(left side)/∂z, Σ = D P Dᵀ, A = [J_1ᵀ …] and τ, the left side without loads at z_0:

    W = (AᵀΣ⁻¹A)⁻¹AᵀΣ⁻¹ τ = E τ,   z = z_0 − P DᵀΣ⁻¹(τ − A W)

The equations are linear in W; Gauss–Newton steps solve them in z.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from cdsm.applied import Applied, without_cables
from cdsm.estimation.holes import Holes
from cdsm.posture import Posture
from cdsm.support.values import Array
from cdsm.terms import stiffness_of, torque_of

_STEPS = 8
_CONVERGED = 1e-10
_EXACT = 1e-6  # standard deviation of an equation that nothing changes, over the largest of others
_ZERO = 1e-8  # smaller singular values, over the largest, are rounding


class Instruments(NamedTuple):
    """Standard uncertainties of what is measured."""

    tension: Array  # of the load cells (C,) [N]
    angle: Array  # of the joint coordinates (nv,) [rad or m]


class LoadTorques(NamedTuple):
    """The m components of loads that are sought."""

    torque: Array  # A (nv, m): torque of each on the joints
    scale: Array  # of each (m,): 1 N, or the arm's length times 1 N m
    stiffness: Callable[[Array], Array]  # K_load (nv, nv) of loads W (m,)


class LoadBalance(NamedTuple):
    """Loads and tensions that balance the arm best."""

    loads: Array  # W (m,); of combinations that are not seen, the part that is 0
    gain: Array  # E (m, nv)
    seen: Array  # J (rank, m): the combinations J W that are seen are known within 1
    motions: Array  # right singular vectors (m, m) of components over their scale, best known first
    rank: int  # how many of them are seen
    by_tension: Array  # ∂τ/∂δF (nv, C)
    by_hole: Array  # ∂τ/∂s (nv, P)
    by_angle: Array  # ∂τ/∂δq (nv, nv)
    exact: float  # standard deviation of an equation that nothing changes
    tension: Array  # T (S,) [N]
    tension_covariance: Array  # (S, S) [N²]
    misfit: float  # χ² of what is left


def balance_loads(
    pose: Posture,
    motor_tension: Array,
    known: Applied,
    columns: LoadTorques,
    instruments: Instruments,
    holes: Holes,
    rows: NDArray[np.bool_],
) -> LoadBalance:
    """Solve the balance of the joints ``rows`` (nv,) under ``known`` loads and those sought."""
    segments = pose.segments
    cable = segments.chains.cable
    C = motor_tension.size
    P = holes.mean.size
    behind = segments.chains.behind
    terms = without_cables(pose, known)
    own_torque = torque_of(terms, pose)
    own_stiffness = stiffness_of(terms, pose)
    G = segments.length_jacobian
    start = np.concatenate([np.zeros(C), holes.mean, np.zeros(pose.q.size)])
    cov = np.zeros((start.size, start.size))
    cov[:C, :C] = np.diag(instruments.tension**2)
    cov[C : C + P, C : C + P] = holes.covariance
    cov[C + P :, C + P :] = np.diag(instruments.angle**2)
    A = columns.torque[rows]
    z = start
    W = np.zeros(A.shape[1])
    one = np.eye(C)[cable]
    for _ in range(_STEPS):
        growth = np.exp(behind @ z[C : C + P])
        T = (motor_tension + z[:C])[cable] * growth
        by_z = np.hstack([one * growth[:, None], T[:, None] * behind])
        K = segments.active(np.maximum(T, 0.0)) + own_stiffness + columns.stiffness(W)
        whole = np.hstack([G.T @ by_z, K])
        D = whole[rows]
        tau = (T @ G + own_torque + K @ z[C + P :])[rows] + D @ (start - z)
        spread = D @ cov @ D.T
        exact = _EXACT * float(np.sqrt(np.diag(spread).max(initial=0.0)))
        L = np.linalg.cholesky(spread + exact**2 * np.eye(len(D)))
        white = solve_triangular(L, A * columns.scale, lower=True)
        right = solve_triangular(L, tau, lower=True)
        u, size, vt = np.linalg.svd(white, full_matrices=True)
        rank = _rank(L, size, vt, columns, instruments.angle, rows)
        u, size = u[:, :rank], size[:rank]
        inverse = columns.scale[:, None] * vt[:rank].T / size @ u.T
        before = W
        W = inverse @ right
        left = right - u @ (u.T @ right)
        new = start - cov @ (D.T @ solve_triangular(L, left, lower=True, trans="T"))
        # the weights depend on W, too: errors of angles turn its levers
        change = max(abs(new - z).max(initial=0.0), abs(W - before).max(initial=0.0))
        done = change < _CONVERGED * (1.0 + abs(W).max(initial=0.0))
        z = new
        if done:
            break
    # of z after the balance: P − Hᵀ (1 − U Uᵀ) H with H = L⁻¹ D P
    H = solve_triangular(L, D @ cov, lower=True)
    H -= u @ (u.T @ H)
    part = slice(0, C + P)
    after = cov[part, part] - H[:, part].T @ H[:, part]
    gain = np.zeros((W.size, pose.q.size))
    gain[:, rows] = solve_triangular(L, inverse.T, lower=True, trans="T").T
    return LoadBalance(
        loads=W,
        gain=gain,
        seen=size[:, None] * vt[:rank] / columns.scale,
        motions=vt,
        rank=rank,
        by_tension=whole[:, :C],
        by_hole=whole[:, C : C + P],
        by_angle=whole[:, C + P :],
        exact=exact,
        tension=np.maximum(T, 0.0),
        tension_covariance=by_z @ after @ by_z.T,
        misfit=float(left @ left),
    )


def _rank(
    L: Array,
    size: Array,
    vt: Array,
    columns: LoadTorques,
    angle: Array,
    rows: NDArray[np.bool_],
) -> int:
    """Return how many combinations are seen.

    Of one that is not, the torque is rounding, or the errors of the angles change it by more.
    """
    for i, (strength, motion) in enumerate(zip(size, vt, strict=False)):
        change = columns.stiffness(columns.scale * motion)[rows] * angle
        noise = np.linalg.norm(solve_triangular(L, change, lower=True))
        if strength <= max(_ZERO * size[0], float(noise)):
            return i
    return size.size
