"""States of rest near a reference, to first order: largest changes of joints and tensions."""

from __future__ import annotations

from copy import copy
from typing import Self

import numpy as np

from cdsm.stiffness_matrix import Stiffness
from cdsm.support.values import Array

_NEAR = 1e-9
"""Least bound of a neighbourhood for changes of an angle [rad], a position [m], a tension [N]."""


class Neighbourhood:
    """Neighbourhood of a reference: all states of rest to first order, enlarged by ``room``.

    A state of rest is an equilibrium that friction allows. ``K`` is the frictionless stiffness at
    the reference, where each cable has one tension F. δ is the change of the joint angles, ΔT_j the
    change of tension of segment j, and g_j the gradient of its length. In each cable, ȳ is the mean
    of ΔT_j/F, weighted with the compliances of the segments, and y_j is the deviation from it, so
    ΔT_j = F (y_j + ȳ). If the motor is locked, F ȳ = k Σ_j g_j·δ, with k the stiffness of the
    whole cable. Equilibrium becomes K_θ δ = −Σ_j F y_j g_j. From segment to segment, y changes by
    at most μ φ of the hole (friction times wrap angle), up or down. So a linear function of y is
    largest if y changes by +μ φ or by −μ φ at every hole. This gives its maximum in closed form.
    All μ φ are multiplied by ``room``.

    Attributes:
        joints: Largest |δ| (nv,) [rad].
        tensions: Largest ΔT (S,) [N].
        falls: Largest −ΔT (S,) [N], at most F, since no tension is negative.
    """

    def __init__(self, K: Stiffness, room: float) -> None:
        segments = K.posture.segments
        chains, laws = segments.chains, K.posture.arm._segment_laws
        cable, start, F = chains.cable, chains.start, K.tension
        with np.errstate(divide="ignore"):
            soft = 1.0 / laws.stiffness(segments.lengths, F[cable])
        steps = np.zeros((cable.size, chains.hole.size))
        for i, hole in enumerate(chains.hole):
            of = slice(start[cable[hole]], start[cable[hole] + 1])
            after = np.arange(of.start, of.stop) > hole
            forced = not np.isfinite(soft[of.start])  # the motor holds the tension at the start
            mean = 0.0 if forced else soft[of][after].sum() / soft[of].sum()
            steps[of, i] = (after - mean) * F[cable[hole]]
        joints = -np.linalg.solve(K.joint, segments.length_jacobian.T @ steps)
        common = K.cable_stiffness[:, None] * (K.posture.length_jacobian @ joints)
        grip = room * chains.friction * segments.wrap
        self._steps = joints * grip
        self.joints = np.maximum(self.largest(np.eye(len(joints))), _NEAR)
        apart = abs((steps + common[cable]) * grip).sum(axis=1) / np.where(F > 0.0, F, 1.0)[cable]
        self._set_tensions(apart, F[cable])

    def _set_tensions(self, apart: Array, F: Array) -> None:
        """Set :attr:`tensions` and :attr:`falls` from the bounds ``apart`` (S,) of |ln T/F|.

        F (S,) [N] are the tensions at the reference.
        """
        self.tensions = np.maximum(np.expm1(apart) * F, _NEAR)
        self.falls = np.minimum(np.maximum(apart * F, _NEAR), F)

    def still(self, K: Stiffness) -> Self:
        """Return the neighbourhood of all states with the joint angles of ``K``: only T varies.

        In each cable, |ln T/F| is at most Σ μ φ over its holes.
        """
        segments = K.posture.segments
        chains, grip = segments.chains, np.zeros(len(segments.lengths))
        grip[chains.hole] = segments.grip
        apart = np.add.reduceat(grip, chains.start[:-1])[chains.cable]
        same = copy(self)
        same.joints, same._steps = np.zeros_like(self.joints), np.zeros_like(self._steps)
        same._set_tensions(apart, K.tension[chains.cable])
        return same

    def largest(self, rows: Array) -> Array:
        """Compute the largest |a·δ| (…,) over all δ of the neighbourhood, for ``rows`` (…, nv)."""
        return np.asarray(abs(rows @ self._steps).sum(axis=-1))

    def curved(self, forms: Array) -> Array:
        """Compute a bound (…,) of |δᵀ A δ|/2 for ``forms`` A (…, nv, nv), over the neighbourhood.

        The bound is the sum of the largest terms of all pairs of holes, as if none cancelled.
        """
        both = self._steps.T @ forms @ self._steps
        return np.asarray(abs(both).sum(axis=(-2, -1)) / 2.0)

    def cubed(self, form: Array) -> float:
        """Compute a bound of |Σ A_ijk δ_i δ_j δ_k|/6 for all δ of the neighbourhood.

        ``form`` is A (nv, nv, nv).
        """
        first = np.tensordot(self._steps, form, (0, 0))
        return float(abs(self._steps.T @ first @ self._steps).sum()) / 6.0
