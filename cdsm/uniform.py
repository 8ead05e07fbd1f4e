"""Uniform arms: the keywords of their constructors, checked, and the geometry they stand for."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import Field

from cdsm.parts import MAXIMUM_JOINTS, CableRoute, Joint, Limit, Link
from cdsm.support.records import Direction, Integer, Name, NotNegative, Number, Positive, record

UNIVERSAL_AXES = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

CablesPerJoint = Annotated[Integer, Field(ge=1, le=64)]


@record
class Uniform:
    """The keywords that :meth:`Geometry.universal` and :meth:`Geometry.hinged` share."""

    joints: Annotated[Integer, Field(ge=1, le=MAXIMUM_JOINTS)]
    cables_per_joint: CablesPerJoint
    link_length: Positive
    base_length: NotNegative
    disk_offset: Positive
    hole_radius: Positive
    link_mass: NotNegative
    lead: NotNegative = 0.0
    joint_limit: Limit = None
    name: Name = "arm"

    def geometry(
        self, axes: list[tuple[Direction, ...]], angles: list[list[float]]
    ) -> dict[str, Any]:
        """Fields of the geometry with these joint axes and hole angles, joint by joint."""
        return {
            "name": self.name,
            "base_length": self.base_length,
            "hole_radius": self.hole_radius,
            "joints": tuple(
                Joint(axes=of_joint, disk_offset=self.disk_offset, limit=self.joint_limit)
                for of_joint in axes
            ),
            "links": (Link(length=self.link_length, mass=self.link_mass),) * self.joints,
            "cables": tuple(
                CableRoute(joint=k + 1, angle=angle, lead=self.lead)
                for k, of_joint in enumerate(angles)
                for angle in of_joint
            ),
        }


@record
class Universal(Uniform):
    """Keywords of :meth:`Geometry.universal`."""

    def fields(self) -> dict[str, Any]:
        """Fields of the geometry."""
        n, m = self.joints, self.cables_per_joint
        angles = [[2.0 * math.pi * (k + n * j) / (n * m) for j in range(m)] for k in range(n)]
        return self.geometry([UNIVERSAL_AXES] * n, angles)


@record
class Hinged(Uniform):
    """Keywords of :meth:`Geometry.hinged`."""

    twist: Number
    cables_per_joint: CablesPerJoint = 2

    def fields(self) -> dict[str, Any]:
        """Fields of the geometry."""
        m = self.cables_per_joint
        rolls = [k * self.twist for k in range(self.joints)]
        axes: list[tuple[Direction, ...]] = [((0.0, math.cos(r), math.sin(r)),) for r in rolls]
        # evenly spread from 90 degrees beside the axis: m = 2 gives the antagonistic pair
        angles = [[r + math.pi / 2 + 2.0 * math.pi * j / m for j in range(m)] for r in rolls]
        return self.geometry(axes, angles)
