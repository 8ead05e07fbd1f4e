"""Identification of the parameters of an arm from stiffnesses measured on it.

    min Σ r_i²,   r_i = (K_i(p) − K_i) / σ_i,   low ≤ p ≤ high

with K_i measured, K_i(p) what the model with parameters p predicts by
:meth:`~cdsm.Stiffness.along` or, for a force that is not small, by
:func:`~cdsm.weight_test`, and σ_i the standard deviation of the measurement. The
parameters are whatever a constructor of the user's own takes: dimensions, masses, springs, leads.
Parameters that the measurements cannot tell apart are named in :attr:`Identification.warnings`.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput, UnknownName
from cdsm.identification.diagnosis import unfinished, warnings_of
from cdsm.identification.intervals import LowerOptimumError, Profile, Profiler
from cdsm.identification.least_squares import LeastSquares
from cdsm.identification.measurement import Measurement
from cdsm.identification.problem import StiffnessModel, UserFaultError
from cdsm.identification.result import Identification
from cdsm.manipulator import Manipulator
from cdsm.support.validation import (
    Array,
    frozen,
    scalar,
    sequence_of,
    vector,
)
from cdsm.tension import Tension

_ON_BOUND = 1e-9
"""A parameter this near to a bound, as part of their distance, is on it."""

_CANDIDATES, _STARTS = 24, 3
"""Points evaluated over the bounds, and how many of the best of them a search starts from."""

_COARSE, _FINE = (1e-10,) * 3, (1e-14,) * 3
"""ftol, xtol and gtol of the searches by one-sided and by central differences."""

_EVALUATIONS = 200
"""Most evaluations of a search, without those of the differences."""


def identify(
    model_of: Callable[..., Manipulator],
    measurements: Sequence[Measurement],
    free: Mapping[str, tuple[float, float]],
    *,
    start: Mapping[str, float] | None = None,
    tension_of: Callable[..., Tension | ArrayLike] | None = None,
) -> Identification:
    """Parameters p of an arm from measured stiffnesses: min Σ ((K_i(p) − K_i)/σ_i)² in bounds.

    K_i(p) = ``stiffness(arm.at(angles), tension, wrench).along(direction)`` with
    ``arm = model_of(**p)``; or, of a measurement with a ``force``, ``weight_test(arm.at(angles),
    tension, force, wrench=wrench).stiffness``. Where the model has no stable stiffness, buckles
    under the force, or a tension leaves the domain of an elasticity, the search turns back.

    A prediction of all measurements is what takes time. The search takes some 50 P of them, the
    profiles of :meth:`Identification.confidence` some 20 P². A measurement with a force takes ten
    times as long as one without, and more where the arm moves far.

    ::

        def model_of(hole_radius, drive):
            geometry = cdsm.presets.experimental_prototype_geometry(hole_radius=hole_radius)
            cables = cdsm.serpentine_cables(geometry, strand, series_stiffness=drive)
            return cdsm.Manipulator(geometry, cables=cables)

        found = cdsm.identify(
            model_of, measurements, free={"hole_radius": (0.02, 0.04), "drive": (1e3, 1e6)}
        )

    Args:
        model_of: Makes the arm from the free parameters, given by keyword.
        measurements: As many as there are parameters, or more.
        free: Bounds (low, high) of each parameter, in the unit that ``model_of`` takes it in.
            Positive ones a factor of 100 or more apart are searched by the logarithm.
        start: Where to start, one value for each parameter. If not given, the best of several
            searches spread over the bounds is taken, the same ones every time.
        tension_of: The tensions (C,) [N] or :class:`~cdsm.Tension` of a measurement, as
            ``tension_of(posture, measurement, **p)``, with all the free parameters. For parameters
            of the tensions, such as the offset of a load cell, which no arm holds; ``model_of``
            then gets all of them too. If not given, those of the measurement.

    Raises:
        InvalidInput: No measurements or fewer than parameters; bad bounds or start; ``model_of``
            fails or returns no arm; or no start gives every measurement a stable stiffness.
        UnknownName: A parameter that ``model_of`` or ``tension_of`` does not take.
    """
    measurements = sequence_of("measurements", measurements, Measurement)
    bounds = _checked_bounds(free)
    if len(measurements) < len(bounds):
        raise InvalidInput(
            "measurements",
            f"{len(measurements)} given for {len(bounds)} parameters, {', '.join(bounds)}; give at "
            "least as many, or free fewer parameters.",
        )
    _check_call("model_of", model_of, 0, tuple(bounds))
    if tension_of is not None:
        _check_call("tension_of", tension_of, 2, tuple(bounds))
    model = StiffnessModel(model_of, tension_of, measurements)
    problem = LeastSquares(model.residuals, len(measurements), bounds)
    try:
        best = _optimum(problem, _starts(problem, start))
        while True:
            try:
                return _result(model, problem, best)
            except LowerOptimumError as lower:  # a profile has led to a deeper valley
                best = min(_optimum(problem, [lower.point]), lower.point, key=problem.cost)
    except UserFaultError as fault:
        raise InvalidInput(
            fault.name,
            f"fails at {fault.at}: {fault.__cause__!r}. Mend it, narrow the bounds, or let it "
            "raise a CdsmError where there is no such arm.",
        ) from fault.__cause__


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
        # closer together, rounding would drown the differences the search lives on
        if not high - low > 1e-9 * max(abs(low), abs(high)):
            raise InvalidInput(
                f"free[{name!r}]",
                f"low = {low:g}, high = {high:g} given; low must be below high. What is known "
                "belongs into model_of.",
            )
        bounds[name] = (low, high)
    return bounds


def _check_call(name: str, function: object, positional: int, names: Sequence[str]) -> None:
    """Refuse a function that cannot be called with these parameters, before any search."""
    if not callable(function):
        raise InvalidInput(name, f"{function!r} given; a function is needed.")
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):  # some compiled functions have none
        return
    kinds = signature.parameters.values()
    if not any(each.kind is each.VAR_KEYWORD for each in kinds):
        by_keyword = (inspect.Parameter.KEYWORD_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
        known = [each.name for each in kinds if each.kind in by_keyword][positional:]
        for each in names:
            if each not in known:
                raise UnknownName(
                    f"parameter of {name}", each, known, f"Give {name} one of that name, or **rest."
                )
    try:
        signature.bind(*(None,) * positional, **dict.fromkeys(names))
    except TypeError as error:
        raise InvalidInput(
            name,
            f"cannot be called with {', '.join(names)} alone: {error}. Free that parameter too, or "
            "give it a default.",
        ) from None


def _starts(problem: LeastSquares, start: Mapping[str, float] | None) -> list[Array]:
    """Points of the unit cube to search from, at each of which the model has its stiffnesses."""
    count = len(problem.names)
    if start is None:
        from scipy.stats import qmc  # only where it is wanted: it imports slowly

        # Halton's first point is a corner
        spread = qmc.Halton(count, scramble=False).random(_CANDIDATES)[1:]
        points = [np.full(count, 0.5), *spread]
    else:
        points = [problem.box.point(_checked_start(problem, start))]
    # a search that starts on a bound may take it for the optimum
    points = [np.clip(point, 1e-6, 1.0 - 1e-6) for point in points]
    usable = [point for point in points if math.isfinite(problem.cost(point))]
    if usable:
        return sorted(usable, key=problem.cost)[:_STARTS]
    failure = problem.failure(points[0])
    assert failure is not None
    where = f"none of {len(points)} starts gives" if start is None else "does not give"
    raise InvalidInput(
        "free" if start is None else "start",
        f"{where} every measurement a stable stiffness. At {problem.describe(points[0])}, "
        f"{failure} Mend that, narrow the bounds, or give another start.",
    ) from failure.__cause__


def _checked_start(problem: LeastSquares, start: Mapping[str, float]) -> Array:
    if not isinstance(start, Mapping) or set(start) != set(problem.names):
        raise InvalidInput(
            "start", f"{start!r} given; one value for each of {', '.join(problem.names)} is needed."
        )
    values = np.array([scalar(f"start[{name!r}]", start[name]) for name in problem.names])
    for name, value, low, high in zip(
        problem.names, values, problem.box.low, problem.box.high, strict=True
    ):
        if not low <= value <= high:
            raise InvalidInput(
                f"start[{name!r}]", f"{value:g} is outside the bounds {low:g} to {high:g}."
            )
    return values


def _optimum(problem: LeastSquares, starts: Sequence[Array]) -> Array:
    found = [
        problem.search(point, method="trf", tolerances=_COARSE, most=_EVALUATIONS)
        for point in starts
    ]
    best = min(found, key=problem.cost)
    finer = problem.search(best, method="dogbox", tolerances=_FINE, most=_EVALUATIONS, central=True)
    best = min(finer, best, key=problem.cost)
    # rounding may leave it beside the bound it is on
    on_bound = np.where(best < _ON_BOUND, 0.0, np.where(best > 1.0 - _ON_BOUND, 1.0, best))
    return on_bound if math.isfinite(problem.cost(on_bound)) else best


def _result(model: StiffnessModel, problem: LeastSquares, best: Array) -> Identification:
    values = problem.parameters(best)
    arm, predicted = model.predict(values)
    jacobian = problem.jacobian(best, central=True)
    result = Identification(
        names=problem.names,
        values=frozen(np.array(list(values.values()))),
        bounds=frozen(problem.box.bounds),
        measurements=model.measurements,
        predicted=frozen(predicted),
        jacobian=frozen(jacobian / problem.box.derivative(best)),
        arm=arm,
        warnings=(),
        profiles=(),
    )
    result = replace(result, profiles=_profiles(problem, best, jacobian, result))
    return replace(result, warnings=(*warnings_of(result), *unfinished(problem, best, jacobian)))


def _profiles(
    problem: LeastSquares, best: Array, jacobian: Array, result: Identification
) -> tuple[Profile | None, ...]:
    """The profile of each parameter that is determined."""
    follow = [i for i in range(best.size) if i not in result._dependent]
    profiles: list[Profile | None] = []
    for i in range(best.size):
        if not math.isfinite(result.std[i]):
            profiles.append(None)
            continue
        others = [j for j in follow if j != i]
        profiler = Profiler(problem, best, jacobian, i, others, *result._goals)
        profiles.append(profiler.profile())
    return tuple(profiles)
