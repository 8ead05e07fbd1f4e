"""Arms with locked motors: of all laws, springs and drives, and one hinge in closed form."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

import cdsm
from cdsm import presets
from cdsm.support.values import Array
from tests.support import arms
from tests.support.differences import gravity_energy

STRAND = presets.STRAND_1X19
# a strand from zero on, EA from 3 kN up; few points, since its third derivative jumps at them
POINTS = np.array([0.0, 30.0, 250.0, 600.0, 900.0])
TABLE = cdsm.TabulatedElasticity(
    tuple(POINTS), tuple(np.log1p(POINTS * 60.0 / 3e3) / 60.0 + POINTS * 1e-6)
)
LAWS: dict[str, cdsm.Elasticity] = {
    "linear": cdsm.LinearElasticity(48e3),
    "strand": STRAND,
    "table": TABLE,
}


def hybrid(arm: cdsm.Manipulator, laws: list[cdsm.Elasticity]) -> cdsm.Manipulator:
    """The arm with cables of all laws in turn: some behind springs, some under force control."""
    rng = np.random.default_rng(5)
    cables = [
        replace(
            cable,
            elasticity=laws[c % len(laws)],
            series_stiffness=float(rng.choice([math.inf, 1e5, 4e5])),
            control="force" if c % 5 == 4 else "position",
        )
        for c, cable in enumerate(arm.cables)
    ]
    return cdsm.Manipulator(arm.geometry, cables=cables, gravity=arm.gravity)


def some_arm(name: str) -> cdsm.Manipulator:
    kind, joints, seed, law = name.split("-")
    laws = list(LAWS.values()) if law == "all" else [LAWS[law]]
    if kind == "mixed":
        return hybrid(arms.mixed_arm(), laws)
    return hybrid(arms.random_arm(int(seed), int(joints), kind), laws)


# kind, joints, seed and law: arms that are stable, by a good margin, though some cables hold force
ARMS = [
    "universal-1-2-strand",
    "universal-3-8-all",
    "universal-5-9-strand",
    "hinged-2-4-table",
    "hinged-4-0-all",
    "mixed-3-0-all",
]


def original_length(cable: cdsm.Cable, F: float, L: float) -> float:
    """l_0 of a cable that is L long under F, from what a Cable says of its elongation alone."""
    return float(
        brentq(lambda l0: l0 + float(cable.elongation(F, l0)) - L, 1e-9, 2.0 * L, xtol=1e-15)
    )


def original_lengths(pose: cdsm.Posture, tension: Array) -> Array:
    """l_0 of the position-controlled cables, L of the others (C,)."""
    return np.array(
        [
            original_length(cable, F, L) if cable.control == "position" else L
            for cable, F, L in zip(pose.arm.cables, tension, pose.cable_lengths, strict=True)
        ]
    )


def potential(
    pose: cdsm.Posture,
    tension: Array,
    force: Array,
    weight: Callable[[cdsm.Posture], float] = gravity_energy,
) -> Callable[[cdsm.Posture], float]:
    """Π = Σ E_c(F_c) + Σ F_0 L_c + V − f·x, cable by cable, from what a Cable says alone."""
    cables = pose.arm.cables
    free = original_lengths(pose, tension)

    def energy(there: cdsm.Posture) -> float:
        total = weight(there) - float(force @ there.tip[:3, 3])
        longer = there.cable_lengths - free
        for c, cable in enumerate(cables):
            if cable.control == "force":
                total += tension[c] * longer[c]
                continue
            l0, elongation = free[c], longer[c]
            if elongation > 0.0 or cable.elasticity.low > 0.0:
                total += float(cable.energy(cable.tension(elongation, l0), l0))
        return total

    return energy


def balanced(name: str, seed: int = 11, moment: bool = True) -> tuple[cdsm.Posture, cdsm.Tension]:
    arm = some_arm(name)
    pose = arms.random_posture(arm, seed, reach=0.25)
    pull = cdsm.distribute_tension(pose, minimum=40.0, wrench=arms.random_wrench(4, moment))
    assert cdsm.stiffness(pose, pull).is_stable
    return pose, pull


def unbalanced_torque(K: cdsm.Stiffness) -> Callable[[Array], Array]:
    """What is out of balance at other angles, motors locked, from lengths and weights alone."""

    def torque(q: Array) -> Array:
        pose = K.posture.arm.at(q, check_limits=False)
        F = K.tension + K.cable_stiffness * (pose.cable_lengths - K.posture.cable_lengths)
        return F @ pose.length_jacobian + pose.gravity_torque - K.wrench @ pose.jacobian

    return torque


# --- one hinge, closed form -----------------------------------------------------------------

SIZES: dict[str, Any] = {
    "joints": 1,
    "twist": 0.0,
    "link_length": 0.1,
    "base_length": 0.02,
    "disk_offset": 0.01,
    "hole_radius": 0.03,
    "link_mass": 0.0,
}
H, R, LENGTH = 0.01, 0.03, 0.1
EA = 2e3


def hinge(
    limit: float | None = None,
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    law: cdsm.Elasticity | None = None,
    **sizes: Any,
) -> cdsm.Manipulator:
    """Hinges about y, of one joint unless ``sizes`` of the geometry say otherwise."""
    geometry = cdsm.Geometry.hinged(**{**SIZES, "joint_limit": limit, **sizes})
    law = law or cdsm.LinearElasticity(EA)
    return cdsm.Manipulator(geometry, law, gravity=gravity)


def half(side: float, angle: float) -> tuple[float, float]:
    """L and dL/dθ of the cable above (+1) or below (−1) the hinge: 2(h cos θ/2 + R sin θ/2)."""
    s, c = math.sin(angle / 2.0), math.cos(angle / 2.0)
    return 2.0 * (H * c + side * R * s), -H * s + side * R * c


def pulls(angle: float, locked: float = 0.0) -> tuple[float, float]:
    """F of the cables above and below, locked at an angle with 20 N each."""
    lengths = [(half(side, locked)[0], half(side, angle)[0]) for side in (1.0, -1.0)]
    # l_0 = L/(1 + 20 N/EA) where they were locked
    above, below = (max(EA * (L * (1.0 + 20.0 / EA) / start - 1.0), 0.0) for start, L in lengths)
    return above, below


def restoring(angle: float, locked: float = 0.0) -> float:
    """Torque of both."""
    above, below = pulls(angle, locked)
    return above * half(1.0, angle)[1] + below * half(-1.0, angle)[1]


MOMENT = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0])


SOFT, LEAD = 980.0, 0.98
"""EA [N] and lead [m] of cables that let the hinge buckle.

