"""Many lines on a panel: their looks, and their names at their ends, apart from each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from cdsm.plots import style
from cdsm.support.values import Array

_LINE = 8.0  # least distance of names below each other [points]
_APART = 100  # largest number of passes that move names apart


def move_apart(places: Array, least: float, low: float, high: float) -> Array:
    """Move ``places`` (n,) so far that neighbours are ``least`` apart, in the same order."""
    order = np.argsort(places, kind="stable")
    moved = np.array(places, dtype=float)[order]
    for _ in range(_APART):
        missing = least - np.diff(moved)
        close = np.flatnonzero(missing > 1e-9 * least)
        if not close.size:
            break
        for k in close:
            push = max((least - (moved[k + 1] - moved[k])) / 2.0, 0.0)
            moved[k] -= push
            moved[k + 1] += push
        moved = np.clip(moved, low, high)
    result = np.empty_like(moved)
    result[order] = moved
    return result


def name_lines(ax: Axes, x: float, ends: Sequence[tuple[float, str, str]]) -> None:
    """Write names beside the ends of lines (y, name, colour) at x, apart from each other.

    The limits of ``ax`` must be set before. Of more names than fit, the highest and lowest remain.
    Names of lines that end within the panel stand before their ends.
    """
    low, high = ax.get_ylim()
    figure = style.figure_of(ax)
    points = 72.0 * figure.get_figheight() * ax.get_position().height
    least = _LINE / points * (high - low)
    kept = sorted(end for end in ends if np.isfinite(end[0]))
    if len(kept) * least > high - low:
        count = len(kept) - 2
        middle = ((kept[0][0] + kept[-1][0]) / 2.0, f"{count} more between", style.SOFT)
        kept = [kept[0], middle, kept[-1]]
    inside = x < ax.get_xlim()[1]
    low += inside * least
    high -= inside * least
    wanted = np.clip(np.array([y for y, *_ in kept]), low, high)
    for (_, name, color), y in zip(kept, move_apart(wanted, least, low, high), strict=True):
        look: dict[str, Any] = {
            "color": style.DARK.get(color, color),
            "fontsize": 7,
            "va": "center",
        }
        look |= {"xytext": (-10, 0) if inside else (4, 0), "ha": "right" if inside else "left"}
        if inside:
            look["bbox"] = {"fc": "white", "ec": "none", "pad": 0.6}
        options: dict[str, Any] = {"textcoords": "offset points", "annotation_clip": False}
        ax.annotate(name, (x, y), parse_math=False, **options, **look)


def line_looks(names: Sequence[str]) -> list[dict[str, Any]]:
    """Return colour and style of a line for each name; above 28 names, a colour only."""
    if len(names) > len(style.COLORS) * len(style.STYLES):
        return [
            {"color": color} for color in style.TENSION_COLORS(np.linspace(0.0, 1.0, len(names)))
        ]
    color = style.COLORS * 4
    dashes = [dash for dash in style.STYLES for _ in style.COLORS]
    return [{"color": color[i], "ls": dashes[i]} for i in range(len(names))]


def cable_lines(ax: Axes, x: Array, values: Array, names: Sequence[str], **line: Any) -> None:
    """Draw values (N, C) against x (N,), a line for each of C cables, named at its end."""
    style.from_zero(ax, values)
    ends = []
    for name, column, look in zip(names, values.T, line_looks(names), strict=True):
        ax.plot(x, column, gid=f"tension:{name}", **look, **line)
        last = np.flatnonzero(np.isfinite(column))[-1:]
        color = look["color"] if isinstance(look["color"], str) else style.INK
        ends += [(float(column[k]), name, color) for k in last]
    ax.set_xlim(x[0], x[-1] if x[-1] > x[0] else x[0] + 1.0)
    name_lines(ax, float(ax.get_xlim()[1]), ends)
