"""Route the cables of a serpentine arm through the holes of its disks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from cdsm.cable import Cable, Control, Site
from cdsm.errors import InvalidInput, listed
from cdsm.geometry import Geometry
from cdsm.support.validation import instance
from cdsm.wires.elasticity import Elasticity, checked_law


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


def require_own_cables(geometry: Geometry, cables: Sequence[Cable]) -> None:
    """Refuse the ``cables`` of an arm that are not routed and led as its ``geometry`` says.

    What is built from values of the geometry would replace them. Raises InvalidInput.
    """
    if tuple(cable.name for cable in cables) != geometry.cable_names:
        raise InvalidInput(
            "arm",
            "has other cables than those of its geometry, which alone is varied. "
            "Describe springs and wires in [cables.NAME] of the ARM.toml.",
        )
    routed = serpentine_cables(geometry, [cable.elasticity for cable in cables])
    if moved := [
        own.name
        for own, cable in zip(cables, routed, strict=True)
        if (own.lead, *_positions(own)) != (cable.lead, *_positions(cable))
    ]:
        raise InvalidInput(
            "arm",
            f"the lead or the holes of {listed(moved)} are not those of its geometry, which "
            "alone is varied. Give them in the geometry.",
        )


def _positions(cable: Cable) -> list[tuple[str, tuple[float, ...]]]:
    return [(site.link, tuple(site.position)) for site in cable.sites]
