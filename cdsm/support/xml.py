"""Read XML strictly: no recovery, no expansion of entities, no network access."""

from __future__ import annotations

import math
import re

from lxml import etree

from cdsm.support.files import MAXIMUM_BYTES
from cdsm.support.validation import LARGEST


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
    parser = etree.XMLParser(
        encoding="utf-8",
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        recover=False,
        huge_tree=False,  # at most 256 levels
        remove_comments=True,
        remove_pis=True,
    )
    try:
        # these bytes are UTF-8, even if the XML declaration names another encoding
        document = etree.fromstring(text.encode(), parser).getroottree()
    except (etree.XMLSyntaxError, ValueError) as error:
        raise XmlFault(f"is not well-formed XML: {error!s:.160}") from None
    if document.docinfo.internalDTD is not None and not (doctype and _names_dtd(text, doctype)):
        raise XmlFault("has a DOCTYPE, which could define entities or name files; remove it")
    top = document.getroot()
    if top.tag != root:
        raise XmlFault(f"has the root element <{top.tag!s:.160}>; <{root}> is needed")
    return top


def _names_dtd(text: str, system: str) -> bool:
    """Return whether the only DOCTYPE of a text just names a DTD of the pattern ``system``."""
    literal = rf"""(?:"{system}"|'{system}')"""
    alone = rf"""<!DOCTYPE\s+[^\s"'<>\[]+\s+(?:SYSTEM|PUBLIC\s+(?:""|''))\s+{literal}\s*>"""
    return text.count("<!DOCTYPE") == 1 and re.search(alone, text) is not None


def numbers(where: str, text: str | None, count: int) -> tuple[float, ...]:
    """Return the ``count`` finite numbers in a text; else raise XmlFault, which names ``where``."""
    try:
        # other programs do not read the 1_000 of Python
        values = tuple(float(word.replace("_", "x")) for word in (text or "").split())
    except ValueError:
        values = ()
    if len(values) != count:
        wanted = "a number is" if count == 1 else f"{count} numbers are"
        raise XmlFault(f"{where}: {text or ''!r:.160} given; {wanted} needed")
    if not all(math.isfinite(value) and abs(value) <= LARGEST for value in values):
        raise XmlFault(f"{where}: {text!r:.160} given; it must be finite, to {LARGEST:g}")
    return values
