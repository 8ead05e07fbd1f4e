"""HTML elements whose text is escaped."""

from __future__ import annotations

import html
from collections.abc import Iterable


class Markup(str):
    """HTML that :func:`element` made: it is not escaped again."""

    __slots__ = ()


def element(name: str, *contents: str, **attributes: str) -> Markup:
    """An HTML element; contents are escaped unless they are elements themselves.

    An underscore in the name of an attribute stands for a hyphen, one at its end for nothing.
    """
    given = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{html.escape(value)}"'
        for key, value in attributes.items()
    )
    inner = "".join(each if isinstance(each, Markup) else html.escape(each) for each in contents)
    return Markup(f"<{name}{given}>{inner}</{name}>")


def row(tag: str, cells: Iterable[str]) -> Markup:
    """A row of a table, its cells ``th`` or ``td``."""
    return element("tr", *(element(tag, cell) for cell in cells))
