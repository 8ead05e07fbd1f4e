"""Write a report, section by section, as text and as HTML."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from cdsm.report.facts import RANK
from cdsm.report.self_check import Agreement, Difference
from cdsm.support.format import MODEL, aligned, coordinates
from cdsm.support.markup import element, row

if TYPE_CHECKING:
    from cdsm.report.report import Report


_WIDTH = 100
_LISTED = 4  # number of joints that a report lists

_STYLE = """
body{font:15px/1.45 system-ui,sans-serif;max-width:62em;margin:2em auto;padding:0 1em;color:#1b1b1b}
h1{font-size:1.5em}h2{font-size:1.1em;margin:1.6em 0 .4em}
table{border-collapse:collapse;font-size:.93em}
th,td{padding:.2em .8em;text-align:right;border-bottom:1px solid #ddd;
font-variant-numeric:tabular-nums}
th:first-child,td:first-child{text-align:left}
td{white-space:nowrap}.wide{overflow-x:auto}
.good,.bad{padding:.6em 1em;border-left:.4em solid;font-weight:600}
.good{background:#e9f5ec;border-color:#2a7d46}.bad{background:#fbeaea;border-color:#b3261e}
li.fault{color:#b3261e}
""".strip()


Section = tuple[str, Sequence[tuple[str, ...]], Sequence[str]]
"""Heading, rows of a table, and sentences. Row 0 has the titles of columns, column 0 names."""


def to_text(report: Report) -> str:
    """Return the report as wrapped text with aligned columns."""
    lines = [_title(report), _verdict(report)]
    lines += [_wrapped(remark, "! ") for remark in report.faults]
    lines += [_wrapped(remark, "- ") for remark in report.notes]
    for title, rows, sentences in _sections(report):
        lines += ["", title, *(f"  {line}" for line in aligned(rows))]
        lines += [_wrapped(sentence, "  ") for sentence in sentences]
    return "\n".join(lines)


def _wrapped(text: str, first: str) -> str:
    return textwrap.fill(text, _WIDTH, initial_indent=first, subsequent_indent="  ")


def to_fragment(report: Report, about: str = "") -> str:
    """Return the report as an HTML element to include in a page.

    ``about`` is text below the title, such as the file of the arm.
    """
    parts = [
        element("h1", _title(report)),
        *(element("p", line) for line in about.splitlines()),
        element("p", _verdict(report), class_="good" if report.trustworthy else "bad"),
    ]
    remarks = [element("li", remark, class_="fault") for remark in report.faults]
    remarks += [element("li", remark) for remark in report.notes]
    if remarks:
        parts.append(element("ul", *remarks))
    for title, rows, sentences in _sections(report):
        parts.append(element("h2", title))
        if rows:
            head, *body = rows
            table = element("table", row("th", head), *(row("td", cells) for cells in body))
            parts.append(element("div", table, class_="wide"))
        parts += [element("p", sentence) for sentence in sentences]
    return str(element("section", *parts))


def to_document(report: Report, about: str = "") -> str:
    """Return the report as a self-contained HTML file; ``about`` is text below the title."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"{element('title', _title(report))}\n<style>\n{_STYLE}\n</style>\n</head>\n"
        f"<body>\n{to_fragment(report, about)}\n</body>\n</html>\n"
    )


def _title(report: Report) -> str:
    return f"Truth report: stiffness of {report.stiffness.posture.arm.name}"


def _verdict(report: Report) -> str:
    if report.trustworthy:
        return "Trustworthy: derived a second time with the same result, in balance, and stable."
    return "NOT to be trusted as it stands, for the reasons that follow."


def _sections(report: Report) -> list[Section]:
    makers = (_readings, _self_check, _statics, _stability, _cables, _ranks, _conventions)
    return [make(report) for make in makers]


def _readings(report: Report) -> Section:
    rows: list[tuple[str, ...]] = [("", "x", "y", "z")]
    if report.readings is not None:
        for name in ("along", "cartesian", "pseudoinverse"):
            values = getattr(report.readings, name)
            rows.append((name, *(_number(value / 1000.0) for value in values)))
    return "Stiffness at the tip [N/mm]", rows, ()


def _self_check(report: Report) -> Section:
    rows = [("", "largest entry", "off, by potential", "off, by torque", "verdict")]
    rows += [
        (
            "sum, K_θ" if each.name == "joint" else each.name,
            f"{each.largest:.4g} {each.unit}",
            _deviation(each.potential, each),
            _deviation(each.torque, each),
            each.verdict,
        )
        for each in report.self_check.compared
    ]
    sentence = (
        "Potential: second differences of the cables' energy, the weight and the load's work. "
        "Torque: first differences of the torque out of balance. Off by parts of the largest "
        "entry; in brackets what truncation and rounding of the differences may come to. The "
        "last rows: torque out of balance by first differences of the potential, lengths "
        "between sites where Pinocchio places the links."
    )
    title = "Self-check: each term derived anew by central differences at this posture"
    return title, rows, [sentence]


def _statics(report: Report) -> Section:
    rows = [
        ("", "found"),
        ("largest residual of the statics (Eq. 13)", f"{report.residual:.2g} N m"),
        ("that over the torques it is a sum of", f"{report.imbalance:.1e}"),
    ]
    found = report.optimality
    if found is None:
        return "Tensions", rows, ["Not distributed: no optimality is claimed."]
    rows += [
        ("solver", found.solver),
        ("violation of balance and bounds", f"{found.feasibility:.1e}"),
    ]
    title = "Tensions, chosen for a stiffness within their bounds"
    if found.stationarity is not None:
        rows.append(("KKT residual, multipliers found anew", f"{found.stationarity:.1e}"))
        title = "Tensions, the least that balance the arm (Eq. 17)"
    lines = [
        f"At their {which} bound: {', '.join(names) or 'none'}."
        for which, names in (("lower", found.at_minimum), ("upper", found.at_maximum))
    ]
    return title, rows, lines


def _stability(report: Report) -> Section:
    K = report.stiffness
    names = K.posture.arm.joint_names
    motion = report.critical_direction
    order = np.argsort(-abs(motion), kind="stable")[:_LISTED]
    head = "softest joint motion"
    if len(names) > _LISTED:
        head += f", most of {len(names)} joints"
    rows = [(head, "share"), *((names[i], f"{motion[i]:+.3f}") for i in order)]
    state = "stable" if K.is_stable else "UNSTABLE"
    sentence = (
        f"Smallest eigenvalue of the symmetric part of K_θ: {K.margin:.4g} "
        f"{K.posture.arm.stiffness_unit()}, {state}. Condition of K_θ: {report.condition:.3g}."
    )
    return "Stability", rows, [sentence]


def _cables(report: Report) -> Section:
    rows = [("", "F [N]", "EA tangent [N]", "EA secant [N]", "law [N]", "down", "up", "k [N/mm]")]
    for each in report.cables:
        F = each.tension
        force = each.control == "force"
        rows.append(
            (
                each.name,
                f"{F:.4g}" + (" held" if force else " slack" if each.is_slack else ""),
                _number(each.tangent),
                _number(each.secant),
                f"{each.low:g} to {each.high:g}",
                "-" if force else _share(each.below, F),
                "-" if force else _share(each.above, F),
                f"{each.stiffness / 1000.0:.4g}",
            )
        )
    sentence = (
        "down, up: how far F may go before its law ends, in N and as a part of F. held: the "
        "motor holds the force, and the cable gives no passive stiffness."
    )
    return "Cables", rows, [sentence]


def _ranks(report: Report) -> Section:
    rows, ratio = [("", "rank", "of", "condition")], report.closure
    for name, rank in (
        ("J_X, motion of the tip", report.jacobian_rank),
        ("its linear rows", report.translation_rank),
        ("J_Lᵀ, torque of the cables", report.cable_rank),
    ):
        rows.append((name, str(rank.rank), str(rank.full), _number(rank.condition)))
    sentences = [
        f"Singular values below {RANK:g} of the largest count as zero; lengths in arm lengths.",
        "Whether all tensions can grow without a torque is not known: HiGHS failed."
        if math.isnan(ratio)
        else f"Tensions can grow without a torque, the least by {ratio:.3g} of the largest."
        if ratio > 0.0
        else "Tensions cannot all grow without a torque.",
    ]
    return "Rank and condition", rows, sentences


def _conventions(report: Report) -> Section:
    K = report.stiffness
    arm = K.posture.arm
    along = " x along the straight arm," if arm.is_serpentine else ""
    angles = zip(arm.joint_names, K.posture.q, arm.joint_units, strict=True)
    posture = ", ".join(f"{name} {q:.6g} {unit}" for name, q, unit in angles)
    lever = (
        f" A joint that slides counts with the arm's length, {arm.length:.4g} m, as lever in the "
        "residual, the self-check, ranks and conditions, but not in the smallest eigenvalue."
        if arm.slides.any()
        else ""
    )
    where = "here" if K.free_length is None else "at the reference of the equilibrium"
    gravity, wrench = coordinates(arm.gravity, "g"), coordinates(K.wrench, "g")
    sentences = [
        "SI but where a heading says otherwise: m, rad, N. All at the tip in base axes:"
        f"{along} tip is the frame of {arm.tip_link}. Gravity {gravity} m/s².",
        "F is tension, never negative; the cables' torque is −J_Lᵀ F. The wrench W acts on the "
        f"tip and is dead, constant in base axes: {wrench}, force [N], then moment [N m]. "
        f"K_θ = ∂(J_Lᵀ F + g − J_Xᵀ W)/∂θ: rows torque, columns angle, positive holds.{lever}",
        f"Posture: {posture}.",
        f"The stiffness is {MODEL}. Position-controlled cables keep the original length l_0 of "
        f"their wire, locked {where}; force-controlled ones their tension.",
    ]
    return "Units, frame and signs", (), sentences


def _deviation(difference: Difference | None, of: Agreement) -> str:
    if difference is None:
        return "-"
    if of.largest == 0.0:
        return f"{difference.found:.1e} {of.unit}"
    return f"{difference.found / of.largest:.1e} ({difference.expected / of.largest:.0e})"


def _share(room: float, F: float) -> str:
    if math.isinf(room):
        return "any"
    return f"{room:.4g}" + (f" ({100.0 * room / F:.3g} %)" if room < 10.0 * F else "")


def _number(value: float | None) -> str:
    return "-" if value is None or math.isnan(value) else f"{value:.4g}"
