"""Refinement of a design by SLSQP of scipy, with derivatives of each posture and load."""

from __future__ import annotations

from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from cdsm.design.evaluation import evaluate_designs
from cdsm.design.goals import KINDS, Measure
from cdsm.design.gradients import SMOOTH, rows_and_gradients
from cdsm.design.infeasible import explain
from cdsm.design.problem import DesignProblem
from cdsm.design.result import DesignSearch
from cdsm.design.search import pareto, progress_of
from cdsm.errors import CdsmError, InvalidInput
from cdsm.support.validation import instance, whole_number
from cdsm.support.values import Array, frozen

_SAFE = 1e-7
"""Relative distance of a refined design from each limit, so that rounding violates none."""


_FAR = 10.0
"""Violation of the scaled constraints that stands for a design that does not hold all postures."""

_AT_END = 1e-9
"""Distance from the end of a range, over the range, that is rounding."""

_ROUNDS = 2
"""Number of times that a design is improved and then moved inside its limits."""


class _Rows(NamedTuple):
    """Values (R,) of a measure, and derivatives (R, n) by variables divided by their ranges."""

    values: Array
    slopes: Array


def refine_design(
    problem: DesignProblem, start: ArrayLike | None = None, *, iterations: int = 100
) -> DesignSearch:
    """Improve a design of continuous variables by SLSQP (Kraft, 1988), with exact derivatives.

    The objective is the worst value over postures and loads, which has kinks. So SLSQP solves the
    smooth problem min t with t ≥ the objective, and with each constraint, at every posture and
    load. A step to a design that does not hold all postures is shortened. The result is a minimum
    near the start; see :func:`search_designs` for the whole range.

    The derivatives are exact, also those of the bounds that ``worst_friction`` narrows; where a
    cable goes straight through a hole, its wrap angle has a kink, and the mean of both sides is
    taken. With ``tolerances``, each posture and load keeps its own margin, coverage · u; its
    derivative is a central difference of u, which is computed from exact first derivatives.

    Args:
        problem: The problem; its variables are continuous, it has one objective, and all quantities
            are of ``stiffness``, ``margin``, ``deflection``, ``motor_force``, ``mass`` and
            ``length``. The objective has its default ``goal``.
        start: Design (n,) [m, rad, N] to begin with; None: the given arm.
        iterations: Maximum number of iterations.

    Raises:
        InvalidInput: The problem is not of this kind, or ``start`` is missing or outside the
            ranges.
        InfeasibleDesign: No design met all constraints; see :func:`search_designs`.
    """
    from scipy.optimize import minimize

    instance("problem", problem, DesignProblem)
    whole_number("iterations", iterations, 1)
    require_smooth(problem)
    begin = problem.start if start is None else np.asarray(start, dtype=np.float64)
    if begin is None:
        raise InvalidInput("start", "is needed: the given arm is outside the ranges.")
    problem.values(begin)
    low, high = problem.bounds.T
    size = high - low
    objective = problem.objectives[0]
    first = rows_and_gradients(problem, begin, objective)[0]
    scale = float(abs(first).max()) or 1.0
    known: dict[bytes, dict[str, _Rows] | None] = {}
    visited: list[Array] = []

    def at(z: Array) -> dict[str, _Rows]:
        key = z[:-1].tobytes()
        if key not in known:
            part = np.where(z[:-1] < _AT_END, 0.0, np.where(z[:-1] > 1.0 - _AT_END, 1.0, z[:-1]))
            x = np.clip(low + size * part, low, high)
            visited.append(x)
            known[key] = _all_rows(problem, x, size)
        rows = known[key]
        if rows is None:
            raise _PostureNotHeld
        return rows

    def slack(z: Array) -> Array:
        try:
            rows = at(z)
        except _PostureNotHeld:  # the line search then takes a smaller step
            return np.full(count, -_FAR)
        parts = [z[-1] - objective.sign * rows[objective.key].values / scale]
        for each in problem.constraints:
            sign = 1.0 if each.at_most is None else -1.0
            bound = abs(each.limit) or KINDS[each.of].shown[1]
            parts.append(sign * (rows[each.key].values - each.limit) / bound - _SAFE)
        return np.concatenate(parts)

    def slope(z: Array) -> Array:
        rows = at(z)
        of = rows[objective.key].slopes
        parts = [np.column_stack([-objective.sign * of / scale, np.ones(len(of))])]
        for each in problem.constraints:
            sign = 1.0 if each.at_most is None else -1.0
            bound = abs(each.limit) or KINDS[each.of].shown[1]
            of = rows[each.key].slopes
            parts.append(np.column_stack([sign * of / bound, np.zeros(len(of))]))
        return np.vstack(parts)

    def limits(y: Array) -> Array:
        return slack(np.append(y, 0.0))[len(first) :]

    def limit_slopes(y: Array) -> Array:
        return slope(np.append(y, 0.0))[len(first) :, :-1]

    y = (begin - low) / size
    inside = [(0.0, 1.0)] * len(size)
    up = np.append(np.zeros(len(size)), 1.0)
    # where smaller steps do not help either, the best before counts
    with suppress(_PostureNotHeld):
        start_rows = at(np.append(y, 0.0))
        each_goal = (objective, *problem.constraints)
        count = sum(len(start_rows[each.key].values) for each in each_goal)
        for _ in range(_ROUNDS):
            worst = float((objective.sign * at(np.append(y, 0.0))[objective.key].values).max())
            found = minimize(
                lambda z: z[-1],
                np.append(y, worst / scale),
                jac=lambda z: up,
                bounds=[*inside, (None, None)],
                constraints={"type": "ineq", "fun": slack, "jac": slope},
                method="SLSQP",
                options={"maxiter": iterations, "ftol": 1e-9},
            )
            # where the worst posture or the cables at a bound change, SLSQP may end a little
            # outside: the nearest design inside is close
            y = ended = found.x[:-1]
            if problem.constraints:
                y = minimize(
                    lambda y, to: 0.5 * float((y - to) @ (y - to)),
                    ended,
                    (ended,),
                    jac=lambda y, to: y - to,
                    bounds=inside,
                    constraints={"type": "ineq", "fun": limits, "jac": limit_slopes},
                    method="SLSQP",
                    options={"maxiter": iterations, "ftol": 1e-12},
                ).x
    return _finished(problem, visited)


