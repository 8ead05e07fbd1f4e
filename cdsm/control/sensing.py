"""Sensors at the motors, and the state of the arm that a controller estimates from them.

A cable with the paid-out wire l_0 and the tension F at its motor has the length

    L(q) = l_0 (1 + ε̄/s) + (F − F_0)/k_series,   ε̄ = Σ_j l_j ε(ρ_j F)/Σ_j l_j,

with the length l_j and the tension ρ_j F of segment j, the strain ε of the law, the stiffness
k_series of the series spring, and the tension F_0 at which this spring has no elongation. The
rigidity factor s is the actual rigidity of all wires divided by the rigidity of their laws. There
are more cables than joints, so the cable lengths give the angles and s: the rigidity is calibrated
while the arm moves. All steps together give s (recursive least squares); the last step gives the
angles. Friction makes ρ_j differ from 1: at each step wire slides through the holes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, NamedTuple, final

import numpy as np

from cdsm.estimation.balanced_loads import Instruments
from cdsm.estimation.estimate import TipForce, tip_force
from cdsm.friction.capstan import ChainProblem
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.validation import SMALLEST, checked_quantity, not_negative, scalar, whole_number
from cdsm.support.values import Array

_LARGEST_NOISE: Final = 4.0  # standard deviations at which noise is cut off
_UNSURE: Final = 0.3  # standard deviation of 1/s before the first measurement
_FINEST: Final = 1e-9  # smallest assumed error of a length [m], also with exact sensors
_LEAST_SPREAD: Final = 1e-3  # smallest assumed error of a tension [N], also with exact load cells
_STEPS = 8  # most Gauss–Newton steps, and the step [rad] that ends them
_CONVERGED = 1e-8


class MotorMeasurement(NamedTuple):
    """Values at the motors at one step, as measured or true.

    Attributes:
        paid_out: `l_0` paid out by each motor (C,) [m], from its encoder.
        tension: F at each motor (C,) [N].
    """

    paid_out: Array
    tension: Array


@final
@dataclass(frozen=True, kw_only=True)
class Sensors:
    """Sensors of all motors: an encoder for the wire and a load cell for the tension.

    Encoders count from where the cable is just taut (zero strain) at a known posture, so they
    measure the rest length `l_0` that is paid out.

    Attributes:
        encoder: Length [m] of one count of an encoder; 0: exact.
        tension_noise: Standard deviation [N] of the Gaussian noise of a load cell, which is cut off
            at ± four standard deviations.
        tension_bias: Constant error of all load cells [N].
        delay: Number of control steps by which all measurements are late.
        seed: Seed of the noise: the same seed gives the same noise in each run.

    Raises:
        InvalidInput: A value is negative or not a number, or delay or seed are not whole numbers.

    Example:
        >>> import cdsm
        >>> sensors = cdsm.Sensors(encoder=1e-5, tension_noise=0.1, seed=1)
        >>> sensors.delay
        0
    """

    encoder: float = 1e-5
    tension_noise: float = 0.0
    tension_bias: float = 0.0
    delay: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        not_negative("encoder", self.encoder, "m")
        checked_quantity("tension_noise", self.tension_noise, "force", zero=True)
        scalar("tension_bias", self.tension_bias)
        whole_number("delay", self.delay, 0)
        whole_number("seed", self.seed, 0)

    def measure(
        self, true_values: Sequence[MotorMeasurement], random: np.random.Generator
    ) -> MotorMeasurement:
        """Measure the newest of the ``true_values``, or an earlier one if there is a delay.

        The noise is drawn from ``random``; each call draws the same number of random numbers.
        """
        now = true_values[max(len(true_values) - 1 - int(self.delay), 0)]
        counted = now.paid_out
        if self.encoder:
            counted = self.encoder * np.round(counted / self.encoder)
        draws = np.clip(random.standard_normal(counted.size), -_LARGEST_NOISE, _LARGEST_NOISE)
        return MotorMeasurement(
            counted, now.tension + self.tension_bias + self.tension_noise * draws
        )


class Estimate(NamedTuple):
    """State of the arm as the controller estimates it."""

    pose: Posture  # of the controller's arm, within its joint limits
    ratio: Array  # mean tension along each cable divided by that at the motor (C,) [-]
    tip_force: TipForce  # force at the tip, base axes, and how well it is known
    softness: float  # 1/s: strain divided by that of the law [-]
    variance: float  # variance of ``softness`` [-]
    rest_length: Array  # of the wire in each segment (S,) [m]; it depends on all past sliding
    shares: Array  # ρ: tension of each segment divided by that at the motor (S,) [-]


@dataclass(frozen=True, eq=False)
class Observer:
    """Estimator of joint angles, rigidity factor s and tip force from measurements.

    ``arm`` is the controller's model. ``sensors`` say how large the errors of measurements are.
    """

    arm: Manipulator
    sensors: Sensors

    def initial(self, q: Array, measured: MotorMeasurement) -> Estimate:
        """Return the first estimate, at known joint angles (nv,), with even tensions of cables."""
        pose = self.arm.at(q)
        cable = pose.segments.chains.cable
        T = np.clip(measured.tension, *self._domains)[cable]
        rest_length = self._problem.rest_lengths(pose.segments.lengths, T)
        one = np.ones(len(self.arm.cables))
        shares = np.ones(cable.size)
        force = self._tip_force(pose, T, np.zeros(pose.q.size))
        return Estimate(pose, one, force, 1.0, _UNSURE**2, rest_length, shares)

    def update(self, before: Estimate, measured: MotorMeasurement) -> Estimate:
        """Return the estimate after one more measurement; ``before`` is the previous estimate."""
        locked = self.arm.cables.position_controlled
        laws = self.arm.laws
        F = np.clip(measured.tension, *self._domains)
        wire = measured.paid_out
        pose = before.pose
        q = before.pose.q
        x = before.softness
        strain = self._mean_strain(pose, before.shares, F)
        soft = np.array(laws.series)
        for law, cables in self._problem.laws:
            soft[cables] += x * wire[cables] / law.rigidity(F[cables])
        spring = laws.series * (F - laws.rest)
        # an error of the tension stretches the cable; the encoder rounds by half a count at most
        counting = max(self.sensors.encoder / math.sqrt(12.0), _FINEST)
        spread = np.hypot(self._tension_spread * soft, counting)[locked]
        sure = math.sqrt(before.variance)
        prior = np.append(np.zeros(q.size), 1.0) / sure
        for _ in range(_STEPS):
            pose = self.arm.at(q, check_limits=False)
            missing = (wire * (1.0 + x * strain) + spring - pose.cable_lengths)[locked] / spread
            rows = np.c_[pose.length_jacobian[locked], -(wire * strain)[locked]] / spread[:, None]
            scaled = np.vstack([rows, prior])
            right = np.append(missing, (before.softness - x) / sure)
            step = np.linalg.lstsq(scaled, right, rcond=None)[0]
            q = q + step[:-1]
            x = x + float(step[-1])
            if abs(step).max() < _CONVERGED:
                break
        covariance = np.linalg.pinv(scaled)
        pose = self.arm.at(np.clip(q, self.arm.lower, self.arm.upper))
        angle_std = np.linalg.norm(covariance[:-1], axis=1)
        return self._after_sliding(before, pose, F, angle_std)._replace(
            softness=x, variance=float(covariance[-1] @ covariance[-1])
        )

    def _after_sliding(
        self, before: Estimate, pose: Posture, F: Array, angle_std: Array
    ) -> Estimate:
        """Return the estimate after wire has slid through holes; ``F`` (C,) [N] at the motors."""
        segments = pose.segments
        chains = segments.chains
        motor = F[chains.cable]
        near = before.shares * motor
        chain = self._problem.settle(segments.lengths, before.rest_length, segments.ratio, F, near)
        # in a slack cable all tensions are 0: their ratio is taken as even
        shares = np.divide(chain.tension, motor, out=np.ones_like(motor), where=motor > 0.0)
        ratio = np.add.reduceat(shares * segments.lengths, chains.start[:-1]) / pose.cable_lengths
        force = self._tip_force(pose, chain.tension, angle_std)
        return before._replace(
            pose=pose, ratio=ratio, tip_force=force, rest_length=chain.rest_length, shares=shares
        )

    def _tip_force(self, pose: Posture, tension: Array, angle_std: Array) -> TipForce:
        """Estimate the force at the tip from the followed tensions T (S,) [N] of the segments."""
        chains = pose.segments.chains
        F = tension[chains.start[:-1]]
        before = tension[chains.hole]
        ratio = np.divide(
            tension[chains.hole + 1], before, out=np.ones(before.size), where=before > 0.0
        )
        exponents = np.log(np.maximum(ratio, SMALLEST))
        spread = np.full(F.size, max(self._tension_spread, _LEAST_SPREAD))
        return tip_force(pose, F, exponents, Instruments(spread, angle_std))

    def _mean_strain(self, pose: Posture, shares: Array, F: Array) -> Array:
        """Compute the mean strains ε̄ (C,) [-] from F (C,) [N] at the motors and shares ρ (S,)."""
        segments = pose.segments
        chains = segments.chains
        T = shares * F[chains.cable]
        strain = np.zeros(segments.lengths.size)
        for law, cables in self._problem.laws:
            mine = np.isin(chains.cable, cables)
            strain[mine] = law.strain(np.clip(T[mine], law.low, law.high))
        total = np.add.reduceat(strain * segments.lengths, chains.start[:-1])
        return np.asarray(total / pose.cable_lengths)

    @cached_property
    def _problem(self) -> ChainProblem:
        arm = self.arm
        chains = arm.at(arm.body.straight).segments.chains
        return ChainProblem(arm.cables, chains.start)

    @cached_property
    def _domains(self) -> Array:
        laws = [cable.elasticity for cable in self.arm.cables]
        return np.array([[law.low for law in laws], [law.high for law in laws]])

    @property
    def _tension_spread(self) -> float:
        return math.hypot(self.sensors.tension_noise, self.sensors.tension_bias)


def with_rigidity(arm: Manipulator, factor: float) -> Manipulator:
    """Return the arm with ``factor`` times the rigidity of all its wires."""
    laws = {id(cable.elasticity): cable.elasticity.scaled(factor) for cable in arm.cables}
    return arm.with_cables(
        [replace(cable, elasticity=laws[id(cable.elasticity)]) for cable in arm.cables]
    )
