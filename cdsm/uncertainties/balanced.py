"""Derivatives of the least tensions with respect to the inputs.

An input is a number that can have a tolerance, such as the radius of one hole.

This module computes the change Σ y_c dF_c of a weighted sum of the least tensions F (Eq. 17), with
constant weights y, for small changes of the arm. The cables balance the torque τ = J_Xᵀ W − g
(Eq. 13). Free cables (index f) are between their bounds, the others (index b) at a bound. B and B_b
are the columns of J_Lᵀ of free and other cables. The tensions of the free cables are F_f = Bᵀ λ,
where λ (nv,) solves B Bᵀ λ = τ − B_b F_b. With μ = (B Bᵀ)⁻¹ B y_f and r = y_f − Bᵀ μ,

    Σ y_c dF_c = r·dBᵀ λ + μ·(dτ − dJ_Lᵀ F).

Both terms are changes of a mechanical power at constant tensions and joint velocity: the power
Σ r_c L̇_c at the velocity λ, and the power of the residual torque J_Lᵀ F − τ at the velocity −μ. So
the kernel :mod:`cdsm._former.sensitivity`, which differentiates the stiffness, computes them too.
The formula holds while the same cables stay at their bounds.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm._former.tension import OPTIMALITY
from cdsm.errors import InvalidInput
from cdsm.support.values import Array
from cdsm.tension import Tension
from cdsm.uncertainties.inputs import Inputs

_NO_VELOCITY = np.zeros(3)

_DETERMINED = 1e-12
"""Smallest over largest singular value of B Bᵀ: below this, free cables cannot balance the arm."""


class Balance(NamedTuple):
    """Least tensions of an arm, with the free cables: those between their bounds.

    The docstring of the module explains the symbols.
    """

    tension: Tension
    free: NDArray[np.bool_]  # (C,)
    inverse: Array  # (B Bᵀ)⁻¹ (nv, nv), with the columns B of J_Lᵀ of the free cables

    @classmethod
    def of(cls, tension: Tension) -> Balance:
        """Find the free cables of ``tension``.

        Raises InvalidInput if ``tension`` are not the least tensions, or if B Bᵀ is singular.
        """
        F = tension.values
        near = OPTIMALITY * F.max(initial=0.0)
        free = (F - tension.minimum > near) & (tension.maximum - F > near)
        B = tension.posture.length_jacobian[free].T
        singular = np.linalg.svd(B @ B.T, compute_uv=False)
        if not tension.least or singular[-1] <= _DETERMINED * singular[0]:
            raise InvalidInput(
                "tension",
                "has no gradient: so many cables are at a bound that the others do not determine "
                "it, or it was not distributed as the least. Lower the minimum.",
            )
        return cls(tension, free, np.linalg.inv(B @ B.T))

    def multipliers(self, weights: Array) -> Array:
        """Compute μ = (B Bᵀ)⁻¹ B y_f (nv,); y are the ``weights`` (C,).

        μ is the derivative of the weighted sum of tensions Σ y_c F_c with respect to the torques
        that they balance. The columns of B are those of J_Lᵀ for the free cables f.
        """
        B = self.tension.posture.length_jacobian[self.free].T
        return np.asarray(self.inverse @ (B @ weights[self.free]))

    def by_bounds(self, weights: Array, low: Array, high: Array) -> Array:
        """Compute the change Σ y_c dF_c (n,) for n changes of the bounds of the tensions F.

        y are the ``weights`` (C,); ``low`` and ``high`` (C, n) [N] are the changes of the lower and
        upper bounds.
        """
        F, J = self.tension.values, self.tension.posture.length_jacobian
        at_low = F - self.tension.minimum <= OPTIMALITY * F.max(initial=0.0)
        moved = np.where(at_low[:, None], low, high)[~self.free]
        return np.asarray((weights - J @ self.multipliers(weights))[~self.free] @ moved)

    def gradient(self, inputs: Inputs, weights: Array) -> dict[str, Array]:
        """Compute the derivatives of a weighted sum Σ y_c F_c of the least tensions.

        y are the ``weights`` (C,). The derivatives are with respect to ``inputs``, in an array for
        each source of uncertainty, such as ``hole_radius``. The derivatives with respect to inputs
        of wires, such as rigidity and lead, are 0.
        """
        F, free = self.tension.values, self.free
        B = self.tension.posture.length_jacobian[free].T
        mu = self.multipliers(weights)
        rest = np.zeros_like(F)
        rest[free] = weights[free] - B.T @ mu
        motion = self.inverse @ (B @ F[free])
        found = self._work(inputs, motion, rest, 0.0)
        balance = self._work(inputs, -mu, F, 1.0)
        return {name: found[name] + balance[name] for name in found}

    def _work(
        self, inputs: Inputs, motion: Array, weights: Array, loaded: float
    ) -> dict[str, Array]:
        """Compute the derivatives of the power Σ p_c L̇_c with respect to ``inputs``.

        The cable forces p are ``weights`` (C,) [N], ``motion`` (nv,) is the joint velocity.
        ``loaded`` is 1 to subtract the power of gravity and load, otherwise 0. The result has an
        array for each source of uncertainty, such as ``hole_radius``.
        """
        none = np.zeros_like(weights)
        given = none, none, none, weights, self.tension.wrench, 0.0, loaded
        return inputs.gradient(self.tension.posture, motion, _NO_VELOCITY, *given)[0]
