"""Give all pictures one style: sizes, colours, units and titles that the plots share.

The palette of Okabe and Ito (2008) is distinct to all kinds of colour vision. Colours never stand
alone: lines are named, slack cables are dashed, cells without a value are hatched.
"""

from __future__ import annotations

import functools
import os
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Final, ParamSpec, TypeVar

import numpy as np
from matplotlib import colormaps, rc_context, rcParams
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import AutoLocator, MaxNLocator
from numpy.typing import NDArray

from cdsm.errors import InvalidInput
from cdsm.support.files import as_path, write_file
from cdsm.support.format import coordinates
from cdsm.support.values import Array

P = ParamSpec("P")
Picture = TypeVar("Picture")

Panels = NDArray[Any]
"""Array of axes: those of a picture of several panels."""

ONE_COLUMN: Final = 88 / 25.4
TWO_COLUMNS: Final = 181 / 25.4
"""Widths [inch] of figures as wide as one and two columns of a journal."""

BLUE: Final = "#0072b2"
VERMILLION: Final = "#d55e00"
GREEN: Final = "#009e73"
ORANGE: Final = "#e69f00"
SKY: Final = "#56b4e9"
PURPLE: Final = "#cc79a7"
BLACK: Final = "#000000"
COLORS: Final = (BLUE, VERMILLION, GREEN, ORANGE, SKY, PURPLE, BLACK)
"""Colours of Okabe and Ito, "Color universal design", 2008; the first three are x, y and z."""

TERM_COLORS: Final = {
    "passive": BLUE,
    "active": ORANGE,
    "gravity": GREEN,
    "load": PURPLE,
    "springs": SKY,
}
"""Colours of the terms of K_θ; terms with other names are grey."""

INK: Final = "0.15"
SOFT: Final = "0.42"
DARK: Final = {
    ORANGE: "#8a610a",
    PURPLE: "#9c4a79",
    SKY: "#24749e",
    GREEN: "#00734f",
    VERMILLION: "#b34700",
}
"""Darker twins of pale colours, for text on white."""

STYLES: Final = ("-", "--", "-.", ":")
COLOR_MAP: Final = "viridis"
TENSION_COLORS: Final = ListedColormap(colormaps[COLOR_MAP](np.linspace(0.0, 0.9, 256)), "tensions")
"""Colours of tensions: without the yellow end, which is not seen in a thin line on white."""

MM: Final = 1e3
KN: Final = 1e-3
N_PER_MM: Final = 1e-3

STYLE: Final = Path(__file__).with_name("cdsm.mplstyle")
"""Style sheet of all pictures; ``plt.style.use(cdsm.plots.STYLE)`` takes it for pictures of one's
own."""

UNHELD: Final = "#fbe3d6"
"""Colour of what an arm does not hold, below the hatch."""

HATCHED: Final[dict[str, Any]] = {
    "fc": UNHELD,
    "ec": VERMILLION,
    "hatch": "////",
    "lw": 0.0,
    "zorder": 0.4,
}
"""Look of a range in which the arm does not hold."""

AROUND: Final = 0.08
"""Room above and below the values of a curve, over their range."""

NOTE_SIZE: Final = 6.5
"""Size of small text [points]."""

_CHARACTERS = 16.0  # of a title in an inch
_DATELESS: Final = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}, ".png": None}
_ROOM = 1.15  # upper limit of an axis that begins at zero, over the largest value drawn
_STEPS: Final = (1, 2, 2.5, 5, 10)


def styled(draw: Callable[P, Picture]) -> Callable[P, Picture]:
    """Let ``draw`` draw in the style of this library, and leave the caller's settings as is."""

    @functools.wraps(draw)
    def drawn(*args: P.args, **options: P.kwargs) -> Picture:
        with rc_context(fname=STYLE):
            picture = draw(*args, **options)
            for ax in np.ravel(np.array(picture, dtype=object)):
                keep_ticks(ax)
            return picture

    return drawn


def keep_ticks(ax: Any) -> None:
    """Make the first ticks of ``ax`` now; matplotlib would make them later, in another style."""
    for axis in (ax.xaxis, ax.yaxis):
        _ = axis.get_major_ticks(1), axis.get_minor_ticks(1)


