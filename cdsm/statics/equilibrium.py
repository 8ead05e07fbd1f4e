"""Equilibrium of a loaded arm whose motors are locked."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

import cdsm
from cdsm.errors import SingularStiffness
from cdsm.posture import Posture
from cdsm.statics.locked_arm import LockedArm
from cdsm.statics.solve import (
    FLAT,
    Balance,
    Point,
    continued,
    equilibrium_error,
    settle,
    stable_between,
)
from cdsm.stiffness_matrix import Stiffness, stiffness
from cdsm.support.directions import Direction, unit_direction
from cdsm.support.format import aligned, coordinates, without_rounding
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import wrench_vector
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_IMMOBILE = 1e-14  # a compliance below this part of the norm of C_vv is rounding


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Equilibrium(Result):
    """Equilibrium of an arm with locked motors under a load; made by :func:`~cdsm.equilibrium`.

    Joint limits act as stops. All arrays are read-only.

    Attributes:
        reference: The posture at which the motors were locked.
        reference_tension: F (C,) [N] at the reference.
        stiffness: K_θ at the equilibrium, with the rest lengths of the *reference*: the derivative
            by q of the torque J_Lᵀ F + g − J_Xᵀ W, without the stops. For a pure force it is the
            exact Hessian of the potential. If no cable is slack and ``original_length`` of the arm
            is "unstrained", it equals :func:`~cdsm.stiffness` of this posture and tension.
        stop_torque: Torque of the stops on the joints (nv,) [N m]: positive at a lower limit,
            negative at an upper limit, zero elsewhere.
        motors: ``"locked"``: they hold the lengths, so the elasticity of the cables counts in K_θ;
            ``"tension"``: they hold the tensions (:func:`~cdsm.forward_statics`).
        branch: Share of load and pull up to which the arm followed without a jump; 1: all of it.
    """

    _headline, _rows = "moved", "cable"

    reference: Posture
    reference_tension: Array = field(metadata=unit("N", "cable"))
    stiffness: Stiffness
    stop_torque: Array = field(metadata=unit("torque", "joint"))
    motors: Literal["locked", "tension"] = field(default="locked", metadata=unit("1"))
    branch: float = field(default=1.0, metadata=unit("1"))

    @property
    def pose(self) -> Posture:
        """Posture at the equilibrium."""
        return self.stiffness.posture

    @property
    def _posture(self) -> Posture:
        return self.pose

    @quantity("N", "cable")
    def tension(self) -> Array:
        """Tensions F (C,) [N] at the equilibrium."""
        return self.stiffness.tension

    @quantity("N and N m", "component")
    def wrench(self) -> Array:
        """W (6,) at ``tool0`` in base axes: force [N], then moment [N m]."""
        return self.stiffness.wrench

    @quantity("torque", "joint")
    def residual(self) -> Array:
        """Residual torque J_Lᵀ F + g − J_Xᵀ W − stop_torque (nv,) [N m]."""
        return frozen(self.stiffness.residual - self.stop_torque)

    @quantity("m", "axis")
    def displacement(self) -> Array:
        """Displacement of the tip from the reference (3,) [m]."""
        return frozen(self.pose.tip[:3, 3] - self.reference.tip[:3, 3])

    @quantity("m")
    def moved(self) -> float:
        """Distance of the tip from the reference [m]."""
        return float(np.linalg.norm(self.displacement))

    @quantity("1")
    def stable(self) -> bool:
        """Whether the symmetric part of K_θ is positive definite for the joints not held by stops.

        It is False for a neutral state, for example if all cables are slack. A joint that touches
        its stop without a torque counts as free, even if this stop blocks the unstable motion.
        """
        K = self.stiffness.joint[np.ix_(self._free, self._free)]
        values = np.linalg.eigvalsh((K + K.T) / 2.0)
        return bool((values > 1e-2 * FLAT * abs(values).max(initial=0.0)).all())

    @quantity("1")
    def slack(self) -> tuple[str, ...]:
        """Names of the position-controlled cables that are slack."""
        held, none = self.pose.arm.cables.position_controlled, self.tension == 0.0
        slack = held & none & (self.stiffness.cable_stiffness == 0.0)
        return tuple(self.pose.arm.cables.names[c] for c in np.flatnonzero(slack))

    @quantity("1")
    def at_limit(self) -> tuple[str, ...]:
        """Names of the joints that rest on a stop."""
        return tuple(self.pose.arm.joint_names[i] for i in np.flatnonzero(self.stop_torque))

    @property
    def _free(self) -> NDArray[np.intp]:
        """Indices (n,) of the joints that no stop pushes."""
        return np.flatnonzero(self.stop_torque == 0.0)

    @cached_property
    def compliance(self) -> Array:
        """Compliance at the tip (6, 6): tip motion per wrench, with joints at stops fixed.

        C = J_X K_θ⁻¹ J_Xᵀ, with the rows and columns of the joints that no stop pushes. Linear rows
        and columns of C are first: C_vv [m/N], C_vω [rad/N], C_ωω [rad/(N m)].

        Raises:
            SingularStiffness: K_θ of these joints is singular.
        """
        if not self.at_limit:
            return self.stiffness.compliance
        free, nv = self._free, self.stop_torque.size
        K, J = self.stiffness.joint[np.ix_(free, free)], self.pose.jacobian[:, free]
        _, values, right = np.linalg.svd(K)
        if free.size and not values[-1] > FLAT * values[0]:
            mode = np.zeros(nv)
            mode[free] = right[-1]
            raise SingularStiffness(
                "K_θ of the joints off their stops is singular, most at "
                f"{self.pose.arm.joint_names[int(abs(mode).argmax())]}: the arm is about to buckle "
                "there.",
                frozen(mode),
            )
        return frozen(J @ np.linalg.solve(K, J.T))

    def along(self, direction: Direction) -> float:
        """Compute the tip stiffness 1/(uᵀ C_vv u) [N/m] along u, with joints at stops fixed.

        C_vv (3, 3) is the part of :attr:`compliance` that relates displacements to forces. u is an
        axis such as ``"z"``, or (3,) in base axes, any length. The stiffness is inf if the tip
        cannot move along u.

        Raises:
            InvalidInput: ``direction`` is neither an axis nor three finite numbers, or is zero.
            SingularStiffness: K_θ of the joints that are not at stops is singular.
        """
        if not self.at_limit:
            return self.stiffness.along(direction)
        u, C = unit_direction("direction", direction), self.compliance[:3, :3]
        compliance = float(u @ C @ u)
        return 1.0 / compliance if abs(compliance) > _IMMOBILE * np.linalg.norm(C) else math.inf

    def plot(self) -> Figure:
        """Plot the arm in mm at the reference (grey) and at the equilibrium."""
        return cdsm.plots.plot_path([self.reference, self.pose])

    def __str__(self) -> str:
        arm, rows = self.pose.arm, [("cable", "tension [N]", "reference", "")]
        for cable, F, F0 in zip(arm.cables, self.tension, self.reference_tension, strict=True):
            below = cable.control == "position" and cable.elasticity.rest > F
            state = "on the slack branch of its wire" if below else ""
            state = "slack" if cable.name in self.slack else state
            rows.append((cable.name, f"{F:.3f}", f"{F0:.3f}", state))
        moved = coordinates(without_rounding(1000.0 * self.displacement))
        lines = [*aligned(rows), f"tip moved by {moved} mm"]
        lines += [
            f"{arm.joint_names[i]} rests on its stop, which pushes with "
            f"{self.stop_torque[i]:.4g} {arm.torque_unit(i)}"
            for i in np.flatnonzero(self.stop_torque).tolist()
        ]
        state = "stable" if self.stable else "NEUTRAL: not every joint is brought back"
        residual = f"{abs(self.residual).max():.1e} {arm.torque_unit()}"
        return "\n".join([*lines, f"{state}, residual {residual}"])


def equilibrium(
    pose: Posture, tension: Tension | ArrayLike, wrench: ArrayLike | None = None
) -> Equilibrium:
    """Compute the equilibrium of an arm under a dead wrench, its motors locked at a reference.

    Solve r(q) = J_Lᵀ F(q) + g − J_Xᵀ W = 0 (Eq. 13). The elongation of a cable is its elongation at
    the reference plus its change of length. For a pure force the solution is a minimum of the
    potential of cables, weight and load: the search leaves saddle points, so an arm that buckles
    comes to rest away from the posture that became unstable. Joint limits act as stops.

    The whole load acts from the start. If several equilibria exist, slow loading
    (:func:`~cdsm.weight_test`) may reach another one.

    Args:
        pose: The reference posture, within the joint limits.
        tension: F at the reference: the result of :func:`~cdsm.distribute_tension`, or other
            tensions (C,) [N], which need not balance the arm.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]. Default: the wrench
            of the ``Tension``, or zero.

    Raises:
        InvalidInput: As for :func:`~cdsm.stiffness`.
        InvalidInput: The posture is beyond a joint limit.
        ElasticityRangeError: A tension at the reference or at the equilibrium is outside the domain
            of its law. A law does not say how a cable becomes slack or yields.
        EquilibriumError: No equilibrium was found. If two sites of a cable meet (disks overlap),
            the error names this cable.
    """
    K = stiffness(pose, tension, None if isinstance(tension, Tension) else wrench)
    W = K.wrench if wrench is None else wrench_vector("wrench", wrench)
    pose.arm._angles(pose.q, True)  # within the joint limits
    return locked_equilibrium(LockedArm(pose, K.tension, W))


def locked_equilibrium(arm: LockedArm) -> Equilibrium:
    """Return the equilibrium to which an arm descends from its reference; see :func:`equilibrium`.

    Raises ElasticityRangeError and EquilibriumError.
    """
    f = Balance(arm.at, arm.reference, arm.at_pose(arm.reference))
    found, converged = settle(f, arm.reference.q)
    if not converged:
        raise equilibrium_error(arm.reference, found, 0.0)
    return as_equilibrium(arm, found)


def followed(arm: LockedArm, before: Posture, stop_torque: Array) -> Point | None:
    """Follow a stable equilibrium while load or motors change a little, without a jump.

    It is at the posture ``before``, where the stops push with ``stop_torque`` (nv,) [N m].
    """
    f = Balance(arm.at, arm.reference, arm.at_pose(before))
    found = continued(f, (before.q / f.unit - stop_torque * f.unit / f.k,), before.q)
    if found is not None and stable_between(arm.at, before.q, found.state.pose.q):
        return found
    return None


def as_equilibrium(arm: LockedArm, found: Point, branch: float = 1.0) -> Equilibrium:
    """Return a solution as an Equilibrium; ElasticityRangeError if a tension is outside its law."""
    return Equilibrium(
        reference=arm.reference,
        reference_tension=arm.tension,
        stiffness=arm.stiffness(found.state.pose),
        stop_torque=found.stop_torque,
        motors="tension" if arm.tension_held else "locked",
        branch=branch,
    )
