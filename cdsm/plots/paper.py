"""The paper's figures, recomputed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from cdsm import paper
from cdsm._checks import Array
from cdsm.plots.arm import draw_arm
from cdsm.plots.style import AXES, COLORS, MM, N_PER_MM, STYLES


def plot_paper(result: paper.Result) -> Figure:
    """One recomputed figure of the paper.

    Of a stiffness its own reading above, that of a hung weight below; the cable tension is the
    mean, and the bars are the range over all cables, as in the paper.

    Args:
        result: What a function in :data:`cdsm.paper.FIGURES` returns.
    """
    if isinstance(result, paper.StrandFigure):
        return _plot_strand(result)
    if isinstance(result, paper.ExperimentFigure):
        return _plot_experiment(result)
    if isinstance(result, paper.PrototypeFigure):
        return _plot_prototype(result)
    return _plot_postures(result) if len(result.curves) == 3 else _plot_directions(result)


def _plot_strand(result: paper.StrandFigure) -> Figure:
    """(a) force over displacement, (b) rigidity over tension."""
    figure = Figure(figsize=(10.0, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(MM * result.displacement, result.tension, color=COLORS[0])
    left.set(
        xlabel=f"stretch of a {MM * result.gauge_length:g} mm wire [mm]",
        ylabel="force [N]",
        title="(a)",
    )
    kilo = 1e-3
    right.plot(result.tension, kilo * result.tangent, color=COLORS[0], label="tangent, repaired")
    right.plot(result.tension, kilo * result.secant, "--", color=COLORS[2], label="secant (Eq. 18)")
    right.plot(result.tension, kilo * result.printed, ":", color=COLORS[1], label="as printed")
    right.set_ylim(-5.0, 1.1 * kilo * result.tangent.max())  # as printed it falls to -788 kN
    right.set(xlabel="tension [N]", ylabel="rigidity EA [kN]", title="(b)")
    right.legend(fontsize=8)
    for axes in (left, right):
        axes.grid(alpha=0.3)
    figure.suptitle(result.title)
    return figure


def _plot_directions(result: paper.Figure) -> Figure:
    """A column for each direction, a curve for each case."""
    rows: list[tuple[str, Callable[[paper.Curve], Array]]] = [
        ("paper's reading", lambda curve: curve.pseudoinverse),
        ("hung weight", lambda curve: curve.along),
    ]
    if result.name == "fig4":  # the only one whose original shows it
        rows.insert(0, ("active part", lambda curve: curve.pseudoinverse_part))
    figure = Figure(figsize=(11.0, 2.7 * len(rows) + 0.6), layout="constrained")
    grid: Any = figure.subplots(len(rows), 3, sharex=True, squeeze=False)
    for row, (reading, values) in zip(grid, rows, strict=True):
        for i, axes in enumerate(row):
            for curve, style in zip(result.curves, STYLES, strict=False):
                _draw_curve(axes, result, curve, values(curve)[:, i], COLORS[i], style)
                if result.part == "passive" and reading == "paper's reading":
                    x = _swept(result, curve)
                    axes.plot(x, N_PER_MM * curve.pseudoinverse_part[:, i], "k.", markersize=3)
            axes.set_ylabel(f"$K_{AXES[i]}$, {reading} [N/mm]")
            axes.grid(alpha=0.3)
    _finish(figure, grid, result)
    return figure


def _plot_postures(result: paper.Figure) -> Figure:
    """A column for each posture: its picture, and a curve for each direction."""
    figure = Figure(figsize=(11.0, 9.0), layout="constrained")
    grid = figure.add_gridspec(3, 3, height_ratios=(1.15, 1.0, 1.0))
    bottom = []
    for i, (curve, pose) in enumerate(zip(result.curves, result.postures, strict=True)):
        picture: Any = figure.add_subplot(grid[0, i], projection="3d")
        draw_arm(picture, pose, None)
        picture.set_title(curve.label, fontsize=10)
        for row, (reading, values) in enumerate(
            (("paper's reading", curve.pseudoinverse), ("hung weight", curve.along)), start=1
        ):
            axes: Any = figure.add_subplot(grid[row, i])
            for j, (name, color) in enumerate(zip(AXES, COLORS, strict=True)):
                _draw_curve(axes, result, curve, values[:, j], color, "-", label=name)
            axes.set_ylabel(f"stiffness, {reading} [N/mm]")
            axes.grid(alpha=0.3)
        bottom.append(axes)
    handles, labels = bottom[0].get_legend_handles_labels()
    figure.legend(handles, labels, title="direction", ncols=3, loc="outside lower center")
    _finish(figure, [bottom], result, legend=False)
    return figure


def _plot_experiment(result: paper.ExperimentFigure) -> Figure:
    """A panel for each trace: computed as a line, the paper's values as dots."""
    scale = 1.0 if result.relative else N_PER_MM
    unit = "stiffness in y over the first [-]" if result.relative else "stiffness [N/mm]"
    tension = result.swept == "tension"
    figure = Figure(figsize=(3.7 * len(result.traces) + 1.0, 3.8), layout="constrained")
    grid: Any = figure.subplots(1, len(result.traces))
    for axes, trace, color in zip(grid, result.traces, COLORS, strict=False):
        across = 1.0 if tension else N_PER_MM
        axes.plot(across * trace.swept, scale * trace.computed, color=color, label="computed")
        axes.plot(across * trace.paper_at, scale * trace.paper, "ko", markersize=4, label="paper")
        axes.set(
            title=trace.label,
            xlabel="tension as reported [N]" if tension else "cable stiffness [N/mm]",
            ylabel=unit,
        )
        axes.set_ylim(bottom=0.0)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    figure.suptitle(result.title)
    return figure


