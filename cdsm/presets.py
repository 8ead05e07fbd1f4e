"""The arms and the strand of the paper, with what it leaves open filled in by name.

Assumptions are parameters: change them and see what follows.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.arm_model import OriginalLength
from cdsm.cable import serpentine_cables
from cdsm.elasticity import Elasticity, LinearElasticity
from cdsm.geometry import Geometry, Link
from cdsm.manipulator import Manipulator
from cdsm.wires.laws import StrandElasticity

STRAND_1X19: Final = StrandElasticity.eq19_repaired()
"""The 1×19 steel strand of 1.2 mm of Section IV-C: Eq. 19, repaired and continuous."""

STRAND_DIAMETER: Final = 1.2e-3
"""Its diameter [m]."""

STEEL_WIRE_200GPA: Final = LinearElasticity.of_wire(200e9, STRAND_DIAMETER)
"""A solid wire of its diameter with the 200 GPa of Section IV-B: EA = 226 kN."""

ELASTIC_STAGE: Final = LinearElasticity(48e3)
"""Constant EA [N] of the strand in its elastic stage; assumed, from Eq. 19 at 600 N."""

TEN_DEGREES: Final = np.deg2rad(10.0)
"""All joint angles of the virtual prototype in Sections IV-A, B and D [rad]."""


def virtual_prototype_geometry(link_mass: float = 0.5, lead: float = 0.0) -> Geometry:
    """Geometry of Section IV: five universal joints, R = 30 mm, disks every 20 mm.

    The paper gives the joints, the hole radius and the disk spacing. Assumed: three cables per
    joint, ending as in :class:`~cdsm.CableRoute`; no lead; 0.5 kg per link.

    Args:
        link_mass: Mass of every link [kg].
        lead: Of every cable, before the base disk [m].
    """
    return Geometry.universal(
        name="virtual_prototype",
        joints=5,
        cables_per_joint=3,
        link_length=0.04,
        base_length=0.02,
        disk_offset=0.01,
        hole_radius=0.03,
        link_mass=link_mass,
        lead=lead,
    )


def virtual_prototype(
    elasticity: Elasticity = STRAND_1X19,
    *,
    link_mass: float = 0.5,
    lead: float = 0.0,
    gravity: ArrayLike = (0.0, -9.81, 0.0),
    original_length: OriginalLength = "unstrained",
) -> Manipulator:
    """The virtual prototype of Section IV.

    Args:
        elasticity: Of all cables; the repaired Eq. 19 by default.
        link_mass: Mass of every link [kg]; assumed.
        lead: Of every cable, before the base disk [m]; assumed.
        gravity: In base axes (3,) [m/s²]; along −y by assumption.
        original_length: As for :class:`~cdsm.Manipulator`; ``"stretched"`` is what the
            paper computes with.
    """
    geometry = virtual_prototype_geometry(link_mass, lead)
    return Manipulator(geometry, elasticity, gravity=gravity, original_length=original_length)


def experimental_prototype_geometry(
    *,
    link_length: float = 0.1,
    tool_length: float | None = None,
    base_length: float = 0.05,
    disk_offset: float = 0.02,
    hole_radius: float = 0.03,
    link_mass: float = 0.3,
    lead: float = 0.3,
) -> Geometry:
    """Geometry of Section V: three hinges of ±30°, turned 30° each, one antagonistic pair each.

    The paper gives the joints, their limits, the twist and the pairs. All dimensions are assumed:
    it prints none.

    Args:
        link_length: [m]; assumed.
        tool_length: From the last joint to where the weights hang [m]; None: ``link_length``.
        base_length: [m]; assumed.
        disk_offset: [m]; assumed.
        hole_radius: [m]; assumed.
        link_mass: [kg]; assumed.
        lead: [m]; assumed.

    Raises:
        GeometryError: Lists every fault.
    """
    geometry = Geometry.hinged(
        name="experimental_prototype",
        joints=3,
        twist=np.deg2rad(30.0),
        cables_per_joint=2,
        joint_limit=np.deg2rad(30.0),
        link_length=link_length,
        base_length=base_length,
        disk_offset=disk_offset,
        hole_radius=hole_radius,
        link_mass=link_mass,
        lead=lead,
    )
    if tool_length is None:
        return geometry
    last = Link(length=tool_length, mass=link_mass)
    return replace(geometry, links=(*geometry.links[:-1], last))


def experimental_prototype(
    elasticity: Elasticity = STRAND_1X19,
    *,
    series_stiffness: float = math.inf,
    gravity: ArrayLike = (0.0, 0.0, -9.81),
    **dimensions: float,
) -> Manipulator:
    """The prototype of Section V-A: of each pair one cable is position-controlled, one force-.

    The first of each pair (``cable1_1`` …) holds its length, the second (``cable1_2`` …) its
    tension, so that the second contributes no passive stiffness; give its tension to
    :func:`~cdsm.distribute_tension` as ``fixed``.

    Args:
        elasticity: Of all cables; the repaired Eq. 19 by default.
        series_stiffness: Of the springs of the hybrid cables (Fig. 11), or of the drives [N/m].
        gravity: In base axes (3,) [m/s²]; along −z by assumption.
        dimensions: Keywords of :func:`experimental_prototype_geometry`; all assumed there.

    Raises:
        GeometryError: Lists every fault of the dimensions.
    """
    geometry = experimental_prototype_geometry(**dimensions)
    cables = serpentine_cables(geometry, elasticity, series_stiffness=series_stiffness)
    pairs = [
        replace(cable, control="position" if cable.name.endswith("_1") else "force")
        for cable in cables
    ]
    return Manipulator(geometry, cables=pairs, gravity=gravity)
