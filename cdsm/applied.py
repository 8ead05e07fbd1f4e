"""What acts on an arm: dead loads at its tip or on any links, as a term of its energy.

A wrench at the tip alone is kept as the array W (6,), which is fast; see :data:`Applied`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from cdsm.definition import Term
from cdsm.errors import InvalidInput, listed
from cdsm.posture import Posture
from cdsm.routing import cross
from cdsm.support.format import coordinates
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

    def energy(self, pose: Posture) -> float:
        """Compute U [J] against the reference."""
        from scipy.spatial.transform import Rotation  # slow to import

        assert self.reference is not None
        start = self.reference.tip
        turned = Rotation.from_matrix(pose.tip[:3, :3] @ start[:3, :3].T).as_rotvec()
        moved = pose.tip[:3, 3] - start[:3, 3]
        return float(-self.wrench[:3] @ moved - self.wrench[3:] @ turned)

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


@dataclass(frozen=True, eq=False)
class LinkPoint:
    """Point fixed to a link."""

    link: str
    local: Array  # (3,) [m] in the frame of the link
    row: int  # of the joint that carries the link, among placements
    offset: Array  # (3,) [m] in the frame of this joint
    joints: NDArray[np.intp]  # from the base to this joint, by their numbers

    @property
    def key(self) -> tuple[int, bytes]:
        """What points at one place of one link share."""
        return self.row, self.offset.tobytes()

    def position(self, pose: Posture) -> Array:
        """Compute the position (3,) [m] in base axes."""
        placement = pose.placements[self.row]
        return np.asarray(placement[:3, :3] @ self.offset + placement[:3, 3])

    def rotation(self, pose: Posture) -> Array:
        """Return the axes (3, 3) of the joint that carries the link."""
        return np.asarray(pose.placements[self.row][:3, :3])

    def full_jacobian(self, pose: Posture) -> Array:
        """Compute its motion (6, n) by all n joints, linear rows first; 0 beyond its link."""
        v = pose.twist[:3, self.joints]
        z = pose.twist[3:, self.joints]
        jacobian = np.zeros((6, pose.twist.shape[1]))
        jacobian[:, self.joints] = np.vstack([v + cross(z, self.position(pose)[:, None]), z])
        return jacobian

    def jacobian(self, pose: Posture) -> Array:
        """Compute its motion (6, nv) by the independent joints, linear rows first."""
        coupling = pose.arm.body.coupling
        jacobian = self.full_jacobian(pose)
        return np.asarray(jacobian @ coupling.matrix) if coupling else jacobian


@dataclass(slots=True)
class PointLoad:
    """Dead wrench W (6,) at a point of a link, as :class:`TipLoad` at the tip.

    With the twists (v_j, z_j) of the joints from the base to the link, at the point p, its torque
    is −(f·(v_j + z_j × p) + m·z_j), and 0 of the joints beyond.
    """

    at: LinkPoint
    wrench: Array  # base axes: force [N], then moment [N m]
    reference: Posture | None = None  # of the energy, which is zero there

    def energy(self, pose: Posture) -> float:
        """Compute U [J] against the reference."""
        from scipy.spatial.transform import Rotation  # slow to import

        assert self.reference is not None
        turn = self.at.rotation(pose) @ self.at.rotation(self.reference).T
        moved = self.at.position(pose) - self.at.position(self.reference)
        turned = Rotation.from_matrix(turn).as_rotvec()
        return float(-self.wrench[:3] @ moved - self.wrench[3:] @ turned)

    def torque(self, pose: Posture) -> Array:
        """Compute −JᵀW (nv,) [N m] with J of the point."""
        return np.asarray(-self.wrench @ self.at.jacobian(pose))

    def torque_size(self, pose: Posture) -> Array:
        """Compute |J|ᵀ |W| (nv,) [N m]."""
        return np.asarray(abs(self.wrench) @ abs(self.at.jacobian(pose)))

    def stiffness(self, pose: Posture) -> Array:
        """Compute −∂(JᵀW)/∂θ (nv, nv) [N m/rad]; not symmetric if W has a moment."""
        coupling = pose.arm.body.coupling
        K = load_stiffness(self.at.full_jacobian(pose), self.wrench, self.at.joints)
        return coupling.square(K) if coupling else K


@dataclass(slots=True)
class Loads:
    """All loads on the arm."""

    loads: Sequence[TipLoad | PointLoad]
    name: ClassVar[str] = "load"

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
        return Loads(tuple(replace(load, reference=reference) for load in self.loads))

    def scaled(self, share: float) -> Loads:
        """Return a share of all of them."""
        return Loads(
            tuple(replace(load, wrench=frozen(share * load.wrench)) for load in self.loads)
        )

    def energy(self, pose: Posture) -> float:
        """Compute the sum of the energies [J]."""
        return sum(load.energy(pose) for load in self.loads)

    def torque(self, pose: Posture) -> Array:
        """Compute the sum of the torques (nv,) [N m]."""
        return total([load.torque(pose) for load in self.loads])

    def torque_size(self, pose: Posture) -> Array:
        """Compute the sum of the magnitudes of the torques (nv,) [N m]."""
        return total([load.torque_size(pose) for load in self.loads])

    def stiffness(self, pose: Posture) -> Array:
        """Compute the sum of the stiffnesses (nv, nv) [N m/rad]."""
        return total([load.stiffness(pose) for load in self.loads])


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


def tip_part(applied: Applied) -> Array:
    """Return W (6,) of what acts at the tip."""
    return frozen(applied.tip_wrench) if isinstance(applied, Loads) else applied


def tip_only(applied: Applied) -> Array:
    """Return the wrench W (6,) at the tip; InvalidInput if a load acts elsewhere."""
    others = as_loads(applied).on_links
    if others:
        names = listed([load.at.link for load in others])
        raise InvalidInput("wrench", f"loads act on {names}; only one at the tip is known here.")
    return tip_part(applied)


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


def described(applied: Applied) -> list[dict[str, object]]:
    """Return the loads for JSON; nothing of a wrench at the tip alone."""
    return [
        {
            "link": load.at.link,
            "point_m": load.at.local,
            "force_N": load.wrench[:3],
            "moment_Nm": load.wrench[3:],
        }
        for load in as_loads(applied).on_links
    ]


def texts(applied: Applied) -> list[str]:
    """Return a line for each load that does not act at the tip, with its place."""
    lines = []
    for load in as_loads(applied).on_links:
        parts = [f"{coordinates(load.wrench[:3])} N"] * bool(load.wrench[:3].any())
        parts += [f"{coordinates(load.wrench[3:])} N m"] * bool(load.wrench[3:].any())
        where = f"{coordinates(1e3 * load.at.local)} mm in its frame"
        lines.append(f"load on {load.at.link}, {where}: {', '.join(parts) or 'none'}")
    return lines


def without_cables(
    pose: Posture, wrench: Applied, reference: Posture | None = None
) -> tuple[Term, ...]:
    """Return all terms but those of the cables: gravity, load, springs, and those of the arm's own.

    ``wrench`` is what acts on the arm, ``reference`` the posture from which its work counts.
    """
    gravity, *others = pose.arm.terms
    if isinstance(wrench, Loads):
        return gravity, wrench.measured_from(reference), *others
    return gravity, Loads((TipLoad(wrench, reference),)), *others


def required_torque(pose: Posture, wrench: Applied) -> Array:
    """Compute the torque J_Lᵀ F (nv,) [N m] by which the cables balance the arm.

    It is J_Xᵀ W − g (Eq. 13), less the torques of springs and further terms.
    """
    return -torque_of(without_cables(pose, wrench), pose)