def _plot_prototype(result: paper.PrototypeFigure) -> Figure:
    """Residual number by number, with all data and with what contradicts them most left out."""
    names = paper.section_v.NAMES
    best = sorted(result.without, key=lambda left_out: result.without[left_out].cost)[:2]
    fits = {
        "all data": result.fit,
        **{f"without {left_out}": result.without[left_out] for left_out in best},
    }
    figure = Figure(figsize=(8.0, 7.0), layout="constrained")
    axes: Any = figure.subplots()
    places = np.arange(len(names))
    for (label, fit), marker, color in zip(fits.items(), "os^", COLORS, strict=True):
        counted = np.array([name not in fit.without for name in names])
        axes.plot(
            100.0 * fit.residuals[counted],
            places[counted],
            marker,
            color=color,
            markersize=5,
            alpha=0.8,
            label=label,
        )
    axes.axvline(0.0, color="0.2", linewidth=0.8)
    axes.set_yticks(places, names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("100 ln(model/paper); Figs. 12, 13: (model − paper)/paper [%]")
    axes.grid(alpha=0.3)
    figure.legend(loc="outside lower center", ncols=3, fontsize=8)
    figure.suptitle(result.title)
    return figure


def _draw_curve(
    axes: Any,
    result: paper.Figure,
    curve: paper.Curve,
    values: Array,
    color: str,
    style: str,
    label: str | None = None,
) -> None:
    x = _swept(result, curve)
    axes.plot(x, N_PER_MM * values, style, color=color, label=label or curve.label)
    if result.swept == "tension":
        low, mean, high = curve.tension.T
        spread = np.array([mean - low, high - mean])
        some = slice(None, None, max(1, len(x) // 8))
        axes.errorbar(
            x[some],
            N_PER_MM * values[some],
            xerr=spread[:, some],
            fmt="none",
            ecolor=color,
            elinewidth=0.7,
            alpha=0.5,
        )


def _swept(result: paper.Figure, curve: paper.Curve) -> Array:
    return curve.swept / 1e9 if result.swept == "young_modulus" else curve.tension[:, 1]


def _finish(figure: Figure, grid: Any, result: paper.Figure, *, legend: bool = True) -> None:
    label = {
        "young_modulus": "Young's modulus [GPa]",
        "tension": "cable tension, mean and range [N]",
    }[result.swept]
    for axes in grid[-1]:
        axes.set_xlabel(label)
    note = "dots: passive part alone" if result.part == "passive" else ""
    if legend and (note or len(result.curves) > 1):
        grid[0][0].legend(fontsize=8, title=note or None, title_fontsize=8)
    figure.suptitle(result.title)
