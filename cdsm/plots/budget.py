"""Plot budgets of uncertainty and Monte Carlo runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from cdsm.plots.style import COLORS, expect, legend_below, panels

if TYPE_CHECKING:
    from cdsm.tolerancing.budget import Uncertainty
    from cdsm.tolerancing.monte_carlo import MonteCarlo


def plot_uncertainty(budget: Uncertainty) -> Figure:
    """Plot the contribution of each source to the standard uncertainty, and the whole uncertainty.

    Raises InvalidInput if ``budget`` is not a result of :func:`~cdsm.uncertainty`.
    """
    expect("budget", budget, "Uncertainty")
    unit, size = budget.measurand.unit
    named = {source.replace("_", " "): u / size for source, u in budget.contributions.items() if u}
    bars = named | {"all together": budget.standard_uncertainty / size}
    figure, ((axes,),) = panels(7.0, 1.2 + 0.34 * len(bars), 1)
    colors = [COLORS[0]] * len(named) + [COLORS[1]]
    drawn = axes.barh(list(bars), list(bars.values()), color=colors, height=0.65)
    axes.bar_label(drawn, fmt="%.3g", padding=4)
    axes.invert_yaxis()
    axes.margins(x=0.12)
    axes.set_axisbelow(True)
    axes.grid(visible=False, axis="y")
    axes.set(xlabel=f"standard uncertainty [{unit}]")
    axes.set_title(f"{budget.name}: {budget.value / size:.4g} {unit}", fontsize=11)
    return figure


def plot_monte_carlo(run: MonteCarlo) -> Figure:
    """Plot a histogram of a Monte Carlo run beside the result of first-order error propagation.

    The latter is drawn as a normal distribution. Dashed lines mark the 95 % intervals of both.

    Raises InvalidInput if ``run`` is not a result of :func:`~cdsm.monte_carlo`.
    """
    expect("run", run, "MonteCarlo")
    (unit, size), first = run.budget.measurand.unit, run.budget
    figure, ((axes,),) = panels(7.0, 4.0, 1)
    values, u = run.values / size, first.standard_uncertainty / size
    low, high = np.quantile(values, [0.0005, 0.9995])
    shown = values[(values >= low) & (values <= high)]
    axes.hist(shown, 80, density=True, color=COLORS[0], alpha=0.45, label="Monte Carlo")
    if u > 0.0:
        x = np.linspace(low, high, 300)
        z = (x - first.value / size) / u
        density = np.exp(-z * z / 2.0) / (u * np.sqrt(2.0 * np.pi))
        axes.plot(x, density, color=COLORS[1], label="first order")
    for interval, color in ((run.interval(), COLORS[0]), (first.interval(), COLORS[1])):
        for end in interval:
            axes.axvline(end / size, color=color, linestyle="--", linewidth=1.0)
    axes.set(xlabel=f"{first.name} [{unit}]", ylabel=f"probability density [1/({unit})]")
    axes.set_yticks([])
    legend_below(figure, axes, 2, title="dashed: 95 % intervals")
    return figure
