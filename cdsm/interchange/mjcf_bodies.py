"""Write bodies, joints, shapes and sites of an arm for MuJoCo, at the initial joint positions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from lxml import etree
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from cdsm.interchange.mjcf_motion import Carried
from cdsm.manipulator import Manipulator
from cdsm.posture import foot
from cdsm.support.values import Array
from cdsm.support.xml import parse_xml

_MASS, _INERTIA = 1e-6, 1e-9
"""Least mass [kg] and moment of inertia [kg m²] of a moving body in MuJoCo."""

_SMALLEST = 1e-12  # a smaller mass [kg] or moment of inertia [kg m²] of a body counts as zero

_ROUNDING = 1e-9
"""Relative margin, since MuJoCo refuses a moment of inertia above the sum of the other two."""

_JOINTS = {"revolute": "hinge", "prismatic": "slide"}
_SITE = 1e-3  # radius [m] of a drawn hole
_STICK = 0.008  # radius of a stick over the length of the arm
_GHOST = {"contype": "0", "conaffinity": "0", "mass": "0"}  # drawn, without mass or contacts


def add_bodies(root: etree._Element, arm: Manipulator, start: Mapping[str, float]) -> list[Carried]:
    """Add the tree of links to ``root``; return mass and inertia of each body that has a mass.

    The file has the links at the joint coordinates ``start`` [rad or m], by joint name. MuJoCo
    moves a joint by qpos − ref from its place in the file. Since ref is ``start``, a new ``mjData``
    begins with the joints at ``start``.
    """
    robot = parse_xml(arm.urdf, "robot")
    links = {str(link.get("name")): link for link in robot.findall("link")}
    joints = robot.findall("joint")
    below: dict[str, list[etree._Element]] = {name: [] for name in links}
    for joint in joints:
        below[joint.find("parent").get("link")].append(joint)
    carried = {joint.find("child").get("link") for joint in joints}
    (base,) = links.keys() - carried
    sites: dict[str, list[tuple[str, tuple[float, ...]]]] = {name: [] for name in links}
    for cable in arm.cables:
        for i, site in enumerate(cable.sites, start=1):
            sites[site.link].append((f"{cable.name}/{i}", site.position))

    world = etree.SubElement(root, "worldbody")
    # MuJoCo reserves the name world for its root
    bodies = {base: world if base == "world" else etree.SubElement(world, "body", name=base)}
    moving, queue = {base: False}, [base]
    masses: list[Carried] = []
    for name in queue:
        body = bodies[name]
        if body is not world:
            masses += _inertial(body, links[name], moving[name])
        drawn = [_shape(body, visual) for visual in links[name].findall("visual")]
        if not any(drawn):
            ends = [_origin(joint)[0] for joint in below[name]]
            _sticks(body, ends, [place for _, place in sites[name]], _STICK * arm.length)
        tip = [("tool0", (0.0, 0.0, 0.0))] if name == arm.tip_link else []
        for hole, position in sites[name] + tip:
            etree.SubElement(body, "site", name=hole, pos=row(position), size=repr(_SITE))
        for joint in below[name]:
            child, kind = joint.find("child").get("link"), _JOINTS.get(joint.get("type"))
            q = start.get(joint.get("name"), 0.0)
            bodies[child] = etree.SubElement(body, "body", name=child, **_placed(joint, kind, q))
            moving[child] = moving[name] or kind is not None
            if kind is not None:
                bodies[child].append(_joint(joint, kind, q))
            queue.append(child)
    return masses


def _joint(joint: etree._Element, kind: str, start: float) -> etree._Element:
    limit = joint.find("limit")
    made = {"name": joint.get("name"), "type": kind, "axis": row(_axis(joint))}
    made["range"] = f"{limit.get('lower', '0')} {limit.get('upper', '0')}"
    if start:
        made["ref"] = repr(start)
    return etree.Element("joint", made)


def _axis(joint: etree._Element) -> Array:
    axis = joint.find("axis")
    given = "1 0 0" if axis is None else axis.get("xyz")
    return np.array(given.split(), dtype=np.float64)


def _inertial(body: etree._Element, link: etree._Element, moves: bool) -> list[Carried]:
    """Write the mass and inertia of a link to its body; return them in a list of one entry.

    A massless link that ``moves`` gets 1e-6 kg and 1e-9 kg m²; its weight is compensated. For a
    massless link that does not move, nothing is written, and the list is empty.
    """
    inertial = link.find("inertial")
    mass = 0.0 if inertial is None else float(inertial.find("mass").get("value"))
    if inertial is not None and mass > _SMALLEST:
        place, turn = _origin(inertial)
        tensor = _inertia(inertial.find("inertia"), turn.as_matrix())
    elif moves:
        # tiny mass, its weight compensated
        body.set("gravcomp", "1")
        mass, place, tensor = _MASS, np.zeros(3), _INERTIA * np.eye(3)
    else:
        return []
    full = [tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2]]
    etree.SubElement(body, "inertial", pos=row(place), mass=repr(mass), fullinertia=row(full))
    return [Carried(str(link.get("name")), mass, place, tensor)]


def _inertia(inertia: etree._Element, R: Array) -> Array:
    """Read an inertia (3, 3) [kg m²], rotate it by R, and change moments that MuJoCo refuses.

    MuJoCo refuses zero moments, and a largest principal moment near the sum of the other two.
    """
    xx, yy, zz, xy, xz, yz = (
        float(inertia.get(key)) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    tensor: Array = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
    moments, axes = np.linalg.eigh(tensor)
    taken = np.maximum(moments, _INERTIA) if moments[0] < _SMALLEST else moments.copy()
    # first correct a needle: the largest moment must not fall below the second
    taken[0] = max(taken[0], 2.0 * _ROUNDING * taken[1])
    taken[2] = min(taken[2], (1.0 - _ROUNDING) * (taken[0] + taken[1]))
    if (taken == moments).all():
        return tensor
    return np.asarray(axes @ np.diag(taken) @ axes.T)


def _shape(body: etree._Element, visual: etree._Element) -> bool:
    """Add a geom for a cylinder, box or sphere of a URDF to a body; False for another shape."""
    shape = visual.find("geometry/*")
    if shape is None or shape.tag not in ("cylinder", "box", "sphere"):
        return False
    if shape.tag == "cylinder":
        size = [float(shape.get("radius")), float(shape.get("length")) / 2.0]
    elif shape.tag == "box":
        size = [float(x) / 2.0 for x in shape.get("size").split()]
    else:
        size = [float(shape.get("radius"))]
    etree.SubElement(body, "geom", type=shape.tag, size=row(size), **_placed(visual), **_GHOST)
    return True


def _sticks(
    body: etree._Element, ends: list[Array], sites: list[tuple[float, ...]], radius: float
) -> None:
    """Draw a body as capsules from its origin to ``ends``, the next joints [m], in its frame.

    A thinner capsule joins each of its ``sites`` [m] to the nearest of these. ``radius`` is in m.
    """
    lines = [np.array([np.zeros(3), end]) for end in ends if np.linalg.norm(end) > radius]
    bones = [(line, radius) for line in lines]
    for site in map(np.asarray, dict.fromkeys(sites)):
        feet = [foot(site, line) for line in lines] or [np.zeros(3)]
        nearest = min(feet, key=lambda each: float(np.linalg.norm(each - site)))
        if np.linalg.norm(nearest - site) > radius / 3.0:
            bones.append((np.array([nearest, site]), radius / 3.0))
    for line, thick in bones:
        etree.SubElement(body, "geom", type="capsule", fromto=row(line), size=repr(thick), **_GHOST)


def _placed(element: etree._Element, kind: str | None = None, start: float = 0.0) -> dict[str, str]:
    """Return the ``<origin>`` of an element of a URDF as MJCF attributes ``pos`` and ``quat``.

    If ``kind`` is ``hinge`` or ``slide``, the element is a joint of this kind; the pose is then
    that of the joint at the coordinate ``start`` [rad or m].
    """
    place, turn = _origin(element)
    if kind is not None and start:
        axis = _axis(element) / np.linalg.norm(_axis(element))
        if kind == "hinge":
            turn = turn * Rotation.from_rotvec(start * axis)
        else:
            place = place + turn.apply(start * axis)
    return {"pos": row(place), "quat": row(np.roll(turn.as_quat(), 1))}


def _origin(element: etree._Element) -> tuple[Array, Rotation]:
    origin = element.find("origin")
    given = {} if origin is None else origin.attrib
    xyz, rpy = (
        np.array(given.get(key, "0 0 0").split(), dtype=np.float64) for key in ("xyz", "rpy")
    )
    return xyz, Rotation.from_euler("xyz", rpy)


def row(values: ArrayLike) -> str:
    """Format numbers as the text of an MJCF attribute, exact to the last bit."""
    return " ".join(repr(float(x)) for x in np.ravel(values))
