"""Cartesian stiffness at the tip, computed from K_θ.

The paper maps K_θ to Cartesian space with J_X⁻¹, which does not exist for a redundant arm. "The
stiffness in x" then has three different meanings. Each meaning has a name here:
:meth:`~cdsm.Stiffness.along`, :attr:`~cdsm.Stiffness.cartesian` and
:meth:`~cdsm.Stiffness.pseudoinverse`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from cdsm.errors import InvalidInput, SingularStiffness
from cdsm.kernels import readings
from cdsm.kernels.read import read
from cdsm.posture import Posture
from cdsm.support.directions import Direction, unit_direction, unit_directions
from cdsm.support.format import coordinates
from cdsm.support.validation import one_of
from cdsm.support.values import Array, ReadOnlyState, frozen

Term = Literal["active", "passive", "gravity", "load", "joint"]

_ORTHOGONAL = 1e-9  # largest product of two unit directions that are orthogonal

_NO_DIRECTIONS = frozen(np.zeros((0, 3)))


@dataclass(frozen=True, eq=False, kw_only=True)
class CartesianReadings(ReadOnlyState):
    """Stiffness and compliance at the tip; base class of :class:`~cdsm.Stiffness`."""

    posture: Posture
    active: Array  # H_L·F (nv, nv) [N m/rad]
    passive: Array  # J_Lᵀ K_L J_L (nv, nv) [N m/rad]
    gravity: Array  # ∂g/∂θ (nv, nv) [N m/rad]
    load: Array  # −∂(J_Xᵀ W)/∂θ (nv, nv) [N m/rad]
    joint: Array  # K_θ, the sum of the four terms (nv, nv) [N m/rad]
    _parts: Array  # sum of the magnitudes of the four terms: scale of rounding errors

    @cached_property
    def compliance(self) -> Array:
        """Compliance C = J_X K_θ⁻¹ J_Xᵀ (6, 6): tip motion per wrench at the tip.

        Linear rows first: C_vv [m/N], C_vω [m/(N m)] = [rad/N], C_ωω [rad/(N m)].

        Raises:
            SingularStiffness: K_θ is singular: the arm is about to buckle.
        """
        status, found = self._read(self.joint, "compliance")
        self._refuse(status)
        return frozen(found["compliance"].reshape(6, 6))

    @cached_property
    def cartesian(self) -> Array:
        """Matrix (C_vv)⁻¹ (3, 3) [N/m]: force per tip displacement, with the tip free to rotate.

        A diagonal entry is the stiffness if the other two translations are *locked*. For a stable
        arm it is never less than :meth:`along` that axis, and often several times larger.

        Raises:
            SingularStiffness: K_θ is singular, or the tip hardly moves in some direction. In the
                second case the error names the direction; use :meth:`along` for other directions.
        """
        status, found = self._read(self.joint, "cartesian")
        self._refuse(status, "the Cartesian stiffness matrix")
        return frozen(found["cartesian"].reshape(3, 3))

    def cartesian_in(self, directions: Iterable[Direction]) -> Array:
        """Compute (U C_vv Uᵀ)⁻¹ (n, n) [N/m]: force per tip displacement in some directions only.

        Use it for planar arms: their tip cannot leave a plane, so :attr:`cartesian` does not exist.

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
        # two joints cannot move the tip in three directions
        if len(moved) < len(U) or moved[-1] <= readings.FLAT * np.linalg.norm(rows, 2):
            u: Array = np.asarray(vectors[:, -1] @ U, dtype=np.float64)
            raise SingularStiffness(f"the tip cannot move along {axis_of(u)}.", frozen(u))
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

        The paper's figures use this formula, but it overestimates stiffness. The result is larger
        than :attr:`cartesian` by 4 % to over 100 %, since J⁺ allows only the joint motion of least
        norm.

        Args:
            term: Part of K_θ: ``"active"``, ``"passive"``, ``"gravity"``, ``"load"``, or the sum
                ``"joint"``.

        Raises:
            UnknownName: ``term`` is unknown.
            SingularStiffness: The tip hardly moves in some direction, which J⁺ omits.
        """
        matrix: Array = getattr(self, one_of("stiffness term", term, get_args(Term)))
        status, found = self._read(matrix, "pseudoinverse")
        self._refuse(status, "the pseudo-inverse reading")
        return frozen(found["pseudoinverse"].reshape(3, 3))

    def _require_mobile(self, u: Array) -> None:
        """Raise SingularStiffness if a tip force along a unit vector u (3,) moves no joint."""
        rows = self.posture.jacobian[:3]
        if not abs(u @ rows).max() > readings.UNMOVED * abs(rows).max():
            raise SingularStiffness(
                f"the tip cannot move along {coordinates(u)}: the stiffness there "
                "is infinite under any tension. Choose another direction, or bend the arm.",
                u,
            )

    def _along(self, u: Array) -> tuple[float, Array]:
        """Return stiffness along a unit vector u [N/m] and joint motion per force along u (nv,)."""
        status, found = self._read(self.joint, "along", u[None])
        stiffness = float(found["along"][0, 0, 0])
        if math.isnan(stiffness):
            self._refuse(status)
        return stiffness, found["motion"][0, :, 0, 0]

    def _read(
        self, matrix: Array, name: str, directions: Array = _NO_DIRECTIONS
    ) -> tuple[int, dict[str, Array]]:
        """Compute the quantity ``name``, such as ``"along"``, from K_θ or one of its terms.

        ``matrix`` is this K_θ or term (nv, nv). Returns the status READ, SINGULAR or IMMOBILE of
        :mod:`cdsm.kernels.readings`, and a dict with the values. ``directions`` (D, 3) are unit
        vectors, for quantities that have a direction.
        """
        status, JX = np.array([[readings.READ]]), self.posture.jacobian
        K, parts, JX = matrix[None, ..., None], self._parts[None, ..., None], JX[None, ..., None]
        found = read(K, parts, JX, directions, (name,), status, None)
        return int(status[0, 0]), found

    def _refuse(self, status: int, what: str = "") -> None:
        """Raise SingularStiffness unless ``status`` is READ; the error gives the reason.

        ``what`` names a quantity that does not exist if the tip is immobile in some direction.
        """
        if status == readings.READ:
            return
        if what and self._read(self.joint, "pseudoinverse")[0] == readings.IMMOBILE:
            u = frozen(np.linalg.svd(self.posture.jacobian[:3])[0][:, 2].copy())
            raise SingularStiffness(
                f"{what} does not exist: the tip cannot move along {coordinates(u)}, where the "
                "stiffness is infinite or nearly so. Use along(direction), or bend the arm.",
                u,
            )
        diagonal = self._parts.diagonal()
        if not diagonal.min() > 0.0:
            why, motion = "next to nothing holds the arm", np.eye(diagonal.size)[diagonal.argmin()]
        else:
            unit = np.sqrt(diagonal)
            why = "the arm is just about to buckle"
            motion = np.linalg.svd(self.joint / unit / unit[:, None])[2][-1] / unit
        motion = frozen(motion / np.linalg.norm(motion))
        raise SingularStiffness(
            f"K_θ is singular: {why} in the joint motion {coordinates(motion)}. Change the "
            "tensions or the posture.",
            motion,
        )


def axis_of(u: Array) -> str:
    """Write a direction (3,) as text; of u and −u, the one whose largest entry is positive."""
    return coordinates(np.round(u * np.sign(u[abs(u).argmax()]), 9), "z.3g")
