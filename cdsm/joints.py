"""Joints that follow others.

A joint of a URDF that mimics another one has θ = multiplier · θ_leader + offset. So the angles of
all joints are θ = S q + θ_0 with a constant S: torques become Sᵀ τ and stiffness Sᵀ K S, without
further terms. S also permutes joints whose order the user chose.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from lxml import etree

from cdsm.errors import GeometryError, InvalidInput, listed
from cdsm.support.values import Array, frozen

_LOGGED = math.radians(1.0)  # largest error of a logged follower [rad]


class Mimic(NamedTuple):
    """What a joint does: multiplier · the angle of the joint ``leader`` + offset [rad or m]."""

    leader: str
    multiplier: float
    offset: float


class Coupling(NamedTuple):
    """All n joints, in Pinocchio's order, as functions of the nv independent ones of q."""

    matrix: Array  # S (n, nv)
    offset: Array  # θ_0 (n,)
    leaders: tuple[int, ...]  # the independent joints among all

    def angles(self, q: Array) -> Array:
        """Compute the angles θ (…, n) of all joints from those of the independent ones."""
        return np.asarray(q @ self.matrix.T + self.offset)

    def square(self, matrix: Array) -> Array:
        """Compute `Sᵀ K S` (…, nv, nv)."""
        return np.asarray(self.matrix.T @ matrix @ self.matrix)


def mimics_of(robot: etree._Element) -> dict[str, Mimic]:
    """Return what each joint of a URDF mimics, if it does."""
    mimics = {}
    for joint in robot.iterfind("joint"):
        if (mimic := joint.find("mimic")) is not None:
            factor = mimic.get("multiplier") or 1.0
            offset = mimic.get("offset") or 0.0
            follower = Mimic(str(mimic.get("joint")), float(factor), float(offset))
            mimics[str(joint.get("name"))] = follower
    return mimics


def coupling_of(
    mimics: Mapping[str, Mimic], names: tuple[str, ...], leaders: tuple[str, ...]
) -> Coupling | None:
    """Multiply chains of followers out; None if no joint follows and the order is the same.

    Raises GeometryError if joints follow each other in a circle, or one that does not move.
    """
    if names == leaders:
        return None
    S = np.zeros((len(names), len(leaders)))
    offset = np.zeros(len(names))
    for i, name in enumerate(names):
        factor = 1.0
        way = [name]
        while (mimic := mimics.get(way[-1])) is not None:
            offset[i] += factor * mimic.offset
            factor *= mimic.multiplier
            if mimic.leader in way:
                raise GeometryError(f"joints mimic each other in a circle: {' → '.join(way)}.")
            if mimic.leader not in names:
                problem = f"joint {way[-1]}: mimics {mimic.leader!r}, which is no joint that moves."
                raise GeometryError(problem)
            way.append(mimic.leader)
        S[i, leaders.index(way[-1])] = factor
    return Coupling(frozen(S), frozen(offset), tuple(names.index(name) for name in leaders))


class CoupledLimits(NamedTuple):
    """Limits of the nv independent joints that keep all n joints within theirs."""

    lower: Array  # (nv,)
    upper: Array  # (nv,)
    narrowing: tuple[tuple[str, ...], ...]  # for each joint, the followers that narrow its limits


def limits_of(
    coupling: Coupling, names: tuple[str, ...], lower: Array, upper: Array
) -> CoupledLimits:
    """Return the limits of φ (nv,) that keep all joints ``names`` within theirs (n,).

    Raises GeometryError if a joint and its followers have no angle in common.
    """
    low = lower[list(coupling.leaders)].copy()
    high = upper[list(coupling.leaders)].copy()
    narrowing: list[tuple[str, ...]] = [() for _ in coupling.leaders]
    for i, j in zip(*np.nonzero(coupling.matrix), strict=True):
        factor = coupling.matrix[i, j]
        ends = sorted((end - coupling.offset[i]) / factor for end in (lower[i], upper[i]))
        if ends[0] > low[j] or ends[1] < high[j]:
            narrowing[j] += (names[i],)
        low[j] = max(low[j], ends[0])
        high[j] = min(high[j], ends[1])
    for j in np.flatnonzero(low > high).tolist():
        leader = names[coupling.leaders[j]]
        problem = f"{leader} has no possible angle: {listed(narrowing[j])}, which mimics it, keeps "
        problem += f"its own limits only where {leader} is beyond its limits. Change a limit, or "
        raise GeometryError(f"{problem}multiplier or offset of the <mimic>.")
    return CoupledLimits(frozen(low), frozen(high), tuple(narrowing))


def require_followers(
    coupling: Coupling | None, names: Sequence[str], q: Array, logged: Mapping[str, Array]
) -> None:
    """Raise InvalidInput if a logged follower is not where its leader puts it, within 1°.

    ``q`` are the angles (S, nv) of the independent joints, ``logged`` those (S,) of followers.
    """
    if coupling is None or not logged:
        return
    angles = coupling.angles(q)
    for name, values in logged.items():
        i = names.index(name)
        expected = angles[:, i]
        off = abs(values - expected)
        k = int(off.argmax())
        if off[k] > _LOGGED:
            leader = names[coupling.leaders[int(abs(coupling.matrix[i]).argmax())]]
            problem = (
                f"reading {k + 1}: {values[k]:.4g} given, but {leader}, which it mimics, puts "
            )
            remedy = f"it at {expected[k]:.4g} [rad, m]. Leave the column out, or correct <mimic>."
            raise InvalidInput(name, problem + remedy)
