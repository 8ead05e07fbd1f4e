"""Tensions of cables whose motors hold their commands, as functions of the cables' lengths L."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.cable_laws import CableLaws, LockedLaw
from cdsm.support.values import Array, frozen
from cdsm.yielding import Yielding


class WireState(NamedTuple):
    """Tensions at given lengths."""

    tension: Array  # F (C,) [N]
    stiffness: Array  # dF/dL (C,) [N/m] of each cable alone; 0: it is slack, or controls force
    turn: Array  # φ (m,) [rad] of the motors that yield


@dataclass(frozen=True, eq=False)
class LockedWires:
    """Wires of all C cables of an arm, held by motors that are locked, or yield.

    Tensions may leave the domains of their laws: outside, a cable has the stiffness of the nearest
    end of the domain, or is slack.
    """

    tension: Array  # F (C,) [N], of force-controlled cables at any length
    rest_length: Array  # l_0 (C,) [m]
    held: tuple[LockedLaw, ...]
    motors: Yielding | None = None
    torque: Array | None = None  # of these motors at turn 0 (m,) [N m]

    @classmethod
    def of(
        cls,
        laws: CableLaws,
        tension: Array,
        length: Array,
        rest_length: Array,
        motors: Yielding | None = None,
        torque: Array | None = None,
    ) -> LockedWires:
        """Return wires that have the tensions F (C,) [N] at the lengths L (C,) [m] of the cables.

        ``torque`` is that of the motors at turn 0; None: that of these tensions.
        """
        held = []
        for law, cables in laws.held:
            F = tension[cables]
            wire = rest_length[cables]
            series = laws.series[cables]
            held.append(LockedLaw(law, cables, wire, series, F, law.strain(F), length[cables]))
        if motors is not None and torque is None:
            torque = frozen(motors.matrix.T @ tension)
        return cls(tension, rest_length, tuple(held), motors, torque)

    def forced(self, tension: Array) -> LockedWires:
        """Return the same wires, of which force-controlled ones have other tensions (C,) [N]."""
        return replace(self, tension=tension)

    def at(self, lengths: Array, taut: NDArray[np.bool_] | None = None) -> WireState:
        """Compute the state at L (C,); ``taut`` cables could push, others are slack; None: F ≥ 0.

        Raises CdsmError if a motor cannot hold its torque.
        """
        if self.motors is None:
            return WireState(*self._alone(lengths, taut), _NO_TURN)
        assert self.torque is not None
        start = np.zeros(self.torque.size)
        turn, F, k = self.motors.settle(
            lambda more: self._alone(lengths + more, taut), self.torque, start
        )
        return WireState(F, k, turn)

    def continued(self, lengths: Array) -> Array:
        """Compute F (C,) [N] at L (C,), negative where the wire of a cable is too long."""
        if self.motors is not None:
            lengths = lengths + self.motors.matrix @ self.at(lengths).turn
        F = self.tension.copy()
        for held in self.held:
            F[held.cables] = held.continued_tension(lengths[held.cables])[0]
        return F

    def pushing(self, lengths: Array) -> WireState:
        """Compute the state at L (C,) of wires that could push."""
        return self.at(lengths, np.ones(lengths.size, dtype=np.bool_))

    def _alone(self, lengths: Array, taut: NDArray[np.bool_] | None) -> tuple[Array, Array]:
        F = self.tension.copy()
        k = np.zeros(self.tension.size)
        for held in self.held:
            pull, slope = held.continued_tension(lengths[held.cables])
            tight = pull >= 0.0 if taut is None else taut[held.cables]
            F[held.cables] = np.where(tight, pull, 0.0)
            k[held.cables] = np.where(tight, 1.0 / slope, 0.0)
        return F, k


_NO_TURN = frozen(np.zeros(0))
