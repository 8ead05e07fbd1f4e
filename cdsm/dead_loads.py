"""Dead loads as a user gives them, and points of links; :mod:`cdsm.applied` has their formulas.

``pose`` is the :class:`~cdsm.Posture`, which this module is below.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import InvalidInput, warn
from cdsm.routing import cross
from cdsm.support.format import coordinates
from cdsm.support.validation import one_of, vector
from cdsm.support.values import Array, frozen

if TYPE_CHECKING:
    from cdsm.geometry import Geometry
    from cdsm.rigid_body import RigidBody

_STILL = 1e-9  # of the length of the arm: a point that moves by less per radian stands still


@final
@dataclass(frozen=True)
class Load:
    """Dead load on a link: a force and a moment that keep their direction as the arm moves.

    Attributes:
        link: Name of the link, not of the base.
        force: f (3,) [N], base axes.
        moment: m (3,) [N m], base axes.
        point: Where the force acts (3,) [m], in the frame of the link. None: at the centre of its
            disk, if the link of a generated arm has one disk, else at the origin of its frame.

    Raises:
        InvalidInput: A vector is not three finite numbers. The arm refuses unknown links.

    Example:
        >>> import cdsm
        >>> camera = cdsm.Load("link2", force=(0.0, -1.5, 0.0))
        >>> arm = cdsm.presets.virtual_prototype()
        >>> pose = arm.at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=5.0, wrench=[camera])
        >>> round(F["cable1_1"], 2)
        35.08
    """

    link: str
    force: tuple[float, ...] = (0.0, 0.0, 0.0)
    moment: tuple[float, ...] = (0.0, 0.0, 0.0)
    point: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.link, str):
            raise InvalidInput("link", f"{self.link!r} given; give the name of a link.")
        units = {"force": "force", "moment": "wrench", "point": "length"}
        for name, quantity in units.items():
            value = getattr(self, name)
            if value is not None:
                checked = vector(name, value, 3, f"a {name} (3,)", quantity)
                object.__setattr__(self, name, tuple(checked.tolist()))

    @property
    def wrench(self) -> Array:
        """Force [N], then moment [N m] (6,)."""
        return frozen(np.array([*self.force, *self.moment]))


@dataclass(frozen=True, eq=False)
class LinkPoint:
    """Point fixed to a link."""

    link: str
    local: Array  # (3,) [m] in the frame of the link
    row: int  # of the joint that carries the link, among placements
    offset: Array  # (3,) [m] in the frame of this joint
    joints: NDArray[np.intp]  # from the base to this joint, by their numbers
    still: bool = False  # it lies on the axes of all these joints, in every posture

    @cached_property
    def key(self) -> tuple[int, bytes]:
        """What points at one place of one link share."""
        return self.row, (self.offset + 0.0).tobytes()  # no -0

    def position(self, pose: Any) -> Array:
        """Compute the position (3,) [m] in base axes."""
        placement = pose.placements[self.row]
        return np.asarray(placement[:3, :3] @ self.offset + placement[:3, 3])

    def rotation(self, pose: Any) -> Array:
        """Return the axes (3, 3) of the joint that carries the link."""
        return np.asarray(pose.placements[self.row][:3, :3])

    def jacobian(self, pose: Any) -> Array:
        """Compute its motion (6, nv) by the independent joints, linear rows first."""
        v = pose.twist[:3, self.joints]
        z = pose.twist[3:, self.joints]
        jacobian = np.zeros((6, pose.twist.shape[1]))
        jacobian[:, self.joints] = np.vstack([v + cross(z, self.position(pose)[:, None]), z])
        coupling = pose.arm.body.coupling
        return np.asarray(jacobian @ coupling.matrix) if coupling else jacobian


def point_on(
    body: RigidBody, geometry: Geometry | None, link: object, point: ArrayLike | None = None
) -> LinkPoint:
    """Return a point of a link, given in the frame of the link (3,) [m].

    None: the centre of the disk of the link, if the geometry has one there, else the origin of its
    frame. Raises InvalidInput if there is no such link, or no joint moves it.
    """
    if point is not None:
        meaning = "a point (3,) [m] in the frame of the link"
        point = tuple(vector("point", point, 3, meaning, "length").tolist())
    return _place(body, geometry, str(link), point)


def _place(
    body: RigidBody, geometry: Geometry | None, link: str, local: tuple[float, ...] | None
) -> LinkPoint:
    """Return a point as :func:`point_on` does, given as checked numbers."""
    if local is None and geometry is not None:
        centres = [disk.x for disk in geometry.disks if disk.link == link]
        local = (centres[0], 0.0, 0.0) if len(centres) == 1 else None
    return _point_on(body, link, local or (0.0, 0.0, 0.0))


@lru_cache(maxsize=128)
def _point_on(body: RigidBody, link: str, local: tuple[float, ...]) -> LinkPoint:
    row, rotation, translation = body.locate(one_of("link", link, body.link_names))
    joints = np.array(body.joints_to(row), np.intp) - 1
    if not joints.size:
        raise InvalidInput(
            "link", f"{link!r} is the base: no joint moves it, and no load bends it."
        )
    offset = frozen(np.asarray(translation + rotation @ local))
    # a point that one posture leaves on all axes is on them in every posture
    state = body.state(np.zeros(len(body.joint_units)))
    position = state.placement[row][:3, :3] @ offset + state.placement[row][:3, 3]
    v, z = np.split(state.twist[:, joints], 2)
    still = bool(abs(v + cross(z, position[:, None])).max() < _STILL * body.length)
    return LinkPoint(link, frozen(np.array(local)), row, offset, joints, still)


def doubt_still(at: LinkPoint) -> None:
    """Warn of a point that no joint moves, such as the centre of the first joint."""
    if at.still:
        where = f"no joint moves the point {coordinates(1e3 * at.local)} mm of {at.link}"
        remedy = "give point= (in ARM.toml: point), or, on the command line, a link farther out."
        warn(f"{where}: a force there bends nothing; {remedy}")


class Places(NamedTuple):
    """Where L loads act."""

    row: NDArray[np.intp]  # of the joint that carries the link (L,), among placements
    offset: Array  # of the point in the frame of this joint (L, 3) [m]
    moved: Array  # 1 where a joint moves the point, else 0 (L, n)

    @classmethod
    def of(cls, body: RigidBody, points: Iterable[LinkPoint | None]) -> Places:
        """Return the places of points; None is the tip."""
        tip = body.tip_row, body.tip_offset
        pairs = [tip if at is None else (at.row, at.offset) for at in points]
        row = np.array([row for row, _ in pairs], np.intp)
        offset = np.array([offset for _, offset in pairs])
        moved = np.vstack([np.zeros(len(body.all_joints)), body.moved_by])[row]
        return cls(row, offset, moved)


def placed_loads(
    loads: Sequence[Load], body: RigidBody, geometry: Geometry | None, name: str
) -> tuple[tuple[LinkPoint, Array], ...]:
    """Return the point and the wrench (6,) of each load; InvalidInput if two act at one point."""
    places: dict[object, tuple[LinkPoint, Array]] = {}
    for load in loads:
        try:
            at = _place(body, geometry, load.link, load.point)
        except InvalidInput as error:
            problem = str(error).removeprefix(f"{error.name}: ")
            raise InvalidInput(f"{name}.{error.name}", problem) from None
        if at.key in places:
            raise InvalidInput(name, f"two loads act on {load.link} at one point; add them up.")
        if load.wrench[:3].any():
            doubt_still(at)
        places[at.key] = at, load.wrench
    return tuple(places.values())
