"""Plot budgets of uncertainty, searches for designs, sets of forces, and laws of wires."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

from cdsm.errors import InvalidInput
from cdsm.plots import style
from cdsm.plots.arm import finish, picture
from cdsm.plots.style import KN

if TYPE_CHECKING:
    from cdsm.design.result import DesignSearch
    from cdsm.measures.polytope import ForcePolytope
    from cdsm.uncertainties.budget import Uncertainty
    from cdsm.uncertainties.monte_carlo import MonteCarlo
    from cdsm.wires.elasticity import Elasticity

_WIDEST = 34  # characters of a label beside an axis of 2.4 inches
_ENDLESS = 1000.0  # tension [N] up to which a law without a highest tension is drawn


@style.styled
def plot_uncertainty(budget: Uncertainty) -> Figure:
    """Plot the contribution of each source to the standard uncertainty, and the whole of it."""
    unit, size = budget.question.unit
    named = {source.replace("_", " "): u / size for source, u in budget.contributions.items() if u}
    bars = named | {"all together": budget.standard_uncertainty / size}
    figure, ((axes,),) = style.panels(style.ONE_COLUMN, 0.9 + 0.2 * len(bars))
    colors = [style.COLORS[0]] * len(named) + [style.COLORS[1]]
    drawn = axes.barh(list(bars), list(bars.values()), color=colors, height=0.65)
    axes.bar_label(drawn, fmt="%.3g", padding=3)
    axes.invert_yaxis()
    axes.margins(x=0.18)
    axes.grid(visible=False, axis="y")
    axes.set(xlabel=f"standard uncertainty [{unit}]")
    style.heading(figure, f"{budget.question.name}: {budget.value / size:.4g} {unit}")
    return figure


@style.styled
def plot_monte_carlo(run: MonteCarlo) -> Figure:
    """Plot a histogram of a Monte Carlo run beside the result of first-order error propagation.

    The latter is drawn as a normal distribution. Dashed lines mark the 95 % intervals of both.
    """
    (unit, size), first = run.budget.question.unit, run.budget
    figure, ((axes,),) = style.panels(style.ONE_COLUMN, 2.8)
    values, u = run.values / size, first.standard_uncertainty / size
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
    axes.set(xlabel=f"{first.question.name} [{unit}]", ylabel=f"probability density [1/({unit})]")
    axes.set_yticks([])
    style.legend_below(figure, axes, 2, title="dashed: 95 % intervals")
    return figure


@style.styled
def plot_designs(found: DesignSearch) -> Figure:
    """Plot the objectives of all designs that meet the constraints, and their Pareto front.

    For a single objective, plot its best value against the number of designs.
    """
    objectives = found.problem.objectives
    scales = [each.unit[1] for each in objectives]
    names = [textwrap.fill(label, _WIDEST) for label in found._labels]
    if len(objectives) == 1:
        figure, ((axes,),) = style.panels(style.ONE_COLUMN, 2.4)
        steps = [step for step in found.history if step.feasible]
        axes.plot([one.designs for one in steps], [one.best / scales[0] for one in steps], ".-")
        style.whole_numbers(axes.xaxis)
        axes.set(xlabel="designs evaluated", ylabel=names[0])
        return figure
    every = found.evaluated
    feasible = np.setdiff1d(np.flatnonzero(every.feasible), found.front)
    others = range(1, len(objectives))
    figure, axes = style.panels(
        style.ONE_COLUMN if len(others) == 1 else style.TWO_COLUMNS, 2.9, len(others)
    )
    for panel, k in zip(axes.flat, others, strict=True):
        x, y = (every[objectives[n].key] / scales[n] for n in (0, k))
        panel.plot(x[feasible], y[feasible], ".", color="0.7", label="feasible")
        panel.plot(x[found.front], y[found.front], ".-", linewidth=0.8, label="front")
        chosen = found.front[found.compromise]
        ring = {"color": style.VERMILLION, "markerfacecolor": "none", "markersize": 8}
        panel.plot(x[chosen], y[chosen], "o", label="compromise", **ring)
        panel.set(xlabel=names[0], ylabel=names[k])
    style.heading(figure, f"{len(every)} designs of {found.problem.arm.name}")
    style.legend_below(figure, axes, 3)
    return figure


@style.styled
def plot_force_polytope(polytope: ForcePolytope) -> Figure:
    """Plot the tip forces [N] that the cables can balance, and the worst direction.

    Raises InvalidInput if ``polytope`` has no surface: the tip cannot move in some direction, or
    the cables balance forces in one plane only.
    """
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
    """Plot tangent and secant rigidity EA [kN] against the tension [N].

    A law without a highest tension is drawn up to 1000 N.
    """
    tension = np.linspace(law.low, law.high if math.isfinite(law.high) else _ENDLESS, 400)
    figure, ((axes,),) = style.panels(style.ONE_COLUMN, 2.3)
    axes.plot(tension, KN * law.rigidity(tension), label="tangent, dF/dε")
    axes.plot(tension, KN * law.secant_rigidity(tension), "--", label="secant")
    axes.set(xlabel="tension [N]", ylabel="rigidity EA [kN]")
    axes.set_ylim(bottom=0.0)
    axes.legend()
    return figure
