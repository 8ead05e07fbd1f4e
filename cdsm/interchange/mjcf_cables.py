"""Write the paths of cables for MuJoCo: sites, pulleys as cylinders, sheaths as gaps of tendons.

A tendon wraps around a cylinder on the side of a *side site*, which is outside the cylinder. MuJoCo
takes the way around that cdsm takes, and lifts off where the cable does, as long as no contact is
farther than some 95° from the side site. It is put into the middle of all contacts within the joint
limits; so one way around serves wrap angles up to some 190°. MuJoCo's cylinders are smooth: beside
the plane of a pulley with a groove, its cables shift along the axis.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from lxml import etree
from numpy.typing import ArrayLike

from cdsm.cable import Cable
from cdsm.cable_path import Pulley, Sheath, Site, off_axis, unit_axis
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.values import Array

GHOST = {"contype": "0", "conaffinity": "0", "mass": "0"}
"""Attributes of a shape that is drawn, without mass or contacts."""

_SITE = 1e-3  # radius of a drawn hole [m]
_OUTSIDE = 1e-6  # a site on the rim is put outside by this share of r: inside, MuJoCo wraps nothing
_WIDTH = 0.3  # half the width of a drawn pulley, over its radius
_SIDE = 2.0  # distance of a side site from the axis, over the radius
_FARTHEST = math.radians(190.0)  # contacts farther apart than this have no common side site
_SAMPLES = 100  # postures at which contacts are looked at
_BESIDE = math.radians(0.1)  # fleet angle from which a groove differs from a smooth cylinder


class Side(NamedTuple):
    """The side site of a pulley."""

    place: Array  # in the frame of the link (3,) [m]
    reach: float  # largest angle from the first to the last contact within the joint limits [rad]


def row(values: ArrayLike) -> str:
    """Format numbers as the text of an MJCF attribute, exact to the last bit."""
    return " ".join(repr(float(x)) for x in np.ravel(values))


def add_entries(body: etree._Element, link: str, arm: Manipulator, sides: list[Side]) -> None:
    """Add the sites and pulleys of one link to its body; ``sides`` are those of all pulleys."""
    number = 0  # of a pulley, among all
    for cable in arm.cables:
        for i, element in enumerate(cable.sites, start=1):
            name = f"{cable.name}/{i}"
            if isinstance(element, Pulley):
                if element.link == link:
                    size = row([element.radius, _WIDTH * element.radius])
                    place = {"pos": row(element.position), "zaxis": row(element.axis)}
                    etree.SubElement(
                        body, "geom", name=name, type="cylinder", size=size, **place, **GHOST
                    )
                    side = {"pos": row(sides[number].place), "size": repr(_SITE), "rgba": "0 0 0 0"}
                    etree.SubElement(body, "site", name=f"{name}/side", **side)
                number += 1
            elif isinstance(element, Site) and element.link == link:
                place = {"pos": row(_outside(cable, i - 1)), "size": repr(_SITE)}
                etree.SubElement(body, "site", name=name, **place)


def add_path(spatial: etree._Element, cable: Cable) -> None:
    """Add the path of a cable to its tendon; a sheath ends one branch and begins another.

    Raises InvalidInput for two pulleys without a site between them, which MuJoCo does not accept,
    and for whole turns.
    """
    for first, second in pairwise(cable.sites):
        if isinstance(first, Pulley) and isinstance(second, Pulley):
            problem = f"the pulleys on {first.link} and {second.link} follow each other; MuJoCo "
            problem += "wants a site between them."
            raise InvalidInput(f"cable {cable.name!r}", problem)
    for pulley in cable.pulleys:
        if pulley.turns:
            problem = f"MuJoCo has no whole turns, as around the pulley on {pulley.link}."
            raise InvalidInput(f"cable {cable.name!r}", problem)
    branches: list[list[etree._Element]] = [[]]
    for i, element in enumerate(cable.sites, start=1):
        name = f"{cable.name}/{i}"
        if isinstance(element, Sheath):
            branches.append([])
        elif isinstance(element, Pulley):
            branches[-1].append(etree.Element("geom", geom=name, sidesite=f"{name}/side"))
        else:
            branches[-1].append(etree.Element("site", site=name))
    # a site alone, between two sheaths or before one, has no length
    for n, branch in enumerate(branch for branch in branches if len(branch) > 1):
        if n > 0:
            etree.SubElement(spatial, "pulley", divisor="1")
        spatial.extend(branch)


def side_sites(arm: Manipulator, q: Array) -> list[Side]:
    """Return the side site of each pulley, in the middle of its contacts within the joint limits.

    Contacts are sampled at q, and at random postures.
    """
    if arm.wraps is None:
        return []
    low, high = (np.clip(limit, -np.pi, np.pi) for limit in (arm.lower, arm.upper))
    samples = np.random.default_rng(0).uniform(low, high, (_SAMPLES, arm.nv))
    arrivals: list[Array] = []
    angles: list[Array] = []
    for posture in (q, *samples):
        try:
            pose = arm.at(posture, check_limits=False)
        except InvalidInput:
            continue  # there the cable cannot run over a pulley
        assert pose.wrapping is not None
        arrivals.append(_seen_from_links(pose, np.array(pose.wrapping.contacts.arrival)))
        angles.append(pose.wrapping.angle)
    return [
        _side(pulley, np.array(arrivals)[:, i], np.array(angles)[:, i])
        for i, pulley in enumerate(arm.wraps.pulleys)
    ]


def _side(pulley: Pulley, arrival: Array, angle: Array) -> Side:
    """Return the side site from the arrivals (n, 3) and wrap angles (n,) at n postures."""
    radial = off_axis(pulley, arrival)
    first = radial[0] / np.linalg.norm(radial[0])
    across = np.cross(unit_axis(pulley), first)
    begin = np.arctan2(radial @ across, radial @ first)
    low = begin.min()
    high = (begin + np.maximum(angle, 0.0)).max()
    middle = (low + high) / 2.0
    out = math.cos(middle) * first + math.sin(middle) * across
    place = np.array(pulley.position) + _SIDE * pulley.radius * out
    return Side(place, float(high - low))


def _seen_from_links(pose: Posture, points: Array) -> Array:
    """Return points (P, 3) of the pulleys in the frames of their links."""
    assert pose.wrapping is not None
    frames = pose.arm.body.link_placements(pose.q)
    local = []
    for pulley, point in zip(pose.wrapping.wraps.pulleys, points, strict=True):
        frame = frames[pulley.link]
        local.append(frame[:3, :3].T @ (point - frame[:3, 3]))
    return np.array(local)


def pulley_remarks(pose: Posture, sides: list[Side]) -> Iterator[str]:
    """Yield what of the pulleys the model does not have, at a posture and within the limits."""
    wrapping = pose.wrapping
    if wrapping is None:
        return
    yield "pulleys    are smooth cylinders with a side site; their friction is left out"
    for i, side in enumerate(sides):
        cable, label = wrapping.wraps.label(i)
        if side.reach > _FARTHEST:
            yield (
                f"wrap       contacts of {cable} with {label} are up to "
                f"{math.degrees(side.reach):.0f}° apart within the joint limits; beyond "
                f"{math.degrees(_FARTHEST):.0f}° MuJoCo may take the other way around"
            )
    fleet = np.nan_to_num(abs(pose.wraps.fleet_angles))
    grooves = wrapping.wraps.groove
    beside = np.flatnonzero(grooves & (fleet.max(axis=1, initial=0.0) > _BESIDE))
    for i in beside.tolist():
        cable, label = wrapping.wraps.label(i)
        yield f"groove     {cable} is beside the plane of {label}: MuJoCo lets it shift there"


def _outside(cable: Cable, i: int) -> Array:
    """Return the place of a site (3,) [m], just outside the rim of a neighbouring pulley."""
    site = cable.sites[i]
    assert isinstance(site, Site)
    point = np.array(site.position)
    for pulley in cable.sites[max(i - 1, 0) : i + 2]:
        if isinstance(pulley, Pulley) and pulley.link == site.link:
            radial = off_axis(pulley, point)
            least = (1.0 + _OUTSIDE) * pulley.radius
            distance = float(np.linalg.norm(radial))
            if distance < least:
                point = point + (least / distance - 1.0) * radial
    return point
