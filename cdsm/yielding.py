"""Motors that yield: what they make of the stiffness and the tensions of the cables they move.

A motor is one more coordinate φ. B (C, M) is the wire of each cable that a motor takes in per turn:
where the motors turn by φ, cable c is as if it were longer by (B φ)_c, and the torque of the motors
is Bᵀ F. With K_L = diag k,

    dF = K_L (J_L dθ + B dφ);   rigid: dφ = 0;   compliant: Bᵀ dF = −k_m dφ;   torque held: k_m = 0.

So the cables of motors that yield have one stiffness together, a full matrix,

    dF = K_eff J_L dθ,     K_eff = K_L − K_L B (k_m + Bᵀ K_L B)⁻¹ Bᵀ K_L = (K_L⁻¹ + B k_m⁻¹ Bᵀ)⁻¹

with the columns of rigid motors left out of B. The passive term of K_θ is J_Lᵀ K_eff J_L.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import CdsmError
from cdsm.status import Status
from cdsm.support.validation import RANGES
from cdsm.support.values import Array

_REGULAR = 1e-12  # k_m + Bᵀ K_L B is singular below this part of its scaled size
_SETTLED = 1e-13  # largest torque that is rounding, over that of the motors
_SHORT = 1e-3  # length [m] whose rounding counts
_STALLED = 1e-10  # the same where no step makes it smaller: laws are inverted to 1e-13
_STEPS = 200  # most steps of the search for the turns of motors

TensionLaw = Callable[[Array], tuple[Array, Array]]
"""Tensions F (C,) [N] and their slopes dF/dL (C,) [N/m] of cables that are longer by (C,) [m]."""


class Yielding(NamedTuple):
    """The m motors of an arm that yield, with their cables.

    Arrays of cables may have further axes before, as rows of a batch.
    """

    names: tuple[str, ...]
    matrix: Array  # B (C, m) [m/rad]
    stiffness: Array  # k_m (m,) [N m/rad]; 0: the motor holds its torque

    def of_motors(self, k: Array) -> Array:
        """Compute k_m + Bᵀ K_L B (…, m, m) [N m/rad] from the stiffness k (…, C) of the cables."""
        B = self.matrix
        return np.asarray(np.diag(self.stiffness) + (B.T * k[..., None, :]) @ B)

    def softening(self, J: Array, k: Array) -> Array:
        """Compute J_Lᵀ (K_L − K_eff) J_L (…, nv, nv) [N m/rad] from J_L (…, C, nv)."""
        pulled = (self.matrix.T * k[..., None, :]) @ J
        return np.asarray(pulled.swapaxes(-1, -2) @ _inverse(self.of_motors(k)) @ pulled)

    def effective(self, k: Array) -> Array:
        """Compute K_eff (C, C) [N/m]: tensions per elongation of the cables with their motors."""
        return np.asarray(np.diag(k) - self.softening(np.eye(k.size), k))

    def transmission(self, k: Array) -> Array:
        """Compute P = 1 − K_L B (k_m + Bᵀ K_L B)⁻¹ Bᵀ (C, C): K_eff = P K_L, also where k is 0.

        P Δ are the changes of tension that are left of Δ (C,) once the motors have yielded.
        """
        B = self.matrix
        return np.asarray(np.eye(k.size) - (k[:, None] * B) @ _inverse(self.of_motors(k)) @ B.T)

    def softness(self, k: Array) -> Array:
        """Compute (k_m + Bᵀ K_L B)⁻¹ (m, m) [rad/(N m)]: turns per torque, the joints held."""
        return _inverse(self.of_motors(k))

    def yielded(self, slopes: Array, k: Array) -> Array:
        """Compute B (k_m + Bᵀ K_L B)⁻¹ Bᵀ ∂F/∂θ (C, nv) [m/rad]: wire that the motors let out.

        ``slopes`` ∂F/∂θ (C, nv) are those of rigid motors.
        """
        return np.asarray(self.matrix @ _inverse(self.of_motors(k)) @ (self.matrix.T @ slopes))

    def settle(self, law: TensionLaw, torque: Array, start: Array) -> tuple[Array, Array, Array]:
        """Find the turns φ (m,) [rad] at which Bᵀ F(B φ) = ``torque`` − k_m φ (m,) [N m].

        It is the least of a convex energy, so Newton's method finds it if a step is shortened until
        the energy does not rise again at its end. Returns φ, F and dF/dL (C,) there. Raises
        CdsmError, which names the motor, if no turn gives its torque.
        """
        B = self.matrix
        k_m = self.stiffness
        turn = start
        F, k = law(B @ turn)
        before = math.inf
        for _ in range(_STEPS):
            off = B.T @ F + k_m * turn - torque
            size = abs(B).T @ (abs(F) + _SHORT * k) + abs(k_m * turn) + abs(torque) + _smallest(B)
            error = float((abs(off) / size).max())
            if error <= _SETTLED or 0.5 * before <= error <= _STALLED:
                return turn, F, k
            before = error
            stiff = np.where(k > 0.0, k, 1e-3 * k.max(initial=1.0))  # of slack cables, for the step
            step = -_inverse(self.of_motors(stiff)) @ off
            part = 1.0
            there, slope = law(B @ (turn + step))
            for _ in range(60):
                rise = (B.T @ there + k_m * (turn + part * step) - torque) @ step
                if rise <= -0.5 * (off @ step):
                    break
                part = part / 2.0
                there, slope = law(B @ (turn + part * step))
            turn = turn + part * step
            F = there
            k = slope
        worst = int((abs(off) / size).argmax())
        raise CdsmError(
            f"motor {self.names[worst]!r}: no turn gives the torque of {torque[worst]:.4g} N m "
            "that it holds: its cables are slack, and cables only pull.",
            Status.NO_EQUILIBRIUM,
        )

    def turns_for(self, elongation: Array, k: Array, slack: NDArray[np.bool_]) -> Array:
        """Compute the turns (m,) per motion that makes the cables longer by (C,), to first order.

        Cables at 0 N, which ``slack`` (C,) marks, pull only where they become longer.
        """
        B = self.matrix
        pulls = np.asarray(k > 0.0)
        turn = np.zeros(self.stiffness.size)
        for _ in range(_STEPS):
            taut = np.where(pulls, k, 0.0)
            turn = -_inverse(self.of_motors(taut)) @ (B.T @ (taut * elongation))
            before = pulls
            pulls = (k > 0.0) & np.where(slack, elongation + B @ turn > 0.0, True)
            if (pulls == before).all():
                break
        return np.asarray(turn)

    def extended(self, K: Array, magnitudes: Array, J: Array, k: Array) -> tuple[Array, ...]:
        """Add the motors to the joints: K (…, n, n), its magnitudes and J_L (…, C, n) with n + m.

        The stiffness of all cables is then diag k again, so that single ones may be taken out.
        """
        B = np.broadcast_to(self.matrix, (*J.shape[:-1], self.matrix.shape[1]))
        pulled = (self.matrix.T * k[..., None, :]) @ J
        rigid = K + self.softening(J, k)
        motors = self.of_motors(k)
        size = magnitudes + abs(rigid - K)
        corner = pulled.swapaxes(-1, -2)
        whole = np.concatenate(
            [np.concatenate([rigid, corner], -1), np.concatenate([pulled, motors], -1)], -2
        )
        sizes = np.concatenate(
            [np.concatenate([size, abs(corner)], -1), np.concatenate([abs(pulled), motors], -1)], -2
        )
        return whole, abs(sizes), np.concatenate([J, B], -1)


def _smallest(B: Array) -> Array:
    """Return the torque of each motor (m,) [N m] under the smallest tension that counts."""
    return np.asarray(abs(B).sum(axis=0) * RANGES["tension"].low)


def _inverse(A: Array) -> Array:
    """Invert symmetric A (…, m, m) ≥ 0; where motors have no stiffness at all, it is 0."""
    d = np.sqrt(np.diagonal(A, axis1=-2, axis2=-1))
    scale = 1.0 / np.where(d > 0.0, d, 1.0)
    both = scale[..., :, None] * scale[..., None, :]
    return np.asarray(np.linalg.pinv(A * both, rcond=_REGULAR, hermitian=True) * both)
