"""What docstrings say of attributes and arguments, for files and tables that explain them."""

from __future__ import annotations

import inspect
import re


def attributes_of(documented: object) -> dict[str, str]:
    """Return the texts of the section ``Attributes`` or ``Args`` of a docstring, by name."""
    text = inspect.getdoc(documented) or ""
    section = re.search(r"(?m)^(?:Attributes|Args):\n((?:    .*\n|\n)+)", f"{text}\n")
    entries = re.split(r"(?m)^    (?=\w+: )", section.group(1)) if section else []
    pairs = (entry.split(": ", 1) for entry in entries if entry.strip())
    return {name: " ".join(meaning.split()) for name, meaning in pairs}


def in_plain_text(text: str) -> str:
    """Return a text of a docstring without its markup."""
    return re.sub(r":\w+:`~?(?:\w+\.)*([^`.]*)`", r"\1", text).replace("`", "")
