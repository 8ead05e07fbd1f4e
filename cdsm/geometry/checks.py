"""Find faults for which a geometry is refused, and doubts for which a warning is issued."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable
from typing import TYPE_CHECKING

from cdsm.errors import listed
from cdsm.geometry.uniform import same_angle

if TYPE_CHECKING:
    from cdsm.geometry.geometry import Geometry

# a longer arm, a larger hole radius or disk offset than this [m] was probably given in millimetres
LONGEST, WIDEST = 30.0, 1.0


def faults_of(geometry: Geometry) -> list[str]:
    """Return the faults that concern several parts, such as too short links, one text each."""
    joints, links, count = geometry.joints, geometry.links, len(geometry.joints)
    wrong = len(links) != count
    faults = [f"links: {len(links)} given for {count} joints; give one for each"] if wrong else []
    offsets = [*(joint.disk_offset for joint in joints), 0.0]
    short = [
        f"link {k + 1} is {link.length:g} m long, its disks need more than {needed:g} m"
        for k, link in enumerate(links)
        if link.length <= (needed := sum(offsets[k : k + 2]))
    ]
    if short:
        problem = f"too large: {listed(short, 1, '; ')}"
        faults += [f"disk_offset: {problem}; lower disk_offset, or lengthen the links"]
    faults += [
        f"cables[{c}].joint: {cable.joint} is past the last joint, {count}; give 1 to {count}"
        for c, cable in enumerate(geometry.cables, start=1)
        if cable.joint > count
    ]
    small = [
        f"at joint {k} it is {joint.disk_radius:g} m, and the farthest hole is at {hole:g} m"
        for k, (joint, hole) in enumerate(zip(joints, geometry._farthest_holes, strict=True), 1)
        if joint.disk_radius is not None and joint.disk_radius <= hole
    ]
    if small:
        faults += [f"disk_radius: too small: {listed(small, 1, '; ')}; give more"]
    return faults


def doubts_about_units(length: float, sizes: Iterable[tuple[str, float, float]] = ()) -> list[str]:
    """Return a warning text if lengths [m] look as if they are not in metres, else an empty list.

    ``length`` is that of the arm; ``sizes`` are names, values and their largest plausible values.
    """
    if 0.0 < length < 1e-3:
        unit = "another unit; give them in metres, or in mm as options of the command line."
        return [f"the arm is {length:.4g} m long: it looks as if lengths are in {unit}"]
    every = [("the arm", length, LONGEST), *sizes]
    large = ", ".join(f"{what} is {size:.4g} m" for what, size, most in every if size > most)
    return [f"{large}: it looks as if lengths are in mm; give them in metres."] if large else []


def doubts_about_angle(what: str, angle: float, most: float) -> list[str]:
    """Return a warning text if ``angle`` [rad] is larger than any plausible one, ``most`` [rad]."""
    doubt = f"{what} {angle:g} rad: it looks as if it is in degrees; give rad."
    return [doubt] if abs(angle) > most else []


def doubts_about(geometry: Geometry) -> list[str]:
    """Return warning texts, e.g. if lengths look like millimetres, or if cables share holes."""
    cables, disks, names = geometry.cables, geometry.disks, geometry.cable_names
    offset = max(joint.disk_offset for joint in geometry.joints)
    sizes = [("hole_radius", max(geometry.hole_radii), WIDEST), ("disk_offset", offset, WIDEST)]
    # the angles of hinges grow by the twist, up to half a turn, from one to the next
    most = math.pi * max(8, len(geometry.joints) + 4)
    widest = max((cable.angle for cable in cables), key=abs)
    doubts = doubts_about_units(geometry.length, sizes)
    doubts += doubts_about_angle("a hole angle is", widest, most)
    holes = defaultdict(list)
    for i, group in enumerate(same_angle(cables)):
        for c in group:
            for d, disk in enumerate(disks[: 2 * cables[c].joint]):
                holes[i, d, disk.radius_of(cables[c])].append(c)
    shared = {tuple(hole) for hole in holes.values() if len(hole) > 1}
    whole = sorted(hole for hole in shared if not any(set(hole) < set(each) for each in shared))
    if whole:
        groups = listed([" and ".join(names[c] for c in hole) for hole in whole], 4, "; ")
        remedy = "Cables in one hole rub: set them apart by spread=, phase= or hole_angles=."
        doubts.append(f"cables share holes: {groups}. {remedy}")
    return doubts
