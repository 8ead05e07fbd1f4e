"""XML of strangers, read strictly: nothing recovered, nothing expanded, nothing fetched."""

from __future__ import annotations

import math
import re

from lxml import etree

from cdsm.support.files import MAXIMUM_BYTES
from cdsm.support.validation import LARGEST

DEEPEST = 100
"""No description of a robot nests its elements deeper."""

_LONGEST = 10_000
"""Characters of a name or number; none is longer."""

_WIDEST = 100_000
"""Characters of a tag with what follows it, or of a comment; libxml2 compares all attributes of an
element with each other."""

_SHOWN = 40


class XmlFault(ValueError):
    """What is wrong with a document; turned into an error of the format it should have had."""


def parse_xml(text: str, root: str, doctype: str | None = None) -> etree._Element:
    """The root element of an XML text.

    Args:
        text: The document.
        root: What its root element must be called.
        doctype: A DOCTYPE whose system identifier matches this pattern as a whole, with an empty
            public identifier or none, and with nothing inside, is let pass, unread; any other is
            refused, since it can define entities or name files to read.

    Raises:
        XmlFault: Not well-formed, too large or too deep, a DOCTYPE, or another root.
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
        # a declaration speaks of bytes, and these are UTF-8 whatever it says
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
    """Whether the one DOCTYPE of a text names such a DTD, and does nothing else."""
    literal = rf"""(?:"{system}"|'{system}')"""
    alone = rf"""<!DOCTYPE\s+[^\s"'<>\[]+\s+(?:SYSTEM|PUBLIC\s+(?:""|''))\s+{literal}\s*>"""
    return text.count("<!DOCTYPE") == 1 and re.search(alone, text) is not None


def numbers(where: str, text: str | None, count: int) -> tuple[float, ...]:
    """Finite numbers separated by white space.

    Raises:
        XmlFault: Says where, what is there and what is needed.
    """
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
    return text if len(text) <= 4 * _SHOWN else f"{text[: 4 * _SHOWN]}…"
