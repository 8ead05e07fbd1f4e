"""Arms on flexible backbones: three that were measured, and one that other programs compute.

Each says where its numbers are from, what is assumed, and what was measured.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.cable import serpentine_cables
from cdsm.geometry import CableRoute, Geometry, Joint, Link
from cdsm.manipulator import Manipulator
from cdsm.support.validation import scalar
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import LinearElasticity

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


def rod_one_tendon(
    youngs_modulus: float = 84.1e9,
    friction: float = 0.0,
    elasticity: Elasticity = LinearElasticity(1e5),  # noqa: B008  # frozen
    *,
    gravity: ArrayLike = (9.81, 0.0, 0.0),
) -> Manipulator:
    """Build a measured rod that hangs down and is bent by one tendon.

    A rod of 1 mm with ten disks at 27 mm and 2 g for each gap; the tendon is 8 mm from it, and ends
    at the last disk. Its motor holds the tension. Source: LeibTon/gtsam-force-estimation on GitHub,
    commit 22164a0, whose licence is not stated. **Measured** there: nine tensions at the motor,
    from 0 to 5.25 N, and the centres of all disks, up to 250 mm from where they hang. **Fitted**
    there: E = 84.1 GPa without friction, the default; or 71.7 GPa with a friction of 0.2256. The
    nominal E is 50 GPa. Assumed: ν = 0.3, a tendon that hardly stretches, and a lead of 50 mm, so
    that it rubs in the base, too. What cdsm predicts stands on the page on validation.

    Args:
        youngs_modulus: E of the rod [Pa].
        friction: μ in all holes [-].
        elasticity: Law of the tendon.
        gravity: Gravity in base axes (3,) [m/s²].

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.rod_one_tendon(82e9, friction=0.08)
        >>> rest = cdsm.forward_statics(arm, tension=[5.2522])
        >>> (1e3 * rest.pose.tip[:3, 3]).round(1).tolist()
        [102.1, 188.4, 0.0]
    """
    section = {"length": 0.27, "disks": 10, "hole_radius": 0.008, "hole_angles": [0.0]}
    geometry = Geometry.backbone(
        name="rod_one_tendon",
        sections=[section | {"friction": friction, "lead": 0.05}],
        outer_diameter=1e-3,
        youngs_modulus=youngs_modulus,
        mass_per_length=0.002 / 0.027,
        joint_limit=1.2,
    )
    cables = serpentine_cables(geometry, elasticity, control="force")
    return Manipulator(geometry, cables=cables, gravity=gravity)


_CONE: Final = 0.305, 0.36  # where the cone gets less steep, and where it ends [m]
_RADII: Final = 0.01541, 0.00642, 0.0048  # at its base, there, and at its end [m]
_GAPS: Final = 20, 3


def silicone_tentacle(
    youngs_modulus: float = 505e3,
    friction: float = 0.0,
    density: float = 1500.0,
    *,
    elasticity: Elasticity = LinearElasticity(1e4),  # noqa: B008  # frozen
    gravity: ArrayLike = (9.81, 0.0, 0.0),
) -> Manipulator:
    """Build a measured tentacle: a cone of silicone that hangs down, with two tendons.

    Its radius falls from 15.41 to 6.42 mm over 305 mm, and to 4.80 mm over the last 55 mm. Tendons
    at 30° and 150° run at 11.4 mm − 0.0295 s from its axis at the distance s from the base, and end
    at s = 305 mm. Motors hold their tensions. Source: tud-phi/soromox on GitHub (MIT), commit
    4f03054, ``paper_results/secVa_system_identification``. **Measured** there: four markers under
    3.08 to 7.69 N in one tendon, eight shapes in all. **Not measured**: E, the density and
    ν = 0.45. The defaults are where the authors began; their fit is 315.1 kPa and 1317.7 kg/m³,
    without friction. x is their −z, y their y, z their x. What cdsm predicts stands on the page on
    validation.

    Assumed: 20 gaps in place of a tendon that is guided all along, each a beam of constant
    stiffness with the mean of 1/EI, and a lead of 50 mm. Shear and compression of the silicone are
    left out: the authors' model has compression, of a few per cent of the length under 7.7 N.

    Args:
        youngs_modulus: E [Pa].
        friction: μ of the tendons in the silicone [-].
        density: Density [kg/m³].
        elasticity: Law of the tendons.
        gravity: Gravity in base axes (3,) [m/s²].

    Example:
        >>> import cdsm
        >>> arm = cdsm.presets.silicone_tentacle()
        >>> rest = cdsm.forward_statics(arm, tension=[3.0769, 0.0])
        >>> (1e3 * rest.pose.tip[:3, 3]).round(1).tolist()
        [334.9, 82.7, 47.7]
    """
    density = scalar("density", density)
    youngs_modulus = scalar("youngs_modulus", youngs_modulus)
    turn, end = _CONE
    to_turn = np.linspace(0.0, turn, _GAPS[0] + 1)
    places = np.concatenate([to_turn, np.linspace(turn, end, _GAPS[1] + 1)[1:]]).tolist()
    joints = list[Joint]()
    links = list[Link]()
    for start, stop in pairwise(places):
        gap = stop - start
        radii = np.interp(np.linspace(start, stop, 21), (0.0, *_CONE), _RADII)
        EI = youngs_modulus * math.pi / 4.0 / float(np.mean(radii**-4.0))
        if links:  # from the middle of the gap before to the middle of this one
            links[-1] = Link(length=links[-1].length + gap / 2.0, mass=0.0)
        links.append(Link(length=gap / 2.0, mass=0.0))
        joints.append(
            Joint(
                disk_offset=gap / 2.0,
                limit=1.2,
                hole_radius=0.0114 - 0.0295 * min(stop, turn),
                disk_radius=float(radii[-1]),
                bending_stiffness=EI,
                torsion_stiffness=EI / (1.0 + 0.45),
                mass=density * math.pi * float(np.mean(radii**2)) * gap,
            )
        )
    routes = [
        CableRoute(joint=_GAPS[0], angle=math.radians(phi), lead=0.05, friction=friction)
        for phi in (30.0, 150.0)
    ]
    geometry = Geometry(
        name="silicone_tentacle",
        base_length=joints[0].disk_offset,
        hole_radius=0.0114,
        joints=tuple(joints),
        links=tuple(links),
        cables=tuple(routes),
    )
    cables = serpentine_cables(geometry, elasticity, control="force")
    return Manipulator(geometry, cables=cables, gravity=gravity)
