"""Write the panel of the page as HTML, in mm and N/mm, with a name on every number."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import matplotlib
import numpy as np

from cdsm.plots.style import AXES, MM, N_PER_MM
from cdsm.support.format import MODEL, coordinates
from cdsm.support.markup import Markup, element
from cdsm.tension import Tension
from cdsm.view.state import Condition, Shown

_GREEN, _RED, _GREY = "#2f855a", "#c53030", "#718096"
_COLORS: Final = {Condition.STABLE: _GREEN, Condition.UNSTABLE: _RED, Condition.SINGULAR: _RED}
_BOX: Final = "padding:0 0.8em;margin-bottom:0.6em;font-size:0.85em;height:23em;overflow-y:auto"
"""Style of the panel. Its height is fixed, so that sliders do not move while they are dragged."""

_NUMBER: Final = "text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums"
_GRADIENT: Final = ",".join(
    f"rgb({red},{green},{blue})"
    for red, green, blue, _ in matplotlib.colormaps["viridis"](np.linspace(0, 1, 9), bytes=True)
)


def page_text(shown: Shown) -> str:
    """Write the panel of one setting. Each number is in an element with ``data-cdsm="name"``."""
    color = _COLORS.get(shown.condition, _GREY)
    badge = f"background:{color};color:white;font-weight:bold;text-align:center;padding:0.2em"
    parts = [element("div", _named("condition", shown.condition.value), style=badge)]
    if shown.problem:
        parts.append(element("p", _named("problem", shown.problem)))
    rows = [_row(*each) for each in _numbers(shown)]
    if rows:
        parts.append(element("table", *rows, style="width:100%;border-spacing:0 0.15em"))
    if shown.stiffness is not None:
        parts.append(element("div", MODEL, style="color:gray"))
    if shown.tension is not None:
        parts += _color_bar(shown.tension)
    return str(element("div", *parts, style=_BOX))  # msgspec accepts no subclass of str


def _numbers(shown: Shown) -> Iterator[tuple[str, str, str, str]]:
    """Yield text, value, unit and name of each number."""
    K, principal, tension = shown.stiffness, shown.principal, shown.tension
    if shown.along is not None and principal is not None:
        for axis, value in zip(AXES, shown.along, strict=True):
            yield f"stiffness along {axis}", _stiffness(value), "N/mm", f"along-{axis}"
        for name in ("softest", "stiffest"):
            direction = coordinates(principal[f"{name}_direction"], "z.2f")
            yield f"{name}: {direction}", _stiffness(float(principal[name])), "N/mm", name
        yield "1 N moves the tip at most", f"{MM / principal['softest']:.3g}", "mm", "most"
    if K is not None and shown.condition is not Condition.SINGULAR:
        unit = K.posture.arm.stiffness_unit()
        yield "smallest joint stiffness", f"{K.margin:.4g}", unit, "margin"
    if shown.posture is not None:
        tip = ", ".join(f"{MM * x:.1f}" for x in shown.posture.tip[:3, 3])
        yield "tip", tip, "mm", "tip"
    if tension is not None:
        F, cables = tension.values, tension.posture.arm.cables
        for name, c in (("smallest", F.argmin()), ("largest", F.argmax())):
            yield f"{name} tension, {cables[c].name}", f"{F[c]:.4g}", "N", f"{name}-tension"


def _row(what: str, value: str, unit: str, name: str) -> Markup:
    return element(
        "tr",
        element("td", what),
        element("td", _named(name, value), style=_NUMBER),
        element("td", f"\xa0{unit}", style="white-space:nowrap"),
    )


def _color_bar(tension: Tension) -> tuple[Markup, Markup]:
    ends = f"{tension.values.min():.4g}", f"{tension.values.max():.4g}"
    words = (element("span", word) for word in (ends[0], "cable tension [N]", ends[1]))
    return (
        element("div", style=f"height:0.7em;background:linear-gradient(to right,{_GRADIENT})"),
        element("div", *words, style="display:flex;justify-content:space-between"),
    )


def _named(name: str, text: str) -> Markup:
    return element("span", text, data_cdsm=name)


def _stiffness(value: float) -> str:
    return f"{N_PER_MM * value:.4g}" if math.isfinite(value) else "∞"
