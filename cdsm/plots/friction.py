"""Plot the history of an arm with friction in its holes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cdsm.plots.style import (
    AXES,
    BESIDE,
    BLUE,
    COLORS,
    MM,
    TWO_COLUMNS,
    VERMILLION,
    expect,
    heading,
    legend,
    panels,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdsm.statics.load_history import LoadHistory


def plot_load_history(history: LoadHistory) -> Figure:
    """Plot the force over the displacement of the tip, and the tensions of one cable's segments.

    Force and displacement are components along the largest force of the history. If no load has a
    force, the displacement is plotted load by load. The cable is the one whose segments differ most
    in tension. InvalidInput if ``history`` is no result of :func:`~cdsm.load_cycle`.
    """
    expect("history", history, "LoadHistory")
    figure, ((left, right),) = panels(TWO_COLUMNS, 3.0, 2)
    forces = history.wrenches[:, :3]
    moved = MM * history.displacement
    size = np.linalg.norm(forces, axis=1)
    line = {"marker": "o", "markersize": 2.0, "linewidth": 0.9}
    if size.any():
        u = forces[size.argmax()] / size.max()
        left.plot(moved @ u, forces @ u, color=BLUE, **line)
        left.set(xlabel="displacement along the force [mm]", ylabel="force [N]")
    else:
        loads = np.arange(1, len(moved) + 1)
        for axis, color, part in zip(AXES, COLORS, moved.T, strict=True):
            left.plot(loads, part, color=color, label=axis, **line)
        left.set(xlabel="load", ylabel="displacement of the tip [mm]")
        legend(left)
    spread = [float(np.ptp(T, axis=1).max()) for T in history.tensions]
    cable = int(np.argmax(spread))
    tensions, F = history.tensions[cable], history.reference_tension[cable]
    last = tensions.shape[1] - 1
    for j, own in enumerate(np.vstack([np.full(last + 1, F), tensions]).T):
        label = {0: "at the motor", last: "at the end"}.get(j)
        shade = j / max(1, last)
        color = VERMILLION if j == last else BLUE
        right.plot(own, color=color, alpha=1.0 - 0.75 * shade * (j < last), label=label, lw=0.9)
    right.set(xlabel="load", ylabel="tension of each segment [N]")
    legend(right, title=history.reference.arm.cables[cable].name, **BESIDE)
    lost = f"{1000.0 * history.dissipated.sum():.4g} mJ lost in {len(history.holes)} holes"
    heading(figure, f"{history.reference.arm.name}: {lost}")
    return figure
