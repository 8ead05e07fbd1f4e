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
from cdsm.support.validation import checked_quantity, instance
from cdsm.support.values import Array
from cdsm.urdf import backbone_radius

KINDS: Final = ("cable_clearance", "link_clearance", "disk_clearance")
"""Names of the clearances in sweeps and designs."""

_ON = 1e-9  # a site this near to a disk [m] is on the disk

_PRECISE = 1e-9  # tolerance of coal's iterations [m]
_MARGIN = 1e-6  # rounding of the distances of centres is smaller [m]


class Named(NamedTuple):
    """A distance [m] and the names of the two bodies; inf and empty names if there is no pair."""

    distance: float
    bodies: tuple[str, str] = ("", "")


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Clearance(Result):
    """Smallest signed distances of the cables of an arm; made by :func:`clearance`.

    A negative distance is the depth of an overlap. A distance is inf if the arm has no such pair.

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
        lines = []
        for (what, value), (one, other) in zip(values, self.nearest, strict=True):
            text = f"{1e3 * value:.4g} mm, {one} and {other}" if one else "none near"
            lines.append(f"cable to {what:<6} {text}")
        return "\n".join(lines)


def clearance(pose: Posture, diameter: float = 0.0, thickness: float = 0.0) -> Clearance:
    """Compute the smallest signed distances of the cables at a posture, by coal.

    Cables are straight between their sites, with round sections and ends; leads are ignored. Links
    are bars from joint to joint, as the generated URDF draws them: their radius is a fifth of the
    hole radius. In an arm from your own URDF, links are lines, and there are no disks. Disks are
    cylinders. If a cable runs through a hole of a disk, its distance from this disk is the distance
    between its surface and the outer rim. If it cuts through a disk, this way is negative.

    Args:
        pose: The posture.
        diameter: Diameter of all cables [m].
        thickness: Thickness of all disks [m].

    Raises:
        InvalidInput: ``diameter`` or ``thickness`` is negative or not a length.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> print(cdsm.clearance(pose, diameter=1.2e-3))
        cable to cable  11.24 mm, cable1_3 and cable5_2
        cable to link   22.63 mm, cable2_2 and the base
        cable to disk   2.4 mm, cable5_3 and disk 10
    """
    d = checked_quantity("diameter", diameter, "diameter", zero=True)
    t = checked_quantity("thickness", thickness, "length", zero=True)
    nearest = distances(instance("pose", pose, Posture), d, t)
    cables, links, disks = (nearest[kind][0] for kind in KINDS)
    return Clearance(
        posture=pose,
        diameter=d,
        thickness=t,
        cables=cables,
        links=links,
        disks=disks,
        nearest=tuple(nearest[kind][1] for kind in KINDS),
    )


def distances(
    pose: Posture, diameter: float, thickness: float = 0.0, kinds: Collection[str] = KINDS
) -> dict[str, Named]:
    """Compute the distances of ``kinds`` out of :data:`KINDS`, with the names of the bodies."""
    arm = pose.arm
    paths = pose.cable_paths
    cable = np.repeat(np.arange(len(paths)), [len(path) - 1 for path in paths])
    ends = np.concatenate([np.stack([path[:-1], path[1:]], axis=1) for path in paths])
    names = [arm.cables[c].name for c in cable.tolist()]
    wires = _Bodies.bars(names, ends, np.full(cable.size, diameter / 2.0))
    disks = arm.geometry.disks if arm.is_serpentine else ()
    nearest = dict[str, Named]()
    if "cable_clearance" in kinds:
        later = np.triu(np.ones((cable.size, cable.size), dtype=np.bool_))
        nearest["cable_clearance"] = _nearest(wires, wires, later & (cable[:, None] != cable))
    if "link_clearance" in kinds:
        bodies = arm.geometry.chain.bodies if arm.is_serpentine else ()
        radii = {
            arm.body.locate(body.name)[0]: backbone_radius(arm.geometry, body) for body in bodies
        }
        rows = [row for row, _ in pose.bones_by_row]
        links = ["the base", *(f"the link after {name}" for name in arm.body.all_joints)]
        radius = np.array([radii.get(row, 0.0) for row in rows])
        lines = np.array(pose.bones).reshape(-1, 2, 3)
        bones = _Bodies.bars([links[row] for row in rows], lines, radius)
        nearest["link_clearance"] = _nearest(
            wires, bones, np.ones((cable.size, len(rows)), np.bool_)
        )
    if "disk_clearance" in kinds:
        poses = arm.body.link_placements(pose.q)
        place = np.array([poses[disk.link] for disk in disks]).reshape(-1, 4, 4)
        x, radius = (np.array([getattr(disk, of) for disk in disks]) for of in ("x", "radius"))
        axis = place[:, :3, 0]
        centre = place[:, :3, 3] + x[:, None] * axis
        across = np.sqrt(np.clip(1.0 - axis**2, 0.0, 1.0))
        plates = _Bodies(
            [f"disk {number + 1}" for number in range(len(disks))],
            [coal.Cylinder(rim, thickness) for rim in radius.tolist()],
            centre,
            axis,
            thickness / 2.0 * abs(axis) + radius[:, None] * across,
        )
        rim = _ways_to_the_rim(ends[:, :, None] - centre, axis, radius)
        nearest["disk_clearance"] = _nearest(wires, plates, np.isinf(rim))
        if rim.size:
            i, j = divmod(int(rim.argmin()), len(disks))
            way = Named(rim[i, j] - diameter / 2.0, (names[i], plates.names[j]))
            nearest["disk_clearance"] = min(nearest["disk_clearance"], way)
    return nearest


def _ways_to_the_rim(away: Array, axis: Array, radius: Array) -> Array:
    """Compute how far segments in a disk are from its rim (S, D) [m]; inf for those that are not.

    ``away`` (S, 2, D, 3) are the ends of the segments, seen from the centres of the disks. The way
    is positive if the segment ends in a hole of the disk, and negative if it cuts through it.
    """
    height = (away * axis).sum(axis=3)
    way = radius - np.linalg.norm(away - height[..., None] * axis, axis=3)
    held = (abs(height) < _ON) & (way > 0.0)
    held_way = np.where(held, way, np.inf).min(axis=1)
    crosses = (height.prod(axis=1) < 0.0) & ~held.any(axis=1)
    part = height[:, 0] / np.where(crosses, height[:, 0] - height[:, 1], 1.0)
    cut = away[:, 0] + part[..., None] * (away[:, 1] - away[:, 0])
    inside = radius - np.linalg.norm(cut, axis=2)
    return np.asarray(np.where(crosses & (inside > 0.0), -inside, held_way))


class _Bodies:
    """Bodies in base axes: n coal shapes along z, rounded by radii (n,) [m]; half boxes (n, 3)."""

    def __init__(
        self, names: list[str], shapes: list[Any], centre: Array, axis: Array, extent: Array
    ) -> None:
        self.names = names
        self.centre = centre
        self.extent = extent
        self.radius = np.zeros(len(names))
        self._shapes = shapes
        # a reflection that takes z to the axis, up to the sign, and one that turns the hand back
        v = axis + np.where(axis[:, 2:] > 0.0, 1.0, -1.0) * [0.0, 0.0, 1.0]
        mirror = np.eye(3) - 2.0 * v[:, :, None] * v[:, None] / (v**2).sum(axis=1)[:, None, None]
        self._turn = mirror * [1.0, -1.0, 1.0]
        self._poses: dict[int, Any] = {}

    @classmethod
    def bars(cls, names: list[str], ends: Array, radius: Array) -> Self:
        """Return round bars with round ends, along lines between points (n, 2, 3)."""
        along = ends[:, 1] - ends[:, 0]
        length = np.linalg.norm(along, axis=1)
        shapes = [coal.Capsule(0.0, height) for height in length.tolist()]
        made = cls(names, shapes, ends.mean(axis=1), along / length[:, None], abs(along) / 2.0)
        made.radius = radius
        return made

    def __getitem__(self, i: int) -> tuple[Any, Any]:
        if i not in self._poses:
            self._poses[i] = coal.Transform3s(self._turn[i], self.centre[i])
        return self._shapes[i], self._poses[i]


def _nearest(one: _Bodies, other: _Bodies, pairs: NDArray[np.bool_]) -> Named:
    """Return the smallest distance of the ``pairs`` (n, m), the likeliest by their boxes first."""
    best = Named(math.inf)
    if not pairs.any():
        return best
    offset = one.centre.mean(axis=0)
    a = one.centre - offset
    b = other.centre - offset
    square = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2.0 * a @ b.T
    apart = np.sqrt(np.maximum(square, 0.0)) - one.radius[:, None] - other.radius
    reach = [np.linalg.norm(bodies.extent, axis=1) for bodies in (one, other)]
    most = apart[pairs].min() + _MARGIN
    i, j = np.nonzero(pairs & (apart - reach[0][:, None] - reach[1] < most))
    gaps = np.maximum(abs(a[i] - b[j]) - one.extent[i] - other.extent[j], 0.0)
    rounding = one.radius[i] + other.radius[j]
    least = np.linalg.norm(gaps, axis=1) - rounding
    request = coal.DistanceRequest(False)
    result = coal.DistanceResult()
    request.gjk_tolerance = _PRECISE
    request.enable_signed_distance = False
    for k in np.argsort(least).tolist():
        if least[k] >= best.distance:
            break
        result.clear()
        distance = coal.distance(*one[int(i[k])], *other[int(j[k])], request, result) - rounding[k]
        best = min(best, Named(float(distance), (one.names[i[k]], other.names[j[k]])))
    return best
