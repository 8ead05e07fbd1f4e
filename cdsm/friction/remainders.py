"""Bounds of the errors of Taylor expansions of an arm, valid in a neighbourhood of a posture.

The proof of a band needs them (:mod:`cdsm.friction.rest_states`). The joints move by δ along a
straight path θ_0 + s δ, 0 ≤ s ≤ 1. For one segment of length l, let σ [rad] be the sum of the turns
of those joints that change l. Over the neighbourhood, let r be the largest distance of the two
sites of the segment from these joints, p the largest motion of a site across the segment per radian
and m the smallest l. Then |d³l/ds³| ≤ c σ³ with c = 3 r p²/m² + 3 r p/m + r. So l differs from its
second-order expansion by at most c σ³/6, and ∂l/∂θ_i from its tangent by at most c σ²/2. The
segment turns by an angle of at most p σ/m, whose second derivative by s is at most
(2 p r/m² + p²/m² + r/m) σ².
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import SolverError
from cdsm.kernels.stiffness import single_load_stiffness
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.values import Array

_STEP = 1e-4  # step of finite differences [rad] or [m]; their truncation is added to the bounds

TOO_FAR = "finds no band: friction may keep the arm too far from the reference"
"""Error message if a neighbourhood is so wide that its bounds do not exist."""

_ITERATIONS = 30  # steps of a fixed point that converges by a factor of ten or more


class Remainders:
    """Bounds of the errors of Taylor expansions at the posture of ``K``, for |δ_i| ≤ ρ_i.

    δ is the change of the joint angles, and ρ is the argument ``within`` (nv,) [rad]. A motion ρ of
    a prismatic joint [m] is treated as a rotation by ρ/r about an axis at the distance r, which
    moves points by the same distance. Each attribute is a bound of the difference between a
    quantity and its expansion.

    Attributes:
        length: Bound for the length of each segment, expanded to second order (S,) [m].
        gradient: Bound for the gradient ∂l/∂θ of each length, expanded to first order (S, nv)
            [m/rad].
        turn: Bound for each wrap angle, taken as constant (P,) [rad].
        wrap: Bound for each wrap angle, expanded to first order (P,) [rad]; inf where the angle may
            be zero.
        tip: Bound for the displacement of the tip, expanded to third order [m].
        body: Bound for the torques of weight and wrench, expanded to second order (nv,) [N m].
    """

    def __init__(self, K: Stiffness, within: Array) -> None:
        pose = K.posture
        segments, slides = pose.segments, pose.arm.slides
        count, nv = segments.lengths.size, within.size
        self.length, self.gradient = np.zeros(count), np.zeros((count, nv))
        tilt, bend = np.zeros(count), np.zeros(count)  # of the direction of each segment
        routing, (origin, axis, slide, site) = segments._routing, segments._frames
        table, joint = routing.segment, routing.joint
        for row in range(len(table) - 1):
            s, a, b = table[row, :3]
            rows = joint[table[row, 3] : table[row + 1, 3]]
            ends = site[[a, b], None, :] - origin[rows]
            lever = float(np.linalg.norm(ends, axis=2).max())
            per = np.where(slides[rows - 1], 1.0 / lever, 1.0)
            turn = float(per @ within[rows - 1])
            r = lever * math.exp(turn)
            m = segments.lengths[s] - r * turn
            if m <= 0.0:  # sites may meet
                raise SolverError("highs", TOO_FAR)
            moved = np.cross(axis[rows], ends)  # of either end: a hole sees the far one turn
            if slide.size:
                moved = moved + slide[rows]
            u = (site[b] - site[a]) / segments.lengths[s]
            across = np.linalg.norm(moved - (moved @ u)[..., None] * u, axis=2) / per
            p = p_0 = float(across.max())
            for _ in range(_ITERATIONS):  # p grows with the turn at most at this rate
                p = min(p_0 + turn * (p * r / m + p**2 / m + r), r)
            tilt[s] = p * turn / m
            bend[s] = (2.0 * p * r / m**2 + (p / m) ** 2 + r / m) * turn**2
            third = 3.0 * r * (p / m) ** 2 + 3.0 * r * p / m + r
            self.length[s] = third * turn**3 / 6.0
            self.gradient[s, rows - 1] = third * per * turn**2 / 2.0
        first, second = segments.chains.hole, segments.chains.hole + 1
        self.turn = tilt[first] + tilt[second]
        angle = segments.wrap - segments.chains.wrap
        sine = np.sin(angle) - self.turn  # sin is 1-Lipschitz
        rate = bend[first] + bend[second] + 2.0 * tilt[first] * tilt[second] + self.turn**2
        self.wrap = np.divide(rate, 2.0 * sine, out=np.full(angle.size, math.inf), where=sine > 0.0)
        self.tip, self.body = _body_remainders(K, within, slides)


class Bends:
    """Second derivatives of the torques of weight and wrench at the posture of ``K``.

    Central differences compute them; :class:`Remainders` includes the truncation error.

    Attributes:
        body: ∂²τ_i/∂θ_j∂θ_k (nv, nv, nv) [N m/rad²] of the torques τ of weight and wrench.
    """

    def __init__(self, K: Stiffness) -> None:
        pose = K.posture
        steps = _STEP * np.eye(pose.q.size)
        self._joints = pose.arm._body.tip_joints
        self._ends = [
            [pose.arm.at(pose.q + sign * step, check_limits=False) for sign in (1.0, -1.0)]
            for step in steps
        ]
        weight = [ahead.gravity_stiffness - back.gravity_stiffness for ahead, back in self._ends]
        self.body = np.stack(weight, axis=-1) / (2.0 * _STEP) + self.of_wrench(K.wrench)

    def of_wrench(self, wrench: Array) -> Array:
        """Compute −∂²(J_Xᵀ W)/∂θ² (nv, nv, nv) [N m/rad²] for ``wrench`` W (6,)."""
        loads = [
            [single_load_stiffness(end.jacobian, wrench, self._joints) for end in pair]
            for pair in self._ends
        ]
        return np.stack([ahead - back for ahead, back in loads], axis=-1) / (2.0 * _STEP)


def _body_remainders(K: Stiffness, within: Array, slides: NDArray[np.bool_]) -> tuple[float, Array]:
    """Compute the bounds ``tip`` [m] and ``body`` (nv,) [N m] of :class:`Remainders`.

    ``within`` is ρ (nv,), the bound of the joint motions |δ|. ``slides`` (nv,) marks prismatic
    joints.
    """
    model, pose = K.posture.arm._model, K.posture
    masses, tree = model.masses, model.tree
    reach = float(np.linalg.norm(tree.translation, axis=1).sum()) + float(abs(pose.q) @ slides)
    reach += float(np.linalg.norm(np.vstack([masses.centre, masses.point]), axis=1).max())
    per = np.where(slides, 1.0 / reach, 1.0)
    turn = float(per @ within)
    reach *= math.exp(turn)
    weight = float(masses.mass.sum() * np.linalg.norm(masses.gravity))
    force, moment = np.linalg.norm(K.wrench[:3]), np.linalg.norm(K.wrench[3:])
    torque = (weight + float(force)) * reach + float(moment)
    cut = _STEP**2 / 6.0  # differences truncate two derivatives on
    torque *= turn**3 / 6.0 + cut * turn**2 / 2.0
    return reach * (turn**4 / 24.0 + cut * turn**3 / 6.0), torque * per
