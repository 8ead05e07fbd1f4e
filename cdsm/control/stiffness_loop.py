"""Outer loop of control: plan the tensions for the target stiffness at the estimated posture."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from cdsm.control.estimates import Estimate
from cdsm.control.laws import Reference
from cdsm.errors import CdsmError, InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.planning.goal import Goal
from cdsm.planning.tension_space import TensionSpace
from cdsm.support.values import Array

_SOFTER = 5e-3  # change of the estimated softness 1/s from which the arm is built again with it


class Replanned(NamedTuple):
    """Result of the outer loop at one step: the planned tensions, or why there are none."""

    reference: Reference  # planned tensions at the motors, and the wire for them
    mean: Array  # mean tensions along each cable (C,) [N], from which the stiffness follows
    refused: str  # why nothing could be planned, so that the previous tensions were kept; or empty
    short: bool  # whether no tensions within the bounds were found that give the target


@dataclass(eq=False)
class StiffnessLoop:
    """Planner of the tensions that give the target stiffness and are nearest to the previous ones.

    If no tensions within the rate give the target, it plans those within the rate whose stiffness
    is nearest to the target.
    """

    arm: Manipulator  # the arm of the controller
    directions: Array  # u (3,) or (n, 3)
    minimum: Array  # lower bounds of the tensions at the motors (C,) [N]
    maximum: Array  # upper bounds (C,) [N]
    rate: Array  # largest change of a tension per step (C,) [N]
    _softness: float = field(default=1.0, init=False)
    _calibrated: Manipulator = field(init=False)

    def __post_init__(self) -> None:
        self._calibrated = self.arm

    def next(
        self, wanted: Reference, target: Array, estimate: Estimate, before: Array
    ) -> Replanned:
        """Plan the tensions of the next step.

        Args:
            wanted: Reference values of the plan at this step. Their tension, wire and stiffness are
                replaced in the result; the angles are kept.
            target: Wanted stiffness [N/m] along the directions, () or (n,).
            estimate: Estimated posture, load, wire and friction.
            before: Mean tensions of the previous step (C,) [N].
        """
        arm, mean, refused, short = self._calibrated, before, "", False
        try:
            arm = self._with_softness(estimate.softness)
            bounds = self.minimum * estimate.ratio, self.maximum * estimate.ratio
            wrench = np.append(estimate.force, np.zeros(3))
            pose = arm.at(estimate.pose.q)
            space = TensionSpace(pose, self.directions, *bounds, wrench)
            goal, held = Goal(space, target.reshape(-1)), np.clip(before, *bounds)
            near = space.within(held, self.rate)
            found = goal.search(held, near, held)
            if found is None:
                found = goal.nearest(held, near)
                short = found is not None and goal.search(found) is None
            if found is None:
                refused = "no tensions within the rate balance the arm and hold it"
            else:
                mean = found
        except CdsmError as error:
            refused = str(error)
        lengths = arm.cable_lengths(wanted.angles)
        laws = arm._laws
        reference = wanted._replace(
            tension=np.clip(mean / estimate.ratio, self.minimum, self.maximum),
            wire=laws.original_lengths(lengths, mean),
            stiffness=laws.stiffness(lengths, mean),
        )
        return Replanned(reference, mean, refused, short)

    def _with_softness(self, softness: float) -> Manipulator:
        """Return the arm with the rigidity of its wires divided by the estimated ``softness`` 1/s.

        A new arm is built only if the softness has changed by more than 0.005. Raises InvalidInput
        if the softness is not positive.
        """
        if softness <= 0.0:  # far from the posture of the plan, readings fit no wire
            raise InvalidInput(
                "rigidity", f"estimated as {1.0 / softness:.3g} times that of the wires' laws."
            )
        if abs(softness - self._softness) > _SOFTER:
            self._softness = softness
            self._calibrated = with_rigidity(self.arm, 1.0 / softness)
        return self._calibrated


def with_rigidity(arm: Manipulator, factor: float) -> Manipulator:
    """Return the arm with ``factor`` times the rigidity of all its wires."""
    laws = {id(cable.elasticity): cable.elasticity for cable in arm.cables}
    scaled = {key: law.scaled(factor) for key, law in laws.items()}
    return arm._with_laws([scaled[id(cable.elasticity)] for cable in arm.cables])
