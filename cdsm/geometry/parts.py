"""Parts of a geometry: joints, links, routes of cables, disks, and which links touch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from cdsm.springs import JointSpring, SpringLaw
from cdsm.support import records
from cdsm.support.values import Array

MAXIMUM_JOINTS = 100
STEEPEST = math.radians(80.0)
"""Largest bend of a joint without a limit of its own [rad]."""

JointLimit = Annotated[records.Number, Field(gt=0, le=math.pi)]
Pieces = Annotated[records.Integer, Field(ge=1, le=20)]


@records.record
class Joint:
    """One joint of the arm and the two disks next to it; GeometryError lists every fault.

    It has axes, or it is a flexible neck: a beam of length 2h from one disk to the other.

    Attributes:
        axes: One axis (hinge), or the first and the second axis (universal joint), in the frame of
            the previous link. Any length; no axis is zero, and two axes are not parallel.
        disk_offset: h: distance from the joint centre to the disk on each side [m].
        limit: Largest angle about each axis in both directions [rad]; None: where disks of radius r
            touch, with r = ``disk_radius``, or else R. They touch at `γ = 2 atan(h/r)`, or at
            80° if that is less; a universal joint bends so far if both axes turn by
            `arccos √(cos γ)`, which is its limit.
        hole_radius: R: distance of the holes of its two disks from the arm's axis [m]; None: the
            ``hole_radius`` of the :class:`Geometry`.
        disk_radius: Outer radius of the two disks [m]; None: 1.1 times the distance of the farthest
            hole from the axis.
        stiffness: k of a spring about each axis [N m/rad], or its :class:`~cdsm.SpringLaw`; 0:
            none.
        rest_angle: Angle about each axis at which the spring has no torque [rad].
        bending_stiffness: EI of a neck [N m²], instead of ``axes``.
        torsion_stiffness: GJ of the neck [N m²]; None: EI/1.3, as of a tube with Poisson's ratio
            0.3; inf: it does not twist.
        pieces: Number of equal pieces of which the neck is made; each has four or five joints.
        mass: Mass of the neck [kg].
        follows: Number of a joint before it, from 1, whose angles it copies; None: it is free.
        rolls: Radii [m] of two round surfaces, before and after the joint, that roll on each other
            without slip about its one axis; None: the joint is a pin. The angle of the joint is
            then that of the line of centres: the links turn by `1 + r₁/r₂` times as much, and
            limits, springs and stiffnesses count for this angle. The ``disk_offset`` counts from
            the contact.

    Example:
        >>> import cdsm
        >>> joint = cdsm.Joint(axes=((0, 1, 0), (0, 0, 1)), disk_offset=0.01, limit=0.35)
        >>> len(joint.axes)
        2
    """

    axes: Annotated[tuple[records.Vector, ...], Field(strict=False, max_length=2)] = ()
    disk_offset: records.Length
    limit: JointLimit | None = None
    hole_radius: records.Length | None = None
    disk_radius: records.Length | None = None
    stiffness: JointSpring = 0.0
    rest_angle: records.Number = 0.0
    bending_stiffness: records.Bending | None = None
    torsion_stiffness: records.Torsion | None = None
    pieces: Pieces = 1
    mass: records.Mass = 0.0
    follows: Annotated[records.Integer, Field(ge=1)] | None = None
    rolls: Annotated[tuple[records.Length, records.Length], Field(strict=False)] | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if bool(self.axes) == (self.bending_stiffness is not None):
            raise records.CrossFaults(["axes: give them, or bending_stiffness, and not both"])
        lengths = [math.hypot(*axis) for axis in self.axes]
        if 0.0 in lengths:
            fault = f"axes[{lengths.index(0.0) + 1}]: has no length; give a direction"
            raise records.CrossFaults([fault])
        if self.rolls and len(self.axes) != 1:
            fault = f"axes: {len(self.axes)} given for surfaces that roll; they need one"
            raise records.CrossFaults([fault])
        if isinstance(self.stiffness, SpringLaw) and self.stiffness.angle and self.rest_angle:
            fault = f"rest_angle: {self.rest_angle:g} given beside a law with the angle "
            raise records.CrossFaults([f"{fault}{self.stiffness.angle:g}; give one of them"])
        units = np.array(self.axes) / np.array(lengths)[:, None]
        if len(units) == 2 and np.linalg.norm(np.cross(*units)) < 1e-6:
            raise records.CrossFaults([f"axes: {self.axes} are parallel; one would do"])
        return self

    def _touching(self, surface: float, radius: float) -> float:
        """Return the turn [rad] of a rolling surface at which its disk reaches the tangent plane.

        The edge of the disk, at (r − h, R) from the centre, is then r ahead:
        (r − h) cos θ + R sin θ = r.
        """
        ahead = surface - self.disk_offset
        far = math.hypot(ahead, radius)
        if far <= surface:
            return math.pi
        return math.atan2(radius, ahead) - math.acos(surface / far)

    def limit_of_disks(self, hole_radius: float) -> float:
        """Return the limit [rad] where disks touch, if the joint has no limit of its own."""
        radius = self.disk_radius or hole_radius
        if self.rolls:
            first, second = self.rolls
            # the disk after the joint turns by r₁/r₂ times as much as the line of centres
            share = first / second
            touching = self._touching(first, radius), self._touching(second, radius) / share
            return min(*touching, STEEPEST / (1.0 + share))
        bend = min(2.0 * math.atan(self.disk_offset / radius), STEEPEST)
        if len(self.axes) < 2:
            return bend
        # two axes at right angles, both turned by x, bend the arm by γ: cos γ = cos² x
        return math.acos(math.sqrt(math.cos(bend)))


@records.record
class Link:
    """One link: from its joint centre to the next joint centre, or to the tip.

    Attributes:
        length: Length [m].
        mass: Mass [kg] of a solid cylinder with the hole radius of its first disk, centred at
            mid-link.
        bending_stiffness: EI [N m²]; None: the link does not bend. A link that bends is a chain of
            beams between the places where something acts on it: its joints and disks.
        torsion_stiffness: GJ [N m²]; None: EI/1.3, as of a tube with Poisson's ratio 0.3; inf: it
            does not twist.
        pieces: Number of equal pieces of each of these beams.

    Example:
        >>> import cdsm
        >>> cdsm.Link(length=0.04, mass=0.5).length
        0.04
    """

    length: records.Length
    mass: records.Mass
    bending_stiffness: records.Bending | None = None
    torsion_stiffness: records.Torsion | None = None
    pieces: Pieces = 1


@records.record
class CableRoute:
    """Path of one cable: a hole at the same angle on every disk, from the base to its last disk.

    Attributes:
        joint: Number of the joint that the cable drives, from 1; the cable ends on the first disk
            after this joint.
        angle: φ: angle of its holes about x, from y towards z [rad].
        lead: Straight cable between the actuator and the base disk [m].
        friction: μ [-]: Coulomb friction coefficient in every hole that the cable passes. Without
            a lead, the actuator is at the base disk, and there is no friction there.
        radius: Distance of its holes from the arm's axis on every disk [m], e.g. of an inner ring;
            None: the hole radius of each disk.

    Example:
        >>> import cdsm
        >>> cdsm.CableRoute(joint=2, angle=1.57, lead=0.3, friction=0.1).joint
        2
    """

    joint: Annotated[records.Integer, Field(ge=1)]
    angle: records.Number
    lead: records.LengthOrZero = 0.0
    friction: records.FrictionCoefficient = 0.0
    radius: records.Length | None = None


class Disk(NamedTuple):
    """One disk of an arm.

    ``link`` is the link in the URDF that carries it at ``x`` [m] along the link, ``joint`` the
    number of the joint next to it, ``hole_radius`` the R [m], ``radius`` the outer radius [m].
    """

    link: str
    x: float
    joint: int
    hole_radius: float
    radius: float

    def radius_of(self, route: CableRoute) -> float:
        """Return the distance of the hole of a cable ``route`` from the axis of the disk [m]."""
        return route.radius or self.hole_radius

    def hole(self, route: CableRoute) -> tuple[float, float, float]:
        """Return the place `(x, R cos φ, R sin φ)` [m] of a cable's hole, in the link's frame."""
        R = self.radius_of(route)
        return self.x, R * math.cos(route.angle), R * math.sin(route.angle)


def overlapping(disks: Sequence[Disk], poses: dict[str, Array]) -> list[tuple[str, str]]:
    """Return the pairs of links whose bodies overlap, by coal; no neighbours.

    The body of a link is the cylinder from its first disk to its last, with the largest radius of
    these disks; ``poses`` has the pose (4, 4) of each link, translation in m.
    """
    import coal

    bodies = []
    for link, pose in poses.items():
        disks_of_link = [disk for disk in disks if disk.link == link]
        first = disks_of_link[0].x
        last = disks_of_link[-1].x
        shape = coal.Cylinder(max(disk.radius for disk in disks_of_link), last - first)
        centre = pose[:3, 3] + pose[:3, 0] * (first + last) / 2.0
        place = coal.Transform3s(np.roll(pose[:3, :3], -1, axis=1), centre)  # its z is the link's x
        bodies.append((link, coal.CollisionObject(shape, place)))
    request = coal.CollisionRequest()
    return [
        (one, other)
        for i, (one, body) in enumerate(bodies)
        for other, far in bodies[i + 2 :]
        if body.getAABB().overlap(far.getAABB())
        and coal.collide(body, far, request, coal.CollisionResult())
    ]
