"""Read URDFs of other programs, and refuse faults that Pinocchio accepts.

Pinocchio accepts links with two parents, impossible masses, zero axes and inverted limits. It
prints the reason of a refusal only to standard error. This module therefore checks the text first:
the XML, the tree, the joints, the masses and inertias.
"""

from __future__ import annotations

import os
from collections import Counter

import numpy as np
from lxml import etree

from cdsm.errors import InvalidInput, UrdfError, listed
from cdsm.geometry import MAXIMUM_JOINTS
from cdsm.support.files import read_text
from cdsm.support.records import misspelt
from cdsm.support.validation import RANGES, flag
from cdsm.support.xml import XmlFault, numbers, parse_xml

TAKEN = ("revolute", "prismatic", "fixed")
"""Joint types that cdsm accepts."""

_INSTEAD = {
    "continuous": "write it as revolute with a <limit>; one angle per joint is needed",
    "floating": "fix the base to the world; a floating base has no stiffness",
    "planar": "write it as two prismatic and one revolute joint",
    "spherical": "write it as three revolute joints",
}

_ONCE = {
    "link": ("inertial",),
    "inertial": ("origin", "mass", "inertia"),
    "joint": ("origin", "parent", "child", "axis", "limit", "mimic"),
}
"""Elements that another element holds once at most."""

_OTHERS = {
    "robot": ("link", "joint", "material", "gazebo", "transmission"),
    "link": ("visual", "collision"),
    "joint": ("calibration", "dynamics", "safety_controller"),
}
"""Elements that may be repeated, or that cdsm does not read."""

_ATTRIBUTES = {
    "origin": ("xyz", "rpy"),
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "parent": ("link",),
    "child": ("link",),
    "axis": ("xyz",),
    "limit": ("lower", "upper", "effort", "velocity"),
}

_MOST_LINKS = 2000
"""Largest number of links, since Pinocchio compares the name of each link with all others."""

_LONGEST_CHAIN = 400
"""Largest number of joints in series, fixed ones included; 4000 crash Pinocchio."""

_ALIKE = 0.75  # similarity of a misspelt element; elements of other programs are less alike

_LOOSE = 1e-2
"""Tolerance of the inertia check for rounded values, relative to the largest principal moment."""


def read_urdf(source: str | os.PathLike[str], *, check_inertia: bool = True) -> str:
    """Check a URDF and return its text. ``source`` is a path, or the text if it begins with ``<``.

    Arguments and errors are those of :meth:`cdsm.Manipulator.from_urdf`.
    """
    flag("check_inertia", check_inertia)
    if not isinstance(source, (str, os.PathLike)) or source == "":
        raise InvalidInput(
            "urdf", f"{source!r:.100} given; the path of a URDF is needed, or its text as str."
        )
    inline = isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<")
    text = (str(source) if inline else read_text(source)).lstrip("\ufeff \t\r\n")
    name = "the URDF" if inline else os.fspath(source)
    try:
        robot = parse_xml(text, "robot")
    except XmlFault as error:
        raise UrdfError(f"{name}: {error}.") from None
    faults = _faults(robot, check_inertia)
    if faults:
        listing = listed(faults, most=20)
        raise UrdfError(f"{name} is no robot that cdsm takes, {len(faults)} found:{listing}")
    return text


def _faults(robot: etree._Element, check_inertia: bool) -> list[str]:
    links, joints = robot.findall("link"), robot.findall("joint")
    faults = [*_names("link", links), *_names("joint", joints)]
    if not robot.get("name"):
        faults.append("<robot> has no name")
    _check_elements(faults, "", robot)
    for link in links:
        _check_link(faults, link, check_inertia)
    for joint in joints:
        _check_joint(faults, joint)
    moving = sum(joint.get("type") in ("revolute", "prismatic") for joint in joints)
    if not moving:
        faults.append("has no joint that moves")
    if len(links) > _MOST_LINKS:
        faults.append(f"has {len(links)} links; {_MOST_LINKS} are taken at most")
    if moving > 2 * MAXIMUM_JOINTS:
        faults.append(f"has {moving} joints that move; {2 * MAXIMUM_JOINTS} are taken at most")
    return faults or _tree_faults([str(link.get("name")) for link in links], joints)


def _check_elements(faults: list[str], where: str, element: etree._Element) -> None:
    """Append faults of ``element`` and of the elements in it: repeated, misspelt or xacro elements.

    ``where`` names the place in the texts. Elements and attributes of other programs are no faults.
    """
    once = _ONCE.get(element.tag, ())
    known = (*once, *_OTHERS.get(element.tag, ()))
    for name, count in Counter(each.tag for each in element.iterchildren("*")).items():
        own = etree.QName(name)
        if "xacro" in (own.namespace or ""):
            faults.append(f"{where}<xacro:{own.localname}> is left; run xacro on the file first")
        elif name in once and count > 1:
            faults.append(f"{where}has {count} <{name}>; one is needed")
        elif meant := misspelt(name, known, _ALIKE):
            faults.append(f"{where}<{name}> is not known{meant}")
    for name, attributes in _ATTRIBUTES.items():
        for part in element.findall(name):
            for key in map(str, part.keys()):
                if meant := misspelt(key, attributes):
                    faults.append(f"{where}<{name}> has {key}, which is not known{meant}")
    for part in element.iterchildren(*_ONCE):
        within = f"{part.tag} {part.get('name')}: " if part.get("name") else where
        _check_elements(faults, within, part)