class _PostureNotHeld(Exception):
    """Raised if SLSQP tries a design that does not hold all postures."""


def _all_rows(problem: DesignProblem, x: Array, size: Array) -> dict[str, _Rows] | None:
    """Compute all quantities of the problem for a design x (n,); ``size`` (n,) are the ranges.

    Return None for a design that does not hold all postures, or has no derivatives.
    """
    found: dict[str, _Rows] = {}
    for each in (*problem.objectives, *problem.constraints):
        if each.key not in found:
            try:
                values, slopes = rows_and_gradients(problem, x, Measure(each.of, each.direction))
            except CdsmError:
                return None
            found[each.key] = _Rows(values, slopes * size)
    return found


def _finished(problem: DesignProblem, visited: list[Array]) -> DesignSearch:
    whole = evaluate_designs(problem, np.array(visited), progress=False)
    front = pareto(whole)
    if not len(front):
        explain(whole)
    count = range(1, len(whole) + 1)
    history = tuple(progress_of(problem, n, whole.values[:n]) for n in count)
    return DesignSearch(
        problem=problem, seed=0, evaluated=whole, front=frozen(front), history=history
    )


def require_smooth(problem: DesignProblem) -> None:
    """Raise InvalidInput if a problem cannot be refined."""
    for variable in problem.variables:
        if not variable.is_continuous:
            raise InvalidInput("problem", f"{variable.name} is not continuous; use search_designs.")
    if len(problem.objectives) != 1:
        raise InvalidInput("problem", "has several objectives; leave one, or use search_designs.")
    objective = problem.objectives[0]
    if objective.goal != KINDS[objective.of].best:
        raise InvalidInput("problem", f"{objective.of} at its {objective.goal} is not smooth.")
    for each in (*problem.objectives, *problem.constraints):
        if each.of not in SMOOTH:
            raise InvalidInput(
                "problem", f"{each.of} has no exact derivatives; use search_designs."
            )
