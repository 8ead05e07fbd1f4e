"""Read URDFs of other programs.

Pinocchio drops a mass that has a blank behind it, accepts links with two parents, impossible
masses, zero axes and inverted limits, and prints the reason of a refusal only to standard error.
This module therefore checks the text, writes each number anew for Pinocchio, and compares the
masses and inertias that Pinocchio read with those of the text.
"""

from __future__ import annotations

import math
import os
from collections import Counter, defaultdict
from collections.abc import Iterator
from copy import deepcopy

import numpy as np
from lxml import etree
from lxml.builder import E

from cdsm.errors import LINES, InvalidInput, UrdfError, listed
from cdsm.geometry import MAXIMUM_JOINTS
from cdsm.rigid_body import RigidBody, accepts, pseudo_inertia
from cdsm.support.files import read_text
from cdsm.support.validation import RANGES, flag
from cdsm.support.values import Array
from cdsm.support.warning import warn
from cdsm.support.xml import XmlFault, numbers, parse_xml

_INSTEAD = {
    "continuous": "write it as revolute with a <limit>; one angle per joint is needed",
    "floating": "fix the base to the world; a floating base has no stiffness",
    "planar": "write it as two prismatic and one revolute joint",
    "spherical": "write it as three revolute joints",
}
_NUMBERS = {  # attributes of an element, and how many numbers each has
    "mass": ("value", 1),
    "inertia": ("ixx ixy ixz iyy iyz izz", 1),
    "origin": ("xyz rpy", 3),
    "axis": ("xyz", 3),
    "limit": ("lower upper effort velocity", 1),
    "dynamics": ("damping friction", 1),
    "box": ("size", 3),
    "cylinder": ("radius length", 1),
    "sphere": ("radius", 1),
    "mesh": ("scale", 3),
}
_NEEDED = {"mass": "value", "inertia": _NUMBERS["inertia"][0], "axis": "xyz"}
_NEEDED |= {"limit": "effort velocity", "parent": "link", "child": "link"}
_INSIDE = {"joint": ("parent", "child"), "inertial": ("mass", "inertia")}
_MODEL = ("inertial", "parent", "child", "origin", "axis", "limit", "dynamics", "mimic")
_MOST_LINKS = 2000  # Pinocchio compares the name of each link with all others
_LONGEST_CHAIN = 400  # joints in series, fixed ones included; 4000 crash Pinocchio
_LOOSE = 1e-2  # people round inertias; relative to the largest principal moment
_ROUNDING = 1e-9  # relative difference of the masses and inertias that Pinocchio reads


def read_urdf(source: str | os.PathLike[str], *, check_inertia: bool = True) -> str:
    """Check a URDF and return its text with all numbers written anew, without comments.

    ``source`` is a path, or the text if it begins with ``<``. Arguments and errors are those of
    :meth:`cdsm.Manipulator.from_urdf`.
    """
    flag("check_inertia", check_inertia)
    if not isinstance(source, (str, os.PathLike)) or source == "":
        raise InvalidInput("urdf", f"{source!r:.100} given; the path of a URDF or its text needed.")
    inline = isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<")
    text = (str(source) if inline else read_text(source)).lstrip("\ufeff \t\r\n")
    name = "the URDF" if inline else os.fspath(source)
    try:
        robot = parse_xml(text, "robot")
    except XmlFault as error:
        mjcf = " It is a MuJoCo model (MJCF): give the URDF that it was made from."
        raise UrdfError(f"{name}: {error}.{mjcf if '<mujoco>' in str(error) else ''}") from None
    if any("xacro" in (etree.QName(each).namespace or "") for each in robot.iter("*")):
        raise UrdfError(f"{name} is a xacro file; run xacro on it first, and give what it prints.")
    links, joints = robot.findall("link"), robot.findall("joint")
    faults = [] if robot.get("name") else ["<robot> has no name"]
    faults += _text_faults([*links, *joints])
    faults = faults or [*_link_faults(links, check_inertia), *_joint_faults(joints)]
    faults = faults or _tree_faults([str(link.get("name")) for link in links], joints)
    text = str(etree.tostring(robot, encoding="unicode"))
    faults = faults or [*_reading_faults(text, links, joints)]
    if faults:
        raise UrdfError(f"{name} is no robot that cdsm takes:{listed(faults, 20, LINES)}")
    return text


