"""Pose sets: grids over named joints, paths along a polyline, Sobol points within the limits.

A pose set does not depend on an arm; :func:`poses_of` builds its postures for an arm. The joint
angles of a grid are computed block by block, so a large grid is never in memory.
"""

from __future__ import annotations

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.support.validation import number_array, one_of, scalar, whole_number
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.sweeps.arguments import Label, distinct, label
from cdsm.sweeps.blocks import Block

MAXIMUM_POSES = 2**30
"""Maximum number of postures of a path or a random set; scipy's Sobol sequence has 30 bits."""

_DRAWN = 2**16  # number of Sobol points drawn at once


class Poses(NamedTuple):
    """Postures of a sweep, built for an arm from a pose set or an array."""

    sizes: dict[str, int]  # length of each dimension
    angles: Callable[[Block], Array]  # joint angles of a block (n, nv) [rad], in C order
    labels: dict[str, Label]  # coordinates by name, those of the dimensions first
    description: str  # in words


class PoseSet(ABC):
    """Set of postures to sweep over: a grid, a path or random postures."""

    @abstractmethod
    def _of(self, arm: Manipulator) -> Poses:
        """Build the postures of this set for an arm."""


@final
@dataclass(frozen=True, init=False)
class GridPoses(PoseSet):
    """Grid of all combinations of angles of named joints; each joint name becomes a dimension.

    In the Dataset each joint of the arm, also one that does not move, is a coordinate with the name
    of the joint. So a sweep refuses a joint name that the Dataset uses already, such as ``along``,
    or that NetCDF and Zarr do not accept, such as ``a/b``.

    Args:
        angles: Angles [rad] of each joint of the grid, by joint name: (n,) or one number; [m] for
            prismatic joints.
        rest: Angles [rad] of joints that do not move, by joint name; 0 for all joints not named.

    Attributes:
        swept: Name of each joint of the grid, with its angles [rad].
        resting: Name of each joint in ``rest``, with its angle [rad].

    Raises:
        InvalidInput: No joint is named; or a joint has no angles, an angle twice, or is also in
            ``rest``.
    """

    swept: tuple[tuple[str, tuple[float, ...]], ...]
    resting: tuple[tuple[str, float], ...]

    def __init__(
        self, angles: Mapping[str, ArrayLike], rest: Mapping[str, float] | None = None
    ) -> None:
        still = {} if rest is None else rest
        for name, given in (("angles", angles), ("rest", still)):
            if not isinstance(given, Mapping):
                raise InvalidInput(name, f"{given!r} given; a mapping of joint names is needed.")
        if not angles:
            raise InvalidInput("angles", "is empty; name at least one joint and its angles [rad].")
        for name in angles.keys() & still.keys():
            raise InvalidInput("rest", f"{name} is swept over; leave it out here.")
        swept = {name: distinct(f"angles[{name!r}]", each) for name, each in angles.items()}
        resting = {name: scalar(f"rest[{name!r}]", angle) for name, angle in still.items()}
        object.__setattr__(
            self, "swept", tuple((name, tuple(each.tolist())) for name, each in swept.items())
        )
        object.__setattr__(self, "resting", tuple(resting.items()))

    def _of(self, arm: Manipulator) -> Poses:
        names = arm.joint_names
        rest = np.zeros(arm.nv)
        for name, angle in self.resting:
            rest[names.index(one_of("joint", name, names))] = angle
        swept = {one_of("joint", name, names): np.array(values) for name, values in self.swept}
        columns = [names.index(name) for name in swept]

        def angles(block: Block) -> Array:
            parts = [values[block[name]] for name, values in swept.items()]
            grid = np.meshgrid(*parts, indexing="ij")
            q = np.tile(rest, (grid[0].size, 1))
            for column, values in zip(columns, grid, strict=True):
                q[:, column] = values.ravel()
            return q

        still = {name: x for name, x in zip(names, rest.tolist(), strict=True) if name not in swept}
        units = dict(zip(names, arm.joint_units, strict=True))
        labels = {
            name: label(
                (name,) if name in swept else (),
                values,
                f"{'way' if units[name] == 'm' else 'angle'} of {name}",
                units[name],
            )
            for name, values in {**swept, **still}.items()
        }
        sizes = {name: len(values) for name, values in swept.items()}
        return Poses(sizes, angles, labels, f"grid over {', '.join(swept)}")


