"""Plot the recomputed figures of the paper."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.figure import Figure

from cdsm.errors import InvalidInput
from cdsm.plots.arm import draw_arm, frame_arms
from cdsm.plots.style import AXES, COLORS, KN, MM, N_PER_MM, STYLES, legend_below, panels
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm import paper

_LENGTHS: Final = {"stretched": "$l_0 = L$ (paper)", "unstrained": "original $l_0$"}
_READINGS: Final = {"pseudoinverse": "paper's reading", "along": "hung weight"}
_SWEPT: Final = {
    "young_modulus": "Young's modulus [GPa]",
    "tension": "cable tension, mean and range [N]",
}


def plot_paper(result: paper.Figure) -> Figure:
    """Plot one recomputed figure of the paper.

    A stiffness has two readings: the paper's K_R above, a hung weight below. Each is shown with
    the stretched length in EA/l_0, as in the paper, and with the original length. The cable
    tension is the mean, and bars show the range over all cables, as in the paper.

    Args:
        result: Result of a function in :data:`cdsm.paper.FIGURES`.

    Raises:
        InvalidInput: ``result`` is not a figure of :mod:`cdsm.paper`.
    """
    draw = _DRAWN.get(getattr(result, "name", ""))
    if draw is None:
        raise InvalidInput("result", f"{result!r} given; a figure of cdsm.paper is needed.")
    figure = draw(result)
    figure.suptitle(result.title)
    return figure


def _plot_strand(result: paper.StrandFigure) -> Figure:
    """Plot (a) force over displacement, (b) rigidity over tension."""
    figure, ((left, right),) = panels(10.0, 4.0, 2)
    left.plot(MM * result.displacement, result.tension, color=COLORS[0])
    left.set(
        xlabel=f"stretch of a {MM * result.gauge_length:g} mm wire [mm]",
        ylabel="force [N]",
        title="(a)",
    )
    right.fill_between(
        result.tension,
        KN * result.low,
        KN * result.high,
        color=COLORS[0],
        alpha=0.15,
        linewidth=0.0,
        label="tangent, all laws of the printed digits",
    )
    right.plot(result.tension, KN * result.tangent, color=COLORS[0], label="tangent, repaired")
    right.plot(result.tension, KN * result.secant, "--", color=COLORS[2], label="secant (Eq. 18)")
    lower = result.tension <= result.join  # above, the printed and the repaired law share digits
    right.plot(
        result.tension[lower],
        KN * result.printed[lower],
        ":",
        color=COLORS[1],
        label="as printed, below 31 N",
    )
    right.set_ylim(-5.0, 1.05 * KN * result.high.max())  # the printed law falls to -788 kN
    right.set(xlabel="tension [N]", ylabel="rigidity EA [kN]", title="(b)")
    right.legend(fontsize=8, loc="upper left")
    return figure


def _plot_directions(result: paper.StiffnessFigure) -> Figure:
    """Plot a row for each reading, a column for each direction, a curve for each case."""
    over_tension = result.swept == "tension"
    curves = result.curves + (result.original if over_tension else ())
    figure, grid = panels(11.0, 6.0, 3, 2, sharex=True)
    for row, (name, reading) in zip(grid, _READINGS.items(), strict=True):
        for i, axes in enumerate(row):
            for curve, style in zip(curves, STYLES, strict=False):
                label = _LENGTHS[curve.original_length] if over_tension else curve.label
                line = {"color": COLORS[i], "linestyle": style, "label": label}
                _draw_curve(axes, result, curve, getattr(curve, name)[:, i], **line)
                if result.part == "passive" and name == "pseudoinverse":
                    passive = N_PER_MM * curve.pseudoinverse_part[:, i]
                    axes.plot(_swept(result, curve), passive, "k.", markersize=3)
            axes.set_ylabel(f"$K_{AXES[i]}$, {reading} [N/mm]")
    note = "dots: passive part alone" if result.part == "passive" else None
    grid[0, 0].legend(fontsize=8, title=note, title_fontsize=8)
    for axes in grid[-1]:
        axes.set_xlabel(_SWEPT[result.swept])
    return figure


def _plot_changes(result: paper.StiffnessFigure) -> Figure:
    """Plot a column for each axis: active part, and change of stiffness since the first tension."""
    figure, grid = panels(11.0, 9.0, 3, 3, sharex=True, sharey="row")
    first, stated = result.curves[0], result.claims[0].paper or ()
    for i, color in enumerate(COLORS):
        active, *changes = grid[:, i]
        _draw_curve(active, result, first, first.pseudoinverse_part[:, i], color=color)
        active.set(title=AXES[i])
        for axes, name in zip(changes, _READINGS, strict=True):
            for pair, shade in zip(
                zip(result.curves, result.original, strict=True), (color, "0.45"), strict=False
            ):
                for curve, style in zip(pair, ("-", "--"), strict=True):
                    values = getattr(curve, name)[:, i]
                    rigidity, length = curve.label.split(" (")[0], _LENGTHS[curve.original_length]
                    axes.plot(
                        curve.tension[:, 1],
                        100.0 * (values / values[0] - 1.0),
                        style,
                        color=shade,
                        label=f"{rigidity}, {length}",
                    )
            axes.axhline(0.0, color="0.2", linewidth=0.6)
        end = first.tension[-1, 1]
        changes[0].plot([end], [stated[i]], "ko", markersize=5, label="paper, at the end")
        changes[1].set_xlabel("cable tension, mean [N]")
    grid[0, 0].set_ylabel("active part, EA = 48 kN [N/mm]")
    grid[1, 0].set_ylabel("change, paper's reading of $K_R$ [%]")
    grid[2, 0].set_ylabel("change, hung weight [%]")
    legend_below(figure, grid[1, 0], 3, fontsize=9)
    return figure


def _plot_lead(result: paper.LeadFigure) -> Figure:
    """Plot a panel for each reading, a colour for each direction."""
    figure, (pair,) = panels(10.0, 4.6, 2, sharey=True)
    for axes, name in zip(pair, _READINGS, strict=True):
        for i, (axis, color) in enumerate(zip(AXES, COLORS, strict=True)):
            for changes, length, style in (
                (getattr(result, f"stretched_{name}"), "stretched", "-"),
                (getattr(result, name), "unstrained", "--"),
            ):
                label = f"{axis}, {_LENGTHS[length]}"
                axes.plot(MM * result.leads, changes[:, i], style, color=color, label=label)
        axes.axhline(0.0, color="0.2", linewidth=0.8)
        axes.set_xscale("symlog", linthresh=10.0, linscale=0.6)
        axes.set_xlim(0.0, MM * result.leads[-1])
        axes.set_xticks([0.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 300.0])
        axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
        axes.set_xlabel("lead of all cables [mm]")
    pair[0].set(title="paper's reading of $K_R$", ylabel="change of stiffness [%]")
    pair[1].set(title="hung weight")
    legend_below(figure, pair[0], 3, fontsize=9)
    return figure


def _plot_postures(result: paper.StiffnessFigure) -> Figure:
    """Plot a column for each posture: a picture of the arm, and a curve for each direction."""
    figure = Figure(figsize=(11.0, 9.0), layout="constrained")
    grid = figure.add_gridspec(3, 3, height_ratios=(1.15, 1.0, 1.0))
    for column, (curve, original, pose) in enumerate(
        zip(result.curves, result.original, result.postures, strict=True)
    ):
        picture: Any = figure.add_subplot(grid[0, column], projection="3d")
        draw_arm(picture, pose)
        frame_arms(picture, None)
        picture.set_title(curve.label, fontsize=10)
        for row, (name, reading) in enumerate(_READINGS.items(), start=1):
            axes: Any = figure.add_subplot(grid[row, column])
            for i, (axis, color) in enumerate(zip(AXES, COLORS, strict=True)):
                values = getattr(curve, name)[:, i]
                _draw_curve(axes, result, curve, values, color=color, label=axis)
                unstrained = N_PER_MM * getattr(original, name)[:, i]
                axes.plot(_swept(result, curve), unstrained, "k:", linewidth=0.8)
            axes.set_ylabel(f"stiffness, {reading} [N/mm]")
            axes.grid(alpha=0.3)
        axes.set_xlabel(_SWEPT[result.swept])
    title = "direction; solid: l_0 = L (paper), dotted: original length"
    legend_below(figure, axes, 3, title=title)  # the last panel: all have the same three lines
    return figure


def _plot_experiment(result: paper.ExperimentFigure) -> Figure:
    """Plot a panel for each trace: a line of computed values, dots for the paper's values."""
    scale = 1.0 if result.relative else N_PER_MM
    unit = "stiffness in y over the first [-]" if result.relative else "stiffness [N/mm]"
    tension = result.swept == "tension"
    rows, columns = -(-len(result.traces) // 3), min(len(result.traces), 3)
    size = 3.7 * columns + 1.0, 3.3 * rows + 0.5
    figure, grid = panels(*size, columns, rows, sharex="col", sharey="col")
    for axes, trace, color in zip(grid.ravel(), result.traces, COLORS * rows, strict=False):
        across = 1.0 if tension else N_PER_MM
        axes.plot(across * trace.swept, scale * trace.computed, color=color, label="computed")
        axes.plot(across * trace.paper_at, scale * trace.paper, "ko", markersize=4, label="paper")
        axes.set(
            xlabel="tension as reported [N]" if tension else "cable stiffness [N/mm]", ylabel=unit
        )
        axes.set_title(textwrap.fill(trace.label, 44), fontsize=9)
        axes.set_ylim(bottom=0.0)
        axes.legend(fontsize=8)
    return figure


def _plot_prototype(result: paper.PrototypeFigure) -> Figure:
    """Plot the residual of each number of Section V, for each reading of Table II."""
    names = result.fits[0].step.numbers
    figure, ((axes,),) = panels(8.5, 7.0, 1)
    places = np.arange(len(names))
    for fit, marker, color in zip(result.fits, "os^D", (*COLORS, "0.3"), strict=True):
        axes.plot(
            100.0 * fit.residuals,
            places[: fit.residuals.size],
            marker,
            color=color,
            markersize=5,
            alpha=0.8,
            label=f"{fit.step.label}: {fit.step.count}",
        )
    axes.axvline(0.0, color="0.2", linewidth=0.8)
    axes.set_yticks(places, names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("100 ln(model/paper); Figs. 12, 13: (model − paper)/paper [%]")
    figure.legend(loc="outside lower center", ncols=1, fontsize=8)
    return figure


def _draw_curve(
    axes: Any, result: paper.StiffnessFigure, curve: paper.Curve, values: Array, **line: Any
) -> None:
    """Draw a stiffness [N/m] over the swept quantity; bars show the range of tension."""
    x, y = _swept(result, curve), N_PER_MM * values
    axes.plot(x, y, **line)
    if result.swept == "tension":
        low, mean, high = curve.tension.T
        every = slice(None, None, max(1, len(x) // 8))
        axes.errorbar(
            x[every],
            y[every],
            xerr=np.array([mean - low, high - mean])[:, every],
            fmt="none",
            ecolor=line["color"],
            elinewidth=0.7,
            alpha=0.5,
        )


def _swept(result: paper.StiffnessFigure, curve: paper.Curve) -> Array:
    return curve.swept / 1e9 if result.swept == "young_modulus" else curve.tension[:, 1]


_DRAWN: Final[dict[str, Callable[[Any], Figure]]] = {
    "fig3": _plot_directions,
    "fig4": _plot_changes,
    "fig5": _plot_strand,
    "fig6": _plot_directions,
    "fig7": _plot_changes,
    "fig8": _plot_postures,
    "fig10": _plot_experiment,
    "fig12": _plot_experiment,
    "fig13": _plot_experiment,
    "lead": _plot_lead,
    "prototype": _plot_prototype,
}
"""Function that draws each figure of :data:`cdsm.paper.FIGURES`, by name."""