def _text_faults(parts: list[etree._Element]) -> Iterator[str]:
    """Write all numbers of links and joints anew; yield what is wrong with names and numbers."""
    for (tag, name), count in Counter((part.tag, part.get("name")) for part in parts).items():
        if not name or count > 1:
            yield f"{tag} {name}: the name is used twice" if name else f"a <{tag}> has no name"
    for part in parts:
        found, tags = [], Counter(child.tag for child in part)
        found += [f"has {tags[tag]} <{tag}>; one is needed" for tag in _MODEL if tags[tag] > 1]
        for holder in (part, *part.findall("inertial")):
            needed = _INSIDE.get(holder.tag, ())
            found += [f"has no <{tag}>" for tag in needed if holder.find(tag) is None]
        for child in part:
            faults = [fault for element in child.iter("*") for fault in _number_faults(element)]
            found += faults if child.tag in _MODEL else []
        yield from (f"{part.tag} {part.get('name')}: {fault}" for fault in found)


def _number_faults(element: etree._Element) -> Iterator[str]:
    for key in _NEEDED.get(element.tag, "").split():
        if not element.get(key):
            remedy = f'; write {key}="0" if it is unknown' if element.tag == "limit" else ""
            yield f"<{element.tag}> has no {key}{remedy}"
    keys, count = _NUMBERS.get(element.tag, ("", 0))
    for key in keys.split():
        if text := element.get(key):
            try:
                values = numbers(f"{key} of <{element.tag}>", text, count)
                element.set(key, " ".join(map(repr, values)))
            except XmlFault as error:
                yield str(error)


def _vector(element: etree._Element | None, key: str, default: str = "0 0 0") -> Array:
    text = default if element is None else element.get(key) or default
    return np.array([float(word) for word in text.split()])


def _inertial(link: etree._Element) -> tuple[float, Array, Array]:
    """Return mass, centre (3,) and inertia (3, 3) about the centre, in the axes of the link."""
    from scipy.spatial.transform import Rotation  # slow to import

    inertial = link.find("inertial")
    if inertial is None:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    origin, inertia = inertial.find("origin"), inertial.find("inertia")
    keys = [[f"i{min(a, b)}{max(a, b)}" for b in "xyz"] for a in "xyz"]
    own = np.array([[float(inertia.get(key)) for key in row] for row in keys])
    turn = Rotation.from_euler("xyz", _vector(origin, "rpy")).as_matrix()
    mass = float(inertial.find("mass").get("value"))
    return mass, _vector(origin, "xyz"), turn @ own @ turn.T


def _link_faults(links: list[etree._Element], check_inertia: bool) -> Iterator[str]:
    for link in links:
        mass, _, inertia = _inertial(link)
        least, mid, most = np.linalg.eigvalsh(inertia).tolist()
        if not 0.0 <= mass <= RANGES["mass"].high:
            yield f"link {link.get('name')}: mass {mass:g} kg; 0 to 1e6 kg is needed"
        if check_inertia and least + mid - most < -_LOOSE * max(most, -least):
            yield (
                f"link {link.get('name')}: principal moments of inertia {least:g}, {mid:g}, "
                f"{most:g} kg m², which no body has: none is negative, nor larger than the sum of "
                "the others. Stiffness does not need them: check_inertia=False lets them pass"
            )


def _joint_faults(joints: list[etree._Element]) -> Iterator[str]:
    moving = [joint for joint in joints if joint.get("type") in ("revolute", "prismatic")]
    if not 0 < len(moving) <= 2 * MAXIMUM_JOINTS:
        yield f"has {len(moving)} joints that move; 1 to {2 * MAXIMUM_JOINTS} are needed"
    for joint in joints:
        where, kind, limit = f"joint {joint.get('name')}", joint.get("type"), joint.find("limit")
        if joint not in moving and kind != "fixed":
            remedy = _INSTEAD.get(str(kind), "one of revolute, prismatic, fixed is needed")
            yield f"{where}: type {kind!r} is not supported; {remedy}"
        if joint.find("mimic") is not None:
            yield f"{where}: mimics another joint, which is not supported; remove <mimic>"
        if abs(_vector(joint.find("origin"), "xyz")).max() > RANGES["length"].high:
            yield f"{where}: its origin is further than {RANGES['length'].high:g} m away"
        if joint in moving and np.linalg.norm(_vector(joint.find("axis"), "xyz", "1 0 0")) < 1e-6:
            yield f"{where}: its axis has no direction"
        low, high = (_vector(limit, key, "0").item() for key in ("lower", "upper"))
        if joint in moving and (limit is None or low > high):
            fault = "has no <limit>" if limit is None else f"lower limit {low:g} above {high:g}"
            yield f"{where}: {fault}; a {kind} joint needs both ends"
        elif kind == "revolute" and max(abs(low), abs(high)) > 4.0 * math.pi:
            warn(
                f"{where}: limits {low:g} to {high:g} rad are more than two turns. Degrees? In "
                f"radians they are {math.radians(low):.4g} to {math.radians(high):.4g}."
            )


