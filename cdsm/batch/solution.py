"""Rows of a batch, computed in chunks by several threads.

The arguments are already checked. A row is a posture, possibly of a variant of the arm.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from cdsm.batch.choice import kernels_for
from cdsm.batch.chunk import Chunk
from cdsm.batch.quantities import Codes, shapes_of
from cdsm.batch.rows import Body, rows_of
from cdsm.manipulator import Manipulator
from cdsm.support.values import Array

Springs = Callable[[Array, Array, slice], Array]

# numbers of the poses of a chunk, compiled and by numpy, where a chunk has one block; 64 postures
# side by side are fastest, or 32 of long arms
_CACHE, _WIDE = 2**19, 2**21


@dataclass(frozen=True, eq=False, kw_only=True)
class Rows:
    """Postures of an arm, loads, and what is given or asked of them.

    An array of loads, tensions or bounds has one row for all, or one for each posture.

    Attributes:
        arm: The arm.
        q: Joint angles (N, nv).
        wrench: W (N, 6).
        names: The quantities to compute.
        tension: Given F (N, C) [N], or None.
        bounds: Lower and upper bounds of F to distribute, (N, C) each [N], or None.
        directions: Unit vectors (D, 3) of ``along``.
        body: Dimensions of each row, rows first; those of the arm by default.
        springs: Stiffness (n, C) of cables of lengths L (n, C) under F (n, C) in a slice of rows;
            −1 outside a law; those of the arm by default.
        joint_springs: Stiffness (N, n) of the springs of all joints; those of the arm by default.
        check_limits: Whether rows beyond the joint limits are skipped.
    """

    arm: Manipulator
    q: Array
    wrench: Array
    names: Collection[str]
    tension: Array | None = None
    bounds: tuple[Array, Array] | None = None
    directions: Array = field(default_factory=partial(np.zeros, (0, 3)))
    body: Body | None = None
    springs: Springs | None = None
    joint_springs: Array | None = None
    check_limits: bool = True

    def solve(self, status: Codes, threads: int = 1) -> dict[str, Array]:
        """Compute the quantities by name (N, …); set the ``status`` (N,) of rows that are OK."""
        arm, table, count = self.arm, rows_of(self.arm), len(self.q)
        kernels = kernels_for(table, count)
        width, size = 32 if arm.nv >= 80 else 64, min(max(1, _WIDE // table.size), 2048)
        if kernels.COMPILED:
            size = width * max(1, _CACHE // (table.size * width))
        parts = [slice(first, first + size) for first in range(0, count, size)]
        shapes = shapes_of(arm.nv, len(arm.cables), len(self.directions))
        values = {name: np.empty((count, *shapes[name])) for name in self.names}

        # to pass on the interpreter's lock at each small call would take longer than the call
        scratch, turn = threading.local(), threading.Lock()

        def fill(part: slice) -> None:
            memory = scratch.__dict__.setdefault("of", {})
            with turn, np.errstate(all="ignore"):
                found = Chunk(self, kernels, part, width, status[part], memory, turn).quantities()
            for name in self.names:
                values[name][part] = found[name]

        if threads == 1 or len(parts) < 2:
            for part in parts:
                fill(part)
            return values
        with ThreadPoolExecutor(min(threads, len(parts))) as pool:
            for _ in pool.map(fill, parts):  # an error cancels the chunks that have not begun
                pass
        return values
