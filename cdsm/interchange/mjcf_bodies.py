"""Write bodies, joints, shapes and sites of an arm for MuJoCo, at the initial posture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from lxml import etree
from scipy.spatial.transform import Rotation

from cdsm.interchange.mjcf_cables import GHOST, Side, add_entries, row
from cdsm.joints import Coupling
from cdsm.manipulator import Manipulator
from cdsm.support.files import parse_xml
from cdsm.support.values import Array

_MASS = 1e-6  # of bodies without mass in MuJoCo [kg], [kg m²]
LEAST_INERTIA = 1e-9
_SMALLEST = 1e-12  # a smaller mass [kg] or moment of inertia [kg m²] of a body counts as zero
_ROUNDING = 1e-9  # relative; MuJoCo refuses a moment of inertia above the sum of the other two
_TIP = 1e-3  # radius of the drawn tip [m]
_STICK = 0.008  # radius of a drawn link, over the length of the arm


def add_bodies(
    root: etree._Element,
    arm: Manipulator,
    start: Mapping[str, float],
    sides: list[Side],
    springs: Mapping[str, tuple[float, float]],
) -> None:
    """Add the tree of links to ``root``; ``sides`` are the side sites of all pulleys.

    ``springs`` have the stiffness and the free angle of each joint.

    The file has the links at the joint coordinates ``start`` [rad or m], by joint name. MuJoCo
    moves a joint by qpos − ref from its place in the file. Since ref is ``start``, a new ``mjData``
    begins with the joints at ``start``.
    """
    robot = parse_xml(arm.urdf, "robot")
    links = {str(link.get("name")): link for link in robot.findall("link")}
    joints = robot.findall("joint")
    (base,) = links.keys() - {joint.find("child").get("link") for joint in joints}
    world = etree.SubElement(root, "worldbody")
    # MuJoCo reserves the name world for its root
    bodies = {base: world if base == "world" else etree.SubElement(world, "body", name=base)}
    for name in (queue := [base]):
        body = bodies[name]
        link = links[name]
        below = [joint for joint in joints if joint.find("parent").get("link") == name]
        if body is not world:
            _add_inertia(body, link)
        drawn = [_shape(body, visual) for visual in link.findall("visual")]
        if not any(drawn):
            thick = _STICK * arm.length
            for end in [_place(joint)[0] for joint in below]:
                if np.linalg.norm(end) > thick:
                    line = {"fromto": f"0 0 0 {row(end)}", "size": repr(thick)}
                    etree.SubElement(body, "geom", type="capsule", **line, **GHOST)
        add_entries(body, name, arm, sides)
        if name == arm.tip_link:
            etree.SubElement(body, "site", name="tool0", pos=row((0.0, 0.0, 0.0)), size=repr(_TIP))
        for joint in below:
            child = joint.find("child").get("link")
            turns = joint.get("type") != "prismatic"
            queue.append(child)
            bodies[child] = etree.SubElement(body, "body", name=child)
            place, turn = _place(joint)
            if joint.get("type") != "fixed":
                axis = _numbers(joint.find("axis"), "xyz", "1 0 0")
                limit = joint.find("limit")
                q = start.get(joint.get("name"), 0.0)
                moved = q * axis / np.linalg.norm(axis)
                place = place if turns else place + turn.apply(moved)
                turn = turn * Rotation.from_rotvec(moved) if turns else turn
                of_joint = {"name": joint.get("name"), "type": "hinge" if turns else "slide"}
                of_joint |= {"axis": row(axis), "ref": repr(q)}
                if joint.get("type") != "continuous":
                    of_joint["range"] = f"{limit.get('lower', '0')} {limit.get('upper', '0')}"
                k, free = springs[joint.get("name")]
                if k:
                    of_joint |= {"stiffness": repr(k), "springref": repr(free)}
                etree.SubElement(bodies[child], "joint", of_joint)
            bodies[child].attrib.update(_placed(place, turn))


def _add_inertia(body: etree._Element, link: etree._Element) -> None:
    """Write the inertia of a link, or one that MuJoCo accepts; without mass it has no weight."""
    inertial = link.find("inertial")
    mass = 0.0 if inertial is None else float(inertial.find("mass").get("value"))
    if mass <= _SMALLEST:
        body.set("gravcomp", "1")
        least = {"mass": repr(_MASS), "diaginertia": row([LEAST_INERTIA] * 3)}
        etree.SubElement(body, "inertial", pos="0 0 0", **least)
        return
    (place, turn) = _place(inertial)
    inertia = inertial.find("inertia")
    R = turn.as_matrix()
    keys = [[f"i{min(a, b)}{max(a, b)}" for b in "xyz"] for a in "xyz"]
    tensor = R @ np.array([[float(inertia.get(key)) for key in row] for row in keys]) @ R.T
    moments, axes = np.linalg.eigh(tensor)
    taken = np.maximum(moments, LEAST_INERTIA) if moments[0] < _SMALLEST else moments.copy()
    # first correct a needle: the largest moment must not fall below the second
    taken[0] = max(taken[0], 2.0 * _ROUNDING * taken[1])
    taken[2] = min(taken[2], (1.0 - _ROUNDING) * (taken[0] + taken[1]))
    if not (taken == moments).all():
        tensor = axes * taken @ axes.T
    full = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    etree.SubElement(body, "inertial", pos=row(place), mass=repr(mass), fullinertia=row(full))


def _shape(body: etree._Element, visual: etree._Element) -> bool:
    """Add a geom for a cylinder, box or sphere of a URDF to a body; False for another shape."""
    shape = visual.find("geometry/*")
    if shape is None or shape.tag not in ("cylinder", "box", "sphere"):
        return False
    size = _numbers(shape, "size") / 2.0
    if shape.tag != "box":
        size = np.array([float(shape.get("radius")), float(shape.get("length", "0")) / 2.0])
    look = {"type": shape.tag, "size": row(size), **_placed(*_place(visual))}
    etree.SubElement(body, "geom", **look, **GHOST)
    return True


def _numbers(element: etree._Element | None, key: str, default: str = "0 0 0") -> Array:
    text = default if element is None else element.get(key, default)
    return np.array(text.split(), dtype=np.float64)


def _place(element: etree._Element) -> tuple[Array, Rotation]:
    origin = element.find("origin")
    return _numbers(origin, "xyz"), Rotation.from_euler("xyz", _numbers(origin, "rpy"))


def _placed(place: Array, turn: Rotation) -> dict[str, str]:
    return {"pos": row(place), "quat": row(np.roll(turn.as_quat(), 1))}


def add_loads(root: etree._Element, arm: Manipulator) -> int:
    """Add an actuator for each load that belongs to the arm, and return their number.

    An actuator between a site and a reference site of the world has its force and moment in the
    axes of the latter; its bias needs no ``ctrl``.
    """
    if not arm.own_loads:
        return 0
    bodies = {body.get("name"): body for body in root.iter("body", "worldbody")}
    size = repr(_TIP)
    etree.SubElement(bodies[None], "site", name="load/axes", pos=row((0.0, 0.0, 0.0)), size=size)
    for number, (at, wrench) in enumerate(arm.own_loads, start=1):
        name = f"load/{number}"
        body = bodies.get(at.link, bodies[None])
        etree.SubElement(body, "site", name=name, pos=row(at.local), size=size)
        force = {"gear": row(wrench), "gainprm": "0", "biastype": "affine", "biasprm": "1 0 0"}
        sites = {"name": name, "site": name, "refsite": "load/axes"}
        etree.SubElement(root.find("actuator"), "general", sites | force)
    return len(arm.own_loads)


def couple(
    root: etree._Element, coupling: Coupling, names: Sequence[str], time_step: float
) -> None:
    """Add an equation for each joint that follows another one, from the initial positions.

    It is as stiff as the time step allows: MuJoCo's own would yield by radians under the cables.
    """
    equations = etree.SubElement(root, "equality")
    stiff = {"solref": f"{2.0 * time_step!r} 1", "solimp": "0.9999 0.9999 0.001 0.5 2"}
    for i, name in enumerate(names):
        if i not in coupling.leaders:
            line = {"joint1": name, "polycoef": "0 0 0 0 0"}  # that of a joint which stays
            for j in np.flatnonzero(coupling.matrix[i]):
                line["joint2"] = names[coupling.leaders[j]]
                line["polycoef"] = f"0 {float(coupling.matrix[i, j])!r} 0 0 0"
            etree.SubElement(equations, "joint", line | stiff)
