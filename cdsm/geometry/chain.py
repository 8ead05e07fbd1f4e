"""The chain of bodies and joints of a geometry: one description for URDF, disks and springs.

A beam of length l, bending stiffness EI and torsion stiffness GJ becomes pieces of l/n each: two
universal joints at 1/6 and 5/6 of the piece with springs 2 EI n/l, and a joint about its axis in
the middle with GJ n/l. At 1/6 and 5/6, a cable beside the beam shortens as beside an arc, to second
order. The axes are y, z at the first joint and z, y at the second: in equal order, a bend that is
not about one of them would twist the beam.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from cdsm.geometry.parts import Disk, Joint, Link

Y, Z, X = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
STEEPEST = math.radians(80.0)
"""Largest angle of a joint without a limit of its own [rad]."""

_OF_CROSS = 0.01  # mass of the cross of a beam's joint, taken from its piece


class Body(NamedTuple):
    """A rigid body: solid cylinder along x, from 0 to ``length`` [m], or the cross of a joint."""

    name: str
    length: float
    mass: float  # [kg]; 0: a placeholder, which simulators need
    radius: float  # of the cylinder that gives its moments of inertia [m]
    cross: bool = False


class Axis(NamedTuple):
    """A joint of one axis between two bodies."""

    name: str
    parent: str
    child: str
    x: float  # place on the parent [m]
    axis: tuple[float, ...]
    limit: float  # both ways [rad]
    stops: bool  # whether the limit is where disks touch
    stiffness: float = 0.0  # k [N m/rad]
    rest_angle: float = 0.0  # q_0 [rad]


@dataclass
class Chain:
    """Bodies one behind another along x. ``go`` runs on along the last one, ``joint`` ends it."""

    radius: float  # of the current body
    link: str = "base_disk"
    x: float = 0.0
    mass: float = 0.0
    bodies: list[Body] = field(default_factory=list)
    axes: list[Axis] = field(default_factory=list)
    disks: list[Disk] = field(default_factory=list)

    def go(self, dx: float, mass: float = 0.0) -> None:
        self.x += dx
        self.mass += mass

    def end(self) -> None:
        """End the current body."""
        cross = self.link.startswith("cross") or self.link.endswith(("_cross1", "_cross2"))
        self.bodies.append(Body(self.link, self.x, self.mass, self.radius, cross))

    def joint(
        self,
        name: str,
        axis: tuple[float, ...],
        child: str,
        limit: float,
        stops: bool,
        spring: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self.axes.append(Axis(name, self.link, child, self.x, axis, limit, stops, *spring))
        self.end()
        self.link, self.x, self.mass = child, 0.0, 0.0

    def beam(self, stem: str, length: float, of: Joint | Link, mass: float, end: str) -> None:
        """Run along a beam of length [m]; the body at its end is called ``end``."""
        n = of.pieces
        l, k = length / n, 2.0 * of.bending_stiffness * n / length
        spring, twist = (k, 0.0), (of.torsion_stiffness * n / length, 0.0)
        limit, stops = self.limits(of)
        weight = mass / n * (1.0 - 4.0 * _OF_CROSS)

        def universal(name: str, cross: str, child: str, order: str) -> None:
            axes = {"y": Y, "z": Z}
            self.joint(f"{name}_{order[0]}", axes[order[0]], cross, limit, stops, spring)
            self.mass = 2.0 * _OF_CROSS * mass / n
            self.joint(f"{name}_{order[1]}", axes[order[1]], child, limit, stops, spring)

        for p in range(1, n + 1):
            own = stem if n == 1 else f"{stem}_{p}"
            self.go(l / 6.0, weight / 6.0)
            universal(f"{own}_bend1", f"{own}_cross1", f"{own}_middle", "yz")
            self.go(l / 3.0, weight / 3.0)
            if math.isfinite(of.torsion_stiffness):
                self.joint(f"{own}_twist", X, f"{own}_middle2", STEEPEST, False, twist)
            self.go(l / 3.0, weight / 3.0)
            universal(f"{own}_bend2", f"{own}_cross2", end if p == n else f"{own}_end", "zy")
            self.go(l / 6.0, weight / 6.0)

    def limits(self, of: Joint | Link) -> tuple[float, bool]:
        """Return the limit of each joint of a beam, and whether disks touch there."""
        if isinstance(of, Link):
            return STEEPEST / (2 * of.pieces), False
        limit = of.limit or min(STEEPEST, 2.0 * math.atan(of.disk_offset / self.disks[-1].radius))
        return limit / (2 * of.pieces), of.limit is None
