"""Compute readings of K_θ (numbers such as ``along``), at one posture or in blocks of postures."""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np

from cdsm._former import readings as kernels
from cdsm._former import tip_stiffness
from cdsm._former.compiling import Width
from cdsm._former.readings import REGULAR, SINGULAR
from cdsm._former.tree import Indices
from cdsm.support.values import Array


def read(
    K: Array,
    parts: Array,
    JX: Array,
    directions: Array,
    wanted: Collection[str],
    status: Indices,
    width: Width,
) -> dict[str, Array]:
    """Compute the wanted readings of B blocks of W postures; set the status of each posture.

    Postures of status UNREAD keep it, and their readings are not valid. If the tip is immobile,
    pseudoinverse and cartesian are NaN. If K_θ is singular, ``along`` is NaN, or infinite in
    directions in which the tip cannot move; compliance and cartesian are not valid.

    Args:
        K: K_θ (B, nv, nv, W); for the pseudoinverse it may be one of its terms.
        parts: P (B, nv, nv, W), the sum of the magnitudes of the four terms.
        JX: J_X (B, 6, nv, W).
        directions: Unit vectors u (D, 3) of ``along``.
        wanted: Any of ``margin``, ``pseudoinverse``, ``along``, ``compliance``, ``cartesian``.
        status: READ or UNREAD (B, W); on return also SINGULAR or IMMOBILE.
        width: W, or None for one posture.

    Returns:
        The wanted readings by name: margin (B, W), pseudoinverse (B, 3, 3, W), along (B, D, W),
        compliance (B, 6, 6, W), cartesian (B, 3, 3, W). If ``along`` is wanted, also ``motion``
        (B, nv, D, W), which is K_θ⁻¹ J_vᵀ u.
    """
    blocks, nv, _, side = K.shape
    found: dict[str, Array] = {}
    if "margin" in wanted:
        found["margin"] = margin = np.empty((blocks, side))
        kernels.set_margins(K, margin, width)
    if "cartesian" in wanted or "pseudoinverse" in wanted:
        left, right = np.empty((blocks, 3, 3, side)), np.empty((blocks, 3, nv, side))
        tip_stiffness.decompose(JX, left, right, status, width)
    if "pseudoinverse" in wanted:
        found["pseudoinverse"] = matrix = np.empty((blocks, 3, 3, side))
        tip_stiffness.set_pseudoinverses(K, left, right, status, matrix, width)
    # columns of the system: K_θ, a probing torque, J_vᵀu, J_Xᵀ, Vᵀ
    first = nv + 1 + ("along" in wanted) * len(directions)
    columns = first + 6 * ("compliance" in wanted) + 3 * ("cartesian" in wanted)
    if columns == nv + 1:
        return found
    system = np.empty((blocks, nv, columns, side))
    if "along" in wanted:
        found["along"] = along = np.empty((blocks, len(directions), side))
        found["motion"] = system[:, :, nv + 1 : first]
        kernels.set_torques(JX, directions, system, along, width)
    if "compliance" in wanted:
        system[:, :, first : first + 6] = JX.swapaxes(1, 2)
    if "cartesian" in wanted:
        system[:, :, -3:] = right.swapaxes(1, 2)
    scale, peak = np.empty((blocks, nv, side)), np.empty((blocks, side))
    if kernels.solve(K, parts, system, status, scale, peak, width):
        _find_singular(K, scale, peak, status)
    if "along" in wanted:
        kernels.set_along(JX, directions, system, status, along, width)
    if "compliance" in wanted:
        found["compliance"] = matrix = np.empty((blocks, 6, 6, side))
        tip_stiffness.set_compliances(JX, system, first, matrix, width)
    if "cartesian" in wanted:
        found["cartesian"] = matrix = np.empty((blocks, 3, 3, side))
        tip_stiffness.set_cartesians(left, right, system, status, matrix, width)
    return found


def _find_singular(K: Array, scale: Array, peak: Array, status: Indices) -> None:
    """Set ``status`` to SINGULAR where K_θ may be singular and its singular values confirm it.

    :func:`~cdsm._former.readings.solve` computes ``scale`` and ``peak``, and marks doubt by
    ``peak`` > 0. Singular values take ten times as long as all the rest, and are rarely needed.
    """
    for b, w in np.argwhere(peak > 0.0):
        if peak[b, w] < math.inf:  # else a joint has zero stiffness in all terms
            scaled = K[b, :, :, w] * scale[b, :, None, w] * scale[b, :, w]
            if np.linalg.svd(scaled)[1][-1] > REGULAR * peak[b, w]:
                continue
        status[b, w] = SINGULAR