def _ends(joint: etree._Element) -> tuple[str, str]:
    return str(joint.find("parent").get("link")), str(joint.find("child").get("link"))


def _tree_faults(links: list[str], joints: list[etree._Element]) -> list[str]:
    """Return what is wrong: unknown links, two parents or roots, circles, too many in series."""
    if len(links) > _MOST_LINKS:
        return [f"has {len(links)} links; {_MOST_LINKS} are taken at most"]
    faults, carriers, children = [], defaultdict(list), defaultdict(list)
    for joint in joints:
        name, (parent, child) = joint.get("name"), _ends(joint)
        unknown = [link for link in (parent, child) if link not in links]
        faults += [f"joint {name}: there is no link {link}" for link in unknown]
        faults += [f"joint {name}: joins link {child} to itself"] if parent == child else []
        carriers[child].append(str(name))
        children[parent].append(child)
    twice = [(child, " and ".join(by)) for child, by in carriers.items() if len(by) > 1]
    faults += [f"link {child}: has two parents, by the joints {by}" for child, by in twice]
    roots = [link for link in links if link not in carriers]
    if faults or len(roots) != 1:
        said = f"has the roots {listed(roots) or 'none'}; one link that no joint carries is needed"
        return faults or [said]
    reached, level, depth = set(roots), roots, -1
    while level:
        level, depth = [child for link in level for child in children[link]], depth + 1
        reached.update(level)
    if depth > _LONGEST_CHAIN:
        return [f"has {depth} joints one behind the other; {_LONGEST_CHAIN} are taken at most"]
    lost = [link for link in links if link not in reached]
    return [f"the links {', '.join(lost)} hang on each other in a circle"] if lost else []


def _reading_faults(
    text: str, links: list[etree._Element], joints: list[etree._Element]
) -> Iterator[str]:
    """Yield what Pinocchio refuses or reads otherwise; warn of moving links without mass."""
    bodies = {str(link.get("name")): pseudo_inertia(*_inertial(link)) for link in links}
    root = next(link for link in bodies if link not in {_ends(joint)[1] for joint in joints})
    try:
        arm = RigidBody(text, root, np.zeros(3))
    except UrdfError as error:
        for joint in joints:
            alone = E.robot(*(E.link(name=end) for end in _ends(joint)), deepcopy(joint), name="r")
            if not accepts(etree.tostring(alone, encoding="unicode")):
                yield f"joint {joint.get('name')}: {error}"
        yield str(error)
        return
    given, names = np.zeros((1 + arm.nv, 4, 4)), defaultdict(list)
    for link, body in bodies.items():
        row, place = arm.locate(link)[0], np.eye(4)
        place[:3, :3], place[:3, 3] = arm.locate(link)[1:]
        given[row] += place @ body @ place.T
        names[row].append(link)
    for row, (ours, theirs) in enumerate(zip(given, arm.pseudo_inertias(), strict=True)):
        size = np.sqrt([abs(ours.diagonal()[:3]).max()] * 3 + [ours[3, 3]])
        if (abs(theirs - ours) > _ROUNDING * np.outer(size, size)).any():
            masses = f"{theirs[3, 3]:g} kg instead of {ours[3, 3]:g} kg"
            yield f"link {listed(names[row])}: Pinocchio read {masses}, or another inertia"
    turning = [joint for joint in joints if joint.get("type") != "fixed"]
    # the cross of a universal joint has no length and may have no mass
    crosses = {_ends(j)[0] for j in turning if not _vector(j.find("origin"), "xyz").any()}
    massless = [link for row in names if row and not given[row, 3, 3] for link in names[row]]
    if bare := [link for link in massless if link not in crosses]:
        warn(f"links that move without mass: {listed(bare)}. Gravity does not act on them.")
