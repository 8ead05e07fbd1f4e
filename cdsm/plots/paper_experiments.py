"""Plot the recomputed strand (Fig. 5) and experiments (Section V) of the paper."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.figure import Figure

from cdsm.plots.measured import shade_stages
from cdsm.plots.style import (
    BLUE,
    COLORS,
    GREEN,
    KN,
    MM,
    N_PER_MM,
    PURPLE,
    SMALL,
    TWO_COLUMNS,
    VERMILLION,
    caption,
    legend_below,
    panels,
)

if TYPE_CHECKING:
    from cdsm import paper

_STAGES: Final = (
    ("pre-tensioning", 0.0, 120.0),
    ("elastic,\nrising slowly", 120.0, 400.0),
    ("elastic,\nnear-constant", 400.0, 810.0),
    ("plastic: no law", 810.0, 900.0),
)
"""Stages of the strand and their tensions [N] in Section IV-C; the end of the last is not given."""


def plot_strand(result: paper.StrandFigure) -> Figure:
    """Plot Fig. 5: force against displacement (a) and rigidity against tension (b).

    Shades and names mark the stages of the strand that the paper distinguishes.
    """
    figure, ((left, right),) = panels(TWO_COLUMNS, 3.4, 2)
    left.plot(MM * result.displacement, result.tension, color=BLUE, label="Eq. 19, repaired")
    shade_stages(left, _STAGES, "y")
    left.set(xlabel=f"stretch of a {MM * result.gauge_length:g} mm wire [mm]", ylabel="force [N]")
    left.set_ylim(0.0, _STAGES[-1][-1])
    words = "stretch from 2.2 N on: below,\nEq. 19 is not positive"
    left.text(0.02, 0.15, words, transform=left.transAxes, fontsize=SMALL)
    caption(left, "(a)")
    right.plot(result.tension, KN * result.tangent, color=BLUE, label="tangent, repaired")
    right.plot(result.tension, KN * result.secant, "--", color=GREEN, label="secant (Eq. 18)")
    lower = result.tension <= result.join  # above, the printed and the repaired law share digits
    printed = KN * result.printed
    line = {"color": VERMILLION, "linewidth": 1.2}
    right.plot(result.tension[lower], printed[lower], ":", label="as printed, misprint", **line)
    right.annotate(
        f"as printed: {printed[lower][-1]:.0f} kN at {result.join:g} N",
        (result.tension[lower][np.argmax(printed[lower] < -4.0)], -4.0),
        xytext=(60, -3.2),
        fontsize=SMALL,
        color=VERMILLION,
        arrowprops={"arrowstyle": "<-", "color": VERMILLION, "linewidth": 0.8},
    )
    shade_stages(right, _STAGES)
    right.set_ylim(-5.0, 1.2 * KN * result.tangent.max())  # the printed law falls far below
    right.set_xlim(0.0, _STAGES[-1][-1])
    right.set(xlabel="tension [N]", ylabel="rigidity EA [kN]")
    caption(right, "(b)")
    legend_below(figure, right, 4)
    return figure


def plot_experiment(result: paper.ExperimentFigure) -> Figure:
    """Plot Fig. 10, 12 or 13, a panel per trace: computed values as a line, the paper's as dots."""
    scale = 1.0 if result.relative else N_PER_MM
    unit = "stiffness in y\nover the first [-]" if result.relative else "stiffness [N/mm]"
    tension = result.swept == "tension"
    columns = min(len(result.traces), 3)
    rows = -(-len(result.traces) // columns)
    size = TWO_COLUMNS, 1.1 + 1.7 * rows
    figure, grid = panels(*size, columns, rows, sharex=True, sharey="col")
    colors = (PURPLE,) if result.relative else COLORS  # y alone, or x, y and z
    for k, (axes, trace) in enumerate(zip(grid.ravel(), result.traces, strict=False)):
        across = 1.0 if tension else N_PER_MM
        color = colors[k % len(colors)]
        axes.plot(across * trace.swept, scale * trace.computed, color=color, label="computed")
        axes.plot(across * trace.paper_at, scale * trace.paper, "ko", markersize=4, label="paper")
        caption(axes, textwrap.fill(trace.label, 110 // columns))
        axes.set_ylim(bottom=0.0)
        if k % columns == 0:
            axes.set_ylabel(unit)
    for axes in grid[-1]:
        axes.set_xlabel("tension as reported [N]" if tension else "cable stiffness [N/mm]")
    note = "the prototype was fitted to come near the paper's numbers (black)"
    legend_below(figure, grid[0, 0], 2, title=note)
    return figure
