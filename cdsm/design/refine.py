"""Refine a design by SLSQP of scipy, with derivatives at each posture and load."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import ArrayLike

from cdsm.design.evaluation import evaluate_designs
from cdsm.design.goals import KINDS, Measure
from cdsm.design.gradients import SMOOTH, rows_and_gradients
from cdsm.design.problem import DesignProblem
from cdsm.design.result import DesignSearch
from cdsm.design.search import best_of, progress_of
from cdsm.errors import CdsmError, InvalidInput
from cdsm.support.validation import instance, whole_number
from cdsm.support.values import Array

_SAFE = 1e-7
"""Relative distance of a refined design from each limit, so that rounding violates none."""

_FAR = 10.0
"""Violation of every condition that is passed to SLSQP if a design does not hold all postures."""

_AT_END = 1e-9  # distance from the end of a range, over the range, that is rounding
_ROUNDS = 2  # number of times that a design is improved and then moved inside its limits


def refine_design(
    problem: DesignProblem, start: ArrayLike | None = None, *, iterations: int = 100
) -> DesignSearch:
    """Improve a design of continuous variables by SLSQP (Kraft, 1988), with exact derivatives.

    The objective is the worst value over postures and loads, which has kinks. So SLSQP solves a
    smooth problem: it minimises t, where t is at least the objective (negated if it is maximised)
    at every posture and load, and each constraint is met at all of them. A step to a design that
    does not hold all postures is shortened. The result is a minimum near the start; see
    :func:`search_designs` for the whole range.

    The derivatives are exact, including those of the bounds that ``worst_friction`` narrows. If a
    cable goes straight through a hole, its wrap angle has a kink; the mean of the derivatives on
    both sides is then used. With ``tolerances``, each posture and load keeps its own margin,
    coverage · u; its derivative is a central difference of u, which is computed from exact first
    derivatives.

    Args:
        problem: The problem. Its variables are continuous. It has one objective, with the default
            ``goal``. All its quantities are among ``stiffness``, ``margin``, ``deflection``,
            ``motor_force``, ``mass`` and ``length``.
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
    first = rows_and_gradients(problem, begin, problem.objectives[0])[0]
    smooth = _SmoothProblem(problem, float(abs(first).max()) or 1.0)
    y = (begin - low) / (high - low)
    inside = [(0.0, 1.0)] * len(y)
    up = np.append(np.zeros(len(y)), 1.0)
    # if smaller steps do not help either, the best design so far is the result
    with suppress(_PostureNotHeld):
        for _ in range(_ROUNDS):
            found = minimize(
                lambda z: z[-1],
                np.append(y, -smooth.rows(y)[0][: len(first)].min()),
                jac=lambda z: up,
                bounds=[*inside, (None, None)],
                constraints={"type": "ineq", "fun": smooth.conditions, "jac": smooth.slopes},
                method="SLSQP",
                options={"maxiter": iterations, "ftol": 1e-9},
            )
            # where the worst posture or the cables at a bound change, SLSQP may end a little
            # outside: the nearest design inside is close
            y = ended = found.x[:-1]
            if problem.constraints:
                limits = {
                    "fun": lambda y: smooth.conditions(np.append(y, 0.0))[len(first) :],
                    "jac": lambda y: smooth.rows(y)[1][len(first) :],
                }
                y = minimize(
                    lambda y, to: 0.5 * float((y - to) @ (y - to)),
                    ended,
                    (ended,),
                    jac=lambda y, to: y - to,
                    bounds=inside,
                    constraints={"type": "ineq"} | limits,
                    method="SLSQP",
                    options={"maxiter": iterations, "ftol": 1e-12},
                ).x
    whole = evaluate_designs(problem, np.array(smooth.visited), progress=False)
    counts = range(1, len(whole) + 1)
    return best_of(whole, 0, (progress_of(problem, n, whole.values[:n]) for n in counts))


class _PostureNotHeld(Exception):
    """SLSQP has tried a design that does not hold all postures."""


class _SmoothProblem:
    """The smooth problem of SLSQP: min t with c(y) + a t ≥ 0 at every posture and load.

    y (n,) is the design, with each variable scaled to 0…1. The first conditions have a = 1 and
    belong to the objective: t − s · objective/``scale`` ≥ 0, with s = −1 if it is maximised, else
    1. The others have a = 0 and belong to the constraints: c is the distance of a quantity from its
    limit, divided by the limit.

    Attributes:
        visited: All designs (n,) for which the conditions were computed.
    """

    def __init__(self, problem: DesignProblem, scale: float) -> None:
        goal = problem.objectives[0]
        self.visited: list[Array] = []
        self._problem = problem
        self._goals: list[tuple[Measure, float, float]] = [(goal, 0.0, -goal.sign * scale)]
        self._goals += [(each, each.limit, each._scale) for each in problem.constraints]
        self._found: dict[bytes, tuple[Array, Array] | None] = {}

    def rows(self, y: Array) -> tuple[Array, Array]:
        """Return c (R,) and ∂c/∂y (R, n) of the R conditions, for a scaled design y (n,).

        Raises _PostureNotHeld if the design does not hold all postures; see :class:`DesignProblem`.
        """
        key = y.tobytes()
        if key not in self._found:
            low, high = self._problem.bounds.T
            part = np.where(y < _AT_END, 0.0, np.where(y > 1.0 - _AT_END, 1.0, y))
            self.visited.append(np.clip(low + (high - low) * part, low, high))
            self._found[key] = self._rows(self.visited[-1])
        found = self._found[key]
        if found is None:
            raise _PostureNotHeld
        return found

    def conditions(self, z: Array) -> Array:
        """Compute the conditions c + a t (R,) at z = (y, t); −10 if a posture is not held."""
        try:
            return np.asarray(self.rows(z[:-1])[0] + z[-1] * self._raised)
        except _PostureNotHeld:  # the line search then takes a smaller step
            return np.full(self._raised.size, -_FAR)

    def slopes(self, z: Array) -> Array:
        """Compute the derivatives (R, n + 1) of :meth:`conditions` with respect to z = (y, t)."""
        return np.column_stack([self.rows(z[:-1])[1], self._raised])

    def _rows(self, design: Array) -> tuple[Array, Array] | None:
        """Compute c and ∂c/∂y of a design (n,); None if it does not hold all postures."""
        try:
            each = {goal.key: goal for goal, *_ in self._goals}
            found = {key: rows_and_gradients(self._problem, design, of) for key, of in each.items()}
        except CdsmError:
            return None
        size = np.ptp(self._problem.bounds, axis=1)
        values = [(found[goal.key][0] - limit) / scale for goal, limit, scale in self._goals]
        slopes = [found[goal.key][1] * size / scale for goal, _, scale in self._goals]
        count = len(values[0])
        c = np.concatenate(values)
        c[count:] -= _SAFE
        self._raised = np.append(np.ones(count), np.zeros(len(c) - count))
        return c, np.vstack(slopes)


def require_smooth(problem: DesignProblem) -> None:
    """Raise InvalidInput if :func:`refine_design` cannot treat a problem."""
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
