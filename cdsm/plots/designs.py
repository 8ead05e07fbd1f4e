"""Plot a search for designs: the Pareto front, or the progress for a single objective."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdsm.plots.style import (
    BLUE,
    ONE_COLUMN,
    TWO_COLUMNS,
    VERMILLION,
    expect,
    heading,
    legend_below,
    panels,
)

if TYPE_CHECKING:
    from cdsm.design.result import DesignSearch


_WIDEST = 34  # characters of a label beside an axis of 2.4 inches


def plot_designs(found: DesignSearch) -> Figure:
    """Plot the objectives of all designs that meet the constraints, and their Pareto front.

    For a single objective, plot its best value against the number of designs.

    Args:
        found: The result of :func:`cdsm.search_designs` or :func:`cdsm.refine_design`.

    Raises:
        InvalidInput: ``found`` is not such a result.
    """
    expect("found", found, "DesignSearch")
    objectives = found.problem.objectives
    scales = [each.unit[1] for each in objectives]
    names = [textwrap.fill(label, _WIDEST) for label in found._labels]
    if len(objectives) == 1:
        figure, axes = panels(ONE_COLUMN, 2.4, 1)
        panel = axes[0, 0]
        goals = np.where(found.evaluated.feasible, found.evaluated.goals[:, 0], np.inf)
        best = np.minimum.accumulate(goals)
        known = np.flatnonzero(np.isfinite(best))
        panel.step(known + 1, objectives[0].sign * best[known] / scales[0], where="post")
        panel.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
        panel.set(xlabel="designs evaluated", ylabel=names[0])
        return figure
    every = found.evaluated
    feasible = np.setdiff1d(np.flatnonzero(every.feasible), found.front)
    others = range(1, len(objectives))
    figure, axes = panels(ONE_COLUMN if len(others) == 1 else TWO_COLUMNS, 2.9, len(others))
    for panel, k in zip(axes.flat, others, strict=True):
        x, y = (every[objectives[n].key] / scales[n] for n in (0, k))
        panel.plot(x[feasible], y[feasible], ".", color="0.7", markersize=3, label="feasible")
        panel.plot(x[found.front], y[found.front], ".-", color=BLUE, linewidth=0.8, label="front")
        chosen = found.front[found.compromise]
        ring = {"color": VERMILLION, "markerfacecolor": "none", "markersize": 8}
        panel.plot(x[chosen], y[chosen], "o", label="compromise", **ring)
        panel.set(xlabel=names[0], ylabel=names[k])
    heading(figure, f"{len(every)} designs of {found.problem.arm.name}")
    legend_below(figure, axes, 3)
    return figure
