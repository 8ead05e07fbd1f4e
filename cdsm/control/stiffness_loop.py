"""The outer loop: tensions for the wanted stiffness, planned again at the estimated posture."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from cdsm.control.estimates import Estimate
from cdsm.control.laws import Reference
from cdsm.errors import CdsmError
from cdsm.manipulator import Manipulator
from cdsm.planning.follow import least_change
from cdsm.planning.objectives import target_constraints
from cdsm.planning.range import MARGIN
from cdsm.planning.stiffness_model import StiffnessModel
from cdsm.support.values import Array

_SOFTER = 5e-3
"""Change of the softness of the wire from which the arm is built again with it."""


class Replanned(NamedTuple):
    """Tensions that the outer loop plans at one step.

    Attributes:
        reference: Its tensions at the motors, and the wire for them.
        mean: Mean tensions over the wire of each cable (C,) [N], which give the stiffness.
        refused: Why nothing could be planned, and the tensions before were kept; or empty.
    """

    reference: Reference
    mean: Array
    refused: str


@dataclass(eq=False)
class StiffnessLoop:
    """Plans the tensions of the next step: the nearest to those before that give the stiffness.

    Where the rate does not allow that, it goes towards them.

    Attributes:
        arm: The arm of the controller.
        directions: u (3,) or (n, 3).
        minimum: Lower bounds of the tensions at the motors (C,) [N].
        maximum: Upper bounds (C,) [N].
        rate: Largest change of a tension per step (C,) [N].
    """

    arm: Manipulator
    directions: Array
    minimum: Array
    maximum: Array
    rate: Array
    _softness: float = field(default=1.0, init=False)
    _calibrated: Manipulator = field(init=False)

    def __post_init__(self) -> None:
        self._calibrated = self.arm

    def next(
        self, wanted: Reference, target: Array, estimate: Estimate, before: Array
    ) -> Replanned:
        """Plan a step.

        Args:
            wanted: The plan at this step, of which the angles are kept.
            target: Stiffness [N/m], () or (n,).
            estimate: Posture, load, wire and friction as far as they are known.
            before: Mean tensions of the step before (C,) [N].
        """
        arm, mean, refused = self._with_softness(estimate.softness), before, ""
        try:
            bounds = self.minimum * estimate.ratio, self.maximum * estimate.ratio
            wrench = np.append(estimate.force, np.zeros(3))
            model = StiffnessModel(arm.at(estimate.pose.q), *bounds, wrench, MARGIN)
            constraints = target_constraints(model, self.directions, target)
            found = least_change(model, constraints, before, self.rate)
            if found is None:
                refused = "no tensions within the rate balance the arm and hold it"
            else:
                mean = found
        except CdsmError as error:
            refused = str(error)
        lengths = arm.cable_lengths(wanted.angles)
        laws = arm._model.laws
        reference = wanted._replace(
            tension=np.clip(mean / estimate.ratio, self.minimum, self.maximum),
            wire=laws.original_lengths(lengths, mean),
            stiffness=laws.stiffness(lengths, mean),
        )
        return Replanned(reference, mean, refused)

    def _with_softness(self, softness: float) -> Manipulator:
        """Return the arm with the rigidity that its wire seems to have."""
        if abs(softness - self._softness) > _SOFTER:
            self._softness = softness
            self._calibrated = with_rigidity(self.arm, 1.0 / softness)
        return self._calibrated


def with_rigidity(arm: Manipulator, factor: float) -> Manipulator:
    """Return the arm with ``factor`` times the rigidity of all its wires."""
    laws = {id(cable.elasticity): cable.elasticity for cable in arm.cables}
    scaled = {key: law.scaled(factor) for key, law in laws.items()}
    return arm._with_laws([scaled[id(cable.elasticity)] for cable in arm.cables])
