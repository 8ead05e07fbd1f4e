"""Search for the best designs, and refine one.

A search is NSGA-II (Deb et al., IEEE T-EC 6, 2002) of pymoo, a refinement SLSQP (Kraft, 1988) of
scipy on the quantities at each posture and load.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.design.evaluation import Designs, explain, gathered, workers
from cdsm.design.goals import KINDS
from cdsm.design.problem import DesignProblem
from cdsm.design.quantities import Found, measure_cases
from cdsm.design.result import DesignSearch
from cdsm.design.variables import WHOLE
from cdsm.errors import InvalidInput, need
from cdsm.support.validation import instance, whole_number
from cdsm.support.values import Array, frozen

SMOOTH: Final = ("stiffness", "margin", "deflection", "motor_force", "mass", "length")
"""Quantities that are smooth functions of the design at one posture and load."""

_FAR = 1e3  # stands for a violation or an objective that does not exist
_SAFE = 1e-7  # relative distance from each limit, so that rounding violates none
_NOT_HELD = -10.0  # condition of a design that does not hold all postures
_DIGITS = 12  # of scaled variables: next to the end of a range is at it, such as no lead


def search_designs(
    problem: DesignProblem,
    *,
    generations: int = 40,
    population: int = 40,
    seed: int = 0,
    jobs: int = 1,
    progress: bool = True,
) -> DesignSearch:
    """Search for the best designs of a problem: the Pareto front of its objectives.

    NSGA-II of pymoo handles continuous variables, whole numbers and choices together. The first
    designs are random, and the given arm is one of them if it lies within the ranges. The same
    problem and the same seed give the same designs, whatever ``jobs`` is.

    Args:
        problem: The problem.
        generations: Number of generations, including the first, random one.
        population: Number of designs in each generation.
        seed: Seed of all random numbers.
        jobs: Number of processes, as for :func:`evaluate_designs`.
        progress: Show a bar, if there is a terminal.

    Raises:
        InfeasibleDesign: No design met all constraints; the error names the nearest one, and which
            constraint it misses by how much.
        InvalidInput: An argument is invalid.
        CdsmError: pymoo is not installed.
    """
    instance("problem", problem, DesignProblem)
    steps = whole_number("generations", generations, 1)
    size = whole_number("population", population, 4)
    whole_number("seed", seed, 0)
    need("design", "pymoo")
    rows: list[Array] = []
    found: list[Found] = []
    with (
        workers(problem, jobs, progress, steps * size) as compute,
        warnings.catch_warnings(action="ignore"),  # pymoo and its parts warn of themselves
    ):

        def evaluate(designs: Array) -> Designs:
            evaluated = [*compute(designs)]
            rows.extend(designs)
            found.extend(evaluated)
            return gathered(problem, designs, evaluated)

        _minimize(problem, evaluate, steps, size, seed)
    return _best_of(gathered(problem, np.array(rows), found), seed)


def _minimize(
    problem: DesignProblem,
    evaluate: Callable[[Array], Designs],
    generations: int,
    population: int,
    seed: int,
) -> None:
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.mixed import (
        MixedVariableDuplicateElimination,
        MixedVariableMating,
        MixedVariableSampling,
    )
    from pymoo.core.population import Population
    from pymoo.core.problem import Problem
    from pymoo.core.variable import Choice, Integer, Real
    from pymoo.optimize import minimize

    named: dict[str, Any] = {}
    for variable, (low, high) in zip(problem.variables, problem.bounds.tolist(), strict=True):
        if variable.choices:
            named[variable.of] = Choice(options=[float(i) for i in range(len(variable.choices))])
        elif variable.kind in WHOLE:
            named[variable.of] = Integer(bounds=(round(low), round(high)))
        else:
            named[variable.of] = Real(bounds=(low, high))

    class Task(Problem):  # type: ignore[misc]
        def _evaluate(self, x: Any, out: dict[str, Array], *_: Any, **__: Any) -> None:
            designs = evaluate(np.array([[float(each[name]) for name in named] for each in x]))
            goals = designs.goals
            missed = np.nan_to_num(designs.violations, nan=_FAR, posinf=_FAR)
            missed[~np.isfinite(goals).all(axis=1), 0] += 1.0
            out["F"], out["G"] = np.where(np.isfinite(goals), goals, _FAR), missed

    constraints = 1 + len(problem.constraints)
    task = Task(vars=named, n_obj=len(problem.objectives), n_ieq_constr=constraints)
    first = MixedVariableSampling()(task, population, random_state=np.random.default_rng(seed))
    if problem.start is not None:
        given = dict(zip(named, problem.start.tolist(), strict=True))
        given |= {name: round(given[name]) for name, x in named.items() if isinstance(x, Integer)}
        first = Population.merge(Population.new(X=[given]), first[1:])
    elimination = MixedVariableDuplicateElimination()
    algorithm = NSGA2(
        pop_size=population,
        sampling=first,
        mating=MixedVariableMating(eliminate_duplicates=elimination),
        eliminate_duplicates=elimination,
    )
    minimize(task, algorithm, ("n_gen", generations), seed=seed, copy_algorithm=False)


def refine_design(
    problem: DesignProblem, start: ArrayLike | None = None, *, iterations: int = 100
) -> DesignSearch:
    """Improve a design of continuous variables by SLSQP.

    The objective is the worst value over postures and loads, which has kinks. So SLSQP solves a
    smooth problem: it minimises t, where t is at least the objective (negated if it is maximised)
    at every posture and load, and each constraint is met at all of them. Derivatives are central
    differences. The least tensions have kinks where a cable reaches a bound, and wrap angles where
    a cable goes straight through a hole; the mean of both sides is used there. A step to a design
    that does not hold all postures is shortened. With ``tolerances``, each posture and load has its
    own margin, coverage · u. The result is the best of all designs evaluated, near a minimum that
    is near the start; see :func:`search_designs` for the whole range.

    Args:
        problem: The problem. Its variables are continuous. It has one objective, with the default
            ``goal``. All its quantities are among ``stiffness``, ``margin``, ``deflection``,
            ``motor_force``, ``mass`` and ``length``.
        start: Design (n,) [m, rad, N] to begin with; None: the given arm.
        iterations: Maximum number of iterations.

    Raises:
        InvalidInput: The problem is not of this kind, or ``start`` is missing, outside the ranges,
            or does not hold all postures.
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
    objective = problem.objectives[0]
    limits = problem.constraints
    visited: list[tuple[Array, Found]] = []
    known: dict[bytes, list[Array] | None] = {}

    def cases(y: Array) -> list[Array] | None:
        y = y.round(_DIGITS)
        if y.tobytes() not in known:
            design = np.clip(low + (high - low) * y, low, high)
            found, each = measure_cases(problem, design, (objective, *limits))
            visited.append((design, found))
            exist = each is not None and all(np.isfinite(x).all() for x in each)
            known[y.tobytes()] = each if exist else None
        return known[y.tobytes()]

    y = (begin - low) / (high - low)  # each variable from 0 to 1
    first = cases(y)
    if first is None:
        raise InvalidInput("start", "does not hold all postures; give another one.")
    scale = objective.sign * (float(abs(first[0]).max()) or 1.0)

    def conditions(z: Array) -> Array:
        found = cases(z[:-1])
        if found is None:  # the line search then takes a smaller step
            return np.full(sum(each.size for each in first), _NOT_HELD)
        parts = [z[-1] - found[0] / scale]
        for limit, each in zip(limits, found[1:], strict=True):
            parts.append(limit.distance(each) - _SAFE)
        return np.concatenate([part.ravel() for part in parts])

    minimize(
        lambda z: z[-1],
        np.append(y, (first[0] / scale).max()),
        bounds=[*[(0.0, 1.0)] * y.size, (None, None)],
        constraints={"type": "ineq", "fun": conditions},
        method="SLSQP",
        jac="3-point",
        options={"maxiter": iterations, "ftol": 1e-9},
    )
    designs, quantities = zip(*visited, strict=True)
    return _best_of(gathered(problem, np.array(designs), quantities), 0)


