"""Arm with locked motors at any posture: tensions F(L) from cable lengths, residual torque."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.cable import Cable
from cdsm.errors import ElasticityRangeError
from cdsm.posture import Posture
from cdsm.routing import Routing, Spans
from cdsm.stiffness_matrix import Stiffness, assemble
from cdsm.support.validation import RANGES
from cdsm.support.values import Array, frozen
from cdsm.wires.elasticity import Elasticity

ROUNDING = 16.0 * float(np.finfo(np.float64).eps)
"""Relative rounding of a torque, from the angles, lengths and tensions in its sum."""

_APART = 1e-6
"""A joint stops this far [rad] before its disks touch, where a cable would have no direction."""

_BEYOND = 1e-9  # a tension outside the domain of a law by at most this part is rounding


class Iterate(NamedTuple):
    """State of an arm at one posture, balanced or not, in the search for equilibrium."""

    K: Stiffness  # with the original lengths of the reference; its residual is r(q)
    torque: Array  # r minus the torque of with_external_torque (nv,) [N m]
    rounding: Array  # rounding of r (nv,) [N m]

    @property
    def pose(self) -> Posture:
        """The posture."""
        return self.K.posture

    @property
    def stiffness(self) -> Array:
        """K_θ (nv, nv) [N m/rad]."""
        return self.K.joint

    def with_external_torque(self, torque: Array | float) -> Iterate:
        """Return this state with the attribute ``torque`` = r − the argument (nv,) [N m].

        A search for zero then finds r = the argument: the equilibrium of an arm on whose joints
        this torque also acts, and so holds back a part of the load.
        """
        return self._replace(torque=self.K.residual - torque)


class LoadedArm:
    """Arm under a wrench W (6,), its motors locked at a reference posture with tensions F (C,) [N].

    It computes the tensions and the residual torque r(q) at other postures. A position-controlled
    cable keeps its original length l_0. Its elongation is its elongation at the reference plus the
    change of its length. A force-controlled cable keeps its tension. During a search, tensions may
    leave the domains of their laws: outside, a cable has the stiffness of the nearest end of the
    domain, or is slack. :meth:`require_domains` refuses a result outside. ``lengths`` (C,) [m] are
    the cable lengths L at which the tensions are F; by default the lengths at the reference.

    Raises:
        ElasticityRangeError: A law gives no strain; or a series spring stretches by more than the
            whole cable, so that no wire is left. The error names the cables.
    """

    def __init__(
        self, reference: Posture, tension: Array, wrench: Array, lengths: Array | None = None
    ) -> None:
        self.reference = reference
        self.tension = tension
        self.wrench = wrench
        self.stops = stops(reference)
        laws, L = reference.arm._laws, reference.cable_lengths if lengths is None else lengths
        self._free_length = laws.original_lengths(L, tension)
        self._laws = []
        for law, cables in laws.held:
            parts = (self._free_length[cables], laws.series[cables], L[cables], tension[cables])
            try:
                self._laws.append(_LockedLaw(law, cables, *parts))
            except ElasticityRangeError as error:
                raise laws.naming(error, cables) from None

    def at(self, pose: Posture, near: Array) -> Iterate:
        """Compute the state at a posture; the search for tensions starts at ``near`` (C,) [N]."""
        F, k = self.tension.copy(), np.zeros(near.size)
        for law in self._laws:
            cables = law.cables
            F[cables], k[cables] = law.tension(pose.cable_lengths[cables], near[cables])
        K = assemble(pose, frozen(F), self.wrench, frozen(k), free_length=self._free_length)
        return Iterate(K, K.residual, rounding(K))

    def moved(self, q: Array, near: Iterate) -> Iterate:
        """Compute the state at joint angles ``q`` (nv,) [rad].

        The search for the tensions starts from ``near``, the state at a posture close by. Raises
        CableError if two sites coincide.
        """
        before = near.K
        pose = self.reference.arm.at(q, check_limits=False)
        longer = pose.cable_lengths - before.posture.cable_lengths
        return self.at(pose, before.tension + before.cable_stiffness * longer)

    def require_domains(self, tension: Array) -> None:
        """Raise ElasticityRangeError if tensions (C,) [N] are outside the domains of their laws."""
        groups = [(each.law, each.cables) for each in self._laws]
        require_domains(self.reference.arm.cables, groups, tension)


def lengths_with(wire: Array, pose: Posture, tension: Array) -> Array:
    """Compute the cable lengths L (C,) [m] at which the cables have ``tension`` (C,) [N].

    ``wire`` are the original lengths l_0 (H,) [m] of the H position-controlled cables. For the
    other cables the result has their lengths at ``pose``.
    """
    lengths, cables = pose.cable_lengths.copy(), pose.arm.cables
    held = np.flatnonzero(cables.position_controlled)
    for c, l_0 in zip(held, wire.tolist(), strict=True):
        lengths[c] = l_0 + cables[c].elongation(tension[c], l_0)
    return lengths


def require_domains(
    cables: Sequence[Cable],
    groups: Iterable[tuple[Elasticity, slice | NDArray[np.intp]]],
    tension: Array,
    where: str = "at the equilibrium",
) -> None:
    """Raise ElasticityRangeError if tensions (C,) [N] are outside the domains of their laws.

    ``groups`` are pairs: a law, and the indices of its cables. ``where`` begins the error message.
    """
    for law, of in groups:
        F = tension[of]
        outside = (law.low * (1.0 - _BEYOND) > F) | (law.high * (1.0 + _BEYOND) < F)
        if np.count_nonzero(outside):
            slack = (law.low > F).any()
            below = ", or continue it below by its slack_below()" if slack else ""
            at = np.arange(tension.size)[of][outside].tolist()
            raise ElasticityRangeError(
                f"{where}; the elasticity is defined on {law._span}, and says neither how a cable "
                "goes slack below it nor how it yields above. Change the tensions or the load, or "
                f"use an elasticity that covers them{below}.",
                F[outside].tolist(),
                at,
                [cables[c].name for c in at],
            )


def stops(reference: Posture) -> tuple[Array, Array]:
    """Return the angles (nv,) [rad] of the lower and of the upper stops of all joints.

    A stop is at the joint limit, or 1e-6 rad before it if disks touch there. A joint that is nearer
    to its limit in ``reference`` has the stop at its angle there.
    """
    arm, q = reference.arm, reference.q
    touching = np.zeros(arm.nv, dtype=np.bool_)  # joints that their disks stop
    if arm.is_serpentine:
        joints = arm.geometry.joints
        touching[:] = [joint.limit is None for joint in joints for _ in joint.axes]
    apart = np.where(touching, _APART, 0.0)
    # the reference may be nearer to the stop
    return np.minimum(arm.lower + apart, q), np.maximum(arm.upper - apart, q)


def rounding(K: Stiffness) -> Array:
    """Estimate the rounding error (nv,) [N m] of :attr:`~cdsm.Stiffness.residual`."""
    pose = K.posture
    force = K.tension + K.cable_stiffness * pose.cable_lengths
    terms = force @ abs(pose.length_jacobian) + abs(K.wrench) @ abs(pose.jacobian)
    turned = abs(K.joint) @ abs(pose.q)
    terms += abs(pose.gravity_torque) + turned
    terms += tilt_torque(
        pose.arm._routing, pose._spans, pose._sites, K.tension[pose.arm._routing.cable]
    )
    return np.asarray(ROUNDING * terms)


def tilt_torque(routing: Routing, spans: Spans, sites: Array, tension: Array) -> Array:
    """Compute the error of joint torques (nv,) [N m] per relative error of the site positions.

    An error of a position turns the segments that end at the site, the short ones most. ``tension``
    (S,) [N] is that of each segment.
    """
    away = np.linalg.norm(sites[:, routing.second], axis=0)
    lever = np.linalg.norm(spans.motion, axis=0) + spans.length[:, None]
    force = (tension * away / spans.length)[:, None] * lever * (routing.sign != 0.0)
    torque = np.bincount(routing.path.ravel(), force.ravel(), minlength=routing.nv)
    return np.asarray(torque, dtype=np.float64)


# --- cables ---------------------------------------------------------------------------------


class _LockedLaw:
    """Tension as a function of length for the n position-controlled cables with one law.

    Outside the domain of the law a cable has the stiffness of the nearest end of the domain.
    ``cables`` are the indices of the n cables. The other arrays are (n,): ``free_length`` is l_0
    [m], ``series`` is 1/k_series [m/N], ``lengths`` L [m] and ``tension`` F [N] are those at the
    reference.
    """

    def __init__(
        self,
        law: Elasticity,
        cables: slice | NDArray[np.intp],
        free_length: Array,
        series: Array,
        lengths: Array,
        tension: Array,
    ) -> None:
        self.law, self.cables = law, cables
        self._free_length, self._series = free_length, series
        size = tension.shape
        self._low, self._high = np.full(size, law.low), np.full(size, law.high)
        # a slack branch has negative strains
        self._least_strain = law.strain(law.low)
        softest = self._compliance(self._low)
        if (softest <= 0.0).any():
            which = np.flatnonzero(softest <= 0.0).tolist()
            raise ElasticityRangeError(
                "stretches the series spring by more than the whole cable is long, so that no wire "
                "is left. Give the cable a longer lead, a stiffer spring or less "
                "tension.",
                tension[which].tolist(),
                which,
            )
        self._before = 1.0 / softest  # stiffness below the law [N/m]
        # stiffness above the law [N/m]; elongation from its lower to its upper bound [m]
        self._after, self._span = np.zeros(size), self._high
        if math.isfinite(law.high):
            self._after = 1.0 / self._compliance(self._high)
            self._span = self._elongation(self._high)
        self._start = lengths - self._elongation(tension)  # L where the law begins [m]

    def _elongation(self, F: Array) -> Array:
        """Compute Δl = l_0 Δε + ΔF/k_series (n,) [m]: elongation from the least tension to F.

        The least tension is the lower end of the domain of the law.
        """
        wire = self._free_length * (self.law.strain(F) - self._least_strain)
        return np.asarray(wire + (F - self.law.low) * self._series)

    def _compliance(self, F: Array) -> Array:
        """Compute dΔl/dF = l_0/EA(F) + 1/k_series (n,) [m/N], with the elongation Δl."""
        return np.asarray(self._free_length / self.law.rigidity(F) + self._series)

    def tension(self, lengths: Array, near: Array) -> tuple[Array, Array]:
        """Compute F [N] and dF/dL [N/m] at ``lengths`` L [m]; the search starts at F = ``near``."""
        elongation = lengths - self._start
        inside = np.minimum(np.maximum(elongation, 0.0), self._span)
        low, high = self._low, np.minimum(self._high, RANGES["tension"].high)
        F = np.clip(near, low, high)
        for _ in range(200):  # Newton's method in a shrinking bracket
            strain, EA = self.law._evaluate(F)
            compliance = self._free_length / EA + self._series
            wire = self._free_length * (strain - self._least_strain)
            error = wire + (F - self.law.low) * self._series - inside
            newton = F - error / compliance
            if (abs(newton - F) <= 1e-13 * np.maximum(F, 1.0)).all():
                break
            low, high = np.where(error < 0.0, F, low), np.where(error > 0.0, F, high)
            F = np.where((low <= newton) & (newton <= high), newton, (low + high) / 2.0)
        k = 1.0 / compliance
        excess = elongation - inside
        if np.count_nonzero(excess):
            k = np.where(excess == 0.0, k, np.where(excess < 0.0, self._before, self._after))
            F = np.maximum(F + k * excess, 0.0)
            k[(F == 0.0) & (excess < 0.0)] = 0.0
        return F, k
