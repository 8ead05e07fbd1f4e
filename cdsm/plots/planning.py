"""Plot attainable stiffness, saturation, plans, and a number for each cable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cdsm.errors import InvalidInput
from cdsm.planning.range import StiffnessRange
from cdsm.plots import style
from cdsm.plots.style import N_PER_MM
from cdsm.quantities import QUANTITIES, display_of, si_of
from cdsm.support.format import one_unit
from cdsm.support.status import check_sweep
from cdsm.support.validation import instance, one_of
from cdsm.support.values import Array

if TYPE_CHECKING:
    import xarray

    from cdsm.planning.path_plan import PathPlan
    from cdsm.planning.plan import StiffnessPlan
    from cdsm.planning.sensitivity import Saturation
    from cdsm.stiffness_matrix import Shares
    from cdsm.tension import Tension

    _Case = tuple[Tension, str, str]

_SAME = 1e-9  # largest difference between the entries of two equal unit directions
_WIDE = 12  # above this number of cables, a figure with their names is two columns wide
_MOST_NAMES = 72  # largest number of names below an axis; of more, every second, third, … is shown


@style.styled
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
    every = [attainable for row in ranges.values() for attainable in row]
    for attainable in every:
        instance("ranges", attainable, StiffnessRange)
    if not every or not all(ranges.values()):
        raise InvalidInput("ranges", "is empty; give ranges of several directions by label.")
    u = abs(np.array([attainable.direction for attainable in every])).max(axis=0)
    if u.min() > _SAME:
        raise InvalidInput("ranges", "has directions that are in no plane of two base axes.")
    first, second = plane = sorted(np.argsort(u)[1:].tolist())
    figure = Figure(figsize=(style.ONE_COLUMN, 4.2))
    axes: Any = figure.add_subplot(projection="polar")

    def around(row: Sequence[StiffnessRange], values: Sequence[float]) -> tuple[Array, Array]:
        v = np.array([one.direction for one in row])
        half = np.mod(np.arctan2(v[:, second], v[:, first]), np.pi)
        turn = np.sort(half)
        radius = N_PER_MM * np.array(values)[np.argsort(half)]
        return np.append(turn, [*(turn + np.pi), turn[0]]), np.append(radius, [*radius, radius[0]])

    shades = colormaps[style.COLOR_MAP](np.linspace(0.0, 0.85, len(ranges)))
    for k, (label, row) in enumerate(ranges.items()):
        high = around(row, [one.high for one in row])
        axes.plot(*high, style.STYLES[k % 4], color=shades[k], label=f"stiffest, {label}")
    low = around(row, [one.low for one in row])
    axes.fill(*low, color="0.85", label=f"below the attainable range, {label}")
    axes.plot(*low, color="0.4", linewidth=0.8)
    ends = [f"{sign}{'xyz'[axis]}" for sign in "+-" for axis in plane]
    axes.set_xticks(np.deg2rad([0.0, 90.0, 180.0, 270.0]), ends)
    axes.set_rlabel_position(60.0)
    axes.yaxis.set_major_locator(MaxNLocator(4))
    figure.legend(loc="outside lower center")
    return style.titled(figure, "attainable stiffness along u [N/mm]")


@style.styled
def plot_saturation(saturation: Saturation) -> Figure:
    """Plot the stiffness [N/mm] against the lower bound of all tensions [N]."""
    figure, ((axes,),) = style.panels(style.ONE_COLUMN, 2.6)
    axes.plot(saturation.minimum, N_PER_MM * saturation.along, label="least tensions")
    direction = style.direction_name(saturation.direction)
    axes.set(xlabel="lower bound of tension [N]", ylabel=f"stiffness along {direction} [N/mm]")
    axes.set_ylim(0.0, 1.1 * axes.get_ylim()[1])  # also a curve that hardly changes is seen
    if np.isfinite(saturation.bound):
        label = f"saturates at {saturation.bound:.4g} N"
        axes.axvline(saturation.bound, color=style.VERMILLION, linestyle="--", label=label)
    if saturation.minimum[0] < saturation.stiffest < saturation.minimum[-1]:
        label = f"softer above {saturation.stiffest:.4g} N"
        axes.axvline(saturation.stiffest, color=style.GREEN, linestyle="-.", label=label)
    axes.legend(loc="lower right")
    return style.titled(figure, saturation.posture.arm.name)


@style.styled
def plot_tension_curve(dataset: xarray.Dataset, quantity: str = "along") -> Figure:
    """Plot a quantity of a sweep at one posture against the least tension that held.

    Args:
        dataset: Result of :func:`~cdsm.sweep` of one posture with several ``minimum``.
        quantity: A quantity with one number, or one for each direction; by default the stiffness
            ``along``. Gaps are where it does not exist; the text of the sweep says why.

    Raises:
        InvalidInput: ``dataset`` is no sweep, or has several postures, wrenches or only one
            minimum. It has no such quantity, or that has more numbers.
    """
    check_sweep(dataset)
    curve = dataset[one_of("quantity", quantity, map(str, dataset.data_vars))].squeeze(drop=True)
    rows = curve.transpose("minimum", ...) if "minimum" in curve.dims else curve
    if rows.dims not in (("minimum",), ("minimum", "direction")):
        problem = f"{quantity} has the dimensions {', '.join(map(str, rows.dims)) or 'none'}"
        remedy = "one posture, one wrench and several minimum are needed, and one number each."
        raise InvalidInput("dataset", f"{problem}; {remedy}")
    held = dataset["minimum_held"].values.min(axis=-1)
    order = np.argsort(held, kind="stable")
    unit, size = display_of(si_of(curve.units))
    figure, ((axes,),) = style.panels(style.ONE_COLUMN, 2.6)
    values = rows.values.reshape(len(held), -1)[order] / size
    labels = dataset["direction"].values.tolist() if rows.ndim == 2 else [quantity]
    for k, (label, column) in enumerate(zip(labels, values.T, strict=True)):
        axes.plot(held[order], column, ".-", color=style.COLORS[k % 7], label=f"{label}")
    axes.set_xlabel("least tension of every cable [N]")
    words = QUANTITIES[quantity].words.removesuffix(" along a direction")
    axes.set_ylabel(f"{words} [{one_unit(unit)}]" if unit.strip("1") else words)
    style.from_zero(axes, values)
    if rows.ndim == 2:
        axes.legend(title="along")
    return style.titled(figure, str(dataset.attrs["title"]).rpartition(" of ")[2])


@style.styled
def plot_path_plan(plan: PathPlan) -> Figure:
    """Plot wanted and reached stiffness [N/mm] and the tensions [N] against the samples.

    Infeasible samples are shaded. :func:`plot_path` draws the arm on its path, and writes a film.
    """
    figure, ((above,), (below,)) = style.panels(style.TWO_COLUMNS, 4.6, rows=2, sharex=True)
    x = np.arange(float(len(plan.target)))
    rows = list(plan.planned)
    wanted = N_PER_MM * plan.target.reshape(len(x), -1)
    # NaN leaves a gap in the line at samples that are not planned
    achieved = np.full(wanted.shape, np.nan)
    tensions = np.full((len(x), plan.tensions.shape[1]), np.nan)
    achieved[rows] = N_PER_MM * plan.achieved.reshape(len(rows), wanted.shape[1])
    tensions[rows] = plan.tensions
    for k, u in enumerate(plan.direction.reshape(-1, 3)):
        label = f"reached along {style.direction_name(u)}"
        color = style.COLORS[k % 7]
        wide = {"color": "0.7", "linewidth": 4.0, "label": None if k else "wanted"}
        above.step(x, wanted[:, k], where="mid", **wide)
        above.plot(x, achieved[:, k], ".-", color=color, linewidth=1.0, label=label)
    line = {"marker": ".", "linewidth": 0.9, "markersize": 2.0}
    style.cable_lines(below, x, tensions, plan.arm.cables.names, **line)
    for axes, values in ((above, (wanted, achieved)), (below, (tensions,))):
        style.from_zero(axes, *values)
        for i in (sample.index for sample in plan.infeasible):
            axes.axvspan(i - 0.5, i + 0.5, color=style.VERMILLION, alpha=0.15, linewidth=0.0)
    above.set_ylabel("stiffness [N/mm]")
    above.set_title(f"{plan.arm.name}{'; shaded: infeasible' if plan.infeasible else ''}")
    above.legend(loc="lower right")
    style.whole_numbers(below.xaxis)
    below.set(xlabel="sample", ylabel="tension of each cable [N]")
    return figure


@style.styled
def plot_shares(shares: Shares) -> Figure:
    """Plot the contribution [N/mm] of each cable, gravity, load and springs as bars."""
    arm = shares.posture.arm
    rest = [*shares.others.values()]
    none = np.zeros(len(rest))
    passive, active = (N_PER_MM * np.append(part, none) for part in (shares.passive, shares.active))
    others = N_PER_MM * np.append(0.0 * shares.active, rest)
    figure, axes = _by_name([*arm.cables.names, *shares.others], "contribution [N/mm]")
    # bars of one sign stand on each other, so that none hides another
    on = np.where(active * passive > 0.0, passive, 0.0)
    x = np.arange(len(passive))
    axes.bar(x, passive, color=style.BLUE, label="passive: elasticity")
    axes.bar(x, active, bottom=on, color=style.ORANGE, label="active: tension")
    axes.bar(x, others, color=style.GREEN, label=", ".join(shares.others))
    axes.axhline(0.0, color="0.2", linewidth=0.8)
    total = f"{N_PER_MM * shares.total:.4g} N/mm along {style.direction_name(shares.direction)}"
    unstable = "" if shares.is_stable else "UNSTABLE: "
    axes.legend()
    return style.titled(figure, f"{unstable}{arm.name}: contributions to {total}")


@style.styled
def plot_stiffness_plan(plan: StiffnessPlan, attainable: StiffnessRange | None = None) -> Figure:
    """Plot the planned tension [N] of each cable, beside those of the softest and stiffest arm."""
    F = plan.tension
    misses = "" if plan.reached else f", missed by {100.0 * plan.misfit:.2g} %"
    if attainable is None:
        return _plot_tensions([(F, f"planned{misses}", "o")], f"{F.posture.arm.name}: plan")
    instance("attainable", attainable, StiffnessRange)
    same = F.posture.equals(attainable.posture) and plan.direction.shape == (3,)
    if not same or abs(plan.direction - attainable.direction).max() > _SAME:
        raise InvalidInput("attainable", "is not of the posture and the direction of the plan.")
    label = f"planned: {N_PER_MM * float(plan.achieved):.4g} N/mm"
    return plot_stiffness_range(attainable, [(F, label, "o")])


@style.styled
def plot_stiffness_range(attainable: StiffnessRange, planned: Sequence[_Case] = ()) -> Figure:
    """Plot the tension [N] of each cable for the softest and the stiffest arm, and as planned."""
    softest = f"softest: {N_PER_MM * attainable.low:.4g} N/mm"
    stiffest = f"stiffest: {N_PER_MM * attainable.high:.4g} N/mm"
    ends = (attainable.low_tension, softest, "v"), (attainable.high_tension, stiffest, "^")
    along = f"stiffness along {style.direction_name(attainable.direction)}"
    title = f"{attainable.posture.arm.name}: {along}"
    return _plot_tensions([ends[0], *planned, ends[1]], title)


def _by_name(names: Sequence[str], label: str) -> tuple[Figure, Any]:
    """Build a figure and its panel, with a place for each name at 0, 1, 2, … of the x-axis."""
    width = style.TWO_COLUMNS if len(names) > _WIDE else style.ONE_COLUMN
    figure, ((axes,),) = style.panels(width, 2.8)
    step = -(-len(names) // _MOST_NAMES)
    places = np.arange(len(names))[::step]
    axes.set_xticks(places, names[::step], rotation=60, ha="right", rotation_mode="anchor")
    axes.set_ylabel(label)
    return figure, axes


def _plot_tensions(shown: Sequence[_Case], title: str) -> Figure:
    """Plot the tensions of the same cables in several cases, each (tensions, label, marker)."""
    figure, axes = _by_name(shown[0][0].posture.arm.cables.names, "tension [N]")
    colors = {"v": style.GREEN, "o": style.BLUE, "^": style.VERMILLION}
    for F, label, marker in shown:
        axes.plot(F.values, marker, color=colors[marker], ls=":", lw=0.8, label=label)
    axes.set_title(title)
    style.from_zero(axes, *(F.values for F, *_ in shown))
    axes.legend()
    return figure