K_θ = 2 (EA + F) R²/(LEAD + 2h) − F h − P ℓ = 1.8 − 0.2 − P/10 at 20 N. Without a lead no linear law
could: EA/l_0 is more than F/L.
"""


def soft(F: float) -> float:
    """K_θ [N m/rad] of the straight soft hinge, both cables at F."""
    return 2.0 * (SOFT + F) * R**2 / (LEAD + 2.0 * H) - F * H


BUCKLING = 2.0 * SOFT * R**2 / ((LEAD + 2.0 * H) * H - 2.0 * R**2)
"""The tension [N] at which that is zero: 215 N."""


def soft_hinge(**sizes: Any) -> cdsm.Manipulator:
    return hinge(law=cdsm.LinearElasticity(SOFT), lead=LEAD, **sizes)


def compressed(angle: float, load: float, pretension: float = 20.0) -> float:
    """Potential of the soft hinge, locked straight, under a force along its axis."""
    energy = load * LENGTH * math.cos(angle)
    free = (LEAD + 2.0 * H) / (1.0 + pretension / SOFT)
    for side in (1.0, -1.0):
        stretched = (LEAD + half(side, angle)[0]) / free - 1.0
        energy += SOFT * free * max(stretched, 0.0) ** 2 / 2.0
    return energy
