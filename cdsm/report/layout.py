"""A report as tables under headings: as text, and as HTML."""

from __future__ import annotations

import html
import textwrap
from collections.abc import Sequence
from typing import NamedTuple

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
    shown = "good" if page.good else "bad"
    parts = [f'<p class="{shown}">{html.escape(page.verdict)}</p>']
    remarks = [f'<li class="fault">{html.escape(each)}</li>' for each in page.faults]
    remarks += [f"<li>{html.escape(each)}</li>" for each in page.notes]
    if remarks:
        parts.append(f"<ul>{''.join(remarks)}</ul>")
    for section in page.sections:
        parts.append(f"<h2>{html.escape(section.title)}</h2>")
        if section.rows:
            head, *body = section.rows
            rows = [_row("th", head), *(_row("td", row) for row in body)]
            parts.append(f'<div class="wide"><table>{"".join(rows)}</table></div>')
        parts += [f"<p>{html.escape(line)}</p>" for line in section.lines]
    return f"<section><h1>{html.escape(page.title)}</h1>{''.join(parts)}</section>"


def to_document(page: Page) -> str:
    """The page as an HTML file that needs no other."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(page.title)}</title>\n<style>\n{_STYLE}\n</style>\n</head>\n"
        f"<body>\n{to_fragment(page)}\n</body>\n</html>\n"
    )


def _row(tag: str, cells: Sequence[str]) -> str:
    return f"<tr>{''.join(f'<{tag}>{html.escape(cell)}</{tag}>' for cell in cells)}</tr>"


def _wrapped(text: str, first: str, other: str) -> str:
    return textwrap.fill(text, _WIDTH, initial_indent=first, subsequent_indent=other)
