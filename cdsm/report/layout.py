"""A report as tables under headings: as text, and as HTML."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import NamedTuple

from cdsm.support.markup import element, row

_WIDTH = 100

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


class Section(NamedTuple):
    """A heading, a table, and lines below it.

    Attributes:
        title: The heading.
        rows: Of equally many cells; the first row is the head, the first column the names.
        lines: Sentences.
    """

    title: str
    rows: Sequence[tuple[str, ...]] = ()
    lines: Sequence[str] = ()


class Page(NamedTuple):
    """What a report shows.

    Attributes:
        title: The heading.
        verdict: In one sentence.
        good: Whether it is a good one.
        faults: Why not.
        notes: What else is to be known.
        sections: The details.
    """

    title: str
    verdict: str
    good: bool
    faults: Sequence[str]
    notes: Sequence[str]
    sections: Sequence[Section]


def to_text(page: Page) -> str:
    """The page in columns, wrapped."""
    lines = [page.title, page.verdict]
    for mark, remarks in (("!", page.faults), ("-", page.notes)):
        lines += [_wrapped(remark, f"{mark} ", "  ") for remark in remarks]
    for section in page.sections:
        lines += ["", section.title]
        widths = [max(map(len, column)) for column in zip(*section.rows, strict=True)]
        for name, *cells in section.rows:
            padded = (cell.rjust(width + 2) for cell, width in zip(cells, widths[1:], strict=True))
            lines.append(f"  {name.ljust(widths[0])}{''.join(padded)}".rstrip())
        lines += [_wrapped(line, "  ", "  ") for line in section.lines]
    return "\n".join(lines)


def to_fragment(page: Page) -> str:
    """The page as HTML to be put into another."""
    parts = [element("p", page.verdict, class_="good" if page.good else "bad")]
    remarks = [element("li", remark, class_="fault") for remark in page.faults]
    remarks += [element("li", remark) for remark in page.notes]
    if remarks:
        parts.append(element("ul", *remarks))
    for section in page.sections:
        parts.append(element("h2", section.title))
        if section.rows:
            head, *body = section.rows
            table = element("table", row("th", head), *(row("td", cells) for cells in body))
            parts.append(element("div", table, class_="wide"))
        parts += [element("p", line) for line in section.lines]
    return str(element("section", element("h1", page.title), *parts))


def to_document(page: Page) -> str:
    """The page as an HTML file that needs no other."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"{element('title', page.title)}\n<style>\n{_STYLE}\n</style>\n</head>\n"
        f"<body>\n{to_fragment(page)}\n</body>\n</html>\n"
    )


def _wrapped(text: str, first: str, other: str) -> str:
    return textwrap.fill(text, _WIDTH, initial_indent=first, subsequent_indent=other)
