"""Plot the stiffness, and what else a sweep has, over the least tension of the cables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import ArrayLike

from cdsm.applied import Applied
from cdsm.errors import CdsmError, InvalidInput, SingularStiffness
from cdsm.loads import LoadsLike
from cdsm.planning.saturation import Saturation, saturation
from cdsm.plots import style
from cdsm.plots.lines import name_lines
from cdsm.plots.style import Panels
from cdsm.posture import Posture
from cdsm.quantities import QUANTITIES, display_of, si_of
from cdsm.statics.buckling import critical_tension
from cdsm.status import Status
from cdsm.stiffness_matrix import stiffness
from cdsm.stiffness_matrix.prints import softer_side
from cdsm.stiffness_matrix.verdict import describe_buckling
from cdsm.support.format import one_unit, stiffness_unit
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


_LEVELS = 60  # number of lower bounds of a curve that names none
_SMALL = 2e-3  # terms below this part of the largest stiffness are left out
_CANCEL = 3.0  # terms that exceed the stiffness by this factor leave the panel


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
    room = style.AROUND * (high - low)
    panel.set_ylim(low - room * (low < 0.0), high + room)
    panel.set_xlim(x[0], x[-1] if x[-1] > x[0] else x[0] + 1.0)
    name_lines(panel, float(x[last] if len(x) > 1 else panel.get_xlim()[1]), ends)
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
    face = Rectangle((low, 0.0), end - low, 1.0, transform=place, fc=style.UNHELD, ec="none")
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
