"""How long the wires of an arm are where its motors are at 0.

``posture`` and ``pose`` are a :class:`~cdsm.Posture`, which this module is below.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput, warn
from cdsm.locked_wires import LockedWires
from cdsm.support.format import aligned
from cdsm.support.result import Result, unit
from cdsm.support.validation import one_of, scalar, vector
from cdsm.support.values import Array, frozen

_TURN = 4.0  # [rad]; a turn beyond may be in degrees
_WIRE = 0.2  # of the arm's length: so much wire bends the arm farther than most joints go


class Driven(NamedTuple):
    """What the commands of all motors make of the wires."""

    rest_length: Array  # l_0 (C,) [m]; L of force-controlled cables
    tension: Array  # (C,) [N] of force-controlled cables; of others that at zero strain
    torque: Array | None  # (m,) [N m] of motors that yield, at turn 0


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Assembly(Result):
    """Wires of an arm with its motors at 0; made by :meth:`Manipulator.assemble`.

    Motors that are fewer than cables cannot set each tension: B of ``arm.motors`` has C − M
    directions N with `Nᵀ B = 0`, and `Nᵀ l_0` stays what it is now. A motor turned by φ leaves the
    wires `l_0 − B φ`. A compliant one has the torque `Bᵀ F` of these tensions at φ, and yields as
    it changes; one that holds its torque takes a torque for its command.

    Attributes:
        posture: The posture of the assembly.
        tension: F (C,) [N] there.
        free_lengths: Original lengths `l_0` (C,) [m] of the wires; L of force-controlled cables.
    """

    _headline = "free_lengths"
    _rows = "cable"

    posture: Any
    tension: Array = field(metadata=unit("N", "cable"))
    free_lengths: Array = field(metadata=unit("m", "cable"))

    @property
    def commands(self) -> Array:
        """Commands (M,) of all motors at the assembly: 0 rad or m, or the torque or tension."""
        motors = self.posture.arm.motors
        return frozen(np.where(motors.holds_torque, motors.matrix.T @ self.tension, 0.0))

    def missing_wire(self, pose: Any) -> Array:
        """Compute `N Nᵀ ΔL` (C,) [m] from the assembly to a posture: wire that no motor can give.

        The cables stretch by it, and go slack where it is negative, whatever the motors do.
        """
        self.require_arm(pose)
        N = self.posture.arm.motors.fixed
        return frozen(N @ (N.T @ (pose.cable_lengths - self.posture.cable_lengths)))

    def require_arm(self, pose: Any) -> None:
        """Raise InvalidInput if a posture is not one of the same arm."""
        arm = getattr(pose, "arm", None)
        if arm is not self.posture.arm and arm != self.posture.arm:
            raise InvalidInput("assembly", "is of another arm; assemble this one.")

    def commanded(self, motors: ArrayLike | Mapping[str, float]) -> Array:
        """Check commands (M,), or by the names of motors; others stay as at the assembly."""
        drives = self.posture.arm.motors
        if not isinstance(motors, Mapping):
            meaning = f"one command per motor, {', '.join(drives.names)}"
            return vector("motors", motors, len(drives), meaning)
        commands = self.commands.copy()
        remedy = "A cable that shares a motor has none of its own."
        for name, value in motors.items():
            m = drives.names.index(one_of("motor", name, drives.names, remedy))
            commands[m] = scalar(f"motors[{name!r}]", value)
        return frozen(commands)

    def _doubt_degrees(self, commands: Array) -> None:
        """Warn of turns that take in much of the arm's length, as if they were in degrees."""
        arm = self.posture.arm
        for motor, turn in zip(arm.motors.given, commands.tolist(), strict=False):
            cable, radius = max(motor.cables.items(), key=lambda drum: abs(drum[1]))
            wire = abs(radius * turn)
            held = motor.control == "position"
            if held and abs(turn) > _TURN and wire > _WIRE * arm.length:
                radians = f"np.deg2rad({turn:g}) is {math.radians(turn):.4g} rad"
                moved = f"moves {1e3 * wire:.4g} mm of {cable}"
                warn(f"motors: {motor.name} turned by {turn:g} rad {moved}. Degrees? {radians}.")

    def driven(self, commands: Array) -> Driven:
        """Return what checked commands (M,) make of the wires."""
        arm = self.posture.arm
        motors = arm.motors
        held = np.array(motors.holds_torque)
        rest = self.free_lengths - motors.matrix @ np.where(held, 0.0, commands)
        forced = ~arm.cables.position_controlled
        tension = np.where(forced, motors.matrix @ np.where(held, commands, 0.0), arm.laws.rest)
        soft = motors.yielding
        if soft is None:
            return Driven(rest, frozen(tension), None)
        before = soft.matrix.T @ self.tension
        places = [motors.names.index(name) for name in soft.names]
        torque = np.where(held[places], commands[places], before)
        return Driven(rest, frozen(tension), frozen(torque))

    def require_wire(self, commands: Array) -> None:
        """Raise InvalidInput if commands (M,) take in all wire of a cable, or push one."""
        arm = self.posture.arm
        driven = self.driven(commands)
        c = int(driven.rest_length.argmin())
        if driven.rest_length[c] <= 0.0:
            left = f"leave {driven.rest_length[c]:.4g} m of {arm.cables.names[c]}"
            problem = f"{left}, which is {self.free_lengths[c]:.4g} m long. Take in less, or, in "
            raise InvalidInput("motors", f"{problem}Python, give turns in radians, not in degrees.")
        arm.cables.require_pulling("motors", driven.tension)
        for motor, torque in zip(arm.motors.given, commands, strict=False):
            if motor.control == "torque" and not motor.can_give(float(torque)):
                side = "0 or more" if torque < 0.0 else "0 or less"
                problem = f"{torque:g} N m for {motor.name}, whose cables only pull: {side} is "
                raise InvalidInput("motors", f"{problem}possible with its radii.")
        self._doubt_degrees(commands)

    def wires(self, driven: Driven) -> LockedWires:
        """Return the wires of driven motors, as functions of the lengths of the cables."""
        laws = self.posture.arm.laws
        soft = self.posture.arm.motors.yielding
        rest = driven.rest_length
        return LockedWires.of(laws, driven.tension, rest, rest, soft, driven.torque)

    def slopes(self, driven: Driven, lengths: Array) -> tuple[Array, Array]:
        """Compute F (C,) [N] at lengths L (C,), and `∂F/∂command` (C, M), of wires that could push.

        Rest lengths `l_0` change F by `−k (1 + ε)`; motors that yield pass on
        `P = K_eff K_L⁻¹` of it.
        """
        arm = self.posture.arm
        laws = arm.laws
        motors = arm.motors
        F, k, turn = self.wires(driven).pushing(lengths)
        held = np.array(motors.holds_torque)
        pulled = lengths
        soft = motors.yielding
        if soft is not None:
            pulled = lengths + soft.matrix @ turn
        stretch = (pulled - laws.series * (F - laws.rest)) / driven.rest_length
        slope = (k * stretch)[:, None] * motors.matrix
        if soft is not None:
            slope = soft.transmission(k) @ slope
            by_torque = (k[:, None] * soft.matrix) @ soft.softness(k)
            for i, name in enumerate(soft.names):
                m = motors.names.index(name)
                if held[m]:
                    slope[:, m] = by_torque[:, i]
        own = held & (np.arange(len(motors)) >= len(motors.given))
        slope[:, own] = motors.matrix[:, own]
        return F, slope

    def __str__(self) -> str:
        names = self.posture.arm.cables.names
        rows = [("cable", "tension [N]", "wire [mm]")]
        for name, F, wire in zip(names, self.tension, self.free_lengths, strict=True):
            rows.append((name, f"{F:.3f}", f"{1e3 * wire:.3f}"))
        return "\n".join([*aligned(rows), self.posture.arm.motors.count])


def assemble(pose: Any, tension: ArrayLike) -> Assembly:
    """Return the assembly with tensions F (C,) [N] at a posture; :meth:`Manipulator.assemble`."""
    arm = pose.arm
    given: Any = tension
    of = getattr(given, "posture", pose)
    if not pose.equals(of):
        raise InvalidInput("tension", "is of another posture; distribute it at this one.")
    F = arm.cables.tension_vector(given)
    lengths = arm.laws.original_lengths(pose.cable_lengths, F)
    arm.laws.require_wire(lengths, F)
    return Assembly(posture=pose, tension=F, free_lengths=lengths)
