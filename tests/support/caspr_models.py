"""Cable lengths of a CASPR model from its XML alone: q in the file's order, no arm of ours in it.

CASPR's joint types are those of D. Lau et al., "CASPR", IROS 2016, and of its ``JointType``: each
moves its link by a way in the parent's axes, then turns it; ``FIXED`` angles are about the axes of
the parent, ``EULER`` and ``U`` angles about those that turn with the link.
"""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from cdsm.support.values import Array


def coordinates(kind: str) -> int:
    """How many coordinates a joint has: as many as its name has letters, but for two kinds."""
    if kind.endswith("_AXIS"):
        return 1
    letters = len(kind.rsplit("_", 1)[1])
    return letters + {"PLANAR": 1, "SPATIAL": 3}.get(kind.split("_")[0], 0)


def motion(kind: str, axis: str | None, q: Array) -> tuple[Array, Array]:
    """Way (3,) [m] and rotation (3, 3) of a link against its parent."""
    family, letters = kind.split("_")[0], kind.rsplit("_", 1)[1]
    still, level = np.zeros(3), np.eye(3)
    if kind.endswith("_AXIS"):
        along = np.array([float(word) for word in str(axis).split()])
        along /= np.linalg.norm(along)
        if family == "P":
            return q[0] * along, level
        return still, Rotation.from_rotvec(q[0] * along).as_matrix()
    moved = still.copy()
    if family in ("P", "T", "PLANAR", "SPATIAL"):
        moved[["XYZ".index(letter) for letter in letters]] = q[: len(letters)]
    if family in ("P", "T"):
        return moved, level
    if family == "PLANAR":
        (normal,) = set("XYZ") - set(letters)
        return moved, Rotation.from_euler(normal, q[2]).as_matrix()
    angles = q[3:] if family == "SPATIAL" else q
    # scipy turns about moving axes where letters are large, about fixed ones where small
    axes = letters.lower() if kind == "S_FIXED_XYZ" else letters
    return moved, Rotation.from_euler(axes, angles).as_matrix().reshape(3, 3)


def lengths(bodies: Path, cables: Path, q: Array, cable_set: str | None = None) -> Array:
    """Length of each cable (C,) [m] at the coordinates q in the order of the file."""
    place, turn, centre = [np.zeros(3)], [np.eye(3)], [np.zeros(3)]
    used = 0
    for link in _root(bodies).iter("link_rigid"):
        joint = link.find("joint")
        assert joint is not None
        kind = str(joint.get("type"))
        count = coordinates(kind)
        way, rotation = motion(kind, joint.get("axis"), q[used : used + count])
        used += count
        before = int(str(link.findtext("parent/num")))
        at = _vector(link.findtext("parent/location")) + way
        place.append(place[before] + turn[before] @ at)
        turn.append(turn[before] @ rotation)
        centre.append(_vector(link.findtext("physical/com_location")))
    assert used == len(q)
    root = _root(cables)
    name = cable_set or root.get("default_cable_set")
    (chosen,) = (each for each in root.iter("cable_set") if each.get("id") == name)
    found = []
    for cable in chosen:
        points = []
        for site in cable.iter("attachment"):
            number, point = int(str(site.findtext("link"))), _vector(site.findtext("location"))
            if cable.get("attachment_reference") == "com":
                point = point + centre[number]
            points.append(place[number] + turn[number] @ point)
        found.append(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    return np.array(found)


def limits(bodies: Path) -> Array:
    """Lower and upper limits (2, nv) in the order of the file."""
    joints = [link.find("joint") for link in _root(bodies).iter("link_rigid")]
    return np.array(
        [
            [float(word) for joint in joints if joint is not None for word in _words(joint, key)]
            for key in ("q_min", "q_max")
        ]
    )


def _words(joint: ET.Element, key: str) -> list[str]:
    return str(joint.get(key)).split()


def _root(path: Path) -> ET.Element:
    text = re.sub(r"<!DOCTYPE[^>]*>", "", path.read_text(encoding="utf-8-sig"))
    return ET.fromstring(text.encode())


def _vector(text: str | None) -> Array:
    return np.array([float(word) for word in str(text).split()])
