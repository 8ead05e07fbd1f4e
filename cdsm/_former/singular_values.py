"""Numba kernel of the singular values of matrices of three rows; the last axis is the posture.

Microseconds for one matrix (3, n) alone / in a block of 32 / in LAPACK called from a kernel:

    n         5               10               20               40
    0.8 / 0.2 / 3.1  1.2 / 0.3 / 3.2  1.2 / 0.5 / 3.3  1.9 / 0.8 / 4.2
"""

from __future__ import annotations

import math

from cdsm._former.compiling import Index, Width, inner, lanes, upwards
from cdsm.support.values import Array

_SWEEPS = 30
"""Largest number of sweeps of Jacobi rotations; five or six are enough to converge."""

_ROUNDING = 2.0**-52


@inner
def singular_values(rows: Array, left: Array, values: Array, scratch: Array, width: Width) -> None:
    """Compute the singular value decomposition U S V of matrices ``rows`` (3, n, W).

    ``left`` (3, 3, W) becomes U, ``rows`` becomes V, and ``values`` (3, W) the diagonal of S, not
    sorted. Jacobi rotations make the rows orthogonal; rows of length zero stay zero. ``scratch`` is
    (5, W).
    """
    aa, bb, ab, cosine, sine = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4]
    for i in upwards(0, left.shape[0]):
        for j in upwards(0, left.shape[0]):
            for w in lanes(width):
                left[i, j, w] = 1.0 if i == j else 0.0
    for _ in range(_SWEEPS):
        turned = 0.0
        for a, b in ((0, 1), (0, 2), (1, 2)):
            _set_product(rows, a, a, aa, width)
            _set_product(rows, b, b, bb, width)
            _set_product(rows, a, b, ab, width)
            for w in lanes(width):
                # orthogonal to rounding, or one row is zero to rounding
                product, largest = math.sqrt(aa[w] * bb[w]), max(aa[w], bb[w])
                negligible = _ROUNDING * max(product, _ROUNDING * largest)
                zeta = (bb[w] - aa[w]) / (2.0 * ab[w])
                tangent = math.copysign(1.0, zeta) / (abs(zeta) + math.sqrt(1.0 + zeta * zeta))
                turns = abs(ab[w]) > negligible
                cosine[w] = 1.0 / math.sqrt(1.0 + tangent * tangent) if turns else 1.0
                sine[w] = cosine[w] * tangent if turns else 0.0
                turned = max(turned, abs(sine[w]))
            for k in upwards(0, rows.shape[1]):
                for w in lanes(width):
                    p, r = rows[a, k, w], rows[b, k, w]
                    rows[a, k, w] = cosine[w] * p - sine[w] * r
                    rows[b, k, w] = sine[w] * p + cosine[w] * r
            for j in upwards(0, left.shape[0]):
                for w in lanes(width):
                    p, r = left[j, a, w], left[j, b, w]
                    left[j, a, w] = cosine[w] * p - sine[w] * r
                    left[j, b, w] = sine[w] * p + cosine[w] * r
        if turned == 0.0:
            break
    for a in range(left.shape[0]):
        _set_product(rows, a, a, aa, width)
        for w in lanes(width):
            values[a, w] = math.sqrt(aa[w])
        for w in lanes(width):
            bb[w] = 1.0 / values[a, w] if values[a, w] > 0.0 else 1.0
        for k in upwards(0, rows.shape[1]):
            for w in lanes(width):
                rows[a, k, w] *= bb[w]


@inner
def _set_product(rows: Array, a: Index, b: Index, product: Array, width: Width) -> None:
    """Fill product (W,) with the dot product of rows a and b of ``rows`` (3, n, W)."""
    for w in lanes(width):
        product[w] = 0.0
    for j in upwards(0, rows.shape[1]):
        for w in lanes(width):
            product[w] += rows[a, j, w] * rows[b, j, w]
