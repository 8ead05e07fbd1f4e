"""Draw the report on a stiffness as one HTML page: text, tables, and pictures as inline SVG.

The page holds all it shows. It has no script, and its content security policy lets a browser load
nothing but the pixels within the page (the colour bar). Numbers and sentences are those of the text
of the report.
"""

from __future__ import annotations

import html
import io
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes

from cdsm.applied import as_loads
from cdsm.errors import CdsmError, SingularStiffness
from cdsm.planning.saturation import saturation
from cdsm.plots import style
from cdsm.plots.arm import plot_arm
from cdsm.plots.bars import plot_shares, plot_tensions
from cdsm.plots.measured import plot_uncertainty
from cdsm.plots.over_tension import plot_stiffness_over_tension
from cdsm.plots.style import MM, N_PER_MM
from cdsm.quantities import display_for
from cdsm.stiffness_matrix import prints
from cdsm.stiffness_matrix.report import tables
from cdsm.support.format import coordinates, place, span, without_rounding
from cdsm.support.validation import unit_direction
from cdsm.support.values import Array
from cdsm.tolerancing.budget import known_tolerances, uncertainty

if TYPE_CHECKING:
    from cdsm.stiffness_matrix import Report, Stiffness
    from cdsm.support.validation import Direction
    from cdsm.tension import Tension

_POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
_LOOK: Final = """
:root{--ink:#222;--soft:#666;--line:#ddd;--good:#00734f;--open:#8a610a;--bad:#b34700}
*{box-sizing:border-box}
body{font:14px/1.45 system-ui,sans-serif;color:var(--ink);max-width:1000px;margin:0 auto;
padding:24px;overflow-wrap:anywhere}
h1{font-size:22px;margin:0}h2{font-size:14px;margin:0 0 8px}p{margin:6px 0}ul{padding-left:20px}
header{border-bottom:2px solid var(--ink);padding-bottom:10px;margin-bottom:18px}
.pill{display:inline-block;padding:1px 10px;border-radius:10px;color:#fff;font-weight:600;
font-size:13px;vertical-align:3px;margin-left:8px;white-space:nowrap}
.pass{background:var(--good)}.not-checked{background:var(--open)}.fail{background:var(--bad)}
.lead{font-size:16px}.soft{color:var(--soft)}.lines{white-space:pre-line}
.faults{color:var(--bad);font-weight:600}.unchecked{color:var(--open)}
.two{display:grid;grid-template-columns:1fr 1fr;gap:26px;margin-bottom:24px}section{min-width:0}
.table{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}
td,th{padding:3px 6px;text-align:right;border-bottom:1px solid var(--line);overflow-wrap:normal}
td:first-child,th:first-child{text-align:left;padding-left:0}th{color:var(--soft)}
tr.main td{font-weight:700}tr.part td:first-child{padding-left:14px;color:var(--soft)}
svg{display:block;width:100%;height:auto}
details{border-top:1px solid var(--line);padding:8px 0}summary{cursor:pointer;font-weight:600}
pre{overflow:auto;font-size:12px}
@media(max-width:760px){.two{grid-template-columns:minmax(0,1fr)}body{padding:14px}}
@media(max-width:480px){table{font-size:12px}td,th{padding:3px 4px}}
@media print{body{padding:0;font-size:11px}section,details{break-inside:avoid}}
"""
_NAMESPACE: Final = re.compile(r' xmlns(:\w+)?="[^"]*"')  # which HTML knows without a name
_REFERENCE: Final = re.compile(r'(\bid="|\burl\(#|\bhref="#)')
_NO_METADATA: Final = dict.fromkeys(("Creator", "Date", "Format", "Type"))
_SOURCE: Final = 'cdsm.Manipulator.read("ARM.toml")'
_CURVE_LEVELS: Final = 60
_REACH: Final = 8.0  # the curve goes on to at most this multiple of the least tension here
_BEYOND: Final = 1.25  # and to at least this one


