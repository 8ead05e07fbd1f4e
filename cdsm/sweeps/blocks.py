"""Division of a sweep into blocks of postures: contiguous rectangles of the pose set."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import final

import numpy as np


@final
@dataclass(frozen=True, kw_only=True)
class Block:
    """Block of postures whose cases are computed, sent and stored together.

    Attributes:
        slices: Slice of the block along each dimension of the pose set.
        start: Number of the first posture, counted in C order.
        stop: Number of the last posture plus one.
    """

    slices: Mapping[str, slice]
    start: int
    stop: int


def extents(poses: Mapping[str, int], most: int) -> dict[str, int]:
    """Return the size of a block along each dimension: at most ``most`` postures, at least one.

    A block takes the last dimensions completely, a part of the dimension before, and one entry of
    all others. So the blocks cover all postures in order without gaps.
    """
    room, extent = most, {}
    for dim, size in reversed(list(poses.items())):
        extent[dim] = min(size, max(1, room))
        room //= size
    return dict(reversed(extent.items()))


def blocks(poses: Mapping[str, int], extent: Mapping[str, int]) -> Iterator[Block]:
    """Build all blocks of a pose set, in order."""
    steps = [range(0, size, extent[dim]) for dim, size in poses.items()]
    for corner in itertools.product(*steps):
        slices = {
            dim: slice(start, min(start + extent[dim], size))
            for (dim, size), start in zip(poses.items(), corner, strict=True)
        }
        start = int(np.ravel_multi_index(corner, tuple(poses.values())))
        count = math.prod(part.stop - part.start for part in slices.values())
        yield Block(slices=slices, start=start, stop=start + count)
