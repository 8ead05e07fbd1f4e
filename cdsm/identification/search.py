"""Identify the parameters of an arm from measured stiffnesses and load loops, by least squares."""

from __future__ import annotations

import inspect
import logging
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.identification.diagnosis import lower_elsewhere, unfinished, warnings_of
from cdsm.identification.intervals import LowerOptimumError, Profile, Profiler
from cdsm.identification.least_squares import LeastSquares
from cdsm.identification.loop import WeightLoop
from cdsm.identification.measurement import Measurement
from cdsm.identification.problem import Model, UserFaultError, problem_of
from cdsm.identification.result import Identification
from cdsm.manipulator import Manipulator
from cdsm.support.format import plural
from cdsm.support.progress import progress_allowed, track
from cdsm.support.validation import one_of, scalar, vector
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension

_log = logging.getLogger("cdsm")

_ON_BOUND = 1e-9  # a parameter this near to a bound (share of the range) counts as on the bound

_COARSE, _FINE = (1e-10,) * 3, (1e-14,) * 3
"""ftol, xtol and gtol of the searches with one-sided and with central differences."""

_OF_LOOPS = (1e-6, 1e-8, 1e-8)  # ftol, xtol and gtol of searches with loops, whose χ² is less exact

_EVALUATIONS = 200  # largest number in a search, without those of the differences


def identify(
    model_of: Callable[..., Manipulator],
    measurements: Sequence[Measurement | WeightLoop],
    free: Mapping[str, tuple[float, float]],
    *,
    start: Mapping[str, float] | None = None,
    tension_of: Callable[..., Tension | ArrayLike] | None = None,
    progress: bool = True,
) -> Identification:
    """Identify P parameters p of an arm within bounds: min Σ ((K_i(p) − K_i)/σ_i)².

    With ``arm = model_of(**p)``, the prediction K_i(p) is ``stiffness(arm.at(angles), tension,
    wrench).along(direction)``. For a measurement with a ``force`` it is ``weight_test(
    arm.at(angles), tension, force, wrench=wrench).stiffness``. The search shortens a step that
    leads to an unstable arm, to one that buckles under the force, or to a tension outside the
    domain of a law.

    A :class:`WeightLoop` is predicted as by :func:`~cdsm.load_cycle`, with friction and history, so
    its width determines the friction.

    The search predicts all measurements about 50 P times, the profiles of
    :meth:`Identification.confidence` about 20 P² times. A measurement with a force takes ten times
    as long as one without; a loop takes tens of milliseconds.

    ::

        def model_of(hole_radius, drive):
            geometry = cdsm.presets.experimental_prototype_geometry(hole_radius=hole_radius)
            cables = cdsm.serpentine_cables(geometry, strand, series_stiffness=drive)
            return cdsm.Manipulator(geometry, cables=cables)

        found = cdsm.identify(
            model_of, measurements, free={"hole_radius": (0.02, 0.04), "drive": (1e3, 1e6)}
        )

    Args:
        model_of: Function that builds the arm from the free parameters (dimensions, masses,
            springs, leads, …), given by keyword.
        measurements: Stiffnesses and loops. They have at least as many numbers as there are
            parameters; a loop of n forces has n − 1 per axis, since its offset is unknown.
        free: Bounds (low, high) of each parameter, in the unit in which ``model_of`` takes it. If
            they are positive and a factor of 100 or more apart, the search is logarithmic.
        start: First value of each parameter; by default the middle of its bounds. The search ends
            in the nearest minimum: give a start near the values that you expect.
        tension_of: Function ``tension_of(posture, measurement, **p)`` that returns the tensions
            (C,) [N] or a :class:`~cdsm.Tension`, for example with the offset of a load cell as a
            parameter. Both ``tension_of`` and ``model_of`` get all free parameters. The default is
            the tensions of the measurement.
        progress: Show a bar on the standard error, if that is a terminal.

    Raises:
        InvalidInput: There are no measurements or fewer than parameters; bounds or start are
            invalid; ``model_of`` fails or does not return an arm; or the start does not give every
            measurement a stable stiffness.
        UnknownName: ``model_of`` or ``tension_of`` does not take a parameter.
    """
    measurements = _checked_measurements(measurements)
    bounds = _checked_bounds(free)
    count = sum(each.informative if isinstance(each, WeightLoop) else 1 for each in measurements)
    if count < len(bounds):
        raise InvalidInput(
            "measurements",
            f"{plural(count, 'independent reading')} given for "
            f"{plural(len(bounds), 'parameter')}, {', '.join(bounds)}; give at least as many, or "
            "free fewer parameters. A stiffness counts as one, a loop as its readings minus one, "
            "since its offset is unknown.",
        )
    check_call("model_of", model_of, 0, tuple(bounds))
    if tension_of is not None:
        check_call("tension_of", tension_of, 2, tuple(bounds))
    model = Model(model_of, tension_of, measurements)
    problem = problem_of(model, bounds)
    try:
        with progress_allowed(progress):
            best = _optimum(problem, _start(problem, start))
            return _result(model, problem, best)
    except UserFaultError as fault:
        raise fault.args[0] from fault.__cause__


def _checked_measurements(
    measurements: Sequence[Measurement | WeightLoop],
) -> tuple[Measurement | WeightLoop, ...]:
    kinds = Measurement | WeightLoop
    listed = isinstance(measurements, list | tuple)
    if not listed or not all(isinstance(each, kinds) for each in measurements):
        raise InvalidInput(
            "measurements",
            f"{measurements!r} given; a list or tuple of Measurement and WeightLoop is needed.",
        )
    for i, each in enumerate(measurements):
        if isinstance(each, WeightLoop) and each.displacements is None:
            raise InvalidInput(
                f"measurements[{i}]",
                f"{each.label or 'the loop'} has no readings yet; give its displacements [m], as "
                "with dataclasses.replace(loop, displacements=…).",
            )
    return tuple(measurements)


