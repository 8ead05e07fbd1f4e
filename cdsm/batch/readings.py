"""What the joint stiffness of a row is asked for: margin, compliance and Cartesian stiffness.

Each by the formula, and within the limits, of :class:`cdsm.Stiffness`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm.batch.layout import (
    CARTESIAN,
    COMPLIANCE,
    IMMOBILE,
    MARGIN,
    OK,
    PSEUDOINVERSE,
    SINGULAR,
    UNDECIDED,
    Flags,
)
from cdsm.batch.linear_algebra import eliminate, singular_values, smallest_eigenvalue
from cdsm.kernels.compiling import compiled, inlined
from cdsm.stiffness_matrix import FLAT, UNMOVED
from cdsm.support.validation import Array

_DOUBT = 1e5
"""Motion under a probing torque, over torque over the size of what K_θ sums, beyond which singular
values have to tell whether K_θ is regular: it estimates them from one side, so this is decades off
the inverse of :data:`~cdsm.stiffness_matrix.REGULAR`."""


class Answers(NamedTuple):
    """Where the quantities go: parts of a record.

    Attributes:
        margin: (1,).
        pseudoinverse: (3, 3).
        along: One for each direction (D,).
        compliance: (6, 6).
        cartesian: (3, 3).
    """

    margin: Array
    pseudoinverse: Array
    along: Array
    compliance: Array
    cartesian: Array


class Workspace(NamedTuple):
    """Scratch for one row.

    Attributes:
        symmetric: The symmetric part of K_θ (nv, nv).
        vectors: For its eigenvalue (4, nv).
        system: K_θ, and right of it, if anything is, a probing torque, and as far as wanted J_vᵀu
            of each direction, J_Xᵀ, and the orthonormal rows of J_v.
        left: Left singular vectors of J_v (3, 3), over its singular values.
        values: These values (3,).
        right: Its orthonormal rows (3, nv).
        image: A matrix (nv, 3).
        inner: A matrix (3, 3), and right of it the unit matrix.
    """

    symmetric: Array
    vectors: Array
    system: Array
    left: Array
    values: Array
    right: Array
    image: Array
    inner: Array


@compiled
def workspace(nv: int, directions: int, asked: Flags) -> Workspace:
    """Room for what is asked for."""
    columns = directions + (6 if asked[COMPLIANCE] else 0) + (3 if asked[CARTESIAN] else 0)
    return Workspace(
        np.empty((nv, nv)),
        np.empty((4, nv)),
        np.empty((nv, nv + columns + (1 if columns > 0 else 0))),
        np.empty((3, 3)),
        np.empty(3),
        np.empty((3, nv)),
        np.empty((nv, 3)),
        np.empty((3, 6)),
    )


@compiled
def solve_row(
    K: Array,
    size: float,
    JX: Array,
    directions: Array,
    work: Workspace,
    asked: Flags,
    answers: Answers,
) -> int:
    """Fill the quantities asked for from K_θ (nv, nv) and its size, J_X (6, nv) and u (D, 3).

    The size is the largest entry of K_θ, every part of its sum taken absolutely.

    Returns:
        A status. UNDECIDED where it takes singular values to tell whether K_θ is regular; of what
        needs that, nothing is filled then.
    """
    symmetric, vectors, system, left, values, right, image, inner = work
    margin, pseudoinverse, along, compliance, cartesian = answers
    nv, count = K.shape[0], directions.shape[0]
    if asked[MARGIN]:
        for i in range(nv):
            for j in range(nv):
                symmetric[i, j] = (K[i, j] + K[j, i]) / 2.0
        margin[0] = smallest_eigenvalue(symmetric, vectors)
    for a in range(3):
        for c in range(3):
            pseudoinverse[a, c] = cartesian[a, c] = 0.0
    status, mobile = OK, False
    if asked[CARTESIAN] or asked[PSEUDOINVERSE]:
        mobile = _mobility(JX, left, values, right)
        status = OK if mobile else IMMOBILE
    if asked[PSEUDOINVERSE] and mobile:
        for i in range(nv):
            for c in range(3):
                image[i, c] = 0.0
                for j in range(nv):
                    image[i, c] += K[i, j] * right[c, j]
        _product(right, image, 0, inner)
        _between(left, inner, 0, pseudoinverse)
    if system.shape[1] == nv:
        return status
    _assemble(K, JX, directions, right, asked, system)
    if eliminate(system) == 0.0 or _yields(system, size):
        return UNDECIDED
    for u in range(count):
        along[u] = _weight_test(JX, directions, system, u)
    if asked[COMPLIANCE]:
        _product(JX, system, nv + 1 + count, compliance)
    if asked[CARTESIAN] and mobile:
        _product(right, system, system.shape[1] - 3, inner)
        for a in range(3):
            for c in range(3):
                inner[a, 3 + c] = 1.0 if a == c else 0.0
        if eliminate(inner) == 0.0:
            return SINGULAR
        _between(left, inner, 3, cartesian)
    return status


@compiled
def _mobility(JX: Array, left: Array, values: Array, right: Array) -> bool:
    """Fill the singular-value decomposition of J_v; tell whether the tip can move in all ways."""
    for a in range(3):
        for i in range(JX.shape[1]):
            right[a, i] = JX[a, i]
    singular_values(right, left, values)
    least = most = values[0]
    for a in range(3):
        least, most = min(least, values[a]), max(most, values[a])
    if least <= FLAT * most:
        return False
    for i in range(3):
        for a in range(3):
            left[i, a] /= values[a]
    return True


@compiled
def _assemble(
    K: Array, JX: Array, directions: Array, right: Array, asked: Flags, system: Array
) -> None:
    """Fill the linear system of a :class:`Workspace`."""
    nv, count = K.shape[0], directions.shape[0]
    width = system.shape[1]
    for i in range(nv):
        for j in range(nv):
            system[i, j] = K[i, j]
        system[i, nv] = _probe(i)
        for u in range(count):
            system[i, nv + 1 + u] = _moved(JX, directions, u, i)
        if asked[COMPLIANCE]:
            for c in range(6):
                system[i, nv + 1 + count + c] = JX[c, i]
        if asked[CARTESIAN]:
            for c in range(3):
                system[i, width - 3 + c] = right[c, i]


@inlined
def _probe(i: int) -> float:
    """Torque on joint i, from 1 to 2 and so irregular that hardly a motion is free of it."""
    return 1.0 + (0.6180339887498949 * i) % 1.0


@compiled
def _yields(system: Array, size: float) -> bool:
    """Whether the probing torque moves a joint so far that K_θ may be singular."""
    moved = 0.0
    for i in range(system.shape[0]):
        moved = max(moved, abs(system[i, system.shape[0]]))
    return not moved * size < _DOUBT


@compiled
def _moved(JX: Array, directions: Array, u: int, i: int) -> float:
    """Entry i of J_vᵀu."""
    x, y, z = directions[u, 0], directions[u, 1], directions[u, 2]
    moved: float = x * JX[0, i] + y * JX[1, i] + z * JX[2, i]
    return moved


@compiled
def _weight_test(JX: Array, directions: Array, system: Array, u: int) -> float:
    """1/(uᵀ C_vv u) from the solved system, inf where no joint moves the tip along u."""
    nv = JX.shape[1]
    torque = linear = compliance = 0.0
    for i in range(nv):
        moved = _moved(JX, directions, u, i)
        compliance += moved * system[i, nv + 1 + u]
        torque = max(torque, abs(moved))
        for a in range(3):
            linear = max(linear, abs(JX[a, i]))
    if torque <= UNMOVED * linear or compliance == 0.0:
        return math.inf
    return 1.0 / compliance


@compiled
def _product(A: Array, B: Array, first: int, out: Array) -> None:
    """Fill the first m columns of out with A (m, nv) times m columns of B (nv, …)."""
    m = A.shape[0]
    for a in range(m):
        for c in range(m):
            out[a, c] = 0.0
        for i in range(A.shape[1]):
            for c in range(m):
                out[a, c] += A[a, i] * B[i, first + c]


@compiled
def _between(left: Array, inner: Array, first: int, out: Array) -> None:
    """Fill out (3, 3) with O X Oᵀ, where X is three columns of inner."""
    for i in range(3):
        for j in range(3):
            out[i, j] = 0.0
            for k in range(3):
                for m in range(3):
                    out[i, j] += left[i, k] * inner[k, first + m] * left[j, m]
