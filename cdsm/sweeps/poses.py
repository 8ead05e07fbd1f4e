"""Pose sets: grids of joints, paths along a polyline, tips in a plane, Sobol points.

A pose set does not depend on an arm. In chunks, its joint angles are computed where they are
needed, so a large set is never in memory.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput, need
from cdsm.manipulator import Manipulator
from cdsm.support.validation import (
    XYZ,
    instance,
    number_array,
    one_of,
    scalar,
    whole_number,
)
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.sweeps.reach import reach_tips

if TYPE_CHECKING:
    import xarray

MAXIMUM_POSES = 2**30
"""Maximum number of postures of a sweep; scipy's Sobol sequence has 30 bits."""

_IN_MEMORY = 2**25  # postures without a store; each takes some 200 bytes in each case
_ALL = slice(None)
_TIP_STEP = 1 / 20  # distance of tips in a plane, over the arm's length
_MOST_TIPS = 40_000


class _Postures(NamedTuple):
    """Postures of an arm, from a pose set or an array."""

    sizes: dict[str, int]  # length of each dimension
    angles: Callable[..., Array]  # joint angles (…, nv) [rad] of a slice of each dimension
    description: str  # in words
    coordinates: dict[str, Any]  # as xarray takes them


class PoseSet(ABC):
    """Set of postures to sweep over: a grid, a path, tips in a plane or random postures."""

    def angles(self, arm: Manipulator, chunk: int | None = None) -> xarray.DataArray:
        """Return the joint angles of this set: its dimensions, then ``joint`` [rad].

        Args:
            arm: The arm.
            chunk: If given, the array is lazy: a dask array in chunks of at most so many postures,
                each computed where it is needed. :func:`~cdsm.sweep` then returns a lazy Dataset.

        Raises:
            InvalidInput: The arm has no such joint. The set does not fit the arm, or has more than
                2³⁰ postures, 2²⁵ without ``chunk``.
            CdsmError: xarray, or dask for chunks, is not installed.
        """
        return angles_of(arm, self, None if chunk is None else whole_number("chunk", chunk, 1))

    @abstractmethod
    def _of(self, arm: Manipulator) -> _Postures:
        """Build the postures of this set for an arm."""


@final
@dataclass(frozen=True, init=False)
class GridPoses(PoseSet):
    """Grid of all combinations of angles of named joints; each joint name becomes a dimension.

    In the Dataset each joint of the arm, also one that does not move, is a coordinate with the name
    of the joint. So a sweep refuses joints called like another variable, such as ``along``.

    Args:
        angles: Angles [rad] of each joint of the grid, by joint name: (n,) or one number; [m] for
            prismatic joints.
        rest: Angles [rad] of joints that do not move, by joint name; 0 for all joints not named.

    Attributes:
        swept: Angles [rad] of each joint of the grid, by name.
        resting: Angle [rad] of each joint in ``rest``, by name.

    Raises:
        InvalidInput: No joint is named; one has no angles, an angle twice, or is in ``rest`` too.

    Example:
        >>> import cdsm
        >>> poses = cdsm.GridPoses({"joint1_1": [-0.1, 0.0, 0.1], "joint1_2": [0.0, 0.1]})
        >>> poses.angles(cdsm.presets.virtual_prototype()).shape
        (3, 2, 10)
    """

    swept: Mapping[str, tuple[float, ...]]
    resting: Mapping[str, float]

    def __init__(
        self, angles: Mapping[str, ArrayLike], rest: Mapping[str, float] | None = None
    ) -> None:
        still = {} if rest is None else rest
        if not (isinstance(angles, Mapping) and angles and isinstance(still, Mapping)):
            problem = f"{angles!r} and rest {rest!r} given; mappings of joint names are needed."
            raise InvalidInput("angles", problem)
        for name in angles.keys() & still.keys():
            raise InvalidInput("rest", f"{name} is swept over; leave it out here.")
        swept = {k: tuple(distinct(f"angles[{k!r}]", a).tolist()) for k, a in angles.items()}
        resting = {name: scalar(f"rest[{name!r}]", angle) for name, angle in still.items()}
        self.__dict__.update(swept=swept, resting=resting)

    def _of(self, arm: Manipulator) -> _Postures:
        q: dict[str, Any] = dict.fromkeys(arm.joint_names, 0.0)
        for name, values in {**self.resting, **self.swept}.items():
            q[one_of("joint", name, arm.joint_names)] = np.array(values)

        def angles(*parts: slice) -> Array:
            along = [q[name][part] for name, part in zip(self.swept, parts, strict=True)]
            grid = np.meshgrid(*along, indexing="ij", sparse=True)
            column = {**q, **dict(zip(self.swept, grid, strict=True))}
            return np.stack(np.broadcast_arrays(*column.values()), axis=-1)

        coordinates: dict[str, Any] = {}
        for name, unit in zip(q, arm.joint_units, strict=True):
            about = {"long_name": f"{'way' if unit == 'm' else 'angle'} of {name}", "units": unit}
            coordinates[name] = ((name,) if name in self.swept else (), q[name], about)
        sizes = {name: len(values) for name, values in self.swept.items()}
        return _Postures(sizes, angles, f"grid over {', '.join(sizes)}", coordinates)


