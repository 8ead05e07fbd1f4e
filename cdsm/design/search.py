"""Search of a design problem by NSGA-II (Deb et al., IEEE T-EC 6, 2002), as pymoo implements it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from cdsm.design.evaluation import Designs, gathered, workers
from cdsm.design.problem import DesignProblem
from cdsm.design.quantities import Found, quiet_arm
from cdsm.design.result import DesignSearch
from cdsm.design.variables import WHOLE
from cdsm.errors import CdsmError, need
from cdsm.manipulator import UNCHECKED
from cdsm.stiffness_matrix import stiffness
from cdsm.support.format import plural
from cdsm.support.validation import instance, whole_number
from cdsm.support.values import Array, frozen
from cdsm.tension import distribute_tension


class InfeasibleDesign(CdsmError):
    """No design that a search tried meets all constraints of its problem.

    ``design`` has the smallest sum of violations, one number for each variable (none if no arm was
    valid); ``constraints`` names what it violates, ``held``: it is not balanced, or unstable.
    """

    def __init__(self, message: str, constraints: Sequence[str], design: Sequence[float]) -> None:
        super().__init__(message)
        self.constraints, self.design = tuple(constraints), tuple(design)


_FAR = 1e3
"""Number that stands for a violation or an objective that does not exist."""


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
    return best_of(gathered(problem, np.array(rows), found), seed)


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


def best_of(evaluated: Designs, seed: int) -> DesignSearch:
    """Return the result of a search; raise InfeasibleDesign if no evaluated design is feasible."""
    front = pareto(evaluated)
    if not len(front):
        _explain(evaluated)
    return DesignSearch(
        problem=evaluated.problem, seed=seed, evaluated=evaluated, front=frozen(front)
    )


def pareto(designs: Designs) -> NDArray[np.intp]:
    """Return the indices (m,) of the feasible designs that no other feasible design dominates.

    They are sorted by the first objective, the best first. Of designs with equal objectives, only
    the first is returned.
    """
    goals = designs.goals
    usable = np.flatnonzero(designs.feasible & np.isfinite(goals).all(axis=1))
    _, first = np.unique(goals[usable], axis=0, return_index=True)  # sorted by the columns
    distinct = goals[usable[first]]
    no_worse = (distinct[:, None] <= distinct).all(axis=2)  # each is no worse than itself
    return np.asarray(usable[first][no_worse.sum(axis=0) == 1])


def _explain(designs: Designs) -> NoReturn:
    """Raise InfeasibleDesign: what the design of the smallest sum of violations misses."""
    problem, count = designs.problem, plural(len(designs), "design")
    missed = np.nan_to_num(designs.violations, posinf=1e9)
    arms = np.array([not fault for fault in designs.faults])
    if not arms.any():
        raise InfeasibleDesign(f"none of {count} is an arm: {designs.faults[0]}", (), ())
    best = int(np.where(arms, missed.sum(axis=1), np.inf).argmin())
    row, said = designs.designs[best], dict[str, str]()
    if missed[best, 0] > 0.0:
        share, why = f"{100.0 * missed[best, 0]:.3g} %", _first_reason(problem, row)
        said["held"] = f"{share} of its postures and loads are not held: {why}"
    for each, miss in zip(problem.constraints, missed[best, 1:].tolist(), strict=True):
        if miss > 0.0:
            value = float(designs[each.key][best])
            now = "does not exist" if np.isnan(value) else each.shown(value)
            far = f", {100.0 * miss:.3g} % off" if miss < 1e9 else ""
            words = problem.with_margin(each, each.words)
            said[each.key] = f"{words} {now}, {each.asked} is asked{far}"
    for objective in problem.objectives:
        value = float(designs[objective.key][best])
        if not np.isfinite(value):
            said.setdefault(objective.key, f"{objective.words} is {objective.shown(value)}")
    values = zip(problem.variables, problem.values(row), strict=True)
    chosen = ", ".join(f"{each.of} {each.shown(value)}" for each, value in values)
    raise InfeasibleDesign(
        f"none of {count} meets all constraints. The nearest one ({chosen}) misses: "
        f"{'; '.join(said.values()).rstrip('.')}. Loosen what it misses, widen a variable, or "
        "search longer.",
        tuple(said),
        tuple(row.tolist()),
    )


def _first_reason(problem: DesignProblem, row: Array) -> str:
    """Return which posture a design does not hold first, and why."""
    bounds, worst, number = (problem.minimum_of(row), problem.maximum), problem.worst_friction, 0
    try:
        arm = quiet_arm(problem, row)
        for number, q in enumerate(problem.postures_of(arm)):
            pose = arm.at(q)
            for load in problem.loads:
                pull = distribute_tension(pose, *bounds, load, worst_friction=worst)
                margin = stiffness(pose, pull).margin
                if margin <= 0.0:
                    return f"posture {number}: UNSTABLE, least eigenvalue of K {margin:.3g} N m/rad"
    except CdsmError as error:
        return f"posture {number}: {str(error).replace(UNCHECKED, '')}"
    return "its tensions are at the edge"
