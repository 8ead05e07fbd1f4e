"""Search for the best designs, by NSGA-II (Deb et al., IEEE T-EC 6, 2002) of pymoo."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdsm.design.evaluation import Designs, explain, gathered, workers
from cdsm.design.problem import DesignProblem
from cdsm.design.quantities import Measured
from cdsm.design.result import DesignSearch
from cdsm.design.variables import WHOLE
from cdsm.errors import need
from cdsm.support.validation import instance, whole_number
from cdsm.support.values import Array, frozen

_MOST = 10_000  # generations, and designs of one
_NO_VALUE = 1e3  # stands for a violation or an objective that does not exist


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

    Example:
        >>> import cdsm
        >>> problem = cdsm.DesignProblem.read("examples/design.toml")
        >>> options = {"generations": 1, "population": 8, "seed": 1, "progress": False}
        >>> search = cdsm.search_designs(problem, **options)
        >>> print(str(search).splitlines()[0])
        8 designs, 4 feasible, 3 on the front; * is the compromise
    """
    instance("problem", problem, DesignProblem)
    steps = whole_number("generations", generations, 1, _MOST)
    size = whole_number("population", population, 4, _MOST)
    whole_number("seed", seed, 0)
    need("design", "pymoo")
    rows: list[Array] = []
    results: list[Measured] = []
    with (
        workers(problem, jobs, progress, steps * size) as compute,
        warnings.catch_warnings(action="ignore"),  # pymoo and its parts warn of themselves
    ):

        def evaluate(designs: Array) -> Designs:
            evaluated = [*compute(designs)]
            rows.extend(designs)
            results.extend(evaluated)
            return gathered(problem, designs, evaluated)

        _minimize(problem, evaluate, steps, size, seed)
    return best_of(gathered(problem, np.array(rows), results), seed)


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
            designs = evaluate(
                np.array([[float(individual[name]) for name in named] for individual in x])
            )
            goals = designs.goals
            missed = np.nan_to_num(designs.violations, nan=_NO_VALUE, posinf=_NO_VALUE)
            missed[~np.isfinite(goals).all(axis=1), 0] += 1.0
            out["F"], out["G"] = np.where(np.isfinite(goals), goals, _NO_VALUE), missed

    constraints = 1 + len(problem.constraints)
    task = Task(vars=named, n_obj=len(problem.objectives), n_ieq_constr=constraints)
    first = MixedVariableSampling()(task, population, random_state=np.random.default_rng(seed))
    if problem.start is not None:
        start = dict(zip(named, problem.start.tolist(), strict=True))
        start |= {name: round(start[name]) for name, x in named.items() if isinstance(x, Integer)}
        first = Population.merge(Population.new(X=[start]), first[1:])
    elimination = MixedVariableDuplicateElimination()
    algorithm = NSGA2(
        pop_size=population,
        sampling=first,
        mating=MixedVariableMating(eliminate_duplicates=elimination),
        eliminate_duplicates=elimination,
    )
    minimize(task, algorithm, ("n_gen", generations), seed=seed, copy_algorithm=False)


def best_of(evaluated: Designs, seed: int) -> DesignSearch:
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
