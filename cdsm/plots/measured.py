"""Plot fits, plans of measurements, budgets and searches for designs."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from cdsm.plots import style
from cdsm.plots.lines import line_looks
from cdsm.plots.style import MM, N_PER_MM, Panels
from cdsm.support.determination import interval_in_percent
from cdsm.support.format import plural

if TYPE_CHECKING:
    from cdsm.design.result import DesignSearch
    from cdsm.identification.experiment_plan import ExperimentPlan
    from cdsm.identification.result import Identification
    from cdsm.tolerancing.budget import Uncertainty
    from cdsm.tolerancing.monte_carlo import MonteCarlo

_MOST_LABELS = 30  # above this number of measurements the axis shows numbers, not names
_WIDEST = 34  # characters of a label beside an axis of 2.4 inches


@style.styled
def plot_identification(
    fit: Identification,
    axs: Panels | Sequence[Axes] | None = None,
    *,
    title: str | None = None,
) -> Panels:
    """Plot predicted and measured stiffnesses [N/mm], tips and loops [mm], and residuals in σ."""
    rows = [fit.measurements[i] for i in fit.measurement_of]
    loops = [
        (i, measurement)
        for i, measurement in enumerate(fit.measurements)
        if hasattr(measurement, "forces")
    ]
    stiff = [k for k, measurement in enumerate(rows) if hasattr(measurement, "value")]
    tips = [k for k, measurement in enumerate(rows) if hasattr(measurement, "pull")]
    count = 1 + bool(stiff) + bool(tips) + bool(loops)
    axes = style.panels(axs, count, height=3.0)
    *left, right = axes
    panels = iter(left)
    for places, unit, size in ((stiff, "N/mm", N_PER_MM), (tips, "mm", MM)):
        if places:
            panel = next(panels)
            sigma = [size * rows[k].std for k in places]
            measured = size * fit.measured[places]
            predicted = size * fit.predicted[places]
            ends = [np.append(measured, predicted).min(), np.append(measured, predicted).max()]
            panel.plot(ends, ends, color="0.6", linewidth=0.9)
            bars = panel.errorbar(measured, predicted, xerr=sigma, fmt="none", ecolor=style.BLUE)
            bars[2][0].set_gid(f"sigma:{unit}")
            panel.plot(measured, predicted, "o", color=style.BLUE, gid=f"predicted:{unit}")
            panel.set(xlabel=f"measured [{unit}], ± σ", ylabel=f"predicted [{unit}]")
    if loops:
        _plot_loops(left[-1], fit, loops)
        left[-1].legend(loc="best", ncols=1 + (len(loops) > 6))
    place = np.arange(len(rows))
    for width, shade in ((2.0, 0.12), (1.0, 0.2)):
        look: dict[str, Any] = {"color": "0.5", "alpha": shade, "linewidth": 0.0}
        right.axhspan(-width, width, gid=f"within:{width:g}", **look)
    right.vlines(place, 0.0, fit.residuals, color=style.BLUE)
    size = 4 if len(rows) < 100 else 2
    right.plot(place, fit.residuals, "o", color=style.BLUE, markersize=size, gid="residuals")
    right.axhline(0.0, color="0.2", linewidth=0.8)
    right.set_ylabel("(predicted − measured)/σ")
    if len(rows) <= _MOST_LABELS and any(measurement.label for measurement in fit.measurements):
        right.set_xticks(place, fit.reading_names, rotation=90)
    else:
        right.set_xlabel("reading" if loops else "measurement")
        style.whole_numbers(right.xaxis)
    style.set_heading(axes, axs, title, fit.verdict)
    return axes


def _plot_loops(axes: Any, fit: Identification, loops: Sequence[tuple[int, Any]]) -> None:
    """Plot displacements of loops along the force, less the first measured one."""
    looks = line_looks([loop.label or f"[{i}]" for i, loop in loops])
    for look, (i, loop) in zip(looks, loops, strict=True):
        rows = np.flatnonzero(fit.measurement_of == i)
        along = loop.axes @ (np.array(loop.direction) / np.linalg.norm(loop.direction))
        read, model = (
            MM * x[rows].reshape(-1, along.size) @ along for x in (fit.measured, fit.predicted)
        )
        name = loop.label or f"[{i}]"
        line = {**look, "ls": "-", "label": name}
        axes.plot(model - read[0], loop.forces, gid=f"predicted:{name}", **line)
        axes.plot(read - read[0], loop.forces, ".", color=look["color"], gid=f"measured:{name}")
    axes.plot([], [], color="0.2", label="predicted")
    axes.plot([], [], ".", color="0.2", label="measured")
    axes.set(xlabel="displacement along the force [mm]", ylabel="force [N]")


@style.styled
def plot_experiment_plan(
    plan: ExperimentPlan, axs: Panels | Sequence[Axes] | None = None, *, title: str | None = None
) -> Panels:
    """Plot the expected 95 % intervals [%], and how often each candidate is tested."""
    panels = style.panels(axs, 2, height=2.6)
    left, right = panels
    half = interval_in_percent(plan.std, plan.values)
    bars = left.barh(np.arange(half.size), np.where(np.isfinite(half), half, 0.0), color=style.BLUE)
    for bar, name in zip(bars, plan.names, strict=True):
        bar.set_gid(f"interval:{name}")
    for y in np.flatnonzero(~np.isfinite(half)):
        left.text(0.0, y, " not determined", va="center")
    left.set_yticks(np.arange(half.size), plan.names)
    left.grid(visible=False, axis="y")
    left.invert_yaxis()
    left.set_xlabel("95 % interval, ± [% of the expected value]")
    counts = right.bar(np.arange(plan.counts.size), plan.counts, color=style.VERMILLION)
    for k, bar in enumerate(counts):
        bar.set_gid(f"tests:{k}")
    right.set(xlabel="candidate", ylabel="tests")
    style.whole_numbers(right.xaxis)
    style.whole_numbers(right.yaxis)
    question = f"which tests tell the parameters? {plural(len(plan.tests), 'test')} chosen"
    style.set_heading(panels, axs, title, question)
    return panels


@style.styled
def plot_uncertainty(
    budget: Uncertainty, ax: Axes | None = None, *, title: str | None = None
) -> Axes:
    """Plot the standard uncertainty, and the contribution of each source to it, one bar each."""
    unit, size = budget.measurand.unit
    named = {source.replace("_", " "): u / size for source, u in budget.contributions.items() if u}
    bars = named | {"all together": budget.standard_uncertainty / size}
    axes = style.panel(ax, 0.9 + 0.2 * len(bars))
    colors = [style.COLORS[0]] * len(named) + [style.COLORS[1]]
    places = range(len(bars))
    drawn = axes.barh(places, list(bars.values()), color=colors, height=0.65)
    for bar, source in zip(drawn, bars, strict=True):
        bar.set_gid(f"source:{source}")
    axes.set_yticks(places, list(bars))
    axes.bar_label(drawn, fmt="%.3g", padding=3, fontsize=7)
    axes.invert_yaxis()
    axes.margins(x=0.3)  # for the numbers at the bars
    axes.grid(visible=False, axis="y")
    axes.set(xlabel=f"standard uncertainty [{unit}]")
    question = f"{budget.name} = {budget.value / size:.4g} {unit}: what makes it uncertain?"
    style.set_title(axes, title, question)
    return axes


@style.styled
def plot_monte_carlo(run: MonteCarlo, ax: Axes | None = None, *, title: str | None = None) -> Axes:
    """Plot the histogram of the values, and the normal distribution of ``run.budget``."""
    unit, size = run.budget.measurand.unit
    first = run.budget
    axes = style.panel(ax, 2.6)
    values = run.values / size
    u = first.standard_uncertainty / size
    low, high = np.quantile(values, [0.0005, 0.9995])
    shown = values[(values >= low) & (values <= high)]
    look: dict[str, Any] = {"color": style.BLUE, "alpha": 0.45, "gid": "histogram"}
    axes.hist(shown, 80, density=True, histtype="stepfilled", label="Monte Carlo", **look)
    if u > 0.0:
        x = np.linspace(low, high, 300)
        z = (x - first.value / size) / u
        density = np.exp(-z * z / 2.0) / (u * np.sqrt(2.0 * np.pi))
        axes.plot(x, density, color=style.VERMILLION, label="first order", gid="first order")
    for name, interval, color, dash in (
        ("Monte Carlo", run.interval(), style.BLUE, "--"),
        ("first order", first.interval(), style.VERMILLION, ":"),
    ):
        for end in interval:
            line: dict[str, Any] = {"color": color, "linestyle": dash, "linewidth": 1.0}
            axes.axvline(end / size, gid=f"interval:{name}", **line)
    axes.set(xlabel=f"{first.name} [{unit}]", ylabel=f"probability density [1/({unit})]")
    axes.set_yticks([])
    anchor = (0.0, -0.2)
    axes.legend(loc="upper left", bbox_to_anchor=anchor, ncols=2, title="dashes: 95 % intervals")
    style.set_title(axes, title, f"{first.name}: does the first order hold?")
    return axes


@style.styled
def plot_designs(
    search: DesignSearch, axs: Panels | Sequence[Axes] | None = None, *, title: str | None = None
) -> Panels:
    """Plot two or three objectives of feasible designs, with the front and its compromise.

    If there is one objective, its best value is plotted against the number of designs.
    """
    objectives = search.problem.objectives
    scales = [objective.unit[1] for objective in objectives]
    names = [textwrap.fill(label, _WIDEST) for label in search.objective_labels]
    if len(objectives) == 1:
        panels = style.panels(axs, 1, height=2.4, width=style.ONE_COLUMN)
        axes = panels[0]
        goals = np.where(search.evaluated.feasible, search.evaluated.goals[:, 0], np.inf)
        best = np.minimum.accumulate(goals)
        known = np.flatnonzero(np.isfinite(best))
        shown = objectives[0].sign * best[known] / scales[0]
        axes.step(known + 1, shown, where="post", color=style.BLUE, gid="best")
        style.whole_numbers(axes.xaxis)
        axes.set(xlabel="designs evaluated", ylabel=names[0])
        question = f"{search.problem.arm.name}: is the search at its end?"
        style.set_heading(panels, axs, title, question)
        return panels
    every = search.evaluated
    feasible = np.setdiff1d(np.flatnonzero(every.feasible), search.front)
    others = range(1, len(objectives))
    width = style.ONE_COLUMN if len(others) == 1 else style.TWO_COLUMNS
    panels = style.panels(axs, len(others), height=2.7, width=width)
    for panel, k in zip(panels, others, strict=True):
        x, y = (every[objectives[n].key] / scales[n] for n in (0, k))
        panel.plot(x[feasible], y[feasible], ".", color="0.7", label="feasible", gid="feasible")
        line: dict[str, Any] = {"color": style.BLUE, "linewidth": 0.8}
        panel.plot(x[search.front], y[search.front], ".-", label="front", gid="front", **line)
        chosen = search.front[search.compromise]
        ring = {"color": style.VERMILLION, "markerfacecolor": "none", "markersize": 8}
        panel.plot(x[chosen], y[chosen], "o", label="compromise", gid="compromise", **ring)
        panel.set(xlabel=names[0], ylabel=names[k])
        panel.legend(loc="best")
    question = f"{search.problem.arm.name}: which of {len(every)} designs is the compromise?"
    style.set_heading(panels, axs, title, question)
    return panels