def _names(kind: str, elements: list[etree._Element]) -> list[str]:
    counts = Counter(element.get("name") for element in elements)
    faults = [
        f"a <{kind}> on line {e.sourceline} has no name" for e in elements if not e.get("name")
    ]
    twice = sorted(str(name) for name, count in counts.items() if name and count > 1)
    return faults + [f"{kind} {name}: the name is used twice" for name in twice]


def _check_link(faults: list[str], link: etree._Element, check_inertia: bool) -> None:
    inertial = link.find("inertial")
    if inertial is None:
        return
    where = f"link {link.get('name')}"
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    value = _read(faults, f"{where}: mass", None if mass is None else mass.get("value"), 1)
    most = RANGES["mass"].high
    if value is not None and not 0.0 <= value[0] <= most:
        faults.append(f"{where}: mass {value[0]:g} kg; 0 to {most:g} kg is needed")
    _check_origin(faults, where, inertial)
    if inertia is None:
        faults.append(f"{where}: <inertial> has no <inertia>")
        return
    read = [_read(faults, f"{where}: {key}", inertia.get(key), 1) for key in _ATTRIBUTES["inertia"]]
    if check_inertia and None not in read:
        xx, xy, xz, yy, yz, zz = (each[0] for each in read if each is not None)
        moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        slack = _LOOSE * float(abs(moments).max())
        if moments[0] < -slack or moments[2] > moments[0] + moments[1] + slack:
            faults.append(
                f"{where}: principal moments of inertia {', '.join(f'{m:g}' for m in moments)} "
                "kg m², which no body has: none is negative, nor larger than the sum of the "
                "others. Stiffness does not need them: check_inertia=False lets them pass"
            )


def _check_joint(faults: list[str], joint: etree._Element) -> None:
    where, kind = f"joint {joint.get('name')}", joint.get("type")
    if kind not in TAKEN:
        remedy = _INSTEAD.get(str(kind), f"one of {', '.join(TAKEN)} is needed")
        faults.append(f"{where}: type {kind!r} is not supported; {remedy}")
    if joint.find("mimic") is not None:
        faults.append(
            f"{where}: mimics another joint, which is not supported; remove <mimic> to let it "
            "move, or make it fixed"
        )
    for end in ("parent", "child"):
        element = joint.find(end)
        if element is None or not element.get("link"):
            faults.append(f"{where}: has no <{end} link=…>")
    _check_origin(faults, where, joint)
    if kind not in ("revolute", "prismatic"):
        return
    axis = joint.find("axis")
    if axis is not None:
        vector = _read(faults, f"{where}: axis", axis.get("xyz"), 3)
        if vector is not None and float(np.linalg.norm(vector)) < 1e-6:
            faults.append(f"{where}: axis {axis.get('xyz')!r} has no direction")
    limit = joint.find("limit")
    if limit is None:
        faults.append(f"{where}: has no <limit>, which a {kind} joint needs")
        return
    for key in ("effort", "velocity"):
        if limit.get(key) is None:
            faults.append(f'{where}: <limit> has no {key}; write {key}="0" if it is unknown')
    ends = [
        _read(faults, f"{where}: {key} limit", limit.get(key, "0"), 1) for key in ("lower", "upper")
    ]
    if ends[0] and ends[1] and ends[0][0] > ends[1][0]:
        faults.append(f"{where}: lower limit {ends[0][0]:g} above the upper one {ends[1][0]:g}")


def _check_origin(faults: list[str], where: str, element: etree._Element) -> None:
    origin = element.find("origin")
    if origin is not None:
        _read(faults, f"{where}: origin rpy", origin.get("rpy", "0 0 0"), 3)
        xyz, most = origin.get("xyz", "0 0 0"), RANGES["length"].high
        position = _read(faults, f"{where}: origin xyz", xyz, 3)
        if position is not None and max(map(abs, position)) > most:
            faults.append(f"{where}: origin xyz {xyz!r} is further than {most:g} m away")


def _read(faults: list[str], where: str, text: str | None, count: int) -> tuple[float, ...] | None:
    """Return the ``count`` numbers in ``text``; else append a fault at ``where``, return None."""
    try:
        return numbers(where, text, count)
    except XmlFault as error:
        faults.append(str(error))
        return None


def _tree_faults(links: list[str], joints: list[etree._Element]) -> list[str]:
    """Return the faults of the tree: unknown links, two parents or roots, cycles, long chains."""
    faults: list[str] = []
    known = set(links)
    parents: dict[str, tuple[str, str]] = {}
    children: dict[str, list[str]] = {}
    for joint in joints:
        name = str(joint.get("name"))
        parent, child = (str(joint.find(end).get("link")) for end in ("parent", "child"))
        for link in (parent, child):
            if link not in known:
                faults.append(f"joint {name}: there is no link {link}")
        if parent == child:
            faults.append(f"joint {name}: joins link {child} to itself")
        elif child in parents:
            faults.append(
                f"link {child}: has two parents, by the joints {parents[child][1]} and {name}"
            )
        else:
            parents[child] = parent, name
            children.setdefault(parent, []).append(child)
    if faults:
        return faults
    roots = [link for link in links if link not in parents]
    if len(roots) != 1:
        listed = ", ".join(roots) or "none"
        return [f"has the roots {listed}; one link that no joint carries is needed"]
    reached, level, depth = set(roots), roots, -1
    while level:
        depth += 1
        level = [child for link in level for child in children.get(link, ())]
        reached.update(level)
    if depth > _LONGEST_CHAIN:
        return [f"has {depth} joints one behind the other; {_LONGEST_CHAIN} are taken at most"]
    lost = [link for link in links if link not in reached]
    return [f"the links {', '.join(lost)} hang on each other in a circle"] if lost else []
