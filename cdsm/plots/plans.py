"""Plot attainable stiffness around a direction, path plans, and closed loops over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdsm.errors import InvalidInput
from cdsm.planning.range import StiffnessRange
from cdsm.plots import style
from cdsm.plots.lines import cable_lines
from cdsm.plots.style import MM, Panels
from cdsm.support.format import stiffness_unit
from cdsm.support.validation import instance
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm.control.run import TrackingRun
    from cdsm.planning.path_plan import PathPlan

_SAME = 1e-9  # largest component of a direction out of a plane
_HALF = 0.5  # the stiffness axis begins at zero if values are below this part of the wanted ones


@style.styled
def plot_stiffness_ranges(
    ranges: Mapping[str, Sequence[StiffnessRange]],
    ax: Axes | None = None,
    *,
    title: str | None = None,
) -> Axes:
    """Plot the attainable stiffness [N/mm] against the direction, as a polar diagram.

    A curve for each label shows the largest stiffness. The smallest stiffness is shown for the last
    label only: the area inside its curve is shaded. Directions u and −u have equal stiffness, so
    half a turn of directions gives the whole diagram.

    Args:
        ranges: For each label, such as a bound of the tensions, a list of ranges, one for each
            direction. All directions are in one plane of two base axes, from 0° to below 180°.
        ax: Polar axes to draw on; None: a new figure of one column.
        title: Title; None: the arm's name and the question.

    Raises:
        InvalidInput: A range is missing or of the wrong type, the directions are not in one
            coordinate plane, or ``ax`` is not polar.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> ranges = [cdsm.stiffness_range(pose, "z", 5.0, most) for most in (50.0, 100.0)]
        >>> len(cdsm.plots.plot_stiffness_ranges({"straight": ranges}).lines) > 0
        True
    """
    rows: object = ranges
    if not isinstance(rows, Mapping):
        raise InvalidInput("ranges", f"{ranges!r} given; give a dict of lists of ranges.")
    every = [attainable for row in ranges.values() for attainable in row]
    for attainable in every:
        instance("ranges", attainable, StiffnessRange)
    if not every or not all(ranges.values()):
        raise InvalidInput("ranges", "is empty; give ranges of several directions by label.")
    u = abs(np.array([attainable.direction for attainable in every])).max(axis=0)
    if u.min() > _SAME:
        raise InvalidInput("ranges", "has directions that are in no plane of two base axes.")
    first, second = plane = sorted(np.argsort(u)[1:].tolist())
    panel: Any = ax
    if panel is None:
        panel = Figure(figsize=(style.ONE_COLUMN, 4.0)).add_subplot(projection="polar")
    elif getattr(panel, "name", None) != "polar":
        remedy = 'subplot_kw={"projection": "polar"}'
        raise InvalidInput("ax", f"is not polar; give one of plt.subplots({remedy}).")

    unit, size = stiffness_unit(*(attainable.high for attainable in every))

    def around(row: Sequence[StiffnessRange], values: Sequence[float]) -> tuple[Array, Array]:
        v = np.array([attainable.direction for attainable in row])
        half = np.mod(np.arctan2(v[:, second], v[:, first]), np.pi)
        turn = np.sort(half)
        radius = np.array(values)[np.argsort(half)] / size
        return np.append(turn, [*(turn + np.pi), turn[0]]), np.append(radius, [*radius, radius[0]])

    shades = style.TENSION_COLORS(np.linspace(0.0, 1.0, len(ranges)))
    for k, (label, row) in enumerate(ranges.items()):
        high = around(row, [attainable.high for attainable in row])
        look: dict[str, Any] = {"color": shades[k], "ls": style.STYLES[k % 4]}
        panel.plot(*high, label=f"stiffest, {label}", gid=f"stiffest:{label}", **look)
    low = around(row, [attainable.low for attainable in row])
    panel.fill(*low, color="0.85", label=f"below the attainable range, {label}")
    panel.plot(*low, color="0.4", linewidth=0.8, gid="softest")
    ends = [f"{sign}{'xyz'[axis]}" for sign in "+−" for axis in plane]
    panel.set_xticks(np.deg2rad([0.0, 90.0, 180.0, 270.0]), ends)
    panel.set_rlabel_position(60.0)
    panel.yaxis.set_major_locator(MaxNLocator(4))
    panel.tick_params(labelsize=7)
    panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.08))
    name = every[0].posture.arm.name
    style.set_title(panel, title, f"{name}: how stiff can it be [{unit}]?")
    return panel  # type: ignore[no-any-return]


@style.styled
def plot_path_plan(
    plan: PathPlan, axs: Panels | Sequence[Axes] | None = None, *, title: str | None = None
) -> Panels:
    """Plot wanted and reached stiffness [N/mm], and the tensions [N], against the samples.

    Infeasible samples are hatched. :func:`plot_path` draws the arm on its path, and writes a film.
    """
    panels = style.panels(axs, 1, 2, height=4.6, sharex=True)
    above, below = panels
    x = np.arange(float(len(plan.target)))
    rows = list(plan.planned)
    unit, size = stiffness_unit(plan.target, plan.achieved)
    wanted = plan.target.reshape(len(x), -1) / size
    # NaN leaves a gap in the line at samples that are not planned
    achieved = np.full(wanted.shape, np.nan)
    tensions = np.full((len(x), plan.tensions.shape[1]), np.nan)
    achieved[rows] = plan.achieved.reshape(len(rows), wanted.shape[1]) / size
    tensions[rows] = plan.tensions
    for k, u in enumerate(plan.direction.reshape(-1, 3)):
        name = style.direction_name(u)
        wide: dict[str, Any] = {"color": "0.75", "linewidth": 4.0, "label": None if k else "wanted"}
        above.step(x, wanted[:, k], where="mid", gid=f"wanted:{name}", **wide)
        line: dict[str, Any] = {"color": style.COLORS[k % 7], "linewidth": 1.0}
        label = f"reached along {name}"
        above.plot(x, achieved[:, k], ".-", label=label, gid=f"reached:{name}", **line)
    line = {"marker": ".", "linewidth": 0.9, "markersize": 2.0}
    style.from_zero(above, wanted, achieved)
    cable_lines(below, x, tensions, plan.arm.cables.names, **line)
    for ax in panels:
        for i in (sample.index for sample in plan.infeasible):
            ax.axvspan(i - 0.5, i + 0.5, gid="infeasible", **style.HATCHED)
    above.set_ylabel(f"stiffness [{unit}]")
    above.legend(loc="lower right")
    style.whole_numbers(below.xaxis)
    below.set(xlabel="sample", ylabel="tension of each cable [N]")
    missed = len(plan.infeasible)
    words = f"hatched: {missed} of {len(x)} samples infeasible" if missed else "every sample is"
    question = f"{plan.arm.name}: is the wanted stiffness reached? {words.capitalize()}"
    style.set_heading(panels, axs, title, question)
    return panels


@style.styled
def plot_tracking_run(
    run: TrackingRun, axs: Panels | Sequence[Axes] | None = None, *, title: str | None = None
) -> Panels:
    """Plot tip error [mm], stiffness [N/mm], displacement [mm] and tensions [N] over time [s].

    The displacement of the tip from the frictionless equilibrium is drawn with its first-order
    band. :func:`plot_path` draws the postures of ``run.states``, and writes a film.
    """
    panels = style.panels(axs, 1, 4, height=6.4, sharex=True)
    error, stiffness, band, tension = panels
    t = run.time
    unit, size = stiffness_unit(run.target, run.stiffness)
    target = run.target / size
    achieved = run.stiffness / size
    error.plot(t, MM * run.tip_error, color=style.BLUE, gid="tip error")
    error.set(ylabel="tip error [mm]")
    for k, u in enumerate(run.directions):
        color = style.COLORS[k % 7]
        name = style.direction_name(u)
        label = f"along {name}; dashed: wanted"
        wanted: dict[str, Any] = {"color": color, "linewidth": 0.9, "gid": f"wanted:{name}"}
        stiffness.plot(t, target[:, k], "--", **wanted)
        stiffness.plot(t, achieved[:, k], color=color, label=label, gid=f"reached:{name}")
    stiffness.set(ylabel=f"frictionless\nstiffness [{unit}]")
    if np.nanmin(achieved / target, initial=1.0) < _HALF:  # else no percent is seen
        style.from_zero(stiffness, target, achieved)
    half = MM * run.band
    if np.isfinite(half).any():
        look: dict[str, Any] = {"color": style.SKY, "alpha": 0.4, "gid": "band"}
        band.fill_between(t, -half, half, label="first-order band", **look)
    moved = MM * run.displacement
    band.plot(t, moved, color=style.VERMILLION, label="tip", gid="displacement")
    band.set(ylabel="displacement from\nfrictionless\nequilibrium [mm]")
    for ax in (stiffness, band):
        ax.legend(loc="best", ncols=2)
    cable_lines(tension, t, run.tension, run.plan.arm.cables.names)
    tension.set(xlabel="time [s]", ylabel="tension [N]")
    error.set_ylim(bottom=0.0)
    changes = t[1:][(np.diff(run.wrench, axis=0) != 0.0).any(axis=1)][:1]
    for ax in panels:
        for at in changes:
            ax.axvline(at, color="0.3", linewidth=0.8, linestyle=":", gid="load changes")
    danger = f"{run.warnings[0].split(':')[0]}. " if run.warnings else ""
    dotted = " Dotted: the load changes" if changes.size else ""
    question = f"{danger}{run.plan.arm.name}: what does the law {run.law} hold?{dotted}"
    style.set_heading(panels, axs, title, question)
    return panels
