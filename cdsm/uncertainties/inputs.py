"""Inputs of an arm: the numbers that can have a tolerance, and how each one changes the arm.

Site positions, joint origins, centres of mass and the tip depend linearly on hole radii, disk
offsets and link lengths. One sparse matrix therefore serves two purposes: it turns drawn errors of
the inputs into displacements of these points, and its transpose turns derivatives with respect to
the points into derivatives with respect to the inputs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from scipy.sparse import csr_matrix, hstack

from cdsm._former.arm_arrays import kernel_arrays
from cdsm._former.sensitivity import single_gradient
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.values import Array, frozen
from cdsm.tolerances import Tolerances
from cdsm.urdf import CROSS_MASS

_NEAR = 1e-9  # a site this near to a disk [m] is on the disk

_LENGTHS = ("lead", "hole_radius", "disk_offset", "link_length", "site")

_LARGEST = 0.1  # largest standard uncertainty of a length, divided by the length of the arm

_ON_DISKS = ("hole_radius", "hole_angle", "disk_offset", "link_length")
"""Sources that exist only for an arm with disks."""


class Places(NamedTuple):
    """All points that define an arm [m], each in the frame of the joint that moves it.

    The origin of a joint is in the frame of its parent joint.
    """

    site: Array  # cable sites (…, P, 3)
    origin: Array  # origin of each joint in its parent (…, nv+1, 3)
    centre: Array  # centres of mass (…, nv+1, 3)
    tip: Array  # (…, 3)

    def stacked(self) -> Array:
        """Return all coordinates of one arm as a vector (n,), in the order of the fields."""
        return np.concatenate([place.ravel() for place in self])

    def moved(self, by: Array) -> Places:
        """Return the points of N arms, displaced ``by`` (N, n) [m]; each array gets a first axis N.

        The n coordinates are in the order of :meth:`stacked`.
        """
        ends = np.cumsum([place.size for place in self])[:-1]
        parts = np.split(by, ends, axis=1)
        return Places(
            *(x + part.reshape(-1, *x.shape) for x, part in zip(self, parts, strict=True))
        )


def rotations(pose: Posture) -> Array:
    """Return the rotation matrices of all joint frames in base axes (nv+1, 3, 3).

    Row 0 is the base.
    """
    tree = kernel_arrays(pose.arm).tree
    found = np.tile(np.eye(3), (len(tree.parent), 1, 1))
    for i in tree.order.tolist():
        start, cosine, sine = tree.turn[i]
        turn = start + np.cos(pose.q[i - 1]) * cosine + np.sin(pose.q[i - 1]) * sine
        found[i] = found[tree.parent[i]] @ turn
    return found


_found: WeakKeyDictionary[Manipulator, Inputs] = WeakKeyDictionary()


def inputs_of(arm: Manipulator) -> Inputs:
    """Return the inputs of an arm: the numbers that can have a tolerance, such as hole radii.

    They are cached, since finding them takes milliseconds.
    """
    inputs = _found.get(arm)
    if inputs is None:
        inputs = _found[arm] = Inputs(arm)
    return inputs


class Inputs:
    """Inputs of an arm: all numbers that can have a tolerance, such as the radius of one hole.

    Inputs of one kind belong to one *source* of uncertainty; for example, all hole radii belong to
    ``hole_radius``.

    Attributes:
        places: Points of the arm without errors; they have n coordinates.
        first: Index of the first site of each cable, then the number of sites, (C+1,).
        link_rows: Number of the joint that moves each link with a mass (links,); 0 is the base.
        labels: Names of the inputs of each source.
        columns: Columns of :attr:`map` that belong to each source that moves points.
        map: Sparse matrix (n, inputs) of the derivatives of the n coordinates with respect to the
            inputs of these sources.
    """

    def __init__(self, arm: Manipulator) -> None:
        model = kernel_arrays(arm)
        cables = [cable.name for cable in arm.cables]
        self.places = Places(
            model.routing.point, model.tree.translation, model.masses.centre, model.masses.point
        )
        self.first = frozen(np.cumsum([0, *(len(cable.sites) for cable in arm.cables)]))
        # the crosses of universal joints weigh next to nothing
        self.link_rows = frozen(np.flatnonzero(model.masses.mass > CROSS_MASS))
        rows = ("base", *arm.joint_names)
        sites = [
            f"{cable.name} on {site.link}, site {i}"
            for cable in arm.cables
            for i, site in enumerate(cable.sites, start=1)
        ]
        each = (site for cable in arm.cables for site in cable.sites)
        holes = zip(sites, each, strict=True)
        self.labels: dict[str, tuple[str, ...]] = {
            "rigidity": tuple(cables),
            "spring": tuple(cables[c] for c in np.flatnonzero(arm._laws.series)),
            "joint_angle": arm.joint_names,
            "tension": tuple(cables),
            "lead": tuple(cables),
            "friction": tuple(name for name, site in holes if site.friction),
            "link_mass": tuple(f"link moved by {rows[i]}" for i in self.link_rows),
            "site": tuple(f"{site}, {axis}" for site in sites for axis in "xyz"),
        }
        total, count = self.places.stacked().size, 3 * len(sites)
        maps = {"site": csr_matrix(np.eye(total, count))}
        if arm.is_serpentine:
            maps |= self._disks(arm, sites)
        self.map = csr_matrix(hstack(list(maps.values())))
        ends = np.cumsum([0, *(each.shape[1] for each in maps.values())]).tolist()
        self.columns = {source: slice(*ends[i : i + 2]) for i, source in enumerate(maps)}
        self._transposed = csr_matrix(self.map.T)

    def zeros(self) -> dict[str, Array]:
        """Return an array of zeros for each source of uncertainty, with an entry for each input."""
        return {source: np.zeros(len(names)) for source, names in self.labels.items()}

    def by_source(self, by_place: Places) -> dict[str, Array]:
        """Convert derivatives with respect to points to derivatives with respect to inputs.

        ``by_place`` has the derivatives of a quantity with respect to the coordinates of the arm's
        points. The result has an array for each source of uncertainty that moves points.
        """
        by_input = self._transposed @ by_place.stacked()
        return {source: by_input[columns] for source, columns in self.columns.items()}

    def gradient(
        self, pose: Posture, motion: Array, velocity: Array, *given: Any
    ) -> tuple[dict[str, Array], Array, Array]:
        """Compute the derivatives of Ψ = zᵀ K_θ z + … with respect to all inputs.

        :func:`~cdsm._former.sensitivity.single_gradient` defines Ψ; ``motion`` is z (nv,),
        ``velocity`` is v (3,), and ``given`` are its arguments from ``tension`` on. The result has
        an array for each source of uncertainty (0 for inputs of wires), and the derivatives with
        respect to the tensions F (C,) and the cable stiffnesses k (C,).
        """
        model = kernel_arrays(pose.arm)
        arguments = model.tree, model.routing, model.masses, pose.q, self.first, motion, velocity
        _, by_q, *by_places, by_mass, by_F, by_k = single_gradient(*arguments, *given)
        by_link = {"joint_angle": by_q, "link_mass": by_mass[self.link_rows]}
        return self.zeros() | by_link | self.by_source(Places(*by_places)), by_F, by_k

    def displaced(self, errors: Mapping[str, Array]) -> Array:
        """Convert errors of the inputs of N arms to displacements (N, n) [m] of their points.

        ``errors`` has an array (N, inputs) for each source of uncertainty; a source that is missing
        has no errors. The n coordinates are in the order of :meth:`Places.stacked`.
        """
        count = len(next(iter(errors.values())))
        every = np.zeros((count, self.map.shape[1]))
        for source, columns in self.columns.items():
            if source in errors:
                every[:, columns] = errors[source]
        return np.asarray((self.map @ every.T).T)

    def require(self, tolerances: Tolerances, arm: Manipulator) -> None:
        """Raise InvalidInput if ``tolerances`` do not fit the arm.

        They do not if the arm has no inputs of one of the sources, such as springs, or if the
        standard uncertainty of a length is above 0.1 times the length of the arm.
        """
        for name, parts in tolerances.given.items():
            if not self.labels.get(name):
                lacks = {
                    "friction": "has no friction in its holes; see Manipulator.with_friction.",
                    "spring": "has no springs in series; see series_stiffness of a Cable.",
                }
                otherwise = (
                    "was made from a URDF and has no holes on disks; give site, the tolerance [m] "
                    "of each coordinate of its cable sites."
                )
                raise InvalidInput(name, f"{arm.name} {lacks.get(name, otherwise)}")
            largest = max(part.standard for part in parts)
            if name in _LENGTHS and largest > _LARGEST * arm.length:
                raise InvalidInput(
                    name,
                    f"a standard uncertainty of {largest:g} m given; up to {_LARGEST:g} of the "
                    f"arm's length, {_LARGEST * arm.length:.2g} m, is a tolerance. It is in m.",
                )

    def _disks(self, arm: Manipulator, sites: list[str]) -> dict[str, csr_matrix]:
        """Find how the inputs of holes, disks and links move the points of the arm.

        Returns the columns of :attr:`map` for each source, and adds the names of the inputs to
        :attr:`labels`. ``sites`` are the names of all cable sites.
        """
        body, (P, rows) = arm._body, (len(sites), arm.nv + 1)
        end, origin, centre = 3 * P + 6 * rows, 3 * P, 3 * P + 3 * rows
        found: dict[str, dict[str, Array]] = {name: {} for name in _ON_DISKS}

        def add(source: str, label: str, at: int, motion: Array) -> None:
            found[source].setdefault(label, np.zeros(end + 3))[at : at + 3] = motion

        disks = arm.geometry.disks
        offsets = {name: [disk.x for disk in disks if disk.link == name] for name, *_ in disks}
        links = {name: body.locate(name) for name in offsets}
        names = list(links)
        everywhere = [site for cable in arm.cables for site in cable.sites]
        for p, site in enumerate(everywhere):
            if site.link not in links:
                continue
            _, rotation, _ = links[site.link]
            x, y, z = site.position
            radius = float(np.hypot(y, z))
            if radius > 0.0:
                add("hole_radius", sites[p], 3 * p, rotation @ [0.0, y / radius, z / radius])
                add("hole_angle", sites[p], 3 * p, rotation @ [0.0, -z, y])
            for d, place in enumerate(offsets[site.link]):
                if abs(x - place) > _NEAR:
                    continue
                before_joint = d > 0 or site.link == names[0]
                along = rotation @ [-1.0 if before_joint else 1.0, 0.0, 0.0]
                add("disk_offset", f"disk {d + 1} of {site.link}", 3 * p, along)
                if before_joint and site.link != names[0]:
                    add("link_length", site.link, 3 * p, -along)
        for k, link in enumerate(names[1:], start=1):
            row, rotation, _ = links[link]
            along = rotation @ [1.0, 0.0, 0.0]
            add("link_length", link, centre + 3 * row, along / 2.0)
            if k == len(names) - 1:
                add("link_length", link, end, along)
            else:
                following = int(np.flatnonzero(kernel_arrays(arm).tree.parent[1:] == row)[0]) + 1
                add("link_length", link, origin + 3 * following, along)
        maps = {}
        for source, inputs in found.items():
            self.labels[source] = tuple(inputs)
            maps[source] = csr_matrix(np.array([*inputs.values()]).reshape(-1, end + 3).T)
        return maps
