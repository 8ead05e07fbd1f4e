"""Description of an arm: joints, links, holes and cable routes, and its TOML form.

All units are SI (m, rad, kg). The straight arm lies along x, and all lengths are measured along x.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from cdsm.errors import GeometryError
from cdsm.support.files import read_text, write_text
from cdsm.support.records import (
    CrossFaults,
    Direction,
    Friction,
    Integer,
    Length,
    LengthOrZero,
    Mass,
    Name,
    Number,
    checked_keywords,
    did_you_mean,
    parse,
    read_toml,
    record,
    toml_lines,
)
from cdsm.support.validation import instance
from cdsm.support.values import Printed

MAXIMUM_JOINTS = 100
"""Largest number of joints, since many more would overflow the stack of the URDF parsers."""

UNIVERSAL_AXES = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

ARM_KEYS = (
    *("gravity", "original_length", "wire", "wires", "urdf"),
    *("series_stiffness", "control", "minimum", "maximum"),
)
"""Keys of an ARM.toml that do not describe its geometry; ``cables`` may."""

JointCount = Annotated[Integer, Field(ge=1, le=MAXIMUM_JOINTS)]
CablesPerJoint = Annotated[Integer, Field(ge=1, le=64)]
JointLimit = Annotated[Number, Field(gt=0, le=math.pi)] | None


@record
class Joint:
    """One joint of the arm and the two disks next to it.

    Attributes:
        axes: One axis (hinge) or two (universal joint, in this order), in the axes of the previous
            link. Any length; no axis is zero, and two axes are not parallel.
        disk_offset: h: distance from the joint centre to the disk on each side [m].
        limit: Largest angle about each axis in both directions [rad]; None: until the disks touch.

    Raises:
        GeometryError: Some attributes are invalid; lists every fault.
    """

    axes: Annotated[tuple[Direction, ...], Field(strict=False, min_length=1, max_length=2)]
    disk_offset: Length
    limit: JointLimit = None

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
        mass: Mass [kg] of a solid cylinder with the hole radius, centred at mid-link.

    Raises:
        GeometryError: Some attributes are invalid; lists every fault.
    """

    length: Length
    mass: Mass


@record
class CableRoute:
    """Path of one cable: the same hole on every disk until its last disk.

    Attributes:
        joint: Number of the joint it drives, from 1; it ends on the first disk after the joint.
        angle: φ: angle of the hole about x, from y towards z [rad].
        lead: Straight cable between the actuator and the base disk [m].
        friction: μ [-]: Coulomb friction coefficient in every hole that the cable passes. With no
            lead the cable starts at the base disk, and nothing slides there.

    Raises:
        GeometryError: Some attributes are invalid; lists every fault.
    """

    joint: Annotated[Integer, Field(ge=1)]
    angle: Number
    lead: LengthOrZero = 0.0
    friction: Friction = 0.0


