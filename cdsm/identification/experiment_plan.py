"""Plan weight tests that determine parameters of an arm, before anything is built or measured."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import InvalidInput
from cdsm.identification.least_squares import LeastSquares
from cdsm.identification.weight_loop import WeightLoop
from cdsm.manipulator import Manipulator
from cdsm.support.determination import Determination, interval_in_percent
from cdsm.support.format import aligned, coordinates
from cdsm.support.progress import show_progress
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import (
    AXES,
    Direction,
    number_array,
    scalar,
    unit_directions,
    whole_number,
)
from cdsm.support.values import Array, Plotted, frozen

_TESTS = 10_000  # at most


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ExperimentPlan(Result, Plotted):
    """Weight tests that determine parameters of an arm best; made by :func:`plan_experiment`.

    There are n candidates and P parameters. All arrays are read-only.

    Attributes:
        names: Names of the parameters, in the order of every (P,) array.
        values: Expected values (P,), each in its own unit.
        candidates: The candidates that can be tested.
        counts: Number of repetitions of each candidate (n,).
        jacobians: One matrix [-] for each candidate, with a row (P,) for each of its readings: the
            derivatives of the reading, in standard deviations, with respect to relative parameters.
            A relative parameter is a parameter divided by its expected value.
        open_combinations: Texts that name the combinations of relative parameters that no candidate
            determines, such as "a by +0.01 and b by -0.01".
        failures: Label and reason of each candidate that cannot be tested.
    """

    _rows = "parameter"
    _figure = "plot_experiment_plan"

    names: tuple[str, ...] = field(metadata=unit("1", "parameter"))
    values: Array = field(metadata=unit("own unit", "parameter"))
    candidates: tuple[WeightLoop, ...]
    counts: NDArray[np.intp] = field(metadata=unit("1", "candidate"))
    jacobians: tuple[Array, ...]
    open_combinations: tuple[str, ...]
    failures: tuple[tuple[str, str], ...]

    @property
    def tests(self) -> tuple[WeightLoop, ...]:
        """The loops to make, repetitions included, without readings."""
        pairs = zip(self.candidates, self.counts.tolist(), strict=True)
        return tuple(loop for loop, count in pairs for _ in range(count))

    @quantity("1")
    def repetitions(self) -> dict[str, int]:
        """Number of repetitions of each test to make, by its label."""
        pairs = zip(self.candidates, self.counts.tolist(), strict=True)
        return {loop.label: count for loop, count in pairs if count}

    @quantity("own unit", "parameter")
    def std(self) -> Array:
        """Expected standard deviations of the parameters (P,) after the planned tests.

        They are inf for an undetermined parameter.
        """
        pairs = zip(self.jacobians, self.counts.tolist(), strict=True)
        rows = np.vstack([math.sqrt(count) * J for J, count in pairs if count])
        covariance = Determination(self.names, rows, np.ones(len(self.names))).covariance
        return frozen(np.sqrt(np.diag(covariance)) * abs(self.values))

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters that the planned tests do not determine."""
        return tuple(n for n, std in zip(self.names, self.std, strict=True) if math.isinf(std))

    def __str__(self) -> str:
        times = ((label, f"{count}×") for label, count in self.repetitions.items())
        rows = aligned([("test", "times"), *times])
        shares = interval_in_percent(self.std, self.values)
        cells = list[tuple[str, ...]]()
        for name, x, share in zip(self.names, self.values, shares, strict=True):
            interval = "not determined" if math.isinf(share) else f"± {share:.3g} %"
            cells.append((name, f"{x:.4g}", interval))
        rows += ["", *aligned([("parameter [own unit]", "expected", "95 %"), *cells]), ""]
        for combination in self.open_combinations:
            rows.append(f"not determined by any candidate: {combination} (relative)")
        if self.undetermined and not self.open_combinations:
            rows.append(f"too few tests to determine {', '.join(self.undetermined)}")
        rows += [f"left out: {name}: {why}" for name, why in self.failures]
        return "\n".join(rows).rstrip()

    def _labels(self) -> dict[str, Sequence[object]]:
        return {"parameter": self.names, "candidate": [loop.label for loop in self.candidates]}


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
        InvalidInput: An argument is invalid, or ``model_of`` fails or does not take a parameter; no
            candidate can be tested, or none determines any parameter.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype(cdsm.LinearElasticity(48e3), friction=0.1)
        >>> model = cdsm.ArmParameters(arm, ("rigidity", "friction"))
        >>> plan = cdsm.plan_experiment(
        ...     model, {"rigidity": 1.0, "friction": 0.1}, postures=[[0.1] * 10],
        ...     directions=["y", "z"], weights=[2.0, 20.0], minimum=5.0, tests=1,
        ...     displacement_std=2e-5, progress=False,
        ... )
        >>> print(plan)
        test                times
        posture 1, z, 20 N     1×
        <BLANKLINE>
        parameter [own unit]  expected      95 %
        rigidity                     1  ± 16.6 %
        friction                   0.1   ± 639 %
    """
    angles = number_array("postures", postures)
    forces = number_array("weights", weights, "force")
    if angles.ndim != 2 or not angles.size:
        remedy = f"shape {angles.shape} given; (n, nv) joint angles [rad] are needed."
        raise InvalidInput("postures", remedy)
    if forces.ndim != 1 or not forces.size or forces.min() <= 0.0:
        raise InvalidInput("weights", f"{weights!r} given; positive forces (n,) [N] are needed.")
    bound = number_array("minimum", minimum)
    count = whole_number("steps", steps, 1, 100)
    axes = np.atleast_2d(unit_directions("directions", directions)).tolist()
    names = {axis: name for name, axis in AXES.items()}
    way = (*range(count + 1), *range(count - 1, -1, -1))  # up and down
    candidates = [
        WeightLoop(
            label=f"posture {i}, {names.get(tuple(u)) or coordinates(u, '.2g')}, {force:g} N",
            angles=tuple(q),
            direction=tuple(u),
            forces=tuple(force * k / count for k in way),
            minimum=bound.tolist(),
            displacement_std=displacement_std,
        )
        for i, q in enumerate(angles.tolist(), 1)
        for u in axes
        for force in forces.tolist()
    ]
    return plan_tests(model_of, parameters, candidates, tests=tests, progress=progress)


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
    if not isinstance(parameters, Mapping) or not parameters:
        remedy = "give {name: expected value} for at least one."
        raise InvalidInput("parameters", f"{parameters!r} given; {remedy}")
    values = np.array([scalar(f"parameters[{name!r}]", x) for name, x in parameters.items()])
    names = tuple(parameters)
    most = whole_number("tests", tests, 1, _TESTS)
    if not values.all():
        remedy = "0 given; intervals are judged relative to the expected value. Give a small one "
        remedy += "(commands: --start)."
        raise InvalidInput(f"parameters[{names[int(abs(values).argmin())]!r}]", remedy)
    bounds = {n: (min(0.0, 2.0 * v), max(0.0, 2.0 * v)) for n, v in zip(names, values, strict=True)}
    usable = list[WeightLoop]()
    rows = list[Array]()
    failures = list[tuple[str, str]]()
    for loop in show_progress(candidates, "following the candidates", wanted=progress):
        problem = LeastSquares(model_of, None, [loop], bounds)
        middle = np.full(len(names), 0.5)
        if isinstance(reason := problem.predict(middle), str):
            failures.append((loop.label, reason))
            continue
        usable.append(loop)
        rows.append(problem.jacobian(middle, central=True) / problem.slope(middle) * values)
    if not usable:
        raise InvalidInput(
            "postures",
            f"none of {len(failures)} candidates can be tested. {': '.join(failures[0])} Choose "
            "other postures, lighter weights, higher tensions.",
        )
    whole = Determination(names, np.vstack(rows), np.ones(len(names)))
    if not whole.rank:
        remedy = f"no candidate determines {', '.join(names)}. Add other postures, directions or "
        raise InvalidInput("parameters", f"{remedy}weights.")
    known = [J @ whole.coordinates for J in rows]
    return ExperimentPlan(
        names=names,
        values=frozen(values),
        candidates=tuple(usable),
        counts=frozen(greedy(np.array([A.T @ A for A in known]), most)),
        jacobians=tuple(frozen(J) for J in rows),
        open_combinations=whole.open_combinations,
        failures=tuple(failures),
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
