"""Numba kernels of dense linear algebra for blocks of small matrices; the last axis is the posture.

LAPACK solves one matrix after the other, and its own threads compete for cores with the threads
that run these kernels: the inverse of an 80×80 matrix then took 16 ms. The table compares times in
microseconds for one n×n matrix: alone / in a block of 32 / in LAPACK called from a kernel. The
linear system has 10 right sides.

    n                                      5               10               20              40
    linear system            0.3 / 0.1 / 1.0  0.9 / 0.4 / 2.0  3.3 / 1.8 / 4.9     14 / 9 / 13
    smallest eigenvalue      0.6 / 0.2 / 1.5  1.5 / 0.4 / 4.5   4.8 / 1.7 / 13    21 / 11 / 54
"""

from __future__ import annotations

import math

import numpy as np

from cdsm._former.compiling import Index, Width, inlined, inner, lanes, upwards
from cdsm.support.values import Array

_STEPS = 200
"""Largest number of Laguerre steps; simple eigenvalues take five, n-fold ones about twenty."""

_ROUNDING = 2.0**-52

_LEAST = 1e-90
"""Entries of a tridiagonal matrix below this magnitude count as zero."""

_NOTHING = 1e-30
"""Off-diagonal entries below this fraction of the largest entry count as zero.

They do not change any eigenvalue.
"""

_PIVOT = 0.1
"""Rows are exchanged where the pivot is below this fraction of the largest entry of its column.

Exchanges are slow, since they are made posture by posture. K_θ of a stable arm needs none.
"""


@inner
def eliminate(M: Array, pivots: Array, width: Width) -> None:
    """Solve A X = B. M (n, n + k, W) has A (n, n) on the left and B (n, k) on the right.

    A⁻¹ B replaces B; A is overwritten. The first two rows of ``pivots`` (4, W) become the smallest
    and the largest magnitude of a pivot; the other two are scratch. If a pivot is zero, the result
    is not valid.
    """
    n, columns = M.shape[0], M.shape[1]
    smallest, largest, factor, inverse = pivots[0], pivots[1], pivots[2], pivots[3]
    for w in lanes(width):
        smallest[w], largest[w] = math.inf, 0.0
    for k in upwards(0, n):
        for w in lanes(width):
            factor[w] = 0.0
        for i in upwards(k + np.uint64(1), n):
            for w in lanes(width):
                factor[w] = max(factor[w], abs(M[i, k, w]))
        for w in lanes(width):
            if abs(M[k, k, w]) < _PIVOT * factor[w]:
                _exchange(M, k, w)
        for w in lanes(width):
            smallest[w] = min(smallest[w], abs(M[k, k, w]))
        for w in lanes(width):
            largest[w] = max(largest[w], abs(M[k, k, w]))
        for w in lanes(width):
            inverse[w] = 1.0 / M[k, k, w]
        for i in upwards(k + np.uint64(1), n):
            for w in lanes(width):
                factor[w] = M[i, k, w] * inverse[w]
            for j in upwards(k + np.uint64(1), columns):
                for w in lanes(width):
                    M[i, j, w] -= factor[w] * M[k, j, w]
    for row in range(n - 1, -1, -1):
        k = np.uint64(row)
        for w in lanes(width):
            inverse[w] = 1.0 / M[k, k, w]
        for j in upwards(n, columns):
            for w in lanes(width):
                M[k, j, w] *= inverse[w]
        for i in upwards(0, row):
            for j in upwards(n, columns):
                for w in lanes(width):
                    M[i, j, w] -= M[i, k, w] * M[k, j, w]


@inner
def _exchange(M: Array, k: Index, w: Index) -> None:
    """Exchange row k of matrix w with the row below that has the largest entry in column k."""
    best = k
    for i in upwards(k, M.shape[0]):
        if abs(M[i, k, w]) > abs(M[best, k, w]):
            best = i
    for j in upwards(k, M.shape[1]):
        M[k, j, w], M[best, j, w] = M[best, j, w], M[k, j, w]


@inlined
def smallest_eigenvalue(A: Array, scratch: Array, x: Array, width: Width) -> None:
    """Fill x (W,) with the smallest eigenvalue of each symmetric A (n, n, W); overwrite A.

    Householder reflections make A tridiagonal. Laguerre's method then converges from below to the
    smallest root of the characteristic polynomial. It never passes the root, since all roots are
    real. ``scratch`` is (4 n + 10, W).
    """
    n = A.shape[0]
    d, e, rest = scratch[:n], scratch[n : 2 * n], scratch[2 * n :]
    _tridiagonalise(A, d, e, rest, width)
    for i in upwards(0, n):  # the squares of smaller inverses would overflow
        for w in lanes(width):
            d[i, w] = d[i, w] if abs(d[i, w]) > _LEAST else 0.0
        for w in lanes(width):
            e[i, w] = e[i, w] if abs(e[i, w]) > _LEAST else 0.0
    scale, least, G, H, going = rest[0], rest[1], rest[2], rest[3], rest[4]
    for w in lanes(width):
        scale[w], x[w], going[w] = 0.0, math.inf, 1.0
    for i in upwards(0, n):
        for w in lanes(width):
            radius = abs(e[i, w]) + (abs(e[i + 1, w]) if i + 1 < n else 0.0)
            scale[w] = max(scale[w], abs(d[i, w]) + radius)
            x[w] = min(x[w], d[i, w] - radius)  # Gershgorin
    for w in lanes(width):
        x[w] -= _ROUNDING * scale[w]
    for _ in range(_STEPS):
        _set_derivatives(d, e, x, rest[1:4], rest[5:10], width)
        left = 0.0
        for w in lanes(width):
            root = math.sqrt(max((n - 1) * (n * H[w] - G[w] * G[w]), 0.0))
            step = n / (G[w] + root) if least[w] > 0.0 else 0.0  # only rounding passes the root
            x[w] += going[w] * step
            going[w] = going[w] if step > _ROUNDING * scale[w] else 0.0
            left += going[w]
        if left == 0.0:
            break


