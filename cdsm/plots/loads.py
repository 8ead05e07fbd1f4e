"""Plot weight tests and buckling."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from cdsm.plots.style import AXES, COLORS, MM, expect, panels

if TYPE_CHECKING:
    from cdsm.statics.buckling import CriticalTension
    from cdsm.statics.weight_test import WeightTest

_ROOM = 0.08
"""Margin above and below all values, as a fraction of their range."""


def plot_weight_test(test: WeightTest) -> Figure:
    """Plot load over tip displacement, nonlinear and linear, and tensions over load.

    Args:
        test: Result of :func:`~cdsm.weight_test`. Several steps show a curve.

    Raises:
        InvalidInput: ``test`` is not a weight test.
    """
    expect("test", test, "WeightTest")
    figure, ((left, right),) = panels(10.0, 4.0, 2)
    loads = np.concatenate([[0.0], test.loads])
    moved = np.vstack([np.zeros(3), test.displacements])
    for axis, color, nonlinear, linear in zip(
        AXES, COLORS, moved.T, test.linear.displacement, strict=True
    ):
        left.plot(MM * nonlinear, loads, "o-", color=color, markersize=3, label=axis)
        left.plot([0.0, MM * linear], [0.0, loads[-1]], "--", color=color, linewidth=0.9)
    left.set(xlabel="displacement of the tip [mm]", ylabel="load [N]")
    left.legend(title="direction; dashed: linear", fontsize=8, title_fontsize=8)
    tensions = np.vstack([test.without.tension, test.tensions])
    right.plot(loads, tensions, color=COLORS[0], linewidth=0.9, alpha=0.7)
    right.set(xlabel="load [N]", ylabel="tension of each cable [N]")
    right.set_ylim(bottom=0.0)
    figure.suptitle(f"{test.without.pose.arm.name}: weight of {np.linalg.norm(test.force):.4g} N")
    return figure


def plot_critical_tension(critical: CriticalTension) -> Figure:
    """Plot the stability margin over the lower bound of tension; unstable ranges are shaded.

    Args:
        critical: Result of :func:`~cdsm.critical_tension`.

    Raises:
        InvalidInput: ``critical`` is not a critical tension.
    """
    expect("critical", critical, "CriticalTension")
    figure, ((axes,),) = panels(7.0, 4.0, 1)
    mark = "o" if critical.bounds.size == 1 else ""
    axes.plot(critical.bounds, critical.margins, color=COLORS[0], marker=mark)
    axes.axhline(0.0, color="0.2", linewidth=0.8)
    low, high = critical.examined
    shown = high if math.isinf(critical.minimum) or not critical.stable else 2.0 * critical.minimum
    # if no tension can be raised by itself, only one bound is examined: a point
    axes.set_xlim(low, min(shown, high) if high > low else low + 1.0)
    margins = np.array([0.0, *critical.margins[critical.bounds <= shown]])
    room = _ROOM * np.ptp(margins)
    axes.set_ylim(margins.min() - room, margins.max() + room)
    edges = [low, *np.ravel(critical.stable), high]
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        axes.axvspan(start, end, color=COLORS[1], alpha=0.15, linewidth=0.0)
    if math.isfinite(critical.minimum) and critical.stable:
        axes.plot(critical.minimum, 0.0, "o", color=COLORS[1])
        axes.annotate(
            f"buckles at {critical.minimum:.4g} N",
            (critical.minimum, 0.0),
            xytext=(8, 10),
            textcoords="offset points",
            fontsize=9,
        )
    axes.set(
        xlabel="lower bound of tension [N]",
        ylabel=f"smallest joint stiffness [{critical.posture.arm.stiffness_unit()}]",
        title=f"{critical.posture.arm.name}; shaded: unstable",
    )
    return figure
