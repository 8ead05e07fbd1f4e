"""Numba kernels of cable lengths and their derivatives: L, J_L and H_L.

A segment between site a and site b has the length ℓ = |b − a|. With u = (b − a)/ℓ and the
derivative d_i = ∂(b − a)/∂θ_i,

    ∂ℓ/∂θ_i = u·d_i,    ∂²ℓ/∂θ_i∂θ_j = (d_i·d_j − (u·d_i)(u·d_j))/ℓ + u·∂²(b − a)/∂θ_i∂θ_j.

Only the joints between the links of a and b change ℓ. A joint on the path to b moves b and has the
sign +; a joint on the path to a moves a and has the sign −. Let x be the site that a joint moves. A
revolute joint with the axis z through o has d = ±z × (x − o), a prismatic joint with the direction
s has d = ±s and z = 0. If joints i and j have the same sign, and j is not nearer to the base than
i, the second derivative of b − a is z_i × d_j; it is 0 if their signs differ.

If j is not nearer to the base than i, the second derivative of ℓ is therefore c_i·d_j, with the
left factor

    c_i = (d_i − (u·d_i) u)/ℓ + u × z_i.

The last term is used only if both joints have the same sign: u·(z_i × d_j) = (u × z_i)·d_j. A left
factor is computed once per joint, and each pair of joints needs one dot product.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm._former.compiling import Index, Width, axes, inlined, inner, lanes, upwards
from cdsm._former.tree import Frames, Indices, Routing
from cdsm.support.values import Array

SHORTEST_SEGMENT = 1e-9
"""Length [m] below which a segment has no direction: its two sites coincide."""


class Segments(NamedTuple):
    """Scratch of one segment in a block of W postures; symbols as at the top of the module."""

    direction: Array  # u (3, W)
    length: Array  # ℓ (W,)
    inverse: Array  # 1/ℓ (W,)
    derivative: Array  # d of one joint (3, W)
    along: Array  # u·d (W,)
    left_factor: Array  # c (3, W)


@inlined
def segment_scratch(nv: int, width: int) -> Segments:
    """Allocate the :class:`Segments` of a block of ``width`` postures."""
    a, vectors, left = np.empty((3, width)), np.empty((2, 3, width)), np.empty((nv, 3, width))
    return Segments(vectors[0], a[0], a[1], vectors[1], a[2], left)


@inlined
def set_direction(site: Array, a: Index, b: Index, scratch: Segments, width: Width) -> None:
    """Fill ``scratch`` with the distance ℓ from site a to site b, 1/ℓ, and the unit vector u."""
    u = scratch.direction
    _set_direction(site[a], site[b], u[0], u[1], u[2], scratch.length, scratch.inverse, width)


@inner
def _set_direction(
    start: Array,
    end: Array,
    x: Array,
    y: Array,
    z: Array,
    length: Array,
    inverse: Array,
    width: Width,
) -> None:
    for w in lanes(width):
        dx, dy, dz = end[0, w] - start[0, w], end[1, w] - start[1, w], end[2, w] - start[2, w]
        distance = math.sqrt(dx * dx + dy * dy + dz * dz)
        over = 1.0 / distance
        x[w], y[w], z[w] = dx * over, dy * over, dz * over
        length[w], inverse[w] = distance, over


@inlined
def set_derivative(
    frames: Frames, sign: float, site: Index, j: Index, d: Array, width: Width
) -> None:
    """Fill d (3, W) with ∂(b − a)/∂θ_j of a segment from site a to site b.

    ``site`` is the end that joint j moves; ``sign`` is 1 if it is b, −1 if it is a.
    """
    point, origin, axis = frames.site[site], frames.origin[j], frames.axis[j]
    _set_derivative(point, origin, axis, sign, d[0], d[1], d[2], width)
    if frames.slide.shape[0]:
        _add_slide(frames.slide[j], sign, d, width)


@inner
def _set_derivative(
    point: Array,
    origin: Array,
    axis: Array,
    sign: float,
    dx: Array,
    dy: Array,
    dz: Array,
    width: Width,
) -> None:
    for w in lanes(width):
        x, y = sign * (point[0, w] - origin[0, w]), sign * (point[1, w] - origin[1, w])
        z = sign * (point[2, w] - origin[2, w])
        dx[w] = axis[1, w] * z - axis[2, w] * y
        dy[w] = axis[2, w] * x - axis[0, w] * z
        dz[w] = axis[0, w] * y - axis[1, w] * x


@inner
def _add_slide(slide: Array, sign: float, d: Array, width: Width) -> None:
    for r in axes(d.shape[0], width):
        for w in lanes(width):
            d[r, w] += sign * slide[r, w]


@inner
def _add_rate(
    u: Array, point: Array, origin: Array, axis: Array, sign: float, rate: Array, width: Width
) -> None:
    """Add u·d to ``rate`` (W,), with d = ±z × (x − o) of a revolute joint.

    u is the unit vector from site a to site b. ``point`` is x, the site that the joint moves;
    ``sign`` is 1 if it is b, −1 if it is a. ``origin`` is o, ``axis`` is z. Vectors are (3, W).
    """
    for w in lanes(width):
        x, y = sign * (point[0, w] - origin[0, w]), sign * (point[1, w] - origin[1, w])
        z = sign * (point[2, w] - origin[2, w])
        rate[w] += (
            u[0, w] * (axis[1, w] * z - axis[2, w] * y)
            + u[1, w] * (axis[2, w] * x - axis[0, w] * z)
            + u[2, w] * (axis[0, w] * y - axis[1, w] * x)
        )


@inner
def _add_slide_rate(u: Array, slide: Array, sign: float, rate: Array, width: Width) -> None:
    """Add u·d to ``rate`` (W,), with d = ``sign`` · s of a prismatic joint.

    u is the unit vector along the segment, and s the direction ``slide`` of the joint, (3, W) each.
    """
    for w in lanes(width):
        rate[w] += sign * (u[0, w] * slide[0, w] + u[1, w] * slide[1, w] + u[2, w] * slide[2, w])


@inner
def _set_factors(
    point: Array,
    origin: Array,
    axis: Array,
    u: Array,
    inverse: Array,
    sign: float,
    weight: Array,
    dx: Array,
    dy: Array,
    dz: Array,
    cx: Array,
    cy: Array,
    cz: Array,
    width: Width,
) -> None:
    """Fill the components (W,) of d = ±z × (x − o), and of ``weight`` times the left factor c.

    c = (d − (u·d) u)/ℓ + u × z. ``inverse`` (W,) is 1/ℓ, ``axis`` is z, ``point`` is x and
    ``origin`` is o, as at the top of the module.
    """
    for w in lanes(width):
        x, y = sign * (point[0, w] - origin[0, w]), sign * (point[1, w] - origin[1, w])
        z = sign * (point[2, w] - origin[2, w])
        ex, ey = axis[1, w] * z - axis[2, w] * y, axis[2, w] * x - axis[0, w] * z
        ez = axis[0, w] * y - axis[1, w] * x
        along = u[0, w] * ex + u[1, w] * ey + u[2, w] * ez
        dx[w], dy[w], dz[w] = ex, ey, ez
        cx[w] = weight[w] * (
            (ex - along * u[0, w]) * inverse[w] + u[1, w] * axis[2, w] - u[2, w] * axis[1, w]
        )
        cy[w] = weight[w] * (
            (ey - along * u[1, w]) * inverse[w] + u[2, w] * axis[0, w] - u[0, w] * axis[2, w]
        )
        cz[w] = weight[w] * (
            (ez - along * u[2, w]) * inverse[w] + u[0, w] * axis[1, w] - u[1, w] * axis[0, w]
        )


@inner
def _add_slide_factor(
    slide: Array, u: Array, inverse: Array, sign: float, weight: Array, c: Array, width: Width
) -> None:
    """Add ``weight`` times ±(s − (u·s) u)/ℓ, of a prismatic joint, to the left factor c (3, W).

    s is the direction ``slide`` of the joint, and ``inverse`` (W,) is 1/ℓ.
    """
    for r in axes(c.shape[0], width):
        for w in lanes(width):
            along = u[0, w] * slide[0, w] + u[1, w] * slide[1, w] + u[2, w] * slide[2, w]
            c[r, w] += weight[w] * (sign * (slide[r, w] - along * u[r, w]) * inverse[w])


@inner
def set_lengths(
    routing: Routing,
    frames: Frames,
    scratch: Segments,
    lengths: Array,
    jacobian: Array,
    shortest: Array,
    width: Width,
) -> None:
    """Fill L (C, W) [m], J_L ``jacobian`` (C, nv, W), and the length of the shortest segment (W,).

    Where two sites coincide, L and J_L of the posture are meaningless.
    """
    segment, joint, (u, length, _, _, _, _) = routing.segment, routing.joint, scratch
    origin, axis, slide, site = frames
    for c in upwards(0, lengths.shape[0]):
        for w in lanes(width):
            lengths[c, w] = routing.fixed[c]
        for j in upwards(0, jacobian.shape[1]):
            for w in lanes(width):
                jacobian[c, j, w] = 0.0
    for w in lanes(width):
        shortest[w] = math.inf
    for s in range(segment.shape[0] - 1):
        cable, a, b = np.uint64(segment[s, 0]), np.uint64(segment[s, 1]), np.uint64(segment[s, 2])
        set_direction(site, a, b, scratch, width)
        for w in lanes(width):
            lengths[cable, w] += length[w]
        for w in lanes(width):
            shortest[w] = min(shortest[w], length[w])
        for t in range(segment[s, 3], segment[s + 1, 3]):
            j, column = np.uint64(joint[t]), np.uint64(joint[t] - 1)
            sign, moved = (1.0, b) if t >= segment[s, 4] else (-1.0, a)
            _add_rate(u, site[moved], origin[j], axis[j], sign, jacobian[cable, column], width)
            if slide.shape[0]:
                _add_slide_rate(u, slide[j], sign, jacobian[cable, column], width)


@inner
def add_length_hessian(
    segment: Indices,
    joint: Indices,
    frames: Frames,
    weight: Array,
    slot: Indices,
    scratch: Segments,
    hessian: Array,
    width: Width,
) -> None:
    """Add weight[c] ∂²L_c/∂θ_i∂θ_j to hessian[slot[c], i, j] of every cable c, for i ≤ j only.

    ``weight`` is (C, W), ``slot`` (C,), and ``hessian`` (slots, nv, nv, W). For H_L·F, the weight
    is F and all slots are 0. For the tensor H_L, the weight is 1 and cable c has slot c.
    """
    u, _, inverse, d, _, left = scratch
    origin, axis, slide, site = frames
    for s in range(segment.shape[0] - 1):
        cable, a, b = np.uint64(segment[s, 0]), np.uint64(segment[s, 1]), np.uint64(segment[s, 2])
        first, split, end = segment[s, 3], segment[s, 4], segment[s + 1, 3]
        set_direction(site, a, b, scratch, width)
        for t in range(first, end):
            j, own = np.uint64(joint[t]), np.uint64(t - first)
            if t == split:  # the joints before it are on the other side: no u × z_i
                for k in upwards(0, split - first):
                    i = np.uint64(joint[first + np.intp(k)])
                    for r in axes(u.shape[0], width):
                        p, q = (r + 1) % 3, (r + 2) % 3
                        for w in lanes(width):
                            left[k, r, w] -= weight[cable, w] * (
                                u[p, w] * axis[i, q, w] - u[q, w] * axis[i, p, w]
                            )
            sign, moved = (1.0, b) if t >= split else (-1.0, a)
            c, ends = left[own], (site[moved], origin[j], axis[j], u, inverse)
            _set_factors(*ends, sign, weight[cable], d[0], d[1], d[2], c[0], c[1], c[2], width)
            if slide.shape[0]:
                _add_slide(slide[j], sign, d, width)
                _add_slide_factor(slide[j], u, inverse, sign, weight[cable], left[own], width)
            # pair joint j with itself and all joints before it, also those of the other side
            for k in upwards(0, t + 1 - first):
                i = np.uint64(joint[first + np.intp(k)])
                row, column = min(i, j) - np.uint64(1), max(i, j) - np.uint64(1)
                own_slot = np.uint64(slot[cable])
                for w in lanes(width):
                    hessian[own_slot, row, column, w] += (
                        left[k, 0, w] * d[0, w] + left[k, 1, w] * d[1, w] + left[k, 2, w] * d[2, w]
                    )