@inner
def _set_derivatives(
    d: Array, e: Array, x: Array, sums: Array, scratch: Array, width: Width
) -> None:
    """Fill the rows of ``sums`` (3, W) with what a step of Laguerre's method at x (W,) needs.

    The first is the smallest ratio of a leading minor of T − x to the leading minor before it: if
    it is positive, x is below all eigenvalues λ of T. The others are Σ 1/(λ − x) and Σ 1/(λ − x)².
    T is the tridiagonal matrix with diagonal d and off-diagonal e, (n, W) each; e[0] is 0.
    ``scratch`` is (5, W).
    """
    least, G, H = sums[0], sums[1], sums[2]
    # inverse, slope and bend are 1/g, g′/g and g″/g of the row above
    inverse, slope, bend, first, second = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4]
    for w in lanes(width):
        least[w] = math.inf
        G[w] = H[w] = inverse[w] = slope[w] = bend[w] = 0.0
    for i in upwards(0, d.shape[0]):
        for w in lanes(width):
            first[w] = -1.0 + e[i, w] * e[i, w] * inverse[w] * slope[w]
        for w in lanes(width):
            second[w] = e[i, w] * e[i, w] * inverse[w] * (bend[w] - 2.0 * slope[w] * slope[w])
        for w in lanes(width):  # g in the place of 1/g of the row above
            inverse[w] = d[i, w] - x[w] - e[i, w] * e[i, w] * inverse[w]
        for w in lanes(width):
            least[w] = min(least[w], inverse[w])
        for w in lanes(width):
            inverse[w] = 1.0 / inverse[w]
        for w in lanes(width):
            slope[w] = first[w] * inverse[w]
        for w in lanes(width):
            bend[w] = second[w] * inverse[w]
        for w in lanes(width):
            G[w] -= slope[w]
        for w in lanes(width):
            H[w] += slope[w] * slope[w] - bend[w]


@inner
def _tridiagonalise(A: Array, d: Array, e: Array, scratch: Array, width: Width) -> None:
    """Fill diagonal d and off-diagonal e, (n, W) each, of a tridiagonal matrix similar to A.

    A is (n, n, W) and is overwritten. e[0] is 0; ``scratch`` is (2 n + 4, W).
    """
    n = np.uint64(A.shape[0])
    v, u = scratch[4 : 4 + n], scratch[4 + n :]
    size, norm, beta, along = scratch[0], scratch[1], scratch[2], scratch[3]
    for w in lanes(width):
        size[w] = e[0, w] = 0.0
    for i in upwards(0, n):
        for j in upwards(0, n):
            for w in lanes(width):
                size[w] = max(size[w], abs(A[i, j, w]))
    for k in upwards(0, max(n, np.uint64(2)) - np.uint64(2)):
        after = k + np.uint64(1)
        for w in lanes(width):
            norm[w] = 0.0
        for i in upwards(after, n):
            for w in lanes(width):
                norm[w] += A[k, i, w] * A[k, i, w]
        # A ← A − v uᵀ − u vᵀ with the reflection 1 − β v vᵀ, but for rows of rounding
        for w in lanes(width):
            length = math.sqrt(norm[w])
            norm[w] = length if length > _NOTHING * size[w] else 0.0
        for w in lanes(width):
            beta[w] = 1.0 / (norm[w] * (norm[w] + abs(A[k, after, w]))) if norm[w] > 0.0 else 0.0
        for w in lanes(width):
            e[after, w] = -norm[w] if A[k, after, w] > 0.0 else norm[w]
        for i in upwards(after, n):
            for w in lanes(width):
                v[i, w] = A[k, i, w]
            for w in lanes(width):
                u[i, w] = 0.0
        for w in lanes(width):
            v[after, w] -= e[after, w]
        _add_product(A, v, after, u, width)
        for w in lanes(width):
            along[w] = 0.0
        for i in upwards(after, n):
            for w in lanes(width):
                u[i, w] *= beta[w]
            for w in lanes(width):
                along[w] += v[i, w] * u[i, w]
        for i in upwards(after, n):
            for w in lanes(width):
                u[i, w] -= beta[w] / 2.0 * along[w] * v[i, w]
        _subtract_products(v, u, after, A, width)
    for i in upwards(0, n):
        for w in lanes(width):
            d[i, w] = A[i, i, w]
    if n > 1:
        for w in lanes(width):
            e[n - 1, w] = A[n - 2, n - 1, w]


@inner
def _add_product(A: Array, v: Array, first: Index, u: Array, width: Width) -> None:
    """Add A v to u (n, W) for symmetric A (n, n, W); rows and columns before ``first`` are ignored.

    This loop has a kernel of its own since LLVM must know that A, v and u do not overlap.
    """
    for i in upwards(first, A.shape[0]):
        for j in upwards(first, A.shape[0]):
            for w in lanes(width):
                u[j, w] += A[i, j, w] * v[i, w]


@inner
def _subtract_products(v: Array, u: Array, first: Index, A: Array, width: Width) -> None:
    """Subtract v uᵀ + u vᵀ from A (n, n, W), but not in rows and columns before ``first``."""
    for i in upwards(first, A.shape[0]):
        for j in upwards(first, A.shape[0]):
            for w in lanes(width):
                A[i, j, w] -= v[i, w] * u[j, w] + u[i, w] * v[j, w]
