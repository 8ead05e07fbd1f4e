"""Plot a number for each cable as horizontal bars: shares of a stiffness, tensions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.axes import Axes

from cdsm.errors import InvalidInput
from cdsm.planning.range import StiffnessRange
from cdsm.plots import style
from cdsm.support.format import stiffness_text, stiffness_unit
from cdsm.support.validation import instance, scalar
from cdsm.support.values import Array
from cdsm.tension import Tension

if TYPE_CHECKING:
    from cdsm.planning.plan import StiffnessPlan
    from cdsm.stiffness_matrix import Shares

_SAME = 1e-9  # largest difference between the entries of two equal unit directions
_BAR = 0.74  # thickness of a bar, over the distance of two rows
_GAP = 0.45  # between cables of two joints
_ROW = 0.125  # height of a row [inch]
_LARGE = 0.02  # shares below this part of the total are written in grey
_LONGEST = 24  # characters of a name beside a bar; of a longer one the middle is left out
_MOST_ROWS = 72  # of more cables every second, third, … row has a name


@style.styled
def plot_shares(shares: Shares, ax: Axes | None = None, *, title: str | None = None) -> Axes:
    """Plot the contribution of each cable, gravity, load and springs as bars [N/mm, or N/m].

    The passive part of a cable (its elasticity) and the active one (its tension) stand on each
    other, with the share of both beside them.
    """
    arm = shares.posture.arm
    others = shares.others
    panel, y = _rows(ax, arm.cables.names, others)
    unit, size = stiffness_unit(shares.total, shares.passive, shares.active)
    passive = shares.passive / size
    active = shares.active / size
    cables = y[: len(passive)]
    # bars of one sign stand on each other, so that none hides another
    left = np.where(passive * active > 0.0, passive, 0.0)
    panel.barh(cables, passive, _BAR, color=style.BLUE, label="passive: its elasticity")
    panel.barh(cables, active, _BAR, left=left, color=style.ORANGE, label="active: its tension")
    rest = np.array(list(others.values())) / size
    colors = [style.TERM_COLORS.get(name, "0.5") for name in others]
    panel.barh(y[len(passive) :], rest, _BAR, color=colors)
    high = np.append(np.maximum(passive, 0.0) + np.maximum(active, 0.0), np.maximum(rest, 0.0))
    low = np.append(np.minimum(passive, 0.0) + np.minimum(active, 0.0), np.minimum(rest, 0.0))
    width = float(high.max() - low.min()) or 1.0
    total = shares.total / size
    for place, value, end in zip(y, np.append(passive + active, rest), high, strict=True):
        color = style.INK if abs(value) > _LARGE * abs(total) else style.SOFT
        _write(panel, end + 0.012 * width, place, f"{100.0 * value / total:z.1f} %", color)
    panel.axvline(0.0, color="0.3", lw=0.6)
    panel.set_xlim(low.min() - 0.02 * width, high.max() + 0.17 * width)
    direction = style.direction_name(shares.direction)
    panel.set_xlabel(f"contribution [{unit}] to {total:.4g} {unit} along {direction}")
    # to the left, where names of cables leave room
    _legend_below(panel, "right")
    style.set_title(panel, title, f"{arm.name}: what makes it stiff?", shares.is_stable)
    return panel


@style.styled
def plot_tensions(
    tension: Tension,
    ax: Axes | None = None,
    *,
    breaking: float | None = None,
    title: str | None = None,
) -> Axes:
    """Plot the tension [N] of each cable as a bar, with the bounds that held.

    Args:
        tension: The tensions.
        ax: Ordinary axes to draw on; None: a new figure of one column.
        breaking: Breaking load [N] of a wire, of which the bars then show percents.
        title: Title; None: the arm's name and the question.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> cdsm.plots.plot_tensions(cdsm.distribute_tension(pose, minimum=5.0)).get_xlabel()
        'tension [N]'
    """
    panel, y, highest = _tension_bars(tension, ax, breaking)
    _bounds(panel, y, tension)
    panel.set_xlim(0.0, (1.3 if breaking else 1.18) * highest)
    style.set_title(panel, title, f"{tension.posture.arm.name}: how hard do its motors pull?")
    return panel


@style.styled
def plot_stiffness_plan(
    plan: StiffnessPlan,
    attainable: StiffnessRange | None = None,
    ax: Axes | None = None,
    *,
    title: str | None = None,
) -> Axes:
    """Plot the planned tension [N] of each cable, with those of the softest and stiffest arm."""
    F = plan.tension
    if attainable is not None:
        instance("attainable", attainable, StiffnessRange)
        same = F.posture.equals(attainable.posture) and plan.direction.shape == (3,)
        if not same or abs(plan.direction - attainable.direction).max() > _SAME:
            problem = "is not of the posture and the direction of the plan."
            raise InvalidInput("attainable", problem)
    panel, y, highest = _tension_bars(F, ax, None)
    if attainable is None:
        _bounds(panel, y, F)
    else:
        highest = max(highest, _marks(panel, y, attainable))
    panel.set_xlim(0.0, 1.18 * highest)
    unit, size = stiffness_unit(plan.achieved)
    achieved = " and ".join(f"{k / size:.4g}" for k in np.atleast_1d(plan.achieved))
    misses = "" if plan.reached else f", missed by {100.0 * plan.misfit:.2g} %"
    question = f"which tensions give {achieved} {unit}?"
    style.set_title(panel, title, f"{F.posture.arm.name}: {question}{misses}")
    return panel


@style.styled
def plot_stiffness_range(
    attainable: StiffnessRange, ax: Axes | None = None, *, title: str | None = None
) -> Axes:
    """Plot the tension [N] of each cable for the softest and the stiffest arm."""
    arm = attainable.posture.arm
    panel, y = _rows(ax, arm.cables.names)
    low, high = attainable.low_tension.values, attainable.high_tension.values
    panel.hlines(y, low, high, color="0.75", lw=1.0, zorder=1, gid="between")
    panel.set_xlim(0.0, 1.08 * _marks(panel, y, attainable))
    panel.set_xlabel("tension [N]")
    direction = style.direction_name(attainable.direction)
    style.set_title(panel, title, f"{arm.name}: how stiff can it be along {direction}?")
    return panel


def _rows(ax: Axes | None, names: Sequence[str], others: Iterable[str] = ()) -> tuple[Axes, Array]:
    """Return a panel with a row for each name, first on top, and their places (n,)."""
    labels = [*names, *others]
    groups = [name.rpartition("_")[0] or "cables" for name in names]
    groups += [""] * (len(labels) - len(names))
    breaks = np.cumsum([0, *(a != b for a, b in pairwise(groups))])
    y = np.arange(len(labels)) + _GAP * breaks
    panel = style.panel(ax, 0.85 + _ROW * (y[-1] + 1.2))
    step = -(-len(labels) // _MOST_ROWS)
    shown = [_shortened(label) for label in labels[::step]]
    panel.set_yticks(y[::step], shown, fontsize=style.NOTE_SIZE, parse_math=False)
    panel.tick_params("y", length=0, pad=2)
    panel.set_ylim(y[-1] + 0.7, -0.7)
    panel.grid(visible=False, axis="y")
    panel.spines["left"].set_visible(False)
    return panel, y


def _shortened(name: str) -> str:
    half = _LONGEST // 2
    return name if len(name) <= _LONGEST else f"{name[: half - 1]}…{name[-half:]}"


def _write(panel: Axes, x: float, y: float, text: str, color: str = style.INK) -> None:
    look: dict[str, Any] = {"fontsize": style.NOTE_SIZE, "va": "center", "color": color}
    panel.text(x, y, text, **look)


def _tension_bars(
    tension: Tension, ax: Axes | None, breaking: float | None
) -> tuple[Axes, Array, float]:
    """Draw bars of tensions with their numbers; return panel, rows and the largest one [N]."""
    F = instance("tension", tension, Tension).values
    panel, y = _rows(ax, tension.posture.arm.cables.names)
    bars = panel.barh(y, F, _BAR, color=style.tension_colors(F).to_rgba(F), zorder=2)
    for bar, name in zip(bars, tension.keys(), strict=True):
        bar.set_gid(f"tension:{name}")
    highest = float(F.max()) or 1.0
    label = "tension [N]"
    if breaking is not None:
        scalar("breaking", breaking)
        if not breaking > 0.0:
            raise InvalidInput("breaking", f"{breaking:g} N given; a breaking load is above 0.")
        label += f", and its part of the breaking load of {breaking:g} N"
    for place, value in zip(y, F, strict=True):
        part = "" if breaking is None else f", {100.0 * value / breaking:.0f} %"
        _write(panel, value + 0.015 * highest, place, f"{value:.1f} N{part}")
    panel.set_xlabel(label)
    return panel, y, highest


def _bounds(panel: Axes, y: Array, tension: Tension) -> None:
    """Mark the bounds of the tensions that are within the picture."""
    largest = float(tension.values.max())
    for bound, name, words in (
        (tension.minimum_held, "minimum", "least that is allowed"),
        (tension.maximum_held, "maximum", "most that is allowed"),
    ):
        bound = np.broadcast_to(bound, (len(tension),))
        shown = np.isfinite(bound) & (bound > 0.0) & (bound <= 1.15 * largest)
        if shown.any():
            look: dict[str, Any] = {"color": style.VERMILLION, "ms": 6, "mew": 1.1, "zorder": 3}
            panel.plot(bound[shown], y[shown], "|", label=words, gid=f"bound:{name}", **look)
    if panel.get_legend_handles_labels()[1]:
        _legend_below(panel, "left")


def _legend_below(panel: Axes, side: Literal["left", "right"]) -> None:
    """Put the legend below the label of the x-axis, at one side."""
    anchor = (float(side == "right"), -0.42 / style.height_of(panel))
    look: dict[str, Any] = {"loc": f"upper {side}", "bbox_to_anchor": anchor, "ncols": 2}
    panel.legend(**look)


def _marks(panel: Axes, y: Array, attainable: StiffnessRange) -> float:
    """Mark the tensions of the softest and the stiffest arm; return the largest [N]."""
    cases = (
        ("softest", attainable.low, attainable.low_tension, "v", style.GREEN),
        ("stiffest", attainable.high, attainable.high_tension, "^", style.VERMILLION),
    )
    for name, value, tension, marker, color in cases:
        look: dict[str, Any] = {"color": color, "mfc": "white", "mew": 1.0, "ms": 4.5, "zorder": 4}
        words = f"{name}: {stiffness_text(value)}"
        panel.plot(tension.values, y, marker, ls="", label=words, gid=name, **look)
    _legend_below(panel, "left")
    return float(max(attainable.low_tension.values.max(), attainable.high_tension.values.max()))
