"""Numba kernel of the clearances of cables: from each other, from links, from the rims of disks.

A cable is a chain of straight segments. A link is a straight round bar, its backbone ("bone"). A
disk is a flat circular plate. The distances of two segments, and of a segment and a disk, are
minima of convex functions.
"""

from __future__ import annotations

import math

import numpy as np

from cdsm._former.compiling import inner, threaded
from cdsm._former.tree import Indices, Routing, Tree, empty_frames, forward_kinematics
from cdsm.support.values import Array

_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
_CUTS = 40
"""Steps of the golden-section search: it finds the nearest point to 4e-9 of a segment's length."""


@inner
def _between(p: Array, q: Array, r: Array, s: Array) -> float:
    """Compute the distance [m] between the segments pq and rs; their ends are (3,) [m]."""
    a = b = c = d = e = 0.0
    for i in range(3):
        u, v, w = q[i] - p[i], s[i] - r[i], p[i] - r[i]
        a += u * u
        b += u * v
        c += v * v
        d += u * w
        e += v * w
    # nearest point of the first line, then of the second segment, then of the first again
    det = a * c - b * b
    t = min(max((b * e - c * d) / det, 0.0), 1.0) if det > 1e-14 * a * c else 0.0
    k = min(max((b * t + e) / c, 0.0), 1.0) if c > 0.0 else 0.0
    t = min(max((b * k - d) / a, 0.0), 1.0) if a > 0.0 else 0.0
    square = 0.0
    for i in range(3):
        way = p[i] + t * (q[i] - p[i]) - r[i] - k * (s[i] - r[i])
        square += way * way
    return math.sqrt(square)


@inner
def _to_disk(p: Array, q: Array, centre: Array, axis: Array, radius: float) -> float:
    """Compute the distance [m] of segment pq from a disk.

    If pq pierces the disk, the result is negative: its size is the distance of the piercing point
    from the rim. The disk is flat, with a ``centre`` (3,) [m], a unit normal ``axis`` (3,) and a
    ``radius`` [m].
    """
    z0 = z1 = 0.0
    for i in range(3):
        z0 += (p[i] - centre[i]) * axis[i]
        z1 += (q[i] - centre[i]) * axis[i]
    if z0 * z1 < 0.0:
        out = _radius(p, q, centre, axis, z0 / (z0 - z1))
        if out < radius:
            return out - radius
    disk, low, high, a, b = (p, q, centre, axis, radius, z0, z1), 0.0, 1.0, 1.0 - _GOLDEN, _GOLDEN
    at_a, at_b = _off(*disk, a), _off(*disk, b)
    for _ in range(_CUTS):
        if at_a < at_b:
            high, b, at_b = b, a, at_a
            a = high - _GOLDEN * (high - low)
            at_a = _off(*disk, a)
        else:
            low, a, at_a = a, b, at_b
            b = low + _GOLDEN * (high - low)
            at_b = _off(*disk, b)
    ends = min(_off(*disk, 0.0), _off(*disk, 1.0))  # the golden-section search leaves these two out
    return math.sqrt(min(at_a, at_b, ends))


@inner
def _radius(p: Array, q: Array, centre: Array, axis: Array, t: float) -> float:
    """Compute the distance [m] of the point p + t (q − p) from the axis of a disk.

    The axis goes through ``centre`` (3,) along the unit vector ``axis`` (3,).
    """
    square = along = 0.0
    for i in range(3):
        way = p[i] + t * (q[i] - p[i]) - centre[i]
        square += way * way
        along += way * axis[i]
    return math.sqrt(max(square - along * along, 0.0))


@inner
def _off(
    p: Array, q: Array, centre: Array, axis: Array, radius: float, z0: float, z1: float, t: float
) -> float:
    """Compute the squared distance [m²] from the point p + t (q − p) to a disk.

    The disk is given as for :func:`_to_disk`; z0 and z1 are the heights of p and q above its plane
    [m].
    """
    z = z0 + t * (z1 - z0)
    out = max(_radius(p, q, centre, axis, t) - radius, 0.0)
    return float(z * z + out * out)


