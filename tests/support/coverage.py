"""Whether 95 % intervals of identified parameters hold the truth, without computing the intervals.

The interval of a parameter holds a value if Δχ² with the parameter fixed there is at most 1.96².
Where the linear model expects less than half of that, it does. Elsewhere χ² is computed on the
tangent of the profile: any values of the other parameters give an upper bound of Δχ², and these a
close one. Only where this bound is too large are the other parameters fitted again.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

import cdsm
from cdsm.identification import WeightLoop
from cdsm.identification.least_squares import LeastSquares
from cdsm.identification.problem import Model, problem_of
from cdsm.support.values import Array

_LIMIT = 1.959964**2
_LEFT = 1e-2  # Δχ² that a fit may leave: it moves 1 in 3000 intervals
_STEPS, _HALVINGS = 20, 5


class Experiment:
    """Loops that are simulated on a known arm; their parameters are identified."""

    def __init__(
        self,
        model_of: Callable[..., cdsm.Manipulator],
        planned: Sequence[WeightLoop],
        true: Mapping[str, float],
        free: Mapping[str, tuple[float, float]],
    ) -> None:
        self.arm, self.true, self.free = model_of(**true), dict(true), free
        exact = tuple(loop.simulated(self.arm) for loop in planned)
        self.model = Model(model_of, None, exact)
        problem = problem_of(self.model, free)
        self.truth = problem.box.point(np.array(list(true.values())))
        self.jacobian = problem.jacobian(self.truth)

    def held(self, random: np.random.Generator) -> dict[str, bool]:
        """Simulate and identify once; return whether the interval of each parameter holds it."""
        loops = [loop.simulated(self.arm, random) for loop in self.model.loops]
        model = replace(self.model, measurements=tuple(loops))
        problem, every = problem_of(model, self.free), list(range(self.truth.size))
        best = _fitted(problem, self.truth, self.jacobian, every)
        jacobian = problem.jacobian(best)
        least, found = problem.cost(best), {}
        for i, name in enumerate(self.true):
            others = [j for j in every if j != i]
            along, beside = jacobian[:, i], jacobian[:, others]
            tangent = np.linalg.lstsq(beside, -along)[0]
            way = self.truth[i] - best[i]
            if np.sum((way * (along + beside @ tangent)) ** 2) < _LIMIT / 2.0:
                found[name] = True
                continue
            point = best.copy()
            point[others] = np.clip(best[others] + way * tangent, 0.0, 1.0)
            point[i] = self.truth[i]
            if not problem.cost(point) - least <= _LIMIT:
                point = _fitted(problem, point, jacobian, others)
            found[name] = bool(problem.cost(point) - least <= _LIMIT)
        return found


def _fitted(problem: LeastSquares, start: Array, jacobian: Array, over: list[int]) -> Array:
    """Fit some parameters by Gauss–Newton steps, from a Jacobian near the start."""
    point, cost, J, old = start, problem.cost(start), jacobian[:, over], False
    for _ in range(_STEPS):
        step = np.linalg.lstsq(J, -problem.residuals(point))[0]
        if np.sum((J @ step) ** 2) < _LEFT:
            break
        if old:
            J, old = problem.jacobian(point, over), False
            step = np.linalg.lstsq(J, -problem.residuals(point))[0]
        for part in 0.5 ** np.arange(_HALVINGS):
            trial = point.copy()
            trial[over] = np.clip(point[over] + part * step, 0.0, 1.0)
            if problem.cost(trial) < cost:
                break
        else:  # at a kink
            break
        point, cost, old = trial, problem.cost(trial), True
    return point
