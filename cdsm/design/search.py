"""Search of a design problem by NSGA-II (Deb et al., IEEE T-EC 6, 2002), as pymoo implements it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdsm.design.evaluation import Designs, gathered, violations, workers
from cdsm.design.infeasible import explain
from cdsm.design.problem import DesignProblem
from cdsm.design.quantities import Found
from cdsm.design.result import DesignProgress, DesignSearch
from cdsm.design.variables import WHOLE
from cdsm.support.extras import need
from cdsm.support.progress import progress_bar
from cdsm.support.validation import instance, whole_number
from cdsm.support.values import Array, frozen

_FAR = 1e3
"""Number that stands for a violation or an objective that does not exist."""


def search_designs(
    problem: DesignProblem,
    *,
    generations: int = 40,
    population: int = 40,
    seed: int = 0,
    jobs: int = 1,
    report: Callable[[DesignProgress], None] | None = None,
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
        report: Function that is called after each generation with its :class:`DesignProgress`.
        progress: Show a bar, if there is a terminal.

    Raises:
        InfeasibleDesign: No design met all constraints; the error names the nearest one, and which
            constraint it misses by how much.
        InvalidInput: An argument is invalid.
        MissingExtra: pymoo is not installed.
    """
    instance("problem", problem, DesignProblem)
    steps = whole_number("generations", generations, 1)
    size = whole_number("population", population, 4)
    whole_number("seed", seed, 0)
    need("design", "pymoo")
    algorithm = _algorithm(problem, size, steps, seed)
    rows: list[Array] = []
    found: list[Found] = []
    history: list[DesignProgress] = []
    with (
        workers(problem, jobs) as compute,
        progress_bar("designs", steps * size, wanted=progress, rate=True) as advance,
    ):
        for step in range(steps):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # pymoo and its parts warn of themselves
                asked = algorithm.ask()
            if asked is None or not len(asked):
                break
            names = [each.name for each in problem.variables]
            designs = np.array([[float(each[x]) for x in names] for each in asked.get("X")])
            evaluated = [*compute(designs)]
            advance(len(designs))
            _tell(problem, algorithm, asked, designs, evaluated)
            rows += [*designs]
            found += evaluated
            values = np.array([each.values for each in found])
            history.append(progress_of(problem, step + 1, values))
            if report is not None:
                report(history[-1])
    return best_of(gathered(problem, np.array(rows), found), seed, history)


def best_of(evaluated: Designs, seed: int, history: Iterable[DesignProgress]) -> DesignSearch:
    """Return the result of a search; raise InfeasibleDesign if no evaluated design is feasible."""
    front = pareto(evaluated)
    if not len(front):
        explain(evaluated)
    return DesignSearch(
        problem=evaluated.problem,
        seed=seed,
        evaluated=evaluated,
        front=frozen(front),
        history=tuple(history),
    )


def pareto(designs: Designs) -> NDArray[np.intp]:
    """Return the indices (m,) of the feasible designs that no other feasible design dominates.

    They are sorted by the first objective, the best first. Of designs with equal objectives, only
    the first is returned.
    """
    goals = designs._goals
    usable = np.flatnonzero((designs.feasible == 1.0) & np.isfinite(goals).all(axis=1))
    kept: list[int] = []
    for i in usable.tolist():
        others = goals[usable]
        beats = (others <= goals[i]).all(axis=1) & (others < goals[i]).any(axis=1)
        same = any((goals[k] == goals[i]).all() for k in kept)
        if not beats.any() and not same:
            kept.append(i)
    return np.array(sorted(kept, key=lambda i: tuple(goals[i])), dtype=np.intp)


def progress_of(problem: DesignProblem, generation: int, values: Array) -> DesignProgress:
    """Return the state of a search after a generation.

    ``values`` (D, m) are the quantities of all designs so far.
    """
    missed = violations(problem, values).sum(axis=1)
    feasible = missed == 0.0
    first = problem.objectives[0]
    column = [each.key for each in problem.measures].index(first.key)
    goal = np.where(feasible, first.sign * values[:, column], math.inf)
    best = int(goal.argmin()) if feasible.any() else int(missed.argmin())
    value, least = float(values[best, column]), float(missed.min())
    return DesignProgress(generation, len(values), int(feasible.sum()), value, least)


def _algorithm(problem: DesignProblem, population: int, generations: int, seed: int) -> Any:
    """Build pymoo's NSGA-II for a problem, ready for its first ``ask``."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.mixed import (
        MixedVariableDuplicateElimination,
        MixedVariableMating,
        MixedVariableSampling,
    )
    from pymoo.core.population import Population
    from pymoo.core.problem import Problem
    from pymoo.core.variable import Choice, Integer, Real

    named: dict[str, Any] = {}
    for variable, (low, high) in zip(problem.variables, problem.bounds.tolist(), strict=True):
        if variable.choices:
            named[variable.name] = Choice(options=[float(i) for i in range(len(variable.choices))])
        elif variable.of in WHOLE:
            named[variable.name] = Integer(bounds=(round(low), round(high)))
        else:
            named[variable.name] = Real(bounds=(low, high))
    bare = Problem(
        vars=named, n_obj=len(problem.objectives), n_ieq_constr=1 + len(problem.constraints)
    )
    random = np.random.default_rng(seed)
    first = MixedVariableSampling()(bare, population, random_state=random)
    if problem.start is not None:
        given = {
            each.name: round(x) if each.of in WHOLE and not each.choices else x
            for each, x in zip(problem.variables, problem.start.tolist(), strict=True)
        }
        first = Population.merge(Population.new(X=[given]), first[1:])
    algorithm = NSGA2(
        pop_size=population,
        sampling=first,
        mating=MixedVariableMating(eliminate_duplicates=MixedVariableDuplicateElimination()),
        eliminate_duplicates=MixedVariableDuplicateElimination(),
    )
    algorithm.setup(bare, termination=("n_gen", generations), seed=seed, verbose=False)
    return algorithm


def _tell(
    problem: DesignProblem, algorithm: Any, asked: Any, designs: Array, evaluated: list[Found]
) -> None:
    """Give pymoo's algorithm the objectives and violations of the designs that it ``asked`` for."""
    whole = gathered(problem, designs, evaluated)
    goals = whole._goals
    missed = np.nan_to_num(whole.violations, nan=_FAR, posinf=_FAR)
    lost = ~np.isfinite(goals).all(axis=1)
    missed[lost, 0] += 1.0
    asked.set("F", np.where(np.isfinite(goals), goals, _FAR))
    asked.set("G", missed)
    asked.set("H", np.zeros((len(designs), 0)))
    for each in asked:
        each.evaluated.update(("F", "G", "H"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        algorithm.tell(infills=asked)
