"""Numba kernels of velocities and accelerations at one posture, if q̇ = z and q̈ = 0."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdsm._former.compiling import inner
from cdsm._former.tree import Tree
from cdsm.support.values import Array


class Motion(NamedTuple):
    """Motion of the joint frames if q̇ = z and q̈ = 0; arrays (nv+1, 3), vectors in base axes."""

    turning: Array  # angular velocity ω
    turning_rate: Array  # ω̇
    velocity: Array  # of the origins
    acceleration: Array  # of the origins


@inner
def cross(a: Array, b: Array, product: Array) -> None:
    """Fill ``product`` (3,) with a × b."""
    product[0] = a[1] * b[2] - a[2] * b[1]
    product[1] = a[2] * b[0] - a[0] * b[2]
    product[2] = a[0] * b[1] - a[1] * b[0]


@inner
def dot(a: Array, b: Array) -> float:
    """Compute a·b."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@inner
def move(
    turning: Array, turning_rate: Array, arm: Array, velocity: Array, acceleration: Array
) -> None:
    """Fill ``velocity`` (3,) with ω × r, and ``acceleration`` (3,) with ω̇ × r + ω × (ω × r).

    This is the motion of a point relative to the origin of its frame. r is ``arm`` (3,), from the
    origin to the point; ω is ``turning`` (3,), and ω̇ is ``turning_rate`` (3,), of the frame.
    """
    cross(turning, arm, velocity)
    w, e, v, r = turning, turning_rate, velocity, arm
    acceleration[0] = e[1] * r[2] - e[2] * r[1] + w[1] * v[2] - w[2] * v[1]
    acceleration[1] = e[2] * r[0] - e[0] * r[2] + w[2] * v[0] - w[0] * v[2]
    acceleration[2] = e[0] * r[1] - e[1] * r[0] + w[0] * v[1] - w[1] * v[0]


@inner
def set_motion(
    tree: Tree, origin: Array, axis: Array, slide: Array, z: Array, motion: Motion
) -> None:
    """Fill ``motion`` with the motion of all joint frames for the joint velocities z (nv,).

    ``origin``, ``axis`` and ``slide`` (nv+1, 3) are the fields of :class:`Frames` of one posture.
    The row of the base in ``motion`` is zero on entry.
    """
    turning, rate, velocity, acceleration = motion
    arm, v, a, way = np.empty(3), np.empty(3), np.empty(3), np.zeros(3)
    for k in range(tree.order.shape[0]):
        i = tree.order[k]
        before, speed = tree.parent[i], z[i - 1]
        for r in range(3):
            arm[r] = origin[i, r] - origin[before, r]
            if slide.shape[0]:
                way[r] = slide[i, r] * speed
        move(turning[before], rate[before], arm, v, a)
        for r in range(3):
            velocity[i, r] = velocity[before, r] + v[r] + way[r]
            acceleration[i, r] = acceleration[before, r] + a[r]
            turning[i, r] = turning[before, r] + axis[i, r] * speed
        cross(turning[before], way, v)
        for r in range(3):
            acceleration[i, r] += 2.0 * v[r]
        cross(turning[before], axis[i], v)
        for r in range(3):
            rate[i, r] = rate[before, r] + v[r] * speed


@inner
def to_frame(rotation: Array, vector: Array, turned: Array) -> None:
    """Fill ``turned`` (3,) with Rᵀ v: a vector v of base axes in the axes of a joint frame.

    ``vector`` is v (3,), and ``rotation`` (3, 3, 1) the rotation R of the frame.
    """
    for r in range(3):
        turned[r] = (
            rotation[0, r, 0] * vector[0]
            + rotation[1, r, 0] * vector[1]
            + rotation[2, r, 0] * vector[2]
        )


@inner
def pull_back(turning: Array, rate: Array, weight: Array, scratch: Array, pulled: Array) -> None:
    """Compute the derivative of a scalar Ψ with respect to a displacement δ of a point of a link.

    The rows X, V and A of ``weight`` (3, 3) are the derivatives of Ψ with respect to the position,
    velocity and acceleration of the point. The link turns with ω ``turning`` and ω̇ ``rate``, so δ
    changes these by δ, ω × δ and ω̇ × δ + ω × (ω × δ). Fills ``pulled`` (3,) with

        ∂Ψ/∂δ = X + V × ω + A × ω̇ + (A × ω) × ω.
    """
    X, V, A = weight[0], weight[1], weight[2]
    cross(A, turning, scratch)
    w, e, s = turning, rate, scratch
    for r in range(3):
        p, q = (r + 1) % 3, (r + 2) % 3
        pulled[r] = X[r] + (V[p] + s[p]) * w[q] - (V[q] + s[q]) * w[p] + A[p] * e[q] - A[q] * e[p]