@final
@dataclass(frozen=True, eq=False)
class PathPoses(ReadOnlyState, PoseSet):
    """Postures along straight lines in joint space from one waypoint to the next.

    Attributes:
        waypoints: Joint angles (n, nv) [rad] of two or more postures.
        count: Number of postures at equal distances `√(Σ δθ²)` along the path, both ends included;
            None uses the waypoints themselves.

    Raises:
        InvalidInput: ``waypoints`` are not (n, nv), n ≥ 2, or all equal; or ``count`` is below 2.

    Example:
        >>> import cdsm
        >>> poses = cdsm.PathPoses([[0.0] * 10, [0.1] * 10], count=5)
        >>> poses.angles(cdsm.presets.virtual_prototype()).sizes["pose"]
        5
    """

    waypoints: ArrayLike
    count: int | None = None

    def __post_init__(self) -> None:
        points = number_array("waypoints", self.waypoints)
        if points.ndim != 2 or len(points) < 2:
            problem = f"shape {points.shape} given, (n, nv) needed: two or more postures [rad]."
            raise InvalidInput("waypoints", problem)
        if self.count is not None:
            whole_number("count", self.count, 2, MAXIMUM_POSES)
            if not np.ptp(points, axis=0).any():
                raise InvalidInput("waypoints", "are all the same posture; give different ones.")
        self.__dict__["waypoints"] = frozen(points)

    def _of(self, arm: Manipulator) -> _Postures:
        q = _rows("waypoints", self.waypoints, arm)
        waypoints = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1)))
        way = waypoints
        if self.count is not None:
            way = np.linspace(0.0, waypoints[-1], self.count)
            q = np.column_stack([np.interp(way, waypoints, angles) for angles in q.T])
        about = {"long_name": "way along the path in joint space", "units": _unit(arm)}
        description = f"path of {len(waypoints)} waypoints"
        distance = (("pose",), way, about)
        return _Postures({"pose": len(q)}, q.__getitem__, description, {"distance": distance})


@final
@dataclass(frozen=True)
class RandomPoses(PoseSet):
    """Random postures: a scrambled Sobol sequence, spread evenly within the joint limits.

    A joint without limits (continuous) takes one turn, −180° to 180°.

    Attributes:
        count: Number of postures; powers of two fill the space most evenly.
        seed: Seed of the sequence; equal seeds give equal postures.

    Raises:
        InvalidInput: ``count`` is below 1 or above 2³⁰, or ``seed`` is not a whole number ≥ 0.

    Example:
        >>> import cdsm
        >>> cdsm.RandomPoses(2000, seed=1).count
        2000
    """

    count: int
    seed: int = 0

    def __post_init__(self) -> None:
        whole_number("count", self.count, 1, MAXIMUM_POSES)
        whole_number("seed", self.seed, 0)

    def _of(self, arm: Manipulator) -> _Postures:
        def angles(part: slice) -> Array:
            from scipy.stats import qmc  # takes half a second to import

            start, stop, _ = part.indices(self.count)
            sequence = qmc.Sobol(arm.nv, seed=np.random.default_rng(self.seed))
            if start:
                unit = sequence.fast_forward(start).random(stop - start)
            else:  # scipy warns of a first draw that is no power of two
                unit = sequence.random(1 << (stop - 1).bit_length())[:stop]
            lower, upper = finite_limits(arm)
            return np.asarray(lower + unit * (upper - lower))

        description = f"{self.count} Sobol points within the joint limits, seed {self.seed}"
        return _Postures({"pose": self.count}, angles, description, {})


