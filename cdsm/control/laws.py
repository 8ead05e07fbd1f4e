"""Motor laws: pure functions of reference and readings, with the clamps of each.

A motor of a position-controlled cable holds the wire that it has paid out, l_0. A law says how much
that is to be. At rest a change of l_0 changes the tension by −k Δl_0, so that each command stands
for a tension, F + k (l_0 measured − l_0 commanded). No law commands a tension outside the bounds:
below is slack, above is overload. A law of one's own is any function of a :class:`Moment` that
returns :func:`limited` of the wire that it wants.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.support.values import Array

PROPORTIONAL, INTEGRAL = 0.2, 0.3
"""Gains of the tension control, as parts of the tension error that one step takes away."""


class Reference(NamedTuple):
    """Reference values of one step of control.

    Attributes:
        angles: Joint angles (nv,) [rad]; [m] where a joint slides.
        tension: F (C,) [N].
        wire: l_0 paid out at these angles and tensions (C,) [m].
        stiffness: k of each cable (C,) [N/m]; 0 where the motor itself holds the tension.
    """

    angles: Array
    tension: Array
    wire: Array
    stiffness: Array


class Reading(NamedTuple):
    """Readings of the sensors at one step.

    Attributes:
        wire: l_0 paid out by each motor (C,) [m], from its encoder.
        tension: F at each motor (C,) [N].
    """

    wire: Array
    tension: Array


class Command(NamedTuple):
    """Command to the motors at one step.

    Attributes:
        wire: l_0 to pay out (C,) [m].
        tension: The tension that this stands for (C,) [N], within the bounds.
        saturated: Whether the clamp changed the command of each motor (C,).
    """

    wire: Array
    tension: Array
    saturated: NDArray[np.bool_]


class Moment(NamedTuple):
    """Arguments of a motor law at one step of control.

    Attributes:
        reference: Reference of this step.
        reading: Readings of this step.
        reference_before: Reference of the step before.
        reading_before: Readings of the step before.
        command: Wire commanded at the step before (C,) [m].
        minimum: Lower bounds of the tensions (C,) [N].
        maximum: Upper bounds of the tensions (C,) [N].
        forced: Cables of which a mixed law controls the tension (C,).
    """

    reference: Reference
    reading: Reading
    reference_before: Reference
    reading_before: Reading
    command: Array
    minimum: Array
    maximum: Array
    forced: NDArray[np.bool_]


Law = Callable[[Moment], Command]
"""A motor law."""


def limited(moment: Moment, wire: Array) -> Command:
    """Clamp the wire (C,) [m] of a law so that no tension that it stands for leaves the bounds.

    The tensions are those measured, changed by the step of the wire while the arm stands still.
    """
    reading, k = moment.reading, moment.reference.stiffness
    asked = reading.tension + k * (reading.wire - wire)
    return _clamped(moment, wire, np.where(k > 0.0, asked, moment.reference.tension))


def feedforward(moment: Moment) -> Command:
    """Pay out the wire of the loaded equilibrium, stretch included. It needs no sensor at all."""
    return _clamped(moment, moment.reference.wire, moment.reference.tension)


def tension_control(moment: Moment) -> Command:
    """Control the tension of every cable about that of the plan: PI, with the wire fed forward.

    Δl_0 = Δl_0 wanted − (P Δe + I e)/k with the error e = F wanted − F measured. It needs a load
    cell at every cable. An arm that only its cables make stiff leaves its posture slowly, since no
    motor holds a length.
    """
    return limited(moment, _regulated(moment))


def mixed(moment: Moment) -> Command:
    """Control the tension of some cables, and pay out the wire of the plan for all others.

    The arm of the paper has one of both in each pair. It needs a load cell at every cable for the
    clamps.
    """
    return limited(moment, np.where(moment.forced, _regulated(moment), moment.reference.wire))


LAWS: Final[dict[str, Law]] = {
    "feedforward": feedforward,
    "tension": tension_control,
    "mixed": mixed,
    "stiffness": mixed,
}
"""Laws by name; ``stiffness`` is the mixed law inside the stiffness loop."""


def _regulated(moment: Moment) -> Array:
    """Return the wire (C,) [m] of a PI control of all tensions, in its incremental form."""
    now, before, k = moment.reference, moment.reference_before, moment.reference.stiffness
    error = now.tension - moment.reading.tension
    last = before.tension - moment.reading_before.tension
    taken_in = PROPORTIONAL * (error - last) + INTEGRAL * error
    shorter = np.divide(taken_in, k, out=np.zeros_like(k), where=k > 0.0)
    return np.asarray(moment.command + (now.wire - before.wire) - shorter)


def _clamped(moment: Moment, wire: Array, asked: Array) -> Command:
    tension = np.minimum(np.maximum(asked, moment.minimum), moment.maximum)
    k = moment.reference.stiffness
    slack = np.divide(asked - tension, k, out=np.zeros_like(k), where=k > 0.0)
    return Command(np.asarray(wire + slack), tension, np.asarray(tension != asked))
