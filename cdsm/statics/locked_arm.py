"""Arm with locked motors, without friction: tensions F(L), residual torque and K at any angles."""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import NDArray

from cdsm.applied import Applied, without_cables
from cdsm.cable_laws import Selection
from cdsm.errors import ElasticityRangeError
from cdsm.locked_wires import LockedWires
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.solve import ArmState
from cdsm.stiffness_matrix import Stiffness, assemble_stiffness
from cdsm.support.values import Array, frozen
from cdsm.terms import ConstantPull, Stretch, stiffness_of, torque_of, torque_size_of
from cdsm.wires.elasticity import Elasticity

_ROUNDING = 1e-9  # a tension outside the domain of a law by at most this part is rounding
_LENGTH_ROUNDING = 1e-13  # of a length, relative


class LockedArm:
    """Arm under a wrench W (6,), its motors locked where the cables have the tensions F (C,) [N].

    They are locked at ``reference``, or hold the wires of ``rest_length`` (C,) [m], or
    hold the tensions (``tension_held``). Motors that yield have the ``torque`` (m,) [N m] as they
    are; None: that of the tensions F. Tensions may leave
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
        torque: Array | None = None,
        tension_held: bool = False,
    ) -> None:
        self.reference = reference
        self.tension = tension
        self.wrench = wrench
        self.tension_held = tension_held
        laws = reference.arm.laws
        L = reference.cable_lengths
        self.rest_length: Array | None = None  # motors that hold tensions hold no length
        self._taut: NDArray[np.bool_] | None = None  # which cables stay taut; None: where F ≥ 0
        if tension_held:
            self._wires = LockedWires(tension, L, ())
            return
        originals = laws.original_lengths(L, tension)
        length = L
        if rest_length is not None:  # at ``tension``, wire and spring have their rest lengths
            originals = length = np.where(reference.arm.cables.position_controlled, rest_length, L)
        laws.require_wire(originals, tension)
        self.rest_length = frozen(originals)
        soft = reference.arm.motors.yielding
        self._wires = LockedWires.of(laws, tension, length, originals, soft, torque)

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
        other._wires = self._wires.forced(tension)
        return other

    def at(self, q: Array) -> ArmState:
        """Compute the state at angles ``q`` (nv,) [rad]; InvalidInput if two sites coincide."""
        return self.at_pose(self.reference.arm.at(q, check_limits=False))

    def at_pose(self, pose: Posture) -> ArmState:
        """Compute the state at a posture."""
        F, k, _ = self._wires.at(pose.cable_lengths, self._taut)
        terms = ConstantPull(F), *without_cables(pose, self.wrench)
        K = stiffness_of((*terms, Stretch(F, k, motors=self._wires.motors)), pose)
        return ArmState(pose, F, torque_of(terms, pose), K, torque_size_of(terms, pose))

    def stiffness(self, pose: Posture) -> Stiffness:
        """Return K_θ at a posture; ElasticityRangeError if a tension is outside its law."""
        F, k, _ = self._wires.at(pose.cable_lengths, self._taut)
        for locked in self._wires.held:
            require_domain(pose.arm, locked.law, locked.cables, F[locked.cables])
        lengths = pose.cable_lengths if self.tension_held else self.rest_length
        return assemble_stiffness(pose, frozen(F), self.wrench, frozen(k), free_length=lengths)

    def continued_tensions(self, pose: Posture) -> Array:
        """Compute F (C,) [N] at a posture, negative where the wire of a cable is too long.

        Below 0 N it is the tension of a wire that could push: where it is 0, a cable goes slack.
        """
        return self._wires.continued(pose.cable_lengths)

    def turns(self, pose: Posture) -> Array:
        """Compute the turns φ (M,) [rad] by which the motors yield at a posture; 0: rigid ones."""
        motors = pose.arm.motors
        turns = np.zeros(len(motors))
        if self._wires.motors is not None:
            found = self._wires.at(pose.cable_lengths, self._taut).turn
            turns[[motors.names.index(name) for name in self._wires.motors.names]] = found
        return turns

    @property
    def locks(self) -> NDArray[np.bool_]:
        """Whether the motor of each cable holds its wire (C,), not its tension."""
        locked = np.zeros(self.tension.size, dtype=np.bool_)
        for held in self._wires.held:
            locked[held.cables] = True
        return locked

    def tension_rounding(self, pose: Posture) -> Array:
        """Return what rounding of the lengths does to the tensions (C,) [N]."""
        k = self._wires.pushing(pose.cable_lengths).stiffness
        return np.asarray(_LENGTH_ROUNDING * k * pose.cable_lengths)

    def keeping(self, taut: NDArray[np.bool_]) -> LockedArm:
        """Return the arm whose cables stay taut, and could push, or stay slack, as ``taut`` (C,).

        It has no kink where a cable goes slack, and is the arm itself up to there.
        """
        other = copy(self)
        other._taut = taut
        return other


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
