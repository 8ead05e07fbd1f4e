"""Read models of CASPR, the MATLAB simulator of cable-driven robots, as a manipulator.

CASPR (D. Lau et al., Cable-Driven Parallel Robots, Springer 2016) describes a robot by two XML
files: rigid links with their joints, and sets of cables between points on the links.
"""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from cdsm.cable import Cable
from cdsm.cable_path import Site
from cdsm.errors import FileError, InvalidInput, unknown
from cdsm.manipulator import Manipulator
from cdsm.rigid_body import GRAVITY
from cdsm.support.files import XmlFault, as_path, parse_xml, read_numbers, read_text
from cdsm.support.validation import AXES
from cdsm.support.values import Array
from cdsm.urdf import TIP, E, inertial, joint, origin, urdf_text
from cdsm.wires.elasticity import Elasticity, checked_law

if TYPE_CHECKING:
    from lxml import etree

_BASE: Final = "base"  # name of link 0

_JOINTS: Final = {
    **{f"R_{axis}": axis.lower() for axis in "XYZ"},
    **{f"U_{axes}": axes.lower() for axes in ("XY", "YZ", "XZ")},
    "S_EULER_XYZ": "xyz",
    "S_FIXED_XYZ": "xyz",
    **{f"P_{axes}": axes for axes in ("X", "XY", "XZ")},
    "PLANAR_XY": "XYz",
    "PLANAR_YZ": "YZx",
    "PLANAR_XZ": "XZy",
    "T_XYZ": "XYZ",
    "SPATIAL_EULER_XYZ": "XYZxyz",
    "R_AXIS": "?",
    "P_AXIS": "!",
}
"""Coordinates of each joint type: x, y, z turn, X, Y, Z slide, ? turns and ! slides on any axis."""


class _Link(NamedTuple):
    """Link of a CASPR model, with what cables and other links need of it."""

    name: str
    centre: Array  # of mass (3,) [m]
    end: Array  # (3,) [m]
    joint_names: list[str]  # in the order of CASPR's coordinates


def read_caspr(
    bodies: str | os.PathLike[str],
    cables: str | os.PathLike[str] | None = None,
    *,
    elasticity: Elasticity,
    cable_set: str | None = None,
    gravity: ArrayLike = GRAVITY,
    check_inertia: bool = True,
) -> Manipulator:
    """Read a robot from its CASPR model files.

    Links keep CASPR's names. A link is called ``link1``, ``link2``, … by its number if its name is
    missing or used twice. Link 0 is called ``base``. Each CASPR joint is split into joints of one
    coordinate. The name of such a joint has the link and the axis: ``link 1_x`` turns about x,
    ``link 1_slide_x`` moves along x. ``tool0`` is at the end of the link with the highest number. A
    repeated cable name gets the suffix ``#2``.

    The joint coordinates q have CASPR's sign and order: link by link in the order of the numbers,
    and within a link as in the name of its joint type, translations first (``S_FIXED_XYZ``: angles
    x, y, z; ``PLANAR_XZ``: translations x and z, then the angle). ``joint_names`` lists them.
    CASPR's force bounds become ``Cable.minimum`` and ``.maximum``. CASPR's cables do not stretch,
    so you choose their elasticity.

    Args:
        bodies: File of the bodies, or folder with one ``*_bodies.xml`` and one ``*_cables.xml``.
        cables: File of the cables, if ``bodies`` is a file.
        elasticity: Elasticity of all cables.
        cable_set: Name of the set of cables; the file's default if not given.
        gravity: Gravity in base axes (3,) [m/s²].
        check_inertia: As for :meth:`Manipulator.from_urdf`.

    Raises:
        InvalidInput: ``elasticity`` is not an Elasticity, or ``cables`` is missing. The set of
            cables does not exist. A cable cannot be routed.
        FileError: A file cannot be read, is not a CASPR model, or has parts that cannot be mapped:
            other joints, cables that are not ideal, pulleys. The first such part is named.
        GeometryError: A link has impossible moments of inertia.

    Example:
        >>> import cdsm
        >>> wire = cdsm.LinearElasticity(48e3)
        >>> arm = cdsm.read_caspr("bodies.xml", "cables.xml", elasticity=wire)  # doctest: +SKIP
    """
    checked_law(elasticity)
    path = as_path(bodies)
    if path.is_dir():
        path, of_cables = (_one_file(path, kind) for kind in ("bodies", "cables"))
    elif cables is None:
        raise InvalidInput("cables", "give the file of the cables too, or the folder of both.")
    else:
        of_cables = as_path(cables)
    with _reading(path) as read:
        parts, links = _read_bodies(read("bodies_system", "bodies"))
    with _reading(of_cables) as read:
        routed = _read_cables(read("cables", "cables"), links, elasticity, cable_set)
    comment = "\n  Made by cdsm from a CASPR model. Units: m, rad, kg.\n"
    return Manipulator.from_urdf(
        urdf_text(path.stem.removesuffix("_bodies") or "caspr", parts, comment),
        routed,
        tip=TIP,
        joint_names=[name for link in links for name in link.joint_names],
        gravity=gravity,
        check_inertia=check_inertia,
    )


