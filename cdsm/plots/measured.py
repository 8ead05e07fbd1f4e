"""Plot fits, plans of measurements, budgets, searches for designs, forces, and laws of wires."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from cdsm.errors import InvalidInput
from cdsm.plots import style
from cdsm.plots.arm import finish, picture
from cdsm.plots.style import KN, MM, N_PER_MM
from cdsm.support.format import plural

if TYPE_CHECKING:
    from cdsm.design.result import DesignSearch
    from cdsm.identification.experiment_plan import ExperimentPlan
    from cdsm.identification.result import Identification
    from cdsm.measures.polytope import ForcePolytope
    from cdsm.tolerancing.budget import Uncertainty
    from cdsm.tolerancing.monte_carlo import MonteCarlo
    from cdsm.wires.elasticity import Elasticity
    from cdsm.wires.tensile_fit import TensileFit

_BROAD = 0.25  # stages wider than this fraction of the whole range have horizontal names
_MOST_LABELS = 30  # above this number of measurements the axis shows numbers, not names
_WIDEST = 34  # characters of a label beside an axis of 2.4 inches
_ENDLESS = 1000.0  # tension [N] up to which a law without a highest tension is drawn


@style.styled
def plot_tensile_fit(fit: TensileFit) -> Figure:
    """Plot force [N] against strain [%] with the fit; EA [kN] with its 95 % band and stages."""
    figure, ((left, right),) = style.panels(style.TWO_COLUMNS, 3.0, 2)
    tension = fit.tension
    band = fit.band
    length = fit.test.gauge_length
    fitted = 100.0 * (fit.start / length + fit.elasticity.strain(tension))
    left.plot(
        100.0 * fit.test.displacement / length, fit.test.force, ".", color="0.6", label="test"
    )
    left.plot(fitted, tension, color=style.VERMILLION, label="fit")
    left.set(xlabel="strain [%]", ylabel="force [N]")
    ends = KN * band.low, KN * band.high
    right.fill_between(tension, *ends, color=style.BLUE, alpha=0.3, linewidth=0, label="95 % band")
    right.plot(tension, KN * fit.rigidity, color=style.VERMILLION, label="EA")
    shade_stages(right, fit.stages)
    right.set(xlabel="tension [N]", ylabel="tangent rigidity EA [kN]")
    right.set_ylim(0.0, 1.1 * right.get_ylim()[1])  # room for the names of the stages
    for axes in (left, right):
        axes.legend()
    return figure


def shade_stages(axes: Any, stages: Sequence[tuple[str, float, float]], along: str = "x") -> None:
    """Shade and name the ``stages`` (name, lowest, highest [N]) of a wire on the x- or y-axis."""
    look: dict[str, Any] = {"fontsize": "small", "color": "0.3"}
    whole = stages[-1][2] - stages[0][1]
    for (name, low, high), shade in zip(stages, cycle(("0.93", "0.98", "0.88")), strict=False):
        middle = (low + high) / 2.0
        if along == "x":
            axes.axvspan(low, high, color=shade, zorder=0, linewidth=0)
            look["rotation"] = 90.0 if high - low < _BROAD * whole else 0.0
            where = axes.get_xaxis_transform()
            axes.text(middle, 0.98, name, transform=where, ha="center", va="top", **look)
        else:
            axes.axhspan(low, high, color=shade, zorder=0, linewidth=0)
            where = axes.get_yaxis_transform()
            axes.text(0.02, middle, name.replace("\n", " "), transform=where, va="center", **look)


@style.styled
def plot_identification(fit: Identification) -> Figure:
    """Plot predicted and measured stiffnesses [N/mm], tips and loops [mm], and residuals in σ."""
    rows = [fit.measurements[i] for i in fit.measurement_of]
    loops = [(i, one) for i, one in enumerate(fit.measurements) if hasattr(one, "forces")]
    stiff = [k for k, one in enumerate(rows) if hasattr(one, "value")]
    tips = [k for k, one in enumerate(rows) if hasattr(one, "pull")]
    count = 1 + bool(stiff) + bool(tips) + bool(loops)
    figure, (axes,) = style.panels(style.TWO_COLUMNS, 3.2, count)
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
            panel.errorbar(measured, predicted, xerr=sigma, fmt="o", color=style.BLUE)
            panel.set(xlabel=f"measured [{unit}], ± σ", ylabel=f"predicted [{unit}]")
    if loops:
        _plot_loops(left[-1], fit, loops)
        style.legend_below(figure, left[-1], 5)
    place = np.arange(len(rows))
    for width, shade in ((2.0, 0.12), (1.0, 0.2)):
        right.axhspan(-width, width, color="0.5", alpha=shade, linewidth=0.0)
    right.vlines(place, 0.0, fit.residuals, color=style.BLUE)
    right.plot(place, fit.residuals, "o", color=style.BLUE, markersize=4 if len(rows) < 100 else 2)
    right.axhline(0.0, color="0.2", linewidth=0.8)
    right.set_ylabel("(predicted − measured)/σ")
    if len(rows) <= _MOST_LABELS and any(measurement.label for measurement in fit.measurements):
        right.set_xticks(place, fit.reading_names, rotation=90)
    else:
        right.set_xlabel("reading" if loops else "measurement")
        style.whole_numbers(right.xaxis)
    return style.titled(figure, fit.verdict)


def _plot_loops(axes: Any, fit: Identification, loops: Sequence[tuple[int, Any]]) -> None:
    """Plot displacements of loops along the force, less the first measured one."""
    looks = style.line_looks([loop.label or f"[{i}]" for i, loop in loops])
    for look, (i, loop) in zip(looks, loops, strict=True):
        rows = np.flatnonzero(fit.measurement_of == i)
        along = loop.axes @ (np.array(loop.direction) / np.linalg.norm(loop.direction))
        read, model = (
            MM * x[rows].reshape(-1, along.size) @ along for x in (fit.measured, fit.predicted)
        )
        axes.plot(loop.forces, model - read[0], **look | {"ls": "-"})
        axes.plot(loop.forces, read - read[0], ".", color=look["color"])
    axes.plot([], [], color="0.2", label="predicted")
    axes.plot([], [], ".", color="0.2", label="measured")
    axes.set(xlabel="force [N]", ylabel="displacement along force [mm]")


@style.styled
def plot_experiment_plan(plan: ExperimentPlan) -> Figure:
    """Plot the expected 95 % intervals [%], and how often each candidate is tested."""
    figure, ((left, right),) = style.panels(style.TWO_COLUMNS, 3.2, 2)
    half = 196.0 * plan.std / abs(plan.values)
    left.barh(np.arange(half.size), np.where(np.isfinite(half), half, 0.0))
    for y in np.flatnonzero(~np.isfinite(half)):
        left.text(0.0, y, " not determined", va="center")
    left.set_yticks(np.arange(half.size), plan.names)
    left.invert_yaxis()
    left.set_xlabel("95 % interval, ± % of the expected value")
    right.bar(np.arange(plan.counts.size), plan.counts, color=style.VERMILLION)
    right.set(xlabel="candidate", ylabel="tests")
    style.whole_numbers(right.xaxis)
    style.whole_numbers(right.yaxis)
    return style.titled(figure, plural(len(plan.tests), "test"))


@style.styled
def plot_uncertainty(budget: Uncertainty) -> Figure:
    """Plot the standard uncertainty, and the contribution of each source to it, one bar each."""
    unit, size = budget.measurand.unit
    named = {source.replace("_", " "): u / size for source, u in budget.contributions.items() if u}
    bars = named | {"all together": budget.standard_uncertainty / size}
    figure, ((axes,),) = style.panels(style.ONE_COLUMN, 0.9 + 0.2 * len(bars))
    colors = [style.COLORS[0]] * len(named) + [style.COLORS[1]]
    drawn = axes.barh(list(bars), list(bars.values()), color=colors, height=0.65)
    axes.bar_label(drawn, fmt="%.3g", padding=3)
    axes.invert_yaxis()
    axes.margins(x=0.3)  # for the numbers at the bars
    axes.grid(visible=False, axis="y")
    axes.set(xlabel=f"standard uncertainty [{unit}]")
    return style.titled(figure, f"{budget.name}: {budget.value / size:.4g} {unit}")


@style.styled
def plot_monte_carlo(run: MonteCarlo) -> Figure:
    """Plot the histogram of the values, and the normal distribution of ``run.budget``."""
    (unit, size) = run.budget.measurand.unit
    first = run.budget
    figure, ((axes,),) = style.panels(style.ONE_COLUMN, 2.8)
    values = run.values / size
    u = first.standard_uncertainty / size
    low, high = np.quantile(values, [0.0005, 0.9995])
    shown = values[(values >= low) & (values <= high)]
    axes.hist(shown, 80, density=True, alpha=0.45, label="Monte Carlo")
    if u > 0.0:
        x = np.linspace(low, high, 300)
        z = (x - first.value / size) / u
        density = np.exp(-z * z / 2.0) / (u * np.sqrt(2.0 * np.pi))
        axes.plot(x, density, color=style.VERMILLION, label="first order")
    for interval, color in ((run.interval(), style.BLUE), (first.interval(), style.VERMILLION)):
        for end in interval:
            axes.axvline(end / size, color=color, linestyle="--", linewidth=1.0)
    axes.set(xlabel=f"{first.name} [{unit}]", ylabel=f"probability density [1/({unit})]")
    axes.set_yticks([])
    style.legend_below(figure, axes, 2, title="dashed: 95 % intervals")
    return figure


@style.styled
def plot_designs(search: DesignSearch) -> Figure:
    """Plot two or three objectives of feasible designs, with the front and its compromise.

    If there is one objective, its best value is plotted against the number of designs.
    """
    objectives = search.problem.objectives
    scales = [objective.unit[1] for objective in objectives]
    names = [textwrap.fill(label, _WIDEST) for label in search.objective_labels]
    if len(objectives) == 1:
        figure, ((axes,),) = style.panels(style.ONE_COLUMN, 2.4)
        goals = np.where(search.evaluated.feasible, search.evaluated.goals[:, 0], np.inf)
        best = np.minimum.accumulate(goals)
        known = np.flatnonzero(np.isfinite(best))
        shown = objectives[0].sign * best[known] / scales[0]
        axes.step(known + 1, shown, where="post")
        style.whole_numbers(axes.xaxis)
        axes.set(xlabel="designs evaluated", ylabel=names[0])
        return figure
    every = search.evaluated
    feasible = np.setdiff1d(np.flatnonzero(every.feasible), search.front)
    others = range(1, len(objectives))
    figure, axes = style.panels(
        style.ONE_COLUMN if len(others) == 1 else style.TWO_COLUMNS, 2.9, len(others)
    )
    for panel, k in zip(axes.flat, others, strict=True):
        x, y = (every[objectives[n].key] / scales[n] for n in (0, k))
        panel.plot(x[feasible], y[feasible], ".", color="0.7", label="feasible")
        panel.plot(x[search.front], y[search.front], ".-", linewidth=0.8, label="front")
        chosen = search.front[search.compromise]
        ring = {"color": style.VERMILLION, "markerfacecolor": "none", "markersize": 8}
        panel.plot(x[chosen], y[chosen], "o", label="compromise", **ring)
        panel.set(xlabel=names[0], ylabel=names[k])
    style.legend_below(figure, axes, 3)
    return style.titled(figure, f"{len(every)} designs of {search.problem.arm.name}")


@style.styled
def plot_force_polytope(polytope: ForcePolytope) -> Figure:
    """Plot the tip forces [N] that the cables can balance; InvalidInput if they have no volume."""
    if not len(polytope.faces):
        raise InvalidInput(
            "polytope", "has no surface in three dimensions to draw; bend the arm, or add cables."
        )
    figure, axes = picture()
    axes.computed_zorder = False  # lines in front of the surface
    triangles = polytope.vertices[polytope.faces]
    look = {"facecolor": style.SKY, "edgecolor": "0.4", "linewidth": 0.15, "alpha": 0.35}
    axes.add_collection3d(Poly3DCollection(triangles, **look))
    worst = np.transpose([np.zeros(3), polytope.radius * polytope.worst_direction])
    axes.plot([0.0], [0.0], [0.0], "+", color=style.BLACK, markersize=7, label="no load")
    axes.plot(*worst, color=style.VERMILLION, label=f"worst direction: {polytope.radius:.4g} N")
    axes.auto_scale_xyz(*polytope.vertices.T)
    return finish(figure, "available force set at the tip", label="force {} [N]")


@style.styled
def plot_elasticity(law: Elasticity) -> Figure:
    """Plot tangent and secant rigidity [kN] against the tension [N]: up to 1000 N if endless."""
    tension = np.linspace(law.low, law.high if math.isfinite(law.high) else _ENDLESS, 400)
    figure, ((axes,),) = style.panels(style.ONE_COLUMN, 2.3)
    axes.plot(tension, KN * law.rigidity(tension), label="tangent, dF/dε")
    axes.plot(tension, KN * law.secant_rigidity(tension), "--", label="secant")
    axes.set(xlabel="tension [N]", ylabel="rigidity EA [kN]")
    axes.set_ylim(bottom=0.0)
    axes.legend()
    return figure
