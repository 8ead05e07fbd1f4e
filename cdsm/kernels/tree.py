"""Kinematic tree of an arm as plain arrays, and the numba kernel of its forward kinematics."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.kernels.compiling import compiled
from cdsm.support.values import Array, frozen

Indices = NDArray[np.intp]


class Tree(NamedTuple):
    """The kinematic tree as plain arrays; row 0 is the base, row i is joint i in the order of q.

    Attributes:
        parent: Row of the previous joint, (nv+1,).
        order: Rows of the joints, sorted so that each joint comes after its parent, (nv,).
        turn: Matrices A, B and C of each joint, (nv+1, 3, 3, 3). The rotation of the joint's frame
            in its parent's frame is A + B cos q + C sin q (Rodrigues' formula).
        translation: Origin in the parent's frame, (nv+1, 3) [m].
        axis: Unit axis of a turning joint in the parent's frame, (nv+1, 3); zero if it slides.
        slide: Unit direction of a sliding joint in the parent's frame, (nv+1, 3), zero if it turns.
            (0, 3) if no joint slides: this usual case then takes no time.
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
        """Build a tree from joint frames at q = 0 in their parents; axes in the joint frames."""
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
    """All cable sites, and the cable segments that joints can change; rows as in :class:`Tree`.

    The number of arrays is small: each array passed from Python takes as much time as a segment.

    Attributes:
        row: Row of the joint that moves each site, (P,).
        point: Position of each site in the frame of this joint, (P, 3) [m].
        segment: Five integers per segment (S+1, 5): cable, site a, site b, start of its joints in
            ``joint``, start of its joints on the path to b. The last row only marks the end.
        joint: Rows of the joints between a and b: first the joints on the path to a, then the
            joints on the path to b, ancestors first.
        fixed: Length that joints do not change, (C,) [m]: segments within one link and the lead
            (the straight cable between its actuator and the base disk).
    """

    row: Indices
    point: Array
    segment: Indices
    joint: Indices
    fixed: Array


class Frames(NamedTuple):
    """Joint axes and cable sites at one posture, in base axes.

    Attributes:
        origin: A point on each joint axis, (nv+1, 3) [m].
        axis: Unit direction of each joint axis, (nv+1, 3); zero if the joint slides.
        slide: Unit direction of each sliding joint, (nv+1, 3), zero if it turns; (0, 3) if none
            slides.
        site: Positions of the cable sites, (P, 3) [m].
    """

    origin: Array
    axis: Array
    slide: Array
    site: Array


@compiled
def forward_kinematics(
    tree: Tree, routing: Routing, q: Array, rotation: Array, frames: Frames
) -> None:
    """Fill the rotations of the joints (nv+1, 3, 3) and the frames at q (nv,).

    A turning joint has the rotation R_parent (A + B cos q + C sin q); see :attr:`Tree.turn`. A
    sliding joint moves its origin by q along its slide.
    """
    parent, order, turn, translation, local_axis, local_slide = tree
    origin, axis, slide, site = frames
    sliding = slide.shape[0] > 0
    for r in range(3):
        origin[0, r] = axis[0, r] = 0.0
        if sliding:
            slide[0, r] = 0.0
        for c in range(3):
            rotation[0, r, c] = 1.0 if r == c else 0.0
    for k in range(order.shape[0]):
        i = np.uint64(order[k])  # not negative: see upwards
        before, angle = np.uint64(parent[i]), q[i - np.uint64(1)]
        cosine, sine = math.cos(angle), math.sin(angle)
        for r in range(3):
            x, y, z = rotation[before, r, 0], rotation[before, r, 1], rotation[before, r, 2]
            t, a = translation[i], local_axis[i]
            origin[i, r] = origin[before, r] + (x * t[0] + y * t[1] + z * t[2])
            if sliding:
                s = local_slide[i]
                slide[i, r] = x * s[0] + y * s[1] + z * s[2]
                origin[i, r] += angle * slide[i, r]
            axis[i, r] = x * a[0] + y * a[1] + z * a[2]
            for c in range(3):
                rotation[i, r, c] = (
                    x * (turn[i, 0, 0, c] + cosine * turn[i, 1, 0, c] + sine * turn[i, 2, 0, c])
                    + y * (turn[i, 0, 1, c] + cosine * turn[i, 1, 1, c] + sine * turn[i, 2, 1, c])
                    + z * (turn[i, 0, 2, c] + cosine * turn[i, 1, 2, c] + sine * turn[i, 2, 2, c])
                )
    row, point = routing.row, routing.point
    for p in range(row.shape[0]):
        i = row[p]
        x, y, z = point[p, 0], point[p, 1], point[p, 2]
        for r in range(3):
            shift = rotation[i, r, 0] * x + rotation[i, r, 1] * y + rotation[i, r, 2] * z
            site[p, r] = origin[i, r] + shift
