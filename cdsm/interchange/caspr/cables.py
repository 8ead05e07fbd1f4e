"""The cables of a CASPR model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdsm.cable import Cable, Site
from cdsm.elasticity import Elasticity
from cdsm.errors import CableError, FileError, UnknownName
from cdsm.interchange.caspr.bodies import Body
from cdsm.interchange.caspr.fields import BASE, TEMPLATE, refuse, whole
from cdsm.support.files import read_text
from cdsm.support.xml import XmlFault, numbers, parse_xml

if TYPE_CHECKING:
    from lxml import etree


def read_cables(
    path: Path, bodies: Sequence[Body], elasticity: Elasticity, wanted: str | None
) -> tuple[Cable, ...]:
    """The cables of the wanted set, or of the file's default.

    Raises:
        FileError: The file cannot be read, or holds what cannot be mapped; every fault is listed.
        UnknownName: There is no such set.
    """
    try:
        root = parse_xml(read_text(path), "cables", TEMPLATE.format("cables"))
    except XmlFault as error:
        raise FileError(path, f"{error}.") from None
    sets = {str(each.get("id")): each for each in root.findall("cable_set")}
    name = root.get("default_cable_set") if wanted is None else wanted
    if not isinstance(name, str) or name not in sets:
        raise UnknownName("set of cables", name, tuple(sets))
    faults: list[str] = []
    cables: list[Cable] = []
    used: dict[str, int] = {}
    for element in sets[name]:
        label = _unique(str(element.get("name") or f"cable{len(cables) + 1}"), used)
        try:
            cables.append(_cable(element, label, bodies, elasticity))
        except (XmlFault, CableError) as error:
            faults.append(str(error))
    if not faults and not cables:
        others = ", ".join(repr(each) for each in sets if len(sets[each])) or "none"
        faults.append(f"the set {name!r} holds no cables; sets with cables are {others}")
    refuse(path, faults)
    return tuple(cables)


def _unique(name: str, used: dict[str, int]) -> str:
    """The name, with a number behind it if it has been used; CASPR lets names repeat.

    Args:
        name: As it stands in the file.
        used: The highest number behind each label so far; filled.
    """
    label, count = name, used.get(name, 1)
    while label in used:
        count += 1
        label = f"{name} #{count}"
    used[name] = count
    used[label] = 1 if label != name else count
    return label


def _cable(
    element: etree._Element, name: str, bodies: Sequence[Body], elasticity: Elasticity
) -> Cable:
    if element.tag != "cable_ideal":
        raise XmlFault(
            f"<{element.tag}> {name}: only <cable_ideal> is taken, give the elasticity here"
        )
    reference = element.get("attachment_reference")
    if reference not in ("com", "joint"):
        raise XmlFault(f"{name}: attachment_reference {reference!r}; com or joint is needed")
    low, high = (
        numbers(f"{name}: <{key}>", element.findtext(f"properties/{key}"), 1)[0]
        for key in ("force_min", "force_max")
    )
    sites = []
    for place in element.find("attachments") if element.find("attachments") is not None else ():
        if place.tag != "attachment":
            raise XmlFault(f"{name}: <{place.tag}> is not taken; a cable passes points only")
        number = whole(f"{name}: <link>", place.findtext("link"))
        if not 0 <= number <= len(bodies):
            raise XmlFault(f"{name}: there is no link {number}, but 0 to {len(bodies)}")
        point = np.array(numbers(f"{name}: <location>", place.findtext("location"), 3))
        if number and reference == "com":
            point = point + bodies[number - 1].centre
        link = bodies[number - 1].name if number else BASE
        sites.append(Site(link, tuple(point.tolist())))
    return Cable(
        name=name,
        sites=tuple(sites),
        elasticity=elasticity,
        minimum=max(low, 0.0),
        maximum=high if high > 0.0 else math.inf,
    )
