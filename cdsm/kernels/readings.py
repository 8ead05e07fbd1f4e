"""Kernels that compute readings of K_θ: stability margin, compliance and Cartesian stiffness.

All arrays are those of a block of postures: the last axis is the posture.

With the linear rows J_v of J_X, and C = J_X K_θ⁻¹ J_Xᵀ with its linear part C_vv,

    margin = λ_min((K_θ + K_θᵀ)/2),    compliance = C,    along(u) = 1/(uᵀ C_vv u),
    cartesian = (C_vv)⁻¹,              pseudoinverse = J_v⁺ᵀ K_θ J_v⁺.

Near a flat posture C_vv is too ill-conditioned for inversion. With the singular value decomposition
J_v = U S V and O = U S⁻¹,

    cartesian = O (V K_θ⁻¹ Vᵀ)⁻¹ Oᵀ,    pseudoinverse = O (V K_θ Vᵀ) Oᵀ.

The four terms of K_θ may cancel. K_θ is therefore compared with P, the sum of their magnitudes, and
scaled by the diagonal D of P. K_θ is singular if the smallest singular value of D^-½ K_θ D^-½ is
below REGULAR times the largest entry of D^-½ P D^-½.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm.kernels.compiling import Index, Width, compiled, inlined, inner, lanes, upwards
from cdsm.kernels.linear_algebra import eliminate, singular_values, smallest_eigenvalue
from cdsm.kernels.tree import Indices
from cdsm.support.values import Array

REGULAR = 1e-8
"""Smallest relative singular value of K_θ at which its inverse still has 6 correct digits."""

FLAT = 1e-6
"""Smallest ratio of the singular values of J_v at which a 3×3 stiffness still has 4 correct digits.

Its entries differ by the square of the ratio, and float64 has 16 digits.
"""

UNMOVED = 1e-10
"""Relative joint torque of a tip force that counts as rounding: the tip cannot move."""

_DOUBT = 1e5
"""Scaled motion under a probing torque above which the singular values are computed.

