"""Springs at the joints of an arm: k (θ − q_0) turns each joint back to its angle q_0."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cdsm.coupling import Coupling
from cdsm.errors import InvalidInput
from cdsm.support.validation import one_of, scalar, within
from cdsm.support.values import Array, frozen

Spring = float | Sequence[float]
"""Stiffness of a spring [N m/rad], or [N/m] at a prismatic joint; or (stiffness, free angle)."""


@dataclass(frozen=True, eq=False)
class Springs:
    """Springs of all n joints; nv of them are independent.

    Attributes:
        joints: Names of the joints, coupled ones included.
        stiffness: k (n,) [N m/rad], [N/m] for prismatic joints; 0: none.
        angle: q_0 (n,) without torque [rad], [m] for prismatic joints.
    """

    joints: tuple[str, ...]
    stiffness: Array
    angle: Array
    _coupling: Coupling | None = None

    def torque(self, q: Array) -> Array:
        """Compute the derivative of the energy ½ Σ k (θ − q_0)² by q (nv,) [N m]."""
        if self._coupling is None:
            return self.stiffness * (q - self.angle)
        pulled = self.stiffness * (self._coupling.angles(q) - self.angle)
        return np.asarray(pulled @ self._coupling.matrix)

    @cached_property
    def matrix(self) -> Array:
        """Second derivative of the energy (nv, nv) [N m/rad]: diag k, or Sᵀ diag k S."""
        K = np.diag(self.stiffness)
        return frozen(self._coupling.square(K) if self._coupling else K)

    @property
    def sprung(self) -> list[int]:
        """Indices of the joints that have a spring."""
        return np.flatnonzero(self.stiffness).tolist()

    @cached_property
    def rest(self) -> Array:
        """Joint angles q (nv,) [rad] where the springs rest; 0 where there are none."""
        if self._coupling is None:
            return self.angle
        S, root = self._coupling.matrix, np.sqrt(self.stiffness)
        free = root * (self.angle - self._coupling.offset)
        found = np.linalg.lstsq(S * root[:, None], free, rcond=None)[0]
        return frozen(np.asarray(found, dtype=np.float64))


def springs_of(given: object, joints: tuple[str, ...], coupling: Coupling | None) -> Springs:
    """Check springs by the name of their joint, and return those of all ``joints``.

    Raises InvalidInput, also if there is no such joint.
    """
    if not isinstance(given, Mapping):
        said = f"{given!r} given; give a dict of joint names and stiffnesses [N m/rad]."
        raise InvalidInput("springs", said)
    k, angle = np.zeros(len(joints)), np.zeros(len(joints))
    for name, spring in given.items():
        j = joints.index(one_of("joint", name, joints))
        pair = list(spring) if isinstance(spring, Sequence) else [spring, 0.0]
        if len(pair) != 2:
            raise InvalidInput(f"springs[{name!r}]", "give a stiffness, or (stiffness, angle).")
        k[j], angle[j] = (scalar(f"springs[{name!r}]", each) for each in pair)
        if fault := within("spring", k[j], zero=True):
            raise InvalidInput(f"springs[{name!r}]", f"{fault}.")
    return Springs(joints, frozen(k), frozen(angle), coupling)