def require_smooth(problem: DesignProblem) -> None:
    """Raise InvalidInput if :func:`refine_design` cannot treat a problem."""
    goals = problem.objectives
    wrong = [f"{each.of} is not continuous" for each in problem.variables if not each.is_continuous]
    wrong += ["it has several objectives"] * (len(goals) > 1)
    wrong += [f"{x.of} at its {x.goal} is not smooth" for x in goals if x.goal != KINDS[x.of].best]
    asked = dict.fromkeys(each.of for each in (*goals, *problem.constraints))
    wrong += [f"{name} is not smooth" for name in asked if name not in SMOOTH]
    if wrong:
        said = f"cannot be refined: {', '.join(wrong)}. Use search_designs (without --refine)."
        raise InvalidInput("problem", said)


def _best_of(evaluated: Designs, seed: int) -> DesignSearch:
    """Return the result of a search; raise InfeasibleDesign if no evaluated design is feasible."""
    front = _pareto(evaluated)
    if not len(front):
        explain(evaluated)
    return DesignSearch(
        problem=evaluated.problem, seed=seed, evaluated=evaluated, front=frozen(front)
    )


def _pareto(designs: Designs) -> NDArray[np.intp]:
    """Return the Pareto-optimal designs (m,), one of equal ones, sorted by the first objective."""
    goals = designs.goals
    usable = np.flatnonzero(designs.feasible & np.isfinite(goals).all(axis=1))
    _, first = np.unique(goals[usable], axis=0, return_index=True)  # sorted by the columns
    distinct = goals[usable[first]]
    no_worse = (distinct[:, None] <= distinct).all(axis=2)  # each is no worse than itself
    return np.asarray(usable[first][no_worse.sum(axis=0) == 1])
