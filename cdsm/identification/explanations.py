"""Which single parameter explains measurements, and which ones exclude each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import final

import numpy as np

from cdsm.errors import InvalidInput, listed
from cdsm.identification.identify import check_measurements, fit_parameters
from cdsm.identification.least_squares import LeastSquares, Test
from cdsm.identification.measurement import Measurement
from cdsm.identification.result import Identification, independent_readings
from cdsm.manipulator import Manipulator
from cdsm.support.determination import likely
from cdsm.support.format import aligned, plural
from cdsm.support.progress import progress_allowed, show_progress
from cdsm.support.result import Result, quantity, unit
from cdsm.support.values import Array, frozen

_NEEDED = 3.84  # fall of χ² by a second parameter that 5 % of needless ones reach
_NOTHING = 0.1  # fall of χ² that leaves a second parameter no part


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Explanations(Result):
    """Parameters that may each explain measurements; made by :func:`compare_explanations`.

    ``print`` it for the verdict in words.

    Attributes:
        names: Names of the parameters, best explanation first.
        alone: Fit of each parameter alone, in the order of ``names``.
        together: Fit of the best one together with each other one, by its name.
        unexplained: Residuals of the arm as it is (n,) in standard deviations.
    """

    _headline = "chi_square"
    _rows = "explanation"

    names: tuple[str, ...] = field(metadata=unit("1", "explanation", name="explanation"))
    alone: tuple[Identification, ...]
    together: Mapping[str, Identification]
    unexplained: Array = field(metadata=unit("1", "reading"))

    @property
    def best(self) -> str:
        """Name of the parameter that alone leaves the least χ²."""
        return self.names[0]

    @quantity("own unit", "explanation")
    def values(self) -> Array:
        """Value of each parameter that explains best, if it alone is free (P,)."""
        return frozen(np.array([fit.values[0] for fit in self.alone]))

    @quantity("1", "explanation")
    def chi_square(self) -> Array:
        """χ² that each parameter alone leaves (P,)."""
        return frozen(np.array([fit.chi_square for fit in self.alone]))

    @quantity("1", "explanation")
    def explains(self) -> tuple[bool, ...]:
        """Whether each parameter alone explains the measurements within their σ (P,).

        It does if at least one in a thousand right models would leave more χ².
        """
        return tuple(likely(fit.chi_square, fit.freedom) for fit in self.alone)

    @property
    def exclusive(self) -> tuple[str, ...]:
        """Names of the parameters that exclude the best one, and that it excludes.

        Alone, each of them lowers χ² of the arm as it is; beside the best one, it has no part.
        """
        return tuple(name for name in self.names[1:] if self._beside(name)[0] == "exclusive")

    def __str__(self) -> str:
        in_mm = not any(
            isinstance(measurement, Measurement) for measurement in self.alone[0].measurements
        )
        rows = [("free", "value [own unit]", "χ²", "RMSE [mm]" if in_mm else "rms [σ]", "explains")]
        fits = [("nothing", "", self.unexplained, self.unexplained.size)]
        for name, fit in zip(self.names, self.alone, strict=True):
            fits.append((name, f"{fit.values[0]:.4g}", fit.residuals, fit.freedom))
        for name, value, r, freedom in fits:
            off = 1e3 * self._deviations * r if in_mm else r
            yes = "yes" if likely(float(r @ r), freedom) else "no"
            rows.append((name, value, f"{r @ r:.4g}", f"{np.sqrt(np.mean(off**2)):.3g}", yes))
        return "\n".join([*aligned(rows), "", *self.verdict])

    @property
    def _deviations(self) -> Array:
        readings = [measurement.readings for measurement in self.alone[0].measurements]
        pairs = zip(self.alone[0].measurements, readings, strict=True)
        sigma = [measurement.errors(numbers)[1] for measurement, numbers in pairs]
        return np.repeat(sigma, [numbers.size for numbers in readings])

    @property
    def verdict(self) -> tuple[str, ...]:
        """What the fits say, in sentences."""
        r = self.unexplained
        best = self.best
        yes = self.explains
        good = [name for name, explained in zip(self.names, yes, strict=True) if explained]
        bad = [name for name, explained in zip(self.names, yes, strict=True) if not explained]
        sentences = list[str]()
        if likely(float(r @ r), r.size):
            sentences.append(
                "The arm as it is explains these measurements; nothing need be changed."
            )
        if good:
            sentences.append(f"{_verb(good, 'explains', 'each explain')} these measurements.")
        if good and bad:
            sentences.append(f"{_verb(bad, 'does', 'do')} not.")
        if not good:
            sentences.append(f"None alone explains these measurements; {best} leaves the least χ².")
        return (*sentences, *(self._beside(name)[1] for name in self.names[1:]))

    def _beside(self, name: str) -> tuple[str, str]:
        """Return how a parameter relates to the best one: in a word, and in a sentence."""
        i = self.names.index(name)
        best = self.best
        both = self.together[name]
        fall = max(0.0, self.alone[0].chi_square - both.chi_square)
        values = ", ".join(f"{key} = {x:.4g}" for key, x in both.parameters.items())
        if fall > _NEEDED:
            sentence = (
                f"{best} and {name} together explain more: χ² falls by {fall:.3g} ({values})."
            )
            return "both", sentence
        if float(self.unexplained @ self.unexplained) - self.alone[i].chi_square < _NEEDED:
            sentence = f"{name} alone or beside {best} changes nothing that these readings show."
            return "idle", sentence
        if self.explains[i]:
            alike = [
                f" {warning}" for warning in both.warnings if warning.startswith("not identifiable")
            ]
            sentence = f"{best} or {name}: these readings do not tell which one."
            return "either", sentence + "".join(alike[:1])
        if fall < _NOTHING:
            return "exclusive", (
                f"{best} and {name} exclude each other: both act on these readings alone, but "
                f"beside {best} no part is left for {name} (χ² falls by {fall:.2g})."
            )
        r = both.correlation[0, 1]
        return "possible", (
            f"{name} beside {best} is possible, not needed: χ² falls by {fall:.3g}, less than "
            f"{_NEEDED} ({values}, correlated at {r:+.2f})."
        )

    def _labels(self) -> dict[str, Sequence[object]]:
        return {"explanation": self.names, "reading": self.alone[0].reading_names}


def compare_explanations(
    model_of: Callable[..., Manipulator],
    measurements: Sequence[Test],
    free: Mapping[str, tuple[float, float]],
    *,
    progress: bool = True,
) -> Explanations:
    """Compare parameters of an arm as single explanations of measurements.

    Each parameter alone is fitted as by :func:`identify`, then the best one together with each
    other one. A parameter explains the measurements if χ² is as small as the σ let expect. Two
    exclude each other if each one alone lowers χ², but the second one beside the best has no part.

    Args:
        model_of: As for :func:`identify`, but with a default for each parameter: it is called with
            one or two of them. :class:`~cdsm.ArmParameters` has the values of its arm.
        measurements: As for :func:`identify`; three independent readings or more.
        free: Bounds (low, high) of each parameter, such as ``{"slack": (0.0, 5e-3), "gain": (0.5,
            1.5)}``; two or more.
        progress: Show a bar on the standard error, if that is a terminal.

    Raises:
        InvalidInput: As for :func:`identify`; or ``model_of`` needs a parameter that is not given.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype(cdsm.LinearElasticity(48e3))
        >>> model = cdsm.ArmParameters(arm, ("rigidity", "lead"))
        >>> tests = [
        ...     cdsm.Measurement(along, axis, angles=(0.1,) * 10, minimum=5.0, std=100.0)
        ...     for axis, along in (("x", 275.2e3), ("y", 87.5e3), ("z", 89.7e3))
        ... ]
        >>> free = {"rigidity": (0.5, 2.0), "lead": (0.0, 1.0)}
        >>> explained = cdsm.compare_explanations(model, tests, free, progress=False)
        >>> print(str(explained).splitlines()[5])
        rigidity explains these measurements.
    """
    if not isinstance(free, Mapping) or len(free) < 2:
        raise InvalidInput("free", f"{free!r} given; give the bounds of two or more parameters.")
    check_measurements(measurements)
    if (count := independent_readings(measurements)) < 3:
        remedy = f"{plural(count, 'independent reading')} given; give at least three to compare."
        raise InvalidInput("measurements", remedy)
    as_it_is = _as_it_is(model_of, measurements)
    with progress_allowed(progress):
        parameters = show_progress(free, "fitting each parameter")
        fits = {
            name: fit_parameters(model_of, measurements, {name: free[name]}, other_starts=False)
            for name in parameters
        }
        names = sorted(free, key=lambda name: fits[name].chi_square)
        best = fits[names[0]]
        together = {
            name: _both(model_of, measurements, free, best, fits[name])
            for name in show_progress(names[1:], f"fitting others beside {names[0]}")
        }
    return Explanations(
        names=tuple(names),
        alone=tuple(fits[name] for name in names),
        together=together,
        unexplained=frozen(as_it_is),
    )


def _both(
    model_of: Callable[..., Manipulator],
    measurements: Sequence[Test],
    free: Mapping[str, tuple[float, float]],
    best: Identification,
    other: Identification,
) -> Identification:
    """Fit two parameters from the middle of the second one, or else from its own fit."""
    (a,) = best.names
    (b,) = other.names
    bounds = {a: free[a], b: free[b]}
    middle = other.problem.values(np.full(1, 0.5))[0]
    fits = list[Identification]()
    for start in (float(middle), other.parameters[b]):
        begin = best.parameters | {b: start}
        try:
            fits.append(fit_parameters(model_of, measurements, bounds, begin, other_starts=False))
        except InvalidInput:
            if start != middle:
                raise
        if fits and fits[-1].chi_square <= best.chi_square:
            break
    return min(fits, key=lambda fit: fit.chi_square)


def _as_it_is(model_of: Callable[..., Manipulator], measurements: Sequence[Test]) -> Array:
    try:
        arm = model_of()
    except TypeError as error:
        fault = f"has no default for a parameter ({error}); each one is freed alone."
        raise InvalidInput("model_of", fault) from error
    point = np.full(1, 0.5)
    problem = LeastSquares(lambda **_: arm, None, measurements, {"nothing": (0.0, 1.0)})
    if isinstance(reason := problem.predict(point), str):
        raise InvalidInput("model_of", f"the arm as it is has no prediction: {reason}")
    return problem.residuals(point)


def _verb(names: Sequence[str], one: str, many: str) -> str:
    return f"{listed(names)} {one if len(names) == 1 else many}"
