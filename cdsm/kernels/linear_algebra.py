"""Numba kernels of dense linear algebra for matrices too small for LAPACK.

A LAPACK with its own threads also competes for cores with the threads that run these kernels: the
inverse of an 80×80 matrix then took 16 ms. Microseconds here / in LAPACK called from a kernel:

    n                                        2         5        10        20        40        80
    linear system, ten right sides   0.1 / 0.5 0.3 / 0.9 0.5 / 1.8 2.0 / 4.5  9.0 / 13   55 / 45
    smallest eigenvalue              0.1 / 0.3 0.4 / 1.4 1.3 / 3.8 4.6 / 13    21 / 51 188 / 370
    singular values of three rows    0.5 / 1.7 0.4 / 3.1 0.4 / 3.2 0.6 / 3.3 0.8 / 4.2 1.5 / 8.8

An arm of five universal joints has ten columns; one posture of a batch then takes 5 µs in total.
"""

from __future__ import annotations

import math

from cdsm.kernels.compiling import compiled, upwards
from cdsm.support.values import Array

_SWEEPS = 30
"""Largest number of sweeps of Jacobi rotations; five or six are enough to converge."""

_STEPS = 200
"""Largest number of Laguerre steps; simple eigenvalues take five, n-fold ones about twenty."""

_ROUNDING = 2.0**-52

_NOTHING = 1e-30
"""Off-diagonal entries below this part of the largest entry do not change any eigenvalue."""


@compiled
def eliminate(M: Array) -> float:
    """Solve A X = B: replace the columns B, right of A (n, n) in M (n, n + …), by A⁻¹ B.

    Returns:
        Smallest over largest pivot, with row exchanges; 0 if a pivot is zero, and B is then
        unfinished.
    """
    n, width = M.shape
    smallest, largest = math.inf, 0.0
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(M[i, k]) > abs(M[best, k]):
                best = i
        pivot = abs(M[best, k])
        smallest, largest = min(smallest, pivot), max(largest, pivot)
        if pivot == 0.0:
            return 0.0
        if best != k:
            for j in upwards(k, width):
                M[k, j], M[best, j] = M[best, j], M[k, j]
        inverse = 1.0 / M[k, k]
        for i in range(k + 1, n):
            factor = M[i, k] * inverse
            for j in upwards(k + 1, width):
                M[i, j] -= factor * M[k, j]
    for k in range(n - 1, -1, -1):
        inverse = 1.0 / M[k, k]
        for j in upwards(n, width):
            M[k, j] *= inverse
        for i in range(k):
            factor = M[i, k]
            for j in upwards(n, width):
                M[i, j] -= factor * M[k, j]
    return smallest / largest


@compiled
def smallest_eigenvalue(A: Array, scratch: Array) -> float:
    """Compute the smallest eigenvalue of a symmetric A (n, n); overwrite A; scratch is (4, n).

    Householder reflections make A tridiagonal. Laguerre's method then converges from below to the
    smallest root of the characteristic polynomial. It never passes the root, since all roots are
    real.
    """
    n = A.shape[0]
    d, e = scratch[0], scratch[1]
    _tridiagonalise(A, d, e, scratch[2], scratch[3])
    scale = x = 0.0
    for i in range(n):
        radius = abs(e[i]) + (abs(e[i + 1]) if i + 1 < n else 0.0)
        scale = max(scale, abs(d[i]) + radius)
        x = min(x, d[i] - radius) if i else d[i] - radius  # Gershgorin
    x -= _ROUNDING * scale
    for _ in range(_STEPS):
        # ratios g of the leading minors, and logarithmic derivatives of the last minor:
        # G = Σ 1/(λ − x), H = Σ 1/(λ − x)²
        inverse = slope = bend = G = H = 0.0
        for i in range(n):
            square = e[i] * e[i]
            # inverse, slope and bend are 1/g, g′/g and g″/g of the row above
            first = -1.0 + square * inverse * slope
            second = square * inverse * (bend - 2.0 * slope * slope)
            g = d[i] - x - square * inverse
            if g <= 0.0:  # only rounding passes the root
                return x
            inverse = 1.0 / g
            slope, bend = first * inverse, second * inverse
            G -= slope
            H += slope * slope - bend
        step = n / (G + math.sqrt(max((n - 1) * (n * H - G * G), 0.0)))
        x += step
        if step <= _ROUNDING * scale:
            break
    return x


