"""Stiffness of an arm at a posture under given cable tensions.

    K_θ = H_L·F + J_Lᵀ K_L J_L + ∂g/∂θ − ∂(J_Xᵀ W)/∂θ                          (Eq. 16)
          active   passive       gravity   load

The paper maps K_θ to Cartesian space with J_X⁻¹, which does not exist for a redundant arm. "The
stiffness in x" then has three different meanings. Each meaning has a name here:
:meth:`Stiffness.along`, :attr:`Stiffness.cartesian` and :meth:`Stiffness.pseudoinverse`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, cached_property, partial
from typing import TYPE_CHECKING, Literal, final, get_args

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput, SingularStiffness
from cdsm.kernels import readings
from cdsm.kernels.read import read, read_margin
from cdsm.posture import Posture
from cdsm.shares import Shares
from cdsm.support.format import MODEL, coordinates, key, plain
from cdsm.support.markup import element, row
from cdsm.support.tidy import dataset
from cdsm.support.validation import (
    Direction,
    instance,
    one_of,
    unit_direction,
    unit_directions,
    vector,
    wrench_vector,
)
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import Tension

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

    from cdsm.instability import Remedy
    from cdsm.report import Report

Term = Literal["active", "passive", "gravity", "load", "joint"]
Friction = Literal["frictionless", "stuck", "sliding"]

_ORTHOGONAL = 1e-9
"""Largest product of two unit directions that are orthogonal."""

_NO_WRENCH = frozen(np.zeros(6))
_NO_DIRECTIONS = frozen(np.zeros((0, 3)))


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class Stiffness(ReadOnlyState):
    """Joint and Cartesian stiffness with their posture, tensions and wrench.

    Cartesian quantities are at ``tool0`` in base axes. All arrays are read-only.

    Attributes:
        posture: The posture.
        tension: F (C,) [N].
        wrench: W (6,): force [N], then moment [N m].
        cable_stiffness: Diagonal of K_L (C,) [N/m]; 0 for force-controlled cables. It is that of
            the whole cable, without friction.
        active: H_L·F (nv, nv) [N m/rad]; also called geometric.
        passive: J_Lᵀ K_L J_L (nv, nv) [N m/rad]; also called material or elastic. With friction it
            is Σ g_j ∂T_j/∂θ over the segments; it is not symmetric if cables slide.
        gravity: ∂g/∂θ (nv, nv) [N m/rad].
        load: −∂(J_Xᵀ W)/∂θ (nv, nv) [N m/rad]; not symmetric if W has a moment.
        joint: K_θ, sum of the four terms (nv, nv) [N m/rad]: row torque, column angle.
        free_length: l_0 (C,) [m] of an :class:`~cdsm.Equilibrium`, with motors locked at its
            reference posture; None if the motors are locked at this posture.
        distribution: The :class:`~cdsm.Tension` that gave the tensions; None for tensions as an
            array.
        friction: ``"frictionless"``; ``"stuck"``, if the holes with friction hold their cables; or
            ``"sliding"``, if cables slide in some of them.
        segment_tension: T (S,) [N] of the segments of :attr:`Posture.segments`; None if
            frictionless.
        tension_gradient: ∂T/∂θ (S, nv) [N/rad] of these segments; None if frictionless.
    """

    posture: Posture
    tension: Array
    wrench: Array
    cable_stiffness: Array
    active: Array
    passive: Array
    gravity: Array
    load: Array
    joint: Array
    free_length: Array | None = None
    distribution: Tension | None = None
    friction: Friction = "frictionless"
    segment_tension: Array | None = None
    tension_gradient: Array | None = None

    @property
    def free_lengths(self) -> Array:
        """Original lengths l_0 (C,) [m] of the wires, as used in :attr:`cable_stiffness`.

        The locked motors hold l_0 = (L − ΔF/k_series)/(1 + ε(F)). It is negative if the series
        spring stretches by more than the length of the cable. For a force-controlled cable it is L.
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

        If an arm has sliding and turning joints, only its sign is independent of the unit of
        length.
        """
        return read_margin(self.joint)

    @cached_property
    def critical_direction(self) -> Array:
        """Unit joint motion (nv,) of the smallest eigenvalue: the arm buckles along it first."""
        vectors = np.linalg.eigh((self.joint + self.joint.T) / 2.0)[1]
        return frozen(vectors[:, 0].copy())

    @property
    def is_stable(self) -> bool:
        """Whether the symmetric part of K_θ is positive definite."""
        return self.margin > 0.0

    @cached_property
    def compliance(self) -> Array:
        """Compliance C = J_X K_θ⁻¹ J_Xᵀ (6, 6): tip motion per wrench, as the real arm moves.

        Linear rows first: C_vv [m/N], C_vω [m/(N m)] = [rad/N], C_ωω [rad/(N m)].

        Raises:
            SingularStiffness: K_θ is singular: the arm is about to buckle.
        """
        status, found = self._read(self.joint, "compliance")
        self._refuse(status)
        return frozen(found["compliance"].reshape(6, 6))

    @cached_property
    def cartesian(self) -> Array:
        """Matrix (C_vv)⁻¹ (3, 3) [N/m]: force per tip displacement, while the tip may rotate.

        A diagonal entry is the stiffness while the other two translations are *held*. It is never
        less than :meth:`along`, and often several times larger.

        Raises:
            SingularStiffness: K_θ is singular, or the tip hardly moves in one direction. In the
                second case the error names the direction; use :meth:`along` for other directions.
        """
        status, found = self._read(self.joint, "cartesian")
        self._refuse(status, "the Cartesian stiffness matrix")
        return frozen(found["cartesian"].reshape(3, 3))

    def cartesian_in(self, directions: Iterable[Direction]) -> Array:
        """Compute (U C_vv Uᵀ)⁻¹ (n, n) [N/m]: force per tip displacement in a plane or along lines.

        For planar arms, whose tip moves in the plane of U only: their stiffness in this plane.

        Args:
            directions: U, n orthogonal directions in base axes: names as ``("x", "z")``, or (n, 3).

        Raises:
            InvalidInput: The directions are not finite numbers, not orthogonal, or one is zero.
            SingularStiffness: K_θ is singular, or the tip hardly moves in one of the directions.
        """
        U = unit_directions("directions", directions).reshape(-1, 3)
        if abs(U @ U.T - np.eye(len(U))).max() > _ORTHOGONAL:
            raise InvalidInput("directions", "are not orthogonal; give axes of a plane.")
        rows = self.posture.jacobian[:3]
        vectors, moved, _ = np.linalg.svd(U @ rows)
        if moved[-1] <= readings.FLAT * np.linalg.norm(rows, 2):
            u: Array = np.asarray(vectors[:, len(moved) - 1] @ U, dtype=np.float64)
            raise SingularStiffness(f"the tip cannot move along {_line(u)}.", frozen(u))
        inverse = np.linalg.inv(U @ self.compliance[:3, :3] @ U.T)
        return frozen(np.asarray(inverse, dtype=np.float64))

    def along(self, direction: Direction) -> float:
        """Compute 1/(uᵀ C_vv u) [N/m], the tangent stiffness that a tip weight measures (Eq. 20).

        A weight that is not small compared with the tensions measures a secant stiffness. With a
        stiffening wire, the secant can be several times larger: see :func:`~cdsm.weight_test`.

        Args:
            direction: u: an axis such as ``"z"`` or ``"-z"``, or (3,) in base axes, any length.

        Returns:
            The stiffness; inf if the tip cannot move in this direction. It may be negative if the
            arm is unstable: see :attr:`is_stable`.

        Raises:
            InvalidInput: ``direction`` is neither an axis nor three finite numbers, or is zero.
            SingularStiffness: K_θ is singular.
        """
        return self._along(unit_direction("direction", direction))[0]

    def pseudoinverse(self, term: Term = "joint") -> Array:
        """Compute J⁺ᵀ K J⁺ (3, 3) [N/m], J the linear rows of J_X: the paper's K_R, read literally.

        The paper's figures use this formula, but it overestimates stiffness. It is larger than
        :attr:`cartesian` by 4 % to over 100 %, since it allows only the joint motion of least norm.

        Args:
            term: Part of K_θ: ``"active"``, ``"passive"``, ``"gravity"``, ``"load"``, or the sum
                ``"joint"``.

        Raises:
            UnknownName: ``term`` is unknown.
            SingularStiffness: The tip hardly moves in one direction, so J⁺ omits this direction.
        """
        matrix: Array = getattr(self, one_of("stiffness term", term, get_args(Term)))
        status, found = self._read(matrix, "pseudoinverse")
        self._refuse(status, "the pseudo-inverse reading")
        return frozen(found["pseudoinverse"].reshape(3, 3))

    def shares(self, direction: Direction) -> Shares:
        """Compute the contribution of each cable's elasticity and tension to :meth:`along`.

        With the joint motion δθ per unit tip displacement along u, along(u) = δθᵀ K_θ δθ. K_θ is a
        sum over cables, gravity and load.

        Args:
            direction: u: an axis such as ``"z"`` or ``"-z"``, or (3,) in base axes, any length.

        Raises:
            InvalidInput: ``direction`` is neither an axis nor three finite numbers, or is zero.
            SingularStiffness: The stiffness along u is infinite, or K_θ is singular.
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
        """What would hold an unstable arm here, each change alone; empty for a stable arm.

        Wires and series springs made stiffer, other lower bounds of the tensions, other disk
        offsets: for each the factor at which the smallest eigenvalue of K_θ is zero, found by a
        bracketed root. The posture and the wrench stay. Tensions of your own are not distributed
        again: for them only wires and springs are tried. Some tenths of a second.
        """
        from cdsm.instability import find_remedies  # here, since a stable arm does not need it

        return find_remedies(self)

    @property
    def warnings(self) -> tuple[str, ...]:
        """That the arm is UNSTABLE, and what would hold it; empty for a stable arm."""
        from cdsm.instability import advice, verdict

        return () if self.is_stable else (verdict(self), *advice(self))

    def report(self) -> Report:
        """Check this stiffness; return facts, warnings and a second derivation of K_θ.

        The second derivation uses central differences of the potential and the torque at this
        posture. It takes some tenths of a second. Problems are not raised as errors; the report
        lists them.

        Raises:
            InvalidInput: The stiffness is not frictionless.
        """
        from cdsm.report import report_on  # here, since a stiffness does not need it

        return report_on(self.require_frictionless())

    def require_frictionless(self) -> Stiffness:
        """Return this stiffness if it is frictionless.

        Raises:
            InvalidInput: Its cables stick or slide.
        """
        if self.friction != "frictionless":
            raise InvalidInput(
                "stiffness", f"the cables are {self.friction}; give a frictionless K of stiffness."
            )
        return self

    def plot(self) -> Figure:
        """Plot the arm in mm, cables coloured by tension, with the compliance at its tip.

        Raises:
            SingularStiffness: K_θ is singular.
        """
        return self.posture.plot(self.distribution, self)

    def to_dict(self) -> dict[str, object]:
        """Return the stiffness in SI for JSON, with units in the keys; None if it does not exist.

        Three numbers are x, y, z.
        """

        def read(reading: Callable[[], object]) -> object:
            try:
                return reading()
            except SingularStiffness:
                return None

        pose, unit = self.posture, self.posture.arm.stiffness_unit()
        numbers = {
            **pose._coordinates,
            "tip_position_m": pose.tip[:3, 3],
            "tension_N": dict(zip(pose.arm.cables.names, self.tension, strict=True)),
            "cable_length_m": pose.cable_lengths,
            key("static_residual", pose.arm.torque_unit()): self.residual,
            "model": self._model,
            "along_N_per_m": [read(partial(self.along, axis)) for axis in np.eye(3)],
            "cartesian_N_per_m": read(lambda: self.cartesian),
            "pseudoinverse_N_per_m": read(self.pseudoinverse),
            "compliance": read(lambda: self.compliance),
            key("joint_stiffness", unit): self.joint,
            key("margin", unit): self.margin,
            "stable": self.is_stable,
            "remedies": [
                {"change": each.change, "factor": each.factor, "text": str(each)}
                for each in self.remedies
            ],
        }
        return dict(plain(numbers))

    def to_xarray(self) -> xarray.Dataset:
        """Return the terms of K_θ, tensions and cable stiffnesses as a Dataset in SI, labelled.

        Raises:
            MissingExtra: xarray is not installed.
        """
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
        lines = [f"{name:<24}{''.join(f'{cell:>12}' for cell in row)}" for name, *row in self._rows]
        return "\n".join([*self.warnings, *lines, *self._notes])

    def _repr_html_(self) -> str:
        head, *rows = self._rows
        table = element("table", row("th", head), *(row("td", cells) for cells in rows))
        warning = element("pre", "\n".join(self.warnings)) if self.warnings else ""
        return warning + table + "".join(element("p", note) for note in self._notes)

    @property
    def _rows(self) -> list[tuple[str, ...]]:
        """Rows of the printed table: a header, then a name and three numbers per row."""
        axes = np.eye(3)
        shares: Callable[[int], Shares] = cache(lambda i: self.shares(axes[i]))
        lines: dict[str, Callable[[int], float]] = {
            "along": lambda i: self.along(axes[i]),
            "  of it passive": lambda i: shares(i).passive.sum(),
            "  of it active": lambda i: shares(i).active.sum(),
            "  of it gravity": lambda i: shares(i).gravity,
            "  of it load": lambda i: shares(i).load,
            "cartesian, diagonal": self._cartesian_entry,
            "pseudoinverse, diagonal": lambda i: self.pseudoinverse()[i, i],
        }

        def cell(read: Callable[[int], float], i: int) -> str:
            try:
                return f"{read(i) / 1000.0:.4g}"
            except SingularStiffness:
                return "-"

        return [
            ("stiffness [N/mm]", "x", "y", "z"),
            *((name, *(cell(read, i) for i in range(3))) for name, read in lines.items()),
        ]

    def _cartesian_entry(self, i: int) -> float:
        """Return a diagonal entry of ``cartesian``, or of that of the axes that can move [N/m]."""
        try:
            return float(self.cartesian[i, i])
        except SingularStiffness:
            mobile = [axis for axis in range(3) if math.isfinite(self.along(np.eye(3)[axis]))]
            if i not in mobile:
                raise
            matrix = self.cartesian_in(np.eye(3)[mobile])
            return float(matrix[mobile.index(i), mobile.index(i)])

    @property
    def _notes(self) -> tuple[str, ...]:
        """Lines below the printed table: why entries are missing; whether the arm is stable."""
        try:
            _ = self.cartesian
            missing = []
        except SingularStiffness as error:
            u = _line(error.direction)
            missing = [
                f"inf, -: the tip cannot move along {u}; cartesian: in the plane of other axes"
                if error.direction.size == 3
                else "-: K_θ is singular, the arm is about to buckle"
            ]
        state = "stable" if self.is_stable else "UNSTABLE"
        unit = self.posture.arm.stiffness_unit()
        least = f"smallest joint stiffness {self.margin:.4g} {unit} ({self._model})"
        return (*missing, f"{state}, {least}")

    @property
    def _model(self) -> str:
        """Assumptions of this stiffness, in words."""
        if self.friction == "frictionless":
            return MODEL
        values = self.posture.segments.chains.friction
        low, high = values.min(initial=math.inf), values.max(initial=0.0)
        mu = f"{low:g}" if low == high else f"{low:g} to {high:g}"
        return MODEL.replace("frictionless", f"cables {self.friction}, μ = {mu}")

    def _require_mobile(self, u: Array) -> None:
        """Raise SingularStiffness if a force along a unit direction u (3,) moves no joint."""
        rows = self.posture.jacobian[:3]
        if not abs(u @ rows).max() > readings.UNMOVED * abs(rows).max():
            raise SingularStiffness(
                f"the tip cannot move along {coordinates(u)}: the stiffness there "
                "is infinite under any tension. Choose another direction, or bend the arm.",
                u,
            )

    def _along(self, u: Array) -> tuple[float, Array]:
        """Return stiffness along a unit direction [N/m] and joint motion per unit force (nv,)."""
        status, found = self._read(self.joint, "along", u[None])
        stiffness = float(found["along"][0, 0, 0])
        if math.isnan(stiffness):
            self._refuse(status)
        return stiffness, found["motion"][0, :, 0, 0]

    @cached_property
    def _parts(self) -> Array:
        """Sum of the magnitudes of the four terms (nv, nv) [N m/rad]."""
        parts = abs(self.active) + abs(self.passive) + abs(self.gravity) + abs(self.load)
        return frozen(parts)

    def _read(
        self, matrix: Array, name: str, directions: Array = _NO_DIRECTIONS
    ) -> tuple[int, dict[str, Array]]:
        """Return the status and a reading of K_θ, or of one of its terms."""
        status = np.full((1, 1), readings.READ)
        K, parts, JX = (
            each[None, :, :, None] for each in (matrix, self._parts, self.posture.jacobian)
        )
        found = read(K, parts, JX, directions, (name,), status, None)
        return int(status[0, 0]), found

    def _refuse(self, status: int, what: str = "") -> None:
        """Raise an error if a reading does not exist; a named reading also needs a mobile tip."""
        if status == readings.READ:
            return
        if what and self._read(self.joint, "pseudoinverse")[0] == readings.IMMOBILE:
            u = frozen(np.linalg.svd(self.posture.jacobian[:3])[0][:, 2].copy())
            raise SingularStiffness(
                f"{what} does not exist: the tip cannot move along {coordinates(u)}, where the "
                "stiffness is infinite or nearly so. Use along(direction), or bend the arm.",
                u,
            )
        held = self._parts.diagonal()
        if not held.min() > 0.0:
            why, motion = "next to nothing holds the arm", np.eye(held.size)[held.argmin()]
        else:
            unit = np.sqrt(held)
            why = "the arm is just about to buckle"
            motion = np.linalg.svd(self.joint / unit / unit[:, None])[2][-1] / unit
        motion = frozen(motion / np.linalg.norm(motion))
        raise SingularStiffness(
            f"K_θ is singular: {why} in the joint motion {coordinates(motion)}. Change the "
            "tensions or the posture.",
            motion,
        )


