"""Divide a sweep into blocks of postures, which are contiguous boxes of the pose set."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping

Block = Mapping[str, slice]
"""Part of a pose set: a slice of each dimension. A block is computed, sent and stored at once."""


def extents(poses: Mapping[str, int], most: int) -> dict[str, int]:
    """Return the size along each dimension of a block of up to ``most`` postures.

    ``poses`` has the size of each dimension of the pose set. A block has the full size along the
    last dimensions, a part of the dimension before them, and the size 1 along all others. So the
    blocks cover all postures in order.
    """
    room, extent = most, {}
    for dim, size in reversed(list(poses.items())):
        extent[dim] = min(size, max(1, room))
        room //= size
    return dict(reversed(extent.items()))


def blocks(poses: Mapping[str, int], extent: Mapping[str, int]) -> list[Block]:
    """Return all blocks of a pose set in order; ``extent`` has the size of a block by dimension."""
    cuts = [
        [slice(start, min(start + extent[dim], size)) for start in range(0, size, extent[dim])]
        for dim, size in poses.items()
    ]
    return [dict(zip(poses, corner, strict=True)) for corner in itertools.product(*cuts)]


def postures(block: Block) -> int:
    """Return the number of postures of a block."""
    return math.prod(part.stop - part.start for part in block.values())
