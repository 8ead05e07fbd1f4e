"""Rows of a batch: what is asked, arrays of the arm for the kernels, and postures side by side.

A row is a posture, possibly of a variant of the arm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property, lru_cache, partial
from itertools import combinations
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from cdsm.batch.applied_rows import RowLoads
from cdsm.batch.quantities import Codes
from cdsm.errors import InvalidInput, listed
from cdsm.manipulator import Manipulator
from cdsm.routing import Indices
from cdsm.support.values import Array, frozen
from cdsm.tension.solvers import NO_ARM

CableStiffness = Callable[[Array, Array, slice | Indices], Array]
"""Stiffness (n, C) of cables of lengths L (n, C) under F (n, C) in some rows; −1 outside."""


class ContactKernels(NamedTuple):
    """Kernels of contacts with pulleys, compiled or run by numpy."""

    fill_contacts: Callable[..., None]
    add_shifts: Callable[..., None]
    compiled: bool


class Touching(NamedTuple):
    """What rows over pulleys share."""

    touches: tuple[bool, ...]  # which pulleys touch in all rows (P,)
    kernels: ContactKernels


_Scalar = TypeVar("_Scalar", np.float64, np.bool_)


class ArmArrays(NamedTuple):
    """What all variants of an arm share: n joints, C cables, S segments between their sites."""

    parent: Indices  # frame before each joint (n,)
    turn: Array  # A, B, C (n, 3, 3, 3): a joint turns its frame by A + B cos q + C sin q
    axis: Array  # of joints that turn, in the frame before (n, 3); else zero
    slide: Array  # of joints that slide, in the frame before (n, 3); else zero
    free: Array  # angle of each joint at which its spring has no torque (n,)
    moves: NDArray[np.bool_]  # whether joint i moves what joint j carries (n of j, n of i)
    frame: Indices  # frame of each site (P,)
    ends: Indices  # cable, first and second site of each segment (S, 3)
    path: Indices  # joints from the first to the second site (S, m)
    sign: Array  # −1 for joints on the way up, then 1 (S, m); 0 for padding
    pulls: NDArray[np.bool_]  # whether a cable can turn a joint (C, n)
    tip: int  # frame of the tip
    tip_rotation: Array  # (3, 3)
    gravity: Array  # (3,) [m/s²]
    least: float  # moment arms below this are rounding [m]
    axes: Indices  # joints of the K blocks of the kernel guess_tensions, from base to tip (n,)
    axis_ends: Indices  # where each block begins in axes, and the last ends (K+1,)
    cables: Indices  # cables of the blocks (C,)
    cable_ends: Indices  # the same in cables (K+1,)
    pairs: Indices  # two cables of one block (N, 2), any second one for a single axis
    pair_ends: Indices  # the same in pairs (K+1,)


class BodyArrays(NamedTuple):
    """Dimensions of an arm, (1, …, W) for all postures, or (B, …, W): each has its own."""

    shift: Array  # origin of each joint in the frame before (B, n, 3, W) [m]
    site: Array  # (B, P, 3, W) [m]
    centre: Array  # of mass of what each frame carries (B, n+1, 3, W) [m]
    tip: Array  # (B, 3, W) [m]
    mass: Array  # (B, n+1, W) [kg]
    fixed: Array  # length of cables that no joint changes (B, C, W) [m]
    spring: Array  # stiffness of the spring of each joint, or the factor on its law (B, n, W)


class PoseArrays(NamedTuple):
    """What the kernel ``fill_pose`` computes of B blocks of W postures."""

    length: Array  # L (B, C, W) [m]
    jacobian: Array  # J_L (B, C, n, W)
    gravity: Array  # g (B, n, W)
    torque: Array  # J_Xᵀ W − g, which the cables balance (B, n, W)
    turned: Array  # Σ f × (v_j + z_j × p) over the loads that each joint moves (B, n or 0, 3, W)
    moment: Array  # Σ m over them (B, n or 0, 3, W)
    tip_jacobian: Array  # J_X, linear and angular part (B, 2, n, 3, W)
    tip: Array  # rotation and position of the tip (B, 4, 3, W)
    axis: Array  # z (B, n, 3, W)
    moved: Array  # Σ m ∂c/∂θ_j over the masses that each joint moves (B, n, 3, W)
    segment: Array  # direction, and 1/length of each segment (B, S, 4, W)
    motion: Array  # d of each joint of each segment (B, S, m, 3, W)
    shortest: Array  # length of the shortest segment (B, W) [m]


class LoadArrays(NamedTuple):
    """Loads on L points of links."""

    frame: Indices  # frame of each point (L,)
    point: Array  # in this frame (L, 3) [m]
    wrench: Array  # force and moment, base axes (B, L, 6, W)


_KERNELS = frozenset(("gravity", "springs"))  # terms of an arm that the kernels compute


def without_kernel(arm: Manipulator) -> list[str]:
    """Return the names of the terms of an arm that no kernel computes."""
    return [term.name for term in arm.terms if term.name not in _KERNELS]


@dataclass(frozen=True, eq=False, kw_only=True)
class Rows:
    """Postures of an arm, loads, and what is given or asked of them; all is checked.

    An array of loads, tensions or bounds has one row for all, or one for each posture.

    Attributes:
        arm: The arm.
        q: Joint angles (N, nv).
        wrench: W (N, 6) at the tip.
        loads: Loads on links, besides those that belong to the arm.
        names: The quantities to compute.
        tension: Given F (N, C) [N], or None.
        bounds: Lower and upper bounds of F to distribute, (N, C) each [N], or None.
        directions: Unit vectors (D, 3) of ``along``.
        body: Dimensions of each row, rows first; those of the arm by default.
        cable_stiffness: That of each row; by default that of the arm's cables.
        check_limits: Whether rows beyond the joint limits are skipped.
        status: :class:`Status` (N,) of rows that are lost already; by default none is.
        touching: Which pulleys touch in all rows; None: not known, or there are none.
    """

    arm: Manipulator
    q: Array
    wrench: Array
    names: Collection[str]
    tension: Array | None = None
    bounds: tuple[Array, Array] | None = None
    directions: Array = field(default_factory=partial(np.zeros, (0, 3)))
    body: BodyArrays | None = None
    cable_stiffness: CableStiffness | None = None
    check_limits: bool = True
    status: Codes | None = None
    touching: Touching | None = None
    loads: RowLoads | None = None

    @cached_property
    def all_loads(self) -> RowLoads | None:
        """Loads on links, those that belong to the arm included; None if there are none."""
        own = self.arm.own_loads
        if not own:
            return self.loads
        points = tuple(at for at, _ in own)
        wrenches = np.array([[W for _, W in own]])
        if self.loads is None:
            return RowLoads(points, frozen(wrenches))
        given = self.loads.wrenches
        shared = np.broadcast_to(wrenches, (len(given), *wrenches.shape[1:]))
        together = frozen(np.concatenate([shared, given], axis=1))
        return RowLoads((*points, *self.loads.points), together)


class ArmTables:
    """Arrays of an arm; its joints are in Pinocchio's order, each after its parent.

    Attributes:
        coupling: How the n joints follow from those of q; None: they are those of q.
        arm: What all variants of the arm share.
        shapes: Of the arrays of :class:`PoseArrays`, for one posture.
        dimensions: Those of the arm: a :class:`BodyArrays` without axes of blocks and postures.
    """

    def __init__(self, arm: Manipulator, touches: tuple[bool, ...] | None = None) -> None:
        if lacking := without_kernel(arm):
            remedy = "use stiffness() posture by posture."
            raise InvalidInput("arm", f"batches have no kernel for {listed(lacking)}; {remedy}")
        tree = arm.body.arrays()
        routing = arm.routing
        if arm.wraps is not None and touches is not None:
            routing = arm.wraps.pattern(touches).routing
        parent = tree.parent[1:]
        n = len(parent)
        self.coupling = arm.body.coupling
        moves = np.eye(n, dtype=np.bool_)
        for j in range(n):
            if parent[j]:
                moves[j] |= moves[parent[j] - 1]
        axis = tree.twist[1:, 3:]
        slide = tree.twist[1:, :3]
        about = axis[:, :, None] * axis[:, None, :]
        about[~axis.any(axis=1)] = np.eye(3)  # a joint that slides does not turn
        cross = np.cross(axis[:, None, :], np.eye(3)).transpose(0, 2, 1)
        rotation = tree.rotation[1:]
        ends = np.stack([routing.cable, routing.first, routing.second], axis=1)
        real = routing.sign != 0.0
        path = np.where(real, routing.path, 0)
        pulls = np.zeros((len(arm.cables), n), dtype=np.bool_)
        pulls[np.broadcast_to(ends[:, :1], path.shape)[real], path[real]] = True
        self.arm = ArmArrays(
            parent=frozen(parent),
            turn=frozen(rotation[:, None] @ np.stack([about, np.eye(3) - about, cross], axis=1)),
            axis=frozen((rotation @ axis[:, :, None])[:, :, 0].copy()),
            slide=frozen((rotation @ slide[:, :, None])[:, :, 0].copy()),
            free=arm.springs.angle,
            moves=frozen(moves),
            frame=frozen(routing.row.copy()),
            ends=frozen(ends),
            path=frozen(path),
            sign=frozen(routing.sign.copy()),
            pulls=frozen(pulls),
            tip=tree.tip,
            tip_rotation=frozen(tree.tip_rotation),
            gravity=frozen(np.array(arm.gravity)),
            least=NO_ARM * arm.length,
            **(_block_arrays([], []) if self.coupling else _blocks(pulls)),
        )
        self.dimensions = BodyArrays(
            shift=tree.translation[1:],
            site=routing.point,
            centre=tree.centre,
            tip=tree.tip_point,
            mass=tree.mass,
            fixed=routing.fixed,
            spring=arm.springs.coefficients,
        )
        self.body = cache(self._body)
        C = len(arm.cables)
        (S, m) = path.shape
        self.shapes: dict[str, tuple[int, ...]] = {
            "length": (C,),
            "jacobian": (C, n),
            "gravity": (n,),
            "torque": (n,),
            "turned": (0, 3),
            "moment": (0, 3),
            "tip_jacobian": (2, n, 3),
            "tip": (4, 3),
            "axis": (n, 3),
            "moved": (n, 3),
            "segment": (S, 4),
            "motion": (S, m, 3),
            "shortest": (),
        }

    def _body(self, width: int) -> BodyArrays:
        """Return the dimensions for blocks of ``width`` postures, all of the same arm."""
        return BodyArrays(
            *(frozen(np.repeat(x[None, ..., None], width, axis=-1)) for x in self.dimensions)
        )

    @property
    def size(self) -> int:
        """Numbers in :class:`PoseArrays` for one posture."""
        return sum(math.prod(shape) for shape in self.shapes.values())


@lru_cache(maxsize=16)
def tables_of(arm: Manipulator, touches: tuple[bool, ...] | None = None) -> ArmTables:
    """Return the arrays of an arm, made once; of cables that touch these of the pulleys."""
    return ArmTables(arm, touches)


def side_by_side(values: Array, width: int) -> Array:
    """Put N postures (N, …) side by side: (B, …, W); the last one fills the last block."""
    count = len(values)
    missing = -count % width
    if missing:
        values = np.concatenate([values, np.repeat(values[-1:], missing, axis=0)])
    blocks = values.reshape(len(values) // width, width, *values.shape[1:])
    return np.ascontiguousarray(blocks.transpose(0, *range(2, blocks.ndim), 1))


def one_by_one(values: NDArray[_Scalar], count: int) -> NDArray[_Scalar]:
    """Undo :func:`side_by_side`: (B, …, W) to (N, …)."""
    last = values.ndim - 1
    rows = len(values) * values.shape[last]
    return values.transpose(0, last, *range(1, last)).reshape(rows, *values.shape[1:-1])[:count]


def _blocks(pulls: NDArray[np.bool_]) -> dict[str, Indices]:
    """Find the blocks of a serpentine arm for ``guess_tensions``; none if there are no such.

    Sorted by how many joints they turn, the cables of a block turn all joints of those before, and
    one or two more; a block has as many cables as axes, or more.
    """
    axes: list[list[int]] = []
    cables: list[list[int]] = []
    before = np.zeros(pulls.shape[1], dtype=np.bool_)
    for c in np.argsort(pulls.sum(axis=1), kind="stable").tolist():
        added = np.flatnonzero(pulls[c] & ~before).tolist()
        if (before & ~pulls[c]).any() or not (axes or added):
            return _block_arrays([], [])
        if added and (not axes or len(cables[-1]) >= len(axes[-1])):
            axes.append([])
            cables.append([])
        axes[-1] += added
        cables[-1].append(c)
        before = pulls[c]
    solvable = all(len(a) <= min(2, len(c)) for a, c in zip(axes, cables, strict=True))
    return _block_arrays(axes, cables) if before.all() and solvable else _block_arrays([], [])


def _block_arrays(axes: list[list[int]], cables: list[list[int]]) -> dict[str, Indices]:
    """Return axes, cables and pairs of the blocks as fields of :class:`ArmArrays`."""
    pairs = [
        list(combinations(block, 2)) if len(turned) > 1 else [(c, c) for c in block]
        for turned, block in zip(axes, cables, strict=True)
    ]
    return {
        "axes": _flat(axes),
        "axis_ends": _ends(axes),
        "cables": _flat(cables),
        "cable_ends": _ends(cables),
        "pairs": frozen(_flat(pairs).reshape(-1, 2)),
        "pair_ends": _ends(pairs),
    }


def _flat(blocks: Sequence[Sequence[Any]]) -> Indices:
    entries = [entry for block in blocks for entry in block]
    return frozen(np.array(entries, dtype=np.intp))


def _ends(blocks: Sequence[Sequence[Any]]) -> Indices:
    """Return where each block begins, and the last one ends."""
    return frozen(np.cumsum([0, *map(len, blocks)]).astype(np.intp))
