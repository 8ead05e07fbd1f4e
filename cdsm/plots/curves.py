"""Plot curves: stiffness over tension, weight tests and load cycles with events, buckling."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes

from cdsm.errors import InvalidInput
from cdsm.plots import style
from cdsm.plots.lines import move_apart
from cdsm.plots.style import MM, N_PER_MM
from cdsm.statics.events import first_slips
from cdsm.statics.hung_loads import total_force
from cdsm.support.format import plural, stiffness_text
from cdsm.support.values import Array

if TYPE_CHECKING:
    from cdsm.statics.buckling import CriticalLoad, CriticalTension
    from cdsm.statics.load_cycle import LoadHistory
    from cdsm.statics.weight_test import WeightTest

_MOST_EVENTS = 6  # of more events only the first have words
_CLOSED = 1e-6  # a cycle is closed if force and tip return to within this part of their ranges

_MARKS: Final = {
    "slack": ("o", style.ORANGE),
    "slip": ("s", style.PURPLE),
    "stop": ("D", style.GREEN),
    "maximum": ("^", style.BLACK),
    "law": ("v", style.SKY),
    "lift-off": ("P", style.BLUE),
    "groove": ("*", "0.3"),
    "contact": ("p", "0.6"),
    "buckling": ("X", style.VERMILLION),
}
"""Marker and colour of each kind of event."""


class _Mark(NamedTuple):
    """An event on a curve, with its words."""

    x: float
    y: float
    kind: str
    text: str


@style.styled
def plot_weight_test(test: WeightTest, ax: Axes | None = None, *, title: str | None = None) -> Axes:
    """Plot the weight [N] over the displacement of the tip along it [mm], and what happens.

    The dashed line is the tangent without the weight. With friction the curve without it is drawn
    thin. Events, such as a cable that goes slack, have marks.
    """
    panel = style.panel(ax)
    force = float(np.linalg.norm(test.force))
    u = test.force / force
    loads = np.append(0.0, test.loads)
    moved = MM * np.append(0.0, test.displacements @ u)
    start = test.unloaded.pose.tip[:3, 3]
    states = [MM * float((state.pose.tip[:3, 3] - start) @ u) for state in test.states]
    smooth = np.append(0.0, states)
    panel.axhline(0.0, color="0.3", lw=0.6)
    panel.axvline(0.0, color="0.3", lw=0.6)
    slope = N_PER_MM * test.tangent  # N/mm
    if math.isfinite(slope) and slope > 0.0:
        end = min(force / slope, float(max(abs(moved).max(), abs(smooth).max())))
        line: dict[str, Any] = {"color": "0.55", "lw": 0.9, "ls": "--"}
        panel.plot([0.0, end], [0.0, end * slope], gid="linear", **line)
        words = f"linear: {stiffness_text(test.tangent, digits=3)}"
        look: dict[str, Any] = {"fontsize": 7, "color": style.SOFT, "ha": "right", "va": "bottom"}
        look |= {"xytext": (-4, 1), "textcoords": "offset points"}
        part = 0.93
        if test.history is not None or loads[-1] > slope * moved[-1]:  # the curve is above
            part = 0.6
            look |= {"ha": "left", "va": "top", "xytext": (4, -2)}
        panel.annotate(words, (part * end, part * end * slope), **look)
    if test.history is not None:
        panel.plot(smooth, loads, color=style.SKY, lw=0.9, gid="frictionless", label="no friction")
        panel.plot([], [], color=style.BLUE, lw=1.4, label="with friction")
        panel.legend(loc="upper left")
    at_events = np.array([event.load for event in test.events])
    bends = MM * test.event_displacements @ u
    order = np.argsort(np.append(loads, at_events), kind="stable")
    curve = np.append(moved, bends)[order], np.append(loads, at_events)[order]
    panel.plot(*curve, "-", color=style.BLUE, lw=1.4, gid="curve")
    panel.plot(moved, loads, ".", color=style.BLUE, ms=3.0, gid="test")
    panel.margins(x=0.08)
    what = test.point.link if test.point else "the tip"
    along = f"displacement of {what} along {style.direction_name(u)} [mm]"
    panel.set(xlabel=along, ylabel="weight [N]")
    told = first_slips(test.events)
    events = [
        _Mark(float(displacement), event.load, event.kind, f"{event.label} {event.where}")
        for event, displacement in zip(test.events, bends, strict=True)
        if event in told
    ]
    _draw_events(panel, events)
    question = f"how far does {force:.4g} N move {test.point.link if test.point else 'its tip'}?"
    if test.left_reference:
        question += " It left its reference before the weight"
    style.set_title(panel, title, f"{test.unloaded.pose.arm.name}: {question}")
    return panel


@style.styled
def plot_load_history(
    history: LoadHistory, ax: Axes | None = None, *, title: str | None = None
) -> Axes:
    """Plot the force [N] over the displacement of the tip [mm], both along the largest force.

    If all loads act on one link, the displacement is that of its point; of loads at several places
    the force is the sum.

    The area of the last closed cycle is filled: the work lost to friction. The first hole that
    slides, and the first one after the force turned back, have marks. Without forces, the three
    displacements are drawn over the numbers of the loads.
    """
    panel = style.panel(ax)
    name = history.reference.arm.name
    holes = plural(len(history.holes), "hole")
    lost = 1e3 * float(history.dissipated.sum())
    forces = np.vstack([total_force(history.reference_applied), history.forces])
    what, displacement = history.read
    displacements = MM * np.vstack([np.zeros(3), displacement])
    size = np.linalg.norm(forces, axis=1)
    if not size.any():
        number = np.append(-1, history.load)
        for axis, color in zip("xyz", style.COLORS, strict=False):
            values = displacements[:, "xyz".index(axis)]
            panel.plot(number, values, ".-", color=color, lw=0.9, label=axis, gid=f"tip:{axis}")
        panel.set(xlabel="number of the load (−1: reference)", ylabel="displacement [mm]")
        panel.legend()
        style.set_title(panel, title, f"{name}: where does its {what} go?")
        return panel
    u = forces[size.argmax()] / size.max()
    force = forces @ u
    moved = displacements @ u
    panel.axhline(0.0, color="0.3", lw=0.6)
    panel.axvline(0.0, color="0.3", lw=0.6)
    panel.plot(moved, force, ".-", color=style.BLUE, lw=1.2, ms=2.0, gid="loop")
    words = f"{lost:.3g} mJ lost in {holes}"
    cycle = _last_cycle(force, moved)
    if cycle is not None:
        look: dict[str, Any] = {"fc": style.SKY, "alpha": 0.18, "ec": "none", "zorder": 0.6}
        panel.fill(moved[cycle:], force[cycle:], gid="lost", **look)
        words = f"{1e3 * float(history.dissipated[cycle:].sum()):.3g} mJ lost per cycle"
    panel.annotate(
        words, (0.03, 0.97), xycoords="axes fraction", va="top", fontsize=7, color=style.BLUE
    )
    panel.margins(0.08)
    of = "" if what == "tip" else f" of {what}"
    along = f"displacement{of} along {style.direction_name(u)} [mm]"
    panel.set(xlabel=along, ylabel="force [N]")
    _draw_events(panel, list(_cycle_events(history, force, u)), lowest=True)
    style.set_title(panel, title, f"{name}: what does friction take?")
    return panel


def _last_cycle(force: Array, moved: Array) -> int | None:
    """Return the row where the last closed cycle begins, which ends at the last row, or None."""
    turns = np.sign(np.diff(force))
    near = _CLOSED * np.ptp(force)
    for k in range(len(force) - 3, 0, -1):
        same = abs(force[k] - force[-1]) <= near and turns[k - 1] == turns[-1]
        if same and abs(moved[k] - moved[-1]) <= 0.02 * np.ptp(moved):
            return k
    return None


def _cycle_events(history: LoadHistory, force: Array, u: Array) -> Iterable[_Mark]:
    """Yield the events; of slips the first one, and the first one after the force turned back."""
    begins = {1.0: "holes slide", -1.0: "slide back"}
    growing = np.sign(force[abs(force).argmax()])
    moves = MM * history.event_displacements @ u
    for event, moved in zip(history.events, moves.tolist(), strict=True):
        assert event.step is not None
        before, after = force[event.step : event.step + 2]
        words = event.label
        if event.kind == "slip":
            words = begins.pop(float(growing * np.sign(after - before)), "")
        there = float(before + event.share * (after - before))
        if words:
            yield _Mark(moved, there, event.kind, f"{words} at {there:.3g} N")


def _draw_events(panel: Axes, events: Sequence[_Mark], lowest: bool = False) -> None:
    """Mark events on a curve, and write their words in a column at the right, or lowest there."""
    for event in events:
        marker, color = _MARKS[event.kind]
        look: dict[str, Any] = {"color": color, "mfc": "white", "mew": 1.1, "ms": 5, "zorder": 7}
        panel.plot(event.x, event.y, marker, ls="", gid=f"event:{event.text}", **look)
    named = sorted(events[:_MOST_EVENTS], key=lambda event: event.y)
    if not named:
        return
    low, high = panel.get_ylim()
    if lowest:  # the corner of a loop has room for two
        low -= 0.09 * max(len(named) - 2, 0) * (high - low)
    panel.set_ylim(low, high)
    panel.set_xlim(panel.get_xlim())
    least = 0.08 * (high - low)
    wanted = np.array([event.y for event in named]) - 0.1 * (high - low)
    wanted = np.full(len(named), low) if lowest else wanted
    ends = low + 0.1 * (high - low), high - 0.1 * (high - low)
    places = move_apart(np.clip(wanted, *ends), least, *ends)
    rest = len(events) - len(named)
    for event, place in zip(named, places, strict=True):
        text = event.text + (f" (and {rest} more)" if rest and event is named[-1] else "")
        arrow = {"arrowstyle": "-", "lw": 0.5, "color": "0.6", "shrinkB": 3, "shrinkA": 1}
        arrow["relpos"] = (0.0, 0.5)
        panel.annotate(
            text, (event.x, event.y), xytext=(0.98, place), textcoords=("axes fraction", "data"),
            fontsize=7, color=style.INK, ha="right", va="center", arrowprops=arrow, zorder=6,
            parse_math=False, bbox={"fc": "white", "ec": "none", "pad": 0.5, "alpha": 0.85},
        )  # fmt: skip


@style.styled
def plot_critical_tension(
    critical: CriticalTension, ax: Axes | None = None, *, title: str | None = None
) -> Axes:
    """Plot the smallest eigenvalue of `K_θ` [N m/rad] over the lower bound of all tensions [N].

    Unstable ranges are shaded.
    """
    low, high = critical.examined
    shown = high if math.isinf(critical.minimum) or not critical.stable else 2.0 * critical.minimum
    inside = critical.bounds <= shown
    panel = _margins(critical, critical.bounds, critical.margins, ax, inside)
    # if no tension can be raised by itself, only one bound is examined: a point
    panel.set_xlim(low, min(shown, high) if high > low else low + 1.0)
    edges = [low, *np.ravel(critical.stable), high]
    spans = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b > a]
    for k, span in enumerate(spans):
        label = "unstable" if k == 0 else None
        panel.axvspan(*span, label=label, gid="unstable", **style.HATCHED)
    question = "does more tension make it buckle?"
    if math.isfinite(critical.minimum) and critical.stable:
        panel.plot(critical.minimum, 0.0, "o", color=style.VERMILLION, gid="event:buckling")
        question = f"it buckles from {critical.minimum:.4g} N"
    panel.set_xlabel("least tension of all cables [N]")
    if spans:
        panel.legend()
    style.set_title(panel, title, f"{critical.posture.arm.name}: {question}")
    return panel


@style.styled
def plot_critical_load(
    critical: CriticalLoad, ax: Axes | None = None, *, title: str | None = None
) -> Axes:
    """Plot the smallest eigenvalue of `K_θ` [N m/rad] over the factor of the load."""
    panel = _margins(critical, critical.factors, critical.margins, ax)
    question = "how much of the load does it hold? All"
    if math.isfinite(critical.factor):
        words = {"buckling": "buckles", "infeasible": "no balance", "elasticity": "end of a law"}
        panel.plot(
            critical.factor, critical.margins[-1], "o", color=style.VERMILLION, gid="event:end"
        )
        question = f"{words[critical.limit]} at {critical.factor:.4g} times the load"
    load = style.direction_name(critical.load[:3] / (np.linalg.norm(critical.load[:3]) or 1.0))
    size = float(np.linalg.norm(critical.load[:3]))
    panel.set_xlabel(f"factor of the load, {size:.4g} N along {load}")
    style.set_title(panel, title, f"{critical.posture.arm.name}: {question}")
    return panel


def _margins(
    critical: CriticalLoad | CriticalTension,
    x: Array,
    margins: Array,
    ax: Axes | None,
    seen: Any = slice(None),
) -> Axes:
    """Plot stability margins, with room around zero and the ``seen`` ones."""
    panel = style.panel(ax)
    panel.plot(x, margins, "o-" if x.size == 1 else "-", color=style.INK, gid="margin")
    panel.axhline(0.0, color="0.3", lw=0.6)
    low = min(0.0, *margins[seen])
    high = max(0.0, *margins[seen])
    if high <= low:
        raise InvalidInput("critical", "has no margin to draw.")
    panel.set_ylim(low - 2.0 * style.AROUND * (high - low), high + style.AROUND * (high - low))
    panel.set_ylabel(f"smallest joint stiffness [{critical.posture.arm.stiffness_unit()}]")
    return panel