def save_figure(figure: Figure | Axes | Panels, path: str | os.PathLike[str]) -> Path:
    """Write a figure: vectors (``.pdf``, ``.svg``) or pixels (``.png``, 300 dpi); return its path.

    Equal figures give equal bytes: no date is written, and names in an SVG are not random.

    Args:
        figure: What a function of :mod:`cdsm.plots` returns, or any other figure of matplotlib.
        path: The file. It is written completely or not at all.

    Raises:
        InvalidInput: The path ends neither in ``.pdf``, ``.svg`` nor ``.png``.
        FileError: The file cannot be written.

    Example:
        >>> from tempfile import TemporaryDirectory
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> with TemporaryDirectory() as folder:
        ...     cdsm.plots.save_figure(pose.plot(), f"{folder}/arm.svg").name
        'arm.svg'
    """
    suffix = as_path(path).suffix.lower()
    if suffix not in _DATELESS:
        raise InvalidInput("path", f"{str(path)!r} given; it must end in {', '.join(_DATELESS)}.")
    sheet = figure if isinstance(figure, Figure) else figure_of(figure)
    with rc_context(fname=STYLE):
        return write_file(path, lambda aside: sheet.savefig(aside, metadata=_DATELESS[suffix]))


def figure_of(panels: Axes | Panels) -> Figure:
    """Return the figure of axes, or of an array of axes."""
    first: Axes = np.ravel(np.array(panels, dtype=object))[0]
    figure = first.get_figure(root=True)
    if figure is None:
        raise InvalidInput("figure", "has axes that belong to no figure.")
    return figure


def height_of(ax: Axes) -> float:
    """Return about how high axes are [inch]."""
    return figure_of(ax).get_figheight() * ax.get_position().height


def panel(ax: Axes | None, height: float = 2.4, width: float = ONE_COLUMN) -> Axes:
    """Return ``ax`` in this style, or else the only axes of a new figure [inch].

    Raises InvalidInput if ``ax`` has a projection of its own, or is no axes.
    """
    return panels(None if ax is None else [ax], 1, height=height, width=width, name="ax")[0]  # type: ignore[no-any-return]


def panels(
    axs: Panels | Sequence[Axes] | Axes | None,
    columns: int,
    rows: int = 1,
    *,
    height: float,
    width: float = TWO_COLUMNS,
    name: str = "axs",
    **options: Any,
) -> Panels:
    """Return ``rows`` times ``columns`` panels in this style: the first ``axs``, or new ones.

    Raises InvalidInput if these are too few, or one of them is no ordinary axes.
    """
    if axs is None:
        figure = Figure(figsize=(width, height))
        chosen = np.ravel(figure.subplots(rows, columns, squeeze=False, **options))
    else:
        chosen = np.ravel(np.array(axs, dtype=object))[: rows * columns]
        if len(chosen) < rows * columns:
            problem = f"has {len(chosen)} of the {rows * columns} axes that this picture needs"
            remedy = f"give those of plt.subplots({rows}, {columns})."
            raise InvalidInput(name, f"{problem}; {remedy}")
        for ax in chosen:
            if not isinstance(ax, Axes) or ax.name != "rectilinear":
                kind = f"axes of the kind {ax.name!r}" if isinstance(ax, Axes) else repr(ax)
                raise InvalidInput(name, f"{kind} given; give ordinary axes of plt.subplots().")
    for ax in chosen:
        _dress(ax)
    return chosen


def _dress(ax: Axes) -> None:
    """Give axes that exist already the look that rcParams would give to new ones."""
    ax.spines[["top", "right"]].set_visible(False)
    for side in ("left", "bottom"):
        ax.spines[side].set(linewidth=rcParams["axes.linewidth"], edgecolor="0.3")
    ax.set_axisbelow(True)
    ax.grid(visible=True, alpha=rcParams["grid.alpha"], linewidth=rcParams["grid.linewidth"])
    ax.tick_params(labelsize=7, width=0.6, length=2.5, color="0.3", labelcolor=INK)
    for axis in (ax.xaxis, ax.yaxis):
        axis.label.set(size=8, color=INK)
        if isinstance(axis.get_major_locator(), AutoLocator):
            axis.set_major_locator(MaxNLocator("auto", steps=_STEPS, min_n_ticks=3))


def set_title(ax: Axes, title: str | None, question: str, stable: bool = True) -> None:
    """Write ``title`` over ``ax``, or the ``question`` if it is None; ``""`` writes nothing.

    The question about an arm that is not ``stable`` says so first.
    """
    text = f"{'' if stable else 'UNSTABLE: '}{question}" if title is None else title
    width = figure_of(ax).get_figwidth() * min(1.15 * ax.get_position().width, 1.0)
    ax.set_title(textwrap.fill(text, max(round(_CHARACTERS * width), 20)), parse_math=False)


