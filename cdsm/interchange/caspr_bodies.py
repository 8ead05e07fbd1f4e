"""Read the links of a CASPR model with their joints, and helpers for its XML."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from cdsm.errors import FileError, counted
from cdsm.support.files import read_text
from cdsm.support.validation import Array
from cdsm.support.xml import XmlFault, numbers, parse_xml
from cdsm.urdf import TIP

if TYPE_CHECKING:
    from lxml import etree

_TEMPLATE: Final = r"(\.\./)*templates/{}\.dtd"
"""DTD named by CASPR's files (a regular expression). It is not read."""

BASE: Final = "base"
"""Name of link 0."""

_AXES: Final = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}

SLIDES: Final = "prismatic"
TURNS: Final = "revolute"

_JOINTS: Final[Mapping[str, tuple[tuple[str, str], ...]]] = {
    **{f"R_{a}": ((TURNS, a),) for a in "XYZ"},
    **{f"U_{a}{b}": ((TURNS, a), (TURNS, b)) for a, b in ("XY", "YZ", "XZ")},
    "S_EULER_XYZ": tuple((TURNS, a) for a in "XYZ"),
    "S_FIXED_XYZ": tuple((TURNS, a) for a in "ZYX"),
    "P_X": ((SLIDES, "X"),),
    **{f"P_{a}{b}": ((SLIDES, a), (SLIDES, b)) for a, b in ("XY", "XZ")},
    "PLANAR_XY": ((SLIDES, "X"), (SLIDES, "Y"), (TURNS, "Z")),
    "PLANAR_YZ": ((SLIDES, "Y"), (SLIDES, "Z"), (TURNS, "X")),
    "PLANAR_XZ": ((SLIDES, "X"), (SLIDES, "Z"), (TURNS, "Y")),
    "T_XYZ": tuple((SLIDES, a) for a in "XYZ"),
    "SPATIAL_EULER_XYZ": (*((SLIDES, a) for a in "XYZ"), *((TURNS, a) for a in "XYZ")),
}
"""Single joints of each CASPR joint type, in the order from parent to link."""

_ORDER: Final = {"S_FIXED_XYZ": (2, 1, 0)}
"""Index of CASPR's coordinate for each single joint, where the order differs.

Rotations about fixed axes X, Y, Z equal rotations about moving axes Z, Y, X.
"""


@dataclass(frozen=True)
class Body:
    """Link of CASPR with the joint that carries it.

    Attributes:
        number: Number from 1. The base has number 0.
        name: Unique name of the link.
        joints: Kind, name, axis and limits of each single joint, in order from the parent.
        joint_names: Names of the single joints, in the order of CASPR's coordinates.
        parent: Number of the parent link.
        place: Position of the joint on the parent (3,) [m].
        mass: Mass [kg].
        centre: Centre of mass, from the joint (3,) [m].
        inertia: Inertia about the centre of mass (3, 3) [kg m²].
        end: End of the link (3,) [m].
    """

    number: int
    name: str
    joints: tuple[tuple[str, str, tuple[float, ...], float, float], ...]
    joint_names: tuple[str, ...]
    parent: int
    place: Array
    mass: float
    centre: Array
    inertia: Array
    end: Array


def read_bodies(path: Path) -> tuple[Body, ...]:
    """Read the links, in the order of their numbers from 1."""
    faults: list[str] = []
    root = read_root(path, "bodies_system", "bodies")
    holders = root.findall("links")
    elements = [element for holder in holders for element in holder]
    names = [str(element.get("name") or "") for element in elements]
    counts = Counter(names)
    bodies = []
    for element, name in zip(elements, names, strict=True):
        unique = name and counts[name] == 1 and name not in (BASE, TIP)
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
    refuse(path, faults)
    return tuple(bodies)


def _body(element: etree._Element, name: str) -> Body:
    if element.tag != "link_rigid":
        raise XmlFault(f"<{element.tag}> {name}: only <link_rigid> is taken")
    joint = element.find("joint")
    kind = None if joint is None else joint.get("type")
    if joint is None or (kind not in _JOINTS and kind not in ("R_AXIS", "P_AXIS")):
        known = ", ".join((*_JOINTS, "R_AXIS", "P_AXIS"))
        raise XmlFault(f"{name}: the joint type {kind!r} is not taken; {known} are")
    (mass,) = numbers(f"{name}: <mass>", text_of(element, name, "physical/mass"), 1)
    centre, end, place = (
        np.array(numbers(f"{name}: <{where}>", text_of(element, name, where), 3))
        for where in ("physical/com_location", "physical/end_location", "parent/location")
    )
    if mass < 0.0:
        raise XmlFault(f"{name}: <mass> {mass:g} kg given; it cannot be negative")
    joints = _single_joints(name, str(kind), joint)
    order = _ORDER.get(str(kind), range(len(joints)))
    return Body(
        number=whole(f"{name}: num", element.get("num")),
        name=name,
        joints=joints,
        joint_names=tuple(joints[i][1] for i in np.argsort(order)),
        parent=whole(f"{name}: parent", text_of(element, name, "parent/num")),
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
        parts = [(TURNS if kind == "R_AXIS" else SLIDES, "", axis)]
    lower, upper = (
        numbers(f"{name}: joint {key}", joint.get(key), len(parts)) for key in ("q_min", "q_max")
    )
    order = _ORDER.get(kind, range(len(parts)))
    found = []
    for (how, letter, vector), i in zip(parts, order, strict=True):
        if lower[i] > upper[i]:
            raise XmlFault(f"{name}: joint q_min {lower[i]:g} is above q_max {upper[i]:g}")
        suffix = "slide" if how == SLIDES else "" if letter else "turn"
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


def text_of(element: etree._Element, name: str, path: str) -> str:
    """Read the text at a path below the element of a link. Raise XmlFault if it is missing."""
    found = element.findtext(path)
    if found is None:
        raise XmlFault(f"{name}: has no <{path.replace('/', '> <')}>")
    return str(found)


def whole(where: str, text: str | None) -> int:
    """Parse a whole number. ``where`` names the place in the error."""
    (value,) = numbers(where, text, 1)
    if value != int(value):
        raise XmlFault(f"{where}: {value:g} given; a whole number is needed")
    return int(value)


def refuse(path: Path, faults: Sequence[str]) -> None:
    """Raise a FileError that lists all faults, if there are any."""
    if faults:
        raise FileError(path, f"cannot be read as a CASPR model, {counted(faults, most=20)}")


def read_root(path: Path, tag: str, template: str) -> etree._Element:
    """Read the root element of a file."""
    try:
        return parse_xml(read_text(path), tag, _TEMPLATE.format(template))
    except XmlFault as error:
        raise FileError(path, f"{error}.") from None
