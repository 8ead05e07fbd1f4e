"""Texts of the page as HTML: the verdict, tables of numbers, bars of the tensions, the matrix."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Final

import numpy as np

from cdsm.cable import breaking_forces, largest_share, wires_text
from cdsm.errors import SingularStiffness
from cdsm.load_texts import own_loads
from cdsm.manipulator import Manipulator
from cdsm.plots.style import DARK, MM, VERMILLION
from cdsm.quantities import display_for
from cdsm.status import Status
from cdsm.stiffness_matrix import Stiffness
from cdsm.stiffness_matrix.prints import model_of, softer_side
from cdsm.support.format import coordinates, largest_finite, plural, span
from cdsm.support.values import Array
from cdsm.view.scene import ELLIPSOID, FORCE, SLIDES, STICKS, TOUCHING, Scene
from cdsm.view.state import Color, Shown

_GOOD: Final = ("#e6f4ee", "#00734f")
_BAD: Final = ("#b34700", "#fff")
_DOUBT: Final = ("#e69f00", "#222")
_NONE: Final = ("#718096", "#fff")
_LOOKS: Final = {
    Status.OK: _GOOD,
    Status.UNSTABLE: _BAD,
    Status.SINGULAR: _BAD,
    Status.UNSTABLE_TO_ONE_SIDE: _BAD,
    Status.MOVED: _BAD,
    Status.INFEASIBLE: _BAD,
    Status.NO_EQUILIBRIUM: _BAD,
    Status.NEUTRAL: _DOUBT,
    Status.AT_STOP: _DOUBT,
    Status.UNBALANCED: _DOUBT,
    Status.ABOVE_MAXIMUM: _DOUBT,
    Status.SELF_CONTACT: _DOUBT,
    Status.SLACK: _DOUBT,
}
"""Background and ink of the banner by the verdict; others have none."""

_HEAD: Final = "9.5em"
"""Height of the text above all tabs, so that sliders do not move while they are dragged."""

_NEAR = 3.0  # a bar reaches to the upper bound if this is below so many times the largest tension
_WIDEST = 9.0  # of a name beside a bar [em]; a longer one takes two lines
_AT_BOUND = 1e-6  # distance from a bound at which a tension is marked, over the largest tension
_MARK: Final = DARK[VERMILLION]


def about_text(arm: Manipulator) -> str:
    """Write what the arm is: its sizes, wire, gravity and friction."""
    friction = "friction in its holes where motors are locked" if arm.has_friction else ""
    basis = f"wire {wires_text(arm.cables)}; gravity {coordinates(arm.gravity)} m/s²"
    said = [f"{arm}; {basis}; {friction or 'frictionless'}", arm.motors.line]
    return box(lines("\n".join(filter(None, said))))


def head_text(shown: Shown, remark: str = "") -> str:
    """Write the verdict with its reasons, and the stiffness of the tip along the axes."""
    status = shown.status if shown.verdict is None else shown.verdict.status
    back, ink = _LOOKS.get(status, _NONE)
    look = f"background:{back};color:{ink};padding:0.4em 0.7em;border-radius:0.3em;font-weight:600"
    parts = [f'<div style="{look}">{html.escape(shown.heading)}</div>']
    rows = [*_stiffness(shown)]
    parts += [_table(rows)] if rows else []
    cause = [] if shown.status is Status.OK else [f"{shown.status.message}."]
    parts += [lines(said) for said in (*cause, remark, shown.problem) if said]
    return box("".join(parts), _HEAD)


def said_numbers(shown: Shown) -> list[str]:
    """Return the stiffness of the tip as lines of plain text."""
    return [html.unescape(f"{what}: {value} {unit}") for what, value, unit in _stiffness(shown)]


def answer_text(shown: Shown, scene: Scene) -> str:
    """Write the table of numbers, and the legend of the scene."""
    parts = [_table(_numbers(shown))]
    if shown.posture is not None and (own := own_loads(shown.posture.arm)):
        parts.append(lines("\n".join(own)))
    if shown.tensions is not None and shown.posture is not None:
        parts.append(lines(largest_share(shown.posture.arm.cables, shown.tensions)))
    if shown.stiffness is not None:
        parts.append(lines(model_of(shown.stiffness)))
    legend = [f"grid: {MM * scene.cell:g} mm"]
    if shown.ellipsoid is not None:
        legend.append(f"{_swatch(ELLIPSOID)} {shown.ellipsoid}")
    if shown.posture is not None and shown.setting.force.any():
        where = html.escape(shown.setting.link) or "the tip"
        size = f"{np.linalg.norm(shown.setting.force):.4g} N"
        legend.append(f"{_swatch(FORCE)} force at {where}: {size}")
    sticking, sliding = map(len, shown.holes)
    if sticking or sliding:
        marks = _swatch(STICKS), _swatch(SLIDES)
        legend.append(f"{marks[0]} {sticking} holes stick, {marks[1]} {sliding} slide")
    if shown.touching:
        legend.append(f"{_swatch(TOUCHING)} {plural(len(shown.touching), 'link')} overlap")
    return box(f"{''.join(parts)}<div>{'<br>'.join(legend)}</div>")


def tensions_text(shown: Shown) -> str:
    """Draw the tensions of all cables as bars with their bounds; mark those at a bound, or slack.

    The colours are those of the cables.
    """
    if shown.tensions is None or shown.posture is None:
        return box("The tensions are unknown.")
    F = shown.tensions
    low, high = shown.bounds
    largest = float(F.max(initial=0.0))
    ends = [largest, *low[np.isfinite(low)], *high[high <= _NEAR * largest]]
    top = 1.05 * max(ends) or 1.0
    slack = () if shown.rest is None else shown.rest.slack
    cables = shown.posture.arm.cables
    names = cables.names
    shares = F / breaking_forces(cables)
    room = "7.2em" if np.isnan(shares).all() else "10em"
    longest = 0.62 * max(map(len, names)) + 0.6
    wide = min(longest, _WIDEST)
    near = _AT_BOUND * largest
    rows = []
    for i, name in enumerate(names):
        mark = "slack" if name in slack else ""
        mark = mark or ("min" if low[i] > 0.0 and F[i] <= low[i] + near else "")
        mark = mark or ("max" if F[i] >= high[i] - near else "")
        ticks = [bound / top for bound in (low[i], high[i]) if 0.0 < bound <= top]
        bar = _bar(F[i] / top, shown.cable_colors[i], ticks)
        shade = f"color:{_MARK}" if mark else ""
        look = f"width:{room};text-align:right;white-space:nowrap;{shade}"
        share = "" if math.isnan(shares[i]) else f"{100.0 * shares[i]:.3g} % "
        written = html.escape(name)
        if longest > _WIDEST:  # in two lines
            written = written.replace("_", "_<wbr>")
        rows.append(
            '<div class="tension" style="display:flex;align-items:center;min-height:1.45em">'
            f'<span style="width:{wide:.1f}em;overflow-wrap:anywhere;line-height:1">'
            f'{written}</span>{bar}<span style="{look}">{F[i]:.4g} N {share}{mark}</span></div>'
        )
    bounds = [f"from {span(low)}" * bool(low.any())]
    bounds.append(f"to {span(high)}" * bool(np.isfinite(high).all()))
    said = " ".join(filter(None, bounds))
    rows.append(f"bounds{_swatch_line()}: {said} N" if said else "no bounds")
    if not np.isnan(shares).all():
        rows.append(lines("%: of the least breaking force of the rope"))
    return box("".join(rows))


def matrix_text(shown: Shown) -> str:
    """Write the stiffness of the tip as a matrix (6, 6), or else (3, 3), or why there is none."""
    K = shown.stiffness
    if K is None or shown.source is None:
        return box("The arm is not stable as shown: it has no stiffness at the tip.")
    if shown.rest is not None and shown.rest.at_limit:
        stops = ", ".join(shown.rest.at_limit)
        return box(lines(f"{stops} on the stop: the matrix does not know of stops."))
    notes = []
    try:
        matrix = np.asarray(K.spatial())
    except SingularStiffness as error:
        notes = [str(error)]
        try:
            matrix = K.cartesian
        except SingularStiffness as worse:
            return box(lines("\n".join(dict.fromkeys([*notes, str(worse)]))))
    unit, size = display_for("N/m", largest_finite(matrix[:3, :3]))
    way = unit.partition("/")[2]
    n = len(matrix)
    axes = [*"xyz", *("turn x", "turn y", "turn z")][:n]
    scale = np.ones((n, n))
    scale[:, :3] = size  # per mm or m
    cells = [[f"{k:z.4g}" for k in row] for row in np.round(matrix / scale, 9)]
    what = f"force [N]{', moment [N m]' if n > 3 else ''} per {way}{' and rad' if n > 3 else ''}"
    notes.insert(0, f"{what} of the tip, base axes")
    head = "".join(f'<th style="text-align:right">{axis}</th>' for axis in ("", *axes))
    body = "".join(
        f"<tr><th>{name}</th>"
        + "".join(f'<td style="text-align:right">{cell}</td>' for cell in row)
        + "</tr>"
        for name, row in zip([*"xyz", *("mx", "my", "mz")], cells, strict=False)
    )
    table = f'<table class="matrix" style="width:100%"><tr>{head}</tr>{body}</table>'
    return box(lines(notes[0]) + f'<div style="overflow-x:auto">{table}</div>'
                + "".join(lines(note) for note in notes[1:]))  # fmt: skip


def code_text(text: str) -> str:
    """Write lines of code."""
    look = "overflow-x:auto;margin:0.3em 0;font-size:0.95em;white-space:pre-wrap"
    return box(f'<pre style="{look}">{html.escape(text)}</pre>')


def _stiffness(shown: Shown) -> Iterator[tuple[str, str, str]]:
    """Yield the stiffness along the axes, of the softer sides, and the softest direction."""
    source = shown.source
    K = shown.stiffness
    if source is None or K is None:
        return
    side = ", softer side" if K.slack else ""
    yield f"stiffness along x, y, z{side}", *_along_axes(source.along, K)
    if link := shown.setting.link:
        of_link = _along_axes(lambda u: source.along(u, link), K)
        yield f"the same of {html.escape(link)}{side}", *of_link
    softest, direction = shown.principal["softest"], shown.principal["softest_direction"]
    unit, size = display_for("N/m", float(softest))
    yield f"softest: {coordinates(direction, 'z.2f')}", f"{softest / size:.4g}", unit


def _along_axes(along: Callable[[Array], float], K: Stiffness) -> tuple[str, str]:
    """Return the stiffness along the axes, of the softer sides, and its unit."""
    # both sides are equal unless cables are at 0 N
    values = [along(softer_side(along, u) if K.slack else u) for u in np.eye(3)]
    unit, size = display_for("N/m", largest_finite(np.array(values)))
    return ", ".join(f"{value / size:.4g}" for value in values), unit


def _numbers(shown: Shown) -> Iterator[tuple[str, str, str]]:
    """Yield what each further number is, the number, and its unit."""
    K = shown.stiffness
    source = shown.source
    tensions = shown.tensions
    pose = shown.posture
    if source is not None:
        principal = shown.principal
        direction = coordinates(principal["stiffest_direction"], "z.2f")
        unit, size = display_for("N/m", float(principal["stiffest"]))
        yield f"stiffest: {direction}", f"{principal['stiffest'] / size:.4g}", unit
        yield "largest compliance", f"{MM / principal['softest']:.3g}", "mm/N"
    if K is not None and shown.status is not Status.SINGULAR:
        yield "smallest joint stiffness", f"{K.margin:.4g}", K.posture.arm.stiffness_unit()
    if pose is not None:
        yield "tip", _joined(MM * pose.tip[:3, 3]), "mm"
    if shown.rest is not None:
        yield "displacement", _joined(MM * shown.rest.displacement), "mm"
        if shown.setting.link:
            moved = shown.moved_point
            yield f"displacement of {html.escape(shown.setting.link)}", _joined(MM * moved), "mm"
        if shown.rest.at_limit:
            yield "joint limit reached", html.escape(", ".join(shown.rest.at_limit)), ""
    if tensions is not None and pose is not None:
        for name, c in (("smallest", tensions.argmin()), ("largest", tensions.argmax())):
            cable = html.escape(pose.arm.cables[c].name)
            swatch = _swatch(shown.cable_colors[c])
            yield f"{name} tension, {swatch} {cable}", f"{tensions[c]:.4g}", "N"


def _table(rows: Iterable[Sequence[str]]) -> str:
    """Return a table of what, number and unit, each as HTML."""
    whole = "white-space:nowrap"
    body = [
        f'<tr><td>{what}</td><td style="text-align:right;{whole}">{value}</td>'
        f'<td style="{whole}">&nbsp;{unit}</td></tr>'
        for what, value, unit in rows
    ]
    return f'<table style="width:100%">{"".join(body)}</table>' if body else ""


def box(content: str, height: str = "auto") -> str:
    """Return content in small letters, with a margin."""
    look = f"height:{height};overflow-y:auto;margin:0.2em 1em 0.2em 0.6em;font-size:0.8em"
    look += ";line-height:1.45"
    return f'<div style="{look}">{content}</div>'


def lines(text: str) -> str:
    """Return text as HTML, in which none of its signs means anything."""
    return f"<div>{html.escape(text).replace(chr(10), '<br>')}</div>"


def _swatch(color: Color) -> str:
    return f'<span style="background:rgb{color};border-radius:0.2em">&emsp;</span>'


def _bar(part: float, color: Color, ticks: Iterable[float]) -> str:
    """Return a bar that fills a part of the width, with marks at other parts."""
    style = f"inset:0 auto 0 0;width:{100.0 * part:.2f}%;background:rgb{color}"
    marks = [f"inset:-1px auto -1px {100.0 * at:.2f}%;width:2px;background:{_MARK}" for at in ticks]
    pieces = "".join(f'<i style="position:absolute;{look}"></i>' for look in (style, *marks))
    look = "flex:1;position:relative;height:0.8em;background:#eee"
    return f'<span style="{look}">{pieces}</span>'


def _swatch_line() -> str:
    return f' <span style="color:{_MARK}">|</span>'


def _joined(values: Iterable[float], form: str = "z.1f") -> str:
    return ", ".join(format(value, form) for value in values)
