"""Arm with locked motors, without friction: tensions F(L), residual torque and K at any angles."""

from __future__ import annotations

import math
from copy import copy

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import ElasticityRangeError
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.solve import ArmState
from cdsm.stiffness_matrix import Stiffness, assemble
from cdsm.support.validation import RANGES
from cdsm.support.values import Array, frozen
from cdsm.wires.elasticity import Elasticity

_ROUNDING = 1e-9  # a tension outside the domain of a law by at most this part is rounding

Indices = slice | NDArray[np.intp]


class LockedArm:
    """Arm under a wrench W (6,), its motors locked where the cables have the tensions F (C,) [N].

    They are locked at ``reference``, or hold the wires of ``rest_length`` (C,) [m], of an arm with
    ``original_length="unstrained"``, or hold the tensions (``tension_held``). Tensions may leave
    the domains of their laws: outside, a cable has the stiffness of the nearest end of the domain,
    or is slack. :func:`require_domain` refuses a result outside. Raises ElasticityRangeError if a
    law gives no strain at F, or if a series spring is longer than its whole cable.
    """

    def __init__(
        self,
        reference: Posture,
        tension: Array,
        wrench: Array,
        rest_length: Array | None = None,
        *,
        tension_held: bool = False,
    ) -> None:
        self.reference, self.tension, self.wrench = reference, tension, wrench
        self.tension_held = tension_held
        laws, L = reference.arm._laws, reference.cable_lengths
        self.rest_length: Array | None = None  # motors that hold tensions hold no length
        self._laws = []
        if tension_held:
            return
        own = laws.original_lengths(L, tension)
        if rest_length is not None:
            own = frozen(np.where(reference.arm.cables.position_controlled, rest_length, L))
        self.rest_length = own
        for law, of in laws.held:
            lengths = None if rest_length is not None else L[of]
            parts = (own[of], laws.series[of], tension[of], lengths)
            try:
                self._laws.append((law, of, _LockedLaw(law, *parts)))
            except ElasticityRangeError as error:
                raise laws.naming(error, of) from None

    def under(self, wrench: Array) -> LockedArm:
        """Return the arm under another wrench (6,), its motors as they are."""
        other = copy(self)
        other.wrench = wrench
        return other

    def resumed(self, pose: Posture, tension: Array) -> LockedArm:
        """Return the arm, its motors as they are, with an equilibrium as the new reference."""
        other = copy(self)
        other.reference, other.tension = pose, tension
        return other

    def at(self, q: Array) -> ArmState:
        """Compute the state at angles ``q`` (nv,) [rad]; InvalidInput if two sites coincide."""
        return self.at_pose(self.reference.arm.at(q, check_limits=False))

    def at_pose(self, pose: Posture) -> ArmState:
        """Compute the state at a posture."""
        F, k = self._tensions(pose)
        J, W, g = pose.length_jacobian, self.wrench, pose._own_torque
        K = pose._active(F) + (J.T * k) @ J + pose._own_stiffness + pose._load(W)
        scale = F @ abs(J) + abs(g) + abs(W) @ abs(pose.jacobian)
        return ArmState(pose, F, F @ J + g - W @ pose.jacobian, K, scale)

    def stiffness(self, pose: Posture) -> Stiffness:
        """Return K_θ at a posture; ElasticityRangeError if a tension is outside its law."""
        F, k = self._tensions(pose)
        for law, of, _ in self._laws:
            require_domain(pose.arm, law, of, F[of])
        lengths = pose.cable_lengths if self.tension_held else self.rest_length
        return assemble(pose, frozen(F), self.wrench, frozen(k), free_length=lengths)

    def _tensions(self, pose: Posture) -> tuple[Array, Array]:
        F, k = self.tension.copy(), np.zeros(self.tension.size)
        for _, of, locked in self._laws:
            F[of], k[of] = locked.tension(pose.cable_lengths[of])
        return F, k


class _LockedLaw:
    """Tension as a function of length, of the n position-controlled cables with one law.

    Arrays are (n,). ``tension`` [N] is that at the cable lengths ``lengths`` [m]; if these are
    None, the wire has no strain at its rest length.
    """

    def __init__(
        self,
        law: Elasticity,
        rest_length: Array,
        series: Array,
        tension: Array,
        lengths: Array | None,
    ) -> None:
        self._law, self._rest_length, self._series, self._near = law, rest_length, series, tension
        self._low = np.full(tension.shape, law.low)
        self._high = np.full(tension.shape, min(law.high, RANGES["tension"].high))
        self._least_strain = law.strain(law.low)
        none, softest = self._elongation(self._low)
        if (softest <= 0.0).any():
            which = np.flatnonzero(softest <= 0.0).tolist()
            problem = "stretches the series spring by more than the whole cable: no wire is left. "
            problem += "Give the cable a longer lead, a stiffer spring or less tension."
            raise ElasticityRangeError(problem, tension[which].tolist(), which)
        self._below, self._above, self._span = 1.0 / softest, none, self._high  # no upper end
        if math.isfinite(law.high):
            self._span, stiffest = self._elongation(self._high)
            self._above = 1.0 / stiffest
        # the length at which the law begins, where F is its lower end
        self._start = rest_length * (1.0 + self._least_strain) + (law.low - law.rest) * series
        if lengths is not None:
            self._start = lengths - self._elongation(law._inside(tension))[0]

    def _elongation(self, F: Array) -> tuple[Array, Array]:
        """Compute the elongation from the lower end of the law to F [m], and its slope [m/N]."""
        strain, EA = self._law._evaluate(F)
        wire = self._rest_length * (strain - self._least_strain)
        return wire + (F - self._law.low) * self._series, self._rest_length / EA + self._series

    def tension(self, lengths: Array) -> tuple[Array, Array]:
        """Compute F [N] and dF/dL [N/m] (n,) at lengths L [m]: Newton's method in a bracket."""
        elongation = lengths - self._start
        inside = np.minimum(np.maximum(elongation, 0.0), self._span)
        low, high, F = self._low, self._high, self._near
        for _ in range(200):
            reached, compliance = self._elongation(F)
            error = reached - inside
            newton = F - error / compliance
            if (abs(newton - F) <= 1e-13 * np.maximum(F, 1.0)).all():
                break
            low, high = np.where(error < 0.0, F, low), np.where(error > 0.0, F, high)
            F = np.where((low <= newton) & (newton <= high), newton, (low + high) / 2.0)
        k, excess = 1.0 / compliance, elongation - inside
        if np.count_nonzero(excess):
            k = np.where(excess == 0.0, k, np.where(excess < 0.0, self._below, self._above))
            F = np.maximum(F + k * excess, 0.0)
            k[(F == 0.0) & (excess < 0.0)] = 0.0
        return F, k


def require_domain(
    arm: Manipulator, law: Elasticity, of: Indices, tension: Array, where: str = ""
) -> None:
    """Raise ElasticityRangeError if the tensions F [N] of the cables ``of`` are outside their law.

    ``where`` begins the error message.
    """
    inside = np.clip(tension, law.low, law.high)
    near = abs(tension - inside) <= _ROUNDING * tension
    try:
        law._inside(np.where(near, inside, tension))
    except ElasticityRangeError as error:
        said = ElasticityRangeError(f"{where}{error.problem}", error.tension, error.indices)
        raise arm._laws.naming(said, of) from None
