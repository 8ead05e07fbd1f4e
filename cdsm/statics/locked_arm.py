"""Arm with locked motors, without friction: tensions F(L), residual torque and K at any angles."""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.applied import Applied, without_cables
from cdsm.errors import ElasticityRangeError
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.solve import ArmState
from cdsm.stiffness_matrix import Stiffness, assemble
from cdsm.support.values import Array, frozen
from cdsm.terms import ConstantPull, Stretch, stiffness_of, torque_of, torque_size_of
from cdsm.wires.elasticity import Elasticity, newton_in_bracket

_ROUNDING = 1e-9  # a tension outside the domain of a law by at most this part is rounding
_LENGTH_ROUNDING = 1e-13  # of a length, relative
_HUGE = 1e12  # no tension [N] is beyond

Selection = slice | NDArray[np.intp]


class LockedArm:
    """Arm under a wrench W (6,), its motors locked where the cables have the tensions F (C,) [N].

    They are locked at ``reference``, or hold the wires of ``rest_length`` (C,) [m], or
    hold the tensions (``tension_held``). Tensions may leave
    the domains of their laws: outside, a cable has the stiffness of the nearest end of the domain,
    or is slack. :func:`require_domain` refuses a result outside. Raises ElasticityRangeError if a
    law gives no strain at F, or if a series spring is longer than its whole cable.
    """

    def __init__(
        self,
        reference: Posture,
        tension: Array,
        wrench: Applied,
        rest_length: Array | None = None,
        *,
        tension_held: bool = False,
    ) -> None:
        self.reference = reference
        self.tension = tension
        self.wrench = wrench
        self.tension_held = tension_held
        laws = reference.arm.laws
        L = reference.cable_lengths
        self.rest_length: Array | None = None  # motors that hold tensions hold no length
        self._laws: list[_LockedLaw] = []
        self._taut: NDArray[np.bool_] | None = None  # which cables stay taut; None: where F ≥ 0
        if tension_held:
            return
        originals = laws.original_lengths(L, tension)
        length = L
        if rest_length is not None:  # at ``tension``, wire and spring have their rest lengths
            originals = length = np.where(reference.arm.cables.position_controlled, rest_length, L)
        laws.require_wire(originals, tension)
        self.rest_length = frozen(originals)
        for law, cables in laws.held:
            F = tension[cables]
            wire = originals[cables]
            series = laws.series[cables]
            locked = _LockedLaw(law, cables, wire, series, F, law.strain(F), length[cables])
            self._laws.append(locked)

    def under(self, wrench: Applied) -> LockedArm:
        """Return the arm under another wrench (6,), its motors as they are."""
        other = copy(self)
        other.wrench = wrench
        return other

    def resumed(self, pose: Posture, tension: Array) -> LockedArm:
        """Return the arm, its motors as they are, with an equilibrium as the new reference."""
        other = copy(self)
        other.reference = pose
        other.tension = tension
        return other

    def at(self, q: Array) -> ArmState:
        """Compute the state at angles ``q`` (nv,) [rad]; InvalidInput if two sites coincide."""
        return self.at_pose(self.reference.arm.at(q, check_limits=False))

    def at_pose(self, pose: Posture) -> ArmState:
        """Compute the state at a posture."""
        F, k = self._tensions(pose)
        terms = ConstantPull(F), *without_cables(pose, self.wrench)
        K = stiffness_of((*terms, Stretch(F, k)), pose)
        return ArmState(pose, F, torque_of(terms, pose), K, torque_size_of(terms, pose))

    def stiffness(self, pose: Posture) -> Stiffness:
        """Return K_θ at a posture; ElasticityRangeError if a tension is outside its law."""
        F, k = self._tensions(pose)
        for locked in self._laws:
            require_domain(pose.arm, locked.law, locked.cables, F[locked.cables])
        lengths = pose.cable_lengths if self.tension_held else self.rest_length
        return assemble(pose, frozen(F), self.wrench, frozen(k), free_length=lengths)

    def continued_tensions(self, pose: Posture) -> Array:
        """Compute F (C,) [N] at a posture, negative where the wire of a cable is too long.

        Below 0 N it is the tension of a wire that could push: where it is 0, a cable goes slack.
        """
        F = self.tension.copy()
        for held in self._laws:
            F[held.cables] = held.continued_tension(pose.cable_lengths[held.cables])[0]
        return F

    @property
    def locks(self) -> NDArray[np.bool_]:
        """Whether the motor of each cable holds its wire (C,), not its tension."""
        locked = np.zeros(self.tension.size, dtype=np.bool_)
        for held in self._laws:
            locked[held.cables] = True
        return locked

    def tension_rounding(self, pose: Posture) -> Array:
        """Return what rounding of the lengths does to the tensions (C,) [N]."""
        k = self.keeping(np.ones(self.tension.size, dtype=np.bool_))._tensions(pose)[1]
        return np.asarray(_LENGTH_ROUNDING * k * pose.cable_lengths)

    def keeping(self, taut: NDArray[np.bool_]) -> LockedArm:
        """Return the arm whose cables stay taut, and could push, or stay slack, as ``taut`` (C,).

        It has no kink where a cable goes slack, and is the arm itself up to there.
        """
        other = copy(self)
        other._taut = taut
        return other

    def _tensions(self, pose: Posture) -> tuple[Array, Array]:
        F = self.tension.copy()
        k = np.zeros(self.tension.size)
        for held in self._laws:
            pull, slope = held.continued_tension(pose.cable_lengths[held.cables])
            taut = pull >= 0.0 if self._taut is None else self._taut[held.cables]
            F[held.cables] = np.where(taut, pull, 0.0)
            k[held.cables] = np.where(taut, 1.0 / slope, 0.0)
        return F, k


class _LockedLaw(NamedTuple):
    """The n position-controlled cables with one law, in their order; arrays are (n,)."""

    law: Elasticity
    cables: Selection
    rest_length: Array  # [m]
    series: Array  # compliance of the springs [m/N]
    start: Array  # a tension F_0 [N]
    strain: Array  # of the wire at F_0
    length: Array  # of the cable at F_0 [m]

    def elongation(self, F: Array) -> tuple[Array, Array]:
        """Compute the elongation from F_0 to F [m], and its slope [m/N]."""
        inside = np.minimum(np.maximum(F, self.law.low), self.law.high)
        strain, EA = self.law.evaluate(inside)
        slope = self.rest_length / EA + self.series
        wire = self.rest_length * (strain - self.strain)
        return wire + (inside - self.start) * self.series + (F - inside) * slope, slope

    def continued_tension(self, lengths: Array) -> tuple[Array, Array]:
        """Compute F [N], also below 0 N, and dL/dF [m/N] at lengths L [m]."""
        wanted = lengths - self.length
        ends = np.full((2, lengths.size), [[-_HUGE], [_HUGE]])

        def error(F: Array) -> tuple[Array, Array]:
            reached, slope = self.elongation(F)
            return reached - wanted, slope

        return newton_in_bracket(error, self.start, *ends)


def require_domain(
    arm: Manipulator, law: Elasticity, cables: Selection, tension: Array, where: str = ""
) -> None:
    """Raise ElasticityRangeError if the tensions F [N] of the cables ``of`` are outside their law.

    ``where`` begins the error message.
    """
    inside = np.clip(tension, law.low, law.high)
    near = abs(tension - inside) <= _ROUNDING * tension
    try:
        law.require_inside(np.where(near, inside, tension))
    except ElasticityRangeError as error:
        named = ElasticityRangeError(f"{where}{error.problem}", error.tension, error.indices)
        raise arm.laws.naming(named, cables) from None
