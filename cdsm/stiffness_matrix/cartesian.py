"""Cartesian stiffness at the tip, computed from K_θ.

The paper maps K_θ to Cartesian space with J_X⁻¹, which does not exist for a redundant arm. "The
stiffness in x" then has three meanings, each with a name here: along, cartesian, pseudoinverse.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from cdsm.errors import InvalidInput, SingularStiffness
from cdsm.posture import Posture
from cdsm.support.directions import Direction, unit_direction, unit_directions
from cdsm.support.format import coordinates
from cdsm.support.result import Result, unit
from cdsm.support.validation import one_of
from cdsm.support.values import Array, frozen

Term = Literal["active", "passive", "gravity", "load", "joint"]

REGULAR = 1e-8  # least relative singular value of K_θ; its inverse has 6 correct digits there
FLAT = 1e-6  # least relative singular value of J_v; a 3×3 stiffness has 4 correct digits there
UNMOVED = 1e-10  # the tip cannot move along u if all entries of J_vᵀ u are below this part of J_v's
_ORTHOGONAL = 1e-9  # largest product of two unit directions that are orthogonal

_SQUARE = unit("joint stiffness", "joint", "joint_column")


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class CartesianReadings(Result):
    """Stiffness and compliance at the tip; base class of :class:`~cdsm.Stiffness`.

    K_θ is singular, and SingularStiffness raised, if the smallest singular value of D^-½ K_θ D^-½
    is at most 1e-8 of the largest entry of D^-½ P D^-½. P is the sum of the magnitudes of the
    terms, which may cancel; its diagonal D makes the test free of units.
    """

    posture: Posture
    active: Array = field(metadata=_SQUARE)
    passive: Array = field(metadata=_SQUARE)
    gravity: Array = field(metadata=_SQUARE)
    load: Array = field(metadata=_SQUARE)
    # in exports, a variable must not have the name of a dimension
    joint: Array = field(metadata={**_SQUARE, "name": "joint_stiffness"})

    @cached_property
    def compliance(self) -> Array:
        """Compliance C = J_X K_θ⁻¹ J_Xᵀ (6, 6): tip motion per wrench at the tip.

        Linear rows first: C_vv [m/N], C_vω [m/(N m)] = [rad/N], C_ωω [rad/(N m)].
        """
        J = self.posture.jacobian
        return frozen(J @ self._inverse @ J.T)

    @cached_property
    def cartesian(self) -> Array:
        """Matrix (C_vv)⁻¹ (3, 3) [N/m]: force per tip displacement, with the tip free to rotate.

        A diagonal entry is the stiffness if the other two translations are *locked*. For a stable
        arm it is never less than :meth:`along` that axis, and often several times larger.
        SingularStiffness also if the tip hardly moves in some direction.
        """
        return self.cartesian_in(np.eye(3))

    def cartesian_in(self, directions: Iterable[Direction]) -> Array:
        """Compute (U C_vv Uᵀ)⁻¹ (n, n) [N/m]: force per tip displacement in some directions only.

        Use it for planar arms: their tip cannot leave a plane, so :attr:`cartesian` does not exist.
        U are n orthogonal directions in base axes: names as ``("x", "z")``, or (n, 3); InvalidInput
        if they are not. SingularStiffness also if the tip hardly moves in one of the directions.
        """
        U = unit_directions("directions", directions).reshape(-1, 3)
        if abs(U @ U.T - np.eye(len(U))).max() > _ORTHOGONAL:
            raise InvalidInput("directions", "are not orthogonal; give axes of a plane.")
        A, V = self._decompose(U)
        return frozen(A @ np.linalg.inv(V @ self._inverse @ V.T) @ A.T)

    def along(self, direction: Direction) -> float:
        """Compute 1/(uᵀ C_vv u) [N/m], the tangent stiffness that a tip weight measures (Eq. 20).

        u is an axis such as ``"z"`` or ``"-z"``, or (3,) in base axes, any length, else
        InvalidInput. A weight that is not small beside the tensions measures a secant:
        :func:`~cdsm.weight_test`. The stiffness is inf if the tip cannot move along u, and may be
        negative if the arm is unstable.
        """
        return self._along(unit_direction("direction", direction))[0]

    def pseudoinverse(self, term: Term = "joint") -> Array:
        """Compute J⁺ᵀ K J⁺ (3, 3) [N/m], J the linear rows of J_X: the paper's K_R, read literally.

        The paper's figures use it, but J⁺ allows only the joint motion of least norm: the result is
        4 % to over 100 % larger than :attr:`cartesian`. ``term`` is a part of K_θ, or ``"joint"``.
        UnknownName if it is neither, SingularStiffness if the tip hardly moves in some direction.
        """
        matrix: Array = getattr(self, one_of("stiffness term", term, get_args(Term)))
        A, V = self._decompose(np.eye(3))
        return frozen(A @ (V @ matrix @ V.T) @ A.T)

    @cached_property
    def _inverse(self) -> Array:
        """K_θ⁻¹ (nv, nv), or SingularStiffness with the joint motion."""
        P = abs(self.active) + abs(self.passive) + abs(self.gravity) + abs(self.load)
        D = P.diagonal()
        if not D.min() > 0.0:
            raise _singular("next to nothing holds the arm", np.eye(D.size)[D.argmin()])
        scale = 1.0 / np.sqrt(D)
        both = scale * scale[:, None]
        scaled, least = self.joint * both, REGULAR * float((P * both).max())
        try:
            inverse = np.linalg.inv(scaled)
        except np.linalg.LinAlgError:
            inverse = np.full_like(scaled, math.inf)
        # 1/|A⁻¹| is a lower bound of the smallest singular value of A
        if not least * math.sqrt(np.vdot(inverse, inverse)) < 1.0:
            _, values, rows = np.linalg.svd(scaled)
            if not values[-1] > least:
                raise _singular("the arm is just about to buckle", rows[-1] * scale)
        return inverse * both

    def _decompose(self, U: Array) -> tuple[Array, Array]:
        """Decompose U J_v = B S V; return A = B S⁻¹ (n, n) and V (n, nv).

        Then (U C_vv Uᵀ)⁻¹ = A (V K_θ⁻¹ Vᵀ)⁻¹ Aᵀ, in which a stiff direction costs no digits.
        """
        rows = self.posture.jacobian[:3]
        B, S, V = np.linalg.svd(U @ rows)
        # two joints cannot move the tip in three directions
        if len(S) < len(U) or not S[-1] > FLAT * np.linalg.norm(rows, 2):
            u = frozen(B[:, -1] @ U)
            said = f"the tip cannot move along {axis_of(u)}, where the stiffness is infinite or "
            said += "nearly so. Use along(direction), other directions, or bend the arm."
            raise SingularStiffness(said, u)
        return B / S, V[: len(U)]

    def _along(self, u: Array) -> tuple[float, Array]:
        """Return stiffness along a unit vector u [N/m] and joint motion per force along u (nv,)."""
        torque = u @ self.posture.jacobian[:3]
        if not self._moves(torque):
            return math.inf, np.zeros_like(torque)
        motion = self._inverse @ torque
        compliance = float(torque @ motion)
        return 1.0 / compliance if compliance else math.inf, motion

    def _moves(self, torque: Array) -> bool:
        """Return whether a tip force with joint torques J_vᵀ u (nv,) moves any joint."""
        return bool(abs(torque).max() > UNMOVED * abs(self.posture.jacobian[:3]).max())

    def _require_mobile(self, u: Array) -> None:
        """Raise SingularStiffness if a tip force along a unit vector u (3,) moves no joint."""
        if not self._moves(u @ self.posture.jacobian[:3]):
            said = f"the tip cannot move along {coordinates(u)}: the stiffness there is infinite "
            said += "under any tension. Choose another direction, or bend the arm."
            raise SingularStiffness(said, u)


def axis_of(u: Array) -> str:
    """Write a direction (3,) as text; of u and −u, the one whose largest entry is positive."""
    return coordinates(np.round(u * np.sign(u[abs(u).argmax()]), 9), "z.3g")


def _singular(why: str, motion: Array) -> SingularStiffness:
    motion = frozen(motion / np.linalg.norm(motion))
    said = f"K_θ is singular: {why} in the joint motion {coordinates(motion)}. "
    return SingularStiffness(said + "Change the tensions or the posture.", motion)
