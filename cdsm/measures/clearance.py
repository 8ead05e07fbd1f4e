"""Clearance of the cables: between each other, to the links, to the edges of the disks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm._former.arm_arrays import kernel_arrays, run_slices
from cdsm._former.clearance import clearance_rows
from cdsm._former.tree import Indices, Routing
from cdsm.batch.inputs import checked_threads, postures
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.format import plain
from cdsm.support.validation import instance, quantity
from cdsm.support.values import Array, ReadOnlyState, frozen

KINDS = ("cable_clearance", "link_clearance", "disk_clearance")
"""Names of the clearances, in the order of the columns of the kernel's result."""

_BESIDE = np.array([1.0, 0.5, 0.5])
"""Cable diameters from a cable axis to another axis, to a link, to a disk when they touch [-]."""

_BACKBONE = 0.2
"""Radius of a link's backbone, divided by the hole radius of its first disk, as in the URDF."""

_ON = 1e-9  # a site this near to a disk [m] is on the disk


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Clearance(ReadOnlyState):
    """Smallest signed distances of the cables of an arm; made by :func:`clearance`.

    A negative distance is the depth of an overlap. A distance is inf if the arm has no such pair.

    Attributes:
        posture: The posture.
        diameter: Diameter of all cables [m].
        cables: Smallest distance between the surfaces of two cables [m].
        links: Smallest distance between a cable and the backbone of a link [m].
        disks: Smallest distance between a cable and a disk [m]; for a disk through which the cable
            runs, between the cable and the outer rim.
        nearest: Names of the two bodies that have the distance ``cables``, then ``links``, then
            ``disks``; empty names for a distance of inf.
    """

    posture: Posture
    diameter: float
    cables: float
    links: float
    disks: float
    nearest: tuple[tuple[str, str], tuple[str, str], tuple[str, str]]

    def to_dict(self) -> dict[str, object]:
        """Return the distances in SI for JSON, with units in the keys; inf as None."""
        numbers: dict[str, object] = {**self.posture._coordinates, "diameter_m": self.diameter}
        for kind, value, names in self._by_kind:
            numbers |= {f"{kind}_m": value, f"{kind}_between": names}
        return plain(numbers)

    @property
    def _by_kind(self) -> list[tuple[str, float, tuple[str, str]]]:
        values = (self.cables, self.links, self.disks)
        return list(zip(KINDS, values, self.nearest, strict=True))

    def __repr__(self) -> str:
        return f"<Clearance {1e3 * min(self.cables, self.links, self.disks):.4g} mm>"

    def __str__(self) -> str:
        lines = []
        for kind, value, (one, other) in self._by_kind:
            what = kind.partition("_")[0]
            said = f"{1e3 * value:.4g} mm, {one} and {other}" if one else "none near"
            lines.append(f"cable to {what:<6} {said}")
        return "\n".join(lines)


def clearance(pose: Posture, diameter: float = 0.0) -> Clearance:
    """Compute the smallest signed distances of the cables at a posture.

    Cables are straight between their sites, with round sections; leads are ignored. Links are bars
    from joint to joint, as the generated URDF draws them: their radius is a fifth of the hole
    radius. In an arm from your own URDF, links are lines, and there are no disks. Disks are plates
    without thickness. If a cable runs through a hole of a disk, its distance from this disk is the
    distance between its surface and the outer rim. If a cable pierces a disk elsewhere, the
    distance is negative. A distance is inf if the arm has no such pair.

    Args:
        pose: The posture.
        diameter: Diameter of all cables [m].

    Raises:
        InvalidInput: ``diameter`` is negative or not a length.
    """
    arm = instance("pose", pose, Posture).arm
    d = quantity("diameter", diameter, "diameter", zero=True)
    distance, nearest = _rows(arm, pose.q[None], d, 1)
    cables, links, disks = distance[0].tolist()
    shape = _shape(arm)
    segments = [arm.cables[c].name for c in shape.segment[:, 0]]
    names = [
        ("", "") if second < 0 else (segments[first], other[second])
        for (first, second), other in zip(
            nearest[0].tolist(), (segments, shape.bone_names, shape.disk_names), strict=True
        )
    ]
    return Clearance(
        posture=pose,
        diameter=d,
        cables=cables,
        links=links,
        disks=disks,
        nearest=(names[0], names[1], names[2]),
    )


