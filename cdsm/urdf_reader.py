"""Read URDFs of other programs.

Pinocchio drops a whole <inertial> whose mass has a blank behind it, accepts links with two parents,
impossible masses, zero axes and inverted limits, and prints why it refuses a file only to standard
error. So the text is checked, each number is written anew, and the masses that were read compared.
"""

from __future__ import annotations

import math
import os
from collections import Counter, defaultdict
from collections.abc import Iterator

import numpy as np
from lxml import etree

from cdsm.errors import LINES, GeometryError, InvalidInput, listed, warn
from cdsm.geometry import MAXIMUM_JOINTS
from cdsm.rigid_body import RigidBody
from cdsm.support.files import XmlFault, parse_xml, read_numbers, read_text
from cdsm.support.validation import RANGES, flag
from cdsm.support.values import Array

_INSTEAD = {
    "floating": "fix the base to the world; a floating base has no stiffness",
    "planar": "write it as two prismatic and one revolute joint",
    "spherical": "write it as three revolute joints",
}
_MOVING = "revolute", "prismatic", "continuous"
_ONE = "value ixx ixy ixz iyy iyz izz lower upper effort velocity damping friction radius length "
_ONE += "multiplier offset"
_COUNTS = dict.fromkeys(_ONE.split(), 1) | dict.fromkeys(("xyz", "rpy", "size", "scale"), 3)
_NEEDED = {"mass": "value", "inertia": "ixx ixy ixz iyy iyz izz", "axis": "xyz"}
_NEEDED |= {"limit": "effort velocity", "parent": "link", "child": "link", "mimic": "joint"}
_INSIDE = {"joint": ("parent", "child"), "inertial": ("mass", "inertia")}
_MODEL = ("inertial", "parent", "child", "origin", "axis", "limit", "dynamics", "mimic")
_MOST_LINKS = 2000  # Pinocchio compares the name of each link with all others
_LONGEST_CHAIN = 400  # joints in series, fixed ones included; 4000 crash Pinocchio
_LOOSE = 1e-2  # people round inertias; relative to the largest principal moment
_ROUNDING = 1e-9  # relative difference of the masses that Pinocchio reads


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
        raise GeometryError(f"{name}: {error}.{mjcf if '<mujoco>' in str(error) else ''}") from None
    if any("xacro" in (etree.QName(element).namespace or "") for element in robot.iter("*")):
        raise GeometryError(
            f"{name} is a xacro file; run xacro on it first, and give what it prints."
        )
    links = robot.findall("link")
    joints = robot.findall("joint")
    faults = [] if robot.get("name") else ["<robot> has no name"]
    faults += _text_faults([*links, *joints])
    faults = faults or [*_link_faults(links, check_inertia), *_joint_faults(joints)]
    faults = faults or _tree_faults([str(link.get("name")) for link in links], joints)
    faults = faults or [*_reading_faults(robot)]
    if faults:
        raise GeometryError(f"{name} is no robot that cdsm takes:{listed(faults, 20, LINES)}")
    return str(etree.tostring(robot, encoding="unicode"))


def _text_faults(parts: list[etree._Element]) -> Iterator[str]:
    """Write all numbers of links and joints anew; yield what is wrong with names and numbers."""
    for (tag, name), count in Counter((part.tag, part.get("name")) for part in parts).items():
        if not name or count > 1:
            yield f"{tag} {name}: the name is used twice" if name else f"a <{tag}> has no name"
    for part in parts:
        tags = Counter(child.tag for child in part)
        part_faults = [f"has {tags[tag]} <{tag}>; one is needed" for tag in _MODEL if tags[tag] > 1]
        for holder in (part, *part.findall("inertial")):
            needed = _INSIDE.get(holder.tag, ())
            part_faults += [f"has no <{tag}>" for tag in needed if holder.find(tag) is None]
        for child in part:
            faults = [fault for element in child.iter("*") for fault in _number_faults(element)]
            part_faults += faults if child.tag in _MODEL else []
        yield from (f"{part.tag} {part.get('name')}: {fault}" for fault in part_faults)


def _number_faults(element: etree._Element) -> Iterator[str]:
    for key in _NEEDED.get(element.tag, "").split():
        if not element.get(key):
            remedy = f'; write {key}="0" if it is unknown' if element.tag == "limit" else ""
            yield f"<{element.tag}> has no {key}{remedy}"
    for key in (key for key in element.attrib if key in _COUNTS):
        try:
            values = read_numbers(f"{key} of <{element.tag}>", element.get(key), _COUNTS[key])
            element.set(key, " ".join(map(repr, values)))
        except XmlFault as error:
            ends = "; a joint without ends is continuous" if element.tag == "limit" else ""
            yield f"{error}{ends}"


def _number(element: etree._Element | None, key: str) -> float:
    return 0.0 if element is None else float(element.get(key) or 0.0)


def _vector(element: etree._Element | None, default: str = "0 0 0") -> Array:
    text = default if element is None else element.get("xyz") or default
    return np.array([float(word) for word in text.split()])


def _masses(links: list[etree._Element]) -> dict[str, float]:
    return {str(link.get("name")): _number(link.find("inertial/mass"), "value") for link in links}


def _link_faults(links: list[etree._Element], check_inertia: bool) -> Iterator[str]:
    for link, (name, mass) in zip(links, _masses(links).items(), strict=True):
        if not 0.0 <= mass <= RANGES["mass"].high:
            yield f"link {name}: mass {mass:g} kg; 0 to 1e6 kg is needed"
        inertial = link.find("inertial/inertia")
        inertia = [[_number(inertial, "i" + min(a + b, b + a)) for b in "xyz"] for a in "xyz"]
        least, mid, most = np.linalg.eigvalsh(inertia).tolist()
        if check_inertia and least + mid - most < -_LOOSE * max(most, -least):
            yield (
                f"link {name}: principal moments of inertia {least:g}, {mid:g}, {most:g} kg m², "
                "which no body has: none is negative, nor larger than the sum of the others. "
                "Stiffness does not need them: accept them by check_inertia=False in Python, "
                "check_inertia = false in [urdf] of ARM.toml, or cdsm new --no-check-inertia"
            )


