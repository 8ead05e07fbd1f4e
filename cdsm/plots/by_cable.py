"""Plot a number for each cable: shares of a stiffness, and tensions of plans."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from cdsm.errors import InvalidInput
from cdsm.plots.style import (
    BLUE,
    GREEN,
    N_PER_MM,
    ONE_COLUMN,
    ORANGE,
    TWO_COLUMNS,
    VERMILLION,
    caption,
    direction_name,
    expect,
    from_zero,
    heading,
    legend,
    panels,
)
from cdsm.support.format import plural

if TYPE_CHECKING:
    from cdsm.batch import Tensions
    from cdsm.planning.plan import StiffnessPlan
    from cdsm.planning.range import StiffnessRange
    from cdsm.stiffness_matrix import Shares
    from cdsm.tension import Tension

_SAME = 1e-9  # largest difference between the entries of two equal unit directions
_WIDE = 12  # above this number of cables, a figure with their names is two columns wide
_MOST_NAMES = 72  # largest number of names below an axis; of more, every second, third, … is shown


def plot_shares(shares: Shares) -> Figure:
    """Plot the contribution of each cable, of gravity, load and springs to a stiffness as bars.

    Raises InvalidInput if ``shares`` is not a result of :meth:`cdsm.Stiffness.shares`.
    """
    expect("shares", shares, "Shares")
    arm = shares.stiffness.posture.arm
    names = [*arm.cables.names, *shares.others]
    figure, ((axes,),) = panels(_width(names), 2.8, 1)
    rest = np.array([*shares.others.values()])
    passive = N_PER_MM * np.append(shares.passive, 0.0 * rest)
    active = N_PER_MM * np.append(shares.active, 0.0 * rest)
    others = N_PER_MM * np.append(0.0 * shares.cables, rest)
    # bars of one sign stand on each other, so that none hides another
    for values, below, color, label in (
        (passive, 0.0 * passive, BLUE, "passive: elasticity"),
        (active, np.where(active * passive > 0.0, passive, 0.0), ORANGE, "active: tension"),
        (others, 0.0 * others, GREEN, ", ".join(shares.others)),
    ):
        axes.bar(names, values, bottom=below, color=color, label=label)
    axes.axhline(0.0, color="0.2", linewidth=0.8)
    _name_cables(axes)
    axes.set_ylabel("contribution [N/mm]")
    total = f"{N_PER_MM * shares.total:.4g} N/mm along {direction_name(shares.direction)}"
    unstable = "" if shares.stiffness.is_stable else "UNSTABLE: "
    heading(figure, f"{unstable}{arm.name}: what makes up the {total}")
    legend(axes)
    return figure


def plot_stiffness_plan(plan: StiffnessPlan, attainable: StiffnessRange | None = None) -> Figure:
    """Plot the planned tension of each cable, beside those of the softest and the stiffest arm.

    Args:
        plan: Result of :func:`~cdsm.plan_stiffness`.
        attainable: Result of :func:`~cdsm.stiffness_range` at the posture and along the direction
            of the plan, which must have one direction. If it is given, the tensions of the softest
            and of the stiffest arm are drawn too.

    Raises:
        InvalidInput: The arguments are not a plan and a range, or differ in posture or direction.
    """
    expect("plan", plan, "StiffnessPlan")
    F = plan.tension
    if attainable is None:
        misses = "" if plan.reached else f", missed by {100.0 * plan.misfit:.2g} %"
        return _plot_tensions([(F, f"planned{misses}", "o")], f"{F.posture.arm.name}: plan")
    expect("attainable", attainable, "StiffnessRange")
    same = F.posture._equals(attainable.posture)
    u = plan.direction
    if not same or u.shape != (3,) or abs(u - attainable.direction).max() > _SAME:
        raise InvalidInput("attainable", "is not of the posture and the direction of the plan.")
    planned = F, f"planned: {N_PER_MM * float(plan.achieved):.4g} N/mm", "o"
    softest, stiffest = _ends(attainable)
    return _plot_tensions([softest, planned, stiffest], _along(attainable))


def plot_stiffness_range(attainable: StiffnessRange) -> Figure:
    """Plot the tension of each cable for the softest and for the stiffest arm.

    Raises InvalidInput if ``attainable`` is not a result of :func:`~cdsm.stiffness_range`.
    """
    expect("attainable", attainable, "StiffnessRange")
    return _plot_tensions(_ends(attainable), _along(attainable))


def plot_tensions(tensions: Tensions) -> Figure:
    """Plot the median tension of each cable over many postures, with the least and the largest.

    Raises InvalidInput if ``tensions`` is not a result of :func:`~cdsm.distribute_tensions`, or all
    tensions are NaN.
    """
    expect("tensions", tensions, "Tensions")
    found, names = tensions.values[tensions.ok], tensions.arm.cables.names
    if not len(found):
        raise InvalidInput("tensions", "have no posture with tensions; see their status.")
    figure, ((axes,),) = panels(_width(names), 2.8, 1)
    low, middle, high = np.quantile(found, [0.0, 0.5, 1.0], axis=0)
    reach = [middle - low, high - middle]
    axes.errorbar(names, middle, reach, fmt="o", color=BLUE, markersize=3, capsize=2, linewidth=0.8)
    axes.set_ylabel("tension [N]")
    from_zero(axes, high)
    count = f"{len(found)} of {plural(len(tensions), 'posture')}"
    caption(axes, f"{tensions.arm.name}: median and range, {count}")
    _name_cables(axes)
    return figure


def _width(names: Sequence[str]) -> float:
    return TWO_COLUMNS if len(names) > _WIDE else ONE_COLUMN


def _name_cables(axes: Any) -> None:
    axes.tick_params(axis="x", rotation=60)
    place, names = axes.get_xticks(), [label.get_text() for label in axes.get_xticklabels()]
    step = -(-len(names) // _MOST_NAMES)
    axes.set_xticks(place[::step], names[::step])
    for label in axes.get_xticklabels():
        label.set(ha="right", rotation_mode="anchor")


def _ends(attainable: StiffnessRange) -> tuple[tuple[Tension, str, str], ...]:
    """Return the tensions, a label and a marker for the softest arm, then for the stiffest."""
    return (
        (attainable.low_tension, f"softest: {N_PER_MM * attainable.low:.4g} N/mm", "v"),
        (attainable.high_tension, f"stiffest: {N_PER_MM * attainable.high:.4g} N/mm", "^"),
    )


def _along(attainable: StiffnessRange) -> str:
    return f"{attainable.posture.arm.name}: stiffness along {direction_name(attainable.direction)}"


def _plot_tensions(shown: Sequence[tuple[Tension, str, str]], title: str) -> Figure:
    """Plot the tensions of the same cables in several cases, each (tensions, label, marker)."""
    names = shown[0][0].keys()
    figure, ((axes,),) = panels(_width(names), 2.8, 1)
    colors = {"v": GREEN, "o": BLUE, "^": VERMILLION}
    for F, label, marker in shown:
        line = {"color": colors[marker], "linestyle": ":", "linewidth": 0.8, "markersize": 4}
        axes.plot(names, F.values, marker, label=label, **line)
    axes.set_ylabel("tension [N]")
    caption(axes, title)
    from_zero(axes, *(F.values for F, *_ in shown))
    _name_cables(axes)
    legend(axes)
    return figure
