"""Route the cables of a serpentine arm through the holes of its disks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from cdsm.cable import Cable, Control, Site
from cdsm.elasticity import Elasticity
from cdsm.elasticity.law import checked_law
from cdsm.errors import InvalidInput
from cdsm.geometry import Geometry
from cdsm.support.validation import instance


def serpentine_cables(
    geometry: Geometry,
    elasticity: Elasticity | Sequence[Elasticity],
    *,
    series_stiffness: float = math.inf,
    control: Control = "position",
) -> tuple[Cable, ...]:
    """Return the cables of a serpentine arm, routed through the holes of its disks.

    A cable of joint k passes the base disk and every disk of links 1…k−1. It ends on the first disk
    of link k. Its hole in a disk is at (x, R cos φ, R sin φ) in the frame of the link: x is the
    position of the disk, φ the angle of the :class:`~cdsm.CableRoute`, R the radius of the route,
    or the hole radius of the disk. The i-th cable of joint k has the name ``cable{k}_{i}``.

    Args:
        geometry: The arm.
        elasticity: One law for all cables, or one law per cable in the geometry's order.
        series_stiffness: k_series of all cables [N/m], as in :class:`Cable`.
        control: Motor control of all cables, as in :class:`Cable`.

    Raises:
        InvalidInput: ``elasticity`` is not a law, or the numbers of laws and of cables differ.
        CableError: A cable is invalid.
    """
    count = len(instance("geometry", geometry, Geometry).cables)
    if isinstance(elasticity, (list, tuple)):
        elasticities = tuple(elasticity)
    else:
        elasticities = (checked_law(elasticity),) * count
    if len(elasticities) != count:
        raise InvalidInput(
            "elasticity",
            f"{len(elasticities)} laws given; give one, or one for each of {count} cables.",
        )
    cables, disks = [], geometry.disks
    for name, route, material in zip(
        geometry.cable_names, geometry.cables, elasticities, strict=True
    ):
        *passed, end = disks[: 2 * route.joint]
        sites = [Site(disk.link, disk.hole(route), route.friction) for disk in passed]
        if route.lead == 0.0:
            sites[0] = replace(sites[0], friction=0.0)
        cables.append(
            Cable(
                name=name,
                sites=(*sites, Site(end.link, end.hole(route))),
                elasticity=material,
                lead=route.lead,
                series_stiffness=series_stiffness,
                control=control,
            )
        )
    return tuple(cables)