def draw_report(
    report: Report, about: str = "", direction: Direction | None = None, source: str = ""
) -> str:
    """Return the page of a report; see :meth:`~cdsm.stiffness_matrix.Report.to_html`."""
    K = report.stiffness
    arm = K.posture.arm
    u = _softest_axis(K) if direction is None else unit_direction("direction", direction)
    tension = K.distribution
    name = _escape(arm.name)
    faults = _list(report.faults, "faults") + _list(report.unchecked, "unchecked")
    pill = f'<span class="pill {_kind(report)}">{report.outcome}</span>'
    warnings = [words for words in K.warnings if words not in " ".join(report.faults)]
    remarks = _list([*warnings, *prints.notes(K), *report.notes])
    sections = [
        _section("The arm", _picture(K)),
        _section("Tip stiffness", _readings(K) + remarks),
        _section("How hard do the motors pull?", _tensions(K)),
    ]
    if u is not None:
        along = style.direction_name(u)
        if K.is_stable:
            sections.append(_section(f"Which cables make it stiff along {along}?", _shares(K, u)))
        if tension is not None and tension.least:
            question = f"Does more tension make it stiffer along {along}?"
            sections.append(_section(question, _curve(K, tension, u)))
        if tension is not None and K.is_stable:
            sections += _uncertainty(tension, u)
    lines = _paragraph(about, "soft lines") if about else _paragraph(_place(K), "soft")
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{_POLICY}">
<title>{name}: stiffness</title><style>{_LOOK}</style></head><body>
<header><h1>{name}: how stiff is it here? {pill}</h1>
{_paragraph(_sentence(report), "lead")}{faults}{lines}</header>
<div class="two">{"".join(sections)}</div>
{_folded(_count(report), "".join(_table(*rows) for rows in tables(report)))}
{_folded("Compliance of the tip", _compliance(K))}
{_folded("The same in Python", f"<pre>{_escape(_python(K, source))}</pre>")}
{_paragraph(report.model, "soft lines")}
</body></html>
"""


def _kind(report: Report) -> str:
    """Return the class of the style of an outcome."""
    return report.outcome.lower().replace(" ", "-")


def _sentence(report: Report) -> str:
    """Return the one sentence of a report: how soft the tip is, or why not to ask."""
    K = report.stiffness
    verdict = f"{report.judgement[0].upper()}{report.judgement[1:]}"
    if report.faults:
        return verdict
    axes, moves, _ = np.linalg.svd(K.compliance[:3, :3])
    pull = f"cables pull {span(K.tension, '{:.3g}'.format)} N"
    if moves[0] == 0.0:
        return f"{verdict} No force moves the tip; {pull}."
    unit, size = display_for("N/m", 1.0 / moves[0])
    direction = prints.axis_of(axes[:, 0])
    softest = f"{1.0 / (moves[0] * size):.3g} {unit} along {direction}"
    return f"{verdict} The tip is softest with {softest}; {pull}."


def _count(report: Report) -> str:
    """Return how many comparisons agree."""
    verdicts = [comparison.verdict for comparison in report.comparisons]
    return f"Checks: {verdicts.count('agrees')} of {len(verdicts)} comparisons agree"


def _place(K: Stiffness) -> str:
    """Return what the arm is, and where it stands."""
    pose = K.posture
    joints = ", ".join(map(place, without_rounding(pose.q).tolist(), pose.arm.joint_units))
    return f"{pose.arm}; at {joints}; tip at {coordinates(MM * pose.tip[:3, 3])} mm"


def _softest_axis(K: Stiffness) -> Array | None:
    """Return the axis, of the softer side, along which the tip is softest; None if it is fixed.

    An unstable arm has no softest axis, and gets z.
    """
    if not K.is_stable:
        return np.array([0.0, 0.0, 1.0])
    readings: list[tuple[float, Array]] = []
    for u in (*np.eye(3), *-np.eye(3)):
        try:
            readings.append((K.along(u), u))
        except SingularStiffness:
            continue
    stiffness, softest = min(readings, key=lambda reading: reading[0], default=(np.inf, None))
    return softest if np.isfinite(stiffness) else None


def _picture(K: Stiffness) -> str:
    """Return the picture of the arm, and its load in words."""
    words = f"{K.posture.arm.name}, its cables coloured by tension"
    picture = _svg(
        lambda: plot_arm(K.posture, K.tension, K, warnings=False, title=""), "arm", words
    )
    W = K.tip_wrench  # loads on links are among the notes
    if not W.any():
        return picture
    force = f"force {coordinates(W[:3])} N"
    moment = f", moment {coordinates(W[3:])} N m" if W[3:].any() else ""
    return picture + _paragraph(f"load at the tip: {force}{moment}", "soft")


def _readings(K: Stiffness) -> str:
    """Return the table of readings, and of their terms."""
    head, along, *rows = prints.table_rows(K)
    marks = ["main", *("part" if row[0].startswith(" ") else "" for row in rows)]
    return _table(head, along, *rows, marks=marks)


def _tensions(K: Stiffness) -> str:
    """Return a picture of distributed tensions with their bounds, or else a table."""
    if (tension := K.distribution) is not None:
        return _svg(lambda: plot_tensions(tension, title=""), "tensions", "tension of each cable")
    cables = zip(K.posture.arm.cables.names, K.tension, strict=True)
    return _table(("cable", "tension [N]"), *((name, f"{F:.4g}") for name, F in cables))


def _shares(K: Stiffness, u: Array) -> str:
    words = "share of each cable in the stiffness"
    return _svg(lambda: plot_shares(K.shares(u), title=""), "shares", words)


def _curve(K: Stiffness, tension: Tension, u: Array) -> str:
    words = "stiffness and its terms over the least tension"
    return _svg(lambda: draw_curve(K, tension, u), "curve", words)


def draw_curve(K: Stiffness, tension: Tension, u: Array) -> Axes:
    """Plot the stiffness over the least tension, with a mark where this one is, if stable."""
    here = float(tension.minimum_held.min())
    saturated = saturation(K.posture, u, maximum=tension.maximum, wrench=K.applied)
    low = float(saturated.minimum[0])
    high = min(float(saturated.minimum[-1]), _REACH * here or 2.0 * saturated.bound)
    high = max(high, _BEYOND * here)  # also where the arm no longer holds
    high = min(high, float(tension.maximum_held.min()))
    levels = None
    if high > low:  # with one at the mark, which may be the last that holds
        levels = np.append(here, np.geomspace(max(low, 1e-9 * high), high, _CURVE_LEVELS))
    panel = plot_stiffness_over_tension(saturated, levels, title="")
    size = 1.0 if panel.get_ylabel().endswith("[N/m]") else 1.0 / N_PER_MM  # of a soft arm
    return _mark(panel, here, K.along(u) / size) if K.is_stable else panel


@style.styled
def _mark(panel: Axes, x: float, y: float) -> Axes:
    """Mark the stiffness of the report in a curve."""
    look: dict[str, Any] = {"color": style.VERMILLION, "ms": 5, "zorder": 5, "gid": "here"}
    panel.plot(x, y, "o", clip_on=False, **look)
    look = {"color": style.DARK[style.VERMILLION], "fontsize": 7, "zorder": 5}
    panel.annotate("here", (x, y), xytext=(7, -7), textcoords="offset points", **look)
    return panel


def _uncertainty(tension: Tension, u: Array) -> Iterator[str]:
    """Yield the section on the uncertainty, if the arm has tolerances."""
    pose = tension.posture
    tolerances = known_tolerances(pose.arm)
    if not tolerances.given:
        return
    title = "How sure is it?"
    try:
        budget = uncertainty(pose, tension, tolerances, direction=u)
    except CdsmError as error:
        yield _section(title, _paragraph(str(error)))
        return
    unit, size = budget.measurand.unit
    low, high = (end / size for end in budget.interval())
    words = f"{budget.name}: {budget.shown} {unit} (one standard uncertainty). "
    words += f"95 % of such arms: {low:.4g} to {high:.4g} {unit}."
    described = "contribution of each tolerance"
    picture = _svg(lambda: plot_uncertainty(budget, title=""), "uncertainty", described)
    yield _section(title, _paragraph(words) + _list(budget.warnings, "unchecked") + picture)


def _compliance(K: Stiffness) -> str:
    """Return the table of the translational compliance of the tip."""
    if not K.is_stable:
        return _paragraph("An unstable arm has no compliance.")
    rows = zip("xyz", K.compliance[:3, :3], strict=True)
    cells = [(f"moves {name}", *(f"{MM * c:.4g}" for c in row)) for name, row in rows]
    return _table(("[mm/N], base axes", "force x", "force y", "force z"), *cells)


def _python(K: Stiffness, source: str) -> str:
    """Return lines of Python that compute the stiffness again, of the arm that ``source`` gives."""
    pose = K.posture
    wrench = f", wrench={K.tip_wrench.tolist()}" if K.tip_wrench.any() else ""
    loads = ""
    if on_links := as_loads(K.applied).on_links:
        each = [(load.at.link, load.wrench, load.at.local) for load in on_links]
        each += [(pose.arm.tip_link, K.tip_wrench, np.zeros(3))] * bool(K.tip_wrench.any())
        lines = ",\n".join(f"    {_load(*load)}" for load in each)
        loads = f"loads = [\n{lines},\n]\n"
        wrench = ", wrench=loads"
    pull = f"{K.tension.tolist()}{wrench}"
    if (tension := K.distribution) is not None and tension.least:
        low = _bound(tension.minimum)
        high = f", maximum={_bound(tension.maximum)}" if np.isfinite(tension.maximum).any() else ""
        high = high.replace("inf", "float('inf')")
        pull = f"cdsm.distribute_tension(pose, minimum={low}{high}{wrench})"
    return (
        "import cdsm\n\n"
        f"arm = {source or _SOURCE}\n"
        f"pose = arm.at({pose.q.tolist()})\n{loads}"
        f"K = cdsm.stiffness(pose, {pull})\n"
        'K.report().write("REPORT.html")'
    )


def _load(link: str, wrench: Array, point: Array) -> str:
    """Return a load on a link as Python."""
    force, moment, place = (tuple(row) for row in np.array([*np.split(wrench, 2), point]).tolist())
    turned = f", moment={moment}" if any(moment) else ""
    return f"cdsm.Load({link!r}, force={force}{turned}, point={place})"


def _bound(bound: Array) -> str:
    """Return a bound of tensions as Python: one number if it is the same for all cables."""
    values = np.atleast_1d(bound).tolist()
    return repr(values[0] if len(set(values)) == 1 else values)


def _svg(draw: Callable[[], Axes], prefix: str, words: str) -> str:
    """Return a picture, described in ``words``, as inline SVG, or else why it does not exist.

    The names of its parts begin with ``prefix``, so that they are unique in a page.
    """
    try:
        panel = draw()
    except CdsmError as error:
        return _paragraph(str(error), "soft")
    file = io.StringIO()
    with rc_context({"svg.hashsalt": prefix}):  # equal pages for equal reports
        style.figure_of(panel).savefig(file, format="svg", metadata=_NO_METADATA)
    text = file.getvalue()
    picture = _NAMESPACE.sub("", text[text.index("<svg") :])
    picture = _REFERENCE.sub(rf"\g<1>{prefix}-", picture)
    return picture.replace("<svg", f'<svg role="img" aria-label="{_escape(words)}"', 1)


def _table(head: Sequence[str], *rows: Sequence[str], marks: Iterable[str] = ()) -> str:
    """Return a table; ``marks`` are classes of its first rows."""
    titles = "".join(f"<th>{_escape(title)}</th>" for title in head)
    classes = [*marks]
    classes += [""] * (len(rows) - len(classes))
    lines = [
        f'<tr class="{mark}">{"".join(f"<td>{_escape(cell)}</td>" for cell in row)}</tr>'
        for row, mark in zip(rows, classes, strict=True)
    ]
    return f'<div class="table"><table><tr>{titles}</tr>{"".join(lines)}</table></div>'


def _section(title: str, content: str) -> str:
    return f"<section><h2>{_escape(title)}</h2>{content}</section>"


def _folded(title: str, content: str) -> str:
    return f"<details><summary>{_escape(title)}</summary>{content}</details>"


def _list(sentences: Iterable[str], kind: str = "soft") -> str:
    entries = "".join(f"<li>{_escape(sentence)}</li>" for sentence in sentences)
    return f'<ul class="{kind}">{entries}</ul>' if entries else ""


def _paragraph(text: str, kind: str = "") -> str:
    return f'<p class="{kind}">{_escape(text)}</p>'


def _escape(text: str) -> str:
    return html.escape(text)
