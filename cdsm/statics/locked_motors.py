"""An arm whose motors are locked, under a load: its cables F(L), and its torque out of balance."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.elasticity import Elasticity, rising_root
from cdsm.errors import ElasticityRangeError, InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.stiffness_matrix import Stiffness, assemble
from cdsm.support.validation import Array, frozen

_ROUNDING = 16.0 * float(np.finfo(np.float64).eps)
"""Relative rounding of a torque: of the angles, lengths and tensions that it is a sum of."""

_APART = 1e-6
"""Where disks are what stops a joint, it stops this far before they touch [rad]: holes that meet
leave a cable without a direction."""

_BEYOND = 1e-9
"""Tensions this part beyond the end of a law are rounding: of an arm that started there."""


class Iterate(NamedTuple):
    """The arm at some posture, in balance or not; a state of the search for rest.

    Attributes:
        K: Tensions and joint stiffness, with the original lengths of the reference.
        torque: What is out of balance, less what is held back (nv,) [N m].
        rounding: How much of it is rounding (nv,) [N m].
    """

    K: Stiffness
    torque: Array
    rounding: Array

    @property
    def q(self) -> Array:
        """Joint angles (nv,) [rad]."""
        return self.K.posture.q

    @property
    def stiffness(self) -> Array:
        """K_θ (nv, nv) [N m/rad]."""
        return self.K.joint

    def holding_back(self, torque: Array | float) -> Iterate:
        """The same posture with a torque (nv,) [N m] on the joints that keeps a load off them."""
        return self._replace(torque=self.K.residual - torque)


class LoadedArm:
    """The arm under a wrench, its motors locked at a reference.

    Args:
        reference: The posture at which they were locked.
        tension: F there (C,) [N].
        wrench: W (6,) that the arm carries: force [N], then moment [N m].
        lengths: L (C,) [m] under which the cables have these tensions, if not those at the posture.
    """

    def __init__(
        self, reference: Posture, tension: Array, wrench: Array, lengths: Array | None = None
    ) -> None:
        self.reference = reference
        self.tension = tension
        self.wrench = wrench
        locked = reference.cable_lengths if lengths is None else lengths
        self.cables = LockedCables(reference.arm, locked, tension)

    def at(self, pose: Posture, near: Array) -> Iterate:
        """The arm at a posture where the tensions are near the given ones (C,) [N]."""
        F, k = self.cables.tension(pose.cable_lengths, near)
        K = assemble(pose, F, self.wrench, k, free_length=self.cables.free_length)
        return Iterate(K, K.residual, rounding(K))

    def moved(self, q: Array, near: Iterate) -> Iterate:
        """The arm at joint angles (nv,) [rad] near another iterate.

        Raises:
            CableError: Two neighbouring sites of a cable coincide there.
        """
        before = near.K
        pose = self.reference.arm.at(q, check_limits=False)
        longer = pose.cable_lengths - before.posture.cable_lengths
        return self.at(pose, before.tension + before.cable_stiffness * longer)

    def stops(self) -> tuple[Array, Array]:
        """Lowest and highest angles (nv,) [rad], at which the joints rest on their stops."""
        arm, q = self.reference.arm, self.reference.q
        touching = np.zeros(arm.nv, dtype=np.bool_)  # joints that are stopped by their disks
        if arm.is_serpentine:
            joints = arm.geometry.joints
            touching[:] = [joint.limit is None for joint in joints for _ in joint.axes]
        apart = np.where(touching, _APART, 0.0)
        # the reference may stand nearer
        return np.minimum(arm.lower + apart, q), np.maximum(arm.upper - apart, q)


def rounding(K: Stiffness) -> Array:
    """How much of :attr:`~cdsm.Stiffness.residual` is rounding (nv,) [N m]."""
    pose = K.posture
    force = K.tension + K.cable_stiffness * pose.cable_lengths
    terms = force @ abs(pose.length_jacobian) + abs(K.wrench) @ abs(pose.jacobian)
    turned = abs(K.joint) @ abs(pose.q)
    terms += abs(pose.gravity_torque) + turned + _tilt_torque(pose, K.tension)
    return np.asarray(_ROUNDING * terms)


def _tilt_torque(pose: Posture, tension: Array) -> Array:
    """Torque (nv,) [N m] of tensions (C,) [N] by the tilt of segments per tilt of their sites.

    It is larger for shorter segments: between disks that nearly touch it is most of the rounding.
    """
    routing = pose.arm._model.routing
    segment, joint = routing.segment, routing.joint
    site, origin = pose._frames.site, pose._frames.origin
    cable, start, end = segment[:-1, :3].T
    apart = np.linalg.norm(site[end] - site[start], axis=1)
    far = np.linalg.norm(site[end], axis=1)
    over = np.repeat(np.arange(cable.size), np.diff(segment[:, 3]))
    arm = np.linalg.norm(site[end][over] - origin[joint], axis=1)
    force = (tension[cable] * far / apart)[over] * arm
    torque = np.bincount(joint, force, minlength=len(origin))[1:]
    return np.asarray(torque, dtype=np.float64)


# --- cables ---------------------------------------------------------------------------------


class _Springs(NamedTuple):
    """The position-controlled cables of one law; arrays over them.

    Attributes:
        law: Their elasticity.
        held: Which cables of the arm they are.
        free_length: l_0 [m].
        series: Compliance of spring or drive [m/N].
    """

    law: Elasticity
    held: slice | NDArray[np.intp]
    free_length: Array
    series: Array

    def elongation(self, F: Array) -> Array:
        """Δl = l_0 ε(F) + ΔF/k_series [m] from the low end of the law."""
        wire = self.free_length * self.law.strain(F)
        return np.asarray(wire + (F - self.law.domain.low) * self.series)

    def compliance(self, F: Array) -> Array:
        """dΔl/dF = l_0/EA(F) + 1/k_series [m/N]."""
        return np.asarray(self.free_length / self.law.rigidity(F) + self.series)


class _Ends(NamedTuple):
    """How such cables go on before and after their law; arrays over them.

    Attributes:
        start: L where the law begins [m].
        span: Elongation from there to its end [m].
        low: Tension where it begins [N].
        high: Tension where it ends [N].
        before: Stiffness below [N/m].
        after: Stiffness above [N/m].
    """

    start: Array
    span: Array
    low: Array
    high: Array
    before: Array
    after: Array


class LockedCables:
    """Tension F(L) of the cables of an arm, each motor left as it is at a reference.

    A position-controlled cable keeps its original length l_0: its elongation is that at the
    reference plus the change of its length. A force-controlled one keeps its tension. Below the
    tension where its law begins a cable goes on with the stiffness it has there, down to zero, from
    where on it is slack; above the end of the law it goes on with the stiffness it has there. Both
    are for iterates to pass through: :meth:`require_domains` refuses them as solutions.

    Args:
        arm: The arm.
        lengths: L at the reference (C,) [m].
        tension: F at the reference (C,) [N]; of position-controlled cables inside their laws.

    Attributes:
        free_length: l_0 (C,) [m].

    Raises:
        ElasticityRangeError: A law gives no strain, or a series spring stretches by so much more
            than the cable is long that no wire explains its tension; names the cables.
        InvalidInput: An elasticity of the user's own gives no finite strain.
    """

    def __init__(self, arm: Manipulator, lengths: Array, tension: Array) -> None:
        self._arm = arm
        self._reference_tension = tension
        self._groups = []
        laws = arm._model.laws
        self.free_length = laws.original_lengths(lengths, tension)
        for law, held in laws.held:
            springs = _Springs(law, held, self.free_length[held], laws.series[held])
            try:
                ends = _ends(springs, lengths[held], tension[held])
            except ElasticityRangeError as error:
                raise laws.naming(error, held) from None
            self._groups.append((springs, ends))

    def tension(self, lengths: Array, near: Array) -> tuple[Array, Array]:
        """Tension F (C,) [N] and tangent stiffness k (C,) [N/m] at the lengths L (C,) [m].

        ``near`` (C,) [N] is F at lengths near these, to start from.
        """
        tension, stiffness = self._reference_tension.copy(), np.zeros(lengths.size)
        for springs, (start, span, low, high, before, after) in self._groups:
            held = springs.held
            elongation = lengths[held] - start
            inside = np.minimum(np.maximum(elongation, 0.0), span)
            F, compliance = rising_root(
                inside, near[held], low, high, springs.elongation, springs.compliance
            )
            k = 1.0 / compliance
            excess = elongation - inside
            if np.count_nonzero(excess):
                k = np.where(excess == 0.0, k, np.where(excess < 0.0, before, after))
                F = np.maximum(F + k * excess, 0.0)
                k[(F == 0.0) & (excess < 0.0)] = 0.0
            tension[held], stiffness[held] = F, k
        return frozen(tension), frozen(stiffness)

    def require_domains(self, tension: Array) -> None:
        """Refuse tensions (C,) [N] outside the domains of their laws.

        Zero is allowed where the law begins at zero: the cable is slack.

        Raises:
            ElasticityRangeError: Names the cables.
        """
        names = [cable.name for cable in self._arm.cables]
        for springs, _ in self._groups:
            domain, F = springs.law.domain, tension[springs.held]
            outside = (domain.low * (1.0 - _BEYOND) > F) | (domain.high * (1.0 + _BEYOND) < F)
            if np.count_nonzero(outside):
                where = np.arange(tension.size)[springs.held][outside].tolist()
                raise ElasticityRangeError(
                    f"at the equilibrium; the elasticity is defined on {domain}, and says neither "
                    "how a cable goes slack below it nor how it yields above. Change the tensions "
                    "or the load, or use an elasticity that covers them.",
                    F[outside].tolist(),
                    where,
                    [names[c] for c in where],
                )


def _ends(springs: _Springs, lengths: Array, tension: Array) -> _Ends:
    """The ends of a law, from L and F at the reference."""
    domain, size = springs.law.domain, tension.shape
    first, last = np.full(size, domain.first), np.full(size, domain.high)
    softest = springs.compliance(first)
    if (softest <= 0.0).any():
        which = np.flatnonzero(softest <= 0.0).tolist()
        raise ElasticityRangeError(
            "stretches the series spring by more than the whole cable is long, so that no wire is "
            "left. Give the cable a lead that holds its spring, a stiffer spring or less tension.",
            tension[which].tolist(),
            which,
        )
    before = 1.0 / softest
    after, span = np.zeros(size), last
    if math.isfinite(domain.high):
        after, span = 1.0 / springs.compliance(last), springs.elongation(last)
    elongation = springs.elongation(tension)
    if not np.isfinite([elongation, before, after]).all() or np.isnan(span).any():
        raise InvalidInput(
            "elasticity", f"{springs.law!r} gives strains or rigidities that are not finite."
        )
    return _Ends(lengths - elongation, span, first, last, before, after)
