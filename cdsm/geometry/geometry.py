"""Geometry of a serpentine arm: build it from joints or sections, or read it from TOML."""

from __future__ import annotations

import itertools
import math
import os
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property, update_wrapper
from inspect import signature
from itertools import count
from pathlib import Path
from typing import Annotated, Any, ParamSpec, Self

from pydantic import Field, TypeAdapter, model_validator

from cdsm.errors import GeometryError, listed, warn
from cdsm.geometry.beams import Backbone
from cdsm.geometry.chain import Chain, chain_of
from cdsm.geometry.parts import MAXIMUM_JOINTS, CableRoute, Disk, Joint, Link
from cdsm.geometry.uniform import Hinged, Rolling, Universal, same_angle, spread_out
from cdsm.springs import SpringLaw, law_table
from cdsm.support import records, validation
from cdsm.support.files import as_path, read_text, write_text
from cdsm.support.format import plural
from cdsm.support.records import CrossFaults, read_toml, record, toml_text
from cdsm.support.validation import WIDEST, doubts_about_angle, doubts_about_units, instance
from cdsm.support.values import Printed

_Keywords = ParamSpec("_Keywords")


def _from_sizes(kind: Callable[_Keywords, Universal | Backbone]) -> Callable[_Keywords, Geometry]:
    """Return a function that builds an arm and has the keywords and the docstring of ``kind``."""

    def build(*args: _Keywords.args, **keywords: _Keywords.kwargs) -> Geometry:
        return Geometry(**kind(*args, **keywords).parts())

    update_wrapper(build, kind, updated=())
    shown = signature(kind).replace(return_annotation="Geometry")
    build.__signature__ = shown  # type: ignore[attr-defined]  # of the record it would be None
    return build


