"""Random arms, postures and loads that the tests share. All reproducible from a seed."""

from typing import Any

import numpy as np

import cdsm
from cdsm import presets
from cdsm.support.values import Array

STEEL = cdsm.LinearElasticity.of_wire(200e9, 1.2e-3)


def random_arm(
    seed: int,
    joints: int,
    kind: str = "universal",
    elasticity: cdsm.Elasticity = STEEL,
) -> cdsm.Manipulator:
    """An arm of the given kind ("universal" or "hinged") with random sizes, mass and gravity."""
    rng = np.random.default_rng([seed, joints])
    disk_offset = rng.uniform(0.006, 0.012)
    sizes: dict[str, Any] = {
        "joints": joints,
        "link_length": rng.uniform(0.03, 0.08),
        "base_length": rng.uniform(0.0, 0.05),
        "disk_offset": disk_offset,
        "hole_radius": rng.uniform(1.5, 4.0) * disk_offset,
        "link_mass": rng.uniform(0.02, 0.5),
        "lead": rng.uniform(0.0, 0.5),
    }
    if kind == "universal":
        geometry = cdsm.Geometry.universal(cables_per_joint=int(rng.integers(3, 5)), **sizes)
    else:
        geometry = cdsm.Geometry.hinged(twist=rng.uniform(-1.5, 1.5), **sizes)
    return cdsm.Manipulator(geometry, elasticity, gravity=rng.normal(0.0, 6.0, 3))


README_SIZES = {
    "link_length": 0.06,
    "base_length": 0.03,
    "disk_offset": 0.012,
    "hole_radius": 0.025,
    "link_mass": 0.12,
    "lead": 0.3,
}
"""Lengths [m] and mass [kg] of README's arm."""


def readme_geometry(**changes: Any) -> cdsm.Geometry:
    """The geometry of README, with some of its sizes changed."""
    sizes: dict[str, Any] = {"joints": 4, "cables_per_joint": 3, **README_SIZES}
    return cdsm.Geometry.universal(**(sizes | changes))


def prototype(
    elasticity: cdsm.Elasticity = presets.STRAND_1X19, minimum: float = 50.0, **options: Any
) -> tuple[cdsm.Posture, cdsm.Tension]:
    """The paper's virtual prototype, 10° at every joint, and its least tensions [N]."""
    arm = presets.virtual_prototype(elasticity, **options)
    pose = arm.at(np.full(arm.nv, presets.TEN_DEGREES))
    return pose, cdsm.distribute_tension(pose, minimum)


def mixed_arm() -> cdsm.Manipulator:
    """A heterogeneous arm: hinges and universal joints, unequal links, cables that end early."""
    geometry = cdsm.Geometry(
        name="mixed",
        base_length=0.03,
        hole_radius=0.02,
        joints=(
            cdsm.Joint(axes=((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), disk_offset=0.008),
            cdsm.Joint(axes=((0.1, 1.0, 0.3),), disk_offset=0.006, limit=0.5),
            cdsm.Joint(axes=((0.0, 0.3, 1.0), (0.0, 1.0, 0.2)), disk_offset=0.01, limit=0.4),
        ),
        links=(
            cdsm.Link(length=0.05, mass=0.2),
            cdsm.Link(length=0.03, mass=0.0),
            cdsm.Link(length=0.06, mass=0.35),
        ),
        cables=(
            *(cdsm.CableRoute(joint=1, angle=a, lead=0.1) for a in (0.1, 2.3, 4.0)),
            *(cdsm.CableRoute(joint=2, angle=a) for a in (0.9, 4.1)),
            *(cdsm.CableRoute(joint=3, angle=a, lead=0.3) for a in (0.4, 2.0, 3.3, 5.5)),
        ),
    )
    return cdsm.Manipulator(geometry, STEEL, gravity=(1.0, -3.0, -9.0))


def random_posture(arm: cdsm.Manipulator, seed: int, reach: float = 0.6) -> cdsm.Posture:
    """A posture with every angle within ``reach`` of its limits."""
    rng = np.random.default_rng([seed, arm.nv])
    return arm.at(rng.uniform(-reach, reach, arm.nv) * arm.upper)


def random_tension(arm: cdsm.Manipulator, seed: int) -> Array:
    """Tensions from 20 to 120 N, which need not balance anything."""
    return np.random.default_rng([seed, arm.nv, 1]).uniform(20.0, 120.0, len(arm.cables))


def random_wrench(seed: int, moment: bool = True) -> Array:
    """A wrench of some newtons, and some tenths of a newton metre if wanted."""
    wrench = np.random.default_rng([seed, 2]).normal(0.0, 3.0, 6)
    wrench[3:] *= 0.1 if moment else 0.0
    return wrench
