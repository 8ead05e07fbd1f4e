"""The stiffness of an arm as a frozen value: K_θ with its four terms."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Literal, final

import numpy as np

from cdsm.errors import InvalidInput
from cdsm.stiffness_matrix import prints
from cdsm.stiffness_matrix.cartesian import CartesianReadings
from cdsm.stiffness_matrix.instability import Remedy, find_remedies, verdict
from cdsm.stiffness_matrix.shares import Shares
from cdsm.support.directions import Direction, unit_direction
from cdsm.support.format import plain
from cdsm.support.result import quantity, unit
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdsm.report import Report

Friction = Literal["frictionless", "stuck", "sliding"]


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Stiffness(CartesianReadings):
    """Joint stiffness and Cartesian stiffness (at ``tool0``, base axes) with all they depend on.

    Attributes:
        posture: The posture.
        active: H_L·F (nv, nv) [N m/rad]; also called geometric.
        passive: J_Lᵀ K_L J_L (nv, nv) [N m/rad]; also called material or elastic. With friction it
            is Σ_j (∂l_j/∂θ)ᵀ ∂T_j/∂θ over the cable segments j, not symmetric if cables slide.
        gravity: ∂g/∂θ (nv, nv) [N m/rad].
        load: −∂(J_Xᵀ W)/∂θ (nv, nv) [N m/rad]; not symmetric if W has a moment.
        joint: K_θ, sum of the four terms (nv, nv) [N m/rad]: row torque, column angle.
        tension: F (C,) [N].
        wrench: W (6,): force [N], then moment [N m].
        cable_stiffness: Diagonal of K_L (C,) [N/m], of cables without friction; 0 for
            force-controlled ones.
        free_length: l_0 (C,) [m] held since another posture; None if motors are locked at this one.
        distribution: The :class:`~cdsm.Tension` that gave the tensions; None for your own.
        friction: ``"frictionless"``; ``"stuck"``: the cables stick in all holes with friction;
            ``"sliding"``: they slide in some of them.
        segment_tension: T (S,) [N] of :attr:`Posture.segments`; None if frictionless.
        tension_gradient: ∂T/∂θ (S, nv) [N/rad] of these segments; None if frictionless.
    """

    _headline, _rows = "margin", "cable"

    tension: Array = field(metadata=unit("N", "cable"))
    wrench: Array = field(metadata=unit("N and N m", "component"))
    cable_stiffness: Array = field(metadata=unit("N/m", "cable"))
    free_length: Array | None = None
    distribution: Tension | None = None
    friction: Friction = "frictionless"
    segment_tension: Array | None = None
    tension_gradient: Array | None = None

    @property
    def free_lengths(self) -> Array:
        """Original lengths l_0 (C,) [m] of the wires, see :class:`Cable`; L if force-controlled."""
        laws, L = self.posture.arm._laws, self.posture.cable_lengths
        l_0 = self.free_length
        return laws.original_lengths(L, self.tension) if l_0 is None else l_0

    @quantity("torque", "joint")
    def residual(self) -> Array:
        """J_Lᵀ F − (J_Xᵀ W − g) (nv,) [N m]; zero if the tensions balance the arm (Eq. 13)."""
        pose, F, J = self.posture, self.tension, self.posture.length_jacobian
        if self.segment_tension is not None:
            F, J = self.segment_tension, pose.segments.length_jacobian
        return frozen(F @ J - self.wrench @ pose.jacobian + pose.gravity_torque)

    @quantity("joint stiffness")
    def margin(self) -> float:
        """Smallest eigenvalue of the symmetric part of K_θ [N m/rad]; if negative, the arm buckles.

        With prismatic and revolute joints, the value depends on the unit of length, not its sign.
        """
        return float(np.linalg.eigvalsh((self.joint + self.joint.T) / 2.0)[0])

    @cached_property
    def critical_direction(self) -> Array:
        """Unit eigenvector (nv,) of the smallest eigenvalue: the joint motion of buckling."""
        return frozen(np.linalg.eigh((self.joint + self.joint.T) / 2.0)[1][:, 0].copy())

    @property
    def is_stable(self) -> bool:
        """Whether the symmetric part of K_θ is positive definite."""
        return self.margin > 0.0

    def shares(self, direction: Direction) -> Shares:
        """Compute the contribution of each cable's elasticity and tension to :meth:`along`.

        If δθ is the joint motion per unit tip displacement along u, along(u) = δθᵀ K_θ δθ. K_θ is a
        sum over cables, gravity and load, and so is along(u). SingularStiffness also if it is inf.
        """
        u = unit_direction("direction", direction)
        self._require_mobile(u)
        stiffness, moved = self._along(u)
        pose, motion = self.posture, moved * stiffness
        if self.segment_tension is None or self.tension_gradient is None:
            passive = self.cable_stiffness * (pose.length_jacobian @ motion) ** 2
            active = self.tension * (pose.length_hessian @ motion @ motion)
        else:
            of = pose.segments
            each = (of.length_jacobian @ motion) * (self.tension_gradient @ motion)
            passive = np.bincount(of.chains.cable, each).astype(np.float64)
            active = of.tension_stiffness(self.segment_tension) @ motion @ motion
        return Shares(
            stiffness=self,
            direction=u,
            passive=frozen(passive),
            active=frozen(active),
            gravity=float(motion @ self.gravity @ motion),
            load=float(motion @ self.load @ motion),
        )

    @cached_property
    def remedies(self) -> tuple[Remedy, ...]:
        """Changes that would make an unstable arm stable, each alone; empty for a stable arm.

        Stiffer wires, stiffer springs and, of distributed tensions, other lower bounds are tried at
        the same posture and wrench. This takes a few tenths of a second.
        """
        return () if self.is_stable else tuple(find_remedies(self))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Lines that say that the arm is UNSTABLE, with its remedies; empty for a stable arm."""
        return () if self.is_stable else (verdict(self), *map(str, self.remedies))

    def report(self) -> Report:
        """Check this frictionless stiffness: is it right, balanced, stable, and how to read it."""
        from cdsm.report import report_on  # the layer above

        return report_on(self.require_frictionless())

    def require_frictionless(self) -> Stiffness:
        """Return this stiffness; InvalidInput if its cables stick or slide."""
        if self.friction != "frictionless":
            raise InvalidInput("stiffness", f"cables are {self.friction}; give a frictionless K.")
        return self

    def plot(self) -> Figure:
        """Plot the arm in mm and, if it is stable, the compliance at its tip as an ellipsoid.

        Cables are coloured by tension if :attr:`distribution` is given.
        """
        return self.posture.plot(self.distribution, self)

    def to_dict(self) -> dict[str, object]:
        """Return the stiffness in SI for JSON, units in the keys; None for what does not exist."""
        more = {
            "tip_position_m": self.posture.tip[:3, 3],
            "cable_length_m": self.posture.cable_lengths,
            "model": prints.model_of(self),
            "along_N_per_m": [prints.existing(partial(self.along, u)) for u in "xyz"],
            "cartesian_N_per_m": prints.existing(lambda: self.cartesian),
            "pseudoinverse_N_per_m": prints.existing(self.pseudoinverse),
            "compliance": prints.existing(lambda: self.compliance),
            "stable": self.is_stable,
            "remedies": {each.change: each.factor for each in self.remedies},
        }
        return super().to_dict() | plain(more)

    def __str__(self) -> str:
        return "\n".join([*self.warnings, *prints.table(self), *prints.notes(self)])
