"""The parts of a geometry: joints, links and cable routes. SI units (m, rad, kg)."""

from __future__ import annotations

import math
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from cdsm.support.records import (
    CrossFaults,
    Direction,
    Integer,
    NotNegative,
    Number,
    Positive,
    record,
)

MAXIMUM_JOINTS = 100
"""More would overflow the URDF parsers' stack before long; no such arm exists."""

Limit = Annotated[Number, Field(gt=0, le=math.pi)] | None


@record
class Joint:
    """One joint of the arm and the two disks beside it.

    Attributes:
        axes: One axis (hinge) or two (universal joint, in this order), in the axes of the link
            before; any length, none zero, not parallel.
        disk_offset: h: distance of the disk before and the disk after from the joint centre [m].
        limit: Largest angle about each axis, both ways [rad]; None: until the disks touch.

    Raises:
        GeometryError: Lists every fault.
    """

    axes: Annotated[tuple[Direction, ...], Field(strict=False, min_length=1, max_length=2)]
    disk_offset: Positive
    limit: Limit = None

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
    """One link: from its joint centre to the next one, or to the tip.

    Attributes:
        length: Length [m].
        mass: Mass [kg], spread as a solid cylinder of the hole radius about mid-link.

    Raises:
        GeometryError: Lists every fault.
    """

    length: Positive
    mass: NotNegative


@record
class CableRoute:
    """The path of one cable: the same hole on every disk until its last one.

    Attributes:
        joint: Number of the joint it drives, from 1; it ends on the first disk after it.
        angle: φ: hole angle about x, from y towards z [rad].
        lead: Straight cable between the actuator and the base disk [m].

    Raises:
        GeometryError: Lists every fault.
    """

    joint: Annotated[Integer, Field(ge=1)]
    angle: Number
    lead: NotNegative = 0.0
