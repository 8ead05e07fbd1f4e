"""Geometry of a serpentine arm: build it from joints or sections, or read it from TOML."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

from cdsm.errors import GeometryError
from cdsm.geometry import tables
from cdsm.geometry.description import GeometryFields
from cdsm.geometry.holes import evenly_spaced, hinge_hole_angles, spread_out
from cdsm.geometry.parts import UNIVERSAL_AXES, CableRoute, Joint, Limit, Link, Turn
from cdsm.geometry.uniform import CablesPerJoint, HoleAngles, JointCount, uniform
from cdsm.support.files import read_text, write_text
from cdsm.support.records import (
    Friction,
    Length,
    LengthOrZero,
    Mass,
    Name,
    Number,
    PerJoint,
    checked_keywords,
    read_toml,
    record,
)
from cdsm.support.validation import instance, scalar, sequence_of


@record
class Geometry(GeometryFields):
    """A serpentine arm, joint by joint; frozen, checked, all in SI units.

    This general constructor allows different joints, links and cables. :meth:`universal` and
    :meth:`hinged` build arms of equal or similar joints, :meth:`sections` joins several arms to
    one, and :meth:`replace` changes some attributes. Joint 1 is at x = ``base_length``, joint k+1
    at the end of link k, and the tip at the end of the last link. Every joint has two disks, at the
    distance ``disk_offset`` before and after it; both have the ``hole_radius`` of the joint.

    Attributes:
        name: Name of the robot: letters, digits and underscores.
        base_length: L_0: distance from the base frame to joint 1 [m].
        hole_radius: R: distance of the holes from the arm's axis [m]; a joint may have its own.
        joints: All joints, base to tip.
        links: One :class:`Link` per joint.
        cables: One :class:`CableRoute` per cable.

    Raises:
        GeometryError: The geometry is invalid; lists every fault: unknown or missing keys, wrong
            types, lengths that are not positive, overlapping disks, holes outside their disk,
            cables that end past the last joint, > 100 joints.

    Warns:
        CdsmWarning: Cables share a hole, or lengths look like millimetres.
    """

    def __repr__(self) -> str:
        return f"<Geometry {self}>"

    @classmethod
    @checked_keywords
    def universal(
        cls,
        *,
        joints: JointCount,
        cables_per_joint: CablesPerJoint | None = None,
        link_length: PerJoint[Length],
        base_length: LengthOrZero,
        disk_offset: PerJoint[Length],
        hole_radius: PerJoint[Length],
        link_mass: PerJoint[Mass],
        lead: PerJoint[LengthOrZero] = 0.0,
        friction: PerJoint[Friction] = 0.0,
        joint_limit: PerJoint[Limit] | None = None,
        disk_radius: PerJoint[Length] | None = None,
        cable_radius: PerJoint[Length] | None = None,
        hole_angles: HoleAngles | None = None,
        phase: PerJoint[Number] = 0.0,
        spread: Turn = 0.0,
        name: Name = "arm",
    ) -> Self:
        """Build an arm of n universal joints with m cables each.

        Cable j = 0…m−1 of joint k = 1…n has its holes at φ = 2π((k−1) + n j)/(n m) + phase_k, or
        at φ = hole_angles[k][j] + phase_k. If ``hole_angles`` and ``phase`` are not given, all
        holes of the base disk are evenly spaced. A size is one number for all joints, or a list
        with one for each joint, base to tip.

        Args:
            joints: n, 1 to 100.
            cables_per_joint: m; not needed with ``hole_angles``.
            link_length: Length of every link [m], more than two ``disk_offset``.
            base_length: L_0: distance from the base frame to joint 1 [m].
            disk_offset: h: distance from each joint centre to the disk on each side [m].
            hole_radius: R: distance of the holes from the axis, on both disks of a joint [m].
            link_mass: Mass of every link [kg].
            lead: Straight cable between each actuator and the base disk [m].
            friction: Friction coefficient μ of the cables [-], as in :class:`CableRoute`.
            joint_limit: Largest angle about each axis in both directions [rad]. None: the angle
                2 atan(h/r) at which disks of radius r touch, at most 80°; r is ``disk_radius``, or
                else R.
            disk_radius: Outer radius of the disks [m]; None: 1.1 times the distance of the farthest
                hole from the axis.
            cable_radius: Distance of the holes from the axis on all disks [m], for the cables of
                each joint, e.g. on an inner ring; None: the ``hole_radius`` of each disk.
            hole_angles: φ of the cables of a joint [rad]: one list for all joints, or a list of
                lists, one for each joint.
            phase: Added to φ of the cables of each joint [rad].
            spread: Angle [rad] between the holes of g cables whose angles φ are equal: the hole of
                cable i = 0…g−1, base to tip, is turned by (i − (g−1)/2)·spread. 0: not turned.
            name: Name of the robot.

        Raises:
            GeometryError: Some arguments are invalid; lists every fault.

        Warns:
            CdsmWarning: As for :class:`Geometry`.
        """
        keywords = locals()  # of the call, before there are other variables
        axes = [UNIVERSAL_AXES] * joints
        return cls(**uniform(axes, lambda m: evenly_spaced(joints, m), keywords))

    @classmethod
    @checked_keywords
    def hinged(
        cls,
        *,
        joints: JointCount,
        twist: Turn,
        cables_per_joint: CablesPerJoint | None = None,
        link_length: PerJoint[Length],
        base_length: LengthOrZero,
        disk_offset: PerJoint[Length],
        hole_radius: PerJoint[Length],
        link_mass: PerJoint[Mass],
        lead: PerJoint[LengthOrZero] = 0.0,
        friction: PerJoint[Friction] = 0.0,
        joint_limit: PerJoint[Limit] | None = None,
        disk_radius: PerJoint[Length] | None = None,
        cable_radius: PerJoint[Length] | None = None,
        hole_angles: HoleAngles | None = None,
        phase: PerJoint[Number] = 0.0,
        spread: Turn = 0.0,
        name: Name = "arm",
    ) -> Self:
        """Build an arm of n hinges; ``twist`` [rad] turns each axis about x from the previous one.

        Hinge k has the axis cos ψ_k y + sin ψ_k z with ψ_k = (k−1)·twist. The link frames are not
        twisted. Cable j = 0…m−1 of hinge k has its holes at φ = ψ_k + 90° + 2πj/m + phase_k: by
        default (m = 2) an antagonistic pair at ψ_k ± 90°. If ``hole_angles`` is given, φ =
        hole_angles[k][j] + phase_k, measured from y. All other arguments, errors and warnings are
        as for :meth:`universal`.

        Hinges with parallel axes, e.g. every second one if the twist is 90°, have cables that share
        holes; ``spread`` separates them.
        """
        keywords = locals()  # of the call, before there are other variables
        if cables_per_joint is None and hole_angles is None:
            keywords["cables_per_joint"] = 2
        rolls = [k * twist for k in range(joints)]
        axes = [((0.0, math.cos(roll), math.sin(roll)),) for roll in rolls]
        return cls(**uniform(axes, lambda m: hinge_hole_angles(rolls, m), keywords))

    @classmethod
    def sections(
        cls, sections: Sequence[Geometry], *, spread: float = 0.0, name: str = "arm"
    ) -> Geometry:
        """Join arms end to end to one arm, each as a section.

        Each section keeps its joints, links, radii and cables. Its base frame is the tip of the
        section before, whose last link therefore becomes longer by its ``base_length``. Its cables
        run through all disks before it, at an unchanged angle, and at the hole radius of each disk
        or at their own radius (``cable_radius``).

        Args:
            sections: The sections, base to tip.
            spread: Angle [rad] between the holes of cables whose angles φ are equal, as for
                :meth:`universal`, but among the cables of all sections. Alternatively, give each
                section another ``phase``.
            name: Name of the robot.

        Raises:
            InvalidInput: ``sections`` is not a list or tuple of geometries.
            GeometryError: The arm is invalid: no section, > 100 joints, overlapping disks.

        Warns:
            CdsmWarning: As for :class:`Geometry`.
        """
        parts = sequence_of("sections", sections, Geometry)
        if not parts:
            raise GeometryError(["sections: none given; give one or more"])
        first = parts[0]
        joints: list[Joint] = []
        links: list[Link] = []
        cables: list[CableRoute] = []
        for part in parts:
            if links:
                length = links[-1].length + part.base_length
                links[-1] = replace(links[-1], length=length)
            cables += [replace(each, joint=each.joint + len(joints)) for each in part.cables]
            joints += [
                replace(joint, hole_radius=None if first.hole_radius == R else R)
                for joint, R in zip(part.joints, part.hole_radii, strict=True)
            ]
            links += part.links
        return cls(
            name=name,
            base_length=first.base_length,
            hole_radius=first.hole_radius,
            joints=tuple(joints),
            links=tuple(links),
            cables=spread_out(cables, scalar("spread", spread)),
        )

    def replace(self, **changes: Any) -> Geometry:
        """Return a copy of this geometry with other attributes, e.g. ``replace(hole_radius=0.02)``.

        If ``hole_radius`` is given without ``joints``, all joints get it. Raises GeometryError,
        which lists every fault, if the changed geometry is invalid.
        """
        if "hole_radius" in changes and "joints" not in changes:
            changes["joints"] = tuple(replace(joint, hole_radius=None) for joint in self.joints)
        return replace(self, **changes)

    def to_toml(self) -> str:
        """Return the TOML text from which :meth:`read` builds an equal geometry."""
        return tables.text_of(self)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the text of :meth:`to_toml` to a file; return its path. FileError on failure."""
        return write_text(path, self.to_toml())

    @classmethod
    def from_toml(cls, text: str, source: str | None = None) -> Geometry:
        """Build a geometry from TOML text, see :meth:`read`; errors begin with ``source``.

        Raises GeometryError, which lists every fault, if the text is not TOML or not a geometry.
        """
        instance("text", text, str)
        try:
            return tables.build_only(cls, read_toml(text))
        except GeometryError as error:
            raise GeometryError(error.faults, source) from None

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Geometry:
        """Read a geometry from a TOML file.

        The file has the full form that :meth:`write` writes, or one table ``[universal]`` or
        ``[hinged]``, whose keys are the keywords of :meth:`universal` or :meth:`hinged`. An arm of
        sections has such a table in each ``[[sections]]`` (``[sections.universal]``), and at the
        top the keywords ``name`` and ``spread`` of :meth:`sections`. From an ARM.toml (see
        :meth:`cdsm.Manipulator.read`), only the geometry is read.

        Raises:
            FileError: The file cannot be read.
            GeometryError: The file is not TOML or not a geometry; lists every fault, also unknown
                keys.
        """
        return cls.from_toml(read_text(path), source=os.fspath(path))
