"""Clearance of the cables from each other, from the links and from the disks, by coal."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple, Self, final

import coal
import numpy as np
from numpy.typing import NDArray

from cdsm.posture import Posture
from cdsm.support.result import Result, unit
from cdsm.support.validation import instance, quantity
from cdsm.support.values import Array

KINDS: Final = ("cable_clearance", "link_clearance", "disk_clearance")
"""Names of the clearances in sweeps and designs."""

_BACKBONE = 0.2
"""Radius of a link's backbone, divided by the hole radius of its first disk, as in the URDF."""

_ON = 1e-9  # a site this near to a disk [m] is on the disk

_PRECISE = 1e-9  # tolerance of coal's iterations [m]


class Named(NamedTuple):
    """A distance [m] and the names of the two bodies; inf and empty names if there is no pair."""

    distance: float
    bodies: tuple[str, str] = ("", "")


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Clearance(Result):
    """Smallest signed distances of the cables of an arm; made by :func:`clearance`.

    A negative distance is the depth of an overlap: the smallest shift that ends it. A distance is
    inf if the arm has no such pair.

    Attributes:
        posture: The posture.
        diameter: Diameter of all cables [m].
        thickness: Thickness of all disks [m].
        cables: Smallest distance between the surfaces of two cables [m].
        links: Smallest distance between a cable and the backbone of a link [m].
        disks: Smallest distance between a cable and a disk [m]; for a disk through which the cable
            runs, between the cable and the outer rim.
        nearest: Names of the two bodies that have the distance ``cables``, then ``links``, then
            ``disks``; empty names for a distance of inf.
    """

    _headline = "cables"

    posture: Posture
    diameter: float = field(metadata=unit("m"))
    thickness: float = field(metadata=unit("m"))
    cables: float = field(metadata=unit("m"))
    links: float = field(metadata=unit("m"))
    disks: float = field(metadata=unit("m"))
    nearest: tuple[tuple[str, str], ...] = field(metadata=unit("1"))

    def __str__(self) -> str:
        values = zip(("cable", "link", "disk"), (self.cables, self.links, self.disks), strict=True)
        said = []
        for (what, value), (one, other) in zip(values, self.nearest, strict=True):
            found = f"{1e3 * value:.4g} mm, {one} and {other}" if one else "none near"
            said.append(f"cable to {what:<6} {found}")
        return "\n".join(said)


def clearance(pose: Posture, diameter: float = 0.0, thickness: float = 0.0) -> Clearance:
    """Compute the smallest signed distances of the cables at a posture, by coal.

    Cables are straight between their sites, with round sections and ends; leads are ignored. Links
    are bars from joint to joint, as the generated URDF draws them: their radius is a fifth of the
    hole radius. In an arm from your own URDF, links are lines, and there are no disks. Disks are
    cylinders. If a cable runs through a hole of a disk, its distance from this disk is the distance
    between its surface and the outer rim.

    Args:
        pose: The posture.
        diameter: Diameter of all cables [m].
        thickness: Thickness of all disks [m].

    Raises:
        InvalidInput: ``diameter`` or ``thickness`` is negative or not a length.
    """
    d = quantity("diameter", diameter, "diameter", zero=True)
    t = quantity("thickness", thickness, "length", zero=True)
    found = distances(instance("pose", pose, Posture), d, t)
    cables, links, disks = (found[kind][0] for kind in KINDS)
    return Clearance(
        posture=pose,
        diameter=d,
        thickness=t,
        cables=cables,
        links=links,
        disks=disks,
        nearest=tuple(found[kind][1] for kind in KINDS),
    )


