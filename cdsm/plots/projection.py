"""Draw in three dimensions on ordinary axes, by an orthographic projection.

All artists have mm (or N) of the picture plane as data. So any axes of ``plt.subplots`` will do,
the scale is equal in both directions, and every point can be read back.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from cdsm.plots import style
from cdsm.plots.style import MM
from cdsm.support.validation import vector
from cdsm.support.values import Array

VIEW: Final = (22.0, -62.0)
"""Elevation and azimuth [deg] from which pictures look at an arm if nobody says otherwise."""

_MARGIN = 0.04  # around what is drawn, over its largest extent
_TRIAD = 0.14  # length of the drawn base axes, over the size of what is drawn
_LAYERS = 3.0  # zorder of what is halfway between front and back
_DEPTHS = 20.0  # depth that is one zorder, over the size of what is drawn
_TOWARDS_EYE = 0.1  # an axis shorter than this part of its length looks like a point
_PARTS: Final = np.linspace(0.0, 1.0, 12)[1:-1]  # of a line, whose points the base axes avoid
_LOWEST, _HIGHEST = 1.2, 3.6  # of a figure of one column [inch]


def projection(elevation: float, azimuth: float) -> Array:
    """Return the directions right, up and towards the eye (3, 3), a row each, of a view [deg]."""
    e, a = np.deg2rad([elevation, azimuth])
    right = [-np.sin(a), np.cos(a), 0.0]
    up = [-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)]
    eye = [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]
    return np.array([right, up, eye])


class Drawing:
    """A picture of something in three dimensions on one panel, and how far it reaches.

    Args:
        ax: The panel.
        view: Elevation and azimuth of the eye [deg].
        size: Size of what is drawn, such as the length of an arm [m].
        unit: Number of data units of the panel in one unit of the points: 1000 for mm.
    """

    def __init__(self, ax: Axes, view: object, size: float, unit: float = MM) -> None:
        elevation, azimuth = vector("view", view, 2, "elevation and azimuth of the eye [deg]")  # type: ignore[arg-type]
        self.ax = ax
        self.rows = projection(float(elevation), float(azimuth))
        self.size = unit * size
        self.unit = unit
        self._low = np.full(2, np.inf)
        self._high = np.full(2, -np.inf)
        self._points: list[Array] = []

    def flat(self, points: Array) -> Array:
        """Return the points (…, 2) of the panel where points (…, 3) [m] are drawn; include them."""
        flat = self.unit * (points @ self.rows[:2].T)
        self.include(flat)
        return flat

    def include(self, flat: Array) -> None:
        """Let the picture reach points (…, 2) of the panel, and the lines from each to the next."""
        points = flat.reshape(-1, 2)
        between = points[:-1, None] + _PARTS[:, None] * np.diff(points, axis=0)[:, None]
        self._points += [points, between.reshape(-1, 2)]

    def layer(self, points: Array) -> float:
        """Return the zorder of points (…, 3) [m]: higher in front of others."""
        return _LAYERS + float(np.mean(self.unit * (points @ self.rows[2]))) / (_DEPTHS * self.size)

    def finish(self, unit_name: str = "mm", *, triad: bool = True, fit: bool = False) -> None:
        """Frame what is drawn with an equal scale, with the base axes in an empty corner.

        Args:
            unit_name: Unit of the panel.
            triad: Whether to draw the base axes.
            fit: Make the figure as high as the picture needs.
        """
        every = np.vstack(self._points)
        if triad:
            every = np.vstack([every, _draw_triad(self.ax, self.rows, every, self.size, unit_name)])
        low = every.min(axis=0)
        high = every.max(axis=0)
        margin = _MARGIN * float(max(high - low))
        self.ax.set(xlim=(low[0] - margin, high[0] + margin), aspect="equal")
        self.ax.set(ylim=(low[1] - margin, high[1] + margin))
        self.ax.set_axis_off()
        if fit:
            width, height = high - low + 2.0 * margin
            figure = style.figure_of(self.ax)
            room = 0.86 * figure.get_figwidth()  # beside the colour bar
            figure.set_figheight(float(np.clip(room * height / width + 0.5, _LOWEST, _HIGHEST)))


def _draw_triad(ax: Axes, rows: Array, every: Array, size: float, unit_name: str) -> Array:
    """Draw base axes of a round length to scale in the emptiest corner; return their extent."""
    length = style.round_number(_TRIAD * size)
    tips = length * rows[:2]  # (2, 3): columns are x, y and z
    low = np.minimum(tips.min(axis=1), 0.0) - 0.45 * length
    high = np.maximum(tips.max(axis=1), 0.0) + 0.45 * length
    origin = _emptiest(every, low, high)
    for name, tip in zip("xyz", tips.T, strict=True):
        text: dict[str, Any] = {"textcoords": "offset points", "fontsize": 7, "color": "0.3"}
        text["zorder"] = 8
        way = float(np.linalg.norm(tip))
        if way < _TOWARDS_EYE * length:
            ax.plot(*origin, "o", ms=4, mfc="white", mec="0.3", mew=0.7, zorder=8)
            ax.annotate(name, tuple(origin), xytext=(-6, -6), **text)
            continue
        arrow: dict[str, Any] = {"arrowstyle": "-|>,head_width=0.13,head_length=0.26"}
        arrow |= {"lw": 0.7, "color": "0.3", "shrinkA": 0, "shrinkB": 0}
        end = tuple(origin + tip)
        made = ax.annotate("", end, tuple(origin), arrowprops=arrow, zorder=8)
        made.set_gid(f"axis:{name}")
        ax.annotate(name, end, xytext=5.5 * tip / way, ha="center", va="center", **text)
    below = origin + np.array([0.0, min(tips[1].min(), 0.0)])
    look: dict[str, Any] = {"fontsize": style.NOTE_SIZE, "color": "0.3", "va": "top", "zorder": 8}
    words = f"axes {length:g} {unit_name}"
    ax.annotate(words, tuple(below), xytext=(0, -5), textcoords="offset points", **look)
    return np.array([origin + low, origin + high])


def _emptiest(every: Array, box_low: Array, box_high: Array) -> Array:
    """Return where a box (low and high corner from its origin) hides least of all points (n, 2)."""
    low = every.min(axis=0)
    high = every.max(axis=0)
    room = np.maximum(high - low - (box_high - box_low), 0.0)
    best = np.inf
    where = low - box_low
    for right in (0.0, 0.5, 1.0):
        for up in (0.0, 1.0):
            corner = low - box_low + np.array([right, up]) * room
            away = (box_high[1] - box_low[1]) * (1.0 if up else -1.0)
            for step in (0.0, 0.25, 0.5, 0.75, 1.0):
                origin = corner + np.array([0.0, step * away])
                inside = (every > origin + box_low) & (every < origin + box_high)
                hidden = int(inside.all(axis=1).sum())
                cost = 50.0 * (hidden > 0) + hidden + 100.0 * step
                cost += (right == 0.5) + 0.5 * (right == 1.0) + 0.25 * up
                if cost < best:
                    best = cost
                    where = origin
    return np.asarray(where)
