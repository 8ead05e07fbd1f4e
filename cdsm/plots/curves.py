"""Plot curves: stiffness over tension, weight tests and load cycles with events, buckling."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import ArrayLike

from cdsm.applied import Applied
from cdsm.errors import CdsmError, InvalidInput, SingularStiffness
from cdsm.loads import LoadsLike
from cdsm.planning.sensitivity import Saturation, saturation
from cdsm.plots import style
from cdsm.plots.style import MM, N_PER_MM, Panels
from cdsm.posture import Posture
from cdsm.quantities import QUANTITIES, display_of, si_of
from cdsm.statics.buckling import critical_tension
from cdsm.statics.events import first_slips
from cdsm.statics.hung_loads import total_force
from cdsm.status import Status
from cdsm.stiffness_matrix import stiffness
from cdsm.stiffness_matrix.prints import softer_side
from cdsm.stiffness_matrix.verdict import describe_buckling
from cdsm.support.format import one_unit, plural, stiffness_text, stiffness_unit
from cdsm.support.status import check_sweep
from cdsm.support.validation import (
    NO_WRENCH,
    Direction,
    instance,
    number_array,
    one_of,
    unit_direction,
)
from cdsm.support.values import Array
from cdsm.tension import distribute_tension

if TYPE_CHECKING:
    import xarray

    from cdsm.statics.buckling import CriticalLoad, CriticalTension
    from cdsm.statics.load_cycle import LoadHistory
    from cdsm.statics.weight_test import WeightTest

_LEVELS = 60  # number of lower bounds of a curve that names none
_SMALL = 2e-3  # terms below this part of the largest stiffness are left out
_CANCEL = 3.0  # terms that exceed the stiffness by this factor leave the panel
_ROOM = 0.08  # margin above and below all values, as a fraction of their range
_MOST_EVENTS = 6  # of more events only the first have words
_CLOSED = 1e-6  # a cycle is closed if force and tip return to within this part of their ranges
_UNSTABLE: Final = "#fbe3d6"

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
def plot_stiffness_over_tension(
    pose: Posture | Saturation,
    levels: ArrayLike | None = None,
    direction: Direction = "z",
    ax: Axes | None = None,
    *,
    terms: bool = True,
    title: str | None = None,
) -> Axes:
    """Plot the stiffness along a direction over the lower bound of all tensions [N].

    It is in N/mm, of soft arms in N/m.

    The terms of `K_θ`, such as the elasticity of the cables and their tension, are drawn too; they
    add up to the stiffness. A range in which the arm is unstable is hatched. Marks tell from where
    on more tension adds little.

    Args:
        pose: The posture; or a saturation, which brings levels, direction, upper bound and loads.
        levels: Lower bounds of the tensions (n,) [N]. Where the arm asks for more, the tension that
            held is drawn. None: 60 levels up to where the curve of :func:`~cdsm.saturation` ends.
        direction: An axis such as ``"z"``, or (3,) in base axes, any length.
        ax: Ordinary axes to draw on; None: a new figure of one column.
        terms: Whether to draw the terms.
        title: Title; None: the arm's name and the question.

    Raises:
        InvalidInput: An argument is invalid.
        InfeasibleTension: No tensions balance the arm at any of the levels.
        SingularStiffness: The arm is unstable at all of them, or its tip cannot move along u.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> ax = cdsm.plots.plot_stiffness_over_tension(pose, [5.0, 50.0, 100.0, 200.0], "z")
        >>> ax.get_xlabel(), ax.get_ylabel()
        ('least tension of all cables [N]', 'stiffness along z [N/mm]')
    """
    wrench: Applied = np.asarray(NO_WRENCH, dtype=float)
    maximum: Array = np.array(math.inf)
    saturated = None
    if isinstance(pose, Saturation):
        saturated = pose
        u = saturated.direction
        wrench = saturated.tension.applied
        maximum = saturated.tension.maximum
        pose = saturated.posture
    else:
        instance("pose", pose, Posture)
        u = unit_direction("direction", direction)
    if saturated is None and levels is None:
        saturated = saturation(pose, u)
    if levels is None:
        assert saturated is not None
        curve = saturated.minimum
        first = distribute_tension(pose, curve[0], maximum, wrench)
        least = float(first.minimum_held.min())
        levels = np.geomspace(max(least, curve[0], 1e-9 * curve[-1]), curve[-1], _LEVELS)
    bounds = np.sort(np.atleast_1d(number_array("levels", levels)))
    x, along, parts = _over_tension(pose, bounds[bounds <= maximum.min()], u, wrench, maximum)
    unit, size = stiffness_unit(along)
    along = along / size
    parts = {term: values / size for term, values in parts.items()}
    panel = style.panel(ax)
    panel.axhline(0.0, color="0.3", lw=0.6)
    name = style.direction_name(u)
    ends = []
    most = float(np.nanmax(along))
    last = np.flatnonzero(np.isfinite(along))[-1]
    shown = [along]
    for term, values in parts.items():
        if terms and np.nanmax(abs(values)) > _SMALL * most:
            color = style.TERM_COLORS.get(term, "0.5")
            panel.plot(x, values, color=color, lw=0.9, gid=f"term:{term}")
            ends.append((float(values[last]), term, color))
            shown.append(values)
    panel.plot(x, along, color=style.INK, lw=1.6, gid="along", marker="o" if len(x) < 2 else None)
    ends.append((float(along[last]), "all" if ends else "", style.INK))
    low = min(0.0, *(float(np.nanmin(values)) for values in shown))
    high = max(float(np.nanmax(values)) for values in shown)
    if high > _CANCEL * most:  # terms that cancel each other leave the panel: their sum counts
        low = max(low, -1.2 * most)
        high = 2.2 * most
    room = _ROOM * (high - low)
    panel.set_ylim(low - room * (low < 0.0), high + room)
    panel.set_xlim(x[0], x[-1] if x[-1] > x[0] else x[0] + 1.0)
    style.name_lines(panel, float(x[last] if len(x) > 1 else panel.get_xlim()[1]), ends)
    panel.set(xlabel="least tension of all cables [N]", ylabel=f"stiffness along {name} [{unit}]")
    if np.isnan(along[last + 1 :]).any():
        bounded = bool(np.isfinite(maximum).any())
        buckles = math.inf if bounded else critical_tension(pose, wrench).minimum
        ends_here = _shade_unstable(panel, float(x[last]), buckles)
        question = f"does more tension make it stiffer? It {ends_here}"
    else:
        question = "does more tension make it stiffer?"
    if saturated is not None:
        _mark_saturation(panel, saturated)
    style.set_title(panel, title, f"{pose.arm.name}: {question}")
    return panel


class TensionLevel(NamedTuple):
    """Stiffness under the least tensions with a lower bound."""

    held: float  # the lower bound that held [N]
    along: float  # K.along(u) [N/m]; NaN if the arm is not stable
    terms: Mapping[str, float]  # of it [N/m]
    problem: CdsmError | None = None  # why there is none
    status: Status = Status.OK  # of it


def at_level(
    pose: Posture,
    bound: float,
    u: Array,
    wrench: LoadsLike = NO_WRENCH,
    maximum: ArrayLike = math.inf,
    *,
    softer: bool = False,
) -> TensionLevel:
    """Compute the stiffness along u (3,) under the least tensions with a lower bound [N].

    ``softer`` takes the softer side of u and −u. Raises CdsmError if an argument is at fault.
    """
    held = bound
    try:
        F = distribute_tension(pose, bound, maximum, wrench)
        held = float(F.minimum_held.min())
        K = stiffness(pose, F)
        if softer and K.slack:
            u = softer_side(K.along, u)
        along = K.along(u)  # raises what is wrong
        if not K.is_stable:
            problem = SingularStiffness(describe_buckling(K), K.critical_direction)
            return TensionLevel(held, math.nan, {}, problem, Status.UNSTABLE)
        shares = K.shares(u)
    except CdsmError as error:
        if error.status.is_fault:
            raise
        return TensionLevel(held, math.nan, {}, error, error.status)
    terms = {"passive": shares.passive.sum(), "active": shares.active.sum(), **shares.others}
    return TensionLevel(held, along, terms)


def _over_tension(
    pose: Posture, bounds: Array, u: Array, wrench: Applied, maximum: Array
) -> tuple[Array, Array, dict[str, Array]]:
    """Return tensions that held [N], stiffness and its terms [N/m]; NaN where it is unstable."""
    levels: list[TensionLevel] = []
    error: CdsmError | None = None
    for bound in bounds.tolist():
        level = at_level(pose, bound, u, wrench, maximum)
        error = level.problem or error
        if not levels or level.held > levels[-1].held:
            levels.append(level)
    along = np.array([level.along for level in levels])
    if not np.isfinite(along).any():
        assert error is not None
        raise error
    names = dict.fromkeys(name for level in levels for name in level.terms)
    terms = {
        name: np.array([level.terms.get(name, math.nan) for level in levels]) for name in names
    }
    return np.array([level.held for level in levels]), along, terms


def _shade_unstable(panel: Axes, stable: float, buckles: float) -> str:
    """Hatch where the arm does not hold, above the last stable bound; return words for it.

    ``buckles`` is the bound at which it buckles, inf if that is not known.
    """
    end = float(panel.get_xlim()[1])
    words = f"holds up to {stable:.3g} N"
    low = stable
    if stable <= buckles <= end:
        low = buckles
        words = f"buckles from {low:.3g} N"
    place = panel.get_xaxis_transform()
    face = Rectangle((low, 0.0), end - low, 1.0, transform=place, fc=_UNSTABLE, ec="none")
    face.set(zorder=0.4, gid="unstable")
    panel.add_patch(face)
    look: dict[str, Any] = {"fc": "none", "ec": style.VERMILLION, "lw": 0, "hatch": "////"}
    hatched = Rectangle((low, 0.0), end - low, 1.0, transform=place, alpha=0.5, zorder=0.5, **look)
    panel.add_patch(hatched)
    look = {"rotation": 90, "ha": "center", "va": "center", "fontsize": 7}
    look |= {"color": style.DARK[style.VERMILLION], "transform": place}
    box = {"fc": "white", "ec": "none", "pad": 1.0}
    panel.text((low + end) / 2.0, 0.5, words, bbox=box, **look)
    return words


def _mark_saturation(panel: Axes, saturated: Saturation) -> None:
    """Mark from where on more tension adds little, and from where on it softens."""
    low, high = panel.get_xlim()
    x = saturated.bound
    if low < x < high:
        percent = f"{100.0 * saturated.fraction:.3g} % of the most\nfrom {x:.3g} N"
        panel.axvline(x, color=style.SOFT, lw=0.8, ls=(0, (4, 2)), zorder=1.5, gid="saturation")
        look: dict[str, Any] = {"fontsize": style.NOTE_SIZE, "color": style.SOFT, "va": "center"}
        right = x < (low + high) / 2.0
        look |= {"xytext": (4 if right else -4, 0), "textcoords": "offset points"}
        place = panel.get_xaxis_transform()
        side = "left" if right else "right"
        panel.annotate(percent, (x, 0.42), xycoords=place, ha=side, linespacing=1.1, **look)


@style.styled
def plot_tension_curve(
    dataset: xarray.Dataset,
    quantity: str = "along",
    axs: Panels | Sequence[Axes] | None = None,
    *,
    title: str | None = None,
) -> Panels:
    """Plot a quantity of a sweep at one posture over the least tension that held.

    Each direction has a panel with a scale of its own.

    Args:
        dataset: Result of :func:`~cdsm.sweep` of one posture with several ``minimum``.
        quantity: A quantity with one number, or one for each direction; by default the stiffness
            ``along``. Gaps are where it does not exist; the text of the sweep says why.
        axs: Ordinary axes, one or more for each direction; None: a new figure.
        title: Title; None: the arm's name and the question.

    Raises:
        InvalidInput: ``dataset`` is no sweep, or has several postures, wrenches or only one
            minimum. It has no such quantity, or that has more numbers.

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.virtual_prototype()
        >>> levels = [5.0, 20.0, 80.0]
        >>> data = cdsm.sweep(arm, [[0.1] * 10], minimum=levels, progress=False)
        >>> cdsm.plots.plot_tension_curve(data).size
        3
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
    values = rows.values.reshape(len(held), -1)[order] / size
    names = dataset["direction"].values.tolist() if rows.ndim == 2 else [""]
    words = QUANTITIES[quantity].words.removesuffix(" along a direction")
    width = style.ONE_COLUMN if len(names) == 1 else style.TWO_COLUMNS
    panels = style.panels(axs, len(names), height=2.4, width=width)
    for k, (ax, name, column) in enumerate(zip(panels, names, values.T, strict=True)):
        color = style.COLORS[k % 7] if name else style.BLUE
        ax.plot(held[order], column, ".-", color=color, gid=f"curve:{name or quantity}")
        style.from_zero(ax, column)
        label = f"{words} along {name}" if name else words
        ax.set(xlabel="least tension of all cables [N]")
        ax.set_ylabel(f"{label} [{one_unit(unit)}]" if unit.strip("1") else label)
    arm = str(dataset.attrs["title"]).rpartition(" of ")[2]
    style.set_heading(panels, axs, title, f"{arm}: does more tension make it stiffer?")
    return panels


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
    places = style.move_apart(np.clip(wanted, *ends), least, *ends)
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
        look: dict[str, Any] = {"fc": _UNSTABLE, "ec": style.VERMILLION, "hatch": "////"}
        panel.axvspan(*span, lw=0.0, zorder=0.4, label=label, gid="unstable", **look)
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
    panel.set_ylim(low - 2.0 * _ROOM * (high - low), high + _ROOM * (high - low))
    panel.set_ylabel(f"smallest joint stiffness [{critical.posture.arm.stiffness_unit()}]")
    return panel
