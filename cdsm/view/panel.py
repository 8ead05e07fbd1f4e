"""Write the text of the panel as HTML, in mm and N/mm; every number is in a named element."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final, NamedTuple

import matplotlib
import numpy as np

from cdsm.manipulator import Manipulator
from cdsm.plots.style import COLOR_MAP, MM, N_PER_MM
from cdsm.stiffness_matrix.prints import model_of
from cdsm.support.directions import XYZ
from cdsm.support.format import coordinates, plural
from cdsm.support.markup import Markup, element
from cdsm.support.values import Array
from cdsm.view.state import ELLIPSOID, FORCE, SLIDES, STICKS, Condition, Shown
from cdsm.wires.catalogue import wires_text

_GREEN, _RED, _AMBER, _GREY = "#2f855a", "#c53030", "#b7791f", "#718096"
_COLORS: Final = {
    Condition.STABLE: _GREEN,
    Condition.UNSTABLE: _RED,
    Condition.SINGULAR: _RED,
    Condition.LEFT_REFERENCE: _AMBER,
}
_TEXT: Final = "padding:0 0.8em;margin-bottom:0.6em;font-size:0.85em;overflow-y:auto;"
_BOX: Final = _TEXT + "height:27em"
"""Style of the panel. Its height is fixed, so that sliders do not move while they are dragged."""

_LIST: Final = _TEXT + "max-height:16em"
_TABLE: Final = "width:100%;border-spacing:0 0.15em"
_NUMBER: Final = "text-align:right;white-space:nowrap;font-variant-numeric:tabular-nums"
_GRADIENT: Final = ",".join(
    f"rgb({red},{green},{blue})"
    for red, green, blue, _ in matplotlib.colormaps[COLOR_MAP](np.linspace(0, 1, 9), bytes=True)
)


class _Row(NamedTuple):
    """Row of the table on the page: its text, its numbers by name, and their unit."""

    what: str
    values: dict[str, str]
    unit: str


def page_text(shown: Shown, force_scale: float, remark: str = "") -> str:
    """Write the results ``shown`` as HTML: condition, remarks, table of numbers, legend.

    ``force_scale`` [m/N] is the length of the force arrow per newton. ``remark`` stands above the
    numbers.
    """
    color = _COLORS.get(shown.condition, _GREY)
    badge = f"background:{color};color:white;font-weight:bold;text-align:center;padding:0.2em"
    parts = [element("div", _named("condition", shown.condition.value), style=badge)]
    lines = "white-space:pre-line"
    parts += [
        element("p", _named(name, text), style=lines) for name, text in _remarks(shown, remark)
    ]
    rows = [_row(each) for each in _numbers(shown)]
    if rows:
        parts.append(element("table", *rows, style=_TABLE))
    if shown.stiffness is not None:
        parts.append(element("div", _named("model", model_of(shown.stiffness)), style="color:gray"))
    parts += _legend(shown, force_scale)
    if shown.tensions is not None:
        parts += _color_bar(shown.tensions)
    return str(element("div", *parts, style=_BOX))  # msgspec accepts no subclass of str


def basis_text(arm: Manipulator) -> str:
    """Write as HTML for which arm, wires, gravity and friction the numbers on the page hold."""
    friction = "friction in its holes where it sags" if arm.has_friction else "frictionless"
    words = f"with wire {wires_text(arm.cables)}; gravity {coordinates(arm.gravity)} m/s²"
    lines = element("div", str(arm)), element("div", _named("basis", f"{words}; {friction}"))
    return str(element("div", *lines, style=_TEXT + "color:gray"))


def tensions_text(shown: Shown) -> str:
    """Write the tensions of all cables as HTML; mark slack cables and tensions at a bound."""
    if shown.tensions is None or shown.posture is None or shown.cable_colors is None:
        return str(element("div", "unknown", style=_LIST))
    marks: dict[str, str] = {}
    if shown.rest is not None:
        marks = dict.fromkeys(shown.rest.slack, "slack")
    elif shown.tension is not None:
        marks = dict.fromkeys(shown.tension.at_minimum, "at lower bound")
        marks |= dict.fromkeys(shown.tension.at_maximum, "at upper bound")
    rows = [
        element(
            "tr",
            element("td", _swatch(color), " ", cable.name),
            element("td", _named(f"tension-{c}", f"{F:.4g}"), style=_NUMBER),
            element("td", "\xa0N"),
            element("td", _named(f"bound-{c}", marks.get(cable.name, "")), style="color:gray"),
        )
        for c, (cable, F, color) in enumerate(
            zip(shown.posture.arm.cables, shown.tensions, shown.cable_colors, strict=True)
        )
    ]
    return str(element("div", element("table", *rows, style=_TABLE), style=_LIST))


def _remarks(shown: Shown, remark: str) -> Iterator[tuple[str, str]]:
    """Yield name and text of each remark above the numbers.

    They are ``remark``, unless it is empty, and the remarks about the results ``shown``.
    """
    if remark:
        yield "remark", remark
    if shown.problem:
        yield "problem", shown.problem
    if shown.rest is not None and shown.rest.at_limit:
        yield "stops", f"rests on its stop: {', '.join(shown.rest.at_limit)}"


def _numbers(shown: Shown) -> Iterator[_Row]:
    K, principal, tensions, pose = shown.stiffness, shown.principal, shown.tensions, shown.posture
    if shown.along is not None and principal is not None:
        along = {f"along-{axis}": _stiffness(F) for axis, F in zip(XYZ, shown.along, strict=True)}
        yield _Row("stiffness along x, y, z", along, "N/mm")
        for name in ("softest", "stiffest"):
            direction = coordinates(principal[f"{name}_direction"], "z.2f")
            yield _Row(f"{name}: {direction}", {name: _stiffness(float(principal[name]))}, "N/mm")
        yield _Row("1 N moves the tip at most", {"most": f"{MM / principal['softest']:.3g}"}, "mm")
    if K is not None and shown.condition is not Condition.SINGULAR:
        unit = K.posture.arm.stiffness_unit()
        yield _Row("smallest joint stiffness", {"margin": f"{K.margin:.4g}"}, unit)
    if pose is not None:
        yield _Row("tip", {"tip": _millimetres(pose.tip[:3, 3])}, "mm")
    if shown.rest is not None:
        yield _Row("sagged by", {"sagged": _millimetres(shown.rest.displacement)}, "mm")
    if tensions is not None and pose is not None:
        for name, c in (("smallest", tensions.argmin()), ("largest", tensions.argmax())):
            what = f"{name} tension, {pose.arm.cables[c].name}"
            yield _Row(what, {f"{name}-tension": f"{tensions[c]:.4g}"}, "N")


def _row(row: _Row) -> Markup:
    span = str(4 - len(row.values))  # three columns of numbers
    values = (_named(*each) for each in row.values.items())
    return element(
        "tr",
        element("td", row.what),
        *(element("td", value, colspan=span, style=_NUMBER) for value in values),
        element("td", f"\xa0{row.unit}", style="white-space:nowrap"),
    )


def _legend(shown: Shown, force_scale: float) -> Iterator[Markup]:
    """Yield HTML that explains what is drawn: ellipsoid, force arrow, marks of holes.

    ``force_scale`` [m/N] is the length of the force arrow per newton.
    """
    if shown.ellipsoid is not None:
        yield _key(ELLIPSOID, "ellipsoid", f"ellipsoid: {shown.ellipsoid}")
    if shown.posture is not None and shown.setting.force.any():
        yield _key(FORCE, "arrow", f"arrow: force at the tip, {MM * force_scale:.3g} mm per N")
    sticking, sliding = map(len, shown.holes)
    if sticking or sliding:
        yield element(
            "div",
            *(_swatch(STICKS), " ", _named("sticking", f"{plural(sticking, 'hole')} stick,")),
            *(" ", _swatch(SLIDES), " ", _named("sliding", f"{sliding} slide")),
        )


def _key(color: tuple[int, int, int], name: str, text: str) -> Markup:
    return element("div", _swatch(color), " ", _named(name, text))


def _swatch(color: object) -> Markup:
    red, green, blue = map(int, color)  # type: ignore[call-overload]
    size = "display:inline-block;width:0.8em;height:0.8em;border-radius:0.2em"
    return element("span", style=f"{size};background:rgb({red},{green},{blue})")


def _color_bar(tensions: Array) -> tuple[Markup, Markup]:
    ends = f"{tensions.min():.4g}", f"{tensions.max():.4g}"
    words = (element("span", word) for word in (ends[0], "cable tension [N]", ends[1]))
    return (
        element("div", style=f"height:0.7em;background:linear-gradient(to right,{_GRADIENT})"),
        element("div", *words, style="display:flex;justify-content:space-between"),
    )


def _named(name: str, text: str) -> Markup:
    return element("span", text, data_cdsm=name)


def _millimetres(point: Array) -> str:
    return ", ".join(f"{MM * x:z.1f}" for x in point)


def _stiffness(value: float) -> str:
    return f"{N_PER_MM * value:.4g}" if math.isfinite(value) else "∞"
