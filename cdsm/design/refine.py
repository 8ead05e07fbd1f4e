"""Refine a design by SLSQP of scipy, on its quantities at each posture and load."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.design.evaluation import gathered
from cdsm.design.goals import KINDS
from cdsm.design.problem import DesignProblem
from cdsm.design.quantities import Found, measure_cases
from cdsm.design.result import DesignSearch
from cdsm.design.search import best_of
from cdsm.errors import InvalidInput
from cdsm.support.validation import instance, whole_number
from cdsm.support.values import Array

SMOOTH: Final = ("stiffness", "margin", "deflection", "motor_force", "mass", "length")
"""Quantities that are smooth functions of the design at one posture and load."""

_SAFE = 1e-7  # relative distance from each limit, so that rounding violates none
_NOT_HELD = -10.0  # condition of a design that does not hold all postures
_DIGITS = 12  # of scaled variables: next to the end of a range is at it, such as no lead


def refine_design(
    problem: DesignProblem, start: ArrayLike | None = None, *, iterations: int = 100
) -> DesignSearch:
    """Improve a design of continuous variables by SLSQP (Kraft, 1988).

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
    objective, limits = problem.objectives[0], problem.constraints
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
    return best_of(gathered(problem, np.array(designs), quantities), 0)


def require_smooth(problem: DesignProblem) -> None:
    """Raise InvalidInput if :func:`refine_design` cannot treat a problem."""
    for variable in problem.variables:
        if not variable.is_continuous:
            raise InvalidInput(
                "problem",
                f"{variable.of} is not continuous; use search_designs (without --refine).",
            )
    if len(problem.objectives) != 1:
        raise InvalidInput(
            "problem",
            "has several objectives; leave one, or use search_designs (without --refine).",
        )
    objective = problem.objectives[0]
    if objective.goal != KINDS[objective.of].best:
        raise InvalidInput("problem", f"{objective.of} at its {objective.goal} is not smooth.")
    for each in (*problem.objectives, *problem.constraints):
        if each.of not in SMOOTH:
            raise InvalidInput(
                "problem", f"{each.of} is not smooth; use search_designs (without --refine)."
            )
