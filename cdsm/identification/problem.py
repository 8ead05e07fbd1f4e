"""Predict the measured stiffnesses from a model of the arm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import CdsmError, InvalidInput, SingularStiffness
from cdsm.identification.least_squares import NoModelError
from cdsm.identification.measurement import Measurement, label
from cdsm.manipulator import Manipulator
from cdsm.statics.following import follow
from cdsm.statics.rest_search import equilibrium
from cdsm.statics.weight_test import WeightTest, weight_test
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.validation import SMALLEST, unit_direction
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension, distribute_tension

Parameters = dict[str, float]


class UserFaultError(Exception):
    """Wraps the :class:`InvalidInput` for a user-defined function that fails."""


@dataclass(frozen=True)
class StiffnessModel:
    """Model of the stiffnesses of all measurements, as a function of the parameters."""

    model_of: Callable[..., Manipulator]
    tension_of: Callable[..., Tension | ArrayLike] | None
    measurements: tuple[Measurement, ...]
    _last_rest: dict[Measurement, Array] = field(default_factory=dict)

    def residuals(self, parameters: Parameters) -> Array:
        """Compute (K(p) − K)/σ (n,), in standard deviations."""
        value, std = np.array([(each.value, each.std) for each in self.measurements]).T
        return np.asarray((self.predict(parameters)[1] - value) / std)

    def predict(self, parameters: Parameters) -> tuple[Manipulator, Array]:
        """Build the arm and compute its stiffnesses K(p) (n,) [N/m]."""
        try:
            arm = _called("model_of", self.model_of, parameters)
        except CdsmError as error:
            raise NoModelError(f"model_of: {error}") from error
        if not isinstance(arm, Manipulator):
            raise InvalidInput("model_of", f"returns {arm!r}; a Manipulator is needed.")
        predicted = np.empty(len(self.measurements))
        for i, measurement in enumerate(self.measurements):
            try:
                predicted[i] = self._along(arm, measurement, parameters)
            except CdsmError as error:
                raise NoModelError(f"measurement {label(i, measurement)}: {error}") from error
        return arm, predicted

    def _along(self, arm: Manipulator, measurement: Measurement, parameters: Parameters) -> float:
        """Compute the stiffness [N/m] of one measurement."""
        pose = arm.at(measurement.angles)
        tension: Tension | ArrayLike
        if self.tension_of is not None:
            tension = _called("tension_of", self.tension_of, parameters, pose, measurement)
        elif measurement.tension is not None:
            tension = measurement.tension
        else:
            assert measurement.minimum is not None
            tension = distribute_tension(pose, measurement.minimum, wrench=measurement.wrench)
        # a Tension holds its wrench
        wrench = None if isinstance(tension, Tension) else measurement.wrench
        K = stiffness(pose, tension, wrench)
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
        """Compute the stiffness [N/m] of a weight test on the model."""
        # start at the equilibrium of the last parameters: a tenth of the time of weight_test
        pose, last = K.posture, self._last_rest.get(measurement)
        force = measurement.force * unit_direction("direction", measurement.direction)
        test = None
        if last is not None:
            without = equilibrium(pose, K.tension, K.wrench)
            loaded = follow(without, frozen(K.wrench + np.append(force, np.zeros(3))), last)
            if loaded is not None:
                test = WeightTest(force=force, without=without, loaded=(loaded,))
        if test is None:
            test = weight_test(pose, K.tension, force, wrench=K.wrench)
        self._last_rest[measurement] = test.loaded[-1].pose.q
        return test.stiffness


def _called(name: str, function: Callable[..., Any], parameters: Parameters, *args: object) -> Any:
    try:
        return function(*args, **parameters)
    except CdsmError:
        raise
    except Exception as error:
        where = ", ".join(f"{key}={value:g}" for key, value in parameters.items())
        raise UserFaultError(
            InvalidInput(
                name,
                f"fails at {where}: {error!r}. Mend it, narrow the bounds, or let it raise a "
                "CdsmError where there is no such arm.",
            )
        ) from error
