"""Outer loop of control: plan the tensions for the target stiffness at the posture to come."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdsm.control.laws import Reference
from cdsm.control.observer import Estimate, with_rigidity
from cdsm.errors import CdsmError, InvalidInput, UnreachableStiffness
from cdsm.manipulator import Manipulator
from cdsm.planning.path_plan import PathPlan
from cdsm.planning.plan import plan_stiffness
from cdsm.posture import Posture
from cdsm.support.values import Array

_SOFTER = 5e-3  # change of the estimated softness 1/s from which the arm is built again with it
_WITHIN = 1e-6  # how far inside the range of the stiffness a target is moved [-]


class Replanned(NamedTuple):
    """Result of the outer loop at one step."""

    reference: Reference  # planned tensions at the motors, and the wire for them
    before: Reference  # the reference of the previous step, with the wire as calibrated now
    flags: dict[str, bool]  # target_unreachable, change_limited


class StiffnessLoop:
    """Planner of the least tensions that give the target stiffness at the posture to come.

    ``low`` and ``high`` (C,) [N] bound the tensions at the motors. In each step the tensions move
    towards those planned; none changes by more than ``change`` (C,) [N]. ``failed`` has the reason
    for each step at which nothing could be planned, so that the previous tensions were kept.
    """

    def __init__(self, plan: PathPlan, low: Array, high: Array, change: Array) -> None:
        self._plan, self._low, self._high, self._change = plan, low, high, change
        self._arm, self._softness = plan.arm, 1.0
        self._mean = plan.tensions[0]  # mean tensions along each cable, as planned last
        self._steps, self.failed = 0, dict[int, str]()

    def next(
        self, wanted: Reference, target: Array, estimate: Estimate, before: Reference
    ) -> Replanned:
        """Plan the tensions of the next step.

        The posture to come is that of ``wanted``, moved by the estimated distance of the arm from
        the reference ``before``. ``target`` is the wanted stiffness (D,) [N/m].
        """
        unreachable = limited = False
        ratio, last = estimate.ratio, self._mean
        try:
            self._calibrate(estimate.softness)
            moved = wanted.angles + (estimate.pose.q - before.angles)
            pose = self._arm.at(np.clip(moved, self._arm.lower, self._arm.upper))
            bounds = self._low * ratio, self._high * ratio
            F, reached = self._least(pose, target, *bounds, np.append(estimate.force, np.zeros(3)))
            way = F - self._mean
            part = 1.0 / max(float((abs(way) / self._change).max()), 1.0)
            self._mean = self._mean + part * way
            unreachable, limited = not reached, part < 1.0
        except CdsmError as error:
            self.failed[self._steps] = str(error)
        self._steps += 1
        motor = np.clip(self._mean / ratio, self._low, self._high)
        now = reference_at(self._arm, wanted.angles, self._mean)._replace(tension=motor)
        then = reference_at(self._arm, before.angles, last)._replace(tension=before.tension)
        flags = {"target_unreachable": unreachable, "change_limited": limited}
        return Replanned(now, then, flags)

    def _least(
        self, pose: Posture, target: Array, low: Array, high: Array, wrench: Array
    ) -> tuple[Array, bool]:
        """Return the least tensions (C,) [N] nearest to the target, and whether they reach it."""
        direction = self._plan.direction
        wanted = target if direction.ndim > 1 else target[0]
        try:
            plan = plan_stiffness(pose, direction, wanted, low, high, wrench)
        except UnreachableStiffness as error:
            ends = error.low * (1.0 + _WITHIN), error.high * (1.0 - _WITHIN)
            nearest = np.clip(error.target, *ends)
            return plan_stiffness(pose, direction, nearest, low, high, wrench).tension.values, False
        return plan.tension.values, plan.reached

    def _calibrate(self, softness: float) -> None:
        """Divide the rigidity of the wires by the estimated ``softness`` 1/s.

        A new arm is built only if the softness has changed by more than 0.005. Raises InvalidInput
        if the softness is not positive.
        """
        if softness <= 0.0:  # far from the posture of the plan, measurements fit no wire
            said = f"estimated as {1.0 / softness:.3g} times that of the wires' laws."
            raise InvalidInput("rigidity", said)
        if abs(softness - self._softness) > _SOFTER:
            self._softness = softness
            self._arm = with_rigidity(self._plan.arm, 1.0 / softness)


def reference_at(arm: Manipulator, q: Array, tension: Array) -> Reference:
    """Return the reference at angles q (nv,) and tensions F (C,) [N], without friction."""
    laws, lengths = arm._laws, arm.at(q).cable_lengths
    wire, k = laws.original_lengths(lengths, tension), laws.stiffness(lengths, tension)
    return Reference(q, tension, wire, k)