def set_heading(axs: Panels, axs_of_caller: object, title: str | None, question: str) -> None:
    """Write a title over all panels of a figure of this library, or over the first of ``axs``.

    Over panels of the caller only a ``title`` of the caller is written.
    """
    if axs_of_caller is None:
        text = question if title is None else title
        figure = figure_of(axs)
        wrapped = textwrap.fill(text, round(_CHARACTERS * figure.get_figwidth()))
        if text:
            figure.suptitle(wrapped, x=0.01, ha="left", parse_math=False)
    elif title:
        set_title(axs[0], title, "")


def write_note(ax: Axes, text: str, line: int = 0, color: str = INK, below: float = 3.0) -> None:
    """Write a line of small text below axes that have no ticks."""
    place = (0.0, -below - 9.5 * line)
    options: dict[str, Any] = {"xycoords": "axes fraction", "textcoords": "offset points"}
    look: dict[str, Any] = {
        "fontsize": 7,
        "va": "top",
        "color": DARK.get(color, color),
        "parse_math": False,
    }
    ax.annotate(text, (0.0, 0.0), xytext=place, **options, **look)


def direction_name(u: Array) -> str:
    """Return ``x`` for (1, 0, 0) and ``−x`` for (−1, 0, 0), else a direction (3,) in numbers."""
    rounded = np.round(u, 9) + 0.0
    for name, axis in zip("xyz", np.eye(3), strict=True):
        for sign, side in (("", axis), ("−", -axis)):
            if np.array_equal(rounded, side):
                return f"{sign}{name}"
    return coordinates(rounded, "z.3g")


def tension_colors(tensions: Array, limits: tuple[float, float] | None = None) -> ScalarMappable:
    """Build the colour scale of tensions [N], from the smallest that pulls to the largest."""
    pulled = tensions[tensions > slack_below(tensions)]
    low, high = limits or ((pulled.min(), pulled.max()) if pulled.size else (0.0, 1.0))
    if high - low <= 1e-9 * abs(high):
        low = 0.95 * low - 1e-9
        high = 1.05 * high + 1e-9
    return ScalarMappable(Normalize(float(low), float(high)), TENSION_COLORS)


def slack_below(tensions: Array) -> float:
    """Return the tension [N] below which a cable counts as slack: 1e-9 of the largest."""
    return 1e-9 * float(np.max(tensions, initial=0.0))


def color_bar_beside(ax: Axes, colors: ScalarMappable, unit: str) -> None:
    """Draw a slim colour bar at the right of ``ax``, with its unit on top."""
    inset = ax.inset_axes((1.03, 0.12, 0.022, 0.76))
    bar = figure_of(ax).colorbar(colors, cax=inset)
    bar.outline.set_linewidth(0.4)
    bar.ax.tick_params(length=2, width=0.5, labelsize=7)
    bar.set_ticks(round_numbers(*colors.get_clim()))
    inset.set_title(unit, fontsize=7, loc="left", pad=3)
    keep_ticks(bar.ax)


def round_number(x: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is not above x > 0."""
    power = 10.0 ** np.floor(np.log10(x))
    return float(max(k for k in (1, 2, 5) if k * power <= x * (1.0 + 1e-9)) * power)


def round_numbers(low: float | None, high: float | None) -> list[float]:
    """Return three or more round numbers from ``low`` to ``high``."""
    if low is None or high is None:
        return []
    step = round_number((high - low) / 3.0)
    first = np.ceil(low / step - 1e-9) * step
    numbers: list[float] = np.round(np.arange(first, high + 1e-9 * step, step), 12).tolist()
    return numbers


def from_zero(ax: Axes, *values: Array) -> None:
    """Set the range of the y-axis of a panel: from zero to above the largest of all values."""
    highest = max((float(np.nanmax(array, initial=0.0)) for array in values), default=0.0)
    ax.set_ylim(0.0, _ROOM * highest or 1.0)


def whole_numbers(axis: Any) -> None:
    """Put the ticks of an axis at whole numbers."""
    axis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))


def legend_below(axs: Any, columns: int, axs_of_caller: object, **options: Any) -> None:
    """Draw one legend below all panels of a figure of this library, or within the last of ``axs``.

    A label that several panels have appears once.
    """
    entries: dict[str, Any] = {}
    flat = np.ravel(np.array(axs, dtype=object))
    for ax in flat:
        entries |= dict(zip(*ax.get_legend_handles_labels()[::-1], strict=True))
    if not entries:
        return
    if axs_of_caller is None:
        options |= {"loc": "outside lower center", "ncols": columns}
        figure_of(flat[0]).legend(list(entries.values()), list(entries), **options)
    else:
        flat[-1].legend(list(entries.values()), list(entries), loc="best")