def _joint_faults(joints: list[etree._Element]) -> Iterator[str]:
    moving = [joint for joint in joints if joint.get("type") in _MOVING]
    if not 0 < len(moving) <= 2 * MAXIMUM_JOINTS:
        yield f"has {len(moving)} joints that move; 1 to {2 * MAXIMUM_JOINTS} are needed"
    for joint in joints:
        where = f"joint {joint.get('name')}"
        kind = joint.get("type")
        limit = joint.find("limit")
        if joint not in moving and kind != "fixed":
            remedy = _INSTEAD.get(
                str(kind), "one of revolute, continuous, prismatic, fixed is needed"
            )
            yield f"{where}: type {kind!r} is not supported; {remedy}"
        if abs(_vector(joint.find("origin"))).max() > RANGES["length"].high:
            yield f"{where}: its origin is further than {RANGES['length'].high:g} m away"
        if joint in moving and np.linalg.norm(_vector(joint.find("axis"), "1 0 0")) < 1e-6:
            yield f"{where}: its axis has no direction"
        _doubt_rotation(where, joint.find("origin"))
        low, high = (_number(limit, key) for key in ("lower", "upper"))
        if kind == "continuous":
            continue
        if joint in moving and (limit is None or low > high):
            fault = "has no <limit>" if limit is None else f"lower limit {low:g} above {high:g}"
            yield f"{where}: {fault}; a {kind} joint needs both ends"
        elif kind == "revolute" and max(abs(low), abs(high)) > 4.0 * math.pi:
            degrees = f"in radians they are {math.radians(low):.4g} to {math.radians(high):.4g}"
            warn(f"{where}: limits {low:g} to {high:g} rad are over two turns. Degrees? {degrees}.")


def _doubt_rotation(where: str, origin: etree._Element | None) -> None:
    """Warn of an rpy that is more than a turn, as if in degrees."""
    text = "0" if origin is None else origin.get("rpy") or "0"
    turns = [float(word) for word in text.split()]
    if max(map(abs, turns)) > 2.0 * math.pi + _LOOSE:
        radians = " ".join(f"{math.radians(turn):.4g}" for turn in turns)
        degrees = " ".join(f"{turn:g}" for turn in turns)
        warn(f"{where}: rpy {degrees} of its origin is over a turn. Degrees? {radians} rad.")


def _ends(joint: etree._Element) -> tuple[str, str]:
    return str(joint.find("parent").get("link")), str(joint.find("child").get("link"))


def _tree_faults(links: list[str], joints: list[etree._Element]) -> list[str]:
    """Return what is wrong: unknown links, two parents or roots, circles, too many in series."""
    if len(links) > _MOST_LINKS:
        return [f"has {len(links)} links; {_MOST_LINKS} are taken at most"]
    faults = []
    carriers = defaultdict(list)
    for joint in joints:
        name = str(joint.get("name"))
        ends = _ends(joint)
        faults += [f"joint {name}: there is no link {link}" for link in ends if link not in links]
        faults += [f"joint {name}: joins link {ends[1]} to itself"] * (ends[0] == ends[1])
        carriers[ends[1]].append((name, ends[0]))
    for link, by in carriers.items():
        problem = (
            f"link {link}: has two parents, by the joints {' and '.join(name for name, _ in by)}"
        )
        faults += [problem] * (len(by) > 1)
    roots = [link for link in links if link not in carriers]
    if faults or len(roots) != 1:
        problem = (
            f"has the roots {listed(roots) or 'none'}; one link that no joint carries is needed"
        )
        return faults or [problem]
    depths = {roots[0]: 0}
    while level := [x for x in links if x not in depths and carriers[x][0][1] in depths]:
        depths |= {link: 1 + depths[carriers[link][0][1]] for link in level}
    if lost := [link for link in links if link not in depths]:
        faults += [f"the links {', '.join(lost)} hang on each other in a circle"]
    if (deepest := max(depths.values())) > _LONGEST_CHAIN:
        count = f"{deepest} joints one behind the other"
        faults += [f"has {count}; {_LONGEST_CHAIN} are taken at most"]
    return faults


def _reading_faults(robot: etree._Element) -> Iterator[str]:
    """Yield what Pinocchio refuses or reads otherwise; warn of moving links without mass."""
    masses = _masses(robot.findall("link"))
    joints = robot.findall("joint")
    root = next(link for link in masses if link not in {_ends(joint)[1] for joint in joints})
    try:
        arm = RigidBody(etree.tostring(robot, encoding="unicode"), root, np.zeros(3))
    except GeometryError as error:
        yield str(error)
        return
    turning = [joint for joint in joints if joint.get("type") != "fixed"]
    # the cross of a universal joint has no length and may have no mass
    crosses = {_ends(joint)[0] for joint in turning if not _vector(joint.find("origin")).any()}
    bare: list[str] = []
    for row, read in enumerate(arm.arrays().mass):
        names = [link for link in masses if arm.locate(link)[0] == row]
        mass = sum(masses[link] for link in names)
        if abs(read - mass) > _ROUNDING * mass:
            yield f"link {listed(names)}: Pinocchio read {read:g} kg instead of {mass:g} kg"
        bare += [name for name in names if row and not mass and name not in crosses]
    if bare:
        warn(f"links that move without mass: {listed(bare)}. Gravity does not act on them.")
