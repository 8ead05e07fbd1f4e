"""Find links of an arm that touch or overlap at a posture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdsm.geometry.parts import Disk
from cdsm.support.values import Array

_ROUNDS = 60  # number of alternating projections: enough to decide gaps and overlaps of 0.01 radius
_TOUCHING = 1e-3  # a gap below this fraction of the radius counts as an overlap


def overlapping(disks: Sequence[Disk], poses: dict[str, Array]) -> list[tuple[str, str]]:
    """Return the pairs of links whose bodies overlap; neighbouring links are not checked.

    The body of a link is the cylinder from its first disk to its last, with the largest radius of
    these disks; ``poses`` has the pose (4, 4) of each link, translation in m. A point is projected
    alternately onto the two convex cylinders of a pair: the distance between the last two
    projections converges to the gap.
    """
    links, pose = list(poses), np.array(list(poses.values()))
    own = [[(disk.x, disk.radius) for disk in disks if disk.link == link] for link in links]
    (first, _), (last, radius) = (np.array([end(each) for each in own]).T for end in (min, max))
    half, axis = (last - first) / 2.0, pose[:, :3, 0]
    centre = pose[:, :3, 3] + axis * ((last + first) / 2.0)[:, None]
    one, other = np.triu_indices(len(links), 2)
    reach, distance = np.hypot(half, radius), np.linalg.norm(centre[one] - centre[other], axis=1)
    near = distance < reach[one] + reach[other]
    one, other = one[near], other[near]
    there = centre[other]
    for _ in range(_ROUNDS):
        here = _projected(there, centre[one], axis[one], half[one], radius[one])
        there = _projected(here, centre[other], axis[other], half[other], radius[other])
    meet = np.linalg.norm(there - here, axis=1) <= _TOUCHING * radius[one]
    return [(links[i], links[j]) for i, j in zip(one[meet], other[meet], strict=True)]


def _projected(points: Array, centre: Array, axis: Array, half: Array, radius: Array) -> Array:
    """Return the nearest point of each of n solid cylinders of length 2 ``half`` (n, 3) [m]."""
    offset = points - centre
    along = np.einsum("ni,ni->n", offset, axis)
    across = offset - along[:, None] * axis
    distance = np.maximum(np.linalg.norm(across, axis=1), radius)
    along = np.clip(along, -half, half)
    return np.asarray(centre + along[:, None] * axis + (radius / distance)[:, None] * across)