@compiled
def _tridiagonalise(A: Array, d: Array, e: Array, v: Array, w: Array) -> None:
    """Fill diagonal d (n,) and off-diagonal e (n,) of a similar tridiagonal matrix; e[0] is 0."""
    n, size = A.shape[0], 0.0
    for i in range(n):
        for j in upwards(0, n):
            size = max(size, abs(A[i, j]))
    e[0] = 0.0
    for k in range(n - 2):
        d[k] = A[k, k]
        norm = 0.0
        for i in range(k + 1, n):
            norm += A[k, i] * A[k, i]
        norm = math.sqrt(norm)
        if norm <= _NOTHING * size:  # its square may be too small for a division
            e[k + 1] = 0.0
            continue
        alpha = -norm if A[k, k + 1] > 0.0 else norm
        e[k + 1] = alpha
        # A ← A − v wᵀ − w vᵀ with the reflection 1 − β v vᵀ
        beta = 1.0 / (norm * (norm + abs(A[k, k + 1])))
        for i in range(k + 1, n):
            v[i] = A[k, i]
            w[i] = 0.0
        v[k + 1] -= alpha
        for i in range(k + 1, n):
            for j in upwards(k + 1, n):
                w[j] += A[i, j] * v[i]
        along = 0.0
        for i in range(k + 1, n):
            w[i] *= beta
            along += v[i] * w[i]
        along *= beta / 2.0
        for i in range(k + 1, n):
            w[i] -= along * v[i]
        for i in range(k + 1, n):
            for j in upwards(k + 1, n):
                A[i, j] -= v[i] * w[j] + w[i] * v[j]
    if n > 1:
        d[n - 2], e[n - 1] = A[n - 2, n - 2], A[n - 2, n - 1]
    d[n - 1] = A[n - 1, n - 1]


@compiled
def singular_values(rows: Array, left: Array, values: Array) -> None:
    """Replace three rows (3, n) by left (3, 3) and values (3,) times orthonormal rows.

    Jacobi rotations make the rows orthogonal. They are not sorted, and rows of length zero stay
    zero.
    """
    n = rows.shape[1]
    for i in range(3):
        for j in range(3):
            left[i, j] = 1.0 if i == j else 0.0
    for _ in range(_SWEEPS):
        turned = False
        for a in range(2):
            for b in range(a + 1, 3):
                aa = bb = ab = 0.0
                for j in range(n):
                    aa += rows[a, j] * rows[a, j]
                    bb += rows[b, j] * rows[b, j]
                    ab += rows[a, j] * rows[b, j]
                # orthogonal to rounding, or one row is zero to rounding
                negligible = max(math.sqrt(aa * bb), _ROUNDING * max(aa, bb))
                if abs(ab) <= _ROUNDING * negligible:
                    continue
                zeta = (bb - aa) / (2.0 * ab)
                tangent = math.copysign(1.0, zeta) / (abs(zeta) + math.sqrt(1.0 + zeta * zeta))
                cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
                sine = cosine * tangent
                turned = True
                for j in range(n):
                    p, r = rows[a, j], rows[b, j]
                    rows[a, j], rows[b, j] = cosine * p - sine * r, sine * p + cosine * r
                for j in range(3):
                    p, r = left[j, a], left[j, b]
                    left[j, a], left[j, b] = cosine * p - sine * r, sine * p + cosine * r
        if not turned:
            break
    for a in range(3):
        square = 0.0
        for j in range(n):
            square += rows[a, j] * rows[a, j]
        values[a] = math.sqrt(square)
        if square > 0.0:
            inverse = 1.0 / values[a]
            for j in range(n):
                rows[a, j] *= inverse
