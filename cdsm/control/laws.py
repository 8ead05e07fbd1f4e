"""Motor laws, and the outer loop that plans tensions again for the wanted stiffness.

A law is a pure function from references and measurements to a command within the bounds.

The motor of a position-controlled cable keeps the length of wire that it has paid out, l_0,
constant; a law computes the next l_0. Every law ends in :func:`limited`, which predicts the
tensions *after* the step. If the posture moves as planned, the plan's change of wire gives the
plan's change of tension, and any other wire a tension that differs by k times the difference:

    F after = F measured + ΔF planned + k (Δl_0 planned − Δl_0 commanded),

with the cable stiffness k. So a plan within the bounds passes, however coarse its steps are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.control.sensing import Estimate, MotorMeasurement, with_rigidity
from cdsm.errors import CdsmError, InvalidInput, UnreachableStiffness
from cdsm.manipulator import Manipulator
from cdsm.planning.path_plan import PathPlan
from cdsm.planning.plan import plan_stiffness
from cdsm.posture import Posture
from cdsm.support.validation import vector
from cdsm.support.values import Array

PROPORTIONAL = 0.2
INTEGRAL = 0.3
"""Gains of the tension control [-]: fractions of the tension error that one step corrects."""

_ROUNDING = 1e-9  # distance of a tension beyond its bound [N] that counts as rounding
_SOFTER = 5e-3  # change of the estimated softness 1/s from which the arm is built again with it
_WITHIN = 1e-6  # how far inside the range of the stiffness a target is moved [-]


class Reference(NamedTuple):
    """Reference values of one step of control.

    Attributes:
        angles: Joint angles (nv,) [rad]; [m] for prismatic joints.
        tension: F (C,) [N].
        paid_out: `l_0` at these angles and tensions (C,) [m].
        stiffness: k of each cable (C,) [N/m]; 0 for force-controlled cables.
    """

    angles: Array
    tension: Array
    paid_out: Array
    stiffness: Array


class Command(NamedTuple):
    """Command to the motors at one step.

    Attributes:
        paid_out: `l_0` to pay out (C,) [m].
        tension: Predicted tension after the step (C,) [N], within the bounds.
        saturated: Whether the command of each motor was changed to keep its tension within the
            bounds (C,).
    """

    paid_out: Array
    tension: Array
    saturated: NDArray[np.bool_]


class ControlInput(NamedTuple):
    """Arguments of a motor law at one step of control.

    Attributes:
        reference: Reference of this step, which the command is to reach.
        reference_before: Reference of the previous step, after which the sensors were read.
        measurement: What the sensors say.
        error_before: :attr:`error` of the previous step (C,) [N].
        paid_out: `l_0` commanded at the previous step (C,) [m].
        minimum: Lower bounds of the tensions (C,) [N].
        maximum: Upper bounds of the tensions (C,) [N].
        tension_controlled: True for each cable (C,) whose tension a mixed law controls; of the
            others it controls the length of wire.
    """

    reference: Reference
    reference_before: Reference
    measurement: MotorMeasurement
    error_before: Array
    paid_out: Array
    minimum: Array
    maximum: Array
    tension_controlled: NDArray[np.bool_]

    @property
    def error(self) -> Array:
        """Tension error e (C,) [N] after the previous step: planned less measured."""
        return np.asarray(self.reference_before.tension - self.measurement.tension)


Law = Callable[[ControlInput], Command]
"""A motor law: it computes the command of one step."""


def limited(control_input: ControlInput, paid_out: Array) -> Command:
    """Return the command to pay out `l_0` (C,) [m], changed to keep the tensions within the bounds.

    The tensions after the step are predicted as the top of the module says. Raises InvalidInput if
    ``paid_out`` is not one number per cable.
    """
    now = control_input.reference
    before = control_input.reference_before
    k = control_input.reference.stiffness
    length = vector("wire of the law", paid_out, k.size, "one length [m] per cable")
    surplus = (now.paid_out - before.paid_out) - (length - control_input.measurement.paid_out)
    predicted = control_input.measurement.tension + (now.tension - before.tension) + k * surplus
    return _clamped(control_input, length, np.where(k > 0.0, predicted, now.tension))


def feedforward(control_input: ControlInput) -> Command:
    """Pay out the lengths of wire of the plan; this law needs no sensor.

    The planned `l_0` allow for the stretch of the wires under the planned tensions.
    """
    return _clamped(
        control_input, control_input.reference.paid_out, control_input.reference.tension
    )


def tension_control(control_input: ControlInput) -> Command:
    """Control all cable tensions by PI control, in addition to the planned changes of `l_0`.

    In each step, `(P Δe + I e)/k` is taken from the planned change `Δl_0`, with the tension error
    e, its change Δe since the previous step, and the cable stiffness k. P and I are PROPORTIONAL
    and INTEGRAL. Every cable needs a load cell. No motor controls a length, so an arm without
    springs in its joints drifts slowly from its posture.
    """
    return limited(control_input, _regulated(control_input))


def mixed(control_input: ControlInput) -> Command:
    """Control the tension of some cables, and pay out the wire of the plan for all others.

    In the paper's arm, the tension of one cable of each pair is controlled. Every cable needs a
    load cell, since the law keeps the tensions of all cables within their bounds.
    """
    planned = control_input.reference.paid_out
    return limited(
        control_input,
        np.where(control_input.tension_controlled, _regulated(control_input), planned),
    )


LAWS: Final[dict[str, Law]] = {
    "feedforward": feedforward,
    "tension": tension_control,
    "mixed": mixed,
    "stiffness": mixed,
}
"""Laws by name; ``stiffness`` is the mixed law inside the stiffness loop."""


def checked_command(command: object, control_input: ControlInput, names: Sequence[str]) -> Command:
    """Check and return the ``command`` of a law to the motors ``names`` (C,).

    Raises InvalidInput unless each commanded length of wire is positive, and each tension is within
    the bounds.
    """
    if not isinstance(command, Command):
        problem = (
            f"returned {command!r}; a Command is needed: return limited(control_input, paid_out)."
        )
        raise InvalidInput("law", problem)
    wire = vector("wire of the law", command.paid_out, len(names), "one length [m] per cable")
    tension = vector("tension of the law", command.tension, len(names), "one [N] per cable")
    low = control_input.minimum - _ROUNDING
    high = control_input.maximum + _ROUNDING
    wrong = ~((wire > 0.0) & (low <= tension) & (tension <= high))
    if wrong.any():
        c = int(wrong.argmax())
        raise InvalidInput(
            "law",
            f"commanded {tension[c]:.6g} N and {wire[c]:.6g} m of wire for {names[c]}; a tension "
            f"from {control_input.minimum[c]:g} to {control_input.maximum[c]:g} N and a positive "
            "length are needed. Return limited(control_input, paid_out).",
        )
    return command


def _regulated(control_input: ControlInput) -> Array:
    """Return l_0 (C,) [m] to pay out if PI control holds the tension of each cable."""
    now = control_input.reference
    k = control_input.reference.stiffness
    error = control_input.error
    correction = PROPORTIONAL * (error - control_input.error_before) + INTEGRAL * error
    taken_in = np.divide(correction, k, out=np.zeros_like(k), where=k > 0.0)
    planned = now.paid_out - control_input.reference_before.paid_out
    return np.asarray(control_input.paid_out + planned - taken_in)


def _clamped(control_input: ControlInput, paid_out: Array, predicted: Array) -> Command:
    tension = np.minimum(np.maximum(predicted, control_input.minimum), control_input.maximum)
    k = control_input.reference.stiffness
    beyond = np.divide(predicted - tension, k, out=np.zeros_like(k), where=k > 0.0)
    return Command(np.asarray(paid_out + beyond), tension, np.asarray(tension != predicted))


def reference_at(arm: Manipulator, q: Array, tension: Array) -> Reference:
    """Return the reference at angles q (nv,) and tensions F (C,) [N], without friction."""
    laws = arm.laws
    lengths = arm.at(q).cable_lengths
    wire = laws.original_lengths(lengths, tension)
    k = laws.stiffness(lengths, tension)
    return Reference(q, tension, wire, k)


class Replanned(NamedTuple):
    """References of one step of control, as the outer loop plans them."""

    reference: Reference
    reference_before: Reference  # that of the previous step, with the wire as calibrated now
    saturated: NDArray[np.bool_]  # whether the tension of each motor was kept at a bound (C,)
    target_unreachable: bool = False
    change_limited: bool = False


class StiffnessLoop:
    """Planner of the least tensions that give the target stiffness at the posture to come.

    ``low`` and ``high`` (C,) [N] bound the tensions at the motors. In each step the tensions move
    towards those planned; none changes by more than ``change`` (C,) [N]. ``failed`` has the reason
    for each step at which nothing could be planned, so that the previous tensions were kept.
    """

    def __init__(self, plan: PathPlan, low: Array, high: Array, change: Array) -> None:
        self._plan = plan
        self._low = low
        self._high = high
        self._change = change
        self._arm = plan.arm
        self._softness = 1.0
        self._mean = plan.tensions[0]  # mean tensions along each cable, as planned last
        self._steps = 0
        self.failed = dict[int, str]()

    def next(
        self, wanted: Reference, target: Array, estimate: Estimate, before: Reference
    ) -> Replanned:
        """Plan the tensions of the next step, for the stiffness ``target`` (D,) [N/m].

        The posture to come is that of ``wanted``, moved by the estimated distance of the arm from
        the reference ``before``.
        """
        ratio = estimate.ratio
        last = self._mean
        unreachable = False
        limited = False
        try:
            self._calibrate(estimate.softness)
            moved = wanted.angles + (estimate.pose.q - before.angles)
            # no arm is beyond its limits: there the estimate is wrong, and the limit is nearest
            pose = self._arm.at(np.clip(moved, self._arm.lower, self._arm.upper))
            wrench = np.append(estimate.tip_force.force, np.zeros(3))
            F, reached = self._least(pose, target, self._low * ratio, self._high * ratio, wrench)
            part = 1.0 / max(float((abs(F - last) / self._change).max()), 1.0)
            self._mean = last + part * (F - last)
            unreachable = not reached
            limited = part < 1.0
        except CdsmError as error:
            self.failed[self._steps] = str(error)
        self._steps += 1
        wanted_at_motor = self._mean / ratio
        motor = np.clip(wanted_at_motor, self._low, self._high)
        saturated = abs(wanted_at_motor - motor) > _ROUNDING
        now = reference_at(self._arm, wanted.angles, self._mean)._replace(tension=motor)
        then = reference_at(self._arm, before.angles, last)._replace(tension=before.tension)
        return Replanned(now, then, saturated, unreachable, limited)

    def _least(
        self, pose: Posture, target: Array, low: Array, high: Array, wrench: Array
    ) -> tuple[Array, bool]:
        """Return the least tensions (C,) [N] nearest to the target, and whether they reach it."""
        direction = self._plan.direction
        wanted = target if direction.ndim > 1 else target[0]
        try:
            plan = plan_stiffness(pose, direction, wanted, low, high, wrench)
        except UnreachableStiffness as error:
            nearest = np.clip(error.target, error.low * (1 + _WITHIN), error.high * (1 - _WITHIN))
            return plan_stiffness(pose, direction, nearest, low, high, wrench).tension.values, False
        return plan.tension.values, plan.reached

    def _calibrate(self, softness: float) -> None:
        """Divide the rigidity of the wires by the estimated ``softness`` 1/s, if that changed."""
        if softness <= 0.0:  # far from the posture of the plan, measurements fit no wire
            problem = f"estimated as {1.0 / softness:.3g} times that of the wires' laws."
            raise InvalidInput("rigidity", problem)
        if abs(softness - self._softness) > _SOFTER:
            self._softness = softness
            self._arm = with_rigidity(self._plan.arm, 1.0 / softness)
