"""Curve of the stiffness over the least tension, with a mark where the arm is."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Final, NamedTuple, final

import numpy as np

from cdsm.loads import LoadsLike
from cdsm.plots.over_tension import TensionLevel, at_level
from cdsm.plots.style import BLUE, VERMILLION
from cdsm.quantities import display_for
from cdsm.support.format import largest_finite
from cdsm.support.values import Array
from cdsm.view.state import Shown
from cdsm.view.texts import box, lines

if TYPE_CHECKING:
    import viser

_LEVELS = 40  # lower bounds of a curve
_FIRST = 1e-3  # the first one at least, over the last one
_EDGE = 1e-3  # width of the interval in which the arm loses its stiffness, over the last bound
_HEIGHT = 170  # of the picture [pixels]
_ROOM = 1.1  # its upper end, over the largest stiffness
_WAITING: Final = "computed when the sliders rest"


class Curve(NamedTuple):
    """Stiffness along an axis over the least tension."""

    tension: Array  # lower bounds that held (n,) [N], ascending
    along: Array  # of the softer side (n,) [N/m]; NaN where there is none
    here: int | None  # which of them the arm has; None: none
    gaps: tuple[str, ...]  # why there is none, and from where on


def compute_curve(
    shown: Shown, axis: str, ends: tuple[float, float], stopped: Callable[[], bool]
) -> Curve | None:
    """Compute the curve between lower bounds [N]; None if it was stopped, or does not exist.

    With locked motors it is that of the arm without the force, as it was tensioned.
    """
    pose = shown.reference
    setting = shown.setting
    if pose is None or setting.pull is not None:
        return None
    u = np.eye(3)["xyz".index(axis)]
    wrench: LoadsLike = np.zeros(6) if setting.sag else setting.wrench

    def at(bound: float) -> TensionLevel:
        return at_level(pose, bound, u, wrench, setting.maximum, softer=True)

    low, high = ends
    levels: list[TensionLevel] = []
    for bound in np.geomspace(max(low, _FIRST * high), high, _LEVELS).tolist():
        if stopped():
            return None
        level = at(bound)
        if not levels or level.held > levels[-1].held:
            levels.append(level)
    gaps = []
    finite = [k for k, level in enumerate(levels) if math.isfinite(level.along)]
    for inner, step, side in ((finite[:1], -1, "below"), (finite[-1:], 1, "above")):
        for k in inner:
            if 0 <= k + step < len(levels):
                found = _towards_edge(at, levels[k], levels[k + step], _EDGE * high)
                gaps.append(f"{levels[k + step].status.title} {side} {found[-1].held:.4g} N")
                levels += found[1:]
    if not finite:
        gaps = [
            levels[0].status.title if levels[0].problem else f"the tip cannot move along {axis}"
        ]
    here = None
    if shown.tension is not None:
        held = float(shown.tension.minimum_held.min())
        mine = at(held)
        levels = [*(level for level in levels if level.held != held), mine]
        here = int(np.searchsorted(sorted(level.held for level in levels), held))
        here = here if math.isfinite(mine.along) else None
    levels.sort(key=lambda level: level.held)
    values = [level.along if math.isfinite(level.along) else math.nan for level in levels]
    return Curve(np.array([level.held for level in levels]), np.array(values), here, tuple(gaps))


def _towards_edge(
    at: Callable[[float], TensionLevel], inside: TensionLevel, outside: TensionLevel, width: float
) -> list[TensionLevel]:
    """Return levels with a stiffness between one that has it and one that has none.

    The last of them is within ``width`` [N] of where the stiffness ends.
    """
    found = [inside]
    beyond = outside.held
    while abs(beyond - found[-1].held) > width:
        middle = (found[-1].held + beyond) / 2.0
        level = at(middle)
        if math.isfinite(level.along) and level.held != found[-1].held:
            found.append(level)
        else:
            beyond = middle
    return found


@final
class CurveChart:
    """Chart of a curve in the panel; ``changed`` is called when another axis is chosen."""

    def __init__(self, gui: viser.GuiApi, changed: Callable[[], None]) -> None:
        self.axis = gui.add_dropdown("curve along", ("x", "y", "z"), initial_value="z")
        self.axis.on_update(lambda _: changed())
        self._said = gui.add_html("")
        nothing = np.full(2, math.nan)
        self.chart = gui.add_uplot(
            (np.arange(2.0), nothing, nothing),
            (
                {"label": "tension [N]"},
                {"label": "along", "stroke": BLUE, "width": 2.0},
                {"label": "here", "stroke": VERMILLION, "points": {"show": True, "size": 9.0}},
            ),
            scales={"x": {"time": False}},
            legend={"show": True},
            height=_HEIGHT,
            visible=False,
        )
        self._is_drawn = False

    def fade(self) -> None:
        """Take the chart away: the setting has changed."""
        if self._is_drawn:
            self._is_drawn = False
            x, along, _ = self.chart.data
            self.chart.data = (x, along, np.full(x.size, math.nan))
            self._said.content = box(lines(f"of the setting before; the new one is {_WAITING}"))

    def draw(self, curve: Curve | None) -> None:
        """Draw a curve; None: there is none."""
        finite = curve is not None and bool(np.isfinite(curve.along).any())
        self.chart.visible = finite
        self._is_drawn = True
        gaps = () if curve is None else curve.gaps
        if curve is None or not finite:
            self._said.content = box(lines("; ".join(gaps)))
            return
        unit, size = display_for("N/m", largest_finite(curve.along))
        title = f"stiffness along {self.axis.value} [{unit}] over least tension [N]"
        self._said.content = box(lines("\n".join([title, *gaps])))
        here = np.full(curve.tension.size, math.nan)
        if curve.here is not None:
            here[curve.here] = curve.along[curve.here] / size
        top = _ROOM * largest_finite(curve.along) / size
        self.chart.scales = {"x": {"time": False}, "y": {"range": (0.0, top)}}
        self.chart.data = (curve.tension, curve.along / size, here)
