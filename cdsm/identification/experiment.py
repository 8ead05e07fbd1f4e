"""Plan weight tests that determine parameters of an arm, before anything is built or measured."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import CdsmError, InvalidInput
from cdsm.identification.determination import Determination
from cdsm.identification.experiment_plan import ExperimentPlan
from cdsm.identification.least_squares import NoModelError
from cdsm.identification.loop import WeightLoop, up_and_down
from cdsm.identification.problem import Model, UserFaultError
from cdsm.identification.search import check_call
from cdsm.manipulator import Manipulator
from cdsm.support.directions import Direction, unit_directions
from cdsm.support.progress import progress_allowed, track
from cdsm.support.validation import number_array, scalar, whole_number
from cdsm.support.values import Array, frozen

_STEP = 1e-4  # relative change of a parameter for its central difference
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
    steps: int = 4,
    progress: bool = True,
) -> ExperimentPlan:
    """Choose the weight tests that determine parameters of an arm best; see :func:`identify`.

    Each combination of posture, direction and weight is a candidate: a :class:`WeightLoop` from
    zero force to the weight and back. The plan gives the number of repetitions of each candidate.
    One test after the other is added, each time the one that reduces det C of the covariance C of
    the parameters most (D-optimal; det C is the squared volume of their confidence region). Such a
    plan is good, not proved the best.

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
        steps: Number of steps from zero force to the largest.
        progress: Show a bar on the standard error, if that is a terminal.

    Raises:
        InvalidInput: An argument is invalid, or no candidate can be tested, or none determines any
            parameter.
        UnknownName: ``model_of`` does not take a parameter.
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
        ),
        tests=tests,
        progress=progress,
    )


def plan_tests(
    model_of: Callable[..., Manipulator],
    parameters: Mapping[str, float],
    candidates: Sequence[WeightLoop],
    *,
    tests: int,
    progress: bool = True,
) -> ExperimentPlan:
    """Choose the tests that determine parameters best among the loops ``candidates``.

    The labels of the loops must differ. :func:`plan_experiment` explains the criterion, the other
    arguments and the errors.
    """
    values = _checked_parameters(parameters)
    check_call("model_of", model_of, 0, tuple(values))
    most = whole_number("tests", tests, 1, _MOST)
    names = tuple(values)
    with progress_allowed(progress):
        usable, rows, failures = _followed(model_of, values, candidates)
    whole = Determination(names, np.vstack(rows), np.ones(len(names)))
    if not whole.rank:
        raise InvalidInput(
            "parameters",
            f"no candidate determines {', '.join(names)}. Add other postures, directions or "
            "weights.",
        )
    basis = whole.coordinates
    counts = greedy(np.array([(J @ basis).T @ (J @ basis) for J in rows]), most)
    return ExperimentPlan(
        names=names,
        values=frozen(np.array(list(values.values()))),
        candidates=usable,
        counts=frozen(counts),
        jacobians=tuple(frozen(J) for J in rows),
        open_combinations=tuple(whole.open_combinations),
        failures=failures,
    )


def greedy(information: Array, tests: int) -> NDArray[np.intp]:
    """Choose ``tests`` of n candidates, repeated or not, one after the other; return counts (n,).

    ``information`` (n, r, r) are the Fisher informations of the candidates for r parameters. Each
    choice has the largest determinant of their sum, which starts from almost nothing.
    """
    total = 1e-9 * information.sum(axis=0)
    counts = np.zeros(len(information), dtype=np.intp)
    for _ in range(tests):
        best = int(np.linalg.slogdet(total + information)[1].argmax())
        total = total + information[best]
        counts[best] += 1
    return counts


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
    exact = loop.simulated(Model(model_of, None, (loop,)).arm(values))
    model = Model(model_of, None, (exact,))
    columns = []
    for name, value in values.items():
        near, far = (
            model.residuals(values | {name: value * (1.0 + s * _STEP)}) for s in (1.0, -1.0)
        )
        columns.append((near - far) / (2.0 * _STEP))
    return np.column_stack(columns)
