"""Wrench closure, tension factor (evenness of the tensions), principal tip stiffness, isotropy."""

from __future__ import annotations

import numpy as np

from cdsm.errors import InvalidInput, solver_failed
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness
from cdsm.stiffness_matrix.verdict import describe_buckling
from cdsm.support.validation import instance
from cdsm.support.values import Array
from cdsm.tension.solvers import minimise

_CLOSED = 1e-9  # smaller ratios are rounding of the linear program


def tension_factor(pose: Posture) -> float:
    """Compute the tension factor [-]: the largest min(F)/max(F) of F ≥ 0 with `J_Lᵀ F = 0`.

    It is 1 if equal tensions cause no joint torque. Above 0 the arm has wrench closure: unlimited
    tensions can balance every joint torque (Gouttefarde and Gosselin, IEEE T-RO 22, 2006). Pham,
    Yeo, Yang and Chen, Robotics and Autonomous Systems 57 (2009), use the ratio of one solution, so
    their factor may be smaller. Raises CdsmError if the linear program fails.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> round(cdsm.tension_factor(pose), 4)
        0.9233
    """
    J = instance("pose", pose, Posture).length_jacobian
    count, nv = J.shape
    if np.linalg.matrix_rank(J) < nv:
        return 0.0
    solution = minimise(  # variables: F, then its least entry
        np.append(np.zeros(count), -1.0),
        A_eq=np.column_stack([J.T / abs(J).max(), np.zeros(nv)]),
        b_eq=np.zeros(nv),
        A_ub=np.column_stack([-np.eye(count), np.ones(count)]),
        b_ub=np.zeros(count),
        bounds=(0.0, 1.0),
    )
    if not solution.ok:
        raise solver_failed("highs", f"finds no tension factor: {solution.message}")
    ratio = float(solution.x[-1])
    return ratio if ratio > _CLOSED else 0.0


def isotropy(stiffness: Stiffness) -> float:
    """Compute the ratio of the least to the largest tip stiffness of all directions, 0 to 1 [-].

    The stiffness along u is `1/(uᵀ C_vv u)`, Eq. 20. The ratio is 0 if the stiffness is infinite in
    some directions, and 1 if it is infinite in all. Raises InvalidInput if the arm is unstable, and
    SingularStiffness if `K_θ` is singular.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0))
        >>> round(cdsm.isotropy(K), 4)
        0.0229
    """
    K = instance("stiffness", stiffness, Stiffness)
    if K.margin < 0.0:
        raise InvalidInput("stiffness", f"has no isotropy: {describe_buckling(K)}.")
    return float(principal_stiffness(K.compliance[:3, :3])["isotropy"])


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
    softest = np.full_like(most, np.inf)
    stiffest = np.full_like(most, np.inf)
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