The motion is at most the torque over the smallest singular value, and usually some tenths of that.
1e5 is orders of magnitude below the inverse of :data:`REGULAR`.
"""

READ, SINGULAR, IMMOBILE, UNREAD = range(4)
"""Status of the readings: all exist; K_θ⁻¹ does not exist; J_v⁺ does not exist; K_θ is unknown."""


class Wanted(NamedTuple):
    """Flags of the wanted readings; ``along`` is computed for every given direction."""

    margin: bool
    pseudoinverse: bool
    compliance: bool
    cartesian: bool


class Readings(NamedTuple):
    """Arrays for the readings of a block of W postures, filled by :func:`read_stiffness`.

    Shapes: margin (1, W), pseudoinverse (3, 3, W), along (D, W), compliance (6, 6, W), cartesian
    (3, 3, W).
    """

    margin: Array
    pseudoinverse: Array
    along: Array
    compliance: Array
    cartesian: Array


class Workspace(NamedTuple):
    """Scratch arrays for a block of W postures.

    Attributes:
        symmetric: The symmetric part of K_θ (nv, nv, W).
        rows: Scratch of the eigenvalues and of short loops (4 nv + 10, W).
        scale: D^-½ (nv, W).
        largest: Largest entry of D^-½ P D^-½ (W,).
        system: K_θ, a probing torque, and, if wanted, J_vᵀu of each direction, J_Xᵀ and Vᵀ.
        left: U, then O (3, 3, W).
        values: The singular values S (3, W).
        right: V (3, nv, W).
        image: K_θ Vᵀ (nv, 3, W).
        inner: A matrix (3, 3, W), and right of it the unit matrix.
    """

    symmetric: Array
    rows: Array
    scale: Array
    largest: Array
    system: Array
    left: Array
    values: Array
    right: Array
    image: Array
    inner: Array


@inlined
def workspace(nv: int, directions: int, wanted: Wanted, width: int) -> Workspace:
    """Allocate scratch for the wanted readings."""
    columns = directions + (6 if wanted.compliance else 0) + (3 if wanted.cartesian else 0)
    return Workspace(
        np.empty((nv, nv, width)),
        np.empty((4 * nv + 10, width)),
        np.empty((nv, width)),
        np.empty(width),
        np.empty((nv, nv + columns + (1 if columns > 0 else 0), width)),
        np.empty((3, 3, width)),
        np.empty((3, width)),
        np.empty((3, nv, width)),
        np.empty((nv, 3, width)),
        np.empty((3, 6, width)),
    )


# --- one posture ----------------------------------------------------------------------------


@compiled
def single_readings(
    K: Array,
    parts: Array,
    JX: Array,
    directions: Array,
    pseudoinverse: bool,
    compliance: bool,
    cartesian: bool,
) -> tuple[int, Array, Array, Array, Array, Array]:
    """Return the status and the wanted readings of one posture.

    K is K_θ or, for the pseudoinverse, any of its terms (nv, nv). P is ``parts`` (nv, nv).

    Returns:
        Status, pseudoinverse (3, 3), along (D,), a matrix with the joint motions K_θ⁻¹ J_vᵀu in its
        columns from nv + 1 on, compliance (6, 6) and cartesian (3, 3).
    """
    nv, count = K.shape[0], directions.shape[0]
    wanted = Wanted(False, pseudoinverse, compliance, cartesian)
    work, status = workspace(nv, count, wanted, 1), np.full(1, READ)
    readings = Readings(
        np.empty((1, 1)),
        np.empty((3, 3, 1)),
        np.empty((count, 1)),
        np.empty((6, 6, 1)),
        np.empty((3, 3, 1)),
    )
    block, magnitudes = K.reshape(nv, nv, 1), parts.reshape(nv, nv, 1)
    jacobian = JX.reshape(6, nv, 1)
    read_stiffness(block, magnitudes, jacobian, directions, wanted, work, readings, status, None)
    return (
        status[0],
        readings.pseudoinverse.reshape(3, 3),
        readings.along.reshape(count),
        work.system.reshape(nv, work.system.shape[1]),
        readings.compliance.reshape(6, 6),
        readings.cartesian.reshape(3, 3),
    )


@compiled
def single_margin(K: Array) -> float:
    """Compute the smallest eigenvalue of the symmetric part of K (nv, nv)."""
    nv, least = K.shape[0], np.empty(1)
    symmetric = np.empty((nv, nv, 1))
    set_symmetric(K.reshape(nv, nv, 1), symmetric, None)
    smallest_eigenvalue(symmetric, np.empty((4 * nv + 10, 1)), least, None)
    margin: float = least[0]
    return margin


# --- blocks of postures ---------------------------------------------------------------------


@inlined
def read_stiffness(
    K: Array,
    parts: Array,
    JX: Array,
    directions: Array,
    wanted: Wanted,
    work: Workspace,
    readings: Readings,
    status: Indices,
    width: Width,
) -> None:
    """Fill the readings that are wanted and exist, and the status: READ, SINGULAR or IMMOBILE.

    Postures that are UNREAD on entry stay so; their readings are meaningless.

    If the tip is immobile, pseudoinverse and cartesian are NaN. If K_θ is singular, ``along`` is
    NaN, or infinite in directions in which the tip cannot move; compliance and cartesian are
    meaningless. K is K_θ (nv, nv, W), JX is J_X (6, nv, W), and directions are unit vectors u (D,
    3). P is ``parts`` (nv, nv, W).
    """
    symmetric, rows, scale, largest, system, left, values, right, image, inner = work
    nv, count = K.shape[0], directions.shape[0]
    if wanted.margin:
        set_symmetric(K, symmetric, width)
        smallest_eigenvalue(symmetric, rows, readings.margin[0], width)
    if wanted.cartesian or wanted.pseudoinverse:
        _decompose(JX, left, values, right, rows, status, width)
    if wanted.pseudoinverse:
        _set_product(K, right, image, width)
        _project(right, image, np.intp(0), inner, width)
        _congruence(left, inner, np.intp(0), status, readings.pseudoinverse, width)
    if system.shape[1] > nv:
        _set_right_sides(JX, directions, right, wanted, system, rows, readings.along, width)
        _equilibrate(K, parts, scale, largest, system, width)
        eliminate(system, rows, width)
        _rescale(K, scale, largest, system, rows, status, width)
        _set_along(JX, directions, system, rows, status, readings.along, width)
    if wanted.compliance:
        _project(JX, system, nv + 1 + count, readings.compliance, width)
    if wanted.cartesian:
        _project(right, system, system.shape[1] - 3, inner, width)
        for a in upwards(0, inner.shape[0]):
            for c in upwards(0, inner.shape[0]):
                for w in lanes(width):
                    inner[a, 3 + c, w] = 1.0 if a == c else 0.0
        eliminate(inner, rows, width)
        for w in lanes(width):
            if rows[0, w] == 0.0 and status[w] == READ:
                status[w] = SINGULAR
        _congruence(left, inner, np.intp(3), status, readings.cartesian, width)


@inner
def set_symmetric(K: Array, symmetric: Array, width: Width) -> None:
    """Fill the symmetric part (nv, nv, W) of K."""
    for i in upwards(0, K.shape[0]):
        for j in upwards(0, K.shape[0]):
            for w in lanes(width):
                symmetric[i, j, w] = (K[i, j, w] + K[j, i, w]) / 2.0


@inner
def _decompose(
    JX: Array, left: Array, S: Array, right: Array, rows: Array, status: Indices, width: Width
) -> None:
    """Fill O, S and V of J_v; set the status where the tip cannot move in all directions."""
    for a in upwards(0, right.shape[0]):
        for i in upwards(0, JX.shape[1]):
            for w in lanes(width):
                right[a, i, w] = JX[a, i, w]
    singular_values(right, left, S, rows, width)
    for w in lanes(width):
        smallest = min(S[0, w], S[1, w], S[2, w])
        if status[w] == READ and not smallest > FLAT * max(S[0, w], S[1, w], S[2, w]):
            status[w] = IMMOBILE
    for i in upwards(0, left.shape[0]):
        for a in upwards(0, left.shape[0]):
            for w in lanes(width):
                left[i, a, w] /= S[a, w]


@inner
def _set_product(K: Array, right: Array, image: Array, width: Width) -> None:
    """Fill image (nv, 3, W) with K Vᵀ."""
    for i in upwards(0, K.shape[0]):
        for c in upwards(0, right.shape[0]):
            for w in lanes(width):
                image[i, c, w] = 0.0
            for j in upwards(0, K.shape[0]):
                for w in lanes(width):
                    image[i, c, w] += K[i, j, w] * right[c, j, w]


# --- K_θ⁻¹ ----------------------------------------------------------------------------------


@inner
def _set_right_sides(
    JX: Array,
    directions: Array,
    right: Array,
    wanted: Wanted,
    system: Array,
    rows: Array,
    along: Array,
    width: Width,
) -> None:
    """Fill the probing torque and the wanted columns of J_vᵀu, J_Xᵀ and Vᵀ, right of K_θ.

    ``along`` (D, W) becomes inf where u moves no joint, else NaN.
    """
    nv, torque, linear = np.uint64(JX.shape[1]), rows[0], rows[1]
    first = nv + np.uint64(1)
    columns, count = np.uint64(system.shape[1]), np.uint64(directions.shape[0])
    for w in lanes(width):
        linear[w] = 0.0
    for i in upwards(0, nv):
        # an irregular torque from 1 to 2 that excites almost every motion
        probe = 1.0 + (0.6180339887498949 * np.intp(i)) % 1.0
        for w in lanes(width):
            system[i, nv, w] = probe
        for a in upwards(0, 3):
            for w in lanes(width):
                linear[w] = max(linear[w], abs(JX[a, i, w]))
        if wanted.compliance:
            for c in upwards(0, JX.shape[0]):
                for w in lanes(width):
                    system[i, first + count + c, w] = JX[c, i, w]
        if wanted.cartesian:
            for c in upwards(0, right.shape[0]):
                for w in lanes(width):
                    system[i, columns - np.uint64(right.shape[0]) + c, w] = right[c, i, w]
    for u in upwards(0, count):
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


@inner
def _equilibrate(
    K: Array, parts: Array, scale: Array, largest: Array, system: Array, width: Width
) -> None:
    """Fill D^-½, the largest entry of D^-½ P D^-½ (inf if D is singular), and scale the system."""
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
def _rescale(
    K: Array,
    scale: Array,
    largest: Array,
    system: Array,
    rows: Array,
    status: Indices,
    width: Width,
) -> None:
    """Scale the solutions back to K_θ⁻¹ B; set the status where K_θ is singular."""
    nv, moved = np.uint64(K.shape[0]), rows[4]
    for w in lanes(width):
        moved[w] = 0.0
    for i in upwards(0, nv):
        for w in lanes(width):
            moved[w] = max(moved[w], abs(system[i, nv, w]))
        for c in upwards(nv + np.uint64(1), system.shape[1]):
            for w in lanes(width):
                system[i, c, w] *= scale[i, w]
    for w in lanes(width):
        # LAPACK's singular values take ten times as long as all the rest, and are rarely needed
        certain = moved[w] * largest[w] < _DOUBT and rows[0, w] > 0.0
        if status[w] != UNREAD and not certain and not _is_regular(K, scale, largest[w], w):
            status[w] = SINGULAR


@inner
def _is_regular(K: Array, scale: Array, largest: float, w: Index) -> bool:
    """Check whether the smallest singular value of one scaled K_θ is large enough."""
    nv = K.shape[0]
    if not largest < math.inf:  # a joint has zero stiffness in all terms
        return False
    scaled = np.empty((nv, nv))
    for i in range(nv):
        for j in range(nv):
            scaled[i, j] = K[i, j, w] * scale[i, w] * scale[j, w]
    regular: bool = np.linalg.svd(scaled)[1][-1] > REGULAR * largest
    return regular


@inner
def _set_along(
    JX: Array,
    directions: Array,
    system: Array,
    rows: Array,
    status: Indices,
    along: Array,
    width: Width,
) -> None:
    """Fill the stiffness along each direction, where the tip can move and K_θ is regular."""
    compliance, first = rows[0], np.uint64(JX.shape[1] + 1)
    for u in upwards(0, directions.shape[0]):
        x, y, z = directions[u, 0], directions[u, 1], directions[u, 2]
        for w in lanes(width):
            compliance[w] = 0.0
        for i in upwards(0, JX.shape[1]):
            for w in lanes(width):
                torque = x * JX[0, i, w] + y * JX[1, i, w] + z * JX[2, i, w]
                compliance[w] += torque * system[i, first + u, w]
        for w in lanes(width):
            stiffness = 1.0 / compliance[w] if compliance[w] != 0.0 else math.inf
            exists = math.isnan(along[u, w]) and status[w] != SINGULAR
            along[u, w] = stiffness if exists else along[u, w]


@inner
def _project(A: Array, B: Array, first: Index, out: Array, width: Width) -> None:
    """Fill the first m columns of out with A (m, nv, W) times m columns of B (nv, …, W)."""
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
    factor: Array, inner: Array, first: Index, status: Indices, out: Array, width: Width
) -> None:
    """Fill out (3, 3, W) with O X Oᵀ, or NaN where the tip is immobile.

    X is three columns of inner, and O is the factor.
    """
    for i in upwards(0, factor.shape[0]):
        for j in upwards(0, factor.shape[0]):
            for w in lanes(width):
                out[i, j, w] = math.nan if status[w] == IMMOBILE else 0.0
            for k in upwards(0, factor.shape[0]):
                for m in upwards(0, factor.shape[0]):
                    for w in lanes(width):
                        out[i, j, w] += (
                            factor[i, k, w] * inner[k, np.uint64(first) + m, w] * factor[j, m, w]
                        )
