"""Read models of CASPR, the MATLAB simulator of cable-driven robots, as a manipulator.

CASPR (D. Lau et al., Cable-Driven Parallel Robots, Springer 2016) describes a robot by two XML
files: rigid links with their joints, and sets of cables between points on the links.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.cable import Cable, Site
from cdsm.errors import CableError, FileError, InvalidInput, UnknownName
from cdsm.interchange.caspr_bodies import BASE, Body, read_bodies, read_root, refuse, whole
from cdsm.manipulator import GRAVITY, Manipulator
from cdsm.support.files import as_path
from cdsm.support.xml import XmlFault, numbers
from cdsm.urdf import TIP, E, inertial, joint, origin, urdf_text
from cdsm.wires.elasticity import Elasticity

if TYPE_CHECKING:
    from lxml import etree

_COMMENT: Final = "\n  Made by cdsm from a CASPR model. Units: m, rad, kg.\n"


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
        InvalidInput: ``elasticity`` is not an Elasticity, or ``cables`` is missing.
        FileError: A file cannot be read, is not a CASPR model, or has parts that cannot be mapped:
            other joints, cables that are not ideal, pulleys. Every such part is named.
        UrdfError: A link has impossible moments of inertia.
        UnknownName: The set of cables does not exist.
        CableError: A cable cannot be routed.
    """
    if not isinstance(elasticity, Elasticity):
        raise InvalidInput("elasticity", f"{elasticity!r} given; an Elasticity is needed.")
    bodies_file, cables_file = _files(bodies, cables)
    links = read_bodies(bodies_file)
    routed = _read_cables(cables_file, links, elasticity, cable_set)
    urdf = _urdf(bodies_file.stem.removesuffix("_bodies"), links)
    return Manipulator.from_urdf(
        urdf,
        routed,
        tip=TIP,
        joint_names=[name for link in links for name in link.joint_names],
        gravity=gravity,
        check_inertia=check_inertia,
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


# --- cables ---------------------------------------------------------------------------------


def _read_cables(
    path: Path, bodies: Sequence[Body], elasticity: Elasticity, wanted: str | None
) -> tuple[Cable, ...]:
    root = read_root(path, "cables", "cables")
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
    """Return ``name``, or the first of ``name #2``, ``name #3``, … that is not in ``used``.

    Add the result to ``used``.
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
            f"<{element.tag}> {name}: only <cable_ideal> is supported; give the elasticity here"
        )
    reference = element.get("attachment_reference")
    if reference not in ("com", "joint"):
        raise XmlFault(f"{name}: attachment_reference {reference!r}; com or joint is needed")
    low, high = (
        numbers(f"{name}: <{key}>", element.findtext(f"properties/{key}"), 1)[0]
        for key in ("force_min", "force_max")
    )
    sites = []
    for place in element.findall("attachments/*"):
        if place.tag != "attachment":
            raise XmlFault(f"{name}: <{place.tag}> is not supported; a cable passes points only")
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


# --- URDF -----------------------------------------------------------------------------------


def _urdf(name: str, bodies: Sequence[Body]) -> str:
    """Return the URDF text of a robot with ``bodies`` as links; ``tool0`` ends the last one."""
    links, joints = [E.link(name=BASE)], []
    names = [BASE, *(body.name for body in bodies)]
    for body in bodies:
        parent, place = names[body.parent], body.place
        for i, each in enumerate(body.joints, start=1):
            # single joints of one link need massless links between them
            child = body.name if i == len(body.joints) else f"{body.name}_{i}"
            axis = E.axis(xyz=each.axis)
            limit = E.limit(effort=0.0, velocity=0.0, lower=each.lower, upper=each.upper)
            joints.append(joint(each.kind, each.name, parent, child, origin(place), axis, limit))
            links.append(E.link(name=child))
            parent, place = child, np.zeros(3)
        if body.mass:
            links[-1].append(inertial(body.mass, body.inertia, origin(body.centre)))
    links.append(E.link(name=TIP))
    joints.append(joint("fixed", f"{TIP}_joint", names[-1], TIP, origin(bodies[-1].end)))
    return urdf_text(name or "caspr", [*links, *joints], _COMMENT)
