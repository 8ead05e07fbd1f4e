"""Read pictures back: artists by their gid, and what every picture keeps to."""

import re
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text

from cdsm.plots.style import figure_of
from cdsm.support.values import Array

UNITS = r"\[.+\]|number|sample|factor|candidate|tests|measurement|reading|σ"


def panels(picture: Any) -> list[Axes]:
    """The panels of a picture, one or several."""
    return list(np.ravel(np.array(picture, dtype=object)))


def artists(ax: Axes, start: str) -> dict[str, Any]:
    """The artists of a panel whose gid begins with ``start``, by gid."""
    every = ((str(artist.get_gid()), artist) for artist in ax.get_children())
    return {gid: artist for gid, artist in every if gid.startswith(start)}


def line(ax: Axes, gid: str) -> Array:
    """The points (n, 2) of the line with this gid."""
    return np.asarray(artists(ax, gid)[gid].get_xydata(), dtype=float)


def labels(ax: Axes) -> dict[str, str]:
    """What the legend of a panel says of each artist, by gid."""
    handles, said = ax.get_legend_handles_labels()
    return {str(artist.get_gid()): label for artist, label in zip(handles, said, strict=True)}


def words(picture: Any) -> str:
    """All texts of the panels of a picture, and of its figure, a line each; − is -."""
    figure = figure_of(picture)
    inside = [text for ax in panels(picture) for text in ax.findobj(Text)]
    every = dict.fromkeys([*(text for text in figure.texts), *inside])
    heading = figure._suptitle.get_text() if figure._suptitle is not None else ""
    lines = [heading, *(text.get_text() for text in every if isinstance(text, Text))]
    return "\n".join(" ".join(line.split()) for line in lines if line.strip())


def named(ax: Axes) -> dict[str, Any]:
    """The annotations of a panel by their text."""
    return {text.get_text(): text for text in ax.texts}


def rows(ax: Axes) -> list[str]:
    """The names of the rows of a panel, as they are read: from its top to its bottom."""
    places = ax.transData.transform([(0.0, y) for y in ax.get_yticks()])[:, 1]
    names = [text.get_text() for text in ax.get_yticklabels()]
    return [names[k] for k in np.argsort(-places)]


def colors_of(ax: Axes, gid: str) -> tuple[Any, Any]:
    """The colour of the line with this gid, and of its name beside it, as they are drawn."""
    name = gid.rpartition(":")[2]
    return to_rgba(artists(ax, gid)[gid].get_color()), to_rgba(named(ax)[name].get_color())


def texts(figure: Figure) -> list[Text]:
    """The texts of a figure that are seen."""
    hidden: set[int] = set()
    for ax in figure.findobj(Axes):
        assert isinstance(ax, Axes)
        for axis, limits in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
            low, high = min(limits), max(limits)
            room = 1e-9 * (high - low)
            ticks = [*axis.get_major_ticks(), *axis.get_minor_ticks()]
            # matplotlib keeps ticks beyond the limits, and those of axes that are off
            unseen = [
                tick
                for tick in ticks
                if not (ax.axison and low - room <= tick.get_loc() <= high + room)
            ]
            hidden |= {id(text) for tick in unseen for text in (tick.label1, tick.label2)}
            if not ax.axison:
                hidden |= {id(axis.label), id(axis.get_offset_text())}
    return [
        text
        for text in figure.findobj(Text)
        if isinstance(text, Text)
        and text.get_visible()
        and text.get_text().strip()
        and id(text) not in hidden
    ]


_LOOK = ("color", "facecolor", "edgecolor", "hatch", "linestyle", "linewidth", "marker", "alpha")


def require_keys(figure: Figure) -> None:
    """Every entry of a legend has words and a look that no other entry of it has."""
    for legend in figure.findobj(Legend):
        assert isinstance(legend, Legend)
        said = [text.get_text() for text in legend.get_texts()]
        looks = [
            str([getattr(key, f"get_{name}", str)() for name in _LOOK])
            for key in legend.legend_handles
        ]
        assert len({*said}) == len(said), said
        assert len({*looks}) == len(said), dict(zip(said, looks, strict=True))


def require_ticks(figure: Figure) -> None:
    """Ticks that have numbers, those of colour bars too, stand at them."""
    for ax in figure.findobj(Axes):
        assert isinstance(ax, Axes)
        if not ax.axison or ax.name != "rectilinear":
            continue
        for axis in (ax.xaxis, ax.yaxis):
            if axis.get_offset_text().get_text():
                continue
            low, high = sorted(axis.get_view_interval())
            for tick in axis.get_major_ticks():
                at = tick.get_loc()
                for label in (tick.label1, tick.label2):
                    said = label.get_text().replace("−", "-")
                    if low <= at <= high and re.fullmatch(r"-?[\d.]+(e[-+]?\d+)?", said):
                        assert abs(float(said) - at) <= 1e-3 * max(abs(at), high - low), said


def require_look(picture: Any) -> None:
    """Units on both axes, three ticks or more, no text over another or outside the figure.

    Entries of legends are told apart, and ticks have the numbers at which they stand.
    """
    figure = figure_of(picture)
    require_keys(figure)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    require_ticks(figure)
    for ax in panels(picture):
        if not ax.axison or ax.name != "rectilinear":
            continue
        for label in (ax.get_xlabel(), ax.get_ylabel()):
            assert not label or re.search(UNITS, label), label
        for axis, limits in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
            ticks = np.asarray(axis.get_majorticklocs())
            inside = (ticks >= min(limits) - 1e-9) & (ticks <= max(limits) + 1e-9)
            whole = np.ptp(limits) < 3.5  # few candidates or readings
            assert inside.sum() >= (1 if whole else 3) or not ticks.size, ticks
    boxes = []
    for text in texts(figure):
        bounds = Text.get_window_extent(text, renderer)  # without the arrow of an annotation
        if bounds.width > 0.0:
            boxes.append((text.get_text(), bounds))
    page = figure.bbox
    for words, box in boxes:
        assert box.x0 > page.x0 - 2.0, words
        assert box.x1 < page.x1 + 2.0, words
        assert box.y0 > page.y0 - 2.0, words
        assert box.y1 < page.y1 + 2.0, words
    for (first, one), (second, other) in combinations(boxes, 2):
        wide = min(one.x1, other.x1) - max(one.x0, other.x0)
        high = min(one.y1, other.y1) - max(one.y0, other.y0)
        assert not (wide > 1.5 and high > 1.5), f"{first!r} over {second!r}"
