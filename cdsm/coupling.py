"""Coupled joints: θ = S φ + θ_0 for the angles θ of all joints and φ of the independent ones.

A joint of a URDF that mimics another one has θ = multiplier · θ_leader + offset. S is constant, so
torques become Sᵀ τ and stiffness Sᵀ K S, without further terms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from lxml import etree

from cdsm.errors import GeometryError
from cdsm.support.values import Array, frozen


class Mimic(NamedTuple):
    """What a joint does: multiplier · the angle of the joint ``leader`` + offset [rad or m]."""

    leader: str
    multiplier: float
    offset: float


class Coupling(NamedTuple):
    """All n joints as functions of the nv independent ones."""

    matrix: Array  # S (n, nv)
    offset: Array  # θ_0 (n,)
    leaders: tuple[int, ...]  # the independent joints among all

    def angles(self, q: Array) -> Array:
        """Compute the angles θ (…, n) of all joints from those of the independent ones."""
        return np.asarray(q @ self.matrix.T + self.offset)

    def square(self, matrix: Array) -> Array:
        """Compute Sᵀ K S (…, nv, nv)."""
        return np.asarray(self.matrix.T @ matrix @ self.matrix)


def mimics_of(robot: etree._Element) -> dict[str, Mimic]:
    """Return what each joint of a URDF mimics, if it does."""
    found = {}
    for joint in robot.iterfind("joint"):
        if (mimic := joint.find("mimic")) is not None:
            numbers = (float(mimic.get(key) or default) for key, default in _DEFAULTS.items())
            found[str(joint.get("name"))] = Mimic(str(mimic.get("joint")), *numbers)
    return found


_DEFAULTS = {"multiplier": 1.0, "offset": 0.0}


def coupling_of(mimics: Mapping[str, Mimic], names: Sequence[str]) -> Coupling | None:
    """Multiply chains of followers out; None if no joint follows.

    Raises GeometryError if joints follow each other in a circle, or one that does not move.
    """
    if not mimics:
        return None
    leaders = [name for name in names if name not in mimics]
    S, offset = np.zeros((len(names), len(leaders))), np.zeros(len(names))
    for i, name in enumerate(names):
        factor, way = 1.0, [name]
        while (mimic := mimics.get(way[-1])) is not None:
            offset[i] += factor * mimic.offset
            factor *= mimic.multiplier
            if mimic.leader in way:
                raise GeometryError(f"joints mimic each other in a circle: {' → '.join(way)}.")
            if mimic.leader not in names:
                said = f"joint {way[-1]}: mimics {mimic.leader!r}, which is no joint that moves."
                raise GeometryError(said)
            way.append(mimic.leader)
        S[i, leaders.index(way[-1])] = factor
    return Coupling(frozen(S), frozen(offset), tuple(names.index(name) for name in leaders))


def limits_of(coupling: Coupling, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return the limits of φ (nv,) that keep all joints within theirs (n,)."""
    low, high = np.full(len(coupling.leaders), -np.inf), np.full(len(coupling.leaders), np.inf)
    for i, j in zip(*np.nonzero(coupling.matrix), strict=True):
        factor = coupling.matrix[i, j]
        ends = sorted((end - coupling.offset[i]) / factor for end in (lower[i], upper[i]))
        low[j], high[j] = max(low[j], ends[0]), min(high[j], ends[1])
    return frozen(low), frozen(high)
