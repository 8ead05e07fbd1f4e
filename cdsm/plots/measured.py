"""Plot fits with their measurements, and plans of measurements."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdsm.plots.style import (
    BLUE,
    COLOR_MAP,
    KN,
    MM,
    N_PER_MM,
    NAMED,
    SMALL,
    TWO_COLUMNS,
    VERMILLION,
    heading,
    legend,
    legend_below,
    number_colors,
    panels,
)
from cdsm.support.format import plural

if TYPE_CHECKING:
    from cdsm.identification.experiment_plan import ExperimentPlan
    from cdsm.identification.measurement import WeightLoop
    from cdsm.identification.result import Identification
    from cdsm.wires.tensile_fit import TensileFit

_BROAD = 0.25  # stages wider than this fraction of the whole range have horizontal names
_MOST_LABELS = 30  # above this number of measurements the axis shows numbers, not names


def plot_tensile_fit(fit: TensileFit) -> Figure:
    """Plot force against strain, measured and fitted, and the fitted rigidity EA against tension.

    The second panel also shows the stages of the wire and the 95 % band of EA.
    """
    figure, ((left, right),) = panels(TWO_COLUMNS, 3.0, 2)
    tension, band = fit.tension, fit.band
    length = fit.test.gauge_length
    measured = 100.0 * fit.test.displacement / length
    fitted = 100.0 * (fit.start / length + fit.elasticity.strain(tension))
    left.plot(measured, fit.test.force, ".", color="0.6", ms=3, label="test")
    left.plot(fitted, tension, color=VERMILLION, label="fit")
    left.set(xlabel="strain [%]", ylabel="force [N]")
    ends = KN * band.low, KN * band.high
    right.fill_between(tension, *ends, color=BLUE, alpha=0.3, linewidth=0, label="95 % band")
    right.plot(tension, KN * fit.rigidity, color=VERMILLION, label="EA")
    shade_stages(right, fit.stages)
    right.set(xlabel="tension [N]", ylabel="tangent rigidity EA [kN]")
    right.set_ylim(0.0, 1.1 * right.get_ylim()[1])  # room for the names of the stages
    for axes in (left, right):
        legend(axes)
    return figure


def shade_stages(axes: Any, stages: Sequence[tuple[str, float, float]], along: str = "x") -> None:
    """Shade and name the ``stages`` of a wire: each has a name, a lowest and a highest tension [N].

    ``along`` is the axis of the tension: ``"x"`` or ``"y"``.
    """
    whole = stages[-1][2] - stages[0][1]
    for (name, low, high), shade in zip(stages, cycle(("0.93", "0.98", "0.88")), strict=False):
        middle, shown = (low + high) / 2.0, {"fontsize": SMALL, "color": "0.3"}
        if along == "x":
            axes.axvspan(low, high, color=shade, zorder=0, linewidth=0)
            turn = 90.0 if high - low < _BROAD * whole else 0.0
            where = {"transform": axes.get_xaxis_transform(), "ha": "center", "va": "top"}
            axes.text(middle, 0.98, name, rotation=turn, **where, **shown)
        else:
            axes.axhspan(low, high, color=shade, zorder=0, linewidth=0)
            where = {"transform": axes.get_yaxis_transform(), "va": "center"}
            axes.text(0.02, middle, name.replace("\n", " "), **where, **shown)


def plot_identification(fit: Identification, labels: Sequence[str], title: str) -> Figure:
    """Plot predicted and measured values, and residuals divided by σ.

    ``labels`` has a text for each residual; more than 30 residuals are numbered instead.
    """
    rows = [fit.measurements[i] for i in fit.measurement_of]
    loops: list[tuple[int, Any]] = [
        (i, each) for i, each in enumerate(fit.measurements) if hasattr(each, "forces")
    ]
    stiff = [k for k, each in enumerate(rows) if not hasattr(each, "forces")]
    figure, (axes,) = panels(TWO_COLUMNS, 3.2, 1 + bool(stiff) + bool(loops))
    *left, right = axes
    if stiff:
        _plot_stiffnesses(left[0], fit, stiff)
    if loops:
        named = len(loops) <= NAMED
        shades = colormaps[COLOR_MAP](np.linspace(0.0, 0.8, len(loops)))
        colors = shades if named else number_colors(left[-1], len(loops), "loop")
        for color, (i, loop) in zip(colors, loops, strict=True):
            own = [k for k, each in enumerate(rows) if each is loop]
            _plot_loop(left[-1], fit, loop, own, color)
            if named and len(loops) > 1:
                left[-1].plot([], [], color=color, label=loop.label or f"[{i}]")
        left[-1].set(xlabel="force [N]", ylabel="displacement along force [mm]")
        line, dot = ({"color": "0.2", **style} for style in ({}, {"marker": ".", "ls": ""}))
        left[-1].plot([], [], label="predicted", **line)
        left[-1].plot([], [], label="measured", **dot)
        legend_below(figure, left[-1], 5)
    place = np.arange(len(rows))
    for width, shade in ((2.0, 0.12), (1.0, 0.2)):
        right.axhspan(-width, width, color="0.5", alpha=shade, linewidth=0.0)
    right.vlines(place, 0.0, fit.residuals, color=BLUE, linewidth=1.2)
    right.plot(place, fit.residuals, "o", color=BLUE, markersize=4 if len(rows) < 100 else 2)
    right.axhline(0.0, color="0.2", linewidth=0.8)
    right.set_ylabel("(predicted − measured)/σ")
    if len(rows) <= _MOST_LABELS and any(measurement.label for measurement in fit.measurements):
        right.set_xticks(place, labels, rotation=90, fontsize=SMALL)
    else:
        right.set_xlabel("reading" if loops else "measurement")
        right.xaxis.set_major_locator(MaxNLocator(integer=True))
    heading(figure, title)
    return figure


def _plot_stiffnesses(axes: Any, fit: Identification, rows: Sequence[int]) -> None:
    measured, predicted = N_PER_MM * fit.measured[rows], N_PER_MM * fit.predicted[rows]
    sigma = [N_PER_MM * fit.measurements[fit.measurement_of[k]].std for k in rows]
    ends = [min(measured.min(), predicted.min()), max(measured.max(), predicted.max())]
    axes.plot(ends, ends, color="0.6", linewidth=0.9)
    axes.errorbar(measured, predicted, xerr=sigma, fmt="o", color=BLUE, markersize=4, capsize=2)
    axes.set(xlabel="measured [N/mm], ± σ", ylabel="predicted [N/mm]")


def _plot_loop(
    axes: Any, fit: Identification, loop: WeightLoop, rows: Sequence[int], colour: Any
) -> None:
    """Plot measured and predicted displacements of a loop [mm] against the force [N].

    All are along the force, less the first measured one. ``rows`` are the rows of the loop in
    ``fit``.
    """
    u = np.array(loop.direction) / np.linalg.norm(loop.direction)
    along = loop.axes @ u
    read, model = (
        MM * x[rows].reshape(-1, along.size) @ along for x in (fit.measured, fit.predicted)
    )
    axes.plot(loop.forces, model - read[0], color=colour, linewidth=1.0)
    axes.plot(loop.forces, read - read[0], ".", color=colour, markersize=5)


def plot_experiment_plan(plan: ExperimentPlan) -> Figure:
    """Plot the expected 95 % interval of each parameter, and how often each candidate is tested."""
    figure, ((left, right),) = panels(TWO_COLUMNS, 3.2, 2)
    half = 196.0 * plan.std / abs(plan.values)
    left.barh(np.arange(half.size), np.where(np.isfinite(half), half, 0.0), color=BLUE)
    for y in np.flatnonzero(~np.isfinite(half)):
        left.text(0.0, y, " not determined", va="center", fontsize=SMALL)
    left.set_yticks(np.arange(half.size), plan.names)
    left.invert_yaxis()
    left.set_xlabel("95 % interval, ± % of the expected value")
    right.bar(np.arange(plan.counts.size), plan.counts, color=VERMILLION)
    right.set(xlabel="candidate", ylabel="tests")
    for axis in (right.xaxis, right.yaxis):
        axis.set_major_locator(MaxNLocator(integer=True))
    heading(figure, plural(len(plan.tests), "test"))
    return figure
