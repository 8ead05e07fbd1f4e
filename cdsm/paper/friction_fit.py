"""Fit Table II with effects that Section V leaves out: friction, bearings, another strand.

Each simulated test begins on a shaken arm: the tension of a cable is the same in all its segments.
Then a weight is applied slowly, so cables stick in the holes at first. The bearing of a joint
resists rotation like a spring: the model has a pair of springs between the two disks beside the
joint. The rigidity of all cables is Eq. 19 times one factor, since they come from one spool.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm import presets
from cdsm.cable import Cable
from cdsm.errors import EquilibriumError
from cdsm.identification.least_squares import LeastSquares, no_model
from cdsm.manipulator import Manipulator
from cdsm.paper.prototype import Prototype, arm_of
from cdsm.paper.prototype_fit import BOUNDS, TABLE_START
from cdsm.paper.section_v import POSTURE, TABLE_II, TENSIONS
from cdsm.posture import Posture
from cdsm.statics.loading_path import LoadingPath
from cdsm.support.validation import one_of
from cdsm.support.values import Array, frozen
from cdsm.tension import distribute_tension
from cdsm.wires.laws import LinearElasticity

ADDED: Final = {"friction": (0.0, 0.5), "bearing": (0.0, 500.0), "rigidity": (0.3, 1.5)}
"""Bounds of μ [-], of the stiffness of a bearing [N m/rad], and of the factor on Eq. 19 [-]."""

_SEARCHED: Final = {
    # starts without and with the added parameters: near the best of searches from several starts
    "link_length": (0.0304, 0.03097),
    "tool_length": (0.2547, 0.2781),
    "hole_radius": (0.02432, 0.02479),
    "lead": (0.0017, 0.00093),
    "link_mass": (0.474, 0.116),
    "drive_stiffness": (9.6e6, 9.6e6),
    "tension_offset": (9.02, 19.8),
    "disk_ratio": (0.2944, 0.2862),
    "weight_x": (3.02, 1.6),
    "weight_y": (11.6, 13.8),
    "weight_z": (3.19, 5.35),
    "friction": (0.0, 0.0205),
    "bearing": (0.0, 6.1),
    "rigidity": (1.0, 1.06),
}

_LEAST_WEIGHT = 0.2  # lower bound of the weights [N], since without a weight the tip does not move
_PARTS = 2  # number of equilibria from zero load to the whole weight
_STRETCHED = 1e-3  # elongation of the springs of a bearing [m]


@final
@dataclass(frozen=True, kw_only=True)
class RoughPrototype:
    """A prototype of Section V with friction, bearings and another rigidity of the strand.

    Attributes:
        prototype: All parameters other than the three below.
        friction: μ [-] in all holes.
        bearing: Stiffness of each bearing [N m/rad].
        rigidity: Factor [-] on the rigidity of Eq. 19, common to all cables.
    """

    prototype: Prototype
    friction: float = 0.0
    bearing: float = 0.0
    rigidity: float = 1.0

    @property
    def spring(self) -> float:
        """Stiffness k [N/m] of each of the two springs of a bearing, whose stiffness is 2 k R²."""
        return self.bearing / (2.0 * self.prototype.hole_radius**2)

    def arm(self) -> Manipulator:
        """Build the arm; its last cables are the springs, unless ``bearing`` is 0."""
        strand = presets.STRAND_1X19.scaled(self.rigidity)
        arm = arm_of(self.prototype, strand, self.prototype.drive_stiffness, self.friction)
        if self.bearing == 0.0:
            return arm
        springs = [
            Cable(
                f"bearing {cable.name}",
                tuple(replace(site, friction=0.0) for site in cable.sites[-2:]),
                LinearElasticity(1e9).scaled(1e3),
                series_stiffness=self.spring,
            )
            for cable in arm.cables
        ]
        return arm.with_cables([*arm.cables, *springs])

    def weigh(self) -> list[LoadingPath]:
        """Load the arm slowly with the weight of each entry of Table II, row by row (15 paths).

        Raises CdsmError if an equilibrium is not found.
        """
        pose = self.arm().at(POSTURE)
        return [
            LoadingPath.of(pose, F, np.zeros(6), weight[None], _PARTS)
            for F in self._tensions(pose)
            for weight in self.prototype.weights
        ]

    def tips_to_first_order(self, paths: Sequence[LoadingPath]) -> Array:
        """Estimate the tip positions (15, 3) [m] under the weights from a similar prototype.

        ``paths`` is the result of :meth:`weigh` for that prototype. The tips are correct to first
        order in the differences of the two prototypes.
        """
        pose = self.arm().at(POSTURE)
        tensions = np.repeat(self._tensions(pose), 3, axis=0)
        pairs = zip(paths, tensions, strict=True)
        return np.array([path.beside(pose, F, np.zeros(6))[0] for path, F in pairs])

    def table(self, tips: ArrayLike) -> Array:
        """Compute Table II (5, 3) [N/m] from the tips (15, 3) [m] under the weights.

        An entry is the weight divided by the displacement of the tip along it.
        """
        weights = np.tile(self.prototype.weights, (5, 1))
        moved = np.asarray(tips) - self.arm().at(POSTURE).tip[:3, 3]
        work = np.einsum("ni,ni->n", weights, moved)
        if not (work > 0.0).all():
            nothing = frozen(np.zeros(3))
            raise EquilibriumError("a weight moves the tip against itself", nothing, 0.0, "joint1")
        return np.asarray(((weights**2).sum(axis=1) / work).reshape(5, 3))

    def _tensions(self, pose: Posture) -> Array:
        """Return the tensions (5, C) [N] for the rows of Table II.

        The two springs of a bearing have tensions whose torques cancel.
        """
        names = pose.arm.cables.names
        springs = [c for c, name in enumerate(names) if name.startswith("bearing")]
        fixed = dict[str, float]()
        for pair in zip(springs[::2], springs[1::2], strict=True):
            arms = abs(pose.length_jacobian[list(pair)].sum(axis=1))
            both = self.spring * _STRETCHED * arms[::-1] / arms.mean()
            fixed |= dict(zip((names[c] for c in pair), both.tolist(), strict=True))
        forced = [cable.name for cable in pose.arm.cables if cable.control == "force"]
        levels = (self.prototype.levels + self.prototype.tension_offset).tolist()
        return np.array(
            [
                distribute_tension(pose, fixed=fixed | dict.fromkeys(forced, level)).values
                for level in levels
            ]
        )


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class RoughFit:
    """The prototype, with friction, bearings and rigidity, that explains Table II best.

    Attributes:
        prototype: Identified parameters.
        table: Table II of this prototype (5, 3) [N/m].
        misfit: Root mean square of ln(model/paper) in each column of Table II (3,) [-].
    """

    prototype: RoughPrototype
    table: Array
    misfit: Array


def identify_rough_prototype(added: Sequence[str] = tuple(ADDED)) -> RoughFit:
    """Fit Table II as printed with friction, bearings and a factor on Eq. 19 as parameters.

    The search varies 11 parameters on which Table II depends (dimensions, link mass, weights, drive
    stiffness, tension offset), within :data:`~cdsm.paper.BOUNDS`, and the parameters of
    :data:`ADDED` that ``added`` names. With all three of these, 14 parameters are fitted to 15
    numbers. The tensions of the rows are evenly spaced.

    Raises:
        UnknownName: A name is not in :data:`ADDED`.
    """
    column = int(bool(added))
    for name in added:
        one_of("parameter of the prototype", name, ADDED)
    free = [name for name in _SEARCHED if name in added or name not in ADDED]
    start = {name: row[column] for name, row in _SEARCHED.items() if name in free}
    levels = dict(zip(("level_2", "level_3", "level_4"), TENSIONS[1:4].tolist(), strict=True))
    base = replace(TABLE_START, **levels)
    bounds = {name: (BOUNDS | ADDED)[name] for name in free}
    bounds |= {f"weight_{x}": (_LEAST_WEIGHT, BOUNDS[f"weight_{x}"][1]) for x in "xyz"}

    def rough(values: dict[str, float]) -> RoughPrototype:
        own = {name: x for name, x in values.items() if name in ADDED}
        rest = {name: x for name, x in values.items() if name not in ADDED}
        return RoughPrototype(prototype=replace(base, **rest), **own)

    @lru_cache(maxsize=2)
    def weighed(values: tuple[float, ...]) -> list[LoadingPath]:
        return rough(dict(zip(free, values, strict=True))).weigh()

    def residuals(values: dict[str, float]) -> Array:
        with no_model():
            tips = [path.tips[0] for path in weighed(tuple(values.values()))]
            return np.asarray(np.log(rough(values).table(tips) / TABLE_II).ravel())

    def beside(here: dict[str, float], moved: dict[str, float]) -> Array:
        with no_model():
            tips = rough(moved).tips_to_first_order(weighed(tuple(here.values())))
            return np.asarray(np.log(rough(moved).table(tips) / TABLE_II).ravel())

    problem = LeastSquares(residuals, TABLE_II.size, bounds, beside)
    point = problem.search(
        problem.box.point(np.array(list(start.values()))),
        method="trf",
        tolerances=(1e-4, 1e-5, 1e-8),
        most=30,
    )
    found = rough(problem.parameters(point))
    off = problem.residuals(point).reshape(TABLE_II.shape)
    return RoughFit(
        prototype=found,
        table=frozen(TABLE_II * np.exp(off)),
        misfit=frozen(np.sqrt(np.mean(off**2, axis=0))),
    )