@record
class Geometry(Printed):
    """A serpentine arm, joint by joint; frozen, checked, all in SI units.

    :meth:`universal` and :meth:`hinged` build arms of similar joints, :meth:`backbone` one on a
    flexible rod or tube, :meth:`rolling` one whose links roll on each other; :meth:`sections` joins
    arms. Joint 1 is at x = ``base_length``, joint k+1
    at the end of link k, and the tip at the end of the last link. Every joint has two disks, at the
    distance ``disk_offset`` before and after it; both have the ``hole_radius`` of the joint.

    Attributes:
        name: Name of the robot: letters, digits and underscores.
        base_length: `L_0`: distance from the base frame to joint 1 [m].
        hole_radius: R: distance of the holes from the arm's axis [m]; a joint may have its own.
        joints: Up to 100 joints, base to tip.
        links: One :class:`Link` after each joint, longer than the offsets of its disks.
        cables: One :class:`CableRoute` per cable.

    Raises:
        GeometryError: The geometry is invalid; lists every fault.

    Warns:
        CdsmWarning: Cables share a hole, or lengths look like mm, or angles like degrees.

    Example:
        >>> import cdsm
        >>> geometry = cdsm.Geometry.universal(
        ...     joints=4, cables_per_joint=3, link_length=0.06, base_length=0.03,
        ...     disk_offset=0.012, hole_radius=0.025, link_mass=0.12, joint_limit=0.35,
        ... )
        >>> round(geometry.length, 3), geometry.cable_names[:3]
        (0.27, ('cable1_1', 'cable1_2', 'cable1_3'))
    """

    joints: Annotated[
        tuple[Joint, ...], Field(strict=False, min_length=1, max_length=MAXIMUM_JOINTS)
    ]
    links: Annotated[tuple[Link, ...], Field(strict=False)]
    cables: Annotated[tuple[CableRoute, ...], Field(strict=False, min_length=1)]
    base_length: records.LengthOrZero
    hole_radius: records.Length
    name: records.Name = "arm"

    universal = staticmethod(_from_sizes(Universal))
    hinged = staticmethod(_from_sizes(Hinged))
    backbone = staticmethod(_from_sizes(Backbone))
    rolling = staticmethod(_from_sizes(Rolling))

    @model_validator(mode="after")
    def _check(self) -> Self:
        """Check all parts together; joints keep only radii that differ from the common one."""
        radii = self.hole_radii
        common = self.hole_radius if self.hole_radius in radii else radii[0]
        radii_of_joints = [None if common == R else R for R in radii]
        joints = [
            joint if joint.hole_radius == R else replace(joint, hole_radius=R)
            for joint, R in zip(self.joints, radii_of_joints, strict=True)
        ]
        self.__dict__.update(hole_radius=common, joints=tuple(joints))
        if faults := [*self._faults()] or self.chain.faults():
            raise CrossFaults(faults)
        for doubt in self._doubts():
            warn(f"{self.name}: {doubt}")
        return self

    def _faults(self) -> Iterator[str]:
        """Yield the faults that concern several parts, such as too short links."""
        joints = self.joints
        links = self.links
        n = len(self.joints)
        if len(links) != n:
            yield f"links: {len(links)} given for {n} joints; give one for each"
        offsets = [*(joint.disk_offset for joint in joints), 0.0]
        necks = [not joint.axes for joint in joints] + [True]  # which may share a disk
        slack = [1e-9 * (one and other) for one, other in itertools.pairwise(necks)]
        short = [
            f"link {k} is {link.length:g} m long, its disks need more than {needed:g} m"
            for k, link in enumerate(links, start=1)
            if link.length <= (needed := sum(offsets[k - 1 : k + 1])) * (1.0 - slack[k - 1])
        ]
        if short:
            remedy = "lower disk_offset, or lengthen the links"
            yield f"disk_offset: too large: {listed(short, 1, '; ')}; {remedy}"
        for c, cable in enumerate(self.cables, start=1):
            if cable.joint > n:
                problem = f"{cable.joint} is past the last joint, {n}; give 1 to {n}"
                yield f"cables[{c}].joint: {problem}"
        for k, (joint, link) in enumerate(zip(joints, links, strict=False), start=1):
            if joint.rolls and link.bending_stiffness is not None:
                yield f"links[{k}].bending_stiffness: a link that rolls on another cannot bend"
        for k, joint in enumerate(joints, start=1):
            leader = joints[joint.follows - 1] if joint.follows and joint.follows < k else None
            if joint.follows and (leader is None or leader.follows or not joint.axes):
                yield f"joints[{k}].follows: {joint.follows} is no free joint before it"
            elif leader and len(leader.axes) != len(joint.axes):
                yield f"joints[{k}].follows: joint {joint.follows} has another number of axes"
        small = [
            f"at joint {k} it is {joint.disk_radius:g} m, and the farthest hole is at {hole:g} m"
            for k, (joint, hole) in enumerate(zip(joints, self._farthest_holes, strict=True), 1)
            if joint.disk_radius is not None and joint.disk_radius <= hole
        ]
        if small:
            yield f"disk_radius: too small: {listed(small, 1, '; ')}; give more"

    def _doubts(self) -> Iterator[str]:
        """Yield texts of warnings: lengths look like mm, angles like degrees; holes are shared."""
        cables = self.cables
        names = self.cable_names
        offset = max(joint.disk_offset for joint in self.joints)
        sizes = [("hole_radius", max(self.hole_radii), WIDEST), ("disk_offset", offset, WIDEST)]
        yield from doubts_about_units(self.length, sizes)
        # the angles of hinges grow by the twist, up to half a turn, from one to the next
        most = math.pi * max(8, len(self.joints) + 4)
        widest = max((cable.angle for cable in cables), key=abs)
        yield from doubts_about_angle("a hole angle is", widest, most)
        rings = defaultdict[Any, list[str]](list)
        for i, group in enumerate(same_angle(cables)):
            for c in group:
                rings[i, cables[c].radius or self.hole_radius].append(names[c])
        if shared := [" and ".join(ring) for ring in rings.values() if len(ring) > 1]:
            remedy = "Cables in one hole rub: set them apart by spread=, phase= or hole_angles=."
            yield f"cables share holes: {listed(shared, 4, '; ')}. {remedy}"

    def __str__(self) -> str:
        joints = plural(len(self.joints), "joint")
        cables = plural(len(self.cables), "cable")
        freedom = plural(len(self.chain.axes), "degree")
        return f"{self.name}: {joints} ({freedom} of freedom), {cables}, {self.length:.4g} m long"

    def __repr__(self) -> str:
        return f"<Geometry {self}>"

    @classmethod
    def sections(
        cls, sections: Sequence[Geometry], *, spread: float = 0.0, name: str = "arm"
    ) -> Geometry:
        """Join arms end to end to one arm, each as a section.

        The base frame of each section is the tip of the section before, whose last link therefore
        becomes longer by its ``base_length``. Its cables run through all disks before it, at an
        unchanged angle, and at the hole radius of each disk or at their own (``cable_radius``).

        Args:
            sections: The sections, base to tip.
            spread: As for :meth:`universal`, among the cables of all sections [rad].
            name: Name of the robot.

        Raises:
            InvalidInput: ``sections`` is not a list or tuple of geometries.
            GeometryError: No section is given, or the arm is invalid, see :class:`Geometry`.
        """
        parts = validation.sequence_of("sections", sections, Geometry)
        if not parts:
            raise GeometryError(["sections: none given; give one or more"])
        first, *_ = parts
        joints = list[Joint]()
        links = list[Link]()
        cables = list[CableRoute]()
        for part in parts:
            begin = len(joints)
            if links:
                links[-1] = replace(links[-1], length=links[-1].length + part.base_length)
            cables += [replace(cable, joint=cable.joint + len(joints)) for cable in part.cables]
            joints += [
                replace(
                    joint,
                    hole_radius=None if first.hole_radius == R else R,
                    follows=joint.follows and joint.follows + begin,
                )
                for joint, R in zip(part.joints, part.hole_radii, strict=True)
            ]
            links += part.links
        spaced = spread_out(cables, validation.scalar("spread", spread))
        return replace(first, name=name, joints=tuple(joints), links=tuple(links), cables=spaced)

    def replace(self, **changes: Any) -> Geometry:
        """Return a checked copy with other attributes, e.g. ``replace(hole_radius=0.02)``.

        If ``hole_radius`` is given without ``joints``, all joints get it.
        """
        if "hole_radius" in changes and "joints" not in changes:
            changes["joints"] = tuple(replace(joint, hole_radius=None) for joint in self.joints)
        return replace(self, **changes)

    @property
    def length(self) -> float:
        """Length of the straight arm from the base frame to the tip [m]."""
        return self.base_length + sum(link.length for link in self.links)

    @property
    def hole_radii(self) -> tuple[float, ...]:
        """Hole radius R [m] for each joint; both disks of a joint have it."""
        return tuple(joint.hole_radius or self.hole_radius for joint in self.joints)

    @property
    def _farthest_holes(self) -> list[float]:
        """Distance [m] of the farthest hole from the axis, on the disks of each joint."""
        rings = [(cable.joint, cable.radius) for cable in self.cables if cable.radius is not None]
        return [max([R, *(r for j, r in rings if j > k)]) for k, R in enumerate(self.hole_radii)]

    @cached_property
    def chain(self) -> Chain:
        """Bodies, joints and disks, base to tip."""
        rows = zip(self.joints, self._farthest_holes, strict=True)
        radii = [joint.disk_radius or 1.1 * farthest for joint, farthest in rows]
        sizes = [*zip(self.hole_radii, radii, self.joint_limits, strict=True)]
        return chain_of(self.base_length, self.joints, self.links, sizes)

    @property
    def joint_limits(self) -> tuple[float, ...]:
        """Limit of each joint [rad]: the given one, or where disks touch, as in :class:`Joint`."""
        joints = zip(self.joints, self.hole_radii, strict=True)
        return tuple(joint.limit or joint.limit_of_disks(R) for joint, R in joints)

    @property
    def disks(self) -> tuple[Disk, ...]:
        """All disks, base to tip: two per joint, before and after it; necks may share one."""
        return tuple(self.chain.disks)

    def disks_of(self, route: CableRoute) -> tuple[Disk, ...]:
        """Return the disks that a cable passes; it ends on the last one, after its joint."""
        return tuple(disk for disk in self.disks if disk.joint <= route.joint)

    @property
    def cable_names(self) -> tuple[str, ...]:
        """Name of each cable: the i-th of joint k is ``cable{k}_{i}``."""
        number = defaultdict[int, Iterator[int]](lambda: count(1))
        return tuple(f"cable{c.joint}_{next(number[c.joint])}" for c in self.cables)

    @property
    def springs(self) -> dict[str, tuple[float, float] | SpringLaw]:
        """Stiffness [N m/rad] and angle without torque [rad], or law, of springs by joint name."""
        return {axis.name: axis.spring for axis in self.chain.axes if axis.stiffness}

    def to_toml(self) -> str:
        """Return the TOML text from which :meth:`read` builds an equal geometry."""
        head = """\
# cdsm geometry. Units: m, rad, kg.
# axes: in the axes of the link before; angle: of the hole about x, from y towards z;
# joint (of a cable): the joint it drives, from 1; it ends on the disk after it.
"""
        first = {name: getattr(self, name) for name in ("name", "base_length", "hole_radius")}
        return head + toml_text(first | self._table)

    @property
    def _table(self) -> dict[str, Any]:
        """All values that are not the usual ones, as parsed TOML."""
        for k, joint in enumerate(self.joints, start=1):
            if isinstance(joint.stiffness, SpringLaw):
                law_table(joint.stiffness, f"joint {k}")  # pydantic would hide its refusal
        table: dict[str, Any] = TypeAdapter(Geometry).dump_python(self, exclude_defaults=True)
        return table

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the text of :meth:`to_toml` to a file; return its path. FileError on failure."""
        return write_text(path, self.to_toml())

    @classmethod
    def from_toml(cls, text: str, source: str | None = None) -> Geometry:
        """Build a geometry from TOML text as :meth:`read` does; errors begin with ``source``.

        ``source`` is the file that the text is from.
        """
        from cdsm.geometry import toml

        try:
            data, rest = toml.split_geometry(read_toml(instance("text", text, str)))
            if "urdf" in rest and not data:
                raise GeometryError(["urdf: a robot has no geometry; use Manipulator.read"])
            described = data or rest
            stem = "" if source is None else as_path(source).stem
            return toml.build(toml.called(described, stem))
        except GeometryError as error:
            raise GeometryError(error.faults, source) from None

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Geometry:
        """Read a geometry from a TOML file.

        The file has the full form that :meth:`write` writes, or one table ``[universal]``,
        ``[hinged]`` or ``[backbone]`` of keywords of these methods. An arm of sections has such a
        table in each ``[[sections]]``, and at the top ``name`` and ``spread`` of :meth:`sections`.
        A table without ``name`` has that of the file: ``SNAKE.toml`` describes ``SNAKE``.
        From an ARM.toml (see :meth:`cdsm.Manipulator.read`), only the geometry is read. Raises
        FileError, or GeometryError, which lists every fault.
        """
        return cls.from_toml(read_text(path), source=os.fspath(path))
