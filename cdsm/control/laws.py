"""Motor laws: pure functions from references and readings to a command within the bounds.

The motor of a position-controlled cable keeps the length of wire that it has paid out, l_0,
constant. A law computes the next l_0. At a constant posture, a change of l_0 changes the tension by
−k Δl_0, so each command corresponds to a tension, F measured + k (l_0 measured − l_0 commanded). No
law commands a tension below its lower bound, where the cable may be slack, or above its upper
bound. A user-defined law is any function of a :class:`Moment` that returns
``limited(moment, wire)``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import InvalidInput
from cdsm.support.validation import vector
from cdsm.support.values import Array

PROPORTIONAL, INTEGRAL = 0.2, 0.3
"""Gains of the tension control [-]: fractions of the tension error that one step corrects."""

_ROUNDING = 1e-9  # distance of a tension beyond its bound [N] that counts as rounding


class Reference(NamedTuple):
    """Reference values of one step of control.

    Attributes:
        angles: Joint angles (nv,) [rad]; [m] for prismatic joints.
        tension: F (C,) [N].
        wire: l_0 paid out at these angles and tensions (C,) [m].
        stiffness: k of each cable (C,) [N/m]; 0 for force-controlled cables.
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
        tension: The tension that corresponds to ``wire`` (C,) [N], within the bounds.
        saturated: Whether the command of each motor was changed to keep its tension within the
            bounds (C,).
    """

    wire: Array
    tension: Array
    saturated: NDArray[np.bool_]


class Moment(NamedTuple):
    """Arguments of a motor law at one step of control: a moment of time, not a torque.

    Attributes:
        reference: Reference of this step.
        reading: Readings of the sensors at this step.
        reference_before: Reference of the previous step.
        reading_before: Readings of the previous step.
        command: Wire commanded at the previous step (C,) [m].
        minimum: Lower bounds of the tensions (C,) [N].
        maximum: Upper bounds of the tensions (C,) [N].
        forced: True for each cable (C,) whose tension a mixed law controls; of the others it
            controls the length of wire.
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
"""A motor law: it computes the command of one step."""


def limited(moment: Moment, wire: Array) -> Command:
    """Return the command to pay out ``wire`` (C,) [m], changed to keep tensions within bounds.

    The commanded tensions follow from the measured tensions and the change of wire at constant
    posture. Raises InvalidInput if ``wire`` is not one number per cable.
    """
    reading, k = moment.reading, moment.reference.stiffness
    wire = vector("wire of the law", wire, k.size, "one length [m] per cable")
    asked = reading.tension + k * (reading.wire - wire)
    return _clamped(moment, wire, np.where(k > 0.0, asked, moment.reference.tension))


def checked_command(command: object, moment: Moment, names: Sequence[str]) -> Command:
    """Check and return the ``command`` of a law to the motors ``names`` (C,).

    Raises InvalidInput unless each commanded length of wire is positive, and each tension is within
    the bounds.
    """
    if not isinstance(command, Command):
        raise InvalidInput(
            "law", f"returned {command!r}; a Command is needed: return limited(moment, wire)."
        )
    wire = vector("wire of the law", command.wire, len(names), "one length [m] per cable")
    tension = vector("tension of the law", command.tension, len(names), "one [N] per cable")
    low, high = moment.minimum - _ROUNDING, moment.maximum + _ROUNDING
    wrong = ~((wire > 0.0) & (low <= tension) & (tension <= high))
    if wrong.any():
        c = int(wrong.argmax())
        raise InvalidInput(
            "law",
            f"commanded {tension[c]:.6g} N and {wire[c]:.6g} m of wire for {names[c]}; a tension "
            f"from {moment.minimum[c]:g} to {moment.maximum[c]:g} N and a positive length are "
            "needed. Return limited(moment, wire).",
        )
    return command


def feedforward(moment: Moment) -> Command:
    """Pay out the lengths of wire of the plan; this law needs no sensor.

    The planned l_0 allow for the stretch of the wires under the planned tensions.
    """
    return _clamped(moment, moment.reference.wire, moment.reference.tension)


def tension_control(moment: Moment) -> Command:
    """Control all cable tensions by PI control, in addition to the planned changes of l_0.

    In each step, Δl_0 = Δl_0 planned − (P Δe + I e)/k with the error e = F planned − F measured,
    its change Δe since the previous step, and the cable stiffness k. P and I are PROPORTIONAL and
    INTEGRAL. Every cable needs a load cell. No motor controls a length, so an arm without springs
    in its joints drifts slowly from its posture.
    """
    return limited(moment, _regulated(moment))


def mixed(moment: Moment) -> Command:
    """Control the tension of some cables, and pay out the wire of the plan for all others.

    In the paper's arm, the tension of one cable of each pair is controlled. Every cable needs a
    load cell, since the law keeps the tensions of all cables within their bounds.
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
    """Return the wire (C,) [m] to pay out if PI control holds the tension of each cable.

    It is the previous command plus the planned change of wire and the correction of the tension
    error, as :func:`tension_control` describes.
    """
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
