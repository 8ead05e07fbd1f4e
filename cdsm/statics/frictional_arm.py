"""Loaded arm whose cables stick and slip in their holes: segment tensions, residual, ∂r/∂q.

    r(q) = Σ_j T_j g_j + g − J_Xᵀ W,    ∂r/∂q = Σ_j (T_j H_j + g_jᵀ ∂T_j/∂q) + ∂g/∂q − ∂(J_Xᵀ W)/∂q

r is the residual torque and g the gravity torque. T_j is the tension of segment j; g_j and H_j are
the gradient and the Hessian of its length. The natural length of a segment is the length of its
wire at zero strain. When the arm moves to a posture, :mod:`cdsm.friction.chain_problem` computes
the tensions there from the natural lengths before the motion. ∂r/∂q is not symmetric where cables
slide: friction has no potential. Without friction the states are those of
:class:`~cdsm.statics.locked_motors.LoadedArm`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdsm.friction.chain_problem import ChainProblem, ChainSolution
from cdsm.posture import Posture
from cdsm.statics.locked_motors import ROUNDING, tilt_torque
from cdsm.support.values import Array


class FrictionalState(NamedTuple):
    """State of an arm at one posture, after the cables have slipped where friction did not hold.

    The tensions meet the law of friction at every hole, but need not balance the arm.
    :func:`~cdsm.statics.trust_region.find_rest` searches for the equilibrium among such states.
    """

    pose: Posture
    chain: ChainSolution
    residual: Array  # r (nv,) [N m]
    torque: Array  # r minus the torque of with_external_torque (nv,) [N m]
    rounding: Array  # rounding of r (nv,) [N m]
    stiffness: Array  # ∂r/∂q (nv, nv) [N m/rad]
    slope: Array  # ∂T/∂q (S, nv) [N/rad]

    def with_external_torque(self, torque: Array | float) -> FrictionalState:
        """Return this state with the attribute ``torque`` = r − the argument (nv,) [N m].

        A search for zero then finds r = the argument: the equilibrium of an arm on whose joints
        this torque also acts, and so holds back a part of the load.
        """
        return self._replace(torque=self.residual - torque)


class FrictionalArm(NamedTuple):
    """Arm with friction under a wrench; its methods compute its state at other joint angles."""

    problem: ChainProblem
    stops: tuple[Array, Array]  # lowest and highest angles (nv,) [rad]
    natural: Array  # natural length of each segment before the move (S,) [m]
    wrench: Array  # W (6,): force [N], then moment [N m]
    forced: Array  # tension of force-controlled cables (C,) [N]; NaN: position-controlled

    def moved(self, q: Array, near: FrictionalState) -> FrictionalState:
        """Compute the state at joint angles ``q`` (nv,) [rad].

        The search for the tensions starts from ``near``, the state at a posture close by. Raises
        CableError if two sites coincide.
        """
        pose = near.pose.arm.at(q, check_limits=False)
        return self.at(pose, np.maximum(near.chain.tension + near.slope @ (q - near.pose.q), 0.0))

    def settled(self, pose: Posture, near: Array) -> ChainSolution:
        """Compute the tensions and slips of all segments at a posture.

        The search for the tensions starts at ``near`` (S,) [N].
        """
        lengths, ratio = pose.segments.lengths, pose.segments.ratio
        return self.problem.settle(lengths, self.natural, ratio, self.forced, near)

    def residual(self, pose: Posture, tension: Array) -> Array:
        """Compute the residual torque r (nv,) [N m] under segment tensions (S,) [N]."""
        torque = tension @ pose.segments.length_jacobian
        return np.asarray(torque + pose.gravity_torque - self.wrench @ pose.jacobian)

    def at(self, pose: Posture, near: Array) -> FrictionalState:
        """Compute the state at a posture; the search for tensions starts at ``near`` (S,) [N]."""
        chain, segments = self.settled(pose, near), pose.segments
        holes, nv, T = segments.chains, pose.q.size, chain.tension
        lengths, J = segments.lengths, segments.length_jacobian
        # the last column is the rounding of the tensions, from that of all lengths
        gradient, grip = np.empty((T.size, nv + 1)), np.zeros((T.size, nv + 1))
        gradient[:, :nv], gradient[:, nv] = J, lengths
        grip[holes.hole, :nv] = holes.friction[:, None] * segments.wrap_jacobian
        slopes = self.problem.tangent(chain, self.forced, gradient, grip)
        slope, rounded = slopes[:, :nv].copy(), abs(slopes[:, nv])
        K = segments.active(T) + pose.gravity_stiffness + pose._load(self.wrench)
        K = K + J.T @ slope
        residual = self.residual(pose, T)
        terms = (T + rounded) @ abs(J) + abs(self.wrench) @ abs(pose.jacobian)
        terms += abs(pose.gravity_torque) + abs(K) @ abs(pose.q)
        terms += tilt_torque(segments._routing, segments._spans, segments._sites, T)
        return FrictionalState(pose, chain, residual, residual, ROUNDING * terms, K, slope)