@final
@dataclass(frozen=True, eq=False)
class PathPoses(ReadOnlyState, PoseSet):
    """Postures along straight lines in joint space from one waypoint to the next.

    Attributes:
        waypoints: Joint angles (n, nv) [rad] of two or more postures.
        count: Number of postures at equal distances √Σδθ² along the path, both ends included; None
            uses the waypoints themselves.

    Raises:
        InvalidInput: ``waypoints`` is not (n, nv) with n ≥ 2, the path has no length, or ``count``
            is below 2 or above 2³⁰.
    """

    waypoints: ArrayLike
    count: int | None = None

    def __post_init__(self) -> None:
        waypoints = number_array("waypoints", self.waypoints)
        if waypoints.ndim != 2 or len(waypoints) < 2:
            raise InvalidInput(
                "waypoints",
                f"shape {waypoints.shape} given, (n, nv) needed: two or more postures [rad].",
            )
        if self.count is not None:
            whole_number("count", self.count, 2, MAXIMUM_POSES)
        object.__setattr__(self, "waypoints", frozen(waypoints))
        if self.count is not None and not self._distances[-1] > 0.0:
            raise InvalidInput("waypoints", "are all the same posture; give two different ones.")

    @property
    def _distances(self) -> Array:
        """Return the length of the path, summed √Σδθ², up to each waypoint, (n,) [rad]."""
        steps = np.linalg.norm(np.diff(self.waypoints, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def _of(self, arm: Manipulator) -> Poses:
        known = self._distances
        q, distances = checked_angles("waypoints", self.waypoints, arm), known
        if self.count is not None:
            distances = np.linspace(0.0, known[-1], self.count)
            q = np.column_stack([np.interp(distances, known, column) for column in q.T])
        distance = label(("pose",), distances, "way along the path in joint space", _unit(arm))
        return _listed(q, arm, f"path of {len(known)} waypoints", {"distance": distance})


@final
@dataclass(frozen=True)
class RandomPoses(PoseSet):
    """Random postures: a scrambled Sobol sequence, spread evenly within the joint limits.

    Attributes:
        count: Number of postures; powers of two fill the space most evenly.
        seed: Seed of the sequence; equal seeds give equal postures.

    Raises:
        InvalidInput: ``count`` is below 1 or above 2³⁰, or ``seed`` is not a whole number ≥ 0.
    """

    count: int
    seed: int = 0

    def __post_init__(self) -> None:
        whole_number("count", self.count, 1, MAXIMUM_POSES)
        whole_number("seed", self.seed, 0)

    def _of(self, arm: Manipulator) -> Poses:
        from scipy.stats import qmc  # takes half a second to import

        sequence = qmc.Sobol(arm.nv, seed=np.random.default_rng(self.seed))
        q = np.empty((self.count, arm.nv))
        # the first point is drawn alone: else scipy warns of counts that are not powers of two
        edges = [0, *range(1, self.count, _DRAWN), self.count]
        for start, stop in itertools.pairwise(edges):
            q[start:stop] = sequence.random(stop - start)
        q *= arm.upper - arm.lower
        q += arm.lower
        description = f"{self.count} Sobol points within the joint limits, seed {self.seed}"
        return _listed(q, arm, description, {})


def poses_of(arm: Manipulator, q: PoseSet | ArrayLike) -> Poses:
    """Build the postures of a pose set, or of an array (N, nv) [rad], for an arm."""
    if isinstance(q, PoseSet):
        return q._of(arm)
    return _listed(checked_angles("q", q, arm), arm, "postures as given", {})


def checked_angles(name: str, q: ArrayLike, arm: Manipulator) -> Array:
    """Check and return joint angles (N, nv) [rad] of one or more postures of the arm."""
    angles = number_array(name, q)
    if angles.ndim != 2 or angles.shape[1] != arm.nv or not len(angles):
        raise InvalidInput(
            name,
            f"shape {angles.shape} given, (N, {arm.nv}) needed: one or more postures, each one "
            f"angle [rad] per joint, {', '.join(arm.joint_names)}.",
        )
    return angles


def _listed(q: Array, arm: Manipulator, description: str, labels: dict[str, Label]) -> Poses:
    labels["pose"] = label(("pose",), np.arange(len(q)), "number of the posture", "1")
    labels["q"] = label(("pose", "joint"), frozen(q), "joint angles", _unit(arm))
    return Poses({"pose": len(q)}, lambda block: q[block["pose"]], labels, description)


def _unit(arm: Manipulator) -> str:
    return "rad or m" if arm.slides.any() else "rad"
