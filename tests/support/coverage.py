"""Whether 95 % intervals of identified parameters hold the truth, without computing the intervals.

The interval of a parameter holds a value if Δχ² with the parameter fixed there is at most 1.96².
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

import cdsm
from cdsm.identification import Measurement, WeightLoop
from cdsm.identification.problem import Problem

_LIMIT = 1.959964**2


class Experiment:
    """Tests that are simulated on a known arm; its parameters are identified."""

    def __init__(
        self,
        model_of: Callable[..., cdsm.Manipulator],
        planned: Sequence[WeightLoop],
        true: Mapping[str, float],
        free: Mapping[str, tuple[float, float]],
    ) -> None:
        self.model_of, self.true, self.free = model_of, dict(true), free
        self.exact = [loop.simulated(model_of(**true)) for loop in planned]

    def held(self, random: np.random.Generator) -> dict[str, bool]:
        """Simulate and identify once; return whether the interval of each parameter holds it."""
        drawn = list[Measurement | WeightLoop]()
        for loop in self.exact:
            read = np.array(loop.displacements)
            read += loop.displacement_std * random.normal(size=read.size)
            drawn.append(replace(loop, displacements=tuple(read.tolist())))
        problem = Problem(self.model_of, None, drawn, self.free)
        truth = problem.point(np.array(list(self.true.values())))
        best, found = problem.search(truth, coarse=True), {}
        for i, name in enumerate(self.true):
            fixed = best.copy()
            fixed[i] = truth[i]
            others = np.flatnonzero(np.arange(truth.size) != i)
            fixed = problem.search(fixed, others, coarse=True) if others.size else fixed
            found[name] = bool(problem.cost(fixed) - problem.cost(best) <= _LIMIT)
        return found
