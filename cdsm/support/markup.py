"""Build HTML elements whose text is escaped."""

from __future__ import annotations

import html


class Markup(str):
    """HTML made by :func:`element`, which does not escape it again inside another element."""

    __slots__ = ()


def element(name: str, *contents: str, **attributes: str) -> Markup:
    """Build an HTML element; contents are escaped unless they are :class:`Markup`.

    In attribute names, underscores become hyphens; underscores at the end are removed.
    """
    given = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{html.escape(value)}"'
        for key, value in attributes.items()
    )
    inner = "".join(each if isinstance(each, Markup) else html.escape(each) for each in contents)
    return Markup(f"<{name}{given}>{inner}</{name}>")
