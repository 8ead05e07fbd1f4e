"""Derivatives of Σ μ φ of each cable: friction coefficient μ times wrap angle φ, over its holes.

Friction narrows the bounds of the tension of a cable by the factor exp(Σ μ φ).

A cable runs from a point a through a hole b to a point c. Its segments have the unit directions u
and v and the lengths ℓ_u and ℓ_v. If the points move by da, db and dc, the wrap angle φ of the hole
changes by the formula of :class:`~cdsm.segments.Segments`,

    dφ = −(p·(db − da)/ℓ_u + q·(dc − db)/ℓ_v),

with p = ((u × v) × u)/|u × v| and q = (v × (u × v))/|u × v|.

Where the cable goes straight through, φ has a kink, and dφ = 0 is taken: the mean of both sides.
"""

from __future__ import annotations

import numpy as np

from cdsm._former.arm_arrays import kernel_arrays
from cdsm.posture import Posture
from cdsm.segments import STRAIGHT
from cdsm.support.values import Array
from cdsm.uncertainties.inputs import Inputs, Places, rotations


def grip_slopes(pose: Posture, inputs: Inputs, moved: Places, turned: Array) -> Array:
    """Compute the derivatives (C, n) of Σ μ φ [-] of each cable with respect to n variables.

    Args:
        pose: The posture.
        inputs: The inputs of the arm.
        moved: Derivatives (n, …, 3) of all points with respect to the variables, in the frames of
            their joints.
        turned: Derivatives (nv, n) of the joint angles with respect to the variables.
    """
    segments, first = pose.segments, inputs.first
    chains, site = segments.chains, segments._sites.T
    along = site[1::2] - site[::2]
    length = np.linalg.norm(along, axis=1)
    u, v = (along[s] / length[s, None] for s in (chains.hole, chains.hole + 1))
    normal = np.cross(u, v)
    sine = np.linalg.norm(normal, axis=1)
    normal /= np.where(sine > STRAIGHT, sine, np.inf)[:, None]
    p, q = np.cross(normal, u), np.cross(v, normal)
    motion = _motion(pose, moved)
    at = first[chains.cable[chains.hole]] + chains.site
    # a lead moves along with the first site, so its direction stays
    before = motion[:, at] - motion[:, np.where(chains.site > 0, at - 1, at)]
    after = motion[:, at + 1] - motion[:, at]
    slopes = -(
        np.einsum("hr,nhr->hn", p / length[chains.hole, None], before)
        + np.einsum("hr,nhr->hn", q / length[chains.hole + 1, None], after)
    )
    slopes += segments.wrap_jacobian @ turned
    total = np.zeros((len(pose.arm.cables), slopes.shape[1]))
    np.add.at(total, chains.cable[chains.hole], chains.friction[:, None] * slopes)
    return total


def _motion(pose: Posture, moved: Places) -> Array:
    """Return the derivatives (n, P, 3) of the P cable sites in base axes, at constant angles."""
    tree, row = kernel_arrays(pose.arm).tree, pose.arm._routing.row
    rotation, origin = rotations(pose), np.zeros_like(moved.origin)
    for i in tree.order.tolist():
        before = tree.parent[i]
        origin[:, i] = origin[:, before] + moved.origin[:, i] @ rotation[before].T
    return np.asarray(origin[:, row] + np.einsum("prs,nps->npr", rotation[row], moved.site))
