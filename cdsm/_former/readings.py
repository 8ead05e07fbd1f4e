"""Numba kernels of readings of K_θ: stability margin, compliance and Cartesian stiffness.

The arrays hold B blocks of W postures: the first axis is the block, the last one the posture in it.
A single posture is a block of one, with the width None. :mod:`cdsm._former.read` calls these
kernels. Each kernel is compiled when it is first needed.

With the linear rows J_v of J_X, and C_vv = J_v K_θ⁻¹ J_vᵀ,

    margin = λ_min((K_θ + K_θᵀ)/2),    along(u) = 1/(uᵀ C_vv u).

:mod:`cdsm._former.tip_stiffness` computes the other readings.

The four terms of K_θ may cancel. K_θ is therefore compared with P, the sum of their magnitudes, and
scaled by the diagonal D of P. K_θ is singular if the smallest singular value of D^-½ K_θ D^-½ is
below REGULAR times the largest entry of D^-½ P D^-½.
"""

from __future__ import annotations

import math

import numpy as np

from cdsm._former.compiling import Index, Width, inner, lanes, threaded, upwards
from cdsm._former.linear_algebra import eliminate, smallest_eigenvalue
from cdsm._former.tree import Indices
from cdsm.support.values import Array

REGULAR = 1e-8
"""Smallest relative singular value of K_θ at which its inverse still has 6 correct digits."""

FLAT = 1e-6
"""Smallest ratio of the singular values of J_v at which a 3×3 stiffness still has 4 correct digits.

The entries of such a stiffness differ by the square of the ratio, and float64 has 16 digits.
"""

UNMOVED = 1e-10
"""Entries of J_vᵀ u below this fraction of the largest entry of J_v are rounding.

The tip cannot move along u if all entries are.
"""

_DOUBT = 1e5
"""Scaled motion under a probing torque above which the singular values are computed.

The motion is at most the torque divided by the smallest singular value, and usually a few tenths of
that. 1e5 is orders of magnitude below the inverse of :data:`REGULAR`.
"""

READ, SINGULAR, IMMOBILE, UNREAD = range(4)
"""Status of the readings of a posture.

READ: all exist. SINGULAR: K_θ⁻¹ does not exist. IMMOBILE: J_v⁺ does not exist. UNREAD: K_θ is not
known.
"""


@threaded
def set_margins(K: Array, margin: Array, width: Width) -> None:
    """Fill ``margin`` (B, W) with the smallest eigenvalues of the symmetric parts of K.

    K is (B, nv, nv, W).
    """
    nv, side = K.shape[1], K.shape[3]
    symmetric, scratch = np.empty((nv, nv, side)), np.empty((4 * nv + 10, side))
    for b in range(K.shape[0]):
        _set_symmetric(K[b], symmetric, width)
        smallest_eigenvalue(symmetric, scratch, margin[b], width)


@inner
def _set_symmetric(K: Array, symmetric: Array, width: Width) -> None:
    """Fill ``symmetric`` (nv, nv, W) with the symmetric part of K."""
    for i in upwards(0, K.shape[0]):
        for j in upwards(0, K.shape[0]):
            for w in lanes(width):
                symmetric[i, j, w] = (K[i, j, w] + K[j, i, w]) / 2.0


@threaded
def solve(
    K: Array, parts: Array, system: Array, status: Indices, scale: Array, peak: Array, width: Width
) -> int:
    """Replace the last n columns X of ``system`` by K_θ⁻¹ X; count the K_θ that may be singular.

    ``system`` (B, nv, nv + 1 + n, W) has nv columns of scratch for K_θ, one column of scratch for a
    probe torque, and X. ``K`` is K_θ, and ``parts`` is P, the sum of the magnitudes of its terms,
    (B, nv, nv, W) each. With the diagonal D of P, ``scale`` (B, nv, W) is filled with D^-½, and
    ``peak`` (B, W) with the largest entry of D^-½ P D^-½ where K_θ may be singular, else with 0.
    Returns the number of postures where it may be.
    """
    rows, largest, doubtful = np.empty((4, K.shape[3])), np.empty(K.shape[3]), 0
    moved = np.empty(K.shape[3])
    for b in range(K.shape[0]):
        _set_probe(system[b], width)
        _equilibrate(K[b], parts[b], scale[b], largest, system[b], width)
        eliminate(system[b], rows, width)
        _rescale(scale[b], system[b], moved, width)
        for w in lanes(width):
            certain = moved[w] * largest[w] < _DOUBT and rows[0, w] > 0.0
            peak[b, w] = 0.0 if certain or status[b, w] == UNREAD else largest[w]
            doubtful += 1 if peak[b, w] > 0.0 else 0
    return doubtful


@inner
def _set_probe(system: Array, width: Width) -> None:
    """Fill column nv of ``system`` with a probe torque, the same for all postures.

    A large joint motion under it reveals a K_θ that may be singular. Its entries vary irregularly
    from 1 to 2, so it excites almost every motion.
    """
    nv = np.uint64(system.shape[0])
    for i in upwards(0, nv):
        probe = 1.0 + (0.6180339887498949 * np.intp(i)) % 1.0
        for w in lanes(width):
            system[i, nv, w] = probe


