"""Identify parameters of an arm from what is measured on it, by least squares."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

import numpy as np

from cdsm.arm_parameters import ArmParameters
from cdsm.errors import InvalidInput
from cdsm.identification.least_squares import LeastSquares, TensionOf, Test
from cdsm.identification.measurement import Measurement, measurement_name
from cdsm.identification.result import Identification, independent_readings
from cdsm.identification.tip_position import TipPosition
from cdsm.identification.weight_loop import WeightLoop
from cdsm.manipulator import Manipulator
from cdsm.support.determination import likely
from cdsm.support.format import plural
from cdsm.support.progress import progress_allowed
from cdsm.support.validation import scalar, vector
from cdsm.support.values import Array, frozen

_OTHER_STARTS = 6  # points from which the search is tried where χ² is refused
_SEARCHED = 2  # of them from which it is finished
_NEAR = 1e-3  # an optimum this near to a bound is tried on it: the search only approaches bounds


def identify(
    model_of: Callable[..., Manipulator],
    measurements: Sequence[Test],
    free: Mapping[str, tuple[float, float]],
    *,
    start: Mapping[str, float] | None = None,
    tension_of: TensionOf | None = None,
    progress: bool = True,
) -> Identification:
    """Identify P parameters p of an arm within bounds: `min Σ ((K_i(p) − K_i)/σ_i)²`.

    With ``arm = model_of(**p)``, the prediction `K_i(p)` is ``stiffness(arm.at(angles), tension,
    wrench).along(direction)``. For a measurement with a ``force`` it is ``weight_test(
    arm.at(angles), tension, force, wrench=wrench).stiffness``. The search shortens a step that
    leads to an unstable arm, to one that buckles under the force, or to a tension outside the
    domain of a law.

    A :class:`WeightLoop` is predicted as by :func:`~cdsm.load_cycle`, with friction and history, so
    its width determines the friction. The coordinates of a :class:`TipPosition` are predicted as by
    :func:`~cdsm.forward_statics`.

    The search (``least_squares`` of scipy) predicts all measurements about 10 P times. A
    measurement with a force takes ten times as long as one without; a loop with friction takes tens
    of milliseconds: the search for its equilibria begins at those of the last point. With loops the
    search ends where χ² falls by less than 1e-4 of itself.

    Args:
        model_of: Function that builds the arm from the free parameters (dimensions, masses,
            springs, leads, …), given by keyword; or :class:`~cdsm.ArmParameters`.
        measurements: Stiffnesses, loops and positions of the tip. They have at least as many
            numbers as there are parameters; a loop of n forces has n − 1 per axis, since its
            offset is unknown.
        free: Bounds (low, high) of each parameter, in the unit in which ``model_of`` takes it. If
            they are positive and a factor of 100 or more apart, the search is logarithmic.
        start: First values of some or all parameters. Default: where ``model_of`` is an
            :class:`~cdsm.ArmParameters`, the value of its arm, or a friction of 0.1 if the arm has
            none; else, and where that is outside the bounds, the middle of the bounds. A search
            ends in the nearest minimum. Where a right model would leave so large a χ² in less than
            one of 1000 experiments, the search is repeated from other points, and the least χ²
            counts.
        tension_of: Function ``tension_of(posture, measurement, **p)`` that returns the tensions
            (C,) [N] or a :class:`~cdsm.Tension`, for example with the offset of a load cell as a
            parameter. Both ``tension_of`` and ``model_of`` get all free parameters. The default is
            the tensions of the measurement. It is not asked for positions of the tip.
        progress: Show a bar on the standard error, if that is a terminal.

    Raises:
        InvalidInput: There are no measurements or fewer than parameters; bounds or start are
            invalid; ``model_of`` or ``tension_of`` fails or does not take a parameter; or the start
            does not give every measurement a stable prediction; or a position is far outside the
            arm, as in mm.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype(cdsm.LinearElasticity(48e3))
        >>> model = cdsm.ArmParameters(arm, ("rigidity",))
        >>> tests = [cdsm.Measurement(87.5e3, "y", angles=(0.1,) * 10, minimum=5.0, std=100.0)]
        >>> identified = cdsm.identify(model, tests, {"rigidity": (0.5, 2.0)}, progress=False)
        >>> print(f"EA times {identified.values[0]:.3f}")
        EA times 0.900
    """
    with progress_allowed(progress):
        return fit_parameters(model_of, measurements, free, start, tension_of, other_starts=True)


def fit_parameters(
    model_of: Callable[..., Manipulator],
    measurements: Sequence[Test],
    free: Mapping[str, tuple[float, float]],
    start: Mapping[str, float] | None = None,
    tension_of: TensionOf | None = None,
    *,
    other_starts: bool,
) -> Identification:
    """Fit parameters as :func:`identify` does; without ``other_starts`` a refused χ² is kept."""
    check_measurements(measurements)
    function: object = tension_of
    if not (function is None or callable(function)):
        wanted = "give a function of posture, measurement and parameters."
        raise InvalidInput("tension_of", f"{tension_of!r} given; {wanted}")
    bounds = _checked_bounds(free)
    informative = independent_readings(measurements)
    if informative < len(bounds):
        raise InvalidInput(
            "measurements",
            f"{plural(informative, 'independent reading')} given for "
            f"{plural(len(bounds), 'parameter')}, {', '.join(bounds)}; give at least as many, or "
            "free fewer parameters. A stiffness or a coordinate counts as one, a loop as its "
            "readings minus one, as its offset is unknown.",
        )
    if isinstance(model_of, ArmParameters):
        for name in set(bounds) & set(model_of.names):
            model_of.require_arms(name, *bounds[name])
    problem = LeastSquares(model_of, tension_of, measurements, bounds)
    first = _start(problem, start)
    with problem.counted("identifying parameters: predictions"):
        best = _optimum(problem, first)
        if other_starts and not likely(problem.cost(best), informative - best.size):
            best = _least_of_other_starts(problem, best)
        jacobian = problem.jacobian(best, central=True)
        if problem.has_loops and _unfinished(problem, best, jacobian):
            best = _optimum(problem, best)  # where χ² is large, a small part of it is not small
            jacobian = problem.jacobian(best, central=True)
        prediction = problem.predict(best)
    assert not isinstance(prediction, str)
    r = problem.weighed(prediction.numbers)
    measured = np.concatenate([measurement.readings for measurement in measurements])
    pairs = zip(measurements, prediction.numbers, strict=True)
    errors = np.concatenate([measurement.errors(numbers)[0] for measurement, numbers in pairs])
    return Identification(
        names=problem.names,
        values=frozen(problem.values(best)),
        bounds=frozen(np.column_stack([problem.low, problem.high])),
        measurements=problem.measurements,
        predicted=frozen(measured + errors),
        residuals=frozen(r),
        jacobian=frozen(jacobian / problem.slope(best)),
        arm=prediction.arm,
        unfinished=_unfinished(problem, best, jacobian),
        problem=problem,
    )


def check_measurements(measurements: object) -> None:
    """Raise InvalidInput if these are no measurements, or planned ones without readings."""
    kinds = Measurement | WeightLoop | TipPosition
    if not isinstance(measurements, list | tuple) or not all(
        isinstance(measurement, kinds) for measurement in measurements
    ):
        remedy = "a list or tuple of Measurement, TipPosition and WeightLoop is needed."
        raise InvalidInput("measurements", f"{measurements!r} given; {remedy}")
    for i, measurement in enumerate(measurements):
        if isinstance(measurement, WeightLoop) and measurement.displacements is None:
            remedy = f"{measurement.label or 'the loop'} has no readings yet; give its "
            remedy += "displacements [m], as with dataclasses.replace(loop, displacements=…)."
            raise InvalidInput(f"measurements[{i}]", remedy)


def _checked_bounds(free: object) -> dict[str, tuple[float, float]]:
    if not isinstance(free, Mapping) or not free:
        remedy = "give {name: (low, high)} for at least one parameter."
        raise InvalidInput("free", f"{free!r} given; {remedy}")
    bounds = {}
    for name, limits in free.items():
        low, high = vector(f"free[{name!r}]", limits, 2, "the bounds (low, high)").tolist()
        # within closer bounds, rounding would hide the finite differences
        if not high - low > 1e-9 * max(abs(low), abs(high)):
            remedy = "low must be below high. A parameter whose value is known is not free."
            raise InvalidInput(f"free[{name!r}]", f"low = {low:g}, high = {high:g} given; {remedy}")
        bounds[name] = (low, high)
    return bounds


def _start(problem: LeastSquares, start: Mapping[str, float] | None) -> Array:
    """Return the point (P,) where the search begins, which has a prediction."""
    begin = {} if start is None else start
    if not isinstance(begin, Mapping) or not set(begin) <= set(problem.names):
        needed = f"values by name are needed; free are {', '.join(problem.names)}."
        raise InvalidInput("start", f"{start!r} given; {needed}")
    values = problem.values(np.full(len(problem.names), 0.5))
    model = problem.model_of
    for i, parameter in enumerate(problem.names):
        low = float(problem.low[i])
        high = float(problem.high[i])
        if parameter in begin:
            values[i] = value = scalar(f"start[{parameter!r}]", begin[parameter])
            if not low <= value <= high:
                fault = f"{value:g} is outside the bounds {low:g} to {high:g}."
                raise InvalidInput(f"start[{parameter!r}]", fault)
        elif isinstance(model, ArmParameters):
            typical = model.start(parameter, low, high)
            values[i] = values[i] if typical is None else typical
    point = np.clip(problem.point(values), 0.0, 1.0)
    name = "it" if begin else "the default start"
    reason = problem.predict(point)
    if isinstance(reason, str):
        fault = f"{name} does not give every measurement a stable prediction. At "
        fault += f"{problem.describe(point)}, {reason} Correct that, or give another start."
        raise InvalidInput("start", fault)
    for i, test in enumerate(problem.measurements):
        if isinstance(test, TipPosition):
            test.require_near(reason.arm, measurement_name(i, test.label))
    return point


def _optimum(problem: LeastSquares, start: Array) -> Array:
    """Search from ``start`` (P,) for the least χ²; the search alone only approaches bounds."""
    best = problem.search(start)
    free = np.ones(best.size, dtype=bool)
    for i in np.flatnonzero(np.minimum(best, 1.0 - best) < _NEAR):
        free[i] = False
        trial = best.copy()
        trial[i] = round(best[i])
        if free.any() and math.isfinite(problem.cost(trial)):
            trial = problem.search(trial, np.flatnonzero(free))
        if problem.cost(trial) <= problem.cost(best):
            best = trial
        else:
            free[i] = True
    return best


def _least_of_other_starts(problem: LeastSquares, best: Array) -> Array:
    """Search from other points of the bounds; return the point of least χ² of these and ``best``.

    Each point is improved by one Gauss–Newton step, and the search continues from the two best.
    """
    edge = problem.edge
    improved = list[Array]()
    for point in _spread(best.size):
        with suppress(InvalidInput):  # the model may end at this point
            if math.isfinite(problem.cost(point)):
                improved.append(_gauss_newton(problem, point))
    least = best
    for point in sorted(improved, key=problem.cost)[:_SEARCHED]:
        least = min(least, _optimum(problem, point), key=problem.cost)
    if least is best:
        problem.edge = edge
    return least


def _spread(size: int) -> Array:
    """Return points (n, P) that are spread evenly within the bounds: Halton's sequence."""
    from scipy.stats import qmc  # slow to import

    points = qmc.Halton(size, scramble=False).random(_OTHER_STARTS + 1)[1:]
    return np.asarray(points)


