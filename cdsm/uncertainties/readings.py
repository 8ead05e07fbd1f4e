"""Compute the readings of an arm that can have an uncertainty, and their derivatives.

A reading is one number of an arm, such as its stiffness along a direction. Two independent
computations of each reading exist: its derivatives with respect to all inputs, for the budget, and
its values for many arms with random errors, for Monte Carlo. The tests compare them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from cdsm._former.arm_arrays import kernel_arrays
from cdsm.stiffness_matrix import Stiffness
from cdsm.support.format import coordinates
from cdsm.support.values import Array, ReadOnlyState
from cdsm.tolerances import Tolerances
from cdsm.uncertainties.balanced import Balance
from cdsm.uncertainties.drawn import DrawnArms, laws_at, margins
from cdsm.uncertainties.inputs import Inputs, Places, inputs_of, rotations
from cdsm.uncertainties.parts import Part, parts_of

Reading = Literal["along", "margin", "tip", "tension"]

_NOWHERE = np.zeros(3)


@dataclass(frozen=True, eq=False)
class Question(ReadOnlyState):
    """Reading whose uncertainty is asked for: one number of an arm, such as a stiffness.

    Attributes:
        of: Name of the reading: ``"along"``, ``"margin"``, ``"tip"`` or ``"tension"``;
            :func:`~cdsm.uncertainty` explains them.
        stiffness: The stiffness of the arm.
        direction: Unit direction (3,) of the readings ``along`` and ``tip``; else None.
        cable: Index of the cable whose ``tension`` is the reading; else None.
    """

    of: Reading
    stiffness: Stiffness
    direction: Array | None = None
    cable: int | None = None

    @property
    def labels(self) -> Mapping[str, Sequence[str]]:
        """Names of the inputs of each source of uncertainty: for ``hole_radius``, the holes."""
        return inputs_of(self.stiffness.posture.arm).labels

    @property
    def unit(self) -> tuple[str, float]:
        """Unit in which the value is shown to the user, and its size in SI."""
        if self.of == "margin":
            return self.stiffness.posture.arm.stiffness_unit(), 1.0
        return {"along": ("N/mm", 1e3), "tip": ("mm", 1e-3)}.get(self.of, ("N", 1.0))

    @property
    def si_unit(self) -> str:
        """SI unit of the value."""
        return {"along": "N/m", "tip": "m"}.get(self.of, self.unit[0])

    @property
    def name(self) -> str:
        """Name of the reading as text, with its direction or cable."""
        if self.direction is not None:
            what = "stiffness" if self.of == "along" else "tip"
            return f"{what} along {coordinates(self.direction)}"
        if self.cable is not None:
            return f"tension of {self.stiffness.posture.arm.cables[self.cable].name}"
        return "smallest joint stiffness"

    def parts(self, tolerances: Tolerances) -> dict[str, tuple[Part, ...]]:
        """Find the inputs to which each tolerance belongs, by source of uncertainty.

        :func:`~cdsm.uncertainties.parts.parts_of` explains the result.
        """
        return parts_of(tolerances, self.labels)

    @cached_property
    def _along(self) -> tuple[float, Array]:
        """Stiffness along the direction [N/m], and joint motion per unit force (nv,)."""
        assert self.direction is not None
        return self.stiffness._along(self.direction)

    def value(self) -> float:
        """Return the value of the reading for the arm without errors, in SI."""
        K = self.stiffness
        if self.of == "tension":
            return float(K.tension[self.cable])
        if self.direction is None:
            return K.margin
        if self.of == "along":
            return self._along[0]
        return float(self.direction @ K.posture.tip[:3, 3])

    def gradient(self) -> dict[str, Array]:
        """Compute the derivatives of the reading with respect to all inputs.

        The result has an array (n,) for the n inputs of each source of uncertainty. Raises
        InvalidInput if the reading is a tension without a gradient.
        """
        K, inputs = self.stiffness, inputs_of(self.stiffness.posture.arm)
        if self.of == "along":
            assert self.direction is not None
            return _along_gradient(K, inputs, self.direction, *self._along)
        if self.of == "tip":
            assert self.direction is not None
            return _tip_gradient(K, inputs, self.direction)
        if self.of == "tension":
            assert K.distribution is not None
            return Balance.of(K.distribution).gradient(inputs, np.eye(len(K.tension))[self.cable])
        return _gradient(K, inputs, K.critical_direction, _NOWHERE)

    def at(self, errors: Mapping[str, Array]) -> Array:
        """Compute the reading of N arms with errors (N,), in SI.

        ``errors`` has an array (N, inputs) for each source of uncertainty.

        Raises:
            ElasticityRangeError: A tension leaves the domain of its cable's law.
            InvalidInput: No tensions balance an arm.
        """
        arms = DrawnArms(self.stiffness, errors)
        if self.of == "tension":
            return np.asarray(arms.distributed()[:, self.cable])
        drawn = arms.evaluate()
        if self.of == "margin":
            return margins(drawn.joint)
        assert self.direction is not None
        if self.of == "tip":
            return np.asarray(drawn.tip @ self.direction)
        force = self.direction @ drawn.tip_rows
        motion = np.linalg.solve(drawn.joint, force[:, :, None])[:, :, 0]
        return np.asarray(1.0 / np.einsum("ni,ni->n", force, motion))


def _along_gradient(
    K: Stiffness, inputs: Inputs, u: Array, along: float, motion: Array
) -> dict[str, Array]:
    """Compute the derivatives of the stiffness along u, ``along`` = 1/(uᵀ C_vv u).

    C_vv is the translational compliance of the tip, ``motion`` (nv,) is K_θ⁻¹ J_vᵀ u. The result
    has an array for each source of ``inputs``.
    """
    right, towards = along * motion, along * u  # d(1/c) = −dc/c² with c = uᵀ C_vv u = 1/along
    if not K.wrench[3:].any():
        return _gradient(K, inputs, right, towards)
    # K_θ is not symmetric: a bilinear form of two motions, by the forms of sum and difference
    left = along * np.asarray(np.linalg.solve(K.joint.T, u @ K.posture.jacobian[:3]), np.float64)
    plus = _gradient(K, inputs, (left + right) / 2.0, towards)
    minus = _gradient(K, inputs, (left - right) / 2.0, _NOWHERE)
    partials = {name: plus[name] - minus[name] for name in plus}
    partials["joint_angle"] += _skew_gradient(K, left, right)
    return partials


def _gradient(K: Stiffness, inputs: Inputs, motion: Array, direction: Array) -> dict[str, Array]:
    """Compute the derivatives of zᵀ K_θ z − 2 u·J_v z: an array for each source of ``inputs``.

    The joint motion z is ``motion`` (nv,), u is ``direction`` (3,); both are constant. For z =
    K_θ⁻¹ J_vᵀ u the derivatives are those of −uᵀ C_vv u.
    """
    pose, F, k = K.posture, K.tension, K.cable_stiffness
    laws = pose.arm._laws
    rigidity, strain = laws_at(K, F)
    stretched = rigidity * (1.0 + strain)
    wire = pose.cable_lengths - laws.series * (F - laws.rest)
    by_stretched = k**2 * wire / stretched**2  # zero where the motor holds the force
    slope = -(k**2) / stretched
    by_spring = k**2 * laws.series * (1.0 - (F - laws.rest) / stretched)
    by_force = k**2 * laws.series / stretched + by_stretched * _stretched_slope(K, strain)
    given = F, k, slope, np.zeros_like(F), K.wrench, 1.0, 0.0
    found, by_tension, by_stiffness = inputs.gradient(pose, motion, -2.0 * direction, *given)
    return found | {
        "rigidity": by_stiffness * by_stretched * rigidity,
        "spring": (by_stiffness * by_spring)[laws.series > 0.0],
        "tension": by_tension + by_stiffness * by_force,
        "lead": by_stiffness * slope,
    }


def _skew_gradient(K: Stiffness, left: Array, right: Array) -> Array:
    """Compute the derivatives with respect to q (nv,) of −m·(ω_r × ω_l)/2.

    If the load has a moment m, K_θ has a skew part, and this is its bilinear form. ω_l and ω_r are
    the angular velocities of the tip for the joint motions ``left`` and ``right``. A change of
    joint angle i turns those parts of them that come from joint i and the joints after it.
    """
    turns, chain = K.posture.jacobian[3:], K.posture.arm._body.tip_joints
    moment, found = K.wrench[3:], np.zeros(left.size)
    for n, i in enumerate(chain):
        beyond = chain[n:]
        both = [
            np.cross(turns[:, i], turns[:, beyond] @ motion[beyond]) for motion in (right, left)
        ]
        turned = np.cross(both[0], turns @ left) + np.cross(turns @ right, both[1])
        found[i] = -moment @ turned / 2.0
    return found


def _tip_gradient(K: Stiffness, inputs: Inputs, direction: Array) -> dict[str, Array]:
    """Compute the derivatives of the tip's coordinate along ``direction``.

    The result has an array for each source of ``inputs``.
    """
    pose, model = K.posture, kernel_arrays(K.posture.arm)
    tree, masses = model.tree, model.masses
    # a point that moves by δ in a frame of rotation R moves the tip by R δ
    along = direction @ rotations(pose)
    origin, row = np.zeros_like(tree.translation), masses.tip_joints + 1
    origin[row] = along[tree.parent[row]]
    still = inputs.places
    moved = Places(
        np.zeros_like(still.site), origin, np.zeros_like(still.centre), along[masses.tip]
    )
    return inputs.zeros() | inputs.by_source(moved) | {"joint_angle": direction @ pose.jacobian[:3]}


def _stretched_slope(K: Stiffness, strain: Array) -> Array:
    """Compute the slope d(EA (1 + ε))/dF = EA′ (1 + ε) + 1 (C,) [-] at the tensions of K.

    EA (1 + ε) is the stiffness of a wire times its stretched length; ε is ``strain`` (C,). If
    ``original_length`` of the arm is not ``"unstrained"``, ε counts as zero and the slope is EA′.
    """
    arm = K.posture.arm
    slope = np.zeros_like(strain)
    for law, of in arm._laws.held:
        slope[of] = law.rigidity_slope(K.tension[of])
    return slope * (1.0 + strain) + float(arm.original_length == "unstrained")
