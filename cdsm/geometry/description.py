"""Base class of Geometry: its fields, their checks, and properties computed from them."""

from __future__ import annotations

import math
from typing import Annotated, Self

from pydantic import Field, model_validator

from cdsm.geometry.checks import doubts_about, farthest_holes, faults_of
from cdsm.geometry.parts import MAXIMUM_JOINTS, CableRoute, Disk, Joint, Link
from cdsm.support.format import plural
from cdsm.support.records import CrossFaults, Length, LengthOrZero, Name, record
from cdsm.support.values import Printed
from cdsm.support.warning import warn


@record
class GeometryFields(Printed):
    """Base class of :class:`~cdsm.Geometry`, whose docstring explains the fields."""

    joints: Annotated[
        tuple[Joint, ...], Field(strict=False, min_length=1, max_length=MAXIMUM_JOINTS)
    ]
    links: Annotated[tuple[Link, ...], Field(strict=False)]
    cables: Annotated[tuple[CableRoute, ...], Field(strict=False, min_length=1)]
    base_length: LengthOrZero
    hole_radius: Length
    name: Name = "arm"

    @model_validator(mode="after")
    def _check(self) -> Self:
        faults = faults_of(self)
        if faults:
            raise CrossFaults(faults)
        for doubt in doubts_about(self):
            warn(f"{self.name}: {doubt}")
        return self

    def __str__(self) -> str:
        dof = sum(len(joint.axes) for joint in self.joints)
        return (
            f"{self.name}: {plural(len(self.joints), 'joint')} "
            f"({plural(dof, 'degree')} of freedom), "
            f"{plural(len(self.cables), 'cable')}, {self.length:g} m long"
        )

    @property
    def length(self) -> float:
        """Length of the straight arm from the base frame to the tip [m]."""
        return self.base_length + sum(link.length for link in self.links)

    @property
    def hole_radii(self) -> tuple[float, ...]:
        """Hole radius R [m] for each joint; both disks of a joint have it."""
        return tuple(
            self.hole_radius if joint.hole_radius is None else joint.hole_radius
            for joint in self.joints
        )

    @property
    def joint_limits(self) -> tuple[float, ...]:
        """Limit of each joint [rad]: the given limit, or else 2 atan(h/r), at most 80°.

        h is the ``disk_offset``; r is the ``disk_radius`` if it is given, else the hole radius.
        """
        return tuple(
            min(2.0 * math.atan(joint.disk_offset / (joint.disk_radius or R)), math.radians(80.0))
            if joint.limit is None
            else joint.limit
            for joint, R in zip(self.joints, self.hole_radii, strict=True)
        )

    @property
    def disks(self) -> tuple[Disk, ...]:
        """All disks, base to tip: two per joint, one before and one after it.

        A cable of joint k passes the first 2k−1 disks and ends on disk 2k.
        """
        farthest = farthest_holes(self)
        links = ["base_disk", *(f"link{k + 1}" for k in range(len(self.joints)))]
        ends = [self.base_length, *(link.length for link in self.links)]
        disks = []
        for k, (joint, R, end) in enumerate(zip(self.joints, self.hole_radii, ends, strict=False)):
            for d, link, x in (
                (2 * k, links[k], end - joint.disk_offset),
                (2 * k + 1, links[k + 1], joint.disk_offset),
            ):
                radius = 1.1 * farthest[d] if joint.disk_radius is None else joint.disk_radius
                disks.append(Disk(link, x, k + 1, R, radius))
        return tuple(disks)

    @property
    def cable_names(self) -> tuple[str, ...]:
        """Name of each cable: the i-th of joint k is ``cable{k}_{i}``."""
        count = [0] * (len(self.joints) + 1)
        names = []
        for cable in self.cables:
            count[cable.joint] += 1
            names.append(f"cable{cable.joint}_{count[cable.joint]}")
        return tuple(names)
