"""Arms with locked motors: of all laws, springs and drives, and one hinge in closed form."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

import cdsm
from cdsm import presets
from cdsm._checks import Array
from tests import arms
from tests.differences import gravity_energy

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


def potential(pose: cdsm.Posture, tension: Array, force: Array) -> Callable[[cdsm.Posture], float]:
    """Π = Σ E_c(F_c) + Σ F_0 L_c + V − f·x, cable by cable, from what a Cable says alone."""
    cables = pose.arm.cables
    starts = [
        float(cable.elongation(F, l0)) if cable.control == "position" else 0.0
        for cable, F, l0 in zip(cables, tension, pose.cable_lengths, strict=True)
    ]

    def energy(there: cdsm.Posture) -> float:
        total = gravity_energy(there) - float(force @ there.tip[:3, 3])
        longer = there.cable_lengths - pose.cable_lengths
        for c, cable in enumerate(cables):
            if cable.control == "force":
                total += tension[c] * longer[c]
                continue
            l0, elongation = pose.cable_lengths[c], starts[c] + longer[c]
            if elongation > 0.0 or cable.elasticity.domain.low > 0.0:
                total += float(cable.energy(cable.tension(elongation, l0), l0))
        return total

    return energy


def balanced(name: str, seed: int = 11, moment: bool = True) -> tuple[cdsm.Posture, cdsm.Tension]:
    arm = some_arm(name)
    pose = arms.random_posture(arm, seed, reach=0.25)
    pull = cdsm.distribute_tension(pose, minimum=40.0, wrench=arms.random_wrench(4, moment))
    assert cdsm.stiffness(pose, pull).is_stable
    return pose, pull


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
    geometry = cdsm.Geometry.hinged(**{**SIZES, "joint_limit": limit, **sizes})
    return cdsm.Manipulator(geometry, law or cdsm.LinearElasticity(EA), gravity=gravity)


def half(side: float, angle: float) -> tuple[float, float]:
    """L and dL/dθ of the cable above (+1) or below (−1) the hinge: 2(h cos θ/2 + R sin θ/2)."""
    s, c = math.sin(angle / 2.0), math.cos(angle / 2.0)
    return 2.0 * (H * c + side * R * s), -H * s + side * R * c


def pulls(angle: float, locked: float = 0.0) -> tuple[float, float]:
    """F of the cables above and below, locked at an angle with 20 N each."""
    lengths = [(half(side, locked)[0], half(side, angle)[0]) for side in (1.0, -1.0)]
    above, below = (max(20.0 + EA * (L / l0 - 1.0), 0.0) for l0, L in lengths)
    return above, below


def restoring(angle: float, locked: float = 0.0) -> float:
    """Torque of both."""
    above, below = pulls(angle, locked)
    return above * half(1.0, angle)[1] + below * half(-1.0, angle)[1]


MOMENT = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0])


SOFT = 20.0
"""EA [N] of cables that let the hinge buckle: K_θ = EA R²/h − F h − P ℓ = 1.8 − 0.2 − P/10."""


def compressed(
    angle: float, load: float, pretension: float = 20.0, rigidity: float = SOFT
) -> float:
    """Potential of the hinge, locked straight, under a force along its axis."""
    energy = load * LENGTH * math.cos(angle)
    for side in (1.0, -1.0):
        stretched = pretension / rigidity + half(side, angle)[0] / (2.0 * H) - 1.0
        energy += rigidity * 2.0 * H * max(stretched, 0.0) ** 2 / 2.0
    return energy
