"""Arrays of an arm for the kernels, and postures side by side."""

from __future__ import annotations

import math
from functools import cache, lru_cache
from itertools import combinations
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InvalidInput, listed
from cdsm.manipulator import Manipulator
from cdsm.support.values import Array, frozen
from cdsm.tension.solvers import NO_ARM

Indices = NDArray[np.intp]
_Scalar = TypeVar("_Scalar", np.float64, np.bool_)


class Arm(NamedTuple):
    """What all arms of a batch share: nv joints, C cables, S segments between their sites."""

    parent: NDArray[np.intp]  # frame before each joint (nv,)
    turn: Array  # A, B, C (nv, 3, 3, 3): a joint turns its frame by A + B cos q + C sin q
    axis: Array  # of joints that turn, in the frame before (nv, 3); else zero
    slide: Array  # of joints that slide, in the frame before (nv, 3); else zero
    free: Array  # angle of each joint at which its spring has no torque (nv,)
    moves: NDArray[np.bool_]  # whether joint i moves what joint j carries (nv of j, nv of i)
    frame: NDArray[np.intp]  # frame of each site (P,)
    ends: NDArray[np.intp]  # cable, first and second site of each segment (S, 3)
    path: NDArray[np.intp]  # joints from the first to the second site (S, m)
    sign: Array  # −1 for joints on the way up, then 1 (S, m); 0 for padding
    pulls: NDArray[np.bool_]  # whether a cable can turn a joint (C, nv)
    tip: int  # frame of the tip
    tip_rotation: Array  # (3, 3)
    gravity: Array  # (3,) [m/s²]
    least: float  # moment arms below this are rounding [m]
    axes: NDArray[np.intp]  # joints of the K blocks of the kernel guess, from base to tip (nv,)
    axis_ends: NDArray[np.intp]  # where each block begins in axes, and the last ends (K+1,)
    cables: NDArray[np.intp]  # cables of the blocks (C,)
    cable_ends: NDArray[np.intp]  # the same in cables (K+1,)
    pairs: NDArray[np.intp]  # two cables of one block (N, 2), any second one for a single axis
    pair_ends: NDArray[np.intp]  # the same in pairs (K+1,)


class Body(NamedTuple):
    """Dimensions, which each posture may have of its own: blocks first (1 for all, or B)."""

    shift: Array  # origin of each joint in the frame before (B, nv, 3, W) [m]
    site: Array  # (B, P, 3, W) [m]
    centre: Array  # of mass of what each frame carries (B, nv+1, 3, W) [m]
    tip: Array  # (B, 3, W) [m]
    mass: Array  # (B, nv+1, W) [kg]
    fixed: Array  # length of cables that no joint changes (B, C, W) [m]
    spring: Array  # stiffness of the spring of each joint (B, nv, W)


class Pose(NamedTuple):
    """What the kernel pose finds in B blocks of W postures."""

    length: Array  # L (B, C, W) [m]
    jacobian: Array  # J_L (B, C, nv, W)
    gravity: Array  # g (B, nv, W)
    torque: Array  # J_Xᵀ W − g, which the cables balance (B, nv, W)
    tip_jacobian: Array  # J_X, linear and angular part (B, 2, nv, 3, W)
    tip: Array  # rotation and position of the tip (B, 4, 3, W)
    axis: Array  # z (B, nv, 3, W)
    moved: Array  # Σ m ∂c/∂θ_j over the masses that each joint moves (B, nv, 3, W)
    segment: Array  # direction, and 1/length of each segment (B, S, 4, W)
    motion: Array  # d of each joint of each segment (B, S, m, 3, W)
    shortest: Array  # length of the shortest segment (B, W) [m]


_KERNELS = frozenset(("gravity", "springs"))  # terms of an arm that the kernels compute


def without_kernel(arm: Manipulator) -> list[str]:
    """Return the names of the terms of an arm that no kernel computes."""
    return [term.name for term in arm.terms if term.name not in _KERNELS]


