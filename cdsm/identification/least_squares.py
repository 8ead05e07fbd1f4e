"""Least squares of all measurements, over parameters scaled to 0…1 between their bounds."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from cdsm.errors import CdsmError, CdsmWarning, InvalidInput
from cdsm.identification.measurement import (
    Measurement,
    measurement_name,
    tension_before,
)
from cdsm.identification.tip_position import TipPosition
from cdsm.identification.warm_starts import LoopPaths, WarmStarts
from cdsm.identification.weight_loop import WeightLoop
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.statics.quasi_static import EquilibriumPath
from cdsm.support.progress import progress_bar
from cdsm.support.validation import instance
from cdsm.support.values import Array
from cdsm.tension import Tension

TensionOf = Callable[..., Tension | ArrayLike]
Test = Measurement | WeightLoop | TipPosition

_DECADES = 100.0  # bounds that are positive and this factor apart: the logarithm is searched
_STEP = 1e-6  # of finite differences
_STEP_OF_RESTS = 1e-5  # the same of postures at rest, which are less exact
_FALL = 1e-12, 1e-6  # of χ², at which a search ends; of a profile
_FALL_OF_RESTS = 1e-6, 1e-5  # the same with postures at rest
_FALL_OF_LOOPS = 1e-4, 1e-5  # the same with loops, each prediction of which takes long
_INSIDE = 1e-2  # nearest start to a bound: a search that starts on a bound may stay there


class Prediction(NamedTuple):
    """What a model of the arm predicts."""

    arm: Manipulator
    numbers: list[Array]  # of each measurement
    rests: Mapping[object, Posture]  # where the arm rests at tip positions, by their conditions
    paths: LoopPaths


class LeastSquares:
    """Residuals r in standard deviations, as a function of scaled parameters x (P,).

    Where the model does not exist, they are infinite, and scipy's search shortens its step.
    """

    def __init__(
        self,
        model_of: Callable[..., Manipulator],
        tension_of: TensionOf | None,
        measurements: Sequence[Test],
        bounds: Mapping[str, tuple[float, float]],
    ) -> None:
        self.model_of = model_of
        self.tension_of = tension_of
        self.measurements = tuple(measurements)
        self.names = tuple(bounds)
        self.low, self.high = np.array([*bounds.values()], dtype=np.float64).T
        self._by_log = (self.low > 0.0) & (self.high >= _DECADES * self.low)
        self._ends = self._scaled(self.low), self._scaled(self.high)
        self._last: tuple[bytes, Prediction | str] = b"", ""
        self._warm_starts = WarmStarts(np.full(len(bounds), 0.5), {})
        self._advance: Callable[[int], None] | None = None  # of the bar that counts predictions
        self.edge = ""  # where the model did not exist last, and why
        self.has_rests = not all(isinstance(entry, Measurement) for entry in measurements)
        self.has_loops = any(isinstance(entry, WeightLoop) for entry in measurements)

    @contextmanager
    def counted(self, description: str) -> Iterator[None]:
        """Show a bar with the number of predictions that are made inside this context."""
        try:
            with progress_bar(description) as self._advance:
                yield
        finally:
            self._advance = None

    def _scaled(self, values: Array) -> Array:
        return np.asarray(np.log(values, out=values.copy(), where=self._by_log))

    def values(self, x: Array) -> Array:
        """Compute the parameters (P,) at a point x (P,)."""
        low, high = self._ends
        mixed = (1.0 - x) * low + x * high
        values = np.exp(mixed, out=mixed, where=self._by_log)
        return np.where(x == 0.0, self.low, np.where(x == 1.0, self.high, values))  # exactly

    def point(self, values: Array) -> Array:
        """Compute the point x (P,) of ``values`` (P,) of the parameters."""
        low, high = self._ends
        return np.asarray((self._scaled(values) - low) / (high - low))

    def slope(self, x: Array) -> Array:
        """Compute the derivative of each parameter with respect to its x, (P,)."""
        low, high = self._ends
        return (high - low) * np.where(self._by_log, self.values(x), 1.0)

    def describe(self, x: Array) -> str:
        """Write the parameters at a point as text: "a = 1.2, b = 3"."""
        return ", ".join(f"{n} = {v:.6g}" for n, v in zip(self.names, self.values(x), strict=True))

    def predict(self, x: Array) -> Prediction | str:
        """Predict all measurements at a point; return the reason as text if there is no model.

        Raises InvalidInput if a function of the user fails.
        """
        if self._last[0] != x.tobytes():
            self._last = (x.tobytes(), self._predict(x))
            if isinstance(reason := self._last[1], str):
                self.edge = f"{self.describe(x)}: {reason}"
        return self._last[1]

    def _predict(
        self, x: Array, near: Mapping[object, Posture] = MappingProxyType({})
    ) -> Prediction | str:
        """Predict at a point; where the arm rests at tip positions is sought from ``near``."""
        known = self._warm_starts.at(x)
        rests = dict[object, Posture]()
        paths = dict[int, tuple[EquilibriumPath, ...]]()
        parameters = dict(zip(self.names, self.values(x).tolist(), strict=True))
        where = "model_of: "
        numbers = list[Array]()
        try:
            with warnings.catch_warnings():  # a trial value may look like one in another unit
                warnings.simplefilter("ignore", CdsmWarning)
                arm = self.model_of(**parameters)
            where = ""
            instance("model_of", arm, Manipulator)
            for i, measurement in enumerate(self.measurements):
                where = f"measurement {measurement_name(i, measurement.label)}: "
                if isinstance(measurement, TipPosition):
                    if (key := measurement.conditions) not in rests:
                        rests[key] = measurement.rest_posture(arm, near.get(key))
                    numbers.append(measurement.tip_coordinates(rests[key]))
                    continue
                pose = arm.at(measurement.angles)
                if self.tension_of is None:
                    tension = tension_before(measurement, pose)
                else:
                    tension = self.tension_of(pose, measurement, **parameters)
                if isinstance(measurement, WeightLoop):
                    moved, paths[i] = measurement.follow(pose, tension, known.get(i, ()))
                    numbers.append(moved)
                else:
                    numbers.append(measurement.predict(pose, tension))
        except CdsmError as error:
            return f"{where}{error}"
        except Exception as error:
            name = "tension_of" if self.tension_of and where.startswith("meas") else "model_of"
            remedy = "Correct it, narrow the bounds, or let it raise a CdsmError where there is no"
            fault = f"fails at {self.describe(x)}: {error!r}."
            raise InvalidInput(name, f"{fault} {remedy} such arm.") from error
        if self._advance:
            self._advance(1)
        return Prediction(arm, numbers, rests, paths)

    def weighed(self, numbers: Sequence[Array]) -> Array:
        """Return the residuals r (n,) of predicted ``numbers``."""
        pairs = zip(self.measurements, numbers, strict=True)
        errors = (measurement.errors(predicted) for measurement, predicted in pairs)
        return np.concatenate([off / std for off, std in errors])

    def residuals(self, x: Array) -> Array:
        """Compute r (n,) at a point; inf without a model."""
        return self._weighed_or_inf(self.predict(x))

    def _weighed_or_inf(self, prediction: Prediction | str) -> Array:
        if isinstance(prediction, str):
            count = sum(measurement.readings.size for measurement in self.measurements)
            return np.full(count, np.inf)
        return self.weighed(prediction.numbers)

    def cost(self, x: Array) -> float:
        """Compute χ² = Σ r² at a point."""
        r = self.residuals(x)
        return float(r @ r)

    def jacobian(self, x: Array, over: Any = None, *, central: bool = False) -> Array:
        """Compute ∂r/∂x (n, P) by one-sided or central differences, or its columns ``over`` alone.

        A side beyond a bound or without a model is left out. Raises InvalidInput if both are.
        """
        here = self.residuals(x)
        prediction = self.predict(x)
        assert not isinstance(prediction, str)
        self._warm_starts = WarmStarts(x.copy(), prediction.paths)
        columns = []
        step = _STEP_OF_RESTS if self.has_rests else _STEP
        for i in range(x.size) if over is None else over:
            sides = list[tuple[float, Array]]()
            for way in (step, -step):
                y = x.copy()
                y[i] += way
                if not 0.0 <= y[i] <= 1.0:
                    continue
                side = self._predict(y, prediction.rests)
                if isinstance(side, str):
                    continue
                self._warm_starts.beside[i] = way, side.paths
                sides.append((way, self.weighed(side.numbers)))
                if not central:
                    break
            if not sides:
                raise InvalidInput(
                    "free",
                    f"at {self.describe(x)} there is a prediction for all measurements, but none "
                    f"for a slightly smaller or larger {self.names[i]}. Change the bounds.",
                )
            (a, r_a), (b, r_b) = [*sides, (0.0, here)][:2]
            columns.append((r_a - r_b) / (a - b))
        return np.column_stack(columns)

    def search(self, x: Array, over: Any = None, *, profile: bool = False) -> Array:
        """Search from a point x for the least χ²; only the parameters ``over`` move, or all.

        The search of a ``profile``, which follows others nearby, ends at a fall of its own.
        """
        moving = np.arange(x.size) if over is None else np.asarray(over)

        def at(part: Array) -> Array:
            point = x.copy()
            point[moving] = part
            return point

        start = np.clip(x[moving], _INSIDE, 1.0 - _INSIDE)
        if not np.isfinite(self.cost(at(start))):
            return x  # the model ends here
        falls = _FALL_OF_LOOPS if self.has_loops else _FALL_OF_RESTS if self.has_rests else _FALL
        solution = least_squares(
            lambda part: self.residuals(at(part)),
            start,
            lambda part: self.jacobian(at(part), moving),
            bounds=(0.0, 1.0),
            x_scale="jac",
            ftol=falls[profile],
            xtol=1e-8 if profile or self.has_rests else 1e-12,
            gtol=1e-12,
            max_nfev=200,
        )
        return at(solution.x)
