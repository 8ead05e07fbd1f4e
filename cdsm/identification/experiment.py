"""Plan weight tests that determine parameters of an arm, before anything is built or measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import CdsmError, InvalidInput
from cdsm.identification.design import Criterion, Design
from cdsm.identification.determination import Determination
from cdsm.identification.experiment_plan import ExperimentPlan
from cdsm.identification.least_squares import NoModelError
from cdsm.identification.loop import WeightLoop, up_and_down
from cdsm.identification.problem import Model, UserFaultError
from cdsm.identification.search import check_call
from cdsm.manipulator import Manipulator
from cdsm.support.directions import Direction, unit_directions
from cdsm.support.progress import progress_allowed, track
from cdsm.support.validation import number_array, one_of, scalar, whole_number
from cdsm.support.values import Array, frozen

_STEP = 1e-5  # relative change of a parameter for its central difference
_MOST = 5000  # largest number of candidates and of tests


def plan_experiment(
    model_of: Callable[..., Manipulator],
    parameters: Mapping[str, float],
    *,
    postures: ArrayLike,
    directions: Direction | Sequence[Direction],
    weights: ArrayLike,
    minimum: float | ArrayLike,
    tests: int,
    displacement_std: float,
    force_std: float = 0.0,
    tension_std: float = 0.0,
    steps: int = 4,
    wanted: Sequence[str] | None = None,
    known: Mapping[str, float] | None = None,
    criterion: Criterion = "D",
    progress: bool = True,
) -> ExperimentPlan:
    """Choose the weight tests that determine parameters of an arm best; see :func:`identify`.

    Each combination of posture, direction and weight is a candidate: a :class:`WeightLoop` from
    zero force to the weight and back. The plan gives the number of repetitions of each candidate.
    It minimises det C (D-optimal: the volume of the confidence region) or tr C (A-optimal: the sum
    of relative variances) of the covariance C of the wanted parameters. ``efficiency``
    of the plan is a proved bound on how much better another choice of as many tests could be.

    The plan uses derivatives at the expected values. If the identified values differ much from
    them, plan again.

    Args:
        model_of: Function that builds the arm from the parameters, as for :func:`identify`.
        parameters: Expected value of each parameter, not 0.
        postures: Candidate joint angles (n, nv) [rad].
        directions: Directions of the weights: names of axes, or (n, 3) in base axes.
        weights: Largest forces of the loops (n,) [N].
        minimum: Lower bound of the tensions before the test [N], one number or (C,).
        tests: Total number of loops, repetitions included.
        displacement_std: Standard deviation of a reading along the weight [m].
        force_std: Standard deviation of a force [N].
        tension_std: Standard deviation of each tension [N].
        steps: Number of steps from zero force to the largest.
        wanted: Names of the parameters to determine well; the others are unknown too, but the plan
            does not minimise their uncertainty. Default: all.
        known: Prior standard deviations of known parameters, by name, in the parameter's unit.
        criterion: ``"D"`` or ``"A"``.
        progress: Show a bar on the standard error, if that is a terminal.

    Raises:
        InvalidInput: An argument is invalid, or no candidate can be tested, or none determines the
            wanted parameters.
        UnknownName: ``model_of`` does not take a parameter, or a name in ``wanted`` or ``known`` is
            not among ``parameters``.
    """
    return plan_tests(
        model_of,
        parameters,
        _candidates(
            postures,
            directions,
            weights,
            steps,
            minimum=minimum,
            displacement_std=displacement_std,
            force_std=force_std,
            tension_std=tension_std,
        ),
        tests=tests,
        wanted=wanted,
        known=known,
        criterion=criterion,
        progress=progress,
    )


def plan_tests(
    model_of: Callable[..., Manipulator],
    parameters: Mapping[str, float],
    candidates: Sequence[WeightLoop],
    *,
    tests: int,
    wanted: Sequence[str] | None = None,
    known: Mapping[str, float] | None = None,
    criterion: Criterion = "D",
    progress: bool = True,
) -> ExperimentPlan:
    """Choose the tests that determine parameters best among the loops ``candidates``.

    The labels of the loops must differ. :func:`plan_experiment` explains the criterion, the other
    arguments and the errors.
    """
    values = _checked_parameters(parameters)
    check_call("model_of", model_of, 0, tuple(values))
    one_of("criterion", criterion, ("D", "A"))
    most = whole_number("tests", tests, 1, _MOST)
    names, chosen = tuple(values), _wanted(values, wanted, known or {})
    prior = _prior(values, known or {})
    with progress_allowed(progress):
        usable, rows, failures = _followed(model_of, values, candidates)
    whole = Determination(names, np.vstack([*rows, prior]), np.ones(len(names)))
    settled = [name for name in chosen if whole.is_determined[names.index(name)]]
    if not settled:
        raise InvalidInput(
            "wanted",
            f"no candidate determines {', '.join(chosen)}: no prediction changes with "
            f"{'; nor with '.join(whole.open_combinations)} (relative). Add other postures, "
            "directions or weights, or state what is known.",
        )
    basis = whole.coordinates
    design = Design(
        information=np.array([(J @ basis).T @ (J @ basis) for J in rows]),
        known=(prior @ basis).T @ (prior @ basis),
        wanted=basis[[names.index(name) for name in settled]],
        criterion=criterion,
        tests=most,
    )
    counts, efficiency = design.best()
    even = np.bincount(
        np.round(np.linspace(0, len(usable) - 1, most)).astype(int), minlength=len(usable)
    )
    M = design.total(counts)
    sensitivities = design.sensitivities(M)[0] if efficiency else np.zeros(len(usable))
    return ExperimentPlan(
        names=names,
        values=frozen(np.array(list(values.values()))),
        wanted=chosen,
        criterion=criterion,
        candidates=usable,
        counts=frozen(counts.astype(np.intp)),
        even=frozen(even.astype(np.intp)),
        jacobians=tuple(frozen(J) for J in rows),
        known=frozen(prior),
        efficiency=efficiency,
        sensitivities=frozen(sensitivities / max(sensitivities.max(), 1e-300)),
        open_combinations=tuple(whole.open_combinations),
        failures=failures,
    )


def _checked_parameters(parameters: Mapping[str, float]) -> dict[str, float]:
    if not isinstance(parameters, Mapping) or not parameters:
        raise InvalidInput(
            "parameters", f"{parameters!r} given; give {{name: expected value}} for at least one."
        )
    values = {name: scalar(f"parameters[{name!r}]", x) for name, x in parameters.items()}
    for name, value in values.items():
        if value == 0.0:
            raise InvalidInput(
                f"parameters[{name!r}]",
                "0 given; intervals are judged relative to the expected value. Give a small one.",
            )
    return values


def _wanted(
    values: dict[str, float], wanted: Sequence[str] | None, known: Mapping[str, float]
) -> tuple[str, ...]:
    """Return the names of the parameters to determine: ``wanted``, or all if None.

    Raises UnknownName if ``wanted`` or ``known`` has a name that is not in ``values``, InvalidInput
    if ``wanted`` is empty.
    """
    chosen = tuple(values) if wanted is None else tuple(wanted)
    for kind, given in (("wanted", chosen), ("known", known)):
        for name in given:
            one_of(f"parameter in {kind}", name, values, "Name one of the arm.")
    if not chosen:
        raise InvalidInput("wanted", "names no parameter; leave it out for all of them.")
    return chosen


def _prior(values: dict[str, float], known: Mapping[str, float]) -> Array:
    """Return the prior knowledge as rows of a Jacobian, a diagonal matrix (P, P) [-].

    The entry of a parameter p is |p|/σ if p is known with the standard deviation σ, else 0.
    """
    weights = dict.fromkeys(values, 0.0)
    for name, std in known.items():
        if not (sigma := scalar(f"known[{name!r}]", std)) > 0.0:
            raise InvalidInput(f"known[{name!r}]", f"{sigma:g} given; it must be positive.")
        weights[name] = abs(values[name]) / sigma
    return np.diag(list(weights.values()))


def _followed(
    model_of: Callable[..., Manipulator], values: dict[str, float], candidates: Sequence[WeightLoop]
) -> tuple[tuple[WeightLoop, ...], list[Array], tuple[tuple[str, str], ...]]:
    """Compute the derivatives of the readings of all candidates.

    Returns the loops that can be tested, their derivatives (see :func:`_rows`), and a pair (label
    of the loop, text of the error) for each loop that cannot be tested. Raises InvalidInput if no
    loop can be tested.
    """
    rows, failures = list[Array](), dict[str, str]()
    for loop in track(candidates, "following the candidates"):
        try:
            rows.append(_rows(model_of, values, loop))
        except (CdsmError, NoModelError) as error:
            failures[loop.label] = str(error)
        except UserFaultError as fault:
            raise fault.args[0] from fault.__cause__
    usable = tuple(loop for loop in candidates if loop.label not in failures)
    if not usable:
        label, reason = next(iter(failures.items()))
        raise InvalidInput(
            "postures",
            f"none of {len(failures)} candidates can be tested. {label}: {reason} Choose other "
            "postures, lighter weights or higher tensions.",
        )
    return usable, rows, tuple(failures.items())


def _candidates(
    postures: ArrayLike,
    directions: Direction | Sequence[Direction],
    weights: ArrayLike,
    steps: int,
    **shared: Any,
) -> list[WeightLoop]:
    """Return a loop for each posture, direction and weight; ``shared`` are its other fields."""
    angles, forces = number_array("postures", postures), number_array("weights", weights, "force")
    if angles.ndim != 2 or not angles.size:
        raise InvalidInput(
            "postures", f"shape {angles.shape} given; (n, nv) joint angles [rad] are needed."
        )
    if forces.ndim != 1 or not forces.size or forces.min() <= 0.0:
        raise InvalidInput("weights", f"{weights!r} given; positive forces (n,) [N] are needed.")
    if len(forces) * len(angles) > _MOST:
        raise InvalidInput("postures", f"more than {_MOST} candidates; give fewer.")
    shared["minimum"] = number_array("minimum", shared["minimum"])
    count = whole_number("steps", steps, 1, 100)
    axes = np.atleast_2d(unit_directions("directions", directions))
    return [
        WeightLoop(
            label=f"posture {i + 1}, {_named(u)}, {force:g} N",
            angles=tuple(q.tolist()),
            direction=tuple(u.tolist()),
            forces=up_and_down(force, count),
            **shared,
        )
        for i, q in enumerate(angles)
        for u in axes
        for force in forces.tolist()
    ]


def _named(u: Array) -> str:
    """Write the direction ``u`` (3,) as text: the name of its axis, or its components."""
    axis = int(abs(u).argmax())
    if abs(u[axis]) == 1.0:
        return ("" if u[axis] > 0.0 else "-") + "xyz"[axis]
    return "(" + " ".join(f"{x:.2g}" for x in u) + ")"


def _rows(
    model_of: Callable[..., Manipulator], values: dict[str, float], loop: WeightLoop
) -> Array:
    """Compute ∂r/∂ln p (m, P) of one planned loop by central differences.

    r are the residuals of its m readings in standard deviations, p the parameters ``values`` of
    ``model_of``.
    """
    exact = loop.simulated(Model.of(model_of, None, (loop,)).arm(values))
    model = Model.of(model_of, None, (exact,)).weighted(values)
    columns = []
    for name, value in values.items():
        near, far = (
            model.residuals_beside(values, values | {name: value * (1.0 + s * _STEP)})
            for s in (1.0, -1.0)
        )
        columns.append((near - far) / (2.0 * _STEP))
    return np.column_stack(columns)
