"""Numba kernel of cosine and sine for blocks of postures (last axis).

The C library takes one angle at a time, and its last bit depends on the machine. The polynomials
and the constants are those of FreeBSD's ``k_sin.c``, ``k_cos.c`` and ``e_rem_pio2.c``. The error is
below 1.2e-16.
"""

from __future__ import annotations

import math

from cdsm._former.compiling import Width, inner, lanes
from cdsm.support.values import Array

_FAR = 1e5
"""Angle [rad] above which the C library computes; the reduction is exact up to 1e6."""

_TO_WHOLE = 1.5 * 2.0**52
"""Adding this number and subtracting it again rounds to a whole number."""

_INVERSE = 6.36619772367581382433e-01
"""2/π."""

_RIGHT, _REST = 1.57079632673412561417e00, 6.07710050650619224932e-11
"""π/2 as a sum: its first 33 bits, whose small multiples are exact, and the rest."""


_S6, _C6 = 1.58969099521155010221e-10, -1.13596475577881948265e-11
"""Last coefficients of the polynomials."""


@inner
def set_cosine_sine(angle: Array, cosine: Array, sine: Array, width: Width) -> None:
    """Fill ``cosine`` and ``sine`` (W,) with the cosine and sine of ``angle`` (W,) [rad]."""
    for w in lanes(width):
        # the angle is that many right angles, and x + tail
        turns = (angle[w] * _INVERSE + _TO_WHOLE) - _TO_WHOLE
        near, small = angle[w] - turns * _RIGHT, turns * _REST
        x = near - small
        tail, z = (near - x) - small, x * x
        s = z * (2.75573137070700676789e-06 + z * (-2.50507602534068634195e-08 + z * _S6))
        s = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + s)
        s = x + (x * z * (-1.66666666666666324348e-01 + z * s) + tail)
        c = z * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * _C6))
        c = -1.38888888888741095749e-03 + z * (2.48015872894767294178e-05 + c)
        c = z * z * (4.16666666666666019037e-02 + z * c) - x * tail
        main = 1.0 - 0.5 * z
        c = main + (((1.0 - main) - 0.5 * z) + c)
        # −2 to 2 right angles beyond whole turns
        quarter = turns - 4.0 * ((0.25 * turns + _TO_WHOLE) - _TO_WHOLE)
        sign = 1.0 - abs(quarter)
        odd = sign == 0.0
        cosine[w] = -quarter * s if odd else sign * c
        sine[w] = quarter * c if odd else sign * s
    for w in lanes(width):
        if abs(angle[w]) > _FAR:
            cosine[w], sine[w] = math.cos(angle[w]), math.sin(angle[w])