def _gauss_newton(problem: LeastSquares, point: Array) -> Array:
    """Return the point after one Gauss–Newton step within the bounds, if χ² is less there."""
    jacobian = problem.jacobian(point)
    step = np.linalg.lstsq(jacobian, -problem.residuals(point), rcond=1e-6)[0]
    there = np.clip(point + step, 0.0, 1.0)
    return min(point, there, key=problem.cost)


def _unfinished(problem: LeastSquares, best: Array, jacobian: Array) -> str:
    """Return a warning if a search ended before a minimum of χ², else an empty text."""
    r = problem.residuals(best)
    gradient = r @ jacobian
    free = ~(((best == 0.0) & (gradient >= 0.0)) | ((best == 1.0) & (gradient <= 0.0)))
    step = np.linalg.lstsq(jacobian[:, free], -r, rcond=1e-6)[0] if free.any() else np.zeros(0)
    fall = float(np.sum((jacobian[:, free] @ step) ** 2))
    if fall < (1e-2 if problem.has_rests else 1e-3):  # of χ²; a standard deviation is 1
        return ""
    edge = (
        f"The model ended last at {problem.edge}"
        if problem.edge
        else "Give other bounds, or another start."
    )
    return (
        f"no optimum within the bounds: χ² would still fall by about {fall:.3g} on the way from "
        f"{problem.describe(best)}. {edge}"
    )
