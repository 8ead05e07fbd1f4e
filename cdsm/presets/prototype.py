"""The virtual prototype of the paper, its strand and its wire.

Values that the paper does not give are assumed. They are parameters: change them to see their
effect.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.geometry import Geometry
from cdsm.manipulator import Manipulator
from cdsm.wires.catalogue import SOLID, STRAND
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import LinearElasticity

STRAND_1X19: Final = STRAND
"""The paper's 1×19 steel strand of 1.2 mm (Section IV-C): Eq. 19, repaired and continuous."""

STRAND_DIAMETER: Final = 1.2e-3
"""Diameter of the 1×19 strand [m]."""

STEEL_WIRE_200GPA: Final = SOLID
"""Solid wire of the strand's diameter with the paper's 200 GPa (Section IV-B): EA = 226 kN."""

ELASTIC_STAGE: Final = LinearElasticity(48e3)
"""Law with the constant EA of the strand in its elastic stage: assumed, from Eq. 19 at 600 N."""

TEN_DEGREES: Final = np.deg2rad(10.0)
"""Angle of every joint of the virtual prototype in Sections IV-A, B and D of the paper [rad]."""


def virtual_prototype_geometry(
    link_mass: float = 0.5, lead: float = 0.0, friction: float = 0.0
) -> Geometry:
    """Build the geometry of Section IV: five universal joints, R = 30 mm, disks every 20 mm.

    The paper gives no more. Three cables per joint, which end on the first disk after the joint,
    are assumed, as are the mass of every link [kg], the ``lead`` [m] before the base disk, and
    the friction coefficient in all holes; the paper has none. Each axis turns until its disks touch
    while the other one is at zero; with both at this limit, disks overlap.

    Example:
        >>> import cdsm
        >>> cdsm.presets.virtual_prototype_geometry().hole_radius
        0.03
    """
    disk_offset = 0.01
    hole_radius = 0.03
    return Geometry.universal(
        name="virtual_prototype",
        joints=5,
        cables_per_joint=3,
        link_length=0.04,
        base_length=0.02,
        disk_offset=disk_offset,
        hole_radius=hole_radius,
        joint_limit=2.0 * math.atan(disk_offset / hole_radius),
        link_mass=link_mass,
        lead=lead,
        friction=friction,
    )


def virtual_prototype(
    elasticity: Elasticity = STRAND_1X19,
    *,
    gravity: ArrayLike = (0.0, -9.81, 0.0),
    **dimensions: float,
) -> Manipulator:
    """Build the paper's virtual prototype (Section IV).

    Args:
        elasticity: Elasticity of all cables. Default: Eq. 19 with the missing digits filled in, see
            :meth:`StrandElasticity.eq19_repaired <cdsm.StrandElasticity.eq19_repaired>`.
        gravity: Gravity in base axes (3,) [m/s²]; the direction −y is assumed.
        dimensions: Keywords of :func:`virtual_prototype_geometry`.

    Example:
        >>> import cdsm
        >>> cdsm.presets.virtual_prototype(lead=0.3)
        <Manipulator virtual_prototype: 5 joints (10 degrees of freedom), 15 cables, 0.22 m long>
    """
    geometry = virtual_prototype_geometry(**dimensions)
    return Manipulator(geometry, elasticity, gravity=gravity)
