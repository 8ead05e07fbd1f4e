"""Models of CASPR, the MATLAB simulator of cable-driven robots: their XML into a manipulator.

CASPR (D. Lau et al., Cable-Driven Parallel Robots, Springer 2016) describes a robot by two files:
rigid links, each with its joint, and sets of cables between points on them.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from cdsm._checks import Array
from cdsm._files import as_path, read_text
from cdsm._xml import XmlFault, numbers, parse_xml
from cdsm.cable import Cable, Site
from cdsm.elasticity import Elasticity
from cdsm.errors import CableError, FileError, InvalidInput, UnknownName, listed
from cdsm.manipulator import GRAVITY, Manipulator
from cdsm.urdf import TIP, urdf_text

if TYPE_CHECKING:
    import yourdfpy
    from lxml import etree

BASE: Final = "base"
"""Name of link 0."""

_COMMENT: Final = "\n  Made by cdsm from a CASPR model. Units: m, rad, kg.\n"

_TEMPLATE: Final = r"(\.\./)*templates/{}\.dtd"
"""What CASPR's files name as their DTD; it is not read."""

_AXES: Final = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}

_SLIDES: Final = "prismatic"
_TURNS: Final = "revolute"

_JOINTS: Final[Mapping[str, tuple[tuple[str, str], ...]]] = {
    **{f"R_{a}": ((_TURNS, a),) for a in "XYZ"},
    **{f"U_{a}{b}": ((_TURNS, a), (_TURNS, b)) for a, b in ("XY", "YZ", "XZ")},
    "S_EULER_XYZ": tuple((_TURNS, a) for a in "XYZ"),
    "S_FIXED_XYZ": tuple((_TURNS, a) for a in "ZYX"),
    "P_X": ((_SLIDES, "X"),),
    **{f"P_{a}{b}": ((_SLIDES, a), (_SLIDES, b)) for a, b in ("XY", "XZ")},
    "PLANAR_XY": ((_SLIDES, "X"), (_SLIDES, "Y"), (_TURNS, "Z")),
    "PLANAR_YZ": ((_SLIDES, "Y"), (_SLIDES, "Z"), (_TURNS, "X")),
    "PLANAR_XZ": ((_SLIDES, "X"), (_SLIDES, "Z"), (_TURNS, "Y")),
    "T_XYZ": tuple((_SLIDES, a) for a in "XYZ"),
    "SPATIAL_EULER_XYZ": (*((_SLIDES, a) for a in "XYZ"), *((_TURNS, a) for a in "XYZ")),
}
"""Joint types of CASPR as single joints, from the parent on."""

_ORDER: Final = {"S_FIXED_XYZ": (2, 1, 0)}
"""Which of CASPR's coordinates each single joint is, where not in the same order."""