def clearances(
    arm: Manipulator, q: ArrayLike, diameter: float = 0.0, *, threads: int | None = None
) -> dict[str, Array]:
    """Compute the distances of :func:`clearance` at postures q (B, nv) [rad].

    Returns ``cable_clearance``, ``link_clearance`` and ``disk_clearance``, (B,) [m] each.
    All cables have the ``diameter`` [m]. ``threads`` is the largest number of threads, by default
    one for each core. Raises InvalidInput as :func:`clearance` does, and if ``q`` is not (B, nv)
    numbers.
    """
    angles = postures(instance("arm", arm, Manipulator), q)
    d = quantity("diameter", diameter, "diameter", zero=True)
    distance, _ = _rows(arm, angles, d, checked_threads(threads))
    return dict(zip(KINDS, distance.T.copy(), strict=True))


class _Shape(NamedTuple):
    """Cable segments, backbones and disks of an arm: arguments of the kernel ``clearance_rows``."""

    routing: Routing  # cable sites, ends of backbones, centres of disks and points on their axes
    segment: Indices  # cable, and both ends among the points, of each segment (S, 3)
    bone: Indices  # both ends of each backbone (n, 2)
    bone_radius: Array  # (n,) [m]
    disk: Indices  # centre of each disk, and a point on its axis 1 m away (D, 2)
    disk_radius: Array  # (D,) [m]
    own: Indices  # 1 or 2 if this end of a segment is in a hole of the disk, else 0 (S, D)
    bone_names: list[str]
    disk_names: list[str]


def _rows(arm: Manipulator, q: Array, diameter: float, threads: int) -> tuple[Array, Indices]:
    """Compute the distances of :data:`KINDS` (B, 3) [m] at postures q (B, nv) [rad].

    Also returns the indices of the two nearest bodies for each distance (B, 3, 2).
    """
    distance, nearest = np.empty((len(q), 3)), np.empty((len(q), 3, 2), dtype=np.intp)
    shape, tree = _shape(arm), kernel_arrays(arm).tree

    def fill(part: slice) -> None:
        clearance_rows(tree, *shape[:7], q[part], distance[part], nearest[part])

    run_slices(fill, len(q), 1, threads)
    return distance - diameter * _BESIDE, nearest


@lru_cache(maxsize=8)
def _shape(arm: Manipulator) -> _Shape:
    """Collect the cable segments, backbones and disks of an arm.

    This takes milliseconds, so the results for the last arms are cached.
    """
    model = kernel_arrays(arm)
    rows = model.routing.row.tolist()
    points = model.routing.point.tolist()
    segment, start = [], 0
    for c, cable in enumerate(arm.cables):
        segment += [(c, start + i, start + i + 1) for i in range(len(cable.sites) - 1)]
        start += len(cable.sites)

    def add(row: int, point: Array) -> int:
        rows.append(row)
        points.append(point.tolist())
        return len(rows) - 1

    disks = arm.geometry.disks if arm.is_serpentine else ()
    # the radius of a link's backbone is that of its first disk
    radii = {model.body.locate(d.link)[0]: _BACKBONE * d.hole_radius for d in reversed(disks)}
    names = ("the base", *(f"the link after {name}" for name in arm.joint_names))
    parents = [*model.tree.parent[1:].tolist(), int(model.masses.tip)]
    bones = [
        (add(row, np.zeros(3)), add(row, end), radii.get(row, 0.0), names[row])
        for row, end in zip(parents, [*model.tree.translation[1:], model.masses.point], strict=True)
        if np.any(end)
    ]
    plates, own = [], []
    for number, disk in enumerate(disks, start=1):
        row, rotation, translation = model.body.locate(disk.link)
        place = translation + rotation @ np.array([disk.x, 0.0, 0.0])
        ahead = place + rotation @ np.array([1.0, 0.0, 0.0])
        plates.append((add(row, place), add(row, ahead), disk.radius, f"disk {number}"))
        at = [
            rows[p] == row and abs((np.array(points[p]) - place) @ (ahead - place)) < _ON
            for p in range(start)
        ]
        own.append([1 if at[a] else 2 if at[b] else 0 for _, a, b in segment])
    places = {"row": frozen(np.array(rows, dtype=np.intp)), "point": frozen(np.array(points))}
    columns = np.array(own, dtype=np.intp).reshape(len(disks), len(segment))
    return _Shape(
        model.routing._replace(**places),
        np.array(segment, dtype=np.intp),
        *_arrays(bones),
        *_arrays(plates),
        np.ascontiguousarray(columns.T),
        [bone[3] for bone in bones],
        [plate[3] for plate in plates],
    )


def _arrays(bodies: list[tuple[int, int, float, str]]) -> tuple[Indices, Array]:
    """Convert n bodies (point, point, radius, name) to arrays.

    Returns the indices of their points (n, 2) and their radii (n,) [m].
    """
    ends = np.array([body[:2] for body in bodies], dtype=np.intp).reshape(-1, 2)
    return ends, np.array([body[2] for body in bodies])
