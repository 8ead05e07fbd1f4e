"""Read untrusted XML strictly: no recovery, no expansion of entities, no network access."""

from __future__ import annotations

import math
import re

from lxml import etree

from cdsm.support.files import MAXIMUM_BYTES
from cdsm.support.validation import LARGEST

DEEPEST = 100
"""Maximum depth of nested elements; descriptions of robots are less deep."""

_LONGEST = 10_000  # maximum number of characters of an attribute or of the text of an element

_WIDEST = 100_000
"""Maximum number of characters of a comment, or of a tag with the text behind it.

libxml2 compares the attributes of an element in pairs, which takes long for many attributes.
"""

_SHOWN = 160  # maximum number of characters of a text that a fault shows


class XmlFault(ValueError):
    """Fault of an XML document; callers raise the error of their file format instead."""


def parse_xml(text: str, root: str, doctype: str | None = None) -> etree._Element:
    """Parse an XML text and return its root element, which must have the name ``root``.

    A DOCTYPE is allowed only if it just names a DTD that matches the pattern ``doctype``; the DTD
    is not read. Other DOCTYPEs could define entities or name files to read.
    Raises XmlFault if the text is not well-formed, too large or too deep, or has another root.
    """
    if len(text) > MAXIMUM_BYTES:
        raise XmlFault(f"is larger than the {MAXIMUM_BYTES} characters that are read")
    widest = max(map(len, text.split("<")))
    if widest > _WIDEST:
        raise XmlFault(
            f"holds a tag, text or comment of {widest} characters; {_WIDEST} are read at most"
        )
    parser = etree.XMLParser(
        encoding="utf-8",
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        recover=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        # these bytes are UTF-8, even if the XML declaration names another encoding
        document = etree.fromstring(text.encode(), parser).getroottree()
    except (etree.XMLSyntaxError, ValueError) as error:
        raise XmlFault(f"is not well-formed XML: {_short(str(error))}") from None
    if document.docinfo.internalDTD is not None and not (doctype and _names_dtd(text, doctype)):
        raise XmlFault("has a DOCTYPE, which could define entities or name files; remove it")
    top = document.getroot()
    if top.tag != root:
        raise XmlFault(f"has the root element <{_short(str(top.tag))}>; <{root}> is needed")
    level, depth = [top], 0
    while level:
        depth += 1
        if depth > DEEPEST:
            raise XmlFault(f"nests elements deeper than {DEEPEST} levels")
        for element in level:
            for value in (element.text or "", *element.attrib.values()):
                if len(value) > _LONGEST:
                    raise XmlFault(
                        f"holds a text of {len(value)} characters in <{_short(str(element.tag))}>, "
                        f"from line {element.sourceline}; {_LONGEST} are read at most"
                    )
        level = [child for element in level for child in element]
    return top


def _names_dtd(text: str, system: str) -> bool:
    """Return whether the only DOCTYPE of a text just names a DTD of the pattern ``system``."""
    literal = rf"""(?:"{system}"|'{system}')"""
    alone = rf"""<!DOCTYPE\s+[^\s"'<>\[]+\s+(?:SYSTEM|PUBLIC\s+(?:""|''))\s+{literal}\s*>"""
    return text.count("<!DOCTYPE") == 1 and re.search(alone, text) is not None


def numbers(where: str, text: str | None, count: int) -> tuple[float, ...]:
    """Return the ``count`` finite numbers in a text; else raise XmlFault, which names ``where``."""
    words = (text or "").split()
    try:
        values = tuple(float(word) for word in words if "_" not in word)
    except ValueError:
        values = ()
    if len(values) != count or len(words) != count:
        wanted = "a number is" if count == 1 else f"{count} numbers are"
        raise XmlFault(f"{where}: {_short(text or '')!r} given; {wanted} needed")
    if not all(math.isfinite(value) and abs(value) <= LARGEST for value in values):
        raise XmlFault(f"{where}: {_short(text or '')!r} given; it must be finite")
    return values


def _short(text: str) -> str:
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}…"
