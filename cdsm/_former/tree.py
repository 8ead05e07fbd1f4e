"""Kinematic tree of an arm as plain arrays, and the numba kernel of its forward kinematics."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm._former.compiling import Index, Width, axes, inlined, inner, lanes, upwards
from cdsm._former.trigonometry import set_cosine_sine
from cdsm.support.values import Array, frozen

Indices = NDArray[np.intp]


class Tree(NamedTuple):
    """The kinematic tree as plain arrays; row 0 is the base, row i is joint i in the order of q.

    Attributes:
        parent: Row of each joint's parent, the joint before it on the way from the base, (nv+1,).
        order: Rows of the joints, sorted so that each joint comes after its parent, (nv,).
        turn: Matrices A, B and C of each joint, (nv+1, 3, 3, 3). The rotation of the joint's frame
            in its parent's frame is A + B cos q + C sin q (Rodrigues' formula).
        translation: Origin of the joint's frame in its parent's frame at q = 0, (nv+1, 3) [m].
        axis: Unit axis of a revolute joint in the parent's frame, (nv+1, 3); zero for a prismatic
            joint.
        slide: Unit direction of a prismatic joint in the parent's frame, (nv+1, 3); zero for a
            revolute joint. Empty, (0, 3), if no joint is prismatic: this usual case takes no time.
    """

    parent: Indices
    order: Indices
    turn: Array
    translation: Array
    axis: Array
    slide: Array

    @classmethod
    def of(
        cls,
        parent: Indices,
        order: Indices,
        rotation: Array,
        translation: Array,
        axis: Array,
        slide: Array,
    ) -> Tree:
        """Build a tree from the joint frames at q = 0.

        ``rotation`` (nv+1, 3, 3) and ``translation`` (nv+1, 3) [m] place each joint frame in its
        parent's frame. ``axis`` and ``slide`` (nv+1, 3) are unit vectors in the joint frame.
        """
        along = axis[:, :, None] * axis[:, None, :]
        along[~axis.any(axis=1)] = np.eye(3)  # a sliding joint: the rotation is constant
        cross = np.cross(axis[:, None, :], np.eye(3)).transpose(0, 2, 1)
        parts = np.stack([along, np.eye(3) - along, cross], axis=1)
        return cls(
            parent=frozen(parent),
            order=frozen(order),
            turn=frozen(rotation[:, None] @ parts),
            translation=frozen(translation),
            axis=frozen((rotation @ axis[:, :, None])[:, :, 0].copy()),
            slide=frozen((rotation @ slide[:, :, None])[: len(slide) * slide.any(), :, 0].copy()),
        )


class Routing(NamedTuple):
    """All cable sites, and the cable segments that joints can change.

    There are few arrays, since passing one from Python takes as long as computing a segment.

    Attributes:
        row: Row, in :class:`Tree`, of the joint that moves each site, (P,).
        point: Position of each site in the frame of this joint, (P, 3) [m].
        segment: Five integers for each segment from site a to site b, (S+1, 5): cable, a, b, index
            in ``joint`` of its first joint, and of its first joint on the path to b. The last row
            only marks the end.
        joint: For each segment, the rows of the joints between a and b: first the joints on the
            path to a, then those on the path to b, both from the base on.
        fixed: Length that joints do not change, (C,) [m]: segments within one link and the lead
            (the straight cable between its actuator and the base disk).
    """

    row: Indices
    point: Array
    segment: Indices
    joint: Indices
    fixed: Array


class Frames(NamedTuple):
    """Joint axes and cable sites of W postures, in base axes; the last axis is the posture.

    Attributes:
        origin: A point on each joint axis, (nv+1, 3, W) [m].
        axis: Unit direction of each joint axis, (nv+1, 3, W); zero for a prismatic joint.
        slide: Unit direction of each prismatic joint, (nv+1, 3, W), zero for a revolute joint; (0,
            3, W) if no joint is prismatic.
        site: Positions of the cable sites, (P, 3, W) [m].
    """

    origin: Array
    axis: Array
    slide: Array
    site: Array


@inlined
def empty_frames(tree: Tree, routing: Routing, width: int) -> Frames:
    """Allocate the :class:`Frames` of a block of ``width`` postures."""
    rows, sites = tree.parent.shape[0], routing.row.shape[0]
    return Frames(
        np.zeros((rows, 3, width)),
        np.zeros((rows, 3, width)),
        np.zeros((tree.slide.shape[0], 3, width)),
        np.empty((sites, 3, width)),
    )


@inlined
def one_frames(origin: Array, axis: Array, slide: Array, site: Array) -> Frames:
    """Return the :class:`Frames` of one posture from arrays that lack the axis of postures."""
    return Frames(
        origin.reshape(origin.shape[0], 3, 1),
        axis.reshape(axis.shape[0], 3, 1),
        slide.reshape(slide.shape[0], 3, 1),
        site.reshape(site.shape[0], 3, 1),
    )


@inlined
def turned(rotation: Array, i: Index, r: Index, x: float, y: float, z: float, w: Index) -> float:
    """Compute component r, in base axes, of a vector (x, y, z) given in the frame of joint i.

    ``rotation`` (nv+1, 3, 3, W) has the rotations of the frames; w is the posture in the block.
    """
    turned: float = rotation[i, r, 0, w] * x + rotation[i, r, 1, w] * y + rotation[i, r, 2, w] * z
    return turned


@inner
def forward_kinematics(
    tree: Tree,
    routing: Routing,
    q: Array,
    trigonometry: Array,
    rotation: Array,
    frames: Frames,
    width: Width,
) -> None:
    """Fill ``rotation`` of the joints (nv+1, 3, 3, W) and ``frames`` at joint angles q (nv, W).

    A revolute joint has the rotation R_parent (A + B cos q + C sin q); see :attr:`Tree.turn`. A
    prismatic joint moves its origin by q along its slide. ``trigonometry`` (2, W) is scratch.
    """
    parent, order, turn, translation, local_axis, local_slide = tree
    origin, axis, slide, site = frames
    cosine, sine = trigonometry[0], trigonometry[1]
    for r in axes(origin.shape[1], width):
        for c in axes(origin.shape[1], width):
            for w in lanes(width):
                rotation[0, r, c, w] = 1.0 if r == c else 0.0
    for k in range(order.shape[0]):
        i = np.uint64(order[k])  # not negative: see upwards
        before, joint = np.uint64(parent[i]), i - np.uint64(1)
        set_cosine_sine(q[joint], cosine, sine, width)
        for r in axes(origin.shape[1], width):
            x, y, z = translation[i, 0], translation[i, 1], translation[i, 2]
            for w in lanes(width):
                origin[i, r, w] = origin[before, r, w] + turned(rotation, before, r, x, y, z, w)
            if slide.shape[0]:
                x, y, z = local_slide[i, 0], local_slide[i, 1], local_slide[i, 2]
                for w in lanes(width):
                    slide[i, r, w] = turned(rotation, before, r, x, y, z, w)
                    origin[i, r, w] += q[joint, w] * slide[i, r, w]
            x, y, z = local_axis[i, 0], local_axis[i, 1], local_axis[i, 2]
            for w in lanes(width):
                axis[i, r, w] = turned(rotation, before, r, x, y, z, w)
            for c in axes(origin.shape[1], width):
                ax, ay, az = turn[i, 0, 0, c], turn[i, 0, 1, c], turn[i, 0, 2, c]
                bx, by, bz = turn[i, 1, 0, c], turn[i, 1, 1, c], turn[i, 1, 2, c]
                cx, cy, cz = turn[i, 2, 0, c], turn[i, 2, 1, c], turn[i, 2, 2, c]
                for w in lanes(width):
                    x = ax + cosine[w] * bx + sine[w] * cx
                    y = ay + cosine[w] * by + sine[w] * cy
                    z = az + cosine[w] * bz + sine[w] * cz
                    rotation[i, r, c, w] = turned(rotation, before, r, x, y, z, w)
    for p in upwards(0, routing.row.shape[0]):
        i = np.uint64(routing.row[p])
        x, y, z = routing.point[p, 0], routing.point[p, 1], routing.point[p, 2]
        for r in axes(origin.shape[1], width):
            for w in lanes(width):
                site[p, r, w] = origin[i, r, w] + turned(rotation, i, r, x, y, z, w)
