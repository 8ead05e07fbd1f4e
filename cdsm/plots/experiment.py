"""Plot plans of experiments."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from cdsm.plots.style import BLUE, TWO_COLUMNS, VERMILLION, heading, legend, panels

if TYPE_CHECKING:
    from cdsm.identification.experiment_plan import ExperimentPlan


def plot_experiment_plan(plan: ExperimentPlan) -> Figure:
    """Plot the 95 % intervals that ``plan`` expects, and the gain by one more test, per candidate.

    The intervals are those of the parameters, of the planned tests and of evenly spaced ones.
    """
    figure, ((left, right),) = panels(TWO_COLUMNS, 3.2, 2)
    place, width = np.arange(len(plan.names)), 0.38
    for shift, std, colour, label in (
        (-width / 2.0, plan.even_std, "0.65", "evenly spaced"),
        (width / 2.0, plan.std, BLUE, "planned"),
    ):
        half = 196.0 * std / abs(plan.values)
        left.barh(
            place + shift, np.where(np.isfinite(half), half, 0.0), width, color=colour, label=label
        )
        for y, x in zip(place + shift, half, strict=True):
            if not np.isfinite(x):
                left.text(0.0, y, " not determined", va="center")
    left.set_yticks(place, plan.names)
    left.invert_yaxis()
    left.set_xlabel("95 % interval, ± % of the expected value")
    legend(left)
    index, chosen = np.arange(len(plan.candidates)), plan.counts > 0
    right.axhline(1.0, color="0.2", linewidth=0.8)
    right.plot(index, plan.sensitivities, ".", color="0.65", label="candidate")
    right.plot(index[chosen], plan.sensitivities[chosen], "o", color=VERMILLION, label="chosen")
    for i in index[chosen]:
        right.annotate(
            f"{plan.counts[i]}×",
            (i, plan.sensitivities[i]),
            textcoords="offset points",
            xytext=(0, -12),
            ha="center",
        )
    right.set(xlabel="candidate", ylabel="gain by one more test, over the largest", ylim=(0, 1.15))
    legend(right)
    heading(figure, f"{len(plan.tests)} tests, {plan.criterion}-optimal")
    return figure