@dataclass(frozen=True)
class _Body:
    """A link of CASPR with the joint that carries it.

    Attributes:
        number: From 1; 0 is the base.
        name: Of the link, unique.
        joints: Kind, axis and limits of each single joint, from the parent on.
        parent: Number of the parent.
        place: Where the joint sits on the parent (3,) [m].
        mass: [kg].
        centre: Centre of mass from the joint (3,) [m].
        inertia: About it (3, 3) [kg m²].
        end: End of the link (3,) [m].
    """

    number: int
    name: str
    joints: tuple[tuple[str, str, tuple[float, ...], float, float], ...]
    parent: int
    place: Array
    mass: float
    centre: Array
    inertia: Array
    end: Array


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

    Links keep CASPR's names (or become ``link1``, ``link2``, … where a name is missing or used
    twice), link 0 is called ``base``; a joint becomes single joints called after their link and
    axis: ``link 1_x`` turns about x, ``link 1_slide_x`` moves along it. ``tool0`` sits at the end
    of the link with the highest number. A cable whose name has been used gets ``#2`` behind it.
    Force bounds become ``Cable.minimum`` and ``.maximum``.
    CASPR's cables do not stretch: their elasticity is up to you.

    Args:
        bodies: The file of the bodies, or the folder with one ``*_bodies.xml`` and one
            ``*_cables.xml``.
        cables: The file of the cables, if ``bodies`` is a file.
        elasticity: Of all cables.
        cable_set: Which set of cables; the file's default if not given.
        gravity: In base axes (3,) [m/s²].
        check_inertia: As for :meth:`Manipulator.from_urdf`.

    Raises:
        FileError: A file cannot be read or is no CASPR model, or has what cannot be mapped: other
            joints, other cables than ideal ones, pulleys. Every such thing is named.
        UrdfError: A link has moments of inertia that no body has.
        UnknownName: No such set of cables.
        CableError: A cable that cannot be routed.
    """
    if not isinstance(elasticity, Elasticity):
        raise InvalidInput("elasticity", f"{elasticity!r} given; an Elasticity is needed.")
    bodies_file, cables_file = _files(bodies, cables)
    links = _read_bodies(bodies_file)
    routed = _read_cables(cables_file, links, elasticity, cable_set)
    urdf = _to_urdf(bodies_file.stem.removesuffix("_bodies"), links)
    return Manipulator.from_urdf(
        urdf, routed, tip=TIP, gravity=gravity, check_inertia=check_inertia
    )


def _files(
    bodies: str | os.PathLike[str], cables: str | os.PathLike[str] | None
) -> tuple[Path, Path]:
    first = as_path(bodies)
    if not first.is_dir():
        if cables is None:
            raise InvalidInput(
                "cables", "not given; give the file of the cables too, or the folder of both."
            )
        return first, as_path(cables)
    found = []
    for kind in ("bodies", "cables"):
        files = sorted(first.glob(f"*_{kind}.xml"))
        if len(files) != 1:
            listed = ", ".join(file.name for file in files) or "none"
            raise FileError(first, f"holds {listed} where one *_{kind}.xml is needed.")
        found.append(files[0])
    return found[0], found[1]


# --- bodies ---------------------------------------------------------------------------------


def _read_bodies(path: Path) -> tuple[_Body, ...]:
    faults: list[str] = []
    try:
        root = parse_xml(read_text(path), "bodies_system", _TEMPLATE.format("bodies"))
    except XmlFault as error:
        raise FileError(path, f"{error}.") from None
    holders = root.findall("links")
    elements = [element for holder in holders for element in holder]
    names = [str(element.get("name") or "") for element in elements]
    bodies = []
    for element, name in zip(elements, names, strict=True):
        unique = name and names.count(name) == 1 and name not in (BASE, TIP)
        try:
            bodies.append(_body(element, name if unique else f"link{element.get('num')}"))
        except XmlFault as error:
            faults.append(str(error))
    if not elements:
        faults.append("<links> holds no link")
    if not faults:
        count = len(bodies)
        if [body.number for body in bodies] != list(range(1, count + 1)):
            faults.append(
                f"links are numbered {[body.number for body in bodies]}, not 1 to {count}"
            )
        faults += [
            f"{body.name}: its parent is link {body.parent}; a link before it is needed"
            for body in bodies
            if not 0 <= body.parent < body.number
        ]
    _refuse(path, faults)
    return tuple(bodies)


def _body(element: etree._Element, name: str) -> _Body:
    if element.tag != "link_rigid":
        raise XmlFault(f"<{element.tag}> {name}: only <link_rigid> is taken")
    joint = element.find("joint")
    kind = None if joint is None else joint.get("type")
    if joint is None or (kind not in _JOINTS and kind not in ("R_AXIS", "P_AXIS")):
        known = ", ".join((*_JOINTS, "R_AXIS", "P_AXIS"))
        raise XmlFault(f"{name}: the joint type {kind!r} is not taken; {known} are")
    (mass,) = numbers(f"{name}: <mass>", _text(element, name, "physical/mass"), 1)
    centre, end, place = (
        np.array(numbers(f"{name}: <{where}>", _text(element, name, where), 3))
        for where in ("physical/com_location", "physical/end_location", "parent/location")
    )
    if mass < 0.0:
        raise XmlFault(f"{name}: <mass> {mass:g} kg given; it cannot be negative")
    return _Body(
        number=_whole(f"{name}: num", element.get("num")),
        name=name,
        joints=_single_joints(name, str(kind), joint),
        parent=_whole(f"{name}: parent", _text(element, name, "parent/num")),
        place=place,
        mass=mass,
        centre=centre,
        inertia=_inertia(element, name, mass, centre),
        end=end,
    )


def _single_joints(
    name: str, kind: str, joint: etree._Element
) -> tuple[tuple[str, str, tuple[float, ...], float, float], ...]:
    if kind in _JOINTS:
        parts: list[tuple[str, str, tuple[float, ...]]] = [
            (how, axis, _AXES[axis]) for how, axis in _JOINTS[kind]
        ]
    else:
        axis = numbers(f"{name}: joint axis", joint.get("axis"), 3)
        if not any(axis):
            raise XmlFault(f"{name}: joint axis {axis} has no direction")
        parts = [(_TURNS if kind == "R_AXIS" else _SLIDES, "", axis)]
    lower, upper = (
        numbers(f"{name}: joint {key}", joint.get(key), len(parts)) for key in ("q_min", "q_max")
    )
    order = _ORDER.get(kind, range(len(parts)))
    found = []
    for (how, letter, vector), i in zip(parts, order, strict=True):
        if lower[i] > upper[i]:
            raise XmlFault(f"{name}: joint q_min {lower[i]:g} is above q_max {upper[i]:g}")
        suffix = "slide" if how == _SLIDES else "" if letter else "turn"
        tail = "_".join(part for part in (suffix, letter.lower()) if part)
        found.append((how, f"{name}_{tail}", vector, lower[i], upper[i]))
    return tuple(found)


def _inertia(element: etree._Element, name: str, mass: float, centre: Array) -> Array:
    inertia = element.find("physical/inertia")
    if inertia is None:
        raise XmlFault(f"{name}: <physical> has no <inertia>")
    xx, yy, zz, xy, xz, yz = (
        numbers(f"{name}: <I{key}>", inertia.findtext(f"I{key}"), 1)[0]
        for key in ("xx", "yy", "zz", "xy", "xz", "yz")
    )
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if inertia.get("ref") == "com":
        return matrix
    if inertia.get("ref") == "joint":
        shift: Array = mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        return matrix - shift
    raise XmlFault(f"{name}: <inertia ref={inertia.get('ref')!r}>; com or joint is needed")


# --- cables ---------------------------------------------------------------------------------


def _read_cables(
    path: Path, bodies: Sequence[_Body], elasticity: Elasticity, wanted: str | None
) -> tuple[Cable, ...]:
    try:
        root = parse_xml(read_text(path), "cables", _TEMPLATE.format("cables"))
    except XmlFault as error:
        raise FileError(path, f"{error}.") from None
    sets = {str(each.get("id")): each for each in root.findall("cable_set")}
    name = root.get("default_cable_set") if wanted is None else wanted
    if not isinstance(name, str) or name not in sets:
        raise UnknownName("set of cables", name, tuple(sets))
    faults: list[str] = []
    cables: list[Cable] = []
    used: set[str] = set()
    for element in sets[name]:
        label = _unique(str(element.get("name") or f"cable{len(cables) + 1}"), used)
        try:
            cables.append(_cable(element, label, bodies, elasticity))
        except (XmlFault, CableError) as error:
            faults.append(str(error))
    if not faults and not cables:
        others = ", ".join(repr(each) for each in sets if len(sets[each])) or "none"
        faults.append(f"the set {name!r} holds no cables; sets with cables are {others}")
    _refuse(path, faults)
    return tuple(cables)


def _unique(name: str, used: set[str]) -> str:
    """The name, with a number behind it if it has been used; CASPR lets names repeat."""
    label, count = name, 1
    while label in used:
        count += 1
        label = f"{name} #{count}"
    used.add(label)
    return label


def _cable(
    element: etree._Element, name: str, bodies: Sequence[_Body], elasticity: Elasticity
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
        number = _whole(f"{name}: <link>", place.findtext("link"))
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


# --- output ---------------------------------------------------------------------------------


def _to_urdf(name: str, bodies: Sequence[_Body]) -> str:
    import yourdfpy

    links, joints = [yourdfpy.Link(name=BASE)], []
    names = [BASE, *(body.name for body in bodies)]
    for body in bodies:
        parent, place = names[body.parent], body.place
        for i, (kind, label, axis, low, high) in enumerate(body.joints, start=1):
            last = i == len(body.joints)
            child = body.name if last else f"{body.name}_{i}"
            joints.append(_joint(label, kind, parent, child, place, axis, (low, high)))
            links.append(_link(body) if last else yourdfpy.Link(name=child))
            parent, place = child, np.zeros(3)
    links.append(yourdfpy.Link(name=TIP))
    origin = np.eye(4)
    origin[:3, 3] = bodies[-1].end
    joints.append(
        yourdfpy.Joint(
            name=f"{TIP}_joint", type="fixed", parent=names[-1], child=TIP, origin=origin
        )
    )
    return urdf_text(yourdfpy.Robot(name=name or "caspr", links=links, joints=joints), _COMMENT)


def _link(body: _Body) -> yourdfpy.Link:
    import yourdfpy

    if body.mass == 0.0:
        return yourdfpy.Link(name=body.name)
    origin = np.eye(4)
    origin[:3, 3] = body.centre
    inertial = yourdfpy.Inertial(origin=origin, mass=body.mass, inertia=body.inertia)
    return yourdfpy.Link(name=body.name, inertial=inertial)


def _joint(
    name: str,
    kind: str,
    parent: str,
    child: str,
    place: Array,
    axis: tuple[float, ...],
    limits: tuple[float, float],
) -> yourdfpy.Joint:
    import yourdfpy

    origin = np.eye(4)
    origin[:3, 3] = place
    limit = yourdfpy.Limit(effort=0.0, velocity=0.0, lower=limits[0], upper=limits[1])
    return yourdfpy.Joint(
        name=name,
        type=kind,
        parent=parent,
        child=child,
        origin=origin,
        axis=np.array(axis),
        limit=limit,
    )


def _text(element: etree._Element, name: str, path: str) -> str:
    found = element.findtext(path)
    if found is None:
        raise XmlFault(f"{name}: has no <{path.replace('/', '> <')}>")
    return str(found)


def _whole(where: str, text: str | None) -> int:
    (value,) = numbers(where, text, 1)
    if value != int(value):
        raise XmlFault(f"{where}: {value:g} given; a whole number is needed")
    return int(value)


def _refuse(path: Path, faults: Sequence[str]) -> None:
    if faults:
        raise FileError(
            path, f"cannot be read as a CASPR model, {len(faults)} faults:{listed(faults, most=20)}"
        )
