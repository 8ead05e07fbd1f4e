"""Parts of a geometry: joints, links, routes of cables, disks."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from cdsm.support.records import (
    CrossFaults,
    Direction,
    Friction,
    Integer,
    Length,
    LengthOrZero,
    Mass,
    Number,
    record,
)

MAXIMUM_JOINTS = 100
"""Largest number of joints, since many more would overflow the stack of the URDF parsers."""

UNIVERSAL_AXES = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def _in_radians(value: float) -> float:
    if abs(value) > 2.0 * math.pi:
        raise ValueError(
            f"{value:g} rad given; at most one turn, 6.28 rad, is allowed; convert degrees to "
            "radians"
        )
    return value


Turn = Annotated[Number, AfterValidator(_in_radians)]
Limit = Annotated[Number, Field(gt=0, le=math.pi)]


@record
class Joint:
    """One joint of the arm and the two disks next to it.

    Attributes:
        axes: One axis (hinge), or the first and the second axis (universal joint), in the frame of
            the previous link. Any length; no axis is zero, and two axes are not parallel.
        disk_offset: h: distance from the joint centre to the disk on each side [m].
        limit: Largest angle about each axis in both directions [rad]; None: the angle at which
            disks of radius r touch, at most 80°; r is ``disk_radius``, or the hole radius if that
            is None.
        hole_radius: R: distance of the holes of its two disks from the arm's axis [m]; None: the
            ``hole_radius`` of the :class:`Geometry`.
        disk_radius: Outer radius of the two disks [m]; None: 1.1 times the distance of the farthest
            hole from the axis.

    Raises:
        GeometryError: Some attributes are invalid; lists every fault.
    """

    axes: Annotated[tuple[Direction, ...], Field(strict=False, min_length=1, max_length=2)]
    disk_offset: Length
    limit: Limit | None = None
    hole_radius: Length | None = None
    disk_radius: Length | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        lengths = [math.hypot(*axis) for axis in self.axes]
        faults = [
            f"axes[{i + 1}]: {axis} has no usable length; give a direction"
            for i, (axis, length) in enumerate(zip(self.axes, lengths, strict=True))
            if not 1e-6 < length < 1e6
        ]
        if not faults and len(self.axes) == 2:
            sine = math.hypot(*np.cross(*self.axes)) / (lengths[0] * lengths[1])
            if sine < 1e-6:
                faults.append(f"axes: the two axes {self.axes} are parallel; one would do")
        if faults:
            raise CrossFaults(faults)
        return self


@record
class Link:
    """One link: from its joint centre to the next joint centre, or to the tip.

    Attributes:
        length: Length [m].
        mass: Mass [kg] of a solid cylinder with the hole radius of its first disk, centred at
            mid-link.

    Raises:
        GeometryError: Some attributes are invalid; lists every fault.
    """

    length: Length
    mass: Mass


@record
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

    Raises:
        GeometryError: Some attributes are invalid; lists every fault.
    """

    joint: Annotated[Integer, Field(ge=1)]
    angle: Number
    lead: LengthOrZero = 0.0
    friction: Friction = 0.0
    radius: Length | None = None


class Disk(NamedTuple):
    """One disk of an arm.

    Attributes:
        link: Name in the URDF of the link that carries it.
        x: Position along x of the link [m].
        joint: Number of the joint next to the disk, from 1.
        hole_radius: R: distance of its holes from the axis [m].
        radius: Outer radius [m].
    """

    link: str
    x: float
    joint: int
    hole_radius: float
    radius: float

    def radius_of(self, route: CableRoute) -> float:
        """Return the distance of the hole of a cable ``route`` from the axis of the disk [m]."""
        return self.hole_radius if route.radius is None else route.radius

    def hole(self, route: CableRoute) -> tuple[float, float, float]:
        """Return the position (x, R cos φ, R sin φ) [m] of a cable's hole, in the link's frame."""
        radius = self.radius_of(route)
        return self.x, radius * math.cos(route.angle), radius * math.sin(route.angle)
