"""What acts on an arm: dead loads at its tip or on any links, as a term of its energy.

A wrench at the tip alone is kept as the array W (6,), which is fast; see :data:`Applied`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.arm import ComputedArm
from cdsm.dead_loads import LinkPoint, Places
from cdsm.definition import Term
from cdsm.errors import InvalidInput, listed
from cdsm.posture import Posture
from cdsm.routing import cross
from cdsm.support.result import quantity
from cdsm.support.values import Array, frozen, total
from cdsm.terms import torque_of


# slots, not frozen: a load is made with every K_θ
@dataclass(slots=True)
class TipLoad:
    """Dead wrench W (6,) at the tip: U = −f·x for a force f.

    A moment m has no potential. In its place is −m·φ, with the rotation φ from the ``reference``.
    """

    wrench: Array  # base axes: force [N], then moment [N m]
    reference: Posture | None = None  # of the energy, which is zero there
    name: ClassVar[str] = "load"

    def energy(self, pose: Posture) -> float:
        """Compute U [J] against the reference."""
        assert self.reference is not None
        start = self.reference.tip
        turn = pose.tip[:3, :3] @ start[:3, :3].T
        return _energy(self.wrench, pose.tip[:3, 3] - start[:3, 3], turn)

    def torque(self, pose: Posture) -> Array:
        """Compute −J_Xᵀ W (nv,) [N m]."""
        return -self.wrench @ pose.jacobian

    def torque_size(self, pose: Posture) -> Array:
        """Compute |J_X|ᵀ |W| (nv,) [N m]."""
        return abs(self.wrench) @ abs(pose.jacobian)

    def stiffness(self, pose: Posture) -> Array:
        """Compute −∂(J_Xᵀ W)/∂θ (nv, nv) [N m/rad]; not symmetric if W has a moment."""
        body = pose.arm.body
        if body.coupling is None:
            return load_stiffness(pose.jacobian, self.wrench, body.tip_joints)
        v = pose.twist[:3]
        z = pose.twist[3:]
        jacobian = np.vstack([v + cross(z, pose.tip[:3, 3:]), z])  # of all joints
        return body.coupling.square(load_stiffness(jacobian, self.wrench, body.tip_joints))


@dataclass(slots=True)
class PointLoad:
    """Dead wrench W (6,) at a point of a link, as :class:`TipLoad` at the tip."""

    at: LinkPoint
    wrench: Array  # base axes: force [N], then moment [N m]
    reference: Posture | None = None  # of the energy, which is zero there

    def energy(self, pose: Posture) -> float:
        """Compute U [J] against the reference."""
        assert self.reference is not None
        moved = self.at.position(pose) - self.at.position(self.reference)
        turn = self.at.rotation(pose) @ self.at.rotation(self.reference).T
        return _energy(self.wrench, moved, turn)


def _energy(wrench: Array, moved: Array, turn: Array) -> float:
    """Compute U [J] of a dead wrench W (6,) whose point moved (3,) [m] and turned (3, 3)."""
    from scipy.spatial.transform import Rotation  # slow to import

    turned = Rotation.from_matrix(turn).as_rotvec()
    return float(-wrench[:3] @ moved - wrench[3:] @ turned)


@dataclass(slots=True)
class Loads:
    """All loads on the arm, together: of L loads the cost is that of one.

    Of the loads that joint j moves, let F_j be the sum of the forces f, S_j that of p × f + m about
    the origin of the base, P_j that of p fᵀ, M_j that of the moments m. With the twists (v, z) of
    the joints, their torque is −(F_j·v_j + S_j·z_j). Let joint a be before b on the way to a load.
    K_θ has z_a·(F_b × v_b + tr(P_b) z_b − P_b z_b) in the entries (a, b) and (b, a), also for
    a = b; moments give −(M_b × z_a)·z_b in the entry (b, a) alone.
    """

    loads: Sequence[TipLoad | PointLoad]
    name: ClassVar[str] = "load"
    _places: Places | None = None

    @property
    def tip_wrench(self) -> Array:
        """W (6,) of those at the tip."""
        return total([np.zeros(6), *(x.wrench for x in self.loads if isinstance(x, TipLoad))])

    @property
    def on_links(self) -> tuple[PointLoad, ...]:
        """Those that do not act at the tip."""
        return tuple(load for load in self.loads if isinstance(load, PointLoad))

    def measured_from(self, reference: Posture | None) -> Loads:
        """Return them with a reference of their energies."""
        if reference is None:
            return self
        loads = tuple(replace(load, reference=reference) for load in self.loads)
        return replace(self, loads=loads)

    def scaled(self, share: float) -> Loads:
        """Return a share of all of them."""
        loads = (replace(load, wrench=frozen(share * load.wrench)) for load in self.loads)
        return replace(self, loads=tuple(loads))

    def energy(self, pose: Posture) -> float:
        """Compute the sum of the energies [J]."""
        return sum(load.energy(pose) for load in self.loads)

    def torque(self, pose: Posture) -> Array:
        """Compute the sum of the torques (nv,) [N m]."""
        screws = self._screws(pose)[0].T @ self._at(pose).moved
        return _reduced(pose, -(screws * pose.twist).sum(axis=0))

    def torque_size(self, pose: Posture) -> Array:
        """Compute the sum of the magnitudes of the torques (nv,) [N m]."""
        screws = abs(self._screws(pose)[0]).T @ self._at(pose).moved
        coupling = pose.arm.body.coupling
        size = (screws * abs(pose.twist)).sum(axis=0)
        return np.asarray(size @ abs(coupling.matrix)) if coupling else size

    def stiffness(self, pose: Posture) -> Array:
        """Compute the sum of the stiffnesses (nv, nv) [N m/rad]; moments are not symmetric."""
        screw, point, wrench = self._screws(pose)
        moved = self._at(pose).moved
        v, z = np.split(pose.twist, 2)
        force = screw[:, :3].T @ moved
        spread = ((point[:, :, None] * wrench[:, None, :3]).reshape(-1, 9).T @ moved).reshape(
            3, 3, -1
        )
        trace = spread[0, 0] + spread[1, 1] + spread[2, 2]
        turned = cross(force, v) + trace * z - (spread * z).sum(axis=1)
        before = pose.arm.body.moved_by.T  # of joints a, b: whether a is before b, or is b
        upper = before * (z.T @ turned)
        K = upper + upper.T
        np.fill_diagonal(K, upper.diagonal())
        if wrench[:, 3:].any():
            later = before.T - np.eye(len(K))
            K -= later * (cross(z, wrench[:, 3:].T @ moved).T @ z)
        coupling = pose.arm.body.coupling
        return coupling.square(K) if coupling else K

    def _screws(self, pose: Posture) -> tuple[Array, Array, Array]:
        """Return f, then p × f + m, of each load (L, 6); the points p (L, 3); f, then m (L, 6)."""
        places = self._at(pose)
        frame = pose.placements[places.row]
        point = (frame[:, :3, :3] @ places.offset[:, :, None])[:, :, 0] + frame[:, :3, 3]
        wrench = np.array([load.wrench for load in self.loads])
        screw = wrench.copy()
        screw[:, 3:] += cross(point.T, wrench[:, :3].T).T
        return screw, point, wrench

    def _at(self, pose: Posture) -> Places:
        if self._places is None:
            points = (load.at if isinstance(load, PointLoad) else None for load in self.loads)
            self._places = Places.of(pose.arm.body, points)
        return self._places


def _reduced(pose: Posture, torque: Array) -> Array:
    """Return a torque on the independent joints (nv,), from that on all joints (n,)."""
    coupling = pose.arm.body.coupling
    return np.asarray(torque @ coupling.matrix) if coupling else torque


def load_stiffness(jacobian: Array, wrench: Array, tip_joints: NDArray[np.intp]) -> Array:
    """Compute −∂(J_Xᵀ W)/∂θ (nv, nv) of a dead wrench W (6,) at the tip, from J_X (6, nv).

    Let joint a be before b on the way to the tip. A force f gives −(f × z_a)·v_b in the entries
    (a, b) and (b, a); a moment m gives −(m × z_a)·z_b in the entry (b, a) alone.
    """
    nv = jacobian.shape[1]
    if not wrench.any():
        return np.zeros((nv, nv))
    v, z = np.split(jacobian if len(tip_joints) == nv else jacobian[:, tip_joints], 2)
    later, not_later = _order(len(tip_joints))
    force = not_later * (cross(z, wrench[:3, None]).T @ v)
    moment = later * (cross(z, wrench[3:, None]).T @ z)
    load = force + force.T * later - moment
    if len(tip_joints) == nv:  # in their order, base to tip
        return load
    stiffness = np.zeros((nv, nv))
    stiffness[np.ix_(tip_joints, tip_joints)] = load
    return stiffness


@cache
def _order(count: int) -> tuple[Array, Array]:
    """Return where a row of (count, count) comes after its column, as 0 or 1, and the opposite."""
    later = np.tri(count, k=-1)
    return frozen(later), frozen(1.0 - later)


Applied = Array | Loads
"""What acts on an arm: the wrench W (6,) if it acts at the tip alone, which is fast, or loads."""


def as_loads(applied: Applied) -> Loads:
    """Return what acts on an arm as loads."""
    return applied if isinstance(applied, Loads) else Loads((TipLoad(applied),))


def acts(applied: Applied) -> bool:
    """Return whether anything acts on the arm."""
    return any(load.wrench.any() for load in as_loads(applied).loads)


def scaled(applied: Applied, share: float) -> Applied:
    """Return a share of what acts on an arm."""
    if isinstance(applied, Loads):
        return applied.scaled(share)
    return frozen(share * applied)


def combined(first: Applied, second: Applied) -> Applied:
    """Return the sum of what acts on an arm; loads at one point are added."""
    if not isinstance(first, Loads) and not isinstance(second, Loads):
        return frozen(first + second)
    loads: dict[object, TipLoad | PointLoad] = {}
    for load in (*as_loads(first).loads, *as_loads(second).loads):
        key = "tip" if isinstance(load, TipLoad) else load.at.key
        if key in loads:
            load = replace(load, wrench=frozen(loads[key].wrench + load.wrench))
        loads[key] = load
    return Loads(tuple(loads.values()))


def between(first: Applied, second: Applied, part: float) -> Applied:
    """Return what acts at a part (0 to 1) of the straight way from ``first`` to ``second``."""
    if not isinstance(first, Loads) and not isinstance(second, Loads):
        return frozen(first + part * (second - first))
    return combined(scaled(first, 1.0 - part), scaled(second, part))


def load_at(at: LinkPoint | None, wrench: Array) -> Applied:
    """Return what a wrench W (6,) at a point is; None: at the tip."""
    return frozen(wrench) if at is None else Loads((PointLoad(at, wrench),))


def force_at(at: LinkPoint | None, force: Array) -> Applied:
    """Return what a force (3,) [N] at a point is; None: at the tip."""
    return load_at(at, np.append(force, np.zeros(3)))


def jacobian_at(pose: Posture, at: LinkPoint | None) -> Array:
    """Return the motion (6, nv) of a point by the joints; None: of the tip."""
    return pose.jacobian if at is None else at.jacobian(pose)


def position_at(pose: Posture, at: LinkPoint | None) -> Array:
    """Return the position (3,) [m] of a point in base axes; None: of the tip."""
    return pose.tip[:3, 3] if at is None else at.position(pose)


def tip_part(applied: Applied) -> Array:
    """Return W (6,) of what acts at the tip."""
    return frozen(applied.tip_wrench) if isinstance(applied, Loads) else applied


def tip_only(applied: Applied) -> Array:
    """Return the wrench W (6,) at the tip; InvalidInput if a load acts elsewhere."""
    refuse_links(applied, "wrench", "only one at the tip is known here.")
    return tip_part(applied)


def refuse_links(applied: Applied, name: str, why: str) -> None:
    """Raise InvalidInput if a load acts elsewhere than at the tip; ``why`` comes last."""
    if others := as_loads(applied).on_links:
        links = listed([load.at.link for load in others])
        raise InvalidInput(name, f"loads act on {links}; {why}")


class Loaded:
    """Base class of results that know what acts on the arm."""

    if TYPE_CHECKING:  # a field here, a property there

        @property
        def applied(self) -> Applied:
            """What acts: W (6,) at the tip, or loads on links."""

    @property
    def wrench(self) -> Array:
        """W (6,) at ``tool0``, base axes; InvalidInput if loads act on other links."""
        return tip_only(self.applied)

    @quantity("N and N m", "component", name="wrench")
    def tip_wrench(self) -> Array:
        """W (6,) of what acts at ``tool0``, base axes: force [N], then moment [N m]."""
        return tip_part(self.applied)


def without_cables(
    pose: Posture, wrench: Applied, reference: Posture | None = None
) -> tuple[Term, ...]:
    """Return all terms but those of the cables: gravity, load, springs, and those of the arm's own.

    ``wrench`` is what acts on the arm besides its own loads, ``reference`` the posture from which
    the work counts.
    """
    gravity, *others = pose.arm.terms
    if pose.arm.own_loads:
        wrench = all_loads(pose.arm, wrench)
    if isinstance(wrench, Loads):
        return gravity, wrench.measured_from(reference), *others
    return gravity, TipLoad(wrench, reference), *others


def all_loads(arm: ComputedArm, wrench: Applied) -> Loads:
    """Return what acts on an arm, and the loads that belong to it."""
    own = (PointLoad(at, W) for at, W in arm.own_loads)
    if isinstance(wrench, Loads):
        return Loads((*own, *wrench.loads))
    return Loads((*own, TipLoad(wrench)), arm.own_places)


class PlacedForce(NamedTuple):
    """A force on a link, where it acts at a posture."""

    link: str
    place: Array  # (3,) [m]
    force: Array  # (3,) [N], not zero


def placed_forces(pose: Posture, applied: Applied) -> list[PlacedForce]:
    """Return the forces on an arm, those that belong to it too, for arrows; the tip's is first."""
    loads = all_loads(pose.arm, applied)
    placed = [PlacedForce(pose.arm.tip_link, pose.tip[:3, 3], loads.tip_wrench[:3])]
    placed += [
        PlacedForce(load.at.link, load.at.position(pose), load.wrench[:3])
        for load in loads.on_links
    ]
    return [load for load in placed if load.force.any()]


def required_torque(pose: Posture, wrench: Applied) -> Array:
    """Compute the torque J_Lᵀ F (nv,) [N m] by which the cables balance the arm.

    It is J_Xᵀ W − g (Eq. 13), less the torques of springs and further terms.
    """
    return -torque_of(without_cables(pose, wrench), pose)
