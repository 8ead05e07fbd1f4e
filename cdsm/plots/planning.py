"""Plot attainable stiffness, saturation against tension, and plans along a path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdsm.errors import InvalidInput
from cdsm.plots.style import (
    BLUE,
    COLORS,
    GREEN,
    N_PER_MM,
    ONE_COLUMN,
    SCREEN,
    SMALL,
    STYLES,
    TWO_COLUMNS,
    VERMILLION,
    cable_lines,
    caption,
    direction_name,
    expect,
    from_zero,
    heading,
    legend,
    panels,
    styled,
)
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm.planning.path_plan import PathPlan
    from cdsm.planning.range import StiffnessRange
    from cdsm.planning.saturation import Saturation

_SAME = 1e-9  # largest entry of a unit direction outside a plane in which it lies

_JUMP = 3.0
"""A change of the target is drawn as a step if it is more than this factor times the change before
and the change after it. Changes of the other sign do not matter."""


def plot_stiffness_ranges(ranges: Mapping[str, Sequence[StiffnessRange]]) -> Figure:
    """Plot the attainable stiffness [N/mm] against the direction, as a polar diagram.

    A curve for each label shows the largest stiffness. The smallest stiffness is shown for the last
    label only: the area inside its curve is shaded. Directions u and −u have equal stiffness, so
    half a turn of directions gives the whole diagram.

    Args:
        ranges: For each label, such as a bound of the tensions, a list of ranges, one for each
            direction. All directions are in one plane of two base axes, from 0° to below 180°.

    Raises:
        InvalidInput: A range is missing or of the wrong type, or the directions are not in one
            coordinate plane.
    """
    every = [one for each in ranges.values() for one in each]
    for one in every:
        expect("ranges", one, "StiffnessRange")
    if not every or not all(ranges.values()):
        raise InvalidInput("ranges", "is empty; give ranges of several directions by label.")
    u = np.array([one.direction for one in every])
    normal = int(abs(u).max(axis=0).argmin())
    if abs(u[:, normal]).max() > _SAME:
        raise InvalidInput("ranges", "has directions that are in no plane of two base axes.")
    first, second = (axis for axis in range(3) if axis != normal)
    figure = Figure(figsize=(ONE_COLUMN, 4.2), dpi=SCREEN, layout="constrained")
    axes: Any = styled(figure.add_subplot(projection="polar"))

    def around(found: Sequence[StiffnessRange], values: Sequence[float]) -> tuple[Array, Array]:
        v = np.array([one.direction for one in found])
        turn = np.arctan2(v[:, second], v[:, first])
        order = np.argsort(turn := np.mod(turn, np.pi))
        half, radius = turn[order], N_PER_MM * np.array(values)[order]
        return (
            np.concatenate([half, half + np.pi, half[:1] + 2.0 * np.pi]),
            np.concatenate([radius, radius, radius[:1]]),
        )

    shades = colormaps["cividis"](np.linspace(0.0, 0.85, len(ranges)))
    for k, ((label, found), shade) in enumerate(zip(ranges.items(), shades, strict=True)):
        high = around(found, [one.high for one in found])
        axes.plot(*high, STYLES[k % len(STYLES)], color=to_hex(shade), label=f"stiffest, {label}")
    label, found = [*ranges.items()][-1]
    low = around(found, [one.low for one in found])
    axes.fill(*low, color="0.85", label=f"below the attainable range, {label}")
    axes.plot(*low, color="0.4", linewidth=0.8)
    letters = "xyz"[first], "xyz"[second]
    ends = [f"{sign}{letter}" for sign in "+-" for letter in letters]
    axes.set_xticks(np.deg2rad([0.0, 90.0, 180.0, 270.0]), ends)
    heading(figure, "attainable stiffness along u [N/mm]")
    axes.set_rlabel_position(60.0)
    axes.yaxis.set_major_locator(MaxNLocator(4))
    figure.legend(loc="outside lower center", fontsize=SMALL, handlelength=2.4)
    return figure


def plot_saturation(found: Saturation) -> Figure:
    """Plot the stiffness against the lower bound of all tensions.

    Raises InvalidInput if ``found`` is not a result of :func:`~cdsm.saturation`.
    """
    expect("found", found, "Saturation")
    figure, ((axes,),) = panels(ONE_COLUMN, 2.6, 1)
    axes.plot(found.minimum, N_PER_MM * found.along, color=BLUE, label="least tensions")
    axes.set(xlabel="lower bound of tension [N]")
    axes.set_ylabel(f"stiffness along {direction_name(found.direction)} [N/mm]")
    axes.set_ylim(bottom=0.0)
    if np.isfinite(found.bound):
        label = f"saturates at {found.bound:.4g} N"
        axes.axvline(found.bound, color=VERMILLION, linestyle="--", label=label)
    if found.minimum[0] < found.stiffest < found.minimum[-1]:
        label = f"softer above {found.stiffest:.4g} N"
        axes.axvline(found.stiffest, color=GREEN, linestyle="-.", label=label)
    legend(axes, loc="lower right")
    heading(figure, found.posture.arm.name)
    return figure


def plot_path_plan(plan: PathPlan) -> Figure:
    """Plot wanted and planned stiffness, and tensions, against the samples of a path.

    Infeasible samples are shaded. The legend names up to 24 cables; a colour bar numbers more.
    Raises InvalidInput if ``plan`` is not a result of :func:`~cdsm.plan_path`.
    """
    expect("plan", plan, "PathPlan")
    figure, ((above,), (below,)) = panels(TWO_COLUMNS, 4.6, 1, rows=2, sharex=True)
    size = len(plan.target)
    wanted = N_PER_MM * plan.target.reshape(size, -1)
    # NaN leaves a gap in the line at samples that are not planned
    achieved = np.full(wanted.shape, np.nan)
    tensions = np.full((size, plan.tensions.shape[1]), np.nan)
    rows = list(plan.planned)
    achieved[rows] = N_PER_MM * plan.achieved.reshape(len(rows), wanted.shape[1])
    tensions[rows] = plan.tensions
    for k, u in enumerate(plan.direction.reshape(-1, 3)):
        color = COLORS[k % len(COLORS)]
        label = "wanted" if k == 0 else None
        above.plot(*_stepped(wanted[:, k]), color="0.7", linewidth=4.0, label=label)
        label = f"reached along {direction_name(u)}"
        above.plot(achieved[:, k], ".-", color=color, linewidth=1.0, markersize=3, label=label)
    line = {"marker": ".", "linewidth": 0.9, "markersize": 2}
    cable_lines(below, np.arange(0.0, size), tensions, plan.arm.cables.names, **line)
    for axes in (above, below):
        for index in (sample.index for sample in plan.infeasible):
            axes.axvspan(index - 0.5, index + 0.5, color=VERMILLION, alpha=0.15, linewidth=0.0)
    from_zero(above, wanted, achieved)
    from_zero(below, tensions)
    shaded = "; shaded: infeasible" if plan.infeasible else ""
    above.set_ylabel("stiffness [N/mm]")
    caption(above, f"{plan.arm.name}{shaded}")
    legend(above, loc="lower right")
    below.xaxis.set_major_locator(MaxNLocator(integer=True))
    below.set(xlabel="sample", ylabel="tension of each cable [N]")
    return figure


def _stepped(values: Array) -> tuple[Array, Array]:
    """Return x and y of a line through ``values`` (S,) at x = 0, 1, …, S − 1.

    A change much larger than the changes beside it becomes a vertical step halfway.
    """
    changes = np.diff(values)
    around = np.pad(changes, 1)
    # only neighbouring changes of equal sign make a ramp; up and back down is two steps
    ramp = np.maximum(around[:-2] * np.sign(changes), around[2:] * np.sign(changes))
    last = np.flatnonzero(abs(changes) > _JUMP * np.maximum(ramp, 0.0))
    at = np.repeat(last + 1, 2)
    beside = np.stack([values[last], values[last + 1]], axis=1).ravel()
    return np.insert(np.arange(0.0, values.size), at, at - 0.5), np.insert(values, at, beside)