def _one_file(folder: Path, kind: str) -> Path:
    files = sorted(folder.glob(f"*_{kind}.xml"))
    if len(files) != 1:
        names = ", ".join(file.name for file in files) or "none"
        raise FileError(folder, f"holds {names} where one *_{kind}.xml is needed.")
    return files[0]


@contextmanager
def _reading(path: Path) -> Iterator[Callable[[str, str], etree._Element]]:
    """Yield a function that parses a file; its DOCTYPE may name a DTD, which is not read."""
    text = read_text(path)
    try:
        yield lambda tag, dtd: parse_xml(text, tag, rf"(\.\./)*templates/{dtd}\.dtd")
    except (XmlFault, InvalidInput) as error:
        raise FileError(path, f"cannot be read as a CASPR model: {error}.") from None


def _whole(where: str, text: str | None, most: int) -> int:
    (value,) = read_numbers(where, text, 1)
    if value not in range(most + 1):
        raise XmlFault(f"{where} is link {value:g}; one of 0 to {most} is needed")
    return int(value)


def _read_bodies(root: etree._Element) -> tuple[list[etree._Element], list[_Link]]:
    """Read the links with their joints; return the elements of a URDF too."""
    elements = root.findall("links/*")
    order = [element.get("num") for element in elements]
    if not order or order != [str(n) for n in range(1, len(order) + 1)]:
        raise XmlFault(f"links are numbered {order}; 1 to the number of links is needed")
    counts = Counter(element.get("name") for element in elements)
    links = [_Link(_BASE, np.zeros(3), np.zeros(3), [])]
    parts = [E.link(name=_BASE)]
    for number, element in enumerate(elements, start=1):
        name = element.get("name") or ""
        if not name or counts[name] > 1 or name in (_BASE, TIP):
            name = f"link{number}"
        if element.tag != "link_rigid":
            raise XmlFault(f"<{element.tag}> {name}: only <link_rigid> is supported")
        links.append(_body(element, name, links, parts))
    parts += [E.link(name=TIP)]
    place = origin(links[-1].end)
    return [*parts, joint("fixed", f"{TIP}_joint", links[-1].name, TIP, place)], links


def _body(
    element: etree._Element, name: str, links: list[_Link], parts: list[etree._Element]
) -> _Link:
    """Read a link, and add it and its joints to the ``parts`` of a URDF."""

    def values(path: str, count: int = 3) -> Array:
        where = f"{name}: <{path.rpartition('/')[2]}>"
        return np.array(read_numbers(where, element.findtext(path), count))

    body = "physical/inertia"
    kind = element.find("joint")
    if kind is None or kind.get("type") not in _JOINTS:
        axis = None if kind is None else kind.get("type")
        known = ", ".join(_JOINTS)
        raise XmlFault(f"{name}: the joint type {axis!r} is not supported; {known} are")
    mass = float(values("physical/mass", 1)[0])
    centre = values("physical/com_location")
    if mass < 0.0:
        raise XmlFault(f"{name}: <mass> {mass:g} kg given; it cannot be negative")
    keys = [[f"{body}/I{min(a, b)}{max(a, b)}" for b in "xyz"] for a in "xyz"]
    inertia = np.array([[values(key, 1)[0] for key in row] for row in keys])
    if (reference := element.find(body).get("ref")) not in ("com", "joint"):
        raise XmlFault(f"{name}: <inertia ref={reference!r}>; com or joint is needed")
    if reference == "joint":
        inertia -= mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    joints = _joints(name, kind)
    names = [label for _, label, *_ in joints]
    if kind.get("type") == "S_FIXED_XYZ":
        joints.reverse()  # turns about fixed axes X, Y, Z equal turns about moving axes Z, Y, X
    parent = links[_whole(f"{name}: its parent", element.findtext("parent/num"), len(links) - 1)]
    carrier = parent.name
    place = values("parent/location")
    for i, (turns, label, *settings) in enumerate(joints, start=1):
        # single joints of one link need massless links between them
        child = name if i == len(joints) else f"{name}_{i}"
        parts += [joint(turns, label, carrier, child, origin(place), *settings)]
        parts += [E.link(name=child)]
        carrier = child
        place = np.zeros(3)
    if mass:
        parts[-1].append(inertial(mass, inertia, origin(centre)))
    return _Link(name, centre, values("physical/end_location"), names)


