"""Residuals and their derivatives over the bounds of the parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import CdsmError, InvalidInput, SingularStiffness
from cdsm.identification.box import Box
from cdsm.identification.measurement import Measurement, label
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.equilibrium import equilibrium, follow
from cdsm.statics.weight_test import WeightTest, weight_test
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.validation import (
    SMALLEST,
    Array,
    frozen,
    unit_direction,
)
from cdsm.tension import Tension, distribute_tension


class NoStiffnessError(Exception):
    """The model has no stiffness for a measurement at this point."""


class UserFaultError(Exception):
    """A function of the user's own fails with an error that is not of this library."""

    def __init__(self, name: str, given: dict[str, float]) -> None:
        self.name = name
        self.given = ", ".join(f"{key}={value:g}" for key, value in given.items())


class Problem:
    """The residuals over the unit cube, which every parameter's bounds are mapped on."""

    def __init__(
        self,
        model_of: Callable[..., Manipulator],
        tension_of: Callable[..., Tension | ArrayLike] | None,
        measurements: tuple[Measurement, ...],
        names: tuple[str, ...],
        bounds: Array,
    ) -> None:
        self._model_of = model_of
        self._tension_of = tension_of
        self.measurements = measurements
        self._value = np.array([each.value for each in measurements])
        self._std = np.array([each.std for each in measurements])
        self.names = names
        self.box = Box(bounds)
        self._hung: dict[Measurement, Array] = {}
        # the searches come back to a point after the differences around it
        self._residuals = lru_cache(maxsize=64)(self._evaluated)

    def predict(self, point: Array) -> tuple[Manipulator, Array]:
        """The arm and its stiffnesses (n,) [N/m].

        Raises:
            NoStiffnessError: It has none for a measurement.
        """
        given = dict(zip(self.names, self.box.parameters(point).tolist(), strict=True))
        try:
            arm = _called("model_of", self._model_of, given)
        except CdsmError as error:
            raise NoStiffnessError(f"model_of: {error}") from error
        if not isinstance(arm, Manipulator):
            raise InvalidInput("model_of", f"returns {arm!r}; a Manipulator is needed.")
        predicted = np.empty(len(self.measurements))
        for i, each in enumerate(self.measurements):
            try:
                predicted[i] = self._along(arm, each, given)
            except CdsmError as error:
                raise NoStiffnessError(f"measurement {label(i, each)}: {error}") from error
        return arm, predicted

    def _along(self, arm: Manipulator, each: Measurement, given: dict[str, float]) -> float:
        pose = arm.at(each.angles)
        tension, wrench = self._tension(pose, each, given)
        K = stiffness(pose, tension, wrench)
        if not K.is_stable:
            raise SingularStiffness(
                f"the arm buckles: the smallest stiffness is {K.margin:.3g} "
                f"{arm.stiffness_unit()}.",
                K.critical_direction,
            )
        value = self._secant(each, pose, K) if each.force else K.along(each.direction)
        if not value < 1.0 / SMALLEST:
            raise SingularStiffness(
                "the tip cannot move in its direction, so the stiffness is infinite.",
                K.critical_direction,
            )
        return value

    def _secant(self, each: Measurement, pose: Posture, K: Stiffness) -> float:
        """What :func:`~cdsm.weight_test` measures.

        To follow the arm from rest to rest takes it ten times as long as to search from where the
        arm of the last parameters hung.
        """
        force = each.force * unit_direction("direction", each.direction)
        hung, test = self._hung.get(each), None
        if hung is not None:
            without = equilibrium(pose, K.tension, K.wrench)
            loaded = follow(without, frozen(K.wrench + np.append(force, np.zeros(3))), hung)
            if loaded is not None:
                test = WeightTest(force=force, without=without, loaded=(loaded,))
        if test is None:
            test = weight_test(pose, K.tension, force, wrench=K.wrench)
        self._hung[each] = test.loaded[-1].pose.q
        return test.stiffness

    def _tension(
        self, pose: Posture, each: Measurement, given: dict[str, float]
    ) -> tuple[Tension, None] | tuple[ArrayLike, ArrayLike]:
        """The tensions, and the wrench if they do not bring their own."""
        if self._tension_of is not None:
            pull = _called("tension_of", self._tension_of, given, pose, each)
            return (pull, None) if isinstance(pull, Tension) else (pull, each.wrench)
        if each.tension is not None:
            return each.tension, each.wrench
        assert each.minimum is not None
        return distribute_tension(pose, each.minimum, wrench=each.wrench), None

    def residuals(self, point: Array) -> Array:
        """Residuals r (n,) in σ; inf, from which the searches step back, if there are none."""
        return self._residuals(point.tobytes()).copy()

    def _evaluated(self, point: bytes) -> Array:
        try:
            r = (self.predict(np.frombuffer(point))[1] - self._value) / self._std
        except NoStiffnessError:
            r = np.full(self._value.shape, math.inf)
        return np.asarray(r)

    def cost(self, point: Array) -> float:
        """χ² at a point."""
        r = self.residuals(point)
        return float(r @ r)

    def slopes(self, point: Array, over: Sequence[int] | None = None) -> Array:
        """∂r/∂point (n, P) by one-sided differences; of some parameters alone, if given."""
        return self._differences(point, 1e-7, over, central=False)

    def central_slopes(self, point: Array) -> Array:
        """∂r/∂point (n, P) by differences of second order."""
        return self._differences(point, 1e-5, None, central=True)

    def _differences(
        self, point: Array, step: float, over: Sequence[int] | None, *, central: bool
    ) -> Array:
        here = self.residuals(point)
        columns = []
        for i in range(len(self.names)) if over is None else over:

            def at(k: int, i: int = i) -> Array | None:
                """Residuals k steps off; None beyond the bounds or where there are none."""
                moved = point.copy()
                moved[i] += k * step
                if not 0.0 <= moved[i] <= 1.0:
                    return None
                r = self.residuals(moved)
                return r if np.isfinite(r).all() else None

            column = None
            for side in (1, -1):
                near = at(side)
                if near is None:
                    continue
                if not central:
                    column = side * (near - here) / step
                elif (far := at(-side)) is not None:
                    column = side * (near - far) / (2.0 * step)
                elif (far := at(2 * side)) is not None:
                    column = side * (4.0 * near - far - 3.0 * here) / (2.0 * step)
                else:
                    continue
                break
            if column is None:
                raise InvalidInput(
                    "free",
                    f"at {self.written(point)} the model has a stiffness for all measurements, "
                    f"but beside it, in {self.names[i]}, it has none either way. Change the "
                    "bounds.",
                )
            columns.append(column)
        return np.column_stack(columns)

    def written(self, point: Array) -> str:
        """A point in own units, for a sentence."""
        values = self.box.parameters(point)
        return ", ".join(f"{n} = {x:.6g}" for n, x in zip(self.names, values, strict=True))


def _called(name: str, function: Callable[..., Any], given: dict[str, float], *args: object) -> Any:
    try:
        return function(*args, **given)
    except CdsmError:
        raise
    except Exception as error:
        raise UserFaultError(name, given) from error
