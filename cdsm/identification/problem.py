"""Predict measured stiffnesses and loops of weight tests from a model of the arm.

The differences from the measurements are the residuals that :func:`identify` minimises.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import CdsmError, InvalidInput, SingularStiffness
from cdsm.identification.least_squares import LeastSquares, no_model
from cdsm.identification.loop import WeightLoop, measured, offset, tips
from cdsm.identification.measurement import Measurement, label
from cdsm.manipulator import Manipulator
from cdsm.statics.weight_test import weight_test
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.directions import unit_direction
from cdsm.support.validation import SMALLEST
from cdsm.support.values import Array
from cdsm.tension import Tension, distribute_tension

Parameters = dict[str, float]


class UserFaultError(Exception):
    """A user-defined function has failed; its first argument is the :class:`InvalidInput` to raise.

    It is not a CdsmError. A search stops at it, while a CdsmError only means that the model does
    not exist for these parameters.
    """


@dataclass(frozen=True)
class Model:
    """Predictions and residuals of all measurements, as functions of the parameters of the arm."""

    model_of: Callable[..., Manipulator]  # function that builds the arm from the parameters
    # function that gives the tensions, or None
    tension_of: Callable[..., Tension | ArrayLike] | None
    measurements: tuple[Measurement | WeightLoop, ...]

    @property
    def count(self) -> int:
        """Number n of residuals: one for each stiffness, and one for each reading of a loop."""
        return sum(len(measured(each)) for each in self.measurements)

    @property
    def loops(self) -> tuple[WeightLoop, ...]:
        """The loops among the measurements."""
        return tuple(each for each in self.measurements if isinstance(each, WeightLoop))

    def residuals(self, parameters: Parameters) -> Array:
        """Compute all residuals (n,) for these ``parameters``, in standard deviations."""
        return self.weigh(self.predict(parameters)[1])

    def predict(self, parameters: Parameters) -> tuple[Manipulator, list[Array]]:
        """Build the arm of ``parameters``; predict each stiffness (1,) [N/m] or loop (m,) [m].

        The predictions of a loop are displacements of the tip from its position without the forces.
        """
        arm = self.arm(parameters)
        predicted = []
        for i, each in enumerate(self.measurements):
            with no_model(f"measurement {label(i, each)}: "):
                if isinstance(each, Measurement):
                    predicted.append(np.array([self._along(arm, each, parameters)]))
                else:
                    K = self._stiffness(arm, each, parameters)
                    moved = tips(K.posture, K.tension, K.wrench, each.applied)
                    predicted.append((moved @ each.axes.T).ravel())
        return arm, predicted

    def weigh(self, predicted: list[Array]) -> Array:
        """Compute the residuals (n,) in standard deviations from a result of :meth:`predict`."""
        rows = []
        for each, found in zip(self.measurements, predicted, strict=True):
            if isinstance(each, WeightLoop):
                rows.append((found - offset(each, found) - measured(each)) / each.displacement_std)
            else:
                rows.append((found - each.value) / each.std)
        return np.concatenate(rows)

    def with_offsets(self, predicted: list[Array]) -> Array:
        """Convert predictions of :meth:`predict` to numbers (n,) [N/m, m] as they would be read.

        The predictions of a loop get the fitted offset of each axis.
        """
        return np.concatenate(
            [
                found - offset(each, found) if isinstance(each, WeightLoop) else found
                for each, found in zip(self.measurements, predicted, strict=True)
            ]
        )

    def arm(self, parameters: Parameters) -> Manipulator:
        """Build the arm of ``parameters``; raise NoModelError if there is none."""
        with no_model("model_of: "):
            arm = _call_model("model_of", self.model_of, parameters)
        if not isinstance(arm, Manipulator):
            raise InvalidInput("model_of", f"returns {arm!r}; a Manipulator is needed.")
        return arm

    def _stiffness(
        self, arm: Manipulator, measurement: Measurement | WeightLoop, parameters: Parameters
    ) -> Stiffness:
        """Compute the stiffness of the arm before the first force of a measurement."""
        pose = arm.at(measurement.angles)
        tension: Tension | ArrayLike
        if self.tension_of is not None:
            tension = _call_model("tension_of", self.tension_of, parameters, pose, measurement)
        elif measurement.tension is not None:
            tension = measurement.tension
        else:
            assert measurement.minimum is not None
            tension = distribute_tension(pose, measurement.minimum, wrench=measurement.wrench)
        wrench = None if isinstance(tension, Tension) else measurement.wrench
        return stiffness(pose, tension, wrench)

    def _along(self, arm: Manipulator, measurement: Measurement, parameters: Parameters) -> float:
        K = self._stiffness(arm, measurement, parameters)
        if not K.is_stable:
            raise SingularStiffness(
                f"the arm buckles: the smallest stiffness is {K.margin:.3g} "
                f"{arm.stiffness_unit()}.",
                K.critical_direction,
            )
        if measurement.force:
            value = self._secant(measurement, K)
        else:
            value = K.along(measurement.direction)
        if not value < 1.0 / SMALLEST:
            raise SingularStiffness(
                "the tip cannot move in its direction, so the stiffness is infinite.",
                K.critical_direction,
            )
        return value

    def _secant(self, measurement: Measurement, K: Stiffness) -> float:
        force = measurement.force * unit_direction("direction", measurement.direction)
        return weight_test(K.posture, K.tension, force, wrench=K.wrench).stiffness


def problem_of(model: Model, bounds: Mapping[str, tuple[float, float]]) -> LeastSquares:
    """Return the least-squares problem of ``model`` within ``bounds`` (low, high) by name."""
    return LeastSquares(model.residuals, model.count, bounds, rough=bool(model.loops))


def _call_model(
    name: str, function: Callable[..., Any], parameters: Parameters, *args: object
) -> Any:
    try:
        return function(*args, **parameters)
    except CdsmError:
        raise
    except Exception as error:
        where = ", ".join(f"{key}={value:g}" for key, value in parameters.items())
        raise UserFaultError(
            InvalidInput(
                name,
                f"fails at {where}: {error!r}. Correct it, narrow the bounds, or let it raise a "
                "CdsmError where there is no such arm.",
            )
        ) from error
