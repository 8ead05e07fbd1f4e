"""Write the panel of the page as HTML, in mm and N/mm, with a name on every number."""

from __future__ import annotations

import math
from functools import cache
from typing import Final

import matplotlib

from cdsm.plots.style import AXES, MM, N_PER_MM
from cdsm.support.format import MODEL, coordinates
from cdsm.support.markup import Markup, element
from cdsm.tension import Tension
from cdsm.view.state import Condition, Shown

_GREEN, _RED, _GREY = "#2f855a", "#c53030", "#718096"
_BADGES: Final = {
    Condition.STABLE: _GREEN,
    Condition.UNSTABLE: _RED,
    Condition.SINGULAR: _RED,
}
_BOX: Final = "padding:0 0.8em;margin-bottom:0.6em;font-size:0.85em;height:23em;overflow-y:auto"
"""Style of the panel. Its height is fixed, so that sliders do not move while they are dragged."""

_NUMBER: Final = "text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums"

_STOPS = 9
"""Number of colours in the bar of tensions."""


def page_text(shown: Shown) -> str:
    """Write the panel of one setting. Each number is in an element with ``data-cdsm="name"``."""
    parts = [_badge(shown.condition)]
    if shown.problem:
        parts.append(element("p", _named("problem", shown.problem)))
    rows = [*_stiffness_rows(shown), *_posture_rows(shown), *_tension_rows(shown.tension)]
    if rows:
        parts.append(element("table", *rows, style="width:100%;border-spacing:0 0.15em"))
    if shown.stiffness is not None:
        parts.append(element("div", MODEL, style="color:gray"))
    if shown.tension is not None:
        parts += _color_bar(shown.tension)
    return str(element("div", *parts, style=_BOX))  # msgspec accepts no subclass of str


def _badge(condition: Condition) -> Markup:
    color = _BADGES.get(condition, _GREY)
    style = f"background:{color};color:white;font-weight:bold;text-align:center;padding:0.2em"
    return element("div", _named("condition", condition.value), style=style)


def _stiffness_rows(shown: Shown) -> list[Markup]:
    K = shown.stiffness
    if K is None or shown.condition is Condition.SINGULAR:
        return []
    rows = []
    if shown.along is not None and shown.principal is not None:
        for axis, value in zip(AXES, shown.along.tolist(), strict=True):
            rows.append(_row(f"stiffness along {axis}", _stiffness(value), "N/mm", f"along-{axis}"))
        for name in ("softest", "stiffest"):
            value = float(shown.principal[name])
            direction = coordinates(shown.principal[f"{name}_direction"], "z.2f")
            rows.append(_row(f"{name}: {direction}", _stiffness(value), "N/mm", name))
        most = f"{MM / shown.principal['softest']:.3g}"
        rows.append(_row("1 N moves the tip at most", most, "mm", "most"))
    unit = K.posture.arm.stiffness_unit()
    return [*rows, _row("smallest joint stiffness", f"{K.margin:.4g}", unit, "margin")]


def _posture_rows(shown: Shown) -> list[Markup]:
    if shown.posture is None:
        return []
    tip = ", ".join(f"{MM * x:.1f}" for x in shown.posture.tip[:3, 3])
    return [_row("tip", tip, "mm", "tip")]


def _tension_rows(tension: Tension | None) -> list[Markup]:
    if tension is None:
        return []
    F, cables = tension.values, tension.posture.arm.cables
    return [
        _row(f"{name} tension, {cables[c].name}", f"{F[c]:.4g}", "N", f"{name}-tension")
        for name, c in (("smallest", F.argmin()), ("largest", F.argmax()))
    ]


def _color_bar(tension: Tension) -> tuple[Markup, Markup]:
    ends = (f"{force:.4g}" for force in (tension.values.min(), tension.values.max()))
    low, high = (element("span", end) for end in ends)
    return (
        element("div", style=f"height:0.7em;background:linear-gradient(to right,{_gradient()})"),
        element(
            "div",
            *(low, element("span", "cable tension [N]"), high),
            style="display:flex;justify-content:space-between",
        ),
    )


@cache
def _gradient() -> str:
    colors = matplotlib.colormaps["viridis"]
    stops = (colors(i / (_STOPS - 1), bytes=True)[:3] for i in range(_STOPS))
    return ",".join(f"rgb({red},{green},{blue})" for red, green, blue in stops)


def _row(what: str, value: str, unit: str, name: str) -> Markup:
    return element(
        "tr",
        element("td", what),
        element("td", _named(name, value), style=_NUMBER),
        element("td", f"\xa0{unit}", style="white-space:nowrap"),
    )


def _named(name: str, text: str) -> Markup:
    return element("span", text, data_cdsm=name)


def _stiffness(value: float) -> str:
    return f"{N_PER_MM * value:.4g}" if math.isfinite(value) else "∞"
