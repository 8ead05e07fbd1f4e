"""The arms and the strand of the paper, with what it leaves open filled in by name.

Assumptions are parameters: change them and see what follows.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.elasticity import Elasticity, LinearElasticity
from cdsm.geometry import Geometry
from cdsm.manipulator import Manipulator
from cdsm.wire import StrandElasticity

STRAND_1X19: Final = StrandElasticity.eq19_repaired()
"""The 1×19 steel strand of 1.2 mm of Section IV-C: Eq. 19, repaired."""

STRAND_DIAMETER: Final = 1.2e-3
"""Its diameter [m]."""

STEEL_WIRE_200GPA: Final = LinearElasticity.of_wire(200e9, STRAND_DIAMETER)
"""A solid wire of its diameter with the 200 GPa of Section IV-B: EA = 226 kN."""

ELASTIC_STAGE: Final = LinearElasticity(48e3)
"""Constant EA [N] of the strand in its elastic stage; assumed, from Eq. 19 at 600 N."""

TEN_DEGREES: Final = np.deg2rad(10.0)
"""All joint angles of the virtual prototype in Sections IV-A, B and D [rad]."""


def virtual_prototype_geometry(link_mass: float = 0.5) -> Geometry:
    """Geometry of Section IV: five universal joints, R = 30 mm, disks every 20 mm.

    The paper gives the joints, the hole radius and the disk spacing. Assumed: three cables per
    joint, ending as in :class:`~cdsm.geometry.CableRoute`; no lead; 0.5 kg per link.

    Args:
        link_mass: Mass of every link [kg].
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
        lead=0.0,
    )


def virtual_prototype(
    elasticity: Elasticity = STRAND_1X19,
    *,
    link_mass: float = 0.5,
    gravity: ArrayLike = (0.0, -9.81, 0.0),
) -> Manipulator:
    """The virtual prototype of Section IV.

    Args:
        elasticity: Of all cables; the repaired Eq. 19 by default.
        link_mass: Mass of every link [kg]; assumed.
        gravity: In base axes (3,) [m/s²]; along −y by assumption.
    """
    return Manipulator(virtual_prototype_geometry(link_mass), elasticity, gravity=gravity)
