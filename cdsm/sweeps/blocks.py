"""A sweep cut into blocks of postures: rectangles of the pose set that are contiguous in it."""

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
    """Some postures, whose cases are computed, sent and stored at once.

    Attributes:
        slices: What it takes of every dimension of the pose set.
        start: Its first posture, counted in C order.
        stop: One past its last.
    """

    slices: Mapping[str, slice]
    start: int
    stop: int


def extents(poses: Mapping[str, int], most: int) -> dict[str, int]:
    """Size along each dimension of a block of at most so many postures, but at least one.

    The last dimensions whole, as many as fit; part of one; and one entry of each before: such
    blocks cover the postures in order without gaps.
    """
    room, extent = most, {}
    for dim, size in reversed(list(poses.items())):
        extent[dim] = min(size, max(1, room))
        room //= size
    return dict(reversed(extent.items()))


def blocks(poses: Mapping[str, int], extent: Mapping[str, int]) -> Iterator[Block]:
    """All blocks of a pose set of these dimensions, in order."""
    steps = [range(0, size, extent[dim]) for dim, size in poses.items()]
    for corner in itertools.product(*steps):
        slices = {
            dim: slice(start, min(start + extent[dim], size))
            for (dim, size), start in zip(poses.items(), corner, strict=True)
        }
        start = int(np.ravel_multi_index(corner, tuple(poses.values())))
        count = math.prod(part.stop - part.start for part in slices.values())
        yield Block(slices=slices, start=start, stop=start + count)