@final
@dataclass(frozen=True)
class PlanePoses(PoseSet):
    """Postures whose tips fill a plane: a grid of tips, for maps of the workspace.

    The grid is as large as the tip can reach. Each posture is continued from that of a neighbour,
    and goes back to the straight arm as far as its tip allows: steps towards `min ‖θ − θ_0‖²` with
    `tip(θ) = target`, where `θ_0` is 0, or the limit nearest to 0. A tip that no neighbour leads to
    has NaN for its angles, and the status OUT_OF_REACH in a sweep. The dimensions are the other two
    axes, such as ``tip_y`` and ``tip_z``.

    Attributes:
        axis: Axis normal to the plane: ``"x"``, ``"y"`` or ``"z"``.
        position: Coordinate of the plane along this axis [m], base axes.
        step: Distance of neighbouring tips [m]; None: a twentieth of the arm's length.

    Raises:
        InvalidInput: ``axis`` is no axis, or ``step`` is not above zero. For an arm: the plane is
            out of reach, or has more than 40 000 tips.

    Example:
        >>> import cdsm
        >>> cdsm.PlanePoses("y", 0.0, step=0.01).axis
        'y'
    """

    axis: str
    position: float
    step: float | None = None

    def __post_init__(self) -> None:
        one_of("axis", self.axis, XYZ)
        scalar("position", self.position)
        if self.step is not None and not scalar("step", self.step) > 0.0:
            raise InvalidInput("step", f"{self.step:g} m given; a distance above 0 is needed.")

    def _of(self, arm: Manipulator) -> _Postures:
        axis = XYZ.index(self.axis)
        plane = [k for k in range(3) if k != axis]
        step = arm.length * _TIP_STEP if self.step is None else self.step
        half = int(arm.length / step)
        if (2 * half + 1) ** 2 > _MOST_TIPS:
            problem = f"{1e3 * step:g} mm makes {2 * half + 1} x {2 * half + 1} tips; "
            raise InvalidInput("step", f"{problem}{_MOST_TIPS} are taken at most.")
        places = step * np.arange(-half, half + 1)
        targets = np.empty((len(places), len(places), 3))
        targets[..., axis] = self.position
        targets[..., plane[0]], targets[..., plane[1]] = np.meshgrid(places, places, indexing="ij")
        angles = reach_tips(arm, targets)
        known = np.isfinite(angles).all(axis=-1)
        if not known.any():
            problem = f"the tip reaches no place of the grid at {self.axis} = "
            remedy = "move the plane towards the arm, or take a smaller step."
            raise InvalidInput("position", f"{problem}{1e3 * self.position:g} mm; {remedy}")
        rows, columns = (np.unique(indices) for indices in np.nonzero(known))
        part = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
        q = angles[part]
        names = [f"tip_{XYZ[k]}" for k in plane]
        about = {"long_name": f"{self.axis} of all tips", "units": "m"}
        coordinates: dict[str, Any] = {"plane": ((), self.position, about)}
        for name, cut in zip(names, part, strict=True):
            about = {"long_name": f"{name[-1]} of the tip", "units": "m"}
            coordinates[name] = ((name,), places[cut], about)
        description = f"tips in the plane {self.axis} = {1e3 * self.position:g} mm"
        sizes = dict(zip(names, q.shape[:2], strict=True))
        return _Postures(sizes, lambda *parts: q[parts], description, coordinates)


def finite_limits(arm: Manipulator) -> tuple[Array, Array]:
    """Return the limits (nv,) of the joints, ±π where they have none."""
    lower = np.where(np.isinf(arm.lower), -math.pi, arm.lower)
    upper = np.where(np.isinf(arm.upper), math.pi, arm.upper)
    return lower, upper


