"""Springs at the joints of an arm: k (q − q_0) turns each joint back to its angle q_0."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from cdsm.errors import InvalidInput
from cdsm.support.validation import one_of, scalar, within
from cdsm.support.values import Array, frozen

Spring = float | Sequence[float]
"""Stiffness of a spring [N m/rad], or [N/m] at a prismatic joint; or (stiffness, free angle)."""


class Springs(NamedTuple):
    """Springs of all joints, in the order of q."""

    stiffness: Array  # k (nv,) [N m/rad], [N/m] for prismatic joints; 0: none
    angle: Array  # q_0 (nv,) without torque [rad], [m] for prismatic joints

    def torque(self, q: Array) -> Array:
        """Compute k (q − q_0) (nv,) [N m]."""
        return self.stiffness * (q - self.angle)

    def energy(self, q: Array) -> float:
        """Compute ½ Σ k (q − q_0)² [J]."""
        return float(0.5 * self.stiffness @ (q - self.angle) ** 2)


def springs_of(given: object, joints: Sequence[str]) -> Springs:
    """Check springs by the name of their joint, and return those of all ``joints``.

    Raises InvalidInput, or UnknownName if there is no such joint.
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
    return Springs(frozen(k), frozen(angle))
