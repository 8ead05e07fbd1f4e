"""Plot weight tests, buckling, load histories, and closed loops over time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from cdsm.plots import style
from cdsm.plots.style import MM, N_PER_MM
from cdsm.support.format import plural
from cdsm.support.values import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdsm.control.run import TrackingRun
    from cdsm.statics.buckling import CriticalLoad, CriticalTension
    from cdsm.statics.load_cycle import LoadHistory
    from cdsm.statics.weight_test import WeightTest

_ROOM = 0.08  # margin above and below all values, as a fraction of their range
_HALF = 0.5  # the stiffness axis begins at zero if values are below this part of the wanted ones


@style.styled
def plot_weight_test(test: WeightTest) -> Figure:
    """Plot load [N] against tip displacement [mm], nonlinear and linear, and tensions [N].

    Dotted lines are the events on the way.
    """
    figure, ((left, right),) = style.panels(style.TWO_COLUMNS, 3.0, 2)
    loads = np.concatenate([[0.0], test.loads])
    moved = MM * np.vstack([np.zeros(3), test.displacements])
    linear = MM * test.tangent_displacement
    for i, (color, marker) in enumerate(zip(style.COLORS[:3], "os^", strict=True)):
        left.plot(moved[:, i], loads, f"{marker}-", color=color, label="xyz"[i])
        left.plot([0.0, linear[i]], [0.0, loads[-1]], "--", color=color, linewidth=0.9)
    left.set(xlabel="displacement of the tip [mm]", ylabel="load [N]")
    left.legend(title="direction; dashed: linear")
    arm = test.unloaded.pose.arm
    tensions = np.vstack([test.unloaded.tension, test.tensions])
    style.cable_lines(right, loads, tensions, arm.cables.names)
    right.set(xlabel="load [N]", ylabel="tension at each motor [N]")
    right.set_ylim(bottom=0.0)
    for event in test.events:
        for mark in (left.axhline, right.axvline):
            mark(event.load, color="0.5", linewidth=0.7, linestyle=":", zorder=0)
    names = dict.fromkeys(event.kind for event in test.events)
    if names:
        right.set_xlabel(f"load [N]; dotted: {', '.join(names)}")
    left_it = "; left its reference before the weight" if test.left_reference else ""
    return style.titled(
        figure, f"{arm.name}: weight of {np.linalg.norm(test.force):.4g} N{left_it}"
    )


@style.styled
def plot_critical_tension(critical: CriticalTension) -> Figure:
    """Plot the smallest eigenvalue of K_θ [N m/rad] against the lower bound of all tensions [N].

    Unstable ranges are shaded.
    """
    low, high = critical.examined
    shown = high if math.isinf(critical.minimum) or not critical.stable else 2.0 * critical.minimum
    inside = critical.bounds <= shown
    figure, axes = _margins(critical, critical.bounds, critical.margins, inside)
    # if no tension can be raised by itself, only one bound is examined: a point
    axes.set_xlim(low, min(shown, high) if high > low else low + 1.0)
    edges = [low, *np.ravel(critical.stable), high]
    spans = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b > a]
    for k, span in enumerate(spans):
        label = "unstable" if k == 0 else None
        axes.axvspan(*span, color=style.VERMILLION, alpha=0.15, linewidth=0.0, label=label)
    if math.isfinite(critical.minimum) and critical.stable:
        _mark(axes, critical.minimum, 0.0, f"buckles at {critical.minimum:.4g} N", (6, 8), "left")
    axes.set(xlabel="lower bound of tension [N]", title=critical.posture.arm.name)
    if spans:
        axes.legend()
    return figure


@style.styled
def plot_critical_load(critical: CriticalLoad) -> Figure:
    """Plot the smallest eigenvalue of K_θ [N m/rad] against the factor of the load."""
    figure, axes = _margins(critical, critical.factors, critical.margins)
    if math.isfinite(critical.factor):
        words = {"buckling": "buckles", "infeasible": "no balance", "elasticity": "end of a law"}
        label = f"{words[critical.limit]} at {critical.factor:.4g}"
        _mark(axes, critical.factor, critical.margins[-1], label, (-6, -12), "right")
    load = style.direction_name(critical.load[:3])
    axes.set(xlabel="factor of the load", title=f"{critical.posture.arm.name}: load {load} N")
    return figure


@style.styled
def plot_load_history(history: LoadHistory) -> Figure:
    """Plot force [N] against tip displacement [mm], and the tensions [N] along one cable.

    Force and displacement are components along the largest force. The cable is the one whose
    segments differ most in tension.
    """
    figure, ((left, right),) = style.panels(style.TWO_COLUMNS, 3.0, 2)
    forces = np.vstack([history.reference_wrench, history.wrenches])[:, :3]
    moved = MM * np.vstack([np.zeros(3), history.displacement])
    number = np.append(-1, history.load)  # −1: the reference
    size = np.linalg.norm(forces, axis=1)
    if size.any():
        u = forces[size.argmax()] / size.max()
        left.plot(moved @ u, forces @ u, "o-", markersize=2.0, linewidth=0.9)
        left.set(xlabel="displacement along the force [mm]", ylabel="force [N]")
    else:
        left.plot(number, moved, "o-", markersize=2.0, linewidth=0.9, label=["x", "y", "z"])
        left.set(xlabel="number of the load (−1: reference)", ylabel="displacement of the tip [mm]")
        left.legend()
    cable = int(np.argmax([np.ptp(T, axis=1).max() for T in history.tensions]))
    tensions = history.tensions[cable]
    F = history.reference_tension[cable]
    values = np.vstack([np.full(tensions.shape[1], F), tensions])
    right.plot(
        number, values[:, 0], color=style.BLUE, linewidth=0.9, zorder=3, label="at the motor"
    )
    for line in right.plot(number, values[:, 1:-1], color="0.6", linewidth=0.9)[:1]:
        line.set_label("between")
    right.plot(number, values[:, -1], color=style.VERMILLION, linewidth=0.9, label="at the end")
    style.whole_numbers(right.xaxis)
    right.set(xlabel="number of the load (−1: reference)", ylabel="tension of each segment [N]")
    right.legend(title=history.reference.arm.cables[cable].name, **style.BESIDE)
    lost = f"{1000.0 * history.dissipated.sum():.4g} mJ lost in all in"
    holes = plural(len(history.holes), "hole")
    return style.titled(figure, f"{history.reference.arm.name}: {lost} {holes}")


@style.styled
def plot_tracking_run(run: TrackingRun) -> Figure:
    """Plot tip error [mm], stiffness [N/mm], displacement [mm] and tensions [N] over time [s].

    The displacement of the tip from the frictionless equilibrium is drawn with its first-order
    band. :func:`plot_path` draws the postures of ``run.states``, and writes a film.
    """
    figure, axes = style.panels(style.TWO_COLUMNS, 6.4, rows=4, sharex=True)
    error, stiffness, band, tension = axes[:, 0]
    t = run.time
    target = N_PER_MM * run.target
    achieved = N_PER_MM * run.stiffness
    error.plot(t, MM * run.tip_error)
    error.set(ylabel="tip error [mm]")
    for k, u in enumerate(run.directions):
        color = style.COLORS[k % 7]
        label = f"along {style.direction_name(u)}; dashed: wanted"
        stiffness.plot(t, target[:, k], "--", color=color, linewidth=0.9)
        stiffness.plot(t, achieved[:, k], color=color, label=label)
    stiffness.set(ylabel="frictionless\nstiffness [N/mm]")
    if np.nanmin(achieved / target, initial=1.0) < _HALF:  # else no percent is seen
        style.from_zero(stiffness, target, achieved)
    half = MM * run.band
    if np.isfinite(half).any():
        band.fill_between(t, -half, half, color=style.SKY, alpha=0.4, label="first-order band")
    band.plot(t, MM * run.displacement, color=style.VERMILLION, label="tip")
    band.set(ylabel="displacement from\nfrictionless\nequilibrium [mm]")
    for panel in (stiffness, band):
        panel.legend(**style.BESIDE)
    style.cable_lines(tension, t, run.tension, run.plan.arm.cables.names)
    tension.set(xlabel="time [s]", ylabel="tension [N]")
    for panel in (error, tension):
        panel.set_ylim(bottom=0.0)
    changes = t[1:][(np.diff(run.wrench, axis=0) != 0.0).any(axis=1)][:1]
    for panel in axes[:, 0]:
        for at in changes:
            panel.axvline(at, color="0.3", linewidth=0.8, linestyle=":")
    danger = f"{run.warnings[0].split(':')[0]}. " if run.warnings else ""
    dotted = "; dotted: the load changes" if changes.size else ""
    return style.titled(figure, f"{danger}{run.plan.arm.name}, law {run.law}{dotted}")


def _margins(
    critical: CriticalLoad | CriticalTension, x: Array, margins: Array, seen: Any = slice(None)
) -> tuple[Figure, Any]:
    """Plot stability margins, with room around zero and the ``seen`` ones."""
    figure, ((axes,),) = style.panels(style.ONE_COLUMN, 2.6)
    axes.plot(x, margins, "o-" if x.size == 1 else "-")
    axes.axhline(0.0, color="0.2", linewidth=0.8)
    low = min(0.0, *margins[seen])
    high = max(0.0, *margins[seen])
    axes.set_ylim(low - 2.0 * _ROOM * (high - low), high + _ROOM * (high - low))
    axes.set_ylabel(f"smallest joint stiffness [{critical.posture.arm.stiffness_unit()}]")
    return figure, axes


def _mark(axes: Any, x: float, y: float, text: str, offset: tuple[int, int], ha: str) -> None:
    axes.plot(x, y, "o", color=style.VERMILLION)
    axes.annotate(text, (x, y), xytext=offset, textcoords="offset points", ha=ha)
