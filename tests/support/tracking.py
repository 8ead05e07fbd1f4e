"""Arms and paths that are followed in closed loop."""

from functools import cache

import numpy as np

import cdsm
from cdsm import presets
from cdsm.planning.path_plan import PathPlan
from cdsm.support.values import Array
from tests.support.arms import readme_geometry

WANTED = 4000.0
"""Stiffness along z [N/m] of :func:`circle`."""


def paid_out(plan: PathPlan) -> Array:
    """Wire that the motors pay out at each sample of a plan (P, C) [m]."""
    pairs = zip(plan.cable_lengths, plan.tensions, strict=True)
    return np.array([plan.arm.laws.original_lengths(L, F) for L, F in pairs])


@cache
def small_path(
    friction: float = 0.0, lead: float = 0.1, target: float | tuple[float, ...] = 15e3
) -> PathPlan:
    """Two universal joints with the strand of Eq. 19; three samples of a bend."""
    geometry = readme_geometry(joints=2, hole_radius=0.02, link_mass=0.05, lead=lead)
    arm = cdsm.Manipulator(geometry, presets.STRAND_1X19).with_friction(friction)
    angles = np.deg2rad([[6.0, -4.0, 5.0, 3.0], [7.0, -3.0, 6.0, 3.0], [8.0, -2.0, 7.0, 3.0]])
    return cdsm.plan_path(arm, "z", target, 10.0, 250.0, angles=angles)


@cache
def coupled_path() -> PathPlan:
    """Four universal joints that bend alike, held by the cables of the last one."""
    geometry = readme_geometry(hole_radius=0.02, link_mass=0.05, lead=0.1, coupled=True)
    arm = cdsm.Manipulator(geometry, presets.STRAND_1X19)
    arm = arm.with_cables([each for each in arm.cables if each.name.startswith("cable4")])
    angles = np.deg2rad([[6.0, -4.0], [7.0, -3.0], [8.0, -2.0]])
    return cdsm.plan_path(arm, "z", 3e3, 10.0, 250.0, angles=angles)


@cache
def circle(friction: float, samples: int = 13) -> PathPlan:
    """Five universal joints, whose tip draws a circle of 15 mm at 4 N/mm along z."""
    geometry = readme_geometry(joints=5, hole_radius=0.02, link_mass=0.05, lead=0.1)
    arm = cdsm.Manipulator(geometry, presets.STRAND_1X19).with_friction(friction)
    bent = np.deg2rad(np.tile([6.0, -4.0], 5))
    turn = np.linspace(0.0, 2.0 * np.pi, samples)
    way = np.array([0.0 * turn, np.cos(turn), np.sin(turn)]).T
    tips = arm.at(bent).tip[:3, 3] + [-0.006, -0.015, 0.02] + 0.015 * way
    return cdsm.plan_path(arm, "z", WANTED, 10.0, 250.0, tips=tips, guess=bent)
