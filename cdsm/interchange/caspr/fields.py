"""What the readers of both files share: entries of their XML, and how faults are told."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cdsm.errors import FileError, counted
from cdsm.support.xml import XmlFault, numbers

if TYPE_CHECKING:
    from lxml import etree

TEMPLATE: Final = r"(\.\./)*templates/{}\.dtd"
"""What CASPR's files name as their DTD; it is not read."""

BASE: Final = "base"
"""Name of link 0."""


def text_of(element: etree._Element, name: str, path: str) -> str:
    """Text of the element at the path below that of the link of this name."""
    found = element.findtext(path)
    if found is None:
        raise XmlFault(f"{name}: has no <{path.replace('/', '> <')}>")
    return str(found)


def whole(where: str, text: str | None) -> int:
    """A whole number; ``where`` is for the error."""
    (value,) = numbers(where, text, 1)
    if value != int(value):
        raise XmlFault(f"{where}: {value:g} given; a whole number is needed")
    return int(value)


def refuse(path: Path, faults: Sequence[str]) -> None:
    """Raise a FileError of all faults, if there are any."""
    if faults:
        raise FileError(path, f"cannot be read as a CASPR model, {counted(faults, most=20)}")