@inner
def _sphere_distance(p: Array, q: Array, r: Array, s: Array) -> float:
    """Return a lower bound [m] of the distance between the segments pq and rs, fast to compute.

    It is the distance of the spheres that have the segments as diameters; negative if they overlap.
    """
    first = second = between = 0.0
    for i in range(3):
        x, y, way = q[i] - p[i], s[i] - r[i], p[i] + q[i] - r[i] - s[i]
        first += x * x
        second += y * y
        between += way * way
    return 0.5 * (math.sqrt(between) - math.sqrt(first) - math.sqrt(second))


@threaded
def clearance_rows(
    tree: Tree,
    routing: Routing,
    segment: Indices,
    bone: Indices,
    bone_radius: Array,
    disk: Indices,
    disk_radius: Array,
    own: Indices,
    q: Array,
    distance: Array,
    nearest: Indices,
) -> None:
    """Compute the smallest distances of cables at B postures, and which bodies have them.

    Args:
        tree: The joints.
        routing: Points of the arm: cable sites, ends of bones, centres of disks and points on
            their axes. Indices of points below refer to it.
        segment: Number of the cable, and indices of both end points, of each segment (S, 3).
        bone: Indices of both end points of each bone, the backbone of a link (n, 2).
        bone_radius: Radius of each bone (n,) [m].
        disk: Indices of two points of each disk: its centre, and a point on its axis 1 m from the
            centre (D, 2).
        disk_radius: Radius of each disk (D,) [m].
        own: 1 or 2 if the first or second end of a segment is in a hole of the disk, else 0 (S, D).
        q: Joint angles (B, nv) [rad].
        distance: To fill: three distances (B, 3) [m]. The first is between the axes of two cables.
            The second is from the axis of a cable to the surface of a bone. The third is from the
            axis of a cable to a disk, or to the rim of a disk in whose hole it is.
        nearest: To fill: the pair for each distance (B, 3, 2), as indices of two segments, of
            segment and bone, and of segment and disk; −1 if there is no such pair.
    """
    rows, nv = q.shape
    count = tree.parent.shape[0]
    rotation, frames = np.empty((count, 3, 3, 1)), empty_frames(tree, routing, 1)
    point, axis = np.empty((routing.row.shape[0], 3)), np.empty(3)
    for n in range(rows):
        angles = q[n].copy().reshape(nv, 1)
        forward_kinematics(tree, routing, angles, np.empty((2, 1)), rotation, frames, None)
        for i in range(point.shape[0]):
            for r in range(3):
                point[i, r] = frames.site[i, r, 0]
        distance[n] = math.inf
        nearest[n] = -1
        for i in range(segment.shape[0]):
            cable, a, b = segment[i]
            for j in range(i):
                if segment[j, 0] == cable:
                    continue
                c, d = segment[j, 1], segment[j, 2]
                if _sphere_distance(point[a], point[b], point[c], point[d]) < distance[n, 0]:
                    found = _between(point[a], point[b], point[c], point[d])
                    if found < distance[n, 0]:
                        distance[n, 0], nearest[n, 0, 0], nearest[n, 0, 1] = found, j, i
            for j in range(bone.shape[0]):
                c, d = bone[j]
                bound = _sphere_distance(point[a], point[b], point[c], point[d]) - bone_radius[j]
                if bound < distance[n, 1]:
                    found = _between(point[a], point[b], point[c], point[d]) - bone_radius[j]
                    if found < distance[n, 1]:
                        distance[n, 1], nearest[n, 1, 0], nearest[n, 1, 1] = found, i, j
            for j in range(disk.shape[0]):
                c, d = disk[j]
                radius = disk_radius[j]
                for r in range(3):
                    axis[r] = point[d, r] - point[c, r]
                if own[i, j]:
                    end = 0.0 if own[i, j] == 1 else 1.0
                    found = radius - _radius(point[a], point[b], point[c], axis, end)
                elif (
                    _sphere_distance(point[a], point[b], point[c], point[c]) - radius
                    < distance[n, 2]
                ):
                    found = _to_disk(point[a], point[b], point[c], axis, radius)
                else:
                    continue
                if found < distance[n, 2]:
                    distance[n, 2], nearest[n, 2, 0], nearest[n, 2, 1] = found, i, j
