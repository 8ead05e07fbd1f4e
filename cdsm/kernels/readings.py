"""Kernels that compute readings of K_θ: stability margin, compliance and Cartesian stiffness.

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

from cdsm.kernels.compiling import compiled, inlined
from cdsm.kernels.linear_algebra import eliminate, singular_values, smallest_eigenvalue
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

READ, SINGULAR, IMMOBILE = range(3)
"""Status of the readings: all exist; K_θ⁻¹ does not exist; J_v⁺ does not exist."""


class Wanted(NamedTuple):
    """Flags of the wanted readings; ``along`` is computed for every given direction."""

    margin: bool
    pseudoinverse: bool
    compliance: bool
    cartesian: bool


class Readings(NamedTuple):
    """Arrays for the readings, filled by :func:`read_stiffness`.

    Shapes: margin (1,), pseudoinverse (3, 3), along (D,), compliance (6, 6), cartesian (3, 3).
    """

    margin: Array
    pseudoinverse: Array
    along: Array
    compliance: Array
    cartesian: Array


class Workspace(NamedTuple):
    """Scratch arrays for one posture.

    Attributes:
        parts: P, the sum of the magnitudes of the four terms of K_θ (nv, nv).
        symmetric: The symmetric part of K_θ (nv, nv).
        vectors: Scratch of the smallest eigenvalue (4, nv).
        scale: D^-½ (nv,).
        system: K_θ, a probing torque, and, if wanted, J_vᵀu of each direction, J_Xᵀ and Vᵀ.
        left: U, then O (3, 3).
        values: The singular values S (3,).
        right: V (3, nv).
        image: K_θ Vᵀ (nv, 3).
        inner: A matrix (3, 3), and right of it the unit matrix.
    """

    parts: Array
    symmetric: Array
    vectors: Array
    scale: Array
    system: Array
    left: Array
    values: Array
    right: Array
    image: Array
    inner: Array


@compiled
def workspace(nv: int, directions: int, wanted: Wanted) -> Workspace:
    """Allocate scratch for the wanted readings."""
    columns = directions + (6 if wanted.compliance else 0) + (3 if wanted.cartesian else 0)
    return Workspace(
        np.empty((nv, nv)),
        np.empty((nv, nv)),
        np.empty((4, nv)),
        np.empty(nv),
        np.empty((nv, nv + columns + (1 if columns > 0 else 0))),
        np.empty((3, 3)),
        np.empty(3),
        np.empty((3, nv)),
        np.empty((nv, 3)),
        np.empty((3, 6)),
    )


# --- one posture ----------------------------------------------------------------------------


@compiled
def single_readings(
    K: Array,
    active: Array,
    passive: Array,
    gravity: Array,
    load: Array,
    JX: Array,
    directions: Array,
    compliance: bool,
    cartesian: bool,
) -> tuple[int, Array, Array, Array, Array]:
    """Return status, along (D,), joint motions K_θ⁻¹ J_vᵀu (nv, D), compliance and cartesian."""
    nv, count = K.shape[0], directions.shape[0]
    wanted = Wanted(False, False, compliance, cartesian)
    work = workspace(nv, count, wanted)
    total = np.empty((nv, nv))
    sum_terms(active, passive, gravity, load, total, work.parts)
    readings = Readings(
        np.empty(1), np.empty((3, 3)), np.empty(count), np.empty((6, 6)), np.empty((3, 3))
    )
    # copies are writable like the rows of a batch, so one compilation serves both
    status = read_stiffness(K.copy(), JX.copy(), directions, wanted, work, readings)
    motion = work.system[:, nv + 1 : nv + 1 + count].copy()
    return status, readings.along, motion, readings.compliance, readings.cartesian


@compiled
def single_margin(K: Array) -> float:
    """Compute the smallest eigenvalue of the symmetric part of K (nv, nv)."""
    nv = K.shape[0]
    return _margin(K.copy(), np.empty((nv, nv)), np.empty((4, nv)))


@compiled
def single_pseudoinverse(K: Array, JX: Array) -> tuple[int, Array]:
    """Return the status and J_v⁺ᵀ K J_v⁺ (3, 3) of any term K (nv, nv)."""
    wanted = Wanted(False, True, False, False)
    readings = Readings(
        np.empty(1), np.empty((3, 3)), np.empty(0), np.empty((6, 6)), np.empty((3, 3))
    )
    work = workspace(K.shape[0], 0, wanted)
    status = read_stiffness(K.copy(), JX.copy(), np.zeros((0, 3)), wanted, work, readings)
    return status, readings.pseudoinverse


@compiled
def is_mobile(JX: Array) -> bool:
    """Check whether the tip can move in all directions."""
    wanted = Wanted(False, False, False, False)
    return _decompose(JX.copy(), workspace(JX.shape[1], 0, wanted))


@compiled
def moves(JX: Array, direction: Array) -> bool:
    """Check whether a force along u (1, 3) moves any joint."""
    return _is_moved(JX, direction, 0)


# --- row by row -----------------------------------------------------------------------------


@compiled
def sum_terms(
    active: Array, passive: Array, gravity: Array, load: Array, K: Array, parts: Array
) -> None:
    """Fill K_θ, and P, the sum of the magnitudes of its four terms, (nv, nv) each."""
    for i in range(K.shape[0]):
        for j in range(K.shape[0]):
            K[i, j] = active[i, j] + passive[i, j] + gravity[i, j] + load[i, j]
            parts[i, j] = abs(active[i, j]) + abs(passive[i, j])
            parts[i, j] += abs(gravity[i, j]) + abs(load[i, j])


@compiled
def read_stiffness(
    K: Array, JX: Array, directions: Array, wanted: Wanted, work: Workspace, readings: Readings
) -> int:
    """Fill the readings that are wanted and exist; return READ, SINGULAR or IMMOBILE.

    If the tip is immobile, pseudoinverse and cartesian are NaN. If K_θ is singular, ``along`` is
    NaN, or infinite in directions in which the tip cannot move. K is K_θ (nv, nv), JX is J_X (6,
    nv), and directions are unit vectors u (D, 3). ``work.parts`` must be filled before.
    """
    nv, count, system = K.shape[0], directions.shape[0], work.system
    if wanted.margin:
        readings.margin[0] = _margin(K, work.symmetric, work.vectors)
    for a in range(3):
        for c in range(3):
            readings.pseudoinverse[a, c] = readings.cartesian[a, c] = math.nan
    status = READ
    if (wanted.cartesian or wanted.pseudoinverse) and not _decompose(JX, work):
        status = IMMOBILE
    if wanted.pseudoinverse and status == READ:
        for i in range(nv):
            for c in range(3):
                work.image[i, c] = 0.0
                for j in range(nv):
                    work.image[i, c] += K[i, j] * work.right[c, j]
        _project(work.right, work.image, 0, work.inner)
        _congruence(work.left, work.inner, 0, readings.pseudoinverse)
    if system.shape[1] == nv:
        return status

    _set_right_sides(JX, directions, work.right, wanted, system)
    for u in range(count):
        readings.along[u] = math.nan if _is_moved(JX, directions, u) else math.inf
    if not _solve(K, work.parts, work.scale, system):
        return SINGULAR
    for u in range(count):
        if math.isnan(readings.along[u]):
            compliance = 0.0
            for i in range(nv):
                compliance += _tip_torque(JX, directions, u, i) * system[i, nv + 1 + u]
            readings.along[u] = 1.0 / compliance if compliance != 0.0 else math.inf
    if wanted.compliance:
        _project(JX, system, nv + 1 + count, readings.compliance)
    if wanted.cartesian and status == READ:
        _project(work.right, system, system.shape[1] - 3, work.inner)
        for a in range(3):
            for c in range(3):
                work.inner[a, 3 + c] = 1.0 if a == c else 0.0
        if eliminate(work.inner) == 0.0:
            return SINGULAR
        _congruence(work.left, work.inner, 3, readings.cartesian)
    return status


@compiled
def _margin(K: Array, symmetric: Array, vectors: Array) -> float:
    for i in range(K.shape[0]):
        for j in range(K.shape[0]):
            symmetric[i, j] = (K[i, j] + K[j, i]) / 2.0
    return smallest_eigenvalue(symmetric, vectors)


@compiled
def _decompose(JX: Array, work: Workspace) -> bool:
    """Fill O, S and V of J_v; return whether the tip can move in all directions."""
    left, values, right = work.left, work.values, work.right
    for a in range(3):
        for i in range(JX.shape[1]):
            right[a, i] = JX[a, i]
    singular_values(right, left, values)
    smallest, largest = values[0], values[0]
    for a in range(3):
        smallest, largest = min(smallest, values[a]), max(largest, values[a])
    if smallest <= FLAT * largest:
        return False
    for i in range(3):
        for a in range(3):
            left[i, a] /= values[a]
    return True


# --- K_θ⁻¹ ----------------------------------------------------------------------------------


@compiled
def _solve(K: Array, parts: Array, scale: Array, system: Array) -> bool:
    """Replace the right sides B of a system by K_θ⁻¹ B; return whether K_θ is regular."""
    nv = K.shape[0]
    largest = _equilibrate(K, parts, scale, system)
    if largest == math.inf:  # a joint has zero stiffness in all terms
        return False
    for i in range(nv):
        system[i, nv] = _probe_torque(i)
        for c in range(nv + 1, system.shape[1]):
            system[i, c] *= scale[i]
    if eliminate(system) == 0.0:
        return False
    moved = 0.0
    for i in range(nv):
        moved = max(moved, abs(system[i, nv]))
    # LAPACK's singular values take ten times as long as all the rest, and are rarely needed
    if not moved * largest < _DOUBT and not _is_regular(K, parts):
        return False
    for i in range(nv):
        for c in range(nv + 1, system.shape[1]):
            system[i, c] *= scale[i]
    return True


@compiled
def _equilibrate(K: Array, parts: Array, scale: Array, scaled: Array) -> float:
    """Fill D^-½ and D^-½ K D^-½; return the largest entry of D^-½ P D^-½, inf if D is singular."""
    nv, largest = K.shape[0], 0.0
    for i in range(nv):
        if not parts[i, i] > 0.0:
            return math.inf
        scale[i] = 1.0 / math.sqrt(parts[i, i])
    for i in range(nv):
        for j in range(nv):
            scaled[i, j] = K[i, j] * scale[i] * scale[j]
            largest = max(largest, parts[i, j] * scale[i] * scale[j])
    return largest


@compiled
def _is_regular(K: Array, parts: Array) -> bool:
    """Check whether the smallest singular value of the scaled K_θ is large enough."""
    scaled = np.empty(K.shape)
    largest = _equilibrate(K, parts, np.empty(K.shape[0]), scaled)
    regular: bool = np.linalg.svd(scaled)[1][-1] > REGULAR * largest
    return regular


@inlined
def _probe_torque(i: int) -> float:
    """Return an irregular torque on joint i, from 1 to 2, that excites almost every motion."""
    return 1.0 + (0.6180339887498949 * i) % 1.0


@compiled
def _set_right_sides(
    JX: Array, directions: Array, right: Array, wanted: Wanted, system: Array
) -> None:
    """Fill the wanted columns of J_vᵀu, J_Xᵀ and Vᵀ, right of the probing torque."""
    nv, count = JX.shape[1], directions.shape[0]
    width = system.shape[1]
    for i in range(nv):
        for u in range(count):
            system[i, nv + 1 + u] = _tip_torque(JX, directions, u, i)
        if wanted.compliance:
            for c in range(6):
                system[i, nv + 1 + count + c] = JX[c, i]
        if wanted.cartesian:
            for c in range(3):
                system[i, width - 3 + c] = right[c, i]


@inlined
def _tip_torque(JX: Array, directions: Array, u: int, i: int) -> float:
    """Compute entry i of J_vᵀu: the joint torque of a unit force along u."""
    x, y, z = directions[u, 0], directions[u, 1], directions[u, 2]
    torque: float = x * JX[0, i] + y * JX[1, i] + z * JX[2, i]
    return torque


@compiled
def _is_moved(JX: Array, directions: Array, u: int) -> bool:
    """Check whether a force along u moves any joint."""
    torque = linear = 0.0
    for i in range(JX.shape[1]):
        torque = max(torque, abs(_tip_torque(JX, directions, u, i)))
        for a in range(3):
            linear = max(linear, abs(JX[a, i]))
    return torque > UNMOVED * linear


@compiled
def _project(A: Array, B: Array, first: int, out: Array) -> None:
    """Fill the first m columns of out with A (m, nv) times m columns of B (nv, …)."""
    m = A.shape[0]
    for a in range(m):
        for c in range(m):
            out[a, c] = 0.0
        for i in range(A.shape[1]):
            for c in range(m):
                out[a, c] += A[a, i] * B[i, first + c]


@compiled
def _congruence(factor: Array, inner: Array, first: int, out: Array) -> None:
    """Fill out (3, 3) with O X Oᵀ; X is three columns of inner, and O is the factor."""
    for i in range(3):
        for j in range(3):
            out[i, j] = 0.0
            for k in range(3):
                for m in range(3):
                    out[i, j] += factor[i, k] * inner[k, first + m] * factor[j, m]
