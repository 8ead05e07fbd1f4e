"""Numba kernels of cables as chains of segments: lengths, wrap angles and their gradients.

These kernels treat each of the S segments as a cable of its own. So ``segments.py`` computes their
lengths and derivatives: L is then l (S,), J_L is ∂l/∂θ (S, nv), and H_L·F is Σ T_j ∂²l_j/∂θ².

The wrap angle φ of a hole is the angle between the directions u and v of the cable before and after
it, φ = atan2(|u × v|, u·v). With the unit vectors p ⊥ u and q ⊥ v in their plane,

    ∂φ/∂θ_i = −(p·d_i/ℓ_u + q·e_i/ℓ_v),   p = ((u × v) × u)/|u × v|,   q = (v × (u × v))/|u × v|.

The segments before and after the hole have the lengths ℓ_u and ℓ_v. d_i and e_i are the derivatives
with respect to θ_i of the vectors along them (end minus start), seen from the link of the hole.
Where the cable goes straight through, φ has a kink: it grows like |a·δθ| with some vector a. There
the gradient is set to 0, the mean of both sides.
"""

from __future__ import annotations

import math

import numpy as np

from cdsm._former.compiling import inner, threaded
from cdsm._former.motion import cross, dot
from cdsm._former.segments import (
    Segments,
    segment_scratch,
    set_derivative,
    set_direction,
)
from cdsm._former.tree import Frames, Indices, Routing, Tree, empty_frames, forward_kinematics
from cdsm.support.values import Array

STRAIGHT = 1e-9
"""Wrap angle [rad] below which a cable counts as straight in a hole: the angle is rounding."""


@inner
def _set_wraps(
    span: Indices,
    joint: Indices,
    hole: Indices,
    own: Array,
    frames: Frames,
    before: Segments,
    after: Segments,
    wrap: Array,
    gradient: Array,
) -> None:
    """Fill ``wrap`` (P,) with φ [rad] of every hole of one posture; add ∂φ/∂θ to ``gradient``.

    Segment s is between the sites 2 s and 2 s + 1; ``hole`` (P,) is the segment before each hole.
    ``joint`` lists the joints between both ends of a segment, one segment after the other. ``span``
    (S, 3) has three indices in ``joint`` for each segment: of its first joint, of its first joint
    on the path to its second site, and of the end. ``own`` (P,) is a constant angle added to φ
    [rad]. ``gradient`` is (P, nv), zero on entry.
    """
    u, v = before.direction.reshape(3), after.direction.reshape(3)
    normal, arm = np.empty(3), np.empty(3)
    for h in range(hole.shape[0]):
        first, middle, second = 2 * hole[h], 2 * hole[h] + 1, 2 * hole[h] + 3
        set_direction(frames.site, first, middle, before, None)
        set_direction(frames.site, middle, second, after, None)
        cross(u, v, normal)
        sine = math.sqrt(dot(normal, normal))
        wrap[h] = math.atan2(sine, dot(u, v)) + own[h]
        for side in range(2):  # p and d of the segment before the hole, then q and e
            far, scratch, sign = (first, before, 1.0) if side == 0 else (second, after, -1.0)
            scale = scratch.inverse[0] / sine if sine > STRAIGHT else 0.0
            cross(normal, scratch.direction.reshape(3), arm)
            for r in range(3):
                arm[r] *= sign * scale
            row = hole[h] + side
            for t in range(span[row, 0], span[row, 2]):
                d, j = scratch.derivative, joint[t]
                set_derivative(frames, 1.0 if t >= span[row, 1] else -1.0, far, j, d, None)
                gradient[h, j - 1] -= dot(arm, d.reshape(3))


@threaded
def grip_rows(
    tree: Tree,
    routing: Routing,
    hole: Indices,
    own: Array,
    cable: Indices,
    friction: Array,
    q: Array,
    grip: Array,
) -> None:
    """Fill ``grip`` (B, C) [-] with Σ μ φ over the holes of each cable at angles q (B, nv) [rad].

    In ``routing``, each segment is a cable. Four arrays (P,) describe the holes: the segment before
    the hole (``hole``), the constant angle [rad] added to its wrap angle φ (``own``), its cable,
    and its friction coefficient μ.
    """
    rows, nv = q.shape
    before, after = segment_scratch(nv, 1), segment_scratch(nv, 1)
    frames = empty_frames(tree, routing, 1)
    rotation = np.empty((tree.parent.shape[0], 3, 3, 1))
    wrap, gradient = np.empty(hole.shape[0]), np.empty((hole.shape[0], 0))
    span = np.zeros((routing.fixed.shape[0], 3), dtype=np.intp)  # no joints: no gradient
    for n in range(rows):
        angles = q[n].copy().reshape(nv, 1)
        forward_kinematics(tree, routing, angles, np.empty((2, 1)), rotation, frames, None)
        _set_wraps(span, routing.joint, hole, own, frames, before, after, wrap, gradient)
        grip[n] = 0.0
        for h in range(hole.shape[0]):
            grip[n, cable[h]] += friction[h] * wrap[h]
