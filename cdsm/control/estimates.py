"""Estimate joint angles from wire and tension at the motors, with stretch and friction.

A cable with the paid-out wire l_0 and the tension F at its motor has the length

    L(q) = l_0 (1 + ε̄/s) + (F − F_rest)/k_series,   ε̄ = Σ_j l_j ε(ρ_j F)/Σ_j l_j,

with the length l_j and the tension ρ_j F of segment j, the strain ε of the law, the stiffness
k_series of the series spring, and the tension F_rest at which this spring has no elongation. The
rigidity factor s is the actual rigidity of all wires divided by the rigidity of their laws. There
are more cables than joints, so the cable lengths give the angles and s: the rigidity is calibrated
while the arm moves. All steps together give s (recursive least squares); the last step gives the
angles.

ρ_j is the tension of segment j divided by the tension at the motor; friction makes it differ from
1. The estimate contains the length of wire in each segment. At each step wire slides through the
holes according to the friction law.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from cdsm.control.laws import Reading
from cdsm.control.sensors import Sensors
from cdsm.friction.capstan import ChainProblem
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.values import Array
from cdsm.tension import grip

UNSURE: Final = 0.3
"""Standard deviation of 1/s before the first measurement."""

_FINEST: Final = 1e-9  # smallest assumed error of a length [m], also with exact sensors
_LEAST_SPREAD: Final = 1e-3  # smallest assumed error of a tension [N], also with exact load cells

_STEPS, _CONVERGED = 8, 1e-8
"""Largest number of Gauss–Newton steps, and the step [rad] that ends them."""


class Estimate(NamedTuple):
    """State of the arm as the controller estimates it."""

    pose: Posture  # of the controller's arm, within its joint limits
    tension: Array  # mean tension along each cable (C,) [N]
    ratio: Array  # mean tension along each cable divided by that at the motor (C,) [-]
    force: Array  # force at the tip (3,) [N], base axes
    softness: float  # 1/s: strain divided by that of the law [-]
    variance: float  # variance of ``softness`` [-]
    # natural length of wire in each segment (S,) [m]; it depends on all past sliding
    natural: Array
    shares: Array  # ρ: tension of each segment divided by that at the motor (S,) [-]


@dataclass(frozen=True, eq=False)
class Observer:
    """Estimator of joint angles, rigidity factor s and tip force from the readings of sensors.

    ``arm`` is the controller's model. ``sensors`` say how large the errors of the readings are.
    """

    arm: Manipulator
    sensors: Sensors

    def begin(self, q: Array, reading: Reading) -> Estimate:
        """Return the first estimate, at known joint angles (nv,) and a reading there.

        It assumes that the tension is equal along each cable.
        """
        pose = self.arm.at(q)
        cable = pose.segments.chains.cable
        F = np.clip(reading.tension, *self._domains)
        natural = self._problem.rest_lengths(pose.segments.lengths, F[cable])
        one, shares = np.ones(F.size), np.ones(cable.size)
        force = self._tip_force(pose, F[cable])
        return Estimate(pose, F, one, force, 1.0, UNSURE**2, natural, shares)

    def update(self, before: Estimate, reading: Reading) -> Estimate:
        """Return the estimate after one more reading; ``before`` is the previous estimate."""
        locked, laws = self.arm.cables.position_controlled, self.arm._laws
        F, wire = np.clip(reading.tension, *self._domains), reading.wire
        pose, x = before.pose, before.softness
        strain = self._mean_strain(pose, before.shares, F)
        spring = laws.series * (F - laws.rest)
        # an error of the tension stretches the cable; the encoder rounds by half a count at most
        slack = self._tension_spread * self._compliance(wire, F, x)
        spread = np.hypot(slack, self._encoder_spread)[locked]
        q, sure = pose.q, np.sqrt(before.variance)
        prior = np.append(np.zeros(q.size), 1.0) / sure
        for _ in range(_STEPS):
            pose = self.arm.at(q, check_limits=False)
            missing = (wire * (1.0 + x * strain) + spring - pose.cable_lengths)[locked] / spread
            rows = np.c_[pose.length_jacobian[locked], -(wire * strain)[locked]] / spread[:, None]
            scaled = np.vstack([rows, prior])
            right = np.append(missing, (before.softness - x) / sure)
            step = np.linalg.lstsq(scaled, right, rcond=None)[0]
            q, x = q + step[:-1], x + float(step[-1])
            if abs(step).max() < _CONVERGED:
                break
        variance = float(np.linalg.inv(scaled.T @ scaled)[-1, -1])
        inside = np.clip(q, self.arm.lower, self.arm.upper)
        pose = pose if (inside == q).all() else self.arm.at(inside)
        return self._after_sliding(before, pose, F, x, variance)

    def _after_sliding(
        self, before: Estimate, pose: Posture, F: Array, softness: float, variance: float
    ) -> Estimate:
        """Return the estimate at a new posture, after wire has slid through the holes.

        ``before`` is the previous estimate, which has the wire in each segment. ``F`` (C,) [N] are
        the tensions at the motors. The new estimate stores ``softness`` and ``variance``.
        """
        segments = pose.segments
        chains, near = segments.chains, before.shares * F[segments.chains.cable]
        chain = self._problem.settle(segments.lengths, before.natural, segments.ratio, F, near)
        motor = F[chains.cable]
        # in a slack cable all tensions are 0: their ratio is taken as even
        shares = np.divide(chain.tension, motor, out=np.ones_like(motor), where=motor > 0.0)
        means = np.add.reduceat(shares * segments.lengths, chains.start[:-1]) / pose.cable_lengths
        force = self._tip_force(pose, chain.tension)
        natural = chain.rest_length
        return Estimate(pose, means * F, means, force, softness, variance, natural, shares)

    def _tip_force(self, pose: Posture, tension: Array) -> Array:
        """Compute the force f (3,) [N] at the tip that best balances the tensions T (S,) [N].

        T are the tensions of all segments. f solves J_vᵀ f = Σ_j T_j g_j + g by weighted least
        squares, with the translational rows J_v of the tip Jacobian, the gravity torque g and the
        gradient g_j of the length of segment j. The weights follow from the errors of the load
        cells and from friction.
        """
        segments, J = pose.segments, pose.length_jacobian
        F = tension[segments.chains.start[:-1]]
        spread = np.hypot(max(self._tension_spread, _LEAST_SPREAD), grip(pose) * F)
        root = np.linalg.cholesky((J.T * spread**2) @ J)
        torque = tension @ segments.length_jacobian + pose.gravity_torque
        rows = solve_triangular(root, pose.jacobian[:3].T, lower=True)
        wanted = solve_triangular(root, torque, lower=True)
        return np.asarray(np.linalg.lstsq(rows, wanted, rcond=None)[0])

    def _mean_strain(self, pose: Posture, shares: Array, F: Array) -> Array:
        """Compute the mean strain ε̄ (C,) [-] of each cable by its law.

        ``F`` (C,) [N] are the tensions at the motors. ``shares`` ρ (S,) are the tensions of the
        segments, divided by the tension at the motor.
        """
        segments = pose.segments
        chains = segments.chains
        strain = np.zeros(segments.lengths.size)
        T = shares * F[chains.cable]
        for law, of in self._problem.laws:
            mine = np.isin(chains.cable, of)
            strain[mine] = law.strain(np.clip(T[mine], law.low, law.high))
        total = np.add.reduceat(strain * segments.lengths, chains.start[:-1])
        return np.asarray(total / pose.cable_lengths)

    def _compliance(self, wire: Array, F: Array, softness: float) -> Array:
        """Compute how much cables lengthen with their tensions, dL/dF = l_0/(s EA) + 1/k_series.

        The paid-out ``wire`` l_0 (C,) [m] is constant, EA is that of the laws, and ``softness`` is
        1/s. The result is (C,) [m/N].
        """
        soft = np.array(self.arm._laws.series)
        for law, of in self._problem.laws:
            soft[of] += softness * wire[of] / law.rigidity(F[of])
        return soft

    @cached_property
    def _problem(self) -> ChainProblem:
        arm = self.arm
        chains = arm.at(np.clip(0.0, arm.lower, arm.upper)).segments.chains
        even = np.zeros(len(arm.cables))
        return ChainProblem(arm.cables, chains.start, even, unstrained=True)

    @cached_property
    def _domains(self) -> Array:
        laws = [cable.elasticity for cable in self.arm.cables]
        return np.array([[law.low for law in laws], [law.high for law in laws]])

    @property
    def _encoder_spread(self) -> float:
        """Standard deviation of the rounding of an encoder [m]; never zero."""
        return max(self.sensors.encoder / math.sqrt(12.0), _FINEST)

    @property
    def _tension_spread(self) -> float:
        return math.hypot(self.sensors.tension_noise, self.sensors.tension_bias)