def distances(
    pose: Posture, diameter: float, thickness: float = 0.0, kinds: Collection[str] = KINDS
) -> dict[str, Named]:
    """Compute the distances of ``kinds`` out of :data:`KINDS`, with the names of the bodies."""
    arm, paths = pose.arm, pose.cable_paths
    cable = np.repeat(np.arange(len(paths)), [len(path) - 1 for path in paths])
    ends = np.concatenate([np.stack([path[:-1], path[1:]], axis=1) for path in paths])
    names = [arm.cables[c].name for c in cable.tolist()]
    wires = _Bodies.bars(names, ends, np.full(cable.size, diameter / 2.0))
    disks = arm.geometry.disks if arm.is_serpentine else ()
    found = dict[str, Named]()
    if "cable_clearance" in kinds:
        later = np.triu(np.ones((cable.size, cable.size), dtype=np.bool_))
        found["cable_clearance"] = _nearest(wires, wires, later & (cable[:, None] != cable))
    if "link_clearance" in kinds:
        radii = {arm._body.locate(d.link)[0]: _BACKBONE * d.hole_radius for d in reversed(disks)}
        rows = [row for row, bones in enumerate(pose._bones) for _ in bones]
        links = ["the base", *(f"the link after {name}" for name in arm.joint_names)]
        radius = np.array([radii.get(row, 0.0) for row in rows])
        lines = np.array(pose.bones).reshape(-1, 2, 3)
        bones = _Bodies.bars([links[row] for row in rows], lines, radius)
        found["link_clearance"] = _nearest(wires, bones, np.ones((cable.size, len(rows)), np.bool_))
    if "disk_clearance" in kinds:
        poses = arm._body.link_placements(pose.q)
        place = np.array([poses[disk.link] for disk in disks]).reshape(-1, 4, 4)
        x, radius = (np.array([getattr(disk, of) for disk in disks]) for of in ("x", "radius"))
        axis, thick = place[:, :3, 0], np.full(radius.size, thickness)
        centre = place[:, :3, 3] + x[:, None] * axis
        numbered = [f"disk {number + 1}" for number in range(len(disks))]
        plates = _Bodies(coal.Cylinder, numbered, centre, axis, thick, radius)
        # where a segment ends in a hole of a disk, the rim counts
        away = ends[:, :, None] - centre
        height = (away * axis).sum(axis=3, keepdims=True)
        rim = radius - np.linalg.norm(away - height * axis, axis=3)
        rim = np.where((abs(height[..., 0]) < _ON) & (rim > 0.0), rim, np.inf).min(axis=1)
        nearest = _nearest(wires, plates, np.isinf(rim))
        if rim.size:
            i, j = divmod(int(rim.argmin()), len(disks))
            nearest = min(nearest, Named(rim[i, j] - diameter / 2.0, (names[i], numbered[j])))
        found["disk_clearance"] = nearest
    return found


class _Bodies:
    """Bodies round an axis, in base axes: n capsules or n cylinders of coal.

    Centres and axes are (n, 3); the lengths along the axes, without the round ends of a capsule,
    and the radii are (n,) [m].
    """

    def __init__(
        self, kind: Any, names: list[str], centre: Array, axis: Array, length: Array, radius: Array
    ) -> None:
        self.names, self.centre, self.radius = names, centre, radius
        rounded = kind is coal.Capsule
        self.reach = length / 2.0 + radius if rounded else np.hypot(length / 2.0, radius)
        # a reflection that takes z to the axis, up to the sign, and one that turns the hand back
        v = axis + np.where(axis[:, 2:] > 0.0, 1.0, -1.0) * [0.0, 0.0, 1.0]
        mirror = np.eye(3) - 2.0 * v[:, :, None] * v[:, None] / (v**2).sum(axis=1)[:, None, None]
        self._parts = kind, mirror * [1.0, -1.0, 1.0], radius.tolist(), length.tolist()
        self._made: dict[int, tuple[Any, Any]] = {}

    @classmethod
    def bars(cls, names: list[str], ends: Array, radius: Array) -> Self:
        """Return capsules around lines between points (n, 2, 3)."""
        along = ends[:, 1] - ends[:, 0]
        length = np.linalg.norm(along, axis=1)
        axis = along / length[:, None]
        return cls(coal.Capsule, names, ends.mean(axis=1), axis, length, radius)

    def __getitem__(self, number: int) -> tuple[Any, Any]:
        if number not in self._made:
            kind, turn, radius, length = self._parts
            pose = coal.Transform3s(turn[number], self.centre[number])
            self._made[number] = kind(radius[number], length[number]), pose
        return self._made[number]


def _nearest(one: _Bodies, other: _Bodies, pairs: NDArray[np.bool_]) -> Named:
    """Return the smallest distance of the ``pairs`` (n, m), capsules with bodies.

    A distance is at least that of the spheres around both bodies. It is at most that of the
    centres, less the radius of the capsule.
    """
    apart = np.linalg.norm(one.centre[:, None] - other.centre, axis=2)
    least = np.where(pairs, apart - one.reach[:, None] - other.reach, np.inf)
    most = np.where(pairs, apart - one.radius[:, None], np.inf).min(initial=math.inf)
    request, result = coal.DistanceRequest(False), coal.DistanceResult()
    request.enable_signed_distance = True
    request.gjk_tolerance = request.epa_tolerance = _PRECISE
    best, near = Named(math.inf), np.argwhere(pairs & (least <= most))
    for i, j in near[np.argsort(least[*near.T])].tolist():
        if least[i, j] >= best.distance:
            break
        result.clear()
        distance = coal.distance(*one[i], *other[j], request, result)
        best = min(best, Named(distance, (one.names[i], other.names[j])))
    return best