def stiffness(
    pose: Posture, tension: Tension | ArrayLike, wrench: ArrayLike | None = None
) -> Stiffness:
    """Compute the joint stiffness with its four terms (Eq. 16), and the Cartesian stiffness.

    Args:
        pose: The posture.
        tension: The result of :func:`~cdsm.distribute_tension` at this posture, or your own
            tensions (C,) [N], not negative. These may be out of balance; see
            :attr:`Stiffness.residual`.
        wrench: W (6,) at ``tool0`` in base axes: force [N], then moment [N m]; default zero. Only
            for your own tensions, since a :class:`~cdsm.Tension` has its own wrench.

    Raises:
        InvalidInput: An argument has the wrong shape or is not numbers, a tension is negative, the
            tensions are of another posture, or a wrench is given with a ``Tension``.
        ElasticityRangeError: A tension is outside the domain of its cable's elasticity.
    """
    F, W = checked_tension(pose, tension, wrench)
    k = pose.arm._model.laws.stiffness(pose.cable_lengths, F)
    return assemble(pose, F, W, k, tension if isinstance(tension, Tension) else None)


def checked_tension(
    pose: Posture, tension: Tension | ArrayLike, wrench: ArrayLike | None
) -> tuple[Array, Array]:
    """Check the arguments of :func:`stiffness`; return F (C,) [N] and W (6,)."""
    arm = instance("pose", pose, Posture).arm
    if isinstance(tension, Tension):
        if not tension.posture._equals(pose):
            raise InvalidInput(
                "tension", "was distributed at another posture; distribute it at this one."
            )
        if wrench is not None:
            raise InvalidInput("wrench", "comes with the Tension; leave it out here.")
        F, W = tension.values, tension.wrench
    else:
        F = vector("tension", tension, len(arm.cables), "one tension [N] per cable", "tension")
        W = _NO_WRENCH if wrench is None else wrench_vector("wrench", wrench)
        if np.count_nonzero(F < 0.0):
            c = int(F.argmin())
            raise InvalidInput(
                "tension", f"{F[c]:g} N given for {arm.cables[c].name}; cables only pull."
            )
    return F, W


def _line(u: Array) -> str:
    """Format a direction (3,) whose sign does not matter: its largest entry is positive."""
    return coordinates(np.round(u * np.sign(u[abs(u).argmax()]), 9), "z.3g")


def assemble(
    pose: Posture,
    tension: Array,
    wrench: Array,
    cable_stiffness: Array,
    distribution: Tension | None = None,
    free_length: Array | None = None,
) -> Stiffness:
    """Compute K_θ from checked, read-only tensions, wrench and cable stiffnesses (Eq. 16)."""
    active, passive, load, joint = pose._joint_stiffness(tension, cable_stiffness, wrench)
    return Stiffness(
        posture=pose,
        tension=tension,
        wrench=wrench,
        cable_stiffness=cable_stiffness,
        active=active,
        passive=passive,
        gravity=pose.gravity_stiffness,
        load=load,
        joint=joint,
        free_length=free_length,
        distribution=distribution,
    )
