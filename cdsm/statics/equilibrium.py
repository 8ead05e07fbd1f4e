"""Equilibrium of a loaded arm whose motors are locked, as a frozen value."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

import cdsm
from cdsm.cable import Cable
from cdsm.errors import SingularStiffness
from cdsm.posture import Posture
from cdsm.statics.trust_region import FLAT
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.directions import unit_direction
from cdsm.support.format import aligned, coordinates, plain, without_rounding
from cdsm.support.values import Array, ReadOnlyState, frozen

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_IMMOBILE = 1e-14
"""A compliance along a direction is rounding if it is below this part of the norm of C_vv."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Equilibrium(ReadOnlyState):
    """Equilibrium of an arm with locked motors under a load; made by :func:`~cdsm.equilibrium`.

    Joint limits act as stops. All arrays are read-only.

    Attributes:
        reference: The posture at which the motors were locked.
        reference_tension: F (C,) [N] at the reference.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m].
        stiffness: K_θ at the equilibrium, with the original lengths of the *reference*: the
            derivative by q of the torque J_Lᵀ F + g − J_Xᵀ W, without the stops. For a pure force
            it is the exact Hessian of the potential. If no cable is slack and ``original_length``
            of the arm is "unstrained", it equals :func:`~cdsm.stiffness` of this posture and
            tension.
        reaction: Torque of the stops on the joints (nv,) [N m]: positive at a lower limit, negative
            at an upper limit, zero elsewhere.
        residual: Residual torque J_Lᵀ F + g − J_Xᵀ W − reaction (nv,) [N m].
    """

    reference: Posture
    reference_tension: Array
    wrench: Array
    stiffness: Stiffness
    reaction: Array
    residual: Array

    @property
    def pose(self) -> Posture:
        """Posture at the equilibrium."""
        return self.stiffness.posture

    @property
    def tension(self) -> Array:
        """Tensions F (C,) [N] at the equilibrium."""
        return self.stiffness.tension

    @property
    def displacement(self) -> Array:
        """Displacement of the tip from the reference (3,) [m]."""
        return frozen(self.pose.tip[:3, 3] - self.reference.tip[:3, 3])

    @property
    def stable(self) -> bool:
        """Whether the symmetric part of K_θ is positive definite for the joints not held by stops.

        It is False for a neutral state, for example if all cables are slack. A joint that touches
        its stop without a reaction counts as free, even if this stop blocks the unstable motion.
        """
        values = eigenvalues(self.stiffness.joint, self._off_stops)
        return bool((values > FLAT * abs(values).max(initial=0.0)).all())

    @cached_property
    def compliance(self) -> Array:
        """Compliance at the tip (6, 6): tip motion per wrench, with joints at stops fixed.

        C = J_X K_θ⁻¹ J_Xᵀ, with the rows and columns of the joints without stop reaction. Linear
        rows and columns of C are first: C_vv [m/N], C_vω [rad/N], C_ωω [rad/(N m)].

        Raises:
            SingularStiffness: K_θ of these joints is singular.
        """
        free = self._off_stops
        if free.size == self.reaction.size:
            return self.stiffness.compliance
        K, J = self.stiffness.joint[np.ix_(free, free)], self.pose.jacobian[:, free]
        if free.size == 0:
            return frozen(np.zeros((6, 6)))
        _, values, right = np.linalg.svd(K)
        if not values[-1] > FLAT * values[0]:
            mode = np.zeros(self.reaction.size)
            mode[free] = right[-1]
            raise SingularStiffness(
                f"K_θ of the joints off their stops is singular, most at "
                f"{self.pose.arm.joint_names[int(abs(mode).argmax())]}: the arm is about to give "
                "way there.",
                frozen(mode),
            )
        return frozen(J @ np.linalg.solve(K, J.T))

    def along(self, direction: ArrayLike) -> float:
        """Compute the tip stiffness 1/(uᵀ C_vv u) [N/m] along u, with joints at stops fixed.

        C_vv (3, 3) is the part of :attr:`compliance` that relates displacements to forces.

        Args:
            direction: u (3,) in base axes, any length.

        Returns:
            The stiffness; inf if the tip cannot move in this direction.

        Raises:
            InvalidInput: ``direction`` is not three finite numbers, or is zero.
            SingularStiffness: K_θ of the joints that are not at stops is singular.
        """
        if not self.at_limit:
            return self.stiffness.along(direction)
        u, C = unit_direction("direction", direction), self.compliance[:3, :3]
        compliance = float(u @ C @ u)
        mobile = abs(compliance) > _IMMOBILE * np.linalg.norm(C)
        return 1.0 / compliance if mobile else math.inf

    @property
    def _off_stops(self) -> NDArray[np.intp]:
        """Indices (n,) of the joints without stop reaction."""
        return np.flatnonzero(self.reaction == 0.0)

    @property
    def slack(self) -> tuple[str, ...]:
        """Names of the position-controlled cables that are slack."""
        states = zip(
            self.pose.arm.cables, self.tension, self.stiffness.cable_stiffness, strict=True
        )
        return tuple(
            cable.name for cable, F, k in states if cable.control == "position" and F == k == 0.0
        )

    @property
    def at_limit(self) -> tuple[str, ...]:
        """Names of the joints that rest on a stop."""
        return tuple(self.pose.arm.joint_names[i] for i in np.flatnonzero(self.reaction))

    def plot(self) -> Figure:
        """Plot the arm in mm at the reference (grey) and at the equilibrium."""
        return cdsm.plots.plot_path([self.reference, self.pose])

    def to_dict(self) -> dict[str, object]:
        """Return posture, tensions and load in SI for JSON, with units in the keys."""
        names = self.pose.arm.cables.names
        numbers = {
            **self.pose._coordinates,
            "tip_displacement_m": self.displacement,
            "tension_N": dict(zip(names, self.tension, strict=True)),
            "reference_tension_N": dict(zip(names, self.reference_tension, strict=True)),
            "force_N": self.wrench[:3],
            "moment_Nm": self.wrench[3:],
            "slack": self.slack,
            "at_limit": self.at_limit,
            "stable": self.stable,
        }
        return plain(numbers)

    def _state(self, cable: Cable, tension: float) -> str:
        if cable.name in self.slack:
            return "slack"
        below = cable.control == "position" and tension < cable.elasticity.rest
        return "on the slack branch of its wire" if below else ""

    def __repr__(self) -> str:
        moved = float(np.linalg.norm(self.displacement)) * 1000.0
        return f"<Equilibrium of {self.pose.arm.name}, tip moved by {moved:.4g} mm>"

    def __str__(self) -> str:
        arm = self.pose.arm
        numbers = zip(arm.cables, self.tension, self.reference_tension, strict=True)
        rows = aligned(
            [("cable", "tension [N]", "reference", "")]
            + [
                (cable.name, f"{F:.3f}", f"{F0:.3f}", self._state(cable, F))
                for cable, F, F0 in numbers
            ]
        )
        rows.append(f"tip moved by {coordinates(without_rounding(1000.0 * self.displacement))} mm")
        rows += [
            f"{name} rests on its stop, which pushes with {self.reaction[i]:.4g} "
            f"{arm.torque_unit(i)}"
            for i, name in enumerate(arm.joint_names)
            if name in self.at_limit
        ]
        state = "stable" if self.stable else "NEUTRAL: not every joint is brought back"
        residual = f"{abs(self.residual).max():.1e} {arm.torque_unit()}"
        return "\n".join([*rows, f"{state}, residual {residual}"])


def eigenvalues(K: Array, free: NDArray[np.intp]) -> Array:
    """Return the eigenvalues (n,) of K's symmetric part, restricted to the joints ``free`` (n,).

    ``free`` are indices of rows and columns of K (nv, nv).
    """
    K = K[np.ix_(free, free)]
    return np.asarray(np.linalg.eigvalsh((K + K.T) / 2.0), dtype=np.float64)
