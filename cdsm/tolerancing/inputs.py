"""Inputs of an arm: the numbers that can have a tolerance, and how each one changes the arm.

Inputs of one kind, such as the radii of all holes, are a *source* of uncertainty.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from cdsm.batch.rows import Body, rows_of
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.support.values import Array
from cdsm.tolerances import EVERY, Tolerance, Tolerances
from cdsm.urdf import CROSS_MASS

Errors = Mapping[str, Array]
"""Errors (N, n) of the n inputs of each source, for N arms; a source that is missing has none."""

_POSITIVE = (
    "rigidity",
    "spring",
    "joint_stiffness",
)  # sources with relative errors of positive numbers
_NEAR = 1e-9  # a site this near to a disk [m] is on the disk
_LENGTHS = ("lead", "hole_radius", "disk_offset", "link_length", "site")
_LARGEST = 0.1  # largest standard uncertainty of a length, divided by the length of the arm


class Group(NamedTuple):
    """Inputs of one source that share a tolerance."""

    source: str
    inputs: NDArray[np.intp]
    tolerance: Tolerance

    def split(self) -> list[Group]:
        """Return groups of inputs with one error each: each input, or all together if ρ = 1."""
        alone = self.inputs[:, None] if self.tolerance.correlation < 1.0 else [self.inputs]
        return [self._replace(inputs=each) for each in alone]


class Inputs:
    """Inputs of an arm.

    Its points (joint origins, sites, centres of mass, tip) depend linearly on them: a sparse matrix
    for each source turns errors into displacements.

    Attributes:
        labels: Names of the inputs of each source, such as ``cable2_1 on link1, site 3``.
    """

    def __init__(self, arm: Manipulator) -> None:
        cables, table, self._arm = arm.cables, rows_of(arm), (arm.name, _LARGEST * arm.length)
        self._nominal = nominal = table.dimensions
        self._points = np.concatenate([x.ravel() for x in nominal[:4]])
        # the crosses of universal joints weigh next to nothing
        self._sprung = arm.springs.sprung
        self._heavy = np.flatnonzero(nominal.mass > CROSS_MASS)
        of, row = np.repeat(range(len(cables)), [len(c.sites) for c in cables]), arm._routing.row
        self._first = np.flatnonzero((of[1:] == of[:-1]) & (row[1:] == row[:-1]))
        self._of_cable = np.eye(len(cables))[of[self._first]]
        each = [(c.name, i, site) for c in cables for i, site in enumerate(c.sites, 1)]
        sites = [f"{name} on {site.link}, site {i}" for name, i, site in each]
        moved = ("base", *arm.springs.joints)
        self.labels: dict[str, Sequence[str]] = {
            "rigidity": cables.names,
            "spring": [c.name for c in cables if c.series_stiffness < math.inf],
            "joint_stiffness": [arm.springs.joints[j] for j in self._sprung],
            "joint_angle": arm.joint_names,
            "tension": cables.names,
            "lead": cables.names,
            "friction": [name for name, e in zip(sites, each, strict=True) if e[2].friction],
            "link_mass": [f"link moved by {moved[i]}" for i in self._heavy],
        }
        names: dict[str, dict[str, int]] = {}
        entries: dict[str, list[tuple[int, int, float]]] = {}
        for source, name, point, motion in _motions(arm, sites):
            of_source = names.setdefault(source, {})
            column = of_source.setdefault(name, len(of_source))
            entries.setdefault(source, []).extend((point + x, column, motion[x]) for x in range(3))
        self._maps = {}
        for source, of_source in names.items():
            i, j, values = np.array(entries[source]).T
            self.labels[source] = [*of_source]
            self._maps[source] = csr_matrix((values, (i, j)), (self._points.size, len(of_source)))

    def bodies(self, errors: Errors, count: int) -> Body:
        """Return the dimensions of ``count`` arms with ``errors``."""
        nominal, points = self._nominal, self._points[:, None]
        for source, each in self._maps.items():
            if source in errors:
                points = points + each @ errors[source].T
        points = np.broadcast_to(points, (len(points), count)).T
        parts = np.split(points, np.cumsum([x.size for x in nominal[:3]]), axis=1)
        shift, site, centre, tip = (
            part.reshape(count, *x.shape) for part, x in zip(parts, nominal[:4], strict=True)
        )
        mass, fixed, spring = (np.tile(x, (count, 1)) for x in nominal[4:])
        mass[:, self._heavy] += errors.get("link_mass", 0.0)
        fixed += errors.get("lead", 0.0)
        spring[:, self._sprung] *= 1.0 + errors.get("joint_stiffness", 0.0)
        a, b = self._first, self._first + 1  # within one body
        longer = np.linalg.norm(site[:, b] - site[:, a], axis=2)
        longer -= np.linalg.norm(nominal.site[b] - nominal.site[a], axis=1)
        return Body(shift, site, centre, tip, mass, fixed + longer @ self._of_cable, spring)

    def groups(self, tolerances: Tolerances) -> tuple[Group, ...]:
        """Find the inputs of each tolerance.

        Raises InvalidInput if the arm has no inputs of a source or none with the name that a
        tolerance gives, if two tolerances belong to one input, or if a length is too uncertain.
        """
        found, (arm, most) = [], self._arm
        for source, given in tolerances.given.items():
            names, taken = self.labels.get(source, ()), np.zeros(0, dtype=np.intp)
            if not names:
                raise InvalidInput(source, f"{arm} {_LACKS.get(source, _NO_HOLES)}")
            for each in given:
                if source in _LENGTHS and each.standard > most:
                    said = f"a standard uncertainty of {each.standard:g} m given; up to {_LARGEST} "
                    said += f"of the arm's length, {most:.2g} m, is a tolerance. It is in m."
                    raise InvalidInput(source, said)
                fits = [each.of == EVERY or fnmatchcase(name, each.of) for name in names]
                own = np.flatnonzero(fits)
                if not own.size:
                    said = f"no input is called {each.of!r}; the first of {len(names)} is"
                    raise InvalidInput(source, f"{said} {names[0]!r}.")
                if (twice := np.intersect1d(taken, own)).size:
                    said = f"{names[twice[0]]} has two tolerances; {each.of!r} is the second."
                    raise InvalidInput(source, said)
                taken = np.append(taken, own)
                found.append(Group(source, own, each))
        return tuple(found)

    def draw(
        self, groups: Sequence[Group], rng: np.random.Generator, draws: int
    ) -> dict[str, Array]:
        """Draw random errors (draws, n) of the n inputs of each source.

        Correlated errors are weighted sums of independent ones. A positive number, 1 + a relative
        error, is lognormal instead of normal, with the same mean and standard uncertainty.
        """
        errors = {g.source: np.zeros((draws, len(self.labels[g.source]))) for g in groups}
        for source, inputs, tolerance in groups:
            u, rho, size = tolerance.standard, tolerance.correlation, (draws, inputs.size + 1)
            normal, side = tolerance.distribution == "normal", math.sqrt(3.0)
            x = rng.standard_normal(size) if normal else rng.uniform(-side, side, size)
            x = math.sqrt(1.0 - rho) * x[:, 1:] + math.sqrt(rho) * x[:, :1]
            square = math.log1p(u**2)  # of the logarithm
            positive = source in _POSITIVE and normal
            drawn = np.expm1(math.sqrt(square) * x - square / 2.0) if positive else u * x
            errors[source][:, inputs] = drawn
        return errors


@lru_cache(maxsize=16)
def inputs_of(arm: Manipulator) -> Inputs:
    """Return the inputs of an arm, which are found once."""
    return Inputs(arm)


_NO_HOLES = (
    "was made from a URDF and has no holes on disks; give site, the tolerance [m] of each "
    "coordinate of its cable sites."
)
_LACKS = {
    "friction": "has no friction in its holes; see Manipulator.with_friction.",
    "spring": "has no springs in series; see series_stiffness of a Cable.",
    "joint_stiffness": "has no springs at its joints; see joint_stiffness and Geometry.backbone.",
}


def _motions(arm: Manipulator, names: Sequence[str]) -> Iterator[tuple[str, str, int, Array]]:
    """Yield how inputs move points: source, input, first coordinate and motion (3,) of a point.

    ``names`` are those of all sites.
    """
    table = rows_of(arm)
    shift, site, centre = np.cumsum([x.size for x in table.dimensions[:3]]).tolist()
    for p, name in enumerate(names):
        for axis, unit in zip("xyz", np.eye(3), strict=True):
            yield "site", f"{name}, {axis}", shift + 3 * p, unit
    if not arm.is_serpentine:
        return
    disks = arm.geometry.disks
    places = {name: [disk.x for disk in disks if disk.link == name] for name, *_ in disks}
    base, *links = places
    for p, own in enumerate(own for cable in arm.cables for own in cable.sites):
        if own.link not in places:
            continue
        rotation, at = arm._body.locate(own.link)[1], shift + 3 * p
        x, y, z = own.position
        if radius := math.hypot(y, z):
            yield "hole_radius", names[p], at, rotation @ [0.0, y / radius, z / radius]
            yield "hole_angle", names[p], at, rotation @ [0.0, -z, y]
        for d, place in enumerate(places[own.link]):
            if abs(x - place) <= _NEAR:
                before_joint = d > 0 or own.link == base
                along = rotation @ [-1.0 if before_joint else 1.0, 0.0, 0.0]
                yield "disk_offset", f"disk {d + 1} of {own.link}", at, along
                if d > 0:
                    yield "link_length", own.link, at, -along
    for link in links:
        row, rotation, _ = arm._body.locate(link)
        along = rotation @ [1.0, 0.0, 0.0]
        yield "link_length", link, site + 3 * row, along / 2.0
        following = np.flatnonzero(table.arm.parent == row).tolist()
        yield "link_length", link, 3 * following[0] if following else centre, along
