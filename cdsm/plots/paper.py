"""Plot the recomputed figures of the paper: stiffness against Young's modulus, tension and lead.

Columns of panels are the directions x, y and z, or postures. Rows are two definitions of the tip
stiffness, the "readings": the paper's K_R, and the stiffness that a hung weight measures.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.figure import Figure

from cdsm.errors import InvalidInput
from cdsm.plots.arm import draw_arm, frame_arms
from cdsm.plots.paper_experiments import plot_experiment, plot_strand
from cdsm.plots.style import (
    BLUE,
    COLORS,
    MM,
    N_PER_MM,
    ORANGE,
    SCREEN,
    SMALL,
    STYLES,
    TWO_COLUMNS,
    VERMILLION,
    caption,
    heading,
    legend_below,
    panels,
    plain_log_ticks,
    styled,
)
from cdsm.support.directions import XYZ
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm import paper

_LENGTHS: Final = {"stretched": "$l_0 = L$, as in the paper", "unstrained": "original $l_0$"}
_READINGS: Final = {"pseudoinverse": "paper's reading\n$K_R$", "along": "hung weight\n$1/C$"}
_NOTE: Final = (
    "paper's reading: diagonal of $K_R = J^{+T} K_\\theta J^+$; "
    "hung weight: $1/(u^T C\\,u)$, what a small weight at the tip measures"
)
_SWEPT: Final = {"young_modulus": "Young's modulus [GPa]", "tension": "cable tension, mean [N]"}
_BARS: Final = 5  # number of bars on a curve that show the range of tension over the cables
_WIDE: Final = {"linewidth": 4.0, "alpha": 0.4}  # a line under another one, both visible


def plot_paper(result: paper.Figure) -> Figure:
    """Plot one recomputed figure of the paper, with the numbers that the paper prints.

    Figures of stiffness show the paper's K_R, and the stiffness that a hung weight measures. Both
    are computed from EA/L with the stretched length L, as in the paper, and from EA/l_0 with the
    original length l_0. The tension on a horizontal axis is the mean of all cables; bars show the
    range over the cables, as in the paper.

    Args:
        result: Result of a function in :data:`cdsm.paper.FIGURES`.

    Raises:
        InvalidInput: ``result`` is not a figure of :mod:`cdsm.paper`.
    """
    draw = _DRAWN.get(getattr(result, "name", ""))
    if draw is None:
        raise InvalidInput("result", f"{result!r} given; a figure of cdsm.paper is needed.")
    figure = draw(result)
    heading(figure, result.title)
    return figure


def _grid(
    result: paper.StiffnessFigure, height: float, rows: int, **options: Any
) -> tuple[Figure, Any]:
    """Build a figure of ``rows`` with the panels x, y and z; it is two columns wide.

    ``height`` is in inches; ``options`` are passed to ``Figure.subplots``.
    """
    figure, grid = panels(TWO_COLUMNS, height, 3, rows, sharex=True, **options)
    for axes, axis in zip(grid[0], XYZ, strict=True):
        caption(axes, axis)
    for axes in grid[-1]:
        axes.set_xlabel(_SWEPT[result.swept])
    return figure, grid


def _plot_moduli(result: paper.StiffnessFigure) -> Figure:
    """Plot Fig. 3: K_R, stiffness for a hung weight, and a difference, against Young's modulus.

    The difference is the passive part minus the total stiffness, over the total stiffness [%].
    """
    figure, grid = _grid(result, 5.4, 3)
    ratio, limit = (result.claims[k].paper or () for k in (0, 1))
    looks: tuple[dict[str, Any], ...] = (
        {"color": BLUE, "linewidth": 1.2, "zorder": 3},
        {"color": ORANGE, **_WIDE},
    )
    for row, (name, reading) in zip(grid, _READINGS.items(), strict=False):
        row[0].set_ylabel(f"{reading} [N/mm]")
        for i, axes in enumerate(row):
            for curve, look in zip(result.curves, looks, strict=True):
                values = N_PER_MM * getattr(curve, name)[:, i]
                axes.plot(_abscissa(result, curve), values, label=curve.label, **look)
                passive = N_PER_MM * getattr(curve, f"{name}_part")[:, i]
            axes.plot(
                _abscissa(result, curve)[::4], passive[::4], "k.", ms=4, label="passive part alone"
            )
            axes.set_ylim(0.0, 1.12 * values.max())
    first = result.curves[0]
    x, stated = _abscissa(result, first), "paper: proportional, twice at 320 GPa"
    for i, axes in enumerate(grid[0]):
        doubled = N_PER_MM * ratio[i] * first.pseudoinverse[0, i]
        axes.plot(x[-1], doubled, "kD", markerfacecolor="none", markersize=6, label=stated)
    grid[2, 0].set_ylabel("passive less\ntotal [%]")
    for i, axes in enumerate(grid[2]):
        axes.axhspan(-limit[0], limit[0], color="0.9", linewidth=0, label="paper: within 1.5 %")
        for curve, look in zip(result.curves, looks, strict=True):
            for (name, reading), style in zip(_READINGS.items(), ("-", "--"), strict=True):
                whole, part = getattr(curve, name)[:, i], getattr(curve, f"{name}_part")[:, i]
                label = f"difference, {reading.splitlines()[0]}"
                axes.plot(x, 100.0 * (part / whole - 1.0), style, **look)
                axes.plot([], [], style, color="0.2", label=label)
        axes.set_ylim(-1.2 * limit[0], 1.2 * limit[0])
    legend_below(figure, grid[:, 0], 3, title=_NOTE)
    return figure


def _plot_directions(result: paper.StiffnessFigure) -> Figure:
    """Plot Fig. 6: K_R and the stiffness for a hung weight, against tension.

    The increment that the paper states is marked.
    """
    figure, grid = _grid(result, 4.4, 2)
    increments = result.claims[0].paper or ()
    for row, (name, reading) in zip(grid, _READINGS.items(), strict=True):
        row[0].set_ylabel(f"{reading} [N/mm]")
        for i, axes in enumerate(row):
            (curve,), (original,) = result.curves, result.original
            _draw_curve(
                axes, curve, getattr(curve, name)[:, i], color=BLUE, label=_LENGTHS["stretched"]
            )
            values = N_PER_MM * getattr(original, name)[:, i]
            line = {"color": VERMILLION, "label": _LENGTHS["unstrained"]}
            axes.plot(original.tension[:, 1], values, "--", **line)
            axes.set_ylim(0.0, 1.12 * values.max())
    for i, axes in enumerate(grid[0]):
        end = N_PER_MM * (1.0 + increments[i]) * curve.pseudoinverse[0, i]
        label = "paper: stated increment, from the first computed value"
        axes.plot(curve.tension[-1, 1], end, "ko", markersize=4, label=label)
        words = {"transform": axes.transAxes, "ha": "right", "fontsize": SMALL}
        axes.text(0.97, 0.05, f"paper: +{increments[i]:g} times", **words)
    legend_below(figure, grid[0, 0], 3, title=_NOTE)
    return figure


def _plot_changes(result: paper.StiffnessFigure) -> Figure:
    """Plot Figs. 4 and 7: active part of K_R, and changes [%] of both stiffnesses, over tension."""
    figure, grid = _grid(result, 5.6, 3, sharey="row")
    first, stated = result.curves[0], result.claims[0].paper or ()
    for i in range(3):
        active, *changes = grid[:, i]
        _draw_curve(active, first, first.pseudoinverse_part[:, i], color=BLUE)
        for axes, name in zip(changes, _READINGS, strict=True):
            for pair, shade in zip(
                zip(result.curves, result.original, strict=True), (BLUE, ORANGE), strict=False
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
        changes[0].plot([end], [stated[i]], "ko", markersize=4, label="paper, at the end")
    grid[0, 0].set_ylabel("active part of $K_R$ [N/mm]")
    for axes, reading in zip(grid[1:, 0], _READINGS.values(), strict=True):
        axes.set_ylabel(f"change, {reading} [%]")
    legend_below(figure, grid[:2, 0], 2, title=_NOTE)
    return figure


def _plot_lead(result: paper.LeadFigure) -> Figure:
    """Plot the change of K_R, and of the stiffness for a hung weight, against the lead.

    Each has a panel, with a colour for each of x, y and z.
    """
    figure, (pair,) = panels(TWO_COLUMNS, 3.4, 2, sharey=True)
    for row, (axes, reading) in enumerate(zip(pair, _READINGS.values(), strict=True)):
        for i, (axis, color) in enumerate(zip(XYZ, COLORS, strict=True)):
            for changes, length, style in (
                (result.stretched, "stretched", "-"),
                (result.original, "unstrained", "--"),
            ):
                label = f"{axis}, {_LENGTHS[length]}"
                axes.plot(MM * result.leads, changes[:, row, i], style, color=color, label=label)
        axes.axhline(0.0, color="0.2", linewidth=0.8)
        axes.set_xscale("symlog", linthresh=10.0, linscale=0.6)
        axes.set_xlim(0.0, MM * result.leads[-1])
        axes.set_xticks([0.0, 5.0, 10.0, 20.0, 50.0, 100.0, 300.0])
        axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
        axes.set_xlabel("lead of all cables [mm]")
        caption(axes, reading.replace("\n", ", "))
    pair[0].set_ylabel("change of stiffness [%]")
    legend_below(figure, pair[0], 3, title=_NOTE)
    return figure


def _plot_postures(result: paper.StiffnessFigure) -> Figure:
    """Plot Fig. 8: for each posture, a picture of the arm, K_R and stiffness for a hung weight."""
    figure = Figure(figsize=(TWO_COLUMNS, 6.4), dpi=SCREEN, layout="constrained")
    grid = figure.add_gridspec(3, 3, height_ratios=(1.1, 1.0, 1.0))
    for column, (curve, original, pose) in enumerate(
        zip(result.curves, result.original, result.postures, strict=True)
    ):
        picture: Any = figure.add_subplot(grid[0, column], projection="3d")
        draw_arm(picture, pose)
        frame_arms(picture, None)
        picture.set_axis_off()
        picture.set_box_aspect(picture._box_aspect, zoom=1.2)
        caption(picture, curve.label)
        for row, (name, reading) in enumerate(_READINGS.items(), start=1):
            axes: Any = styled(figure.add_subplot(grid[row, column]))
            for i, (axis, color) in enumerate(zip(XYZ, COLORS, strict=True)):
                for each, look in ((original, _WIDE), (curve, {"linestyle": STYLES[i]})):
                    values = N_PER_MM * getattr(each, name)[:, i]
                    label = f"{axis}, {_LENGTHS[each.original_length]}"
                    axes.plot(_abscissa(result, each), values, color=color, label=label, **look)
            axes.set_yscale("log")
            plain_log_ticks(axes.yaxis)
            if column == 0:
                axes.set_ylabel(f"{reading} [N/mm]")
        axes.set_xlabel(_SWEPT[result.swept])
    note = f"{_NOTE}\nthe paper prints no numbers here: a steep rise, then a slight decrease"
    legend_below(figure, axes, 3, title=note)  # the last panel: all have the same lines
    return figure


def _draw_curve(axes: Any, curve: paper.Curve, values: Array, **line: Any) -> None:
    """Draw stiffnesses ``values`` (N,) [N/m] against the mean tension of the cables.

    Bars show the range of tensions over the cables.
    """
    low, mean, high = curve.tension.T
    axes.plot(mean, N_PER_MM * values, **line)
    some = np.linspace(0, len(mean) - 1, _BARS).round().astype(int)
    axes.errorbar(
        mean[some],
        N_PER_MM * values[some],
        xerr=np.array([mean - low, high - mean])[:, some],
        fmt="none",
        ecolor="0.4",
        elinewidth=0.8,
        capsize=2.0,
        label="bars: range over the cables",
    )


def _abscissa(result: paper.StiffnessFigure, curve: paper.Curve) -> Array:
    return curve.swept / 1e9 if result.swept == "young_modulus" else curve.tension[:, 1]


_DRAWN: Final[dict[str, Callable[[Any], Figure]]] = {
    "fig3": _plot_moduli,
    "fig4": _plot_changes,
    "fig5": plot_strand,
    "fig6": _plot_directions,
    "fig7": _plot_changes,
    "fig8": _plot_postures,
    "fig10": plot_experiment,
    "fig12": plot_experiment,
    "fig13": plot_experiment,
    "lead": _plot_lead,
}
"""Function that draws each figure of :data:`cdsm.paper.FIGURES`, by name."""