class ArmRows:
    """Arrays of an arm; its joints are in Pinocchio's order, each after its parent.

    Attributes:
        coupling: How the n joints follow from those of q; None: they are those of q.
        arm: What all variants of the arm share.
        shapes: Of the arrays of :class:`Pose`, for one posture.
        dimensions: Those of the arm: a :class:`Body` without axes of blocks and postures.
    """

    def __init__(self, arm: Manipulator) -> None:
        if lacking := without_kernel(arm):
            remedy = "use stiffness() posture by posture."
            raise InvalidInput("arm", f"batches have no kernel for {listed(lacking)}; {remedy}")
        tree = arm.body.arrays()
        routing = arm.routing
        parent = tree.parent[1:]
        nv = len(parent)
        self.coupling = arm.body.coupling
        moves = np.eye(nv, dtype=np.bool_)
        for j in range(nv):
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
        pulls = np.zeros((len(arm.cables), nv), dtype=np.bool_)
        pulls[np.broadcast_to(ends[:, :1], path.shape)[real], path[real]] = True
        self.arm = Arm(
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
            **(_found([], []) if self.coupling else _blocks(pulls)),
        )
        self.dimensions = Body(
            shift=tree.translation[1:],
            site=routing.point,
            centre=tree.centre,
            tip=tree.tip_point,
            mass=tree.mass,
            fixed=routing.fixed,
            spring=arm.springs.stiffness,
        )
        self.body = cache(self._body)
        C = len(arm.cables)
        (S, m) = path.shape
        self.shapes: dict[str, tuple[int, ...]] = {
            "length": (C,),
            "jacobian": (C, nv),
            "gravity": (nv,),
            "torque": (nv,),
            "tip_jacobian": (2, nv, 3),
            "tip": (4, 3),
            "axis": (nv, 3),
            "moved": (nv, 3),
            "segment": (S, 4),
            "motion": (S, m, 3),
            "shortest": (),
        }

    def _body(self, width: int) -> Body:
        """Return the dimensions for blocks of ``width`` postures, all of the same arm."""
        return Body(
            *(frozen(np.repeat(x[None, ..., None], width, axis=-1)) for x in self.dimensions)
        )

    @property
    def size(self) -> int:
        """Numbers in :class:`Pose` for one posture."""
        return sum(math.prod(shape) for shape in self.shapes.values())


@lru_cache(maxsize=16)
def rows_of(arm: Manipulator) -> ArmRows:
    """Return the arrays of an arm, which are made once."""
    return ArmRows(arm)


def side_by_side(values: Array, width: int) -> Array:
    """Put N postures (N, …) side by side: (B, …, W); the last one fills the last block."""
    count = len(values)
    missing = -count % width
    if missing:
        values = np.concatenate([values, np.repeat(values[-1:], missing, axis=0)])
    blocks = values.reshape(-1, width, *values.shape[1:])
    return np.ascontiguousarray(blocks.transpose(0, *range(2, blocks.ndim), 1))


def one_by_one(values: NDArray[_Scalar], count: int) -> NDArray[_Scalar]:
    """Undo :func:`side_by_side`: (B, …, W) to (N, …)."""
    last = values.ndim - 1
    return values.transpose(0, last, *range(1, last)).reshape(-1, *values.shape[1:-1])[:count]


def _blocks(pulls: NDArray[np.bool_]) -> dict[str, Indices]:
    """Find the blocks of a serpentine arm for the kernel ``guess``; none if there are no such.

    Sorted by how many joints they turn, the cables of a block turn all joints of those before, and
    one or two more; a block has as many cables as axes, or more.
    """
    axes: list[list[int]] = []
    cables: list[list[int]] = []
    before = np.zeros(pulls.shape[1], dtype=np.bool_)
    for c in np.argsort(pulls.sum(axis=1), kind="stable").tolist():
        added = np.flatnonzero(pulls[c] & ~before).tolist()
        if (before & ~pulls[c]).any() or not (axes or added):
            return _found([], [])
        if added and (not axes or len(cables[-1]) >= len(axes[-1])):
            axes.append([])
            cables.append([])
        axes[-1] += added
        cables[-1].append(c)
        before = pulls[c]
    solvable = all(len(a) <= min(2, len(c)) for a, c in zip(axes, cables, strict=True))
    return _found(axes, cables) if before.all() and solvable else _found([], [])


def _found(axes: list[list[int]], cables: list[list[int]]) -> dict[str, Indices]:
    pairs = [
        list(combinations(own, 2)) if len(of) > 1 else [(c, c) for c in own]
        for of, own in zip(axes, cables, strict=True)
    ]
    found: dict[str, Indices] = {}
    for name, ends, parts in (
        ("axes", "axis_ends", axes),
        ("cables", "cable_ends", cables),
        ("pairs", "pair_ends", pairs),
    ):
        flat = np.array([each for part in parts for each in part], dtype=np.intp)
        found[name] = frozen(flat.reshape(-1, 2) if name == "pairs" else flat)
        found[ends] = frozen(np.cumsum([0, *map(len, parts)]).astype(np.intp))
    return found
