"""The stiffness of an arm as a frozen value: K_θ with its terms, and the readings at the tip.

The paper maps K_θ to Cartesian space with J_X⁻¹, which does not exist for a redundant arm. "The
stiffness in x" then has three meanings, each with a name here: along, cartesian, pseudoinverse.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm import readings
from cdsm.applied import Applied, Loaded, jacobian_at, required_torque
from cdsm.errors import InvalidInput, SingularStiffness, listed
from cdsm.load_texts import described
from cdsm.loads import link_point
from cdsm.posture import Posture
from cdsm.stiffness_matrix import prints
from cdsm.stiffness_matrix.report import Report
from cdsm.stiffness_matrix.shares import Shares
from cdsm.stiffness_matrix.spatial import (
    SpatialStiffness,
    frame_name,
    invert_scaled,
    require_six_motions,
    transform,
)
from cdsm.stiffness_matrix.verdict import Verdict, describe_buckling, judge_stiffness
from cdsm.support.format import coordinates, merged, prepare_json
from cdsm.support.result import Result, quantity, tabulated, unit_of
from cdsm.support.validation import Direction, one_of, unit_direction, unit_directions
from cdsm.support.values import Array, frozen
from cdsm.tension import Tension
from cdsm.terms import CABLE_TERMS, passive_stiffness
from cdsm.yielding import Yielding

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FrictionState = Literal["frictionless", "stuck", "sliding"]
Joints = slice | NDArray[np.intp]

_ORTHOGONAL = 1e-9  # largest product of two unit directions that are orthogonal


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Stiffness(Result, Loaded):
    """Joint stiffness and Cartesian stiffness (at ``tool0``, base axes) with all they depend on.

    `K_θ` is singular, and SingularStiffness raised, if the smallest singular value of
    `D^-½ K_θ D^-½` is at most 1e-8 of the largest entry of `D^-½ P D^-½`. P is the sum of the
    magnitudes of the terms, which may cancel; its diagonal D makes the test free of units.

    Attributes:
        posture: The posture.
        terms: The terms of `K_θ` by name, in the order of Eq. 16, each (nv, nv) [N m/rad]: active,
            passive, gravity, load, springs, and those of :meth:`Manipulator.with_terms`.
        joint: `K_θ`, sum of the terms (nv, nv) [N m/rad]: row torque, column angle.
        tension: F (C,) [N].
        applied: What acts: W (6,) at the tip, or loads on links.
        cable_stiffness: Diagonal of `K_L` (C,) [N/m], of cables without friction and without their
            motors; 0 for force-controlled ones.
        free_length: `l_0` (C,) [m] held since another posture; None if motors are locked at this
            one.
        distribution: The :class:`~cdsm.Tension` that gave the tensions; None for your own.
        friction: ``"frictionless"``; ``"stuck"``: the cables stick in all holes with friction;
            ``"sliding"``: they slide in some of them.
        segment_tension: T (S,) [N] of :attr:`Posture.segments`; None if frictionless.
        tension_gradient: `∂T/∂θ` (S, nv) [N/rad] of these segments; None if frictionless.

    Example:
        >>> import cdsm
        >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
        >>> K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0))
        >>> f"{1e-3 * K.along('z'):.3f} N/mm, softest joint motion {K.margin:.3f} N m/rad"
        '2.105 N/mm, softest joint motion 2.526 N m/rad'
    """

    _headline = "margin"
    _rows = "cable"

    posture: Posture
    terms: Mapping[str, Array]
    joint: Array = field(metadata=unit_of("joint_stiffness"))
    tension: Array = field(metadata=unit_of("tension"))
    applied: Applied
    cable_stiffness: Array = field(metadata=unit_of("cable_stiffness"))
    free_length: Array | None = None
    distribution: Tension | None = None
    friction: FrictionState = "frictionless"
    segment_tension: Array | None = None
    tension_gradient: Array | None = None

    @tabulated
    def active(self) -> Array:
        """`H_L·F` (nv, nv) [N m/rad]; also called geometric."""
        return self.terms["active"]

    @tabulated
    def passive(self) -> Array:
        """`J_Lᵀ K_L J_L` (nv, nv) [N m/rad]; also called material or elastic.

        Where motors yield, :attr:`wire_stiffness` is in the place of `K_L`. With friction it is
        `Σ_j (∂l_j/∂θ)ᵀ ∂T_j/∂θ` over the cable segments j, not symmetric if cables slide.
        """
        return self.terms["passive"]

    @tabulated
    def gravity(self) -> Array:
        """`∂g/∂θ` (nv, nv) [N m/rad]."""
        return self.terms["gravity"]

    @tabulated
    def load(self) -> Array:
        """`−∂(J_Xᵀ W)/∂θ` (nv, nv) [N m/rad]; not symmetric if W has a moment."""
        return self.terms["load"]

    @tabulated
    def springs(self) -> Array:
        """Of the joint springs (nv, nv) [N m/rad]: diag k, or `Sᵀ diag k S` of coupled joints."""
        return self.terms["springs"]

    @property
    def motor_compliance(self) -> Array:
        """`B k_m⁻¹ Bᵀ` (C, C) [m/N]: how much longer the motors make the cables per tension.

        It is 0 for rigid motors, and ±inf between cables of a motor that holds its torque.
        """
        return self.posture.arm.motors.compliance

    @cached_property
    def wire_stiffness(self) -> Array:
        """`K_eff = (K_L⁻¹ + B k_m⁻¹ Bᵀ)⁻¹` (C, C) [N/m]: tensions per elongation of the cables.

        It is diag k of :attr:`cable_stiffness` if no motor yields.
        """
        if self._yielding is None:
            return frozen(np.diag(self.cable_stiffness))
        return frozen(self._yielding.effective(self.cable_stiffness))

    @property
    def _yielding(self) -> Yielding | None:
        return self.posture.arm.motors.yielding

    @property
    def free_lengths(self) -> Array:
        """Original lengths `l_0` (C,) [m] of the wires (:class:`Cable`); L if force-controlled."""
        laws = self.posture.arm.laws
        L = self.posture.cable_lengths
        l_0 = self.free_length
        return laws.original_lengths(L, self.tension) if l_0 is None else l_0

    @tabulated
    def residual(self) -> Array:
        """`J_Lᵀ F − (J_Xᵀ W − g) + k (q − q_0)` (nv,) [N m]; zero if the arm is in balance."""
        pose = self.posture
        F = self.tension
        J = self.posture.length_jacobian
        if self.segment_tension is not None:
            F = self.segment_tension
            J = pose.segments.length_jacobian
        return frozen(F @ J - required_torque(pose, self.applied))

    @tabulated
    def margin(self) -> float:
        """Smallest eigenvalue of the symmetric part of `K_θ` [N m/rad]; below 0 the arm buckles.

        With prismatic and revolute joints, the value depends on the unit of length, not its sign.
        """
        return float(readings.margin(self.joint))

    @cached_property
    def critical_direction(self) -> Array:
        """Unit eigenvector (nv,) of the smallest eigenvalue: the joint motion of buckling."""
        return frozen(np.linalg.eigh((self.joint + self.joint.T) / 2.0)[1][:, 0].copy())

    @property
    def is_stable(self) -> bool:
        """Whether the symmetric part of `K_θ` is positive definite.

        Where cables slide it is enough that all eigenvalues of `K_θ` have positive real parts;
        ``warnings`` say so.
        """
        if self.friction == "sliding" and self.margin <= 0.0:
            return readings.least_real_part(self.joint)[0] > 0.0
        return self.margin > 0.0

    @quantity("1")
    def slack(self) -> tuple[str, ...]:
        """Names of the cables at 0 N that have a stiffness: they resist only what stretches them.

        0 N is a tension below 1e-9 of the largest one. :meth:`along` and :meth:`shares` let these
        cables pull or hang loose; `K_θ` and all that follows from it count them as taut.
        """
        return tuple(self.posture.arm.cables.names[c] for c in np.flatnonzero(self._slack))

    @cached_property
    def without_slack(self) -> Array:
        """`K_θ` without the stiffness of the cables at 0 N (nv, nv) [N m/rad]."""
        J = self.posture.length_jacobian
        k = np.where(self._slack, self.cable_stiffness, 0.0)
        if self._yielding is None:
            return frozen(readings.remove_cables(self.joint, J, k))
        taut = passive_stiffness(J, self.cable_stiffness - k, self._yielding)
        return frozen(self.joint - self.passive + taut)

    @property
    def margin_without_slack(self) -> float:
        """Smallest eigenvalue of the symmetric part of :attr:`without_slack` [N m/rad].

        If it is negative, the arm is unstable to one side: it can leave without stretching them.
        """
        return float(readings.margin(self.without_slack))

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the arm is stable and in balance, in one word, and what qualifies it."""
        return judge_stiffness(self)

    def loose(self, motion: Array) -> NDArray[np.bool_]:
        """Return which cables at 0 N a motion (nv,) of the joints does not stretch (C,)."""
        J = self.posture.length_jacobian
        if self._yielding is None or not self.slack:
            return readings.loose_cables(J, self._slack, motion)
        turn = self._yielding.turns_for(J @ motion, self.cable_stiffness, self._slack)
        both = np.concatenate([J, self._yielding.matrix], axis=1)
        return readings.loose_cables(both, self._slack, np.append(motion, turn))

    @cached_property
    def _slack(self) -> NDArray[np.bool_]:
        """Which cables are at 0 N and have a stiffness (C,)."""
        return readings.slack_cables(self.tension, self.cable_stiffness)

    @cached_property
    def compliance(self) -> Array:
        """Compliance `C = J_X K_θ⁻¹ J_Xᵀ` (6, 6): tip motion per wrench at the tip.

        Linear rows first: `C_vv` [m/N], `C_vω` [m/(N m)] = [rad/N], `C_ωω` [rad/(N m)].
        """
        return frozen(readings.compliance(self._inverse, self.posture.jacobian))

    def compliance_at(self, frame: str = "base", at: str | ArrayLike = "tip") -> Array:
        """Compute the compliance `T C Tᵀ` (6, 6) in another frame and at another point of the tip.

        T is the 6 × 6 of the lever from the tip to the point, turned into the axes of the frame.

        Args:
            frame: ``"base"``, or a link, whose axes the rows and columns have.
            at: ``"tip"``, a link, whose origin is the point, or a point (3,) [m] from the base's
                origin in base axes. The point moves as if it were fixed to the tip.

        Raises:
            InvalidInput: There is no such link, or ``at`` is not (3,).
            SingularStiffness: `K_θ` is singular.

        Example:
            >>> import cdsm
            >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
            >>> K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0))
            >>> f"{1.0 / K.compliance_at()[2, 2]:.1f} N/m"
            '2104.8 N/m'
        """
        T, _ = transform(self.posture, frame_name(frame), at)
        return frozen(T @ self.compliance @ T.T)

    def spatial(self, frame: str = "base", at: str | ArrayLike = "tip") -> SpatialStiffness:
        """Compute the stiffness of the tip as a matrix (6, 6) in a frame and at a point.

        It is the inverse of :meth:`compliance_at`, which explains the arguments; ``np.asarray`` of
        the result is the matrix.

        Raises:
            InvalidInput: There is no such link, or ``at`` is not (3,).
            SingularStiffness: `K_θ` is singular, or the tip lacks one of its six motions, which the
                error names. Rank is judged at 1e-9 with the arm's length as lever.

        Example:
            >>> import cdsm
            >>> import numpy as np
            >>> pose = cdsm.presets.virtual_prototype().at(np.linspace(-0.1, 0.2, 10))
            >>> K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0))
            >>> np.asarray(K.spatial(frame="link5", at="tip"))[:3, :3].round(-2)
            array([[ 519500., -146100.,  139000.],
                   [-146100.,   64000.,  -32100.],
                   [ 139000.,  -32100.,   46600.]])
        """
        T, point = transform(self.posture, frame_name(frame), at)
        require_six_motions(self.posture)
        tip = invert_scaled(self.compliance, self.posture.arm.length)
        T_inverse = np.linalg.inv(T)
        return SpatialStiffness(
            posture=self.posture,
            frame=frame,
            point=point,
            stiffness=frozen(T_inverse.T @ tip @ T_inverse),
            compliance=self.compliance_at(frame, at),
        )

    @cached_property
    def cartesian(self) -> Array:
        """Matrix `(C_vv)⁻¹` (3, 3) [N/m]: force per tip displacement, with the tip free to rotate.

        A diagonal entry is the stiffness if the other two translations are *locked*. For a stable
        arm it is never less than :meth:`along` that axis, and often several times larger.
        SingularStiffness also if the tip hardly moves in some direction.
        """
        return self._cartesian_in(None)

    def cartesian_in(self, directions: Iterable[Direction]) -> Array:
        """Compute `(U C_vv Uᵀ)⁻¹` (n, n) [N/m]: force per tip displacement in some directions only.

        Use it for planar arms: their tip cannot leave a plane, so :attr:`cartesian` does not exist.
        U are n orthogonal directions in base axes: names as ``("x", "z")``, or (n, 3); InvalidInput
        if they are not. SingularStiffness also if the tip hardly moves in one of the directions.
        """
        U = unit_directions("directions", directions).reshape(-1, 3)
        if abs(U @ U.T - np.eye(len(U))).max() > _ORTHOGONAL:
            raise InvalidInput("directions", "are not orthogonal; give axes of a plane.")
        return self._cartesian_in(U)

    def along(
        self, direction: Direction, link: str | None = None, point: ArrayLike | None = None
    ) -> float:
        """Compute the tangent stiffness [N/m] that a small force along +u measures (Eq. 20).

        It is `1/(uᵀ C_vv u)`. Cables at 0 N (:attr:`slack`) only add tension: the stiffness is then
        `1/(τᵀ x)`, in which the joint motion x has the least energy
        `½ xᵀ K_0 x + ½ Σ k_c max(J_c x, 0)² − τᵀ x` under the torque `τ = J_vᵀ u`; `K_0` is `K_θ`
        without these cables. It differs for u and −u. With a moment in W, x solves the equilibrium
        instead, which has no potential. With friction (:attr:`friction`), cables at 0 N count as
        taut.

        u is an axis such as ``"z"`` or ``"-z"``, or (3,) in base axes, any length, else
        InvalidInput. A weight that is not small beside the tensions measures a secant:
        :func:`~cdsm.weight_test`. The stiffness is inf if the tip cannot move along u, and may be
        negative if the arm is unstable. SingularStiffness if `K_θ` is singular, or if the arm is
        unstable to one side: `K_0` is not positive definite.

        ``link`` is where the force acts and the displacement is read, instead of the tip: at the
        ``point`` (3,) [m] in the frame of the link; None: its disk, or its frame (:class:`Load`).

        Example:
            >>> import cdsm
            >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
            >>> K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0))
            >>> round(K.along("z"), 1), round(K.along("z", link="link2"), 1)
            (2104.8, 17182.8)
        """
        u = unit_direction("direction", direction)
        J_v = None if link is None and point is None else self.jacobian_at(link, point)[:3]
        return self.tip_response(u, J_v=J_v)[0]

    def compliance_between(self, read: str, load: str) -> Array:
        """Compute `J_a K_θ⁻¹ J_bᵀ` (6, 6): motion of the link ``read`` per wrench on ``load``.

        The points of the links are those of :class:`~cdsm.Load`. Raises InvalidInput if there is no
        such link, SingularStiffness as :attr:`compliance`.
        """
        J_a = self.jacobian_at(read, None)
        return frozen(J_a @ self._inverse @ self.jacobian_at(load, None).T)

    def jacobian_at(self, link: str | None, point: ArrayLike | None) -> Array:
        """Compute J (6, nv) of a point of a link."""
        return jacobian_at(self.posture, link_point(self.posture.arm, link, point))

    def pseudoinverse(self, term: str = "joint") -> Array:
        """Compute `J⁺ᵀ K J⁺` (3, 3) [N/m], J the linear rows of `J_X`: the printed `K_R`.

        The paper's figures use it, but `J⁺` allows only the joint motion of least norm: the result
        is 4 % to over 100 % larger than :attr:`cartesian`. ``term`` is a part of `K_θ`, or
        ``"joint"``. InvalidInput if it is neither, SingularStiffness if the tip hardly moves in
        some direction.
        """
        names = (*self.terms, "joint")
        matrix = {**self.terms, "joint": self.joint}[one_of("stiffness term", term, names)]
        return frozen(readings.pseudoinverse(matrix, self._tip_motions(None)))

    @property
    def magnitudes(self) -> Array:
        """Sum of the magnitudes of the terms (nv, nv): the size of their rounding errors."""
        return np.asarray(sum(map(abs, self.terms.values())))

    @cached_property
    def _inverse(self) -> Array:
        return self.joint_compliance()

    def joint_compliance(self, joints: Joints = slice(None)) -> Array:
        """Compute `K_θ⁻¹` (n, n) [rad/(N m)] of n joints by their numbers, all others held.

        Raises:
            SingularStiffness: `K_θ` of these joints is singular; the error has their motion.
        """
        K = self.joint[joints][:, joints]
        magnitudes = self.magnitudes[joints][:, joints]
        inverse, singular = readings.invert(K, magnitudes)
        if singular:
            motion = np.zeros(len(self.joint))
            motion[joints] = readings.singular_motion(K, magnitudes)
            motion = frozen(motion)
            held = magnitudes.diagonal().all()
            why = "the arm is just about to buckle" if held else "next to nothing holds the arm"
            raise SingularStiffness(
                f"K_θ is singular: {why} in the joint motion {coordinates(motion)}. "
                "Change the tensions or the posture.",
                motion,
            )
        return frozen(inverse)

    def tip_response(
        self, u: Array, joints: Joints = slice(None), J_v: Array | None = None
    ) -> tuple[float, Array]:
        """Compute the response to a tip force along a unit vector u (3,), other joints held.

        ``J_v`` (3, nv) is the linear motion of another point, where the force acts instead.

        Returns:
            The stiffness along u [N/m], inf if the tip cannot move there, and the motion of the
            joints per force (n,) [rad/N].

        Raises:
            SingularStiffness: As :meth:`joint_compliance`, or the arm is unstable to one side.
        """
        J_v = self.posture.jacobian[:3] if J_v is None else J_v
        torque = (u @ J_v)[joints]
        moves = readings.moves_tip(torque, J_v)
        if not moves:
            return math.inf, np.zeros_like(torque)
        if self.slack and self.friction == "frictionless":
            return self._one_sided_response(torque, joints)
        inverse = self._inverse if isinstance(joints, slice) else self.joint_compliance(joints)
        stiffness, motion = readings.along(inverse, torque[None], moves)
        return float(stiffness[0]), motion[0]

    def _one_sided_response(self, torque: Array, joints: Joints) -> tuple[float, Array]:
        """Compute what :meth:`tip_response` does, of cables at 0 N that can only add tension."""
        K = self.joint[joints][:, joints]
        magnitudes = self.magnitudes[joints][:, joints]
        J = self.posture.length_jacobian[:, joints]
        forces = torque
        if self._yielding is not None:
            K, magnitudes, J = self._yielding.extended(K, magnitudes, J, self.cable_stiffness)
            forces = np.append(torque, np.zeros(len(K) - torque.size))
        along, motion, buckles = readings.one_sided_along(
            K[None],
            magnitudes[None],
            J[None],
            np.where(self._slack, self.cable_stiffness, 0.0)[None],
            forces[None, None],
            np.ones((1, 1), dtype=np.bool_),
        )
        if buckles[0]:
            K_0 = self.without_slack[joints][:, joints]
            least = np.zeros(len(self.joint))
            least[joints] = np.linalg.eigh((K_0 + K_0.T) / 2.0)[1][:, 0]
            worst = self.posture.arm.joint_names[int(abs(least).argmax())]
            problem = f"without {listed(self.slack)} at 0 N, which only pull, nothing holds the arm"
            raise SingularStiffness(
                f"unstable to one side: {problem}, {worst} least. Raise the lower bound of their "
                "tensions, or change the posture.",
                frozen(least),
            )
        return float(along[0, 0]), motion[0, 0, : torque.size]

    def _cartesian_in(self, U: Array | None) -> Array:
        """Compute (U C_vv Uᵀ)⁻¹ (n, n) [N/m] of orthonormal directions U (n, 3), or of all."""
        motions = self._tip_motions(U)
        return frozen(readings.cartesian(self._inverse, motions))

    def _tip_motions(self, U: Array | None) -> readings.TipMotions:
        """Decompose the motion of the tip; SingularStiffness if it hardly moves in a direction."""
        J_v = self.posture.jacobian[:3]
        motions = readings.tip_motions(J_v, U)
        if motions.immobile:
            u = frozen(readings.immobile_direction(J_v, np.eye(3) if U is None else U))
            raise SingularStiffness(
                f"the tip cannot move along {prints.axis_of(u)}, where the stiffness is infinite "
                "or nearly so. Use along(direction), other directions, or bend the arm.",
                u,
            )
        return motions

    def require_mobile(self, u: Array) -> None:
        """Raise SingularStiffness if a tip force along a unit vector u (3,) moves no joint."""
        J_v = self.posture.jacobian[:3]
        if not readings.moves_tip(u @ J_v, J_v):
            raise SingularStiffness(
                f"the tip cannot move along {coordinates(u)}: the stiffness there is infinite "
                "under any tension. Choose another direction, or bend the arm.",
                u,
            )

    def shares(self, direction: Direction) -> Shares:
        """Compute the contribution of each cable's elasticity and tension to :meth:`along`.

        If δθ is the joint motion per unit tip displacement along u, `along(u) = δθᵀ K_θ δθ`, and
        `K_θ` is a sum over cables and other terms. SingularStiffness also if it is inf.

        Example:
            >>> import cdsm
            >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
            >>> K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0))
            >>> print(str(K.shares("z")).splitlines()[-2])
            total                                 2.105  100.0%
        """
        u = unit_direction("direction", direction)
        self.require_mobile(u)
        along, moved = self.tip_response(u)
        motion = moved * along
        if self.segment_tension is None or self.tension_gradient is None:
            k = np.where(self.loose(motion), 0.0, self.cable_stiffness)
            longer = self.posture.length_jacobian @ motion
            passive = k * longer**2
            if self._yielding is not None:
                passive = longer * (self._yielding.effective(k) @ longer)
            active = self.tension * (self.posture.length_hessian @ motion @ motion)
        else:
            segments = self.posture.segments
            parts = (segments.length_jacobian @ motion) * (self.tension_gradient @ motion)
            passive = np.bincount(segments.chains.cable, parts).astype(np.float64)
            active = segments.tension_stiffness(self.segment_tension) @ motion @ motion
        return Shares(
            posture=self.posture,
            direction=u,
            passive=frozen(passive),
            active=frozen(active),
            terms={
                name: float(motion @ matrix @ motion)
                for name, matrix in self.terms.items()
                if name not in CABLE_TERMS
            },
            model=prints.model_of(self),
            warnings=() if self.is_stable else (describe_buckling(self),),
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on what makes the numbers doubtful; empty for a stable arm in balance.

        They say that the arm is UNSTABLE, or so without cables at 0 N; that its tensions do not
        balance it; that it passes through itself; that a cable is above its maximum, or about to
        leave a pulley; or that cables at 0 N count as taut. ``report().remedies`` are changes that
        would hold an unstable arm.
        """
        return self.verdict.warnings

    def report(self) -> Report:
        """Check this frictionless stiffness: is it right, balanced, stable, and how to read it.

        Example:
            >>> import cdsm
            >>> pose = cdsm.presets.virtual_prototype().at([0.1] * 10)
            >>> K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=5.0))
            >>> print(str(K.report()).splitlines()[1])
            PASS: agrees with finite differences, tensions balance the arm, arm is stable.
        """
        above = import_module("cdsm.report")  # a chapter that this one cannot import
        report: Report = above.report_on(self.require_frictionless())
        return report

    def require_frictionless(self) -> Stiffness:
        """Return this stiffness; InvalidInput if its cables stick or slide."""
        if self.friction != "frictionless":
            raise InvalidInput("stiffness", f"cables are {self.friction}; give a frictionless K.")
        return self

    def plot(self, ax: Axes | None = None, **options: Any) -> Axes:
        """Plot the arm in mm, coloured by tension; if stable, its compliance too.

        Other options are those of :func:`cdsm.plots.plot_arm`. Returns the axes.
        """
        return self.posture.plot(self.tension, self, ax, **options)

    def to_dict(self) -> dict[str, object]:
        """Return the stiffness in SI for JSON, units in the keys; None for what does not exist."""
        more: dict[str, object] = {}
        if loads := described(self.posture.arm, self.applied):
            more["loads"] = loads
        if self.posture.arm.motors.given:
            more["drives"] = self.posture.arm.motors.to_dict()
            more["wire_stiffness_N_per_m"] = self.wire_stiffness
        return merged(super().to_dict(), prepare_json(prints.readings(self) | more))

    def __str__(self) -> str:
        return "\n".join([*self.warnings, *prints.table(self), *prints.notes(self)])