@record
class Geometry(Printed):
    """A serpentine arm, joint by joint; frozen, checked, all in SI units.

    This general constructor allows different joints, links and cables. :meth:`universal` and
    :meth:`hinged` build uniform arms. Joint 1 is at x = ``base_length``, joint k+1 at the end of
    link k, and the tip at the end of the last link. Every joint has one disk ``disk_offset`` before
    it and one after it. The holes of the disks are at ``hole_radius``.

    Attributes:
        name: Name of the robot: letters, digits and underscores.
        base_length: L_0: distance from the base frame to joint 1 [m].
        hole_radius: R: distance of all holes from the arm's axis [m].
        joints: All joints, base to tip.
        links: One :class:`Link` per joint.
        cables: One :class:`CableRoute` per cable.

    Raises:
        GeometryError: The geometry is invalid; lists every fault: unknown or missing keys, wrong
            types, lengths that are not positive, overlapping disks, cables that end past the last
            joint, > 100 joints.
    """

    joints: Annotated[
        tuple[Joint, ...], Field(strict=False, min_length=1, max_length=MAXIMUM_JOINTS)
    ]
    links: Annotated[tuple[Link, ...], Field(strict=False)]
    cables: Annotated[tuple[CableRoute, ...], Field(strict=False, min_length=1)]
    base_length: LengthOrZero
    hole_radius: Length
    name: Name = "arm"

    @classmethod
    @checked_keywords
    def universal(
        cls,
        *,
        joints: JointCount,
        cables_per_joint: CablesPerJoint,
        link_length: Length,
        base_length: LengthOrZero,
        disk_offset: Length,
        hole_radius: Length,
        link_mass: Mass,
        lead: LengthOrZero = 0.0,
        friction: Friction = 0.0,
        joint_limit: JointLimit = None,
        name: Name = "arm",
    ) -> Self:
        """Build a uniform arm of n universal joints with m cables each.

        Cable j = 0…m−1 of joint k = 1…n has its holes at φ = 2π((k−1) + n j)/(n m). All holes of
        the base disk are therefore evenly spaced.

        Args:
            joints: n, 1 to 100.
            cables_per_joint: m.
            link_length: Length of every link [m], more than two ``disk_offset``.
            base_length: L_0: distance from the base frame to joint 1 [m].
            disk_offset: h: distance from each joint centre to the disk on each side [m].
            hole_radius: R [m].
            link_mass: Mass of every link [kg].
            lead: Straight cable between each actuator and the base disk [m].
            friction: μ of all cables, as in :class:`CableRoute`.
            joint_limit: Largest angle about each axis in both directions [rad]. None: until the
                disks touch, 2 atan(h/R), at most 80°.
            name: Name of the robot.

        Raises:
            GeometryError: Some arguments are invalid; lists every fault.
        """
        n, m = joints, cables_per_joint
        return cls(
            name=name,
            base_length=base_length,
            hole_radius=hole_radius,
            joints=(Joint(axes=UNIVERSAL_AXES, disk_offset=disk_offset, limit=joint_limit),) * n,
            links=(Link(length=link_length, mass=link_mass),) * n,
            cables=tuple(
                CableRoute(
                    joint=k + 1,
                    angle=2.0 * math.pi * (k + n * j) / (n * m),
                    lead=lead,
                    friction=friction,
                )
                for k in range(n)
                for j in range(m)
            ),
        )

    @classmethod
    @checked_keywords
    def hinged(
        cls,
        *,
        joints: JointCount,
        twist: Number,
        cables_per_joint: CablesPerJoint = 2,
        link_length: Length,
        base_length: LengthOrZero,
        disk_offset: Length,
        hole_radius: Length,
        link_mass: Mass,
        lead: LengthOrZero = 0.0,
        friction: Friction = 0.0,
        joint_limit: JointLimit = None,
        name: Name = "arm",
    ) -> Self:
        """Build a uniform arm of n hinges; ``twist`` turns each axis about x from the previous one.

        Hinge k has the axis cos ψ_k y + sin ψ_k z with ψ_k = (k−1)·twist. The link frames are not
        twisted. The cables of a hinge are evenly spaced and start at φ = ψ_k + 90°. A pair is at
        ψ_k ± 90°.

        Args:
            joints: n, 1 to 100.
            twist: Angle between neighbouring hinge axes about x [rad].
            cables_per_joint: m; 2 is the antagonistic pair.
            link_length: As for :meth:`universal`, like all following arguments [m].
            base_length: L_0 [m].
            disk_offset: h [m].
            hole_radius: R [m].
            link_mass: Mass of every link [kg].
            lead: Straight cable between each actuator and the base disk [m].
            friction: μ of all cables, as in :class:`CableRoute`.
            joint_limit: Largest angle in both directions [rad].
            name: Name of the robot.

        Raises:
            GeometryError: Some arguments are invalid; lists every fault.
        """
        rolls = [k * twist for k in range(joints)]
        # evenly spaced, starting 90 degrees from the axis: two cables form the antagonistic pair
        turns = [2.0 * math.pi * j / cables_per_joint for j in range(cables_per_joint)]
        return cls(
            name=name,
            base_length=base_length,
            hole_radius=hole_radius,
            joints=tuple(
                Joint(
                    axes=((0.0, math.cos(roll), math.sin(roll)),),
                    disk_offset=disk_offset,
                    limit=joint_limit,
                )
                for roll in rolls
            ),
            links=(Link(length=link_length, mass=link_mass),) * joints,
            cables=tuple(
                CableRoute(
                    joint=k + 1, angle=roll + math.pi / 2 + turn, lead=lead, friction=friction
                )
                for k, roll in enumerate(rolls)
                for turn in turns
            ),
        )

    @model_validator(mode="after")
    def _check(self) -> Self:
        faults, count = [], len(self.joints)
        if len(self.links) != count:
            faults.append(
                f"links: {len(self.links)} given for {count} joints; every joint has one link "
                "after it"
            )
        offsets = [joint.disk_offset for joint in self.joints]
        for k, (link, before, after) in enumerate(
            zip(self.links, offsets, [*offsets[1:], 0.0], strict=False), start=1
        ):
            if link.length <= before + after:
                what = "its disk" if k == count else "its two disks overlap: they"
                faults.append(
                    f"links[{k}].length: {link.length:g} m is too short, {what} "
                    f"need more than {before + after:g} m; lengthen the link or lower disk_offset"
                )
        faults += [
            f"cables[{c}].joint: {cable.joint} is past the last joint, {count}; give 1 to {count}"
            for c, cable in enumerate(self.cables, start=1)
            if cable.joint > count
        ]
        if faults:
            raise CrossFaults(faults)
        return self

    def __str__(self) -> str:
        dof = sum(len(joint.axes) for joint in self.joints)
        return (
            f"{self.name}: {len(self.joints)} joints ({dof} degrees of freedom), "
            f"{len(self.cables)} cables, {self.length:g} m long"
        )

    @property
    def length(self) -> float:
        """Length of the straight arm from the base frame to the tip [m]."""
        return self.base_length + sum(link.length for link in self.links)

    @property
    def joint_limits(self) -> tuple[float, ...]:
        """Limit of each joint [rad]: the given limit, or 2 atan(h/R), at most 80°."""
        return tuple(
            min(2.0 * math.atan(joint.disk_offset / self.hole_radius), math.radians(80.0))
            if joint.limit is None
            else joint.limit
            for joint in self.joints
        )

    @property
    def disks(self) -> tuple[tuple[str, tuple[float, ...]], ...]:
        """Name and disk positions along x [m] of each link, starting with the base."""
        offsets = [joint.disk_offset for joint in self.joints]
        ends = [link.length - after for link, after in zip(self.links, offsets[1:], strict=False)]
        places = [(self.base_length - offsets[0],), *zip(offsets, ends, strict=False), offsets[-1:]]
        names = ["base_disk", *(f"link{k + 1}" for k in range(len(offsets)))]
        return tuple((name, tuple(at)) for name, at in zip(names, places, strict=True))

    def to_toml(self) -> str:
        """Return the TOML text from which :meth:`read` builds an equal geometry."""
        lines = [
            "# cdsm geometry. Units: m, rad, kg.",
            "# axes: in the axes of the link before; angle: of the hole about x, from y towards z;",
            "# joint (of a cable): the joint it drives, from 1; it ends on the disk after it.",
        ]
        return "\n".join([*lines, *self.toml_lines()]) + "\n"

    def toml_lines(self, prefix: str = "") -> list[str]:
        """Return the lines of :meth:`to_toml`, with a prefix before the names of tables."""
        lines = toml_lines(self, ("name", "base_length", "hole_radius"))
        for joint in self.joints:
            lines += ["", f"[[{prefix}joints]]", *toml_lines(joint)]
        for link in self.links:
            lines += ["", f"[[{prefix}links]]", *toml_lines(link)]
        for cable in self.cables:
            keys = ("joint", "angle", "lead", *(["friction"] if cable.friction else []))
            lines += ["", f"[[{prefix}cables]]", *toml_lines(cable, keys)]
        return lines

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write :meth:`to_toml` to a file and return its path; a failure leaves no partial file.

        Raises:
            FileError: The file cannot be written.
        """
        return write_text(path, self.to_toml())

    @classmethod
    def from_toml(cls, text: str, source: str | None = None) -> Geometry:
        """Build a geometry from TOML text: see :meth:`read`.

        Args:
            text: The TOML text.
            source: Name of its file, for the error.

        Raises:
            GeometryError: ``text`` is not TOML or not a geometry; lists every fault.
        """
        instance("text", text, str)
        try:
            return cls.of_tables(split_geometry(read_toml(text))[0])
        except GeometryError as error:
            raise GeometryError(error.faults, source) from None

    @classmethod
    def of_tables(cls, data: dict[str, Any]) -> Geometry:
        """Build a geometry from parsed TOML: see :meth:`read`; raise GeometryError."""
        builders: dict[str, Callable[..., Geometry]] = {
            "universal": cls.universal,
            "hinged": cls.hinged,
            "geometry": lambda **full: parse(cls, full),
        }
        kind = next((key for key in data if key in builders), None)
        if kind is None and data.keys() & {"joints", "links"}:
            return parse(cls, data)
        if kind is None and "cables" in data:
            faults = ["holds cables but no joints: give a file of cables beside the arm it is for"]
        elif kind is None:
            found = ", ".join(data) or "nothing"
            faults = [f"holds {found}; give a table [universal] or [hinged], or the full form"]
        elif len(data) > 1:
            faults = [
                f"{key}: stands outside [{kind}], which says all of the geometry; move it in, or "
                f"away{did_you_mean(key, ARM_KEYS)}"
                for key in data
                if key != kind
            ]
        elif not isinstance(data[kind], dict):
            faults = [f"{kind}: is {data[kind]!r}; give a table [{kind}]"]
        else:
            return builders[kind](**data[kind])
        raise GeometryError(faults)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Geometry:
        """Read a geometry from a TOML file.

        The file has the full form that :meth:`write` writes, or one table ``[universal]`` or
        ``[hinged]``. The keys of the table are the keywords of the constructor with this name.

        Raises:
            FileError: The file cannot be read.
            GeometryError: The file is not TOML or not a geometry; lists every fault, also unknown
                keys.
        """
        return cls.from_toml(read_text(path), source=os.fspath(path))


def split_geometry(data: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Split the parsed TOML of an arm: what describes its geometry, and what does not.

    Cables belong to the geometry if its joints or links stand beside them.
    """
    kept = set(ARM_KEYS)
    if data.keys() - {"cables"} and not data.keys() & {"joints", "links"}:
        kept.add("cables")
    geometry = {key: value for key, value in data.items() if key not in kept}
    return geometry, {key: value for key, value in data.items() if key in kept}
