"""Plan of an experiment: which weight tests to make, how often, and the expected uncertainties."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray

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
        candidates: The candidates that can be tested.
        counts: Number of repetitions of each candidate (n,).
        jacobians: One matrix [-] for each candidate, with a row (P,) for each of its readings: the
            derivatives of the reading, in standard deviations, with respect to relative parameters.
            A relative parameter is a parameter divided by its expected value.
        open_combinations: Texts that name the combinations of relative parameters that no candidate
            determines, such as "a by +0.01 and b by -0.01".
        failures: Label and reason of each candidate that cannot be tested.
    """

    names: tuple[str, ...]
    values: Array
    candidates: tuple[WeightLoop, ...]
    counts: NDArray[np.intp]
    jacobians: tuple[Array, ...]
    open_combinations: tuple[str, ...]
    failures: tuple[tuple[str, str], ...]

    @property
    def tests(self) -> tuple[WeightLoop, ...]:
        """The loops to make, repetitions included, without readings."""
        pairs = zip(self.candidates, self.counts.tolist(), strict=True)
        return tuple(loop for loop, count in pairs for _ in range(count))

    @cached_property
    def std(self) -> Array:
        """Expected standard deviations of the parameters (P,) after the planned tests [m, kg, …].

        They are inf for an undetermined parameter.
        """
        pairs = zip(self.jacobians, self.counts.tolist(), strict=True)
        rows = np.vstack([math.sqrt(count) * J for J, count in pairs if count])
        determination = Determination(self.names, rows, np.ones(len(self.names)))
        return frozen(np.sqrt(np.diag(determination.covariance)) * abs(self.values))

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters that the planned tests do not determine."""
        return tuple(n for n, std in zip(self.names, self.std, strict=True) if math.isinf(std))

    def to_dict(self) -> dict[str, object]:
        """Return the plan as plain numbers for JSON; parameters in their own units."""
        return plain(
            {
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
                "undetermined": self.undetermined,
            }
        )

    def plot(self) -> Figure:
        """Plot the expected 95 % intervals, and how often each candidate is tested."""
        from cdsm.plots.measured import plot_experiment_plan  # matplotlib imports slowly

        return plot_experiment_plan(self)

    def __repr__(self) -> str:
        return f"<ExperimentPlan of {plural(len(self.tests), 'test')} for {', '.join(self.names)}>"

    def __str__(self) -> str:
        made = [
            (loop.label, f"{count}×")
            for loop, count in zip(self.candidates, self.counts.tolist(), strict=True)
            if count
        ]
        rows = [*aligned([("test", "times"), *made]), ""]
        shares = 100.0 * _WIDTH * self.std / abs(self.values)
        cells = [
            (name, f"{x:.4g}", "not determined" if math.isinf(share) else f"± {share:.3g} %")
            for name, x, share in zip(self.names, self.values, shares, strict=True)
        ]
        rows += [*aligned([("parameter [own unit]", "expected", "95 %"), *cells]), ""]
        for combination in self.open_combinations:
            rows.append(f"not determined by any candidate: {combination} (relative)")
        if self.undetermined and not self.open_combinations:
            rows.append(f"too few tests to determine {', '.join(self.undetermined)}")
        for label, reason in self.failures:
            rows.append(f"left out: {label}: {reason}")
        return "\n".join(rows)
