"""Terms of the energy U(θ) of an arm: each gives its energy, torque ∂U/∂θ and stiffness ∂²U/∂θ².

The torques add up to zero in balance (Eq. 13), the stiffnesses to K_θ (Eq. 16):

    K_θ = H_L·F  + J_Lᵀ K_L J_L + ∂g/∂θ   − ∂(J_Xᵀ W)/∂θ + springs + further terms
          active   passive        gravity   load

The cables are two potentials: :class:`ConstantPull` is what they would give if their motors held
the tensions, :class:`Stretch` what their elasticity adds if the motors are locked, or yield.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cdsm.definition import Term
from cdsm.joint_springs import Springs
from cdsm.locked_wires import LockedWires
from cdsm.posture import Posture
from cdsm.support.values import Array, total
from cdsm.yielding import Yielding

CABLE_TERMS = ("active", "passive")
"""Names of the terms that depend on the tensions of the cables."""


@dataclass(frozen=True)
class Gravity:
    """Weight of the links: U = V(q)."""

    name: ClassVar[str] = "gravity"

    def energy(self, pose: Posture) -> float:
        """Compute V [J]."""
        return pose.arm.body.potential_energy(pose.q)

    def torque(self, pose: Posture) -> Array:
        """Return g = ∂V/∂θ (nv,) [N m]."""
        return pose.gravity_torque

    def stiffness(self, pose: Posture) -> Array:
        """Return ∂g/∂θ (nv, nv) [N m/rad]."""
        return pose.gravity_stiffness


@dataclass(frozen=True, eq=False)
class JointSprings:
    """Springs at the joints: U = Σ E(θ − q_0), ½ k (θ − q_0)² without laws."""

    springs: Springs
    name: ClassVar[str] = "springs"

    def energy(self, pose: Posture) -> float:
        """Compute U [J]."""
        return self.springs.energy(pose.q)

    def torque(self, pose: Posture) -> Array:
        """Compute k (θ − q_0), or M of a law (nv,) [N m]."""
        return self.springs.torque(pose.q)

    def stiffness(self, pose: Posture) -> Array:
        """Return diag k, or Sᵀ diag k S of coupled joints (nv, nv) [N m/rad]."""
        return self.springs.stiffness_at(pose.q)


@dataclass(slots=True)
class ConstantPull:
    """Cables that pull with constant tensions F (C,) [N], as weights over pulleys: U = F·L."""

    tension: Array
    name: ClassVar[str] = "active"

    def energy(self, pose: Posture) -> float:
        """Compute F·L [J]."""
        return float(self.tension @ pose.cable_lengths)

    def torque(self, pose: Posture) -> Array:
        """Compute J_Lᵀ F (nv,) [N m]."""
        return self.tension @ pose.length_jacobian

    def torque_size(self, pose: Posture) -> Array:
        """Compute |J_L|ᵀ F (nv,) [N m]."""
        return self.tension @ abs(pose.length_jacobian)

    def stiffness(self, pose: Posture) -> Array:
        """Compute H_L·F (nv, nv) [N m/rad]."""
        weight = self.tension[pose.routing.cable]
        H = np.asarray(pose.routing.hessian(pose.spans, weight))
        if pose.wrapping:
            H = H + pose.wrapping.shifts.hessian(weight)
        return H


@dataclass(slots=True)
class Stretch:
    """What locked motors add: U = ∫(F(L) − F_0) dL, with the tensions F_0 where K_θ is computed.

    ``free_length`` and ``length`` are needed for energy and torque, ``cable_stiffness`` for the
    stiffness, which is that at F_0.
    """

    tension: Array  # F_0 (C,) [N]
    cable_stiffness: Array  # dF/dL (C,) [N/m] at F_0
    free_length: Array | None = None  # l_0 (C,) [m]
    length: Array | None = None  # L (C,) [m] at F_0
    motors: Yielding | None = None  # those that yield, with K_eff in the place of diag k
    _last: tuple[Posture, tuple[Array, Array]] | None = None  # energy, then torque are asked for
    name: ClassVar[str] = "passive"

    def energy(self, pose: Posture) -> float:
        """Compute U [J]."""
        return float(self._follow(pose)[1].sum())

    def torque(self, pose: Posture) -> Array:
        """Compute J_Lᵀ (F − F_0) (nv,) [N m]."""
        return (self._follow(pose)[0] - self.tension) @ pose.length_jacobian

    def torque_size(self, pose: Posture) -> Array:
        """Compute |J_L|ᵀ F_0 (nv,) [N m]."""
        return self.tension @ abs(pose.length_jacobian)

    def stiffness(self, pose: Posture) -> Array:
        """Compute J_Lᵀ K_L J_L (nv, nv) [N m/rad], of motors that yield J_Lᵀ K_eff J_L."""
        return passive_stiffness(pose.length_jacobian, self.cable_stiffness, self.motors)

    def _follow(self, pose: Posture) -> tuple[Array, Array]:
        """Compute the tensions F (C,) [N] and the energies (n,) [J] of the cables at a posture.

        With motors that yield by φ, U = Σ ∫F dL + ½ φᵀ k_m φ − τ_0·φ − F_0·(L − L_0), in which the
        cables are longer by B φ and τ_0 = Bᵀ F_0: it is the least over φ.
        """
        assert self.free_length is not None
        assert self.length is not None
        if self._last is None or self._last[0] is not pose:
            taut = self.tension + self.cable_stiffness > 0.0
            longer = np.where(taut, pose.cable_lengths - self.length, 0.0)
            pulled = longer
            of_motors: tuple[float, ...] = ()
            if self.motors is not None:
                laws = pose.arm.laws
                wires = self.tension, self.length, self.free_length, self.motors
                turn = LockedWires.of(laws, *wires).at(self.length + longer, taut).turn
                more = self.motors.matrix @ turn
                pulled = np.where(taut, longer + more, 0.0)
                work = self.motors.stiffness @ turn**2 / 2.0 - self.tension @ more
                of_motors = (float(work),)
            F, energy = pose.arm.laws.stretched(self.tension, self.free_length, pulled)
            self._last = pose, (F, np.append(energy - self.tension * longer, of_motors))
        return self._last[1]


def passive_stiffness(J: Array, cable_stiffness: Array, motors: Yielding | None) -> Array:
    """Compute J_Lᵀ K_eff J_L (nv, nv) [N m/rad]; K_eff is diag k without motors that yield."""
    rigid: Array = (J.T * cable_stiffness) @ J
    return rigid if motors is None else rigid - motors.softening(J, cable_stiffness)


def torque_of(terms: Iterable[Term], pose: Posture) -> Array:
    """Compute the sum of the torques of ``terms`` (nv,) [N m]."""
    return total([term.torque(pose) for term in terms])


def torque_size_of(terms: Iterable[Term], pose: Posture) -> Array:
    """Compute the sum of the magnitudes of their torques (nv,) [N m], which sets the rounding."""
    return total([torque_size(term, pose) for term in terms])


def torque_size(term: Term, pose: Posture) -> Array:
    """Compute the magnitude of a torque (nv,) [N m]: of a sum of products, that of each product."""
    size = getattr(term, "torque_size", None)
    return abs(term.torque(pose)) if size is None else size(pose)


def stiffness_of(terms: Iterable[Term], pose: Posture) -> Array:
    """Compute the sum of the stiffnesses of ``terms`` (nv, nv) [N m/rad]."""
    return total([term.stiffness(pose) for term in terms])
