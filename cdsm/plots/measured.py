"""Plot fits with their measurements, and plans of measurements."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from cdsm.plots import style
from cdsm.plots.style import KN, MM, N_PER_MM
from cdsm.support.format import plural

if TYPE_CHECKING:
    from cdsm.identification.experiment_plan import ExperimentPlan
    from cdsm.identification.result import Identification
    from cdsm.wires.tensile_fit import TensileFit

_BROAD = 0.25  # stages wider than this fraction of the whole range have horizontal names
_MOST_LABELS = 30  # above this number of measurements the axis shows numbers, not names


@style.styled
def plot_tensile_fit(fit: TensileFit) -> Figure:
    """Plot force against strain, measured and fitted, and the fitted rigidity EA against tension.

    The second panel also shows the stages of the wire and the 95 % band of EA.
    """
    figure, ((left, right),) = style.panels(style.TWO_COLUMNS, 3.0, 2)
    tension, band, length = fit.tension, fit.band, fit.test.gauge_length
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
    """Shade and name the ``stages`` of a wire: each has a name, a lowest and a highest tension [N].

    ``along`` is the axis of the tension: ``"x"`` or ``"y"``.
    """
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
def plot_identification(fit: Identification, labels: Sequence[str], title: str) -> Figure:
    """Plot predicted and measured values, and residuals divided by σ.

    ``labels`` has a text for each residual; more than 30 residuals are numbered instead.
    """
    rows = fit._rows
    loops = [(i, one) for i, one in enumerate(fit.measurements) if hasattr(one, "forces")]
    stiff = [k for k, one in enumerate(rows) if not hasattr(one, "forces")]
    figure, (axes,) = style.panels(style.TWO_COLUMNS, 3.2, 1 + bool(stiff) + bool(loops))
    *left, right = axes
    if stiff:
        measured, predicted = N_PER_MM * fit.measured[stiff], N_PER_MM * fit.predicted[stiff]
        sigma = [N_PER_MM * fit._rows[k].std for k in stiff]  # type: ignore[union-attr]
        ends = [np.append(measured, predicted).min(), np.append(measured, predicted).max()]
        left[0].plot(ends, ends, color="0.6", linewidth=0.9)
        left[0].errorbar(measured, predicted, xerr=sigma, fmt="o", color=style.BLUE)
        left[0].set(xlabel="measured [N/mm], ± σ", ylabel="predicted [N/mm]")
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
        right.set_xticks(place, labels, rotation=90)
    else:
        right.set_xlabel("reading" if loops else "measurement")
        style.whole_numbers(right.xaxis)
    style.heading(figure, title)
    return figure


def _plot_loops(axes: Any, fit: Identification, loops: Sequence[tuple[int, Any]]) -> None:
    """Plot measured and predicted displacements of loops [mm] against the force [N].

    All are along the force, less the first measured one.
    """
    looks = style.line_looks([loop.label or f"[{i}]" for i, loop in loops])
    for look, (_, loop) in zip(looks, loops, strict=True):
        rows = [k for k, each in enumerate(fit._rows) if each is loop]
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
    """Plot the expected 95 % interval of each parameter, and how often each candidate is tested."""
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
    style.heading(figure, plural(len(plan.tests), "test"))
    return figure