def _joints(name: str, element: etree._Element) -> list[tuple[str, str, Any, Any]]:
    """Split a CASPR joint into joints of one coordinate, in the order of its coordinates."""
    axes = _JOINTS[str(element.get("type"))]
    low, high = (
        read_numbers(f"{name}: joint {key}", element.get(key), len(axes))
        for key in ("q_min", "q_max")
    )
    sites = []
    for axis, lower, upper in zip(axes, low, high, strict=True):
        if lower > upper:
            raise XmlFault(f"{name}: joint q_min {lower:g} is above q_max {upper:g}")
        tail = {"?": "turn", "!": "slide"}.get(axis, f"slide_{axis.lower()}" * axis.isupper())
        xyz = AXES.get(axis.lower()) or read_numbers(f"{name}: joint axis", element.get("axis"), 3)
        kind = "prismatic" if axis in "XYZ!" else "revolute"
        limit = E.limit(effort=0.0, velocity=0.0, lower=lower, upper=upper)
        sites.append((kind, f"{name}_{tail or axis}", E.axis(xyz=xyz), limit))
    return sites


def _read_cables(
    root: etree._Element, links: list[_Link], elasticity: Elasticity, wanted: str | None
) -> list[Cable]:
    sets = {str(element.get("id")): element for element in root.findall("cable_set")}
    name = root.get("default_cable_set") if wanted is None else wanted
    if not isinstance(name, str) or name not in sets:
        raise unknown("set of cables", name, tuple(sets))
    if not len(sets[name]):
        others = ", ".join(repr(name) for name in sets if len(sets[name])) or "none"
        raise XmlFault(f"the set {name!r} holds no cables; sets with cables are {others}")
    cables: list[Cable] = []
    used: Counter[str] = Counter()
    for element in sets[name]:
        label = element.get("name") or f"cable{len(cables) + 1}"
        used[label] += 1
        label += f" #{used[label]}" if used[label] > 1 else ""
        cables.append(_cable(element, label, links, elasticity))
    return cables


def _cable(element: etree._Element, name: str, links: list[_Link], elasticity: Elasticity) -> Cable:
    if element.tag != "cable_ideal":
        only = "only <cable_ideal> is supported; give the elasticity here"
        raise XmlFault(f"<{element.tag}> {name}: {only}")
    reference = element.get("attachment_reference")
    if reference not in ("com", "joint"):
        raise XmlFault(f"{name}: attachment_reference {reference!r}; com or joint is needed")
    low, high = (
        read_numbers(f"{name}: <{key}>", element.findtext(f"properties/{key}"), 1)[0]
        for key in ("force_min", "force_max")
    )
    sites = []
    for place in element.findall("attachments/*"):
        if place.tag != "attachment":
            raise XmlFault(f"{name}: <{place.tag}> is not supported; a cable passes points only")
        link = links[_whole(f"{name}: <link>", place.findtext("link"), len(links) - 1)]
        point = np.array(read_numbers(f"{name}: <location>", place.findtext("location"), 3))
        point = point + link.centre if reference == "com" else point
        sites.append(Site(link.name, tuple(point.tolist())))
    high = high if high > 0.0 else math.inf
    return Cable(name, tuple(sites), elasticity, minimum=max(low, 0.0), maximum=high)
