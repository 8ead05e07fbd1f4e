"""Plan of an experiment: which weight tests to make, how often, and the expected uncertainties."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray

from cdsm.identification.design import Criterion
from cdsm.identification.determination import Determination
from cdsm.identification.loop import WeightLoop
from cdsm.support.format import aligned, plain, plural
from cdsm.support.values import Array, ReadOnlyState, frozen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDTH = 1.959964  # half a 95 % interval in standard deviations


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class ExperimentPlan(ReadOnlyState):
    """Weight tests that determine parameters of an arm best; made by :func:`plan_experiment`.

    There are n candidates and P parameters. All arrays are read-only.

    Attributes:
        names: Names of the parameters, in the order of every (P,) array.
        values: Expected values (P,) [m, kg, N/m, …].
        wanted: Names of the parameters that the tests are to determine well.
        criterion: ``"D"`` or ``"A"``, see :func:`plan_experiment`.
        candidates: The candidates that can be tested.
        counts: Number of repetitions of each candidate (n,).
        even: Repetitions (n,) in a reference plan: as many tests, evenly spaced over the
            candidates.
        jacobians: One matrix [-] for each candidate, with a row (P,) for each of its readings: the
            derivatives of the reading, in standard deviations, with respect to relative parameters.
            A relative parameter is a parameter divided by its expected value.
        known: Prior knowledge, a diagonal matrix (P, P) [-]: 1/σ of each known relative parameter,
            0 for the others.
        efficiency: Proved lower bound of f/f_best [-]; 1 for the best plan. C is the covariance of
            those s wanted parameters that the candidates determine. f is det(C)^(−1/s) for
            ``"D"`` and 1/tr C for ``"A"``. So the mean variance (geometric or arithmetic) is at
            most 1/efficiency times as large as in the best plan. It is 0 if the planned tests
            determine less than all candidates together.
        sensitivities: Gain of f by one more test of each candidate, relative to the largest gain
            (n,) [-]; 0 for all if ``efficiency`` is 0.
        open_combinations: Texts that name the combinations of relative parameters that no candidate
            determines, such as "a by +0.01 and b by -0.01".
        failures: Label and reason of each candidate that cannot be tested.
    """

    names: tuple[str, ...]
    values: Array
    wanted: tuple[str, ...]
    criterion: Criterion
    candidates: tuple[WeightLoop, ...]
    counts: NDArray[np.intp]
    even: NDArray[np.intp]
    jacobians: tuple[Array, ...]
    known: Array
    efficiency: float
    sensitivities: Array
    open_combinations: tuple[str, ...]
    failures: tuple[tuple[str, str], ...]

    @property
    def tests(self) -> tuple[WeightLoop, ...]:
        """The loops to make, repetitions included, without readings."""
        return self._tests(self.counts)

    @property
    def even_tests(self) -> tuple[WeightLoop, ...]:
        """Loops of a reference plan: as many as ``tests``, evenly spaced over the candidates."""
        return self._tests(self.even)

    @cached_property
    def std(self) -> Array:
        """Expected standard deviations of the parameters (P,) after the planned tests [m, kg, …].

        They are inf for an undetermined parameter.
        """
        return self._std(self.counts)

    @cached_property
    def even_std(self) -> Array:
        """Expected standard deviations (P,) after the reference plan ``even_tests`` [m, kg, …]."""
        return self._std(self.even)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters that the planned tests do not determine."""
        return tuple(n for n, std in zip(self.names, self.std, strict=True) if math.isinf(std))

    @property
    def factors(self) -> dict[str, float]:
        """Factor by which the plan beats the reference plan [-], for each wanted parameter by name.

        It is ``even_std`` divided by ``std``; NaN if the plan does not determine the parameter.
        """
        found = zip(self.names, self.even_std, self.std, strict=True)
        return {
            name: float(even / std) if math.isfinite(std) else math.nan
            for name, even, std in found
            if name in self.wanted
        }

    def _tests(self, counts: NDArray[np.intp]) -> tuple[WeightLoop, ...]:
        pairs = zip(self.candidates, counts.tolist(), strict=True)
        return tuple(loop for loop, count in pairs for _ in range(count))

    def _std(self, counts: NDArray[np.intp]) -> Array:
        pairs = zip(self.jacobians, counts.tolist(), strict=True)
        rows = [math.sqrt(count) * J for J, count in pairs if count]
        determination = Determination(
            self.names, np.vstack([*rows, self.known]), np.ones(len(self.names))
        )
        return frozen(np.sqrt(np.diag(determination.covariance)) * abs(self.values))

    def to_dict(self) -> dict[str, object]:
        """Return the plan as plain numbers for JSON; parameters in their own units."""
        return plain(
            {
                "criterion": self.criterion,
                "efficiency_at_least": self.efficiency,
                "tests": [
                    {
                        "label": loop.label,
                        "times": int(count),
                        "angles": loop.angles,
                        "direction": loop.direction,
                        "forces_N": loop.forces,
                    }
                    for loop, count in zip(self.candidates, self.counts, strict=True)
                    if count
                ],
                "parameters": dict(zip(self.names, self.values, strict=True)),
                "std": dict(zip(self.names, self.std, strict=True)),
                "even_std": dict(zip(self.names, self.even_std, strict=True)),
                "undetermined": self.undetermined,
            }
        )

    def plot(self) -> Figure:
        """Plot the expected 95 % intervals, and the gain from repeating each candidate."""
        from cdsm.plots.measured import plot_experiment_plan  # matplotlib imports slowly

        return plot_experiment_plan(self)

    def __repr__(self) -> str:
        return f"<ExperimentPlan of {plural(len(self.tests), 'test')} for {', '.join(self.wanted)}>"

    def __str__(self) -> str:
        made = [
            (loop.label, f"{count}×")
            for loop, count in zip(self.candidates, self.counts.tolist(), strict=True)
            if count
        ]
        rows = [*aligned([("test", "times"), *made]), ""]
        shares = 100.0 * _WIDTH / abs(self.values)
        cells = [
            (
                name + ("" if name in self.wanted else " (not wanted)"),
                f"{value:.4g}",
                *("not determined" if math.isinf(x) else f"± {x:.3g} %" for x in (plan, even)),
            )
            for name, value, plan, even in zip(
                self.names, self.values, shares * self.std, shares * self.even_std, strict=True
            )
        ]
        heads = ("parameter [own unit]", "expected", "95 %, planned", "95 %, evenly spaced")
        rows += [*aligned([heads, *cells]), ""]
        if self.efficiency:
            most = max(0.1, 100.0 * (self.efficiency**-0.5 - 1.0))
            rows.append(
                f"{self.criterion}-optimal: no {plural(len(self.tests), 'test')} of these "
                f"candidates make intervals narrower by more than {most:.2g} % in the mean"
            )
        for combination in self.open_combinations:
            rows.append(f"not determined by any candidate: {combination} (relative)")
        if self.undetermined and not self.open_combinations:
            rows.append(f"too few tests to determine {', '.join(self.undetermined)}")
        for label, reason in self.failures:
            rows.append(f"left out: {label}: {reason}")
        return "\n".join(rows)
