"""What the page says, as HTML: names and messages escaped, N/mm and mm, a name on every number."""

from __future__ import annotations

import html
import math
from functools import cache
from typing import Final

import matplotlib

from cdsm.plots.style import AXES, MM, N_PER_MM
from cdsm.support.units import MODEL
from cdsm.support.validation import Array
from cdsm.tension import Tension
from cdsm.view.state import Condition, Shown

_GOOD, _BAD, _NONE = "#2f855a", "#c53030", "#718096"
_BADGES: Final = {
    Condition.STABLE: _GOOD,
    Condition.UNSTABLE: _BAD,
    Condition.SINGULAR: _BAD,
}
_BOX: Final = "padding:0 0.8em;margin-bottom:0.6em;font-size:0.85em;height:23em;overflow-y:auto"
"""Of one height always: no slider may move away under the mouse that drags it."""

_STOPS = 9
"""Colours in the bar of tensions."""


def page_text(shown: Shown) -> str:
    """The panel of one setting. Every number is in an element with ``data-cdsm="its name"``."""
    parts = [_badge(shown.condition)]
    if shown.problem:
        parts.append(f"<p>{_named('problem', shown.problem)}</p>")
    rows = [*_stiffness_rows(shown), *_posture_rows(shown), *_tension_rows(shown.tension)]
    if rows:
        parts.append(f'<table style="width:100%;border-spacing:0 0.15em">{"".join(rows)}</table>')
    if shown.stiffness is not None:
        parts.append(f'<div style="color:gray">{MODEL}</div>')
    if shown.tension is not None:
        parts.append(_color_bar(shown.tension))
    return f'<div style="{_BOX}">{"".join(parts)}</div>'


def _badge(condition: Condition) -> str:
    color = _BADGES.get(condition, _NONE)
    style = f"background:{color};color:white;font-weight:bold;text-align:center;padding:0.2em"
    return f'<div style="{style}">{_named("condition", condition.value)}</div>'


def _stiffness_rows(shown: Shown) -> list[str]:
    K = shown.stiffness
    if K is None or shown.condition is Condition.SINGULAR:
        return []
    rows = []
    if shown.along is not None and shown.principal is not None:
        rows = [
            _row(f"stiffness along {axis}", _stiffness(value), "N/mm", f"along-{axis}")
            for axis, value in zip(AXES, shown.along, strict=True)
        ]
        for name in ("softest", "stiffest"):
            value = float(shown.principal[name])
            direction = _direction(shown.principal[f"{name}_direction"])
            rows.append(_row(f"{name}: {direction}", _stiffness(value), "N/mm", name))
        most = f"{MM / shown.principal['softest']:.3g}"
        rows.append(_row("1 N moves the tip at most", most, "mm", "most"))
    unit = K.posture.arm.stiffness_unit()
    return [*rows, _row("smallest joint stiffness", f"{K.margin:.4g}", unit, "margin")]


def _posture_rows(shown: Shown) -> list[str]:
    if shown.posture is None:
        return []
    tip = ", ".join(f"{MM * x:.1f}" for x in shown.posture.tip[:3, 3])
    return [_row("tip", tip, "mm", "tip")]


def _tension_rows(pull: Tension | None) -> list[str]:
    if pull is None:
        return []
    rows = []
    for name, c in (("smallest", pull.values.argmin()), ("largest", pull.values.argmax())):
        what = f"{name} tension, {pull.posture.arm.cables[c].name}"
        rows.append(_row(what, f"{pull.values[c]:.4g}", "N", f"{name}-tension"))
    return rows


def _color_bar(pull: Tension) -> str:
    low, high = f"{pull.values.min():.4g}", f"{pull.values.max():.4g}"
    return (
        f'<div style="height:0.7em;background:linear-gradient(to right,{_gradient()})"></div>'
        '<div style="display:flex;justify-content:space-between">'
        f"<span>{low}</span><span>cable tension [N]</span><span>{high}</span></div>"
    )


@cache
def _gradient() -> str:
    colors = matplotlib.colormaps["viridis"]
    stops = (colors(i / (_STOPS - 1), bytes=True)[:3] for i in range(_STOPS))
    return ",".join(f"rgb({red},{green},{blue})" for red, green, blue in stops)


def _row(what: str, value: str, unit: str, name: str) -> str:
    number = 'style="text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums"'
    return (
        f"<tr><td>{html.escape(what)}</td>"
        f"<td {number}>{_named(name, value)}</td>"
        f'<td style="white-space:nowrap">&nbsp;{html.escape(unit)}</td></tr>'
    )


def _named(name: str, text: str) -> str:
    return f'<span data-cdsm="{name}">{html.escape(text)}</span>'


def _stiffness(value: float) -> str:
    return f"{N_PER_MM * value:.4g}" if math.isfinite(value) else "∞"


def _direction(u: Array) -> str:
    return f"({', '.join(f'{x:z.2f}' for x in u)})"
