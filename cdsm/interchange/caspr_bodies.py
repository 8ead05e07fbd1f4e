"""Read the links of a CASPR model with their joints; read the values of its XML."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from cdsm.errors import LINES, FileError, listed
from cdsm.support.directions import AXES
from cdsm.support.files import read_text
from cdsm.support.values import Array
from cdsm.support.xml import XmlFault, numbers, parse_xml
from cdsm.urdf import TIP

if TYPE_CHECKING:
    from lxml import etree

_TEMPLATE: Final = r"(\.\./)*templates/{}\.dtd"
"""Pattern of the DTD that CASPR's files name; the DTD is not read."""

BASE: Final = "base"
"""Name of link 0."""

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
}
"""Coordinates of each CASPR joint type: x, y, z are rotations, X, Y, Z translations."""

_OBLIQUE: Final = {"R_AXIS": ("turn", "revolute"), "P_AXIS": ("slide", "prismatic")}
"""Name suffix and URDF type of the joint for each CASPR joint type that has any axis."""


class SingleJoint(NamedTuple):
    """Joint of a URDF: one axis, one coordinate."""

    name: str
    kind: str  # type in URDF: revolute or prismatic
    axis: tuple[float, ...]  # (3,), any length
    lower: float  # limit [rad], or [m] if the joint slides
    upper: float


@dataclass(frozen=True)
class Body:
    """Link of a CASPR model, with the joint between it and its parent link."""

    number: int  # from 1; the base has 0
    name: str  # unique
    joints: tuple[SingleJoint, ...]  # in order from the parent
    joint_names: tuple[str, ...]  # in the order of CASPR's coordinates
    parent: int  # number of the parent link
    place: Array  # of the joint in the frame of the parent (3,) [m]
    mass: float  # [kg]
    centre: Array  # of mass in the frame of the link (3,) [m]
    inertia: Array  # about the centre of mass (3, 3) [kg m²]
    end: Array  # of the link in its frame (3,) [m]


def read_bodies(path: Path) -> tuple[Body, ...]:
    """Read the links of a CASPR model, in the order of their numbers 1, 2, ….

    Raises FileError, which lists every fault.
    """
    faults: list[str] = []
    root = read_root(path, "bodies_system", "bodies")
    elements = root.findall("links/*")
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
        order = [body.number for body in bodies]
        if order != list(range(1, len(order) + 1)):
            faults.append(f"links are numbered {order}, not 1 to {len(order)}")
        faults += [
            f"{body.name}: its parent is link {body.parent}; a link before it is needed"
            for body in bodies
            if not 0 <= body.parent < body.number
        ]
    refuse(path, faults)
    return tuple(bodies)


def _body(element: etree._Element, name: str) -> Body:
    if element.tag != "link_rigid":
        raise XmlFault(f"<{element.tag}> {name}: only <link_rigid> is supported")
    joint = element.find("joint")
    kind = None if joint is None else joint.get("type")
    if joint is None or kind not in (known := (*_JOINTS, *_OBLIQUE)):
        raise XmlFault(f"{name}: the joint type {kind!r} is not supported; {', '.join(known)} are")
    (mass,) = numbers(f"{name}: <mass>", _text_of(element, name, "physical/mass"), 1)
    centre, end, place = (
        np.array(numbers(f"{name}: <{where}>", _text_of(element, name, where), 3))
        for where in ("physical/com_location", "physical/end_location", "parent/location")
    )
    if mass < 0.0:
        raise XmlFault(f"{name}: <mass> {mass:g} kg given; it cannot be negative")
    joints = _single_joints(name, str(kind), joint)
    return Body(
        number=whole(f"{name}: num", element.get("num")),
        name=name,
        # turns about fixed axes X, Y, Z equal turns about moving axes Z, Y, X
        joints=joints[::-1] if kind == "S_FIXED_XYZ" else joints,
        joint_names=tuple(each.name for each in joints),
        parent=whole(f"{name}: parent", _text_of(element, name, "parent/num")),
        place=place,
        mass=mass,
        centre=centre,
        inertia=_inertia(element, name, mass, centre),
        end=end,
    )


def _single_joints(name: str, kind: str, joint: etree._Element) -> tuple[SingleJoint, ...]:
    """Split the CASPR joint of type ``kind`` of the link ``name`` into joints of one coordinate.

    They are in the order of CASPR's coordinates.
    """
    if kind in _JOINTS:
        parts: list[tuple[str, str, tuple[float, ...]]] = [
            (axis, "revolute", AXES[axis])
            if axis in AXES
            else (f"slide_{axis.lower()}", "prismatic", AXES[axis.lower()])
            for axis in _JOINTS[kind]
        ]
    else:
        given = numbers(f"{name}: joint axis", joint.get("axis"), 3)
        if not any(given):
            raise XmlFault(f"{name}: joint axis {given} has no direction")
        parts = [(*_OBLIQUE[kind], given)]
    lower, upper = (
        numbers(f"{name}: joint {key}", joint.get(key), len(parts)) for key in ("q_min", "q_max")
    )
    for low, high in zip(lower, upper, strict=True):
        if low > high:
            raise XmlFault(f"{name}: joint q_min {low:g} is above q_max {high:g}")
    return tuple(
        SingleJoint(f"{name}_{tail}", how, axis, low, high)
        for (tail, how, axis), low, high in zip(parts, lower, upper, strict=True)
    )


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


def _text_of(element: etree._Element, name: str, path: str) -> str:
    found = element.findtext(path)
    if found is None:
        raise XmlFault(f"{name}: has no <{path.replace('/', '> <')}>")
    return str(found)


def whole(where: str, text: str | None) -> int:
    """Parse ``text`` as a whole number; raise XmlFault, which names ``where``, if it is none."""
    (value,) = numbers(where, text, 1)
    if value != int(value):
        raise XmlFault(f"{where}: {value:g} given; a whole number is needed")
    return int(value)


def refuse(path: Path, faults: Sequence[str]) -> None:
    """Raise a FileError that lists all ``faults`` of the file, if there are any."""
    if faults:
        raise FileError(path, f"cannot be read as a CASPR model:{listed(faults, 20, LINES)}")


def read_root(path: Path, tag: str, template: str) -> etree._Element:
    """Parse an XML file and return its root element, which must be ``tag``; FileError if not.

    The DOCTYPE of the file may name CASPR's ``template``, ``bodies`` or ``cables``; the DTD is not
    read.
    """
    try:
        return parse_xml(read_text(path), tag, _TEMPLATE.format(template))
    except XmlFault as error:
        raise FileError(path, f"{error}.") from None
