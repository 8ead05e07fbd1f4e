"""Tubes and rods: their stiffness, and arms whose disks sit on one (backbones)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Self, cast

from pydantic import Field, PlainValidator, model_validator

from cdsm.geometry.parts import MAXIMUM_JOINTS, CableRoute, Joint, JointLimit, Link, Pieces
from cdsm.support import records


@records.record
class Beam:
    """Stiffness of a beam: EI, or the diameters and Young's modulus of a tube or rod."""

    bending_stiffness: records.Bending | None = None
    torsion_stiffness: records.Torsion | None = None
    outer_diameter: records.Length | None = None
    inner_diameter: records.LengthOrZero = 0.0
    youngs_modulus: Annotated[records.Number, Field(ge=1e3, le=1e13)] | None = None
    poisson: Annotated[records.Number, Field(ge=0.0, le=0.5)] = 0.3
    pieces: Pieces = 1

    def faults_of_beam(self) -> list[str]:
        """Return what is wrong with the stiffness or the diameters, a sentence each."""
        tube = self.outer_diameter, self.youngs_modulus
        if self.bending_stiffness is None and tube.count(None) == 1:
            return ["youngs_modulus: give it with outer_diameter, both or none of them"]
        if self.bending_stiffness is not None and tube.count(None) < 2:
            return ["bending_stiffness: give it, or outer_diameter and youngs_modulus, not both"]
        if self.outer_diameter is not None and self.inner_diameter >= self.outer_diameter:
            problem = f"{self.inner_diameter:g} m given, not below outer_diameter"
            return [f"inner_diameter: {problem}, {self.outer_diameter:g} m"]
        is_tube = self.outer_diameter is not None
        if self.inner_diameter and not is_tube:
            return ["inner_diameter: belongs to outer_diameter and youngs_modulus, give them"]
        if is_tube or self.bending_stiffness is not None:
            return []
        bends = "bending_stiffness, or outer_diameter and youngs_modulus"
        return [
            f"{key}: belongs to links that bend; give {bends}"
            for key, usual in (("torsion_stiffness", None), ("poisson", 0.3), ("pieces", 1))
            if getattr(self, key) != usual
        ]

    def stiffness(self) -> dict[str, Any]:
        """Return EI = E π (D⁴ − d⁴)/64, GJ = EI/(1 + ν) and the pieces; empty if it is rigid."""
        EI = self.bending_stiffness
        if self.outer_diameter is not None and self.youngs_modulus is not None:
            fourth = self.outer_diameter**4 - self.inner_diameter**4
            EI = self.youngs_modulus * math.pi * fourth / 64.0
        if EI is None:
            return {}
        GJ = EI / (1.0 + self.poisson) if self.torsion_stiffness is None else self.torsion_stiffness
        return {"bending_stiffness": EI, "torsion_stiffness": GJ, "pieces": self.pieces}


def buckling_doubt(joints: Sequence[Joint]) -> str:
    """Return a sentence if a backbone or neck has one piece from disk to disk; else nothing."""
    if all(joint.axes or joint.pieces > 1 for joint in joints):
        return ""
    doubt = (
        "the backbone has one piece from disk to disk: it buckles by its own cables at 12 EI/d² "
    )
    return doubt + "in place of π² EI/d², 21.6 % too late. Build it with pieces=4: 1.7 % too early."


@records.record
class Section:
    """A section of a backbone: its disks, and the cables that end at the last of them.

    Attributes:
        length: Length of the section [m].
        disks: Number of its disks, evenly spaced, the last one at its end.
        hole_angles: φ of its cables [rad], from y towards z.
        hole_radius: Distance of the holes from the backbone [m].
        lead: Straight cable between each actuator and the base disk [m].
        friction: Friction coefficient μ in the holes [-].
        disk_mass: Mass of each disk [kg].
        disk_radius: Outer radius of the disks [m]; None: 1.1 times that of the farthest hole.
    """

    length: records.Length
    disks: Annotated[records.Integer, Field(ge=1, le=MAXIMUM_JOINTS)]
    hole_angles: records.HoleAngles
    hole_radius: records.Length
    lead: records.LengthOrZero = 0.0
    friction: records.FrictionCoefficient = 0.0
    disk_mass: records.Mass = 0.0
    disk_radius: records.Length | None = None


def _section(section: object) -> Section:
    if isinstance(section, dict):
        return Section(**section)
    if not isinstance(section, Section):
        raise ValueError(f"{section!r:.60} given; a table is needed")
    return section


@records.record
class Backbone(Beam):
    """Build an arm whose disks sit on a flexible backbone along x; a base disk is at its start.

    Between two disks the backbone is a beam of ``pieces``, each with universal joints at 1/6 and
    5/6 and a joint about its axis in the middle. A cable of a section passes the base disk and
    all disks up to the last one of its section. Shear and stretch of the backbone are left out.
    ``critical_tension`` reads 21.6 % too much with one piece, and 1.7 % too little with four.

    Args:
        sections: Tables or records :class:`Section`, base to tip.
        bending_stiffness: EI [N m²]; or give the diameters.
        torsion_stiffness: GJ [N m²]; None: EI/(1 + ν); inf: it does not twist.
        outer_diameter: Outer diameter [m] of a tube or rod.
        inner_diameter: Inner diameter [m]; 0: a rod.
        youngs_modulus: E [Pa].
        poisson: ν, Poisson's ratio [-].
        pieces: Number of pieces from disk to disk.
        mass_per_length: Mass of the backbone per length [kg/m].
        joint_limit: Largest bend from disk to disk about each axis [rad]; None: where disks touch.
        name: Name of the robot.
    """

    sections: Annotated[
        Sequence[Annotated[Section | dict[str, Any], PlainValidator(_section)]],
        Field(min_length=1),
    ]
    mass_per_length: records.Mass = 0.0
    joint_limit: JointLimit | None = None
    name: records.Name = "arm"

    @model_validator(mode="after")
    def _check(self) -> Self:
        faults = self.faults_of_beam()
        if not faults and not self.stiffness():
            faults = ["bending_stiffness: give it, or outer_diameter and youngs_modulus"]
        if faults:
            raise records.CrossFaults(faults)
        return self

    def parts(self) -> dict[str, Any]:
        """Return the fields of the :class:`~cdsm.Geometry` by name."""
        sections = cast("Sequence[Section]", self.sections)  # see _section
        common = sections[0].hole_radius
        joints = list[Joint]()
        links = list[Link]()
        cables = list[CableRoute]()
        for section in sections:
            gap = section.length / section.disks
            radius = None if section.hole_radius == common else section.hole_radius
            for _ in range(section.disks):
                if links:  # from the middle of the gap before to the middle of this one
                    links[-1] = Link(length=links[-1].length + gap / 2.0, mass=links[-1].mass)
                joints += [
                    Joint(
                        disk_offset=gap / 2.0,
                        limit=self.joint_limit,
                        hole_radius=radius,
                        disk_radius=section.disk_radius,
                        mass=self.mass_per_length * gap,
                        **self.stiffness(),
                    )
                ]
                links += [Link(length=gap / 2.0, mass=section.disk_mass)]
            kept: dict[str, Any] = {"joint": len(joints), "friction": section.friction}
            cables += [CableRoute(angle=x, lead=section.lead, **kept) for x in section.hole_angles]
        whole = {"name": self.name, "base_length": joints[0].disk_offset, "hole_radius": common}
        return whole | {"joints": joints, "links": links, "cables": cables}
