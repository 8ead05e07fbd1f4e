"""The arrays of an arm as the kernels of batches take them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from typing import Any

import numpy as np

from cdsm._former.bodies import Masses
from cdsm._former.serpentine_guess import find_blocks
from cdsm._former.tree import Routing, Tree
from cdsm.manipulator import LIMIT_SLACK, Manipulator
from cdsm.routing import Routing as ArmRouting
from cdsm.support.values import frozen

_MOST = 4096
"""Maximum number of postures in a slice; a slice allocates the kernel's scratch once."""


class KernelArrays:
    """Kinematic tree, masses, routing and blocks of joints of an arm, without its laws."""

    def __init__(self, arm: Manipulator) -> None:
        self._arm, self.body = arm, arm._body
        found = self.body.arrays()
        self.tree = Tree.of(
            parent=found.parent,
            order=found.order,
            rotation=found.rotation,
            translation=found.translation,
            axis=found.twist[:, 3:],
            slide=found.twist[:, :3],
        )
        self.masses = Masses(
            mass=found.mass,
            centre=found.centre,
            gravity=arm.gravity,
            tip=found.tip,
            tip_joints=self.body.tip_joints,
            rotation=found.tip_rotation,
            point=found.tip_point,
        )
        self.routing = _table(arm._routing)
        self.blocks = find_blocks(self.routing, arm.nv)
        self.arrays: tuple[Any, ...] = (*self.tree, *self.routing, *self.masses)
        self.lowest = frozen(arm.lower - LIMIT_SLACK)
        self.highest = frozen(arm.upper + LIMIT_SLACK)

    @cached_property
    def chain_arrays(self) -> tuple[Any, ...]:
        """Routing of the segments between holes, span, hole and own wrap angles."""
        chains, whole = self._arm._chains, self._arm._chain_routing
        routing, span = _table(whole), np.zeros((len(chains.segments), 3), dtype=np.intp)
        moving = routing.segment[:-1, 0]
        span[moving, :2], span[moving, 2] = routing.segment[:-1, 3:], routing.segment[1:, 3]
        return *routing, frozen(span), chains.hole, chains.wrap


def kernel_arrays(arm: Manipulator) -> KernelArrays:
    """Return the arrays of an arm, which are made once."""
    found = arm.__dict__.get("_kernel_arrays")
    if found is None:
        found = arm.__dict__["_kernel_arrays"] = KernelArrays(arm)
    return found


def _table(routing: ArmRouting) -> Routing:
    """Write a routing as the table of segments that the kernels read."""
    parts: list[tuple[int, ...]] = []
    joints: list[int] = []
    fixed = np.array(routing.fixed)
    for s, c in enumerate(routing.cable.tolist()):
        sign = routing.sign[s]
        first = len(joints)
        joints += (1 + routing.path[s][sign < 0.0][::-1]).tolist()  # from the base to a
        middle = len(joints)
        joints += (1 + routing.path[s][sign > 0.0]).tolist()
        a, b = int(routing.first[s]), int(routing.second[s])
        if len(joints) > first:
            parts.append((c, a, b, first, middle))
        else:  # a segment within one body
            fixed[c] += np.linalg.norm(routing.point[b] - routing.point[a])
    parts.append((0, 0, 0, len(joints), len(joints)))
    return Routing(
        row=routing.row,
        point=routing.point,
        segment=frozen(np.array(parts, dtype=np.intp)),
        joint=frozen(np.array(joints, dtype=np.intp)),
        fixed=frozen(fixed),
    )


def run_slices(work: Callable[[slice], None], rows: int, block: int, threads: int) -> None:
    """Call ``work`` for slices that together cover all rows, in several threads.

    These are Python threads; the kernels release the interpreter lock. Parallel loops of numba
    take seconds longer to compile. On some machines two threads cannot enter such a loop at once;
    on others a process that forks later cannot use one.

    Args:
        work: Computes the postures of its slice, and changes no others.
        rows: Number of postures.
        block: Number of postures that the kernel computes at a time.
        threads: Maximum number of threads.
    """
    size = max(1, min(-(-rows // threads), _MOST))
    size += -size % block
    slices = [slice(first, min(first + size, rows)) for first in range(0, rows, size)]
    if threads == 1 or len(slices) < 2:
        for part in slices:
            work(part)
        return
    with ThreadPoolExecutor(min(threads, len(slices))) as pool:
        for _ in pool.map(work, slices):  # an error cancels the slices that have not begun
            pass
