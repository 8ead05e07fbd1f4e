"""The stiffness of an arm as a frozen value: K_θ with its four terms."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal, final, get_args

import numpy as np

from cdsm.errors import InvalidInput
from cdsm.kernels.read import read_margin
from cdsm.stiffness_matrix import prints
from cdsm.stiffness_matrix.cartesian import CartesianReadings, Term
from cdsm.stiffness_matrix.instability import Remedy, advice, find_remedies, verdict
from cdsm.stiffness_matrix.shares import Shares
from cdsm.support.directions import Direction, unit_direction
from cdsm.support.markup import element, row
from cdsm.support.tidy import dataset
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from cdsm.report import Report

Friction = Literal["frictionless", "stuck", "sliding"]


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Stiffness(CartesianReadings):
    """Joint and Cartesian stiffness with their posture, tensions and wrench.

    Cartesian quantities are at ``tool0`` in base axes. All arrays are read-only.

    Attributes:
        posture: The posture.
        tension: F (C,) [N].
        wrench: W (6,): force [N], then moment [N m].
        cable_stiffness: Diagonal of K_L (C,) [N/m]; 0 for force-controlled cables. Even with
            friction, it is the stiffness of whole cables that slide freely.
        active: H_L·F (nv, nv) [N m/rad]; also called geometric.
        passive: J_Lᵀ K_L J_L (nv, nv) [N m/rad]; also called material or elastic. With friction it
            is Σ_j (∂l_j/∂θ)ᵀ ∂T_j/∂θ over the segments j of length l_j and tension T_j; it is not
            symmetric if cables slide.
        gravity: ∂g/∂θ (nv, nv) [N m/rad].
        load: −∂(J_Xᵀ W)/∂θ (nv, nv) [N m/rad]; not symmetric if W has a moment.
        joint: K_θ, sum of the four terms (nv, nv) [N m/rad]: row torque, column angle.
        free_length: l_0 (C,) [m] of an :class:`~cdsm.Equilibrium`, with motors locked at its
            reference posture; None if the motors are locked at this posture.
        distribution: The :class:`~cdsm.Tension` that gave the tensions; None for tensions as an
            array.
        friction: ``"frictionless"``; ``"stuck"``: the cables stick in all holes with friction;
            ``"sliding"``: they slide in some of them.
        segment_tension: T (S,) [N] of the segments of :attr:`Posture.segments`; None if
            frictionless.
        tension_gradient: ∂T/∂θ (S, nv) [N/rad] of these segments; None if frictionless.
    """

    tension: Array
    wrench: Array
    cable_stiffness: Array
    free_length: Array | None = None
    distribution: Tension | None = None
    friction: Friction = "frictionless"
    segment_tension: Array | None = None
    tension_gradient: Array | None = None

    @property
    def free_lengths(self) -> Array:
        """Original lengths l_0 (C,) [m] of the wires, as used in :attr:`cable_stiffness`.

        A locked motor keeps l_0 = (L − ΔF/k_series)/(1 + ε(F)) constant; :class:`Cable` explains
        the symbols. For a force-controlled cable l_0 is its length L. l_0 is negative if the series
        spring stretches by more than the length of the cable; ``print`` says so.
        """
        if self.free_length is not None:
            return self.free_length
        pose = self.posture
        return pose.arm._model.laws.original_lengths(pose.cable_lengths, self.tension)

    @cached_property
    def residual(self) -> Array:
        """J_Lᵀ F − (J_Xᵀ W − g) (nv,) [N m]; zero if the tensions balance the arm (Eq. 13)."""
        pose = self.posture
        if self.segment_tension is None:
            cables = self.tension @ pose.length_jacobian
        else:
            cables = self.segment_tension @ pose.segments.length_jacobian
        return frozen(cables - self.wrench @ pose.jacobian + pose.gravity_torque)

    @cached_property
    def margin(self) -> float:
        """Smallest eigenvalue of the symmetric part of K_θ [N m/rad]; if negative, the arm buckles.

        If an arm has both prismatic and revolute joints, the value depends on the unit of length;
        its sign does not.
        """
        return read_margin(self.joint)

    @cached_property
    def critical_direction(self) -> Array:
        """Unit eigenvector (nv,) of the smallest eigenvalue: the joint motion of buckling."""
        vectors = np.linalg.eigh((self.joint + self.joint.T) / 2.0)[1]
        return frozen(vectors[:, 0].copy())

    @property
    def is_stable(self) -> bool:
        """Whether the symmetric part of K_θ is positive definite."""
        return self.margin > 0.0

    def shares(self, direction: Direction) -> Shares:
        """Compute the contribution of each cable's elasticity and tension to :meth:`along`.

        If δθ is the joint motion per unit tip displacement along u, along(u) = δθᵀ K_θ δθ. K_θ is a
        sum over cables, gravity and load, and so is along(u). ``direction`` is u, an axis or (3,),
        as for :meth:`along`. Raises the errors of :meth:`along`, and SingularStiffness also if the
        stiffness along u is infinite.
        """
        u = unit_direction("direction", direction)
        self._require_mobile(u)
        stiffness, motion = self._along(u)
        motion = motion * stiffness
        pose = self.posture
        if self.segment_tension is None or self.tension_gradient is None:
            passive = self.cable_stiffness * (pose.length_jacobian @ motion) ** 2
            active = self.tension * (pose.length_hessian @ motion @ motion)
        else:
            segments = pose.segments
            each = (segments.length_jacobian @ motion) * (self.tension_gradient @ motion)
            passive = np.asarray(np.bincount(segments.chains.cable, each), dtype=np.float64)
            active = segments.tension_stiffness(self.segment_tension) @ motion @ motion
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

        Stiffer wires, stiffer series springs, other lower bounds of the tensions and other disk
        offsets are tried. For each, a root search finds the factor at which the smallest eigenvalue
        of K_θ is zero. The posture and the wrench stay the same. Tensions of your own are not
        distributed again: for them only wires and springs are tried. This takes a few tenths of a
        second.
        """
        return () if self.is_stable else tuple(find_remedies(self))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Lines that say that the arm is UNSTABLE, with its remedies; empty for a stable arm."""
        return () if self.is_stable else (verdict(self), *advice(self))

    def report(self) -> Report:
        """Check this stiffness: is it right, balanced and stable, and how to read it.

        Each term is compared with finite differences and with :func:`evaluate`. Problems are not
        raised as errors; the report lists them.

        Raises:
            InvalidInput: The stiffness is not frictionless.
        """
        from cdsm.report import report_on  # here, since a stiffness does not need it

        return report_on(self.require_frictionless())

    def require_frictionless(self) -> Stiffness:
        """Return this stiffness; InvalidInput if its cables stick or slide."""
        if self.friction != "frictionless":
            raise InvalidInput(
                "stiffness", f"the cables are {self.friction}; give a frictionless K of stiffness."
            )
        return self

    def plot(self) -> Figure:
        """Plot the arm in mm and, if it is stable, the compliance at its tip as an ellipsoid.

        Cables are coloured by tension if :attr:`distribution` is given.

        Raises:
            SingularStiffness: K_θ is singular.
        """
        return self.posture.plot(self.distribution, self)

    def to_dict(self) -> dict[str, object]:
        """Return the stiffness in SI for JSON, with units in the keys.

        Lists of three numbers are for x, y and z. A number that does not exist is None.
        """
        return prints.numbers(self)

    def to_xarray(self) -> xarray.Dataset:
        """Return K_θ, its terms, F and k as a labelled Dataset; needs xarray (MissingExtra)."""
        arm, square = self.posture.arm, ("joint", "joint_column")
        unit = arm.stiffness_unit()
        terms = {name: (square, getattr(self, name), unit) for name in get_args(Term)}
        # a variable must not have the name of a dimension
        terms["joint_stiffness"] = terms.pop("joint")
        of_cables = {
            "tension": (("cable",), self.tension, "N"),
            "cable_stiffness": (("cable",), self.cable_stiffness, "N/m"),
        }
        labels = {"cable": arm.cables.names, **dict.fromkeys(square, arm.joint_names)}
        return dataset({**terms, **of_cables}, labels, title=f"stiffness of {arm.name}")

    def __repr__(self) -> str:
        state = "stable" if self.is_stable else "UNSTABLE"
        return f"<Stiffness of {self.posture.arm.name}, {state}>"

    def __str__(self) -> str:
        rows = prints.table(self)
        lines = [f"{name:<24}{''.join(f'{cell:>12}' for cell in cells)}" for name, *cells in rows]
        return "\n".join([*self.warnings, *lines, *prints.notes(self)])

    def _repr_html_(self) -> str:
        head, *rows = prints.table(self)
        table = element("table", row("th", head), *(row("td", cells) for cells in rows))
        warning = element("pre", "\n".join(self.warnings)) if self.warnings else ""
        return warning + table + "".join(element("p", note) for note in prints.notes(self))
