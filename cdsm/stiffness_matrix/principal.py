"""Principal stiffness: the smallest and the largest stiffness of the tip, with directions."""

from __future__ import annotations

import numpy as np

from cdsm.support.values import Array

RIGID = 1e-12
"""Ratio of smallest to largest compliance below which the largest stiffness is returned as inf.

An eigenvalue is accurate to 1e-16 of the largest one. Below the ratio, the smallest one has fewer
than 4 correct digits.
"""


def principal_stiffness(compliance: Array) -> dict[str, Array]:
    """Compute the smallest and the largest stiffness 1/(uᵀ C_vv u) of all unit vectors u.

    They are the inverse eigenvalues of the symmetric part of C_vv.

    Args:
        compliance: C_vv (..., 3, 3) [m/N], positive semidefinite, as for stable arms.

    Returns:
        Values by name. ``softest`` and ``stiffest`` [N/m] are the smallest and the largest
        stiffness, inf where the tip cannot move in that direction; ``softest_direction`` and
        ``stiffest_direction`` are (..., 3). ``isotropy`` is softest/stiffest, or 1 if the tip
        cannot move at all.
    """
    values, vectors = np.linalg.eigh((compliance + compliance.swapaxes(-1, -2)) / 2.0)
    most = values[..., 2]
    softest, stiffest = np.full_like(most, np.inf), np.full_like(most, np.inf)
    np.divide(1.0, most, out=softest, where=most > 0.0)
    np.divide(1.0, values[..., 0], out=stiffest, where=values[..., 0] > RIGID * most)
    isotropy = np.ones_like(most)  # value for a tip that cannot move at all
    np.divide(softest, stiffest, out=isotropy, where=most > 0.0)
    return {
        "softest": softest,
        "stiffest": stiffest,
        "isotropy": isotropy,
        "softest_direction": _positive(vectors[..., 2]),
        "stiffest_direction": _positive(vectors[..., 0]),
    }


def _positive(directions: Array) -> Array:
    """Return each direction u (..., 3) with the sign that makes its largest component positive."""
    largest = np.take_along_axis(directions, abs(directions).argmax(-1)[..., None], -1)
    return np.asarray(directions * np.sign(largest))
