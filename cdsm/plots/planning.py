"""Plot the attainable stiffness of an arm, and plans of stiffness."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdsm.errors import InvalidInput
from cdsm.plots.style import COLORS, N_PER_MM, expect, panels
from cdsm.support.format import coordinates
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm.planning.path_plan import PathPlan
    from cdsm.planning.plan import StiffnessPlan
    from cdsm.planning.range import StiffnessRange

_SAME = 1e-9
"""Largest difference between the entries of two equal unit directions."""

_JUMP = 3.0
"""The target jumps where a change exceeds the neighbouring changes of equal sign by this factor."""

_NAMED = 20
"""Above this number of cables the colours are not distinct, so cables are not named."""


def plot_stiffness_plan(plan: StiffnessPlan, attainable: StiffnessRange) -> Figure:
    """Plot the tensions of all cables: for the softest, the planned and the stiffest arm.

    Args:
        plan: Result of :func:`~cdsm.planning.plan.plan_stiffness` for one direction.
        attainable: Range of stiffness along the direction of the plan, at its posture.

    Raises:
        InvalidInput: The arguments are not a plan and a range, or differ in posture or direction.
    """
    expect("plan", plan, "StiffnessPlan")
    expect("attainable", attainable, "StiffnessRange")
    same = plan.tension.posture._equals(attainable.posture)
    u = np.zeros(3) if plan.direction is None else plan.direction
    if not same or not np.allclose(u, attainable.direction, rtol=0.0, atol=_SAME):
        raise InvalidInput("attainable", "is not of the posture and the direction of the plan.")
    figure, ((axes,),) = panels(8.0, 4.0, 1)
    names = [cable.name for cable in attainable.posture.arm.cables]
    for tension, value, name, color, marker in (
        (attainable.low_tension, attainable.low, "softest", COLORS[2], "v"),
        (plan.tension, float(plan.achieved), "planned", COLORS[0], "o"),
        (attainable.high_tension, attainable.high, "stiffest", COLORS[1], "^"),
    ):
        label = f"{name}: {N_PER_MM * value:.4g} N/mm"
        axes.plot(names, tension.values, marker, color=color, label=label, linestyle=":")
    axes.set(ylabel="tension [N]", title=f"stiffness along {_named(attainable.direction)}")
    axes.set_ylim(bottom=0.0)
    axes.tick_params(axis="x", rotation=60)
    axes.legend(fontsize=8)
    return figure


def plot_path_plan(plan: PathPlan) -> Figure:
    """Plot wanted and planned stiffness, and tensions, over the samples of a path.

    Infeasible samples are shaded. Target jumps are steps. Up to 20 cables have colours and names.

    Args:
        plan: Result of :func:`~cdsm.planning.path.plan_path` for one direction or several.

    Raises:
        InvalidInput: ``plan`` is not a plan of a path, or is a plan of ``cartesian``.
    """
    expect("plan", plan, "PathPlan")
    if plan.direction is None:
        raise InvalidInput("plan", "is one of cartesian; only stiffness along directions is drawn.")
    figure, ((above,), (below,)) = panels(8.0, 5.5, 1, rows=2, sharex=True)
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
        above.plot(*_stepped(wanted[:, k]), color="0.6", linewidth=3.0, label=label)
        above.plot(achieved[:, k], ".-", color=color, linewidth=1.0, markersize=3, label=_named(u))
    names = [cable.name for cable in plan.arm.cables]
    named = len(names) <= _NAMED
    for c, name in enumerate(names):
        color = to_hex(colormaps["tab20"](c)) if named else COLORS[0]
        below.plot(tensions[:, c], ".-", color=color, linewidth=0.9, markersize=2, label=name)
    if named:
        beside = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5), "frameon": False}
        below.legend(fontsize=7, ncols=1 + (len(names) > _NAMED // 2), **beside)
    for axes in (above, below):
        for index in (sample.index for sample in plan.infeasible):
            axes.axvspan(index - 0.5, index + 0.5, color=COLORS[1], alpha=0.15, linewidth=0.0)
        axes.margins(y=0.1)
        axes.set_ylim(bottom=0.0)
    above.set(ylabel="stiffness [N/mm]", title=f"{plan.arm.name}; shaded: infeasible")
    above.legend(title="along", fontsize=8, title_fontsize=8)
    below.xaxis.set_major_locator(MaxNLocator(integer=True))
    below.set(xlabel="sample", ylabel="tension of each cable [N]")
    return figure


def _stepped(values: Array) -> tuple[Array, Array]:
    """Build a line through the samples (S,); a jump becomes a step half-way between two samples."""
    changes = np.diff(values)
    around = np.pad(changes, 1)
    # only neighbouring changes of equal sign make a ramp; up and back down is two jumps
    ramp = np.maximum(around[:-2] * np.sign(changes), around[2:] * np.sign(changes))
    last = np.flatnonzero(abs(changes) > _JUMP * np.maximum(ramp, 0.0))
    at = np.repeat(last + 1, 2)
    beside = np.stack([values[last], values[last + 1]], axis=1).ravel()
    return np.insert(np.arange(0.0, values.size), at, at - 0.5), np.insert(values, at, beside)


def _named(u: Array) -> str:
    """Format a direction; rounding errors become zero."""
    return coordinates(np.round(u, 9), "z.3g")
