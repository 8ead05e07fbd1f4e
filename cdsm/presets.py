"""The arms and the strand of the paper, and arms that bend from other sources.

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

# fmt: off
__all__ = [
    "ELASTIC_STAGE", "STEEL_WIRE_200GPA", "STRAND_1X19", "STRAND_DIAMETER", "TEN_DEGREES",
    "nitinol_segment", "tdcr_two_sections", "virtual_prototype", "virtual_prototype_geometry",
]
# fmt: on


def __dir__() -> list[str]:
    return __all__


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


_NO_GRAVITY = (0.0, 0.0, 0.0)
_THREE_HOLES = np.deg2rad([90.0, -30.0, 210.0]).tolist()


def tdcr_two_sections(
    elasticity: Elasticity = LinearElasticity(2e4),  # noqa: B008  # frozen
    *,
    gravity: ArrayLike = _NO_GRAVITY,
) -> Manipulator:
    """Build a rod with two sections of three tendons each, on which models of rods are compared.

    Sections of 0.2 m with 10 disks each, a rod of 1.4 mm with E = 54 GPa and ν = 0.3, holes at 10
    mm and 90°, −30°, 210°. The cables of section 1 come first. Source: tests of tdcr-pinn (M.
    Martin-Bensch, snapshot 3d5e7ba), which compute tips from tensions by models of Lilge and Rao. x
    is their z, y their x, z their y. Tendons have no EA there, and nothing has a mass: the
    ``elasticity`` of the cables is assumed.

    Example:
        >>> import cdsm
        >>> cdsm.presets.tdcr_two_sections().nv
        100
    """
    section = {"length": 0.2, "disks": 10, "hole_angles": _THREE_HOLES, "hole_radius": 0.01}
    geometry = Geometry.backbone(
        name="tdcr_two_sections",
        sections=[section, section],
        outer_diameter=1.4e-3,
        youngs_modulus=54e9,
    )
    return Manipulator(geometry, elasticity, gravity=gravity)


def nitinol_segment(
    elasticity: Elasticity = LinearElasticity(1e6),  # noqa: B008  # frozen
    *,
    gravity: ArrayLike = _NO_GRAVITY,
) -> Manipulator:
    """Build a measured segment: a Nitinol tube of 0.25 m with three tendons.

    Outer diameter 1.22 mm, inner diameter 0.954 mm, E = 83 GPa, 11 disks with that of the base,
    holes at 6 mm. Source: github.com/mohamad-nouredeen/tdcr-cosserat-robot-platform, snapshot
    e43787a. With one tendon pulled by 5 mm, the tip was read at heights x of 233, 235 and 233 mm;
    with 10 mm, at 171, 168 and 169 mm. Assumed: tendons that do not stretch, hole angles of 90°,
    −30° and 210°, a density of 6450 kg/m³, ν = 0.3, and disks without mass.

    Example:
        >>> import cdsm
        >>> rest = cdsm.forward_statics(cdsm.presets.nitinol_segment(), pull={"cable10_1": 0.01})
        >>> f"{1e3 * rest.pose.tip[0, 3]:.0f} mm"  # 168 to 171 measured
        '154 mm'
    """
    outer = 1.22e-3
    inner = 0.954e-3
    section = {"length": 0.25, "disks": 10, "hole_angles": _THREE_HOLES, "hole_radius": 6e-3}
    geometry = Geometry.backbone(
        name="nitinol_segment",
        sections=[section],
        outer_diameter=outer,
        inner_diameter=inner,
        youngs_modulus=83e9,
        mass_per_length=6450.0 * math.pi / 4.0 * (outer**2 - inner**2),
    )
    return Manipulator(geometry, elasticity, gravity=gravity)
