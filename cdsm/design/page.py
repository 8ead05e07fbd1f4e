"""HTML page of a search: a plot of the front; a click on a design shows its arm and its numbers."""

from __future__ import annotations

import base64
import io
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from cdsm.plots.arm import draw_arm, frame_arms
from cdsm.plots.designs import plot_designs
from cdsm.plots.style import fill_canvas, picture_axes
from cdsm.support.markup import Document, Markup, element

if TYPE_CHECKING:
    from cdsm.design.result import DesignSearch

_DPI = 110  # resolution of the pictures [1/inch]: some 50 kB each

_SHOWN = 60
"""Largest number of designs on a page, evenly spread over the front; each has a picture."""

_STYLE = """
body{font:14px/1.4 system-ui,sans-serif;margin:1em;color:#1b1b1b}
.side{display:flex;flex-wrap:wrap;align-items:center;gap:1em}
.front svg{width:34em;max-width:100%;height:auto}
.arm{display:none;margin:0;width:28em}.arm.chosen{display:block}.arm img{width:100%}
table{border-collapse:collapse;font-size:.93em;font-variant-numeric:tabular-nums}
th,td{padding:.2em .8em;text-align:right;border-bottom:1px solid #ddd;white-space:nowrap}
.wide{overflow-x:auto}td:first-child,th:first-child{text-align:left}
tr[data-design],g[id^=design-]{cursor:pointer}
tr.chosen{background:#fbe3d4}g.chosen use{stroke:#d55e00!important;stroke-width:6}
""".strip()

_SCRIPT = """
const parts = [...document.querySelectorAll('[data-design],g[id^=design-]')];
const number = part => part.dataset.design ?? part.id.split('-')[1];
const choose = n => parts.forEach(part => part.classList.toggle('chosen', number(part) === n));
parts.forEach(part => part.addEventListener('click', () => choose(number(part))));
choose(document.body.dataset.compromise);
""".strip()


def page_of(found: DesignSearch) -> Document:
    """Return the HTML page of a search; it needs no other file and no network."""
    arms, count = [], len(found.front)
    shown = found._spread(_SHOWN)
    for i, picture in zip(shown, _pictures(found, shown), strict=True):
        image = element("img", src=picture, alt=f"arm of design {i}")
        name = element("figcaption", f"design {i} at the first posture")
        arms.append(element("figure", image, name, class_="arm", data_design=str(i)))
    head, *rows = found._table(shown)
    lines = [element("tr", *(element("th", cell) for cell in head))]
    lines += [
        element("tr", *(element("td", cell) for cell in row), data_design=str(i))
        for i, row in zip(shown, rows, strict=True)
    ]
    best = f"{len(shown)} of {count}" if len(shown) < count else f"{count}"
    title = f"{best} best of {len(found.evaluated)} designs of {found.problem.arm.name}"
    front = element("div", _svg(plot_designs(found, shown)), class_="front")
    body = element(
        "body",
        element("p", f"{title}. Click a point or a row; all arms are drawn to one scale."),
        element("div", front, *arms, class_="side"),
        element("div", element("table", *lines), class_="wide"),
        element("script", Markup(_SCRIPT)),
        data_compromise=str(found.compromise),
    )
    top = element("head", Markup('<meta charset="utf-8">'), element("title", title))
    style = element("style", Markup(_STYLE))
    return Document(f"<!DOCTYPE html>\n{element('html', top, style, body, lang='en')}\n")


def _pictures(found: DesignSearch, shown: list[int]) -> list[str]:
    """Draw the arms of the designs ``shown`` of the front; return PNG pictures as data URLs.

    Each arm is drawn at the first posture, all to one scale.
    """
    poses = []
    for number in shown:
        arm = found.arm(number)
        poses.append(arm.at(found.problem.postures_of(arm)[0], check_limits=False))
    figure, axes = picture_axes()
    for pose in poses:
        draw_arm(axes, pose)
    limits = np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()])
    pictures: list[str] = []
    for pose in poses:
        axes.clear()
        draw_arm(axes, pose)
        frame_arms(axes, limits)
        if not pictures:
            fill_canvas(axes)
        out = io.BytesIO()
        figure.savefig(out, format="png", dpi=_DPI, metadata={"Software": None})
        pictures.append("data:image/png;base64," + base64.b64encode(out.getvalue()).decode())
    return pictures


def _svg(figure: Figure) -> Markup:
    out = io.StringIO()
    with rc_context({"svg.hashsalt": "cdsm"}):
        figure.savefig(out, format="svg", metadata={"Date": None})
    text = out.getvalue()
    return Markup(text[text.index("<svg") :])
