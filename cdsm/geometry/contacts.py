"""Find links of an arm that touch or overlap at a posture."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from cdsm.geometry.parts import Disk
from cdsm.support.values import Array

_ROUNDS = 60  # number of alternating projections: enough to decide gaps and overlaps of 0.01 radius
_TOUCHING = 1e-3  # a gap below this fraction of the radius counts as an overlap


def overlapping(disks: Sequence[Disk], poses: dict[str, Array]) -> list[tuple[str, str]]:
    """Return the pairs of links whose bodies overlap; neighbouring links are not checked.

    The body of a link is the cylinder from its first disk to its last, with the largest radius of
    these disks; ``poses`` has the pose (4, 4) of each link, translation in m. A point is projected
    alternately onto the two cylinders of a pair. Both are convex, so the distance between the last
    two projections converges to the gap between the cylinders.
    """
    links = list(poses)
    apart = [(i, j) for i, j in combinations(range(len(links)), 2) if j - i > 1]
    pairs = np.array(apart, dtype=np.intp).reshape(-1, 2)
    ends = [[disk.x for disk in disks if disk.link == link] for link in links]
    half = np.array([(max(x) - min(x)) / 2.0 for x in ends])
    radius = np.array([max(disk.radius for disk in disks if disk.link == link) for link in links])
    pose = np.array([poses[link] for link in links])
    axis = pose[:, :3, 0]
    centre = pose[:, :3, 3] + axis * [[(max(x) + min(x)) / 2.0] for x in ends]
    reach = np.hypot(half, radius)
    distance = np.linalg.norm(centre[pairs[:, 0]] - centre[pairs[:, 1]], axis=1)
    pairs = pairs[distance < reach[pairs].sum(axis=1)]
    if not len(pairs):
        return []
    one, other = pairs.T
    there = centre[other]
    for _ in range(_ROUNDS):
        here = _projected(there, centre[one], axis[one], half[one], radius[one])
        there = _projected(here, centre[other], axis[other], half[other], radius[other])
    gap = np.linalg.norm(there - here, axis=1)
    return [(links[i], links[j]) for i, j in pairs[gap <= _TOUCHING * radius[one]].tolist()]


def _projected(points: Array, centre: Array, axis: Array, half: Array, radius: Array) -> Array:
    """Return, for each of n ``points``, the nearest point of its solid cylinder (n, 3) [m].

    Row i of all arguments belongs to cylinder i: its ``centre`` (n, 3) [m], unit vector ``axis``
    (n, 3), half of its length ``half`` (n,) [m], ``radius`` (n,) [m].
    """
    offset = points - centre
    along = np.einsum("ni,ni->n", offset, axis)
    across = offset - along[:, None] * axis
    distance = np.maximum(np.linalg.norm(across, axis=1), radius)
    along = np.clip(along, -half, half)
    return np.asarray(centre + along[:, None] * axis + (radius / distance)[:, None] * across)
