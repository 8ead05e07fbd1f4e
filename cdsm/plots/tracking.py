"""Plot a closed loop over time: tip, stiffness, tensions, and where friction lets the tip rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cdsm.plots.style import (
    BESIDE,
    BLUE,
    COLORS,
    MM,
    N_PER_MM,
    SKY,
    TWO_COLUMNS,
    VERMILLION,
    cable_lines,
    direction_name,
    expect,
    from_zero,
    heading,
    legend,
    panels,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdsm.control.run import TrackingRun

_HALF = 0.5
"""The stiffness axis begins at zero if values are below this fraction of the wanted stiffness."""


def plot_tracking_run(run: TrackingRun) -> Figure:
    """Plot a closed loop over time: tip error, stiffness, displacement of the tip, tensions.

    The third panel shows the displacement of the tip from the frictionless equilibrium, along the
    first direction of the plan. To first order, friction can hold the tip at rest only within the
    shaded band.

    Raises InvalidInput if ``run`` is not a result of :func:`~cdsm.track`.
    """
    expect("run", run, "TrackingRun")
    figure, axes = panels(TWO_COLUMNS, 6.4, 1, 4, sharex=True)
    error, stiffness, band, tension = axes[:, 0]
    t = run.time
    error.plot(t, MM * run.tip_error, color=BLUE)
    error.set(ylabel="tip error [mm]")
    error.set_ylim(bottom=0.0)
    each = zip(run.directions, COLORS, run.target.T, run.stiffness.T, strict=False)
    for u, color, wanted, found in each:
        name = direction_name(u)
        stiffness.plot(t, N_PER_MM * wanted, "--", color=color, linewidth=0.9, label="_")
        stiffness.plot(t, N_PER_MM * found, color=color, label=f"along {name}; dashed: wanted")
    stiffness.set(ylabel="frictionless\nstiffness [N/mm]")
    if np.nanmin(run.stiffness / run.target, initial=1.0) < _HALF:  # else no percent is seen
        from_zero(stiffness, N_PER_MM * run.target, N_PER_MM * run.stiffness)
    half = MM * run.band
    if np.isfinite(half).any():
        band.fill_between(t, -half, half, color=SKY, alpha=0.4, label="first-order band")
    moved = MM * run.displacement
    band.plot(t, moved, color=VERMILLION, label="tip")
    band.set(ylabel="off the rest\nwithout friction [mm]")
    for panel in (stiffness, band):
        legend(panel, **BESIDE)
    cable_lines(tension, t, run.tension, run.plan.arm.cables.names)
    tension.set(xlabel="time [s]", ylabel="tension [N]")
    tension.set_ylim(bottom=0.0)
    changes = t[1:][(np.diff(run.wrench, axis=0) != 0.0).any(axis=1)][:1]
    for panel in axes[:, 0]:
        for at in changes:
            panel.axvline(at, color="0.3", linewidth=0.8, linestyle=":")
    danger = f"{run.warnings[0].split(':')[0]}. " if run.warnings else ""
    dotted = "; dotted: the load changes" if changes.size else ""
    heading(figure, f"{danger}{run.plan.arm.name}, law {run.law}{dotted}")
    return figure
