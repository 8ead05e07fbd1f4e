"""Inputs of an arm: the numbers that can have a tolerance, and how each one changes the arm.

Inputs of one kind, such as the radii of all holes, are a *source* of uncertainty.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import lru_cache
from itertools import compress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from cdsm.batch.rows import BodyArrays, tables_of
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.parameters import PARAMETERS
from cdsm.support.values import Array
from cdsm.tolerances import EVERY, Tolerance, Tolerances, sources
from cdsm.tolerancing.dimensions import (
    NO_PULLEYS,
    Change,
    changes_of_chain,
    changes_of_holes,
)
from cdsm.tolerancing.rebuilt import labels_of
from cdsm.urdf import CROSS_MASS

Errors = Mapping[str, Array]
"""Errors (N, n) of the n inputs of each source, for N arms; a source that is missing has none."""

_LARGEST = 0.1  # largest standard uncertainty of a length, divided by the length of the arm


class Group(NamedTuple):
    """Inputs of one source that share a tolerance."""

    source: str
    inputs: NDArray[np.intp]
    tolerance: Tolerance

    def split(self) -> list[Group]:
        """Return groups of inputs with one error each: each input, or all together if ρ = 1."""
        alone = self.inputs[:, None] if self.tolerance.correlation < 1.0 else [self.inputs]
        return [self._replace(inputs=inputs) for inputs in alone]


class Inputs:
    """Inputs of an arm.

    Its dimensions (points, masses, lengths of leads) and 1/k of its beams are linear in them, or
    nearly so: a sparse matrix for each source turns errors into changes.

    Attributes:
        labels: Names of the inputs of each source, such as ``cable2_1 on link1, site 3``.
        rebuilt: Those of the sources for which arms are built anew (:mod:`.rebuilt`).
    """

    def __init__(self, arm: Manipulator) -> None:
        cables = arm.cables
        self._arm = (arm.name, _LARGEST * arm.length)
        slides = list(compress(arm.joint_names, arm.slides))
        self.labels: dict[str, Sequence[str]] = {
            "rigidity": cables.names,
            "spring": [c.name for c in cables if c.series_stiffness < math.inf],
            "joint_angle": [name for name in arm.joint_names if name not in slides],
            "joint_position": slides,
            "tension": cables.names,
        }
        self._lacks = dict[str, str]()
        refusal = ""
        try:
            for cable in cables:
                cable.only_sites(NO_PULLEYS)
        except InvalidInput as error:
            refusal = str(error)
        self._has_sites = not refusal
        if self._has_sites:
            self._find_dimensions(arm)
        self.rebuilt: dict[str, Sequence[str]] = {}
        for name in [name for name in sources() if name not in self.labels]:
            try:
                if name in PARAMETERS:
                    self.rebuilt[name] = labels_of(arm, name)
            except InvalidInput as error:
                if arm.is_serpentine:
                    self._lacks[name] = str(error).removeprefix(f"{name}: ")
            if refusal and name not in self.rebuilt:
                self._lacks[name] = refusal
        self.labels |= self.rebuilt

    def _find_dimensions(self, arm: Manipulator) -> None:
        """Find the dimensions that are inputs, and what each one changes."""
        cables = arm.cables
        paths = [cable.only_sites(NO_PULLEYS) for cable in cables]
        table = tables_of(arm)
        self._nominal = table.dimensions
        self._sprung = arm.springs.sprung
        k = self._nominal.spring
        softness = np.divide(1.0, k, out=np.full(k.shape, np.inf), where=k > 0.0)
        every = *self._nominal[:-1], softness
        self._parts = np.cumsum([x.size for x in every[:-1]])
        self._numbers = np.concatenate([x.ravel() for x in every])
        cable_of_site = np.repeat(range(len(cables)), [len(path) for path in paths])
        row = arm.routing.row
        self._first = np.flatnonzero(
            (cable_of_site[1:] == cable_of_site[:-1]) & (row[1:] == row[:-1])
        )
        self._of_cable = np.eye(len(cables))[cable_of_site[self._first]]
        holes = [
            (cable.name, i, site)
            for cable, path in zip(cables, paths, strict=True)
            for i, site in enumerate(path, 1)
        ]
        sites = [f"{name} on {site.link}, site {i}" for name, i, site in holes]
        self.labels |= {
            "joint_stiffness": [arm.springs.joints[j] for j in self._sprung],
            "friction": [name for name, e in zip(sites, holes, strict=True) if e[2].friction],
        }
        changes_of: dict[str, list[Change]] = {}
        for change in _changes(arm, sites):
            changes_of.setdefault(change[0], []).append(change)
        self._maps = {}
        for source, changes in changes_of.items():
            _, self.labels[source], rows, values = zip(*changes, strict=True)
            columns = np.repeat(range(len(rows)), [len(holes) for holes in rows])
            entries = np.concatenate(values), (np.concatenate(rows), columns)
            self._maps[source] = csr_matrix(entries, (self._numbers.size, len(rows)))

    def bodies(self, errors: Errors, count: int) -> BodyArrays | None:
        """Return the dimensions of ``count`` arms with ``errors``; None: no input is one."""
        if not self._has_sites:
            return None
        numbers = self._numbers[:, None]
        for source, matrix in self._maps.items():
            if source in errors:
                numbers = numbers + matrix @ errors[source].T
        numbers = np.broadcast_to(numbers, (len(numbers), count)).T
        *parts, softness = np.split(numbers, self._parts, axis=1)
        springs = 1.0 / softness
        springs[:, self._sprung] *= 1.0 + errors.get("joint_stiffness", 0.0)
        shapes = zip((*parts, springs), self._nominal, strict=True)
        body = BodyArrays(*(part.reshape(count, *x.shape) for part, x in shapes))
        a = self._first  # within one body
        b = self._first + 1
        longer = np.linalg.norm(body.site[:, b] - body.site[:, a], axis=2)
        longer -= np.linalg.norm(self._nominal.site[b] - self._nominal.site[a], axis=1)
        return body._replace(fixed=body.fixed + longer @ self._of_cable)

    def groups(self, tolerances: Tolerances) -> tuple[Group, ...]:
        """Find the inputs of each tolerance.

        Raises InvalidInput if the arm has no inputs of a source or none with the name that a
        tolerance gives, if two tolerances belong to one input, or if a length is too uncertain.
        """
        groups = []
        arm, most = self._arm
        known = sources()
        for source, parts in tolerances.given.items():
            names = self.labels.get(source, ())
            taken = np.zeros(0, dtype=np.intp)
            if not names:
                problem = self._lacks.get(source, f"{arm} {_LACKS.get(source, _NO_HOLES)}")
                raise InvalidInput(source, problem)
            for tolerance in parts:
                if known[source].unit.si == "m" and tolerance.standard > most:
                    problem = f"a standard uncertainty of {tolerance.standard:g} m given; up to "
                    problem += f"{_LARGEST} of the arm's length, {most:.2g} m, is a tolerance. It "
                    problem += "is in m."
                    raise InvalidInput(source, problem)
                fits = [tolerance.of == EVERY or fnmatchcase(name, tolerance.of) for name in names]
                chosen = np.flatnonzero(fits)
                if not chosen.size:
                    problem = f"no input is called {tolerance.of!r}; the first of {len(names)} is"
                    raise InvalidInput(source, f"{problem} {names[0]!r}.")
                if (twice := np.intersect1d(taken, chosen)).size:
                    problem = (
                        f"{names[twice[0]]} has two tolerances; {tolerance.of!r} is the second."
                    )
                    raise InvalidInput(source, problem)
                taken = np.append(taken, chosen)
                groups.append(Group(source, chosen, tolerance))
        return tuple(groups)

    def draw(
        self, groups: Sequence[Group], rng: np.random.Generator, draws: int
    ) -> dict[str, Array]:
        """Draw random errors (draws, n) of the n inputs of each source.

        Correlated errors are weighted sums of independent ones. A positive number, 1 + a relative
        error, is lognormal instead of normal, with the same mean and standard uncertainty.
        """
        known = sources()
        errors = {g.source: np.zeros((draws, len(self.labels[g.source]))) for g in groups}
        for source, inputs, tolerance in groups:
            u = tolerance.standard
            rho = tolerance.correlation
            size = (draws, inputs.size + 1)
            normal = tolerance.distribution == "normal"
            side = math.sqrt(3.0)
            x = rng.standard_normal(size) if normal else rng.uniform(-side, side, size)
            x = math.sqrt(1.0 - rho) * x[:, 1:] + math.sqrt(rho) * x[:, :1]
            square = math.log1p(u**2)  # of the logarithm
            positive = known[source].is_relative and normal
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
    "joint_angle": "has no joints that turn; give joint_position [m].",
    "joint_position": "has no joints that slide; give joint_angle [rad].",
    "friction": "has no friction in its holes; see Manipulator.with_friction.",
    "spring": "has no springs in series; see series_stiffness of a Cable.",
    "joint_stiffness": "has no springs at its joints; see joint_stiffness and Geometry.backbone.",
}


def _changes(arm: Manipulator, sites: Sequence[str]) -> Iterator[Change]:
    """Yield what each input changes of the numbers of :class:`Inputs`; ``sites`` are named."""
    dimensions = tables_of(arm).dimensions
    sizes = np.cumsum([0, *(x.size for x in dimensions)]).tolist()
    starts = dict(zip((*BodyArrays._fields[:-1], "softness"), sizes, strict=False))
    one = np.ones(1)
    for p, name in enumerate(sites):
        for i, axis in enumerate("xyz"):
            yield "site", f"{name}, {axis}", np.array([starts["site"] + 3 * p + i]), one
    for c, cable in enumerate(arm.cables):
        yield "lead", cable.name, np.array([starts["fixed"] + c]), one
    if arm.is_serpentine:
        yield from changes_of_holes(arm, sites, starts["site"])
        yield from changes_of_chain(arm, starts)
        return
    moved = ("base", *arm.springs.joints)
    for i in np.flatnonzero(dimensions.mass > CROSS_MASS).tolist():
        yield "link_mass", f"link moved by {moved[i]}", np.array([starts["mass"] + i]), one
