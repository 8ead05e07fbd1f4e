"""Find faults for which a geometry is refused, and doubts for which a warning is issued."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from cdsm.errors import listed
from cdsm.geometry.holes import sharing

if TYPE_CHECKING:
    from cdsm.geometry.description import GeometryFields

LONGEST = 30.0
"""If an arm is longer than this [m], its lengths are probably in millimetres."""

WIDEST = 1.0
"""A hole radius or disk offset larger than this [m] is probably in millimetres."""

_WIDEST_ANGLE = 8.0 * math.pi
"""A larger hole angle [rad] is probably in degrees. It is the sum of an angle and a phase."""

_SHORTEST = 1e-3  # an arm shorter than this [m] was probably given in metres where mm are taken


def farthest_holes(geometry: GeometryFields) -> list[float]:
    """Return, for each disk, the distance [m] of its farthest hole from the arm's axis."""
    farthest = [R for R in geometry.hole_radii for _ in range(2)]
    for cable in geometry.cables:
        if cable.radius is not None:
            for d in range(2 * cable.joint):
                farthest[d] = max(farthest[d], cable.radius)
    return farthest


def faults_of(geometry: GeometryFields) -> list[str]:
    """Return the faults that concern several parts, such as too short links, one text each."""
    count = len(geometry.joints)
    faults = []
    if len(geometry.links) != count:
        faults.append(
            f"links: {len(geometry.links)} given for {count} joints; every joint has one link "
            "after it"
        )
    faults += _short_links(geometry)
    faults += [
        f"cables[{c}].joint: {cable.joint} is past the last joint, {count}; give 1 to {count}"
        for c, cable in enumerate(geometry.cables, start=1)
        if cable.joint > count
    ]
    if faults:
        return faults
    small = [
        f"at joint {k} it is {joint.disk_radius:g} m, and the farthest hole is at {farthest:g} m"
        for k, (joint, farthest) in enumerate(
            zip(geometry.joints, farthest_holes(geometry)[::2], strict=True), start=1
        )
        if joint.disk_radius is not None and joint.disk_radius <= farthest
    ]
    if small:
        faults.append(
            f"disk_radius: too small: {listed(small, 1, '; ')}; give more, or leave it out"
        )
    return faults


def _short_links(geometry: GeometryFields) -> list[str]:
    """Return a list with one text on all links too short for their disks; empty if none is."""
    offsets = [joint.disk_offset for joint in geometry.joints]
    short = [
        f"link {k} is {link.length:g} m long, its {'disks need' if after else 'disk needs'} "
        f"more than {before + after:g} m"
        for k, (link, before, after) in enumerate(
            zip(geometry.links, offsets, [*offsets[1:], 0.0], strict=False), start=1
        )
        if link.length <= before + after
    ]
    if not short:
        return []
    names = listed(short, 1, "; ")
    return [f"disk_offset: too large: {names}; lower disk_offset, or lengthen the links"]


def doubts_about_units(length: float, sizes: Iterable[tuple[str, float, float]] = ()) -> list[str]:
    """Return one warning text if lengths look as if they are not in metres, else an empty list.

    ``length`` is the length of the arm [m]. Each of ``sizes`` is a name for the text, a size [m]
    and the largest plausible value of this size [m].
    """
    if 0.0 < length < _SHORTEST:
        return [
            f"the arm is {length:.4g} m long: it looks as if lengths are in another unit; give "
            "them in metres, or in mm as options of the command line."
        ]
    every = [("the arm", length, LONGEST), *sizes]
    large = [f"{what} is {size:.4g} m" for what, size, most in every if size > most]
    if not large:
        return []
    return [f"{', '.join(large)}: it looks as if lengths are in mm; give them in metres."]


def doubts_about_angle(what: str, angle: float, most: float) -> list[str]:
    """Return one warning text if ``angle`` [rad] looks as if it is in degrees, else an empty list.

    The text begins with ``what``, such as "a hole angle is"; ``most`` is the largest plausible
    magnitude [rad].
    """
    if abs(angle) <= most:
        return []
    return [f"{what} {angle:g} rad: it looks as if it is in degrees; give rad."]


def doubts_about(geometry: GeometryFields) -> list[str]:
    """Return warning texts, e.g. if lengths look like millimetres, or if cables share holes."""
    sizes = [
        ("hole_radius", max(geometry.hole_radii), WIDEST),
        ("disk_offset", max(joint.disk_offset for joint in geometry.joints), WIDEST),
    ]
    doubts = doubts_about_units(geometry.length, sizes)
    names = geometry.cable_names
    widest = max(geometry.cables, key=lambda cable: abs(cable.angle))
    # the angles of hinges grow by the twist, up to half a turn, from one to the next
    most = max(_WIDEST_ANGLE, math.pi * (len(geometry.joints) + 4))
    doubts += doubts_about_angle("a hole angle is", widest.angle, most)
    groups = [
        " and ".join(names[c] for c in each) for each in sharing(geometry.cables, geometry.disks)
    ]
    if groups:
        doubts.append(
            f"cables share holes: {listed(groups, 4, '; ')}. Two cables in one hole rub, and "
            "few disks are built so. Set them apart by spread=, phase= or hole_angles=."
        )
    return doubts
