"""Route the cables of a serpentine arm through the holes of its disks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

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

    A cable of joint k passes all disks before it, and ends on the first disk after it. Its hole in
    a disk is at (x, R cos φ, R sin φ) in the frame of the link: x is the position of the disk, φ
    the angle of the :class:`~cdsm.CableRoute`, R the radius of the route, or the hole radius of the
    disk. The i-th cable of joint k has the name ``cable{k}_{i}``.

    Args:
        geometry: The arm.
        elasticity: One law for all cables, or one law per cable in the geometry's order.
        series_stiffness: k_series of all cables [N/m], as in :class:`Cable`.
        control: Motor control of all cables, as in :class:`Cable`.

    Raises:
        InvalidInput: ``elasticity`` is not a law, or not one for each cable.
    """
    names, n = instance("geometry", geometry, Geometry).cable_names, len(geometry.cables)
    laws: Sequence[Elasticity]
    laws = elasticity if isinstance(elasticity, (list, tuple)) else [checked_law(elasticity)] * n
    if len(laws) != n:
        raise InvalidInput("elasticity", f"{len(laws)} laws given; give 1, or 1 for each of {n}.")
    new = partial(Cable, series_stiffness=series_stiffness, control=control)
    cables = []
    for name, route, law in zip(names, geometry.cables, laws, strict=True):
        mu, passed = route.friction, geometry.disks_of(route)
        friction = [mu if route.lead else 0.0, *[mu] * (len(passed) - 2), 0.0]
        holes = zip(passed, friction, strict=True)
        sites = tuple(Site(disk.link, disk.hole(route), mu) for disk, mu in holes)
        cables.append(new(name=name, sites=sites, elasticity=law, lead=route.lead))
    return tuple(cables)


def require_own_cables(geometry: Geometry, cables: Sequence[Cable]) -> None:
    """Refuse the ``cables`` of an arm that are not routed and led as its ``geometry`` says.

    What is built from values of the geometry would replace them. Raises InvalidInput.
    """
    routed = serpentine_cables(geometry, cables[0].elasticity)
    own, given = {cable.name: _path(cable) for cable in routed}, {c.name: _path(c) for c in cables}
    if list(own.items()) != list(given.items()):
        other = listed([name for name in own | given if own.get(name) != given.get(name)])
        raise InvalidInput(
            "arm",
            f"the lead or the holes of {other} are not those of its geometry, which alone is "
            "varied. Describe springs and wires in [cables.NAME] of the ARM.toml.",
        )


def _path(cable: Cable) -> tuple[float, list[tuple[str, tuple[float, ...]]]]:
    return cable.lead, [(site.link, tuple(site.position)) for site in cable.sites]