@inner
def _equilibrate(
    K: Array, parts: Array, scale: Array, largest: Array, system: Array, width: Width
) -> None:
    """Scale the equations in ``system``, whose solution is K_θ⁻¹ X, with the diagonal D of P.

    D^-½ K_θ D^-½ fills the first nv columns, and D^-½ X replaces X, the columns from nv + 1 on.
    ``parts`` is P. Fills ``scale`` (nv, W) with D^-½, and ``largest`` (W,) with the largest entry
    of D^-½ P D^-½ (inf if D is singular).
    """
    nv = np.uint64(K.shape[0])
    for w in lanes(width):
        largest[w] = 0.0
    for i in upwards(0, nv):
        for w in lanes(width):
            scale[i, w] = 1.0 / math.sqrt(parts[i, i, w])
        for w in lanes(width):
            largest[w] = largest[w] if parts[i, i, w] > 0.0 else math.inf
        for c in upwards(nv + np.uint64(1), system.shape[1]):
            for w in lanes(width):
                system[i, c, w] *= scale[i, w]
    for i in upwards(0, nv):
        for j in upwards(0, nv):
            for w in lanes(width):
                system[i, j, w] = K[i, j, w] * scale[i, w] * scale[j, w]
            for w in lanes(width):
                largest[w] = max(largest[w], parts[i, j, w] * scale[i, w] * scale[j, w])


@inner
def _rescale(scale: Array, system: Array, moved: Array, width: Width) -> None:
    """Multiply the last n columns of ``system`` by D^-½ (``scale``): they become K_θ⁻¹ X.

    Fills ``moved`` (W,) with the largest scaled joint motion that the probe torque causes.
    """
    nv = np.uint64(system.shape[0])
    for w in lanes(width):
        moved[w] = 0.0
    for i in upwards(0, nv):
        for w in lanes(width):
            moved[w] = max(moved[w], abs(system[i, nv, w]))
        for c in upwards(nv + np.uint64(1), system.shape[1]):
            for w in lanes(width):
                system[i, c, w] *= scale[i, w]


@threaded
def set_torques(JX: Array, directions: Array, system: Array, along: Array, width: Width) -> None:
    """Fill the columns of ``system`` from nv + 1 on with J_vᵀ u for D unit vectors u.

    The vectors u are the rows of ``directions`` (D, 3). ``along`` (B, D, W) becomes inf where a
    force along u causes no torque at any joint, else NaN.
    """
    scratch = np.empty((2, JX.shape[3]))
    for b in range(JX.shape[0]):
        _set_torques(JX[b], directions, system[b], scratch, along[b], width)


@inner
def _set_torques(
    JX: Array, directions: Array, system: Array, scratch: Array, along: Array, width: Width
) -> None:
    torque, linear, nv = scratch[0], scratch[1], np.uint64(JX.shape[1])
    first = nv + np.uint64(1)
    for w in lanes(width):
        linear[w] = 0.0
    for i in upwards(0, nv):
        for a in upwards(0, directions.shape[1]):
            for w in lanes(width):
                linear[w] = max(linear[w], abs(JX[a, i, w]))
    for u in upwards(0, directions.shape[0]):
        x, y, z = directions[u, 0], directions[u, 1], directions[u, 2]
        for w in lanes(width):
            torque[w] = 0.0
        for i in upwards(0, nv):
            for w in lanes(width):
                system[i, first + u, w] = x * JX[0, i, w] + y * JX[1, i, w] + z * JX[2, i, w]
            for w in lanes(width):
                torque[w] = max(torque[w], abs(system[i, first + u, w]))
        for w in lanes(width):
            along[u, w] = math.nan if torque[w] > UNMOVED * linear[w] else math.inf


@threaded
def set_along(
    JX: Array, directions: Array, system: Array, status: Indices, along: Array, width: Width
) -> None:
    """Replace NaN in ``along`` (B, D, W) by 1/(uᵀ C_vv u) [N/m], except where K_θ is singular.

    The columns of ``system`` from nv + 1 on are K_θ⁻¹ J_vᵀ u for the unit ``directions`` u (D, 3).
    """
    compliance, first = np.empty(JX.shape[3]), np.uint64(JX.shape[2] + 1)
    for b in range(JX.shape[0]):
        for u in upwards(0, directions.shape[0]):
            _set_compliance(JX[b], directions[u], system[b], first + u, compliance, width)
            for w in lanes(width):
                stiffness = 1.0 / compliance[w] if compliance[w] != 0.0 else math.inf
                exists = math.isnan(along[b, u, w]) and status[b, w] != SINGULAR
                along[b, u, w] = stiffness if exists else along[b, u, w]


@inner
def _set_compliance(
    JX: Array, u: Array, system: Array, column: Index, compliance: Array, width: Width
) -> None:
    """Fill ``compliance`` (W,) with uᵀ C_vv u; ``system[:, column]`` (nv, W) is K_θ⁻¹ J_vᵀ u."""
    x, y, z = u[0], u[1], u[2]
    for w in lanes(width):
        compliance[w] = 0.0
    for i in upwards(0, JX.shape[1]):
        for w in lanes(width):
            torque = x * JX[0, i, w] + y * JX[1, i, w] + z * JX[2, i, w]
            compliance[w] += torque * system[i, column, w]
