"""Plot load histories, weight tests and buckling."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import MaxNLocator

from cdsm.plots.style import (
    BESIDE,
    BLUE,
    COLORS,
    MM,
    ONE_COLUMN,
    SMALL,
    TICKS,
    TWO_COLUMNS,
    VERMILLION,
    cable_lines,
    caption,
    expect,
    heading,
    legend,
    panels,
)
from cdsm.support.directions import XYZ
from cdsm.support.format import plural

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdsm.statics.buckling import CriticalLoad, CriticalTension
    from cdsm.statics.load_cycle import LoadHistory
    from cdsm.statics.weight_test import WeightTest

_ROOM = 0.08  # margin above and below all values, as a fraction of their range
_SEEN = 2e-3  # a narrower range, relative to the axis, cannot be seen


def plot_weight_test(test: WeightTest) -> Figure:
    """Plot load against tip displacement, nonlinear and linear, and tensions against load.

    The legend names up to 24 cables; a colour bar numbers more. Raises InvalidInput if ``test`` is
    not a result of :func:`~cdsm.weight_test`.
    """
    expect("test", test, "WeightTest")
    figure, ((left, right),) = panels(TWO_COLUMNS, 3.0, 2)
    loads = np.concatenate([[0.0], test.loads])
    moved = np.vstack([np.zeros(3), test.displacements])
    for axis, color, marker, nonlinear, linear in zip(
        XYZ, COLORS, "os^", moved.T, test.tangent_displacement, strict=True
    ):
        left.plot(MM * nonlinear, loads, f"{marker}-", color=color, markersize=3, label=axis)
        left.plot([0.0, MM * linear], [0.0, loads[-1]], "--", color=color, linewidth=0.9)
    left.set(xlabel="displacement of the tip [mm]", ylabel="load [N]")
    left.locator_params("x", nbins=TICKS)
    legend(left, title="direction; dashed: linear")
    names = test.unloaded.pose.arm.cables.names
    cable_lines(right, loads, np.vstack([test.unloaded.tension, test.tensions]), names)
    right.set(xlabel="load [N]", ylabel="tension at each motor [N]")
    right.set_ylim(bottom=0.0)
    left_it = "; left its reference before the weight" if test.left_reference else ""
    weight = f"weight of {np.linalg.norm(test.force):.4g} N"
    heading(figure, f"{test.unloaded.pose.arm.name}: {weight}{left_it}")
    return figure


def plot_critical_tension(critical: CriticalTension) -> Figure:
    """Plot the stability margin against the lower bound of all tensions; shade unstable ranges.

    Raises InvalidInput if ``critical`` is not a result of :func:`~cdsm.critical_tension`.
    """
    expect("critical", critical, "CriticalTension")
    figure, ((axes,),) = panels(ONE_COLUMN, 2.6, 1)
    mark = "o" if critical.bounds.size == 1 else ""
    axes.plot(critical.bounds, critical.margins, color=BLUE, marker=mark)
    axes.axhline(0.0, color="0.2", linewidth=0.8)
    low, high = critical.examined
    shown = high if math.isinf(critical.minimum) or not critical.stable else 2.0 * critical.minimum
    # if no tension can be raised by itself, only one bound is examined: a point
    right = min(shown, high) if high > low else low + 1.0
    axes.set_xlim(low, right)
    margins = np.array([0.0, *critical.margins[critical.bounds <= shown]])
    room = _ROOM * np.ptp(margins)
    axes.set_ylim(margins.min() - room, margins.max() + room)
    edges = [low, *np.ravel(critical.stable), high]
    label = "unstable"
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if min(end, right) - start > _SEEN * (right - low):
            axes.axvspan(start, end, color=VERMILLION, alpha=0.15, linewidth=0.0, label=label)
            label = "_"
    if math.isfinite(critical.minimum) and critical.stable:
        axes.plot(critical.minimum, 0.0, "o", color=VERMILLION, markersize=4)
        axes.annotate(
            f"buckles at {critical.minimum:.4g} N",
            (critical.minimum, 0.0),
            xytext=(6, 8),
            textcoords="offset points",
            fontsize=SMALL,
        )
    unit = critical.posture.arm.stiffness_unit()
    axes.set(xlabel="lower bound of tension [N]", ylabel=f"smallest joint stiffness [{unit}]")
    caption(axes, critical.posture.arm.name)
    if label == "_":
        legend(axes)
    return figure


def plot_critical_load(critical: CriticalLoad) -> Figure:
    """Plot the stability margin against the factor of the load, up to the critical factor.

    Raises InvalidInput if ``critical`` is not a result of :func:`~cdsm.critical_load`.
    """
    expect("critical", critical, "CriticalLoad")
    figure, ((axes,),) = panels(ONE_COLUMN, 2.6, 1)
    axes.plot(critical.factors, critical.margins, color=BLUE)
    axes.axhline(0.0, color="0.2", linewidth=0.8)
    if math.isfinite(critical.factor):
        end = critical.factor, critical.margins[-1]
        axes.plot(*end, "o", color=VERMILLION, markersize=4)
        words = {"buckling": "buckles", "infeasible": "no balance", "elasticity": "end of a law"}
        label = f"{words[critical.limit]} at {critical.factor:.4g}"
        place = {"xytext": (-6, -12), "textcoords": "offset points", "ha": "right"}
        axes.annotate(label, end, fontsize=SMALL, **place)
    room = _ROOM * np.ptp([0.0, *critical.margins])
    axes.set_ylim(min(0.0, *critical.margins) - 2.0 * room, max(0.0, *critical.margins) + room)
    unit = critical.posture.arm.stiffness_unit()
    axes.set(xlabel="factor of the load", ylabel=f"smallest joint stiffness [{unit}]")
    load = " ".join(f"{x:.3g}" for x in critical.load[:3])
    caption(axes, f"{critical.posture.arm.name}: load ({load}) N")
    return figure


def plot_load_history(history: LoadHistory) -> Figure:
    """Plot the force against the displacement of the tip, and the tensions of one cable's segments.

    Both panels begin at the reference posture. Force and displacement are components along the
    largest force of the history. If no load has a force, the displacement is plotted against the
    number of the load. The second panel shows the cable whose segments differ most in tension.

    Raises InvalidInput if ``history`` is not a result of :func:`~cdsm.load_cycle`.
    """
    expect("history", history, "LoadHistory")
    figure, ((left, right),) = panels(TWO_COLUMNS, 3.0, 2)
    forces = np.vstack([history.reference_wrench, history.wrenches])[:, :3]
    moved = MM * np.vstack([np.zeros(3), history.displacement])
    size = np.linalg.norm(forces, axis=1)
    line = {"marker": "o", "markersize": 2.0, "linewidth": 0.9}
    if size.any():
        u = forces[size.argmax()] / size.max()
        left.plot(moved @ u, forces @ u, color=BLUE, **line)
        left.set(xlabel="displacement along the force [mm]", ylabel="force [N]")
    else:
        for axis, color, part in zip(XYZ, COLORS, moved.T, strict=True):
            left.plot(part, color=color, label=axis, **line)
        left.set(xlabel="number of the load", ylabel="displacement of the tip [mm]")
        legend(left)
    spread = [float(np.ptp(T, axis=1).max()) for T in history.tensions]
    cable = int(np.argmax(spread))
    tensions, F = history.tensions[cable], history.reference_tension[cable]
    last = tensions.shape[1] - 1
    for j, own in enumerate(np.vstack([np.full(last + 1, F), tensions]).T):
        label = {0: "at the motor", 1: "between", last: "at the end"}.get(j)
        shade = j / max(1, last)
        color = VERMILLION if j == last else BLUE if j == 0 else str(0.4 + 0.4 * shade)
        right.plot(own, color=color, label=label, lw=0.9, zorder=2.5 if j in (0, last) else 2.0)
    right.xaxis.set_major_locator(MaxNLocator(integer=True))
    right.set(xlabel="number of the load", ylabel="tension of each segment [N]")
    legend(right, title=history.reference.arm.cables[cable].name, **BESIDE)
    lost = f"{1000.0 * history.dissipated.sum():.4g} mJ lost in all in"
    heading(figure, f"{history.reference.arm.name}: {lost} {plural(len(history.holes), 'hole')}")
    return figure
