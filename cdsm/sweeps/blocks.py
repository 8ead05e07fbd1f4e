"""Divide the postures of a sweep into blocks; a block is a slice of each dimension of the poses."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping

Block = Mapping[str, slice]
"""Part of a pose set: a slice of each dimension. A block is computed, sent and stored at once."""


def extents(poses: Mapping[str, int], most: int) -> dict[str, int]:
    """Return the size of a block along each dimension, for blocks of at most ``most`` postures.

    ``poses`` has the size of the pose set along each dimension. A block covers the last dimensions
    completely, a part of the dimension before them, and one entry of each other dimension. So the
    postures of a block follow each other in the pose set.
    """
    room, extent = most, {}
    for dim, size in reversed(list(poses.items())):
        extent[dim] = min(size, max(1, room))
        room //= size
    return dict(reversed(extent.items()))


def blocks(poses: Mapping[str, int], extent: Mapping[str, int]) -> list[Block]:
    """Return all blocks of a pose set, in order.

    ``poses`` has the size of the set, ``extent`` that of a block, along each dimension.
    """
    cuts = [
        [slice(start, min(start + extent[dim], size)) for start in range(0, size, extent[dim])]
        for dim, size in poses.items()
    ]
    return [dict(zip(poses, corner, strict=True)) for corner in itertools.product(*cuts)]


def postures(block: Block) -> int:
    """Return the number of postures of a block."""
    return math.prod(part.stop - part.start for part in block.values())