def _checked_bounds(free: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    if not isinstance(free, Mapping) or not free:
        raise InvalidInput(
            "free", f"{free!r} given; give {{name: (low, high)}} for at least one parameter."
        )
    bounds = {}
    for name, limits in free.items():
        if not isinstance(name, str):
            raise InvalidInput("free", f"{name!r} is no name of a parameter.")
        low, high = vector(f"free[{name!r}]", limits, 2, "the bounds (low, high)").tolist()
        # within closer bounds, rounding would hide the finite differences
        if not high - low > 1e-9 * max(abs(low), abs(high)):
            raise InvalidInput(
                f"free[{name!r}]",
                f"low = {low:g}, high = {high:g} given; low must be below high. A parameter whose "
                "value is known is not free.",
            )
        bounds[name] = (low, high)
    return bounds


def check_call(name: str, function: object, positional: int, names: Sequence[str]) -> None:
    """Raise UnknownName or InvalidInput if ``function`` cannot be called with these arguments.

    They are ``positional`` positional arguments, and one keyword argument for each of ``names``.
    The error calls the function ``name``.
    """
    if not callable(function):
        raise InvalidInput(name, f"{function!r} given; a function is needed.")
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # some compiled functions have no signature
        return
    kinds = signature.parameters.values()
    if not any(each.kind is each.VAR_KEYWORD for each in kinds):
        by_keyword = (inspect.Parameter.KEYWORD_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
        known = [each.name for each in kinds if each.kind in by_keyword][positional:]
        for each in names:
            remedy = f"Give {name} one of that name, or **rest."
            one_of(f"parameter of {name}", each, known, remedy)
    try:
        signature.bind(*(None,) * positional, **dict.fromkeys(names))
    except TypeError as error:
        raise InvalidInput(
            name,
            f"cannot be called with {', '.join(names)} alone: {error}. Free that parameter too, or "
            "give it a default.",
        ) from None


def _start(problem: LeastSquares, start: Mapping[str, float] | None) -> Array:
    """Return ``start``, or the middle of the bounds, as a point (P,) of the unit cube."""
    if start is None:
        point = np.full(len(problem.names), 0.5)
    else:
        point = problem.box.point(_checked_start(problem, start))
    if (failure := problem.failure(point)) is not None:
        name = "the middle of the bounds" if start is None else "it"
        raise InvalidInput(
            "start",
            f"{name} does not give every measurement a stable prediction. At "
            f"{problem.describe(point)}, {failure} Correct that, or give another start.",
        ) from failure.__cause__
    return point


def _checked_start(problem: LeastSquares, start: Mapping[str, float]) -> Array:
    if not isinstance(start, Mapping) or set(start) != set(problem.names):
        raise InvalidInput(
            "start", f"{start!r} given; one value for each of {', '.join(problem.names)} is needed."
        )
    values = np.array([scalar(f"start[{name!r}]", start[name]) for name in problem.names])
    for name, value, (low, high) in zip(problem.names, values, problem.box.bounds, strict=True):
        if not low <= value <= high:
            raise InvalidInput(
                f"start[{name!r}]", f"{value:g} is outside the bounds {low:g} to {high:g}."
            )
    return values


def _optimum(problem: LeastSquares, start: Array) -> Array:
    """Search from ``start`` (P,) for the minimum of χ², in the unit cube."""
    coarse, fine = (_OF_LOOPS, _OF_LOOPS) if problem.rough else (_COARSE, _FINE)
    first = problem.search(start, method="trf", tolerances=coarse, most=_EVALUATIONS)
    finer = problem.search(first, method="dogbox", tolerances=fine, most=_EVALUATIONS, central=True)
    best = min(finer, first, key=problem.cost)
    # rounding may leave an optimum beside its bound
    on_bound = np.where(best < _ON_BOUND, 0.0, np.where(best > 1.0 - _ON_BOUND, 1.0, best))
    return on_bound if math.isfinite(problem.cost(on_bound)) else best


def _result(model: Model, problem: LeastSquares, best: Array) -> Identification:
    """Build the result at the optimum ``best`` (P,), in the unit cube."""
    values = problem.parameters(best)
    arm, predicted = model.predict(values)
    jacobian = problem.jacobian(best, central=True)
    result = Identification(
        names=problem.names,
        values=frozen(np.array(list(values.values()))),
        bounds=frozen(problem.box.bounds),
        measurements=model.measurements,
        predicted=frozen(model.with_offsets(predicted)),
        residuals=frozen(model.weigh(predicted)),
        jacobian=frozen(jacobian / problem.box.derivative(best)),
        arm=arm,
        warnings=(),
        profiles=(),
    )
    follow = [j for j in range(best.size) if j not in result._determination.to_fix]
    profiles, refuted = list[Profile | None](), unfinished(problem, best, jacobian)
    try:
        for i in track(range(best.size), "finding the confidence of the parameters"):
            others = [j for j in follow if j != i]
            profiler = Profiler(problem, best, jacobian, i, others, *result._goals)
            profiles.append(profiler.profile() if math.isfinite(result.std[i]) else None)
    except LowerOptimumError as lower:
        refuted += lower_elsewhere(problem, best, lower.point)
    result = replace(result, profiles=(None,) * best.size if refuted else tuple(profiles))
    return replace(result, warnings=(*warnings_of(result), *refuted))