def joint_angles(arm: Manipulator, q: PoseSet | ArrayLike) -> Array:
    """Return the joint angles (N, nv) [rad] of a pose set or array, checked."""
    postures = _postures_of(arm, q)
    return postures.angles(*[_ALL] * len(postures.sizes)).reshape(-1, arm.nv)


def angles_of(
    arm: Manipulator, q: PoseSet | ArrayLike | xarray.DataArray, chunk: int | None = None
) -> xarray.DataArray:
    """Return the joint angles of a sweep with their coordinates; lazy if ``chunk`` is given."""
    need("sweep", "xarray", *([] if chunk is None else ["dask"]))
    import xarray

    instance("arm", arm, Manipulator)
    if isinstance(q, xarray.DataArray):
        return _checked(arm, q, chunk)
    sizes, angles, description, coordinates = _postures_of(arm, q)
    if math.prod(sizes.values()) > (_IN_MEMORY if chunk is None else MAXIMUM_POSES):
        size = " x ".join(map(str, sizes.values()))
        raise InvalidInput("q", f"has {size} postures; 2^30 are taken at most, 2^25 in memory.")
    if chunk is None:
        values: Any = angles(*[_ALL] * len(sizes))
    else:
        import dask.array

        def block(block_info: Any = None) -> Array:
            return angles(*(slice(*ends) for ends in block_info[None]["array-location"][:-1]))

        lazy: Any = dask.array  # untyped
        most = 8 * arm.nv * chunk
        shape = (*sizes.values(), arm.nv)
        chunks = ("auto",) * len(sizes) + (arm.nv,)
        chunks = lazy.core.normalize_chunks(chunks, shape, limit=most, dtype=np.float64)
        values = lazy.map_blocks(block, chunks=chunks, meta=np.empty(0))
    if "pose" in sizes:
        number = {"long_name": "number of the posture", "units": "1"}
        coordinates |= {"pose": (("pose",), np.arange(sizes["pose"]), number)}
    about = {"long_name": "joint angles", "units": _unit(arm), "poses": description}
    return xarray.DataArray(values, coordinates, (*sizes, "joint"), attrs=about)


def distinct(name: str, values: ArrayLike) -> Array:
    """Check and return the values (n,) of a dimension: one or more numbers, no two equal."""
    array = np.atleast_1d(number_array(name, values))
    if array.ndim > 1 or not array.size or len(np.unique(array)) < array.size:
        raise InvalidInput(name, f"{values!r:.200} given; give one or more different numbers.")
    return array


def _postures_of(arm: Manipulator, q: PoseSet | ArrayLike) -> _Postures:
    if isinstance(q, PoseSet):
        return q._of(arm)
    rows = _rows("q", q, arm)
    return _Postures({"pose": len(rows)}, rows.__getitem__, "as given", {})


def _rows(name: str, q: ArrayLike, arm: Manipulator) -> Array:
    angles = number_array(name, q)
    if angles.ndim != 2 or angles.shape[1] != arm.nv or not len(angles):
        needed = f"(N, {arm.nv}) needed: one or more postures, each one angle [rad] per joint"
        raise InvalidInput(name, f"shape {angles.shape} given, {needed}.")
    return angles


def _checked(arm: Manipulator, q: xarray.DataArray, chunk: int | None) -> xarray.DataArray:
    """Check a DataArray of joint angles; return it with ``joint`` last, and undivided there."""
    if q.ndim < 2 or q.sizes.get("joint") != arm.nv or not q.size:
        raise InvalidInput("q", f"{dict(q.sizes)} given; postures x joint={arm.nv} is needed.")
    if "joint" in q.coords and tuple(q["joint"].values.tolist()) != arm.joint_names:
        raise InvalidInput("q", f"its joints are not {', '.join(arm.joint_names)}, in this order.")
    q = q.transpose(..., "joint")
    if q.chunks is None:
        number_array("q", q.values)
        rows = q.size // len(q) // arm.nv  # in each entry of the first dimension
        return q if chunk is None else q.chunk({q.dims[0]: max(1, chunk // rows)})
    return q.chunk(joint=-1)


def _unit(arm: Manipulator) -> str:
    return "rad or m" if arm.slides.any() else "rad"
