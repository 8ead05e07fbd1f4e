"""Plot the recomputed figures of the paper: stiffness against Young's modulus, tension and lead.

Columns of panels are the directions x, y and z, or postures. Rows are two definitions of the tip
stiffness: the paper's K_R, and the stiffness that a hung weight measures. Both are
computed from EA/L with the stretched length L, as in the paper, and from EA/l_0.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from cdsm.plots import style
from cdsm.plots.arm import draw_arm
from cdsm.plots.laws import shade_stages
from cdsm.plots.projection import VIEW, Drawing
from cdsm.plots.style import KN, MM, N_PER_MM, Panels
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm import paper

    Line = tuple[Array, Array, dict[str, Any]]
    Row = tuple[str, list[Line]]

_LENGTHS: Final = {"stretched": "$l_0 = L$, as in the paper", "unstrained": "original $l_0$"}
_DEFINITIONS: Final = {"pseudoinverse": "paper's definition\n$K_R$", "along": "hung weight\n$1/C$"}
_NOTE: Final = (
    "paper's definition: diagonal of $K_R = J^{+T} K_\\theta J^+$; "
    "hung weight: $1/(u^T C\\,u)$, what a small weight at the tip measures"
)
_SWEPT: Final = {"young_modulus": "Young's modulus [GPa]", "tension": "cable tension, mean [N]"}
_WIDE: Final = {"linewidth": 4.0, "alpha": 0.4}  # a line under another one, both visible
_DOT: Final = {"ls": "", "marker": "o", "color": "k"}
_STAGES: Final = (
    ("pre-tensioning", 0.0, 120.0),
    ("elastic,\nrising slowly", 120.0, 400.0),
    ("elastic,\nnear-constant", 400.0, 810.0),
    ("plastic: no law", 810.0, 900.0),
)
"""Stages of the strand and their tensions [N] in Section IV-C; the end of the last is not given."""


@style.styled
def plot_paper(
    result: paper.Figure, axs: Panels | Sequence[Axes] | None = None, *, title: str | None = None
) -> Panels:
    """Plot the curves of one recomputed figure, with the numbers that the paper prints."""
    panels = _DRAWN[result.name](result, axs)
    style.set_heading(panels, axs, title, result.title)
    return panels


def _multiples(
    result: paper.StiffnessFigure, axs: Any, height: float, rows: list[Row], **shared: Any
) -> Panels:
    """Draw rows of panels x, y and z; each row has a label, and lines of x (N,), y (N, 3), look."""
    panels = style.panels(axs, 3, len(rows), height=height, sharex=True, **shared)
    grid = panels.reshape(-1, 3)
    for panels, (label, lines) in zip(grid, rows, strict=True):
        panels[0].set_ylabel(label)
        for x, y, look in lines:
            for i, axes in enumerate(panels):
                axes.plot(x, y[:, i], **look)
    for i, axis in enumerate("xyz"):
        grid[0, i].set_title(axis)
        grid[-1, i].set_xlabel(_SWEPT[result.swept])
    return grid


def _plot_moduli(result: paper.StiffnessFigure, axs: Any) -> Panels:
    """Plot Fig. 3; its last row is passive part minus total stiffness, over the total stiffness."""
    ratio, (limit, *_) = (np.array(result.claims[k].paper) for k in (0, 1))
    looks: Any = {"color": style.BLUE, "zorder": 3}, {"color": style.ORANGE, **_WIDE}
    rows: list[Row] = []
    differences: list[Line] = []
    for (name, definition), dash in zip(_DEFINITIONS.items(), ("-", "--"), strict=True):
        lines: list[Line] = []
        for curve, look in zip(result.curves, looks, strict=True):
            x = curve.swept / 1e9
            whole = getattr(curve, name)
            part = getattr(curve, f"{name}_part")
            lines.append((x, N_PER_MM * whole, {**look, "label": curve.label}))
            differences.append((x, 100.0 * (part / whole - 1.0), {**look, "ls": dash}))
        dots = {**_DOT, "ms": 2.0, "label": "passive part alone"}
        lines.append((x[::4], N_PER_MM * part[::4], dots))
        name = f"difference, {definition.splitlines()[0]}"
        differences.append((x[:1], np.nan * whole[:1], {"color": "0.2", "ls": dash, "label": name}))
        rows.append((f"{definition} [N/mm]", lines))
    doubled = N_PER_MM * ratio * result.curves[0].pseudoinverse[:1]
    diamond = {**_DOT, "marker": "D", "mfc": "none", "ms": 6.0}
    label = "paper: proportional, twice at 320 GPa"
    rows[0][1].append((x[-1:], doubled, {**diamond, "label": label}))
    grid = _multiples(result, axs, 5.4, [*rows, ("passive less\ntotal [%]", differences)])
    for axes in grid[:2].flat:
        axes.set_ylim(0.0, 1.05 * axes.get_ylim()[1])  # room for the diamond
    for axes in grid[2]:
        axes.axhspan(-limit, limit, color="0.9", lw=0, label="paper: within 1.5 %")
        axes.set_ylim(-1.2 * limit, 1.2 * limit)
    style.legend_below(grid[:, 0], 3, axs, title=_NOTE)
    return grid.ravel()


def _plot_directions(result: paper.StiffnessFigure, axs: Any) -> Panels:
    """Plot Fig. 6: K_R and the stiffness for a hung weight, against tension."""
    (curve,) = result.curves
    (original,) = result.original
    stated = result.claims[0].paper or ()
    looks = {"color": style.BLUE}, {"color": style.VERMILLION, "ls": "--"}
    rows: list[Row] = []
    for name, definition in _DEFINITIONS.items():
        lines = [
            (one.tension[:, 1], N_PER_MM * getattr(one, name), _named(one, look))
            for one, look in zip((curve, original), looks, strict=True)
        ]
        rows.append((f"{definition} [N/mm]", lines))
    end = N_PER_MM * (1.0 + np.array(stated)) * curve.pseudoinverse[:1]
    times = ", ".join(f"+{change:g}" for change in stated)
    label = f"paper: {times} times the first computed value"
    rows[0][1].append((curve.tension[-1:, 1], end, {**_DOT, "label": label}))
    grid = _multiples(result, axs, 4.4, rows)
    for name, panels in zip(_DEFINITIONS, grid, strict=True):
        _draw_bars(panels, curve, getattr(curve, name))
    for axes in grid.flat:
        axes.set_ylim(bottom=0.0)
    style.legend_below(grid[0, 0], 3, axs, title=_NOTE)
    return grid.ravel()


def _plot_changes(result: paper.StiffnessFigure, axs: Any) -> Panels:
    """Plot Figs. 4 and 7: active part of K_R, and changes [%] of both stiffnesses, over tension."""
    first = result.curves[0]
    shades = (style.BLUE, style.ORANGE)
    x = first.tension[:, 1]
    active = first.pseudoinverse_part
    rows: list[Row] = [("active part of $K_R$ [N/mm]", [(x, N_PER_MM * active, {})])]
    for name, definition in _DEFINITIONS.items():
        lines: list[Line] = []
        for curves, dash in ((result.curves, "-"), (result.original, "--")):
            for curve, shade in zip(curves, shades, strict=False):
                values = getattr(curve, name)
                look = _named(
                    curve, {"color": shade, "ls": dash}, f"{curve.label.split(' (')[0]}, "
                )
                lines.append((curve.tension[:, 1], 100.0 * (values / values[0] - 1.0), look))
        rows.append((f"change, {definition} [%]", lines))
    stated = np.array([result.claims[0].paper])
    rows[1][1].append((x[-1:], stated, {**_DOT, "label": "paper, at the end"}))
    grid = _multiples(result, axs, 6.2, rows, sharey="row")
    _draw_bars(grid[0], first, active)
    for axes in grid[1:].flat:
        axes.axhline(0.0, color="0.2", linewidth=0.6)
    style.legend_below(grid[:2, 0], 2, axs, title=_NOTE)
    return grid.ravel()


def _plot_lead(result: paper.LeadFigure, axs: Any) -> Panels:
    """Plot the change of K_R, and of the stiffness for a hung weight, against the lead."""
    pair = style.panels(axs, 2, height=3.4, sharey=True)
    cases = (result.stretched, "stretched", "-"), (result.original, "unstrained", "--")
    for row, (axes, definition) in enumerate(zip(pair, _DEFINITIONS.values(), strict=True)):
        for i, color in enumerate(style.COLORS[:3]):
            for changes, length, dash in cases:
                label = f"{'xyz'[i]}, {_LENGTHS[length]}"
                axes.plot(MM * result.leads, changes[:, row, i], dash, color=color, label=label)
        axes.axhline(0.0, color="0.2", linewidth=0.8)
        axes.set_xscale("symlog", linthresh=10.0, linscale=0.6)
        axes.set_xlim(0.0, MM * result.leads[-1])
        axes.set_xticks([0, 5, 10, 20, 50, 100, 300], ["0", "5", "10", "20", "50", "100", "300"])
        axes.set_xlabel("lead of all cables [mm]")
        axes.set_title(definition.replace("\n", ", "))
    pair[0].set_ylabel("change of stiffness [%]")
    style.legend_below(pair[0], 3, axs, title=_NOTE)
    return pair


def _plot_postures(result: paper.StiffnessFigure, axs: Any) -> Panels:
    """Plot Fig. 8: for each posture, a picture of the arm, K_R and stiffness for a hung weight."""
    panels = style.panels(axs, 3, 3, height=6.4, height_ratios=(1.1, 1.0, 1.0))
    grid = panels.reshape(3, 3)
    for column, pose in enumerate(result.postures):
        curve = result.curves[column]
        original = result.original[column]
        drawing = Drawing(grid[0, column], VIEW, pose.arm.length)
        draw_arm(drawing, pose)
        drawing.finish(triad=column == 0)
        grid[0, column].set_title(curve.label)
        for row, (name, definition) in enumerate(_DEFINITIONS.items(), start=1):
            axes = grid[row, column]
            for i, color in enumerate(style.COLORS[:3]):
                for one, look in ((original, _WIDE), (curve, {"ls": style.STYLES[i]})):
                    values = N_PER_MM * getattr(one, name)[:, i]
                    options = _named(one, {"color": color, **look}, f"{'xyz'[i]}, ")
                    axes.plot(one.tension[:, 1], values, **options)
            axes.set_yscale("log")
            axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.yaxis.set_major_formatter("{x:g}")
            axes.yaxis.set_minor_locator(NullLocator())
            if column == 0:
                axes.set_ylabel(f"{definition} [N/mm]")
        axes.set_xlabel(_SWEPT[result.swept])
    note = f"{_NOTE}\nthe paper prints no numbers here: a steep rise, then a slight decrease"
    style.legend_below(axes, 3, axs, title=note)  # the last panel: all have the same lines
    return panels


def _plot_strand(result: paper.StrandFigure, axs: Any) -> Panels:
    """Plot Fig. 5: force against displacement (a) and rigidity against tension (b)."""
    panels = style.panels(axs, 2, height=3.4)
    left, right = panels
    left.plot(MM * result.displacement, result.tension)
    shade_stages(left, _STAGES, "y")
    left.set(xlabel=f"stretch of a {MM * result.gauge_length:g} mm wire [mm]", ylabel="force [N]")
    left.set(ylim=(0.0, _STAGES[-1][-1]), title="(a)")
    words = "stretch from 2.2 N on: below,\nEq. 19 is not positive"
    left.text(0.02, 0.15, words, transform=left.transAxes, fontsize="small")
    right.plot(result.tension, KN * result.tangent, label="tangent, repaired")
    right.plot(result.tension, KN * result.secant, "--", color=style.GREEN, label="secant (Eq. 18)")
    lower = result.tension <= result.join  # above, the printed and the repaired law share digits
    tension = result.tension[lower]
    printed = KN * result.printed[lower]
    red: Any = {"color": style.VERMILLION}
    right.plot(tension, printed, ":", label="as printed, misprint", **red)
    arrow = {"arrowstyle": "<-", "linewidth": 0.8, **red}
    words = f"as printed: {printed[-1]:.0f} kN at {result.join:g} N"
    end = (60, -3.2)
    at = tension[np.argmax(printed < -4.0)], -4.0
    right.annotate(words, at, xytext=end, fontsize="small", arrowprops=arrow, **red)
    shade_stages(right, _STAGES)
    right.set_ylim(-5.0, 1.2 * KN * result.tangent.max())  # the printed law falls far below
    right.set(xlabel="tension [N]", ylabel="rigidity EA [kN]", title="(b)")
    right.set_xlim(0.0, _STAGES[-1][-1])
    style.legend_below(right, 4, axs)
    return panels


def _plot_experiment(result: paper.ExperimentFigure, axs: Any) -> Panels:
    """Plot Fig. 10, 12 or 13, a panel per trace: computed values as a line, the paper's as dots."""
    panels = style.panels(axs, len(result.traces), height=2.8, sharex=True)
    across = 1.0  # x, y and z, or y alone
    scale = N_PER_MM
    colors = style.COLORS
    x = "tension as reported [N]"
    y = "stiffness [N/mm]"
    if result.swept == "cable_stiffness":
        across = N_PER_MM
        x = "cable stiffness [N/mm]"
    if result.relative:
        scale = 1.0
        y = "stiffness in y\nover the first [-]"
        colors = (style.PURPLE,) * 7
    for axes, trace, color in zip(panels, result.traces, colors, strict=False):
        axes.plot(across * trace.swept, scale * trace.computed, color=color, label="computed")
        axes.plot(across * trace.paper_at, scale * trace.paper, "ko", label="paper")
        axes.set(title=textwrap.fill(trace.label, 110 // len(panels)), xlabel=x)
        axes.set_ylim(bottom=0.0)
    panels[0].set_ylabel(y)
    note = "the prototype was fitted to come near the paper's numbers (black)"
    style.legend_below(panels[0], 2, axs, title=note)
    return panels


def _named(curve: paper.Curve, look: dict[str, Any], before: str = "") -> dict[str, Any]:
    return {**look, "label": f"{before}{_LENGTHS[curve.original_length]}"}


def _draw_bars(panels: Any, curve: paper.Curve, values: Array) -> None:
    """Draw the range of tensions over the cables at five of the stiffnesses (N, 3) [N/m]."""
    some = np.linspace(0, len(values) - 1, 5).round().astype(int)
    low, mean, high = curve.tension[some].T
    look: Any = {"fmt": "none", "ecolor": "0.4", "elinewidth": 0.8}
    for axes, y in zip(panels, N_PER_MM * values[some].T, strict=True):
        label = "bars: range over the cables"
        axes.errorbar(mean, y, xerr=[mean - low, high - mean], label=label, **look)


_DRAWN: Final[dict[str, Callable[[Any, Any], Panels]]] = {
    "fig3": _plot_moduli,
    "fig4": _plot_changes,
    "fig5": _plot_strand,
    "fig6": _plot_directions,
    "fig7": _plot_changes,
    "fig8": _plot_postures,
    "fig10": _plot_experiment,
    "fig12": _plot_experiment,
    "fig13": _plot_experiment,
    "lead": _plot_lead,
}
"""Function that draws each figure of :data:`cdsm.paper.FIGURES`, by name."""
