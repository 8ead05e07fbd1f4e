"""Layout of a record: the quantities of one posture, one after the other."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cdsm.kernels.tree import Indices
from cdsm.support.status import Status

Codes = NDArray[np.uint8]
Flags = NDArray[np.bool_]

# kernels take plain integers
OK = int(Status.OK)
BEYOND_LIMITS = int(Status.BEYOND_LIMITS)
COINCIDENT_SITES = int(Status.COINCIDENT_SITES)
INFEASIBLE = int(Status.INFEASIBLE)
OUTSIDE_ELASTICITY = int(Status.OUTSIDE_ELASTICITY)
SINGULAR = int(Status.SINGULAR)
IMMOBILE = int(Status.IMMOBILE)
UNDECIDED = 255
"""Internal status: the guess of tensions is not optimal; a search or a solver follows."""
POSTPONED = 254
"""Internal status: the tensions exist; what needs them is computed beside other postures."""

QUANTITIES = (
    "tip",
    "jacobian",
    "cable_lengths",
    "length_jacobian",
    "gravity_torque",
    "gravity",
    "tension",
    "residual",
    "active",
    "load",
    "cable_stiffness",
    "passive",
    "joint",
    "stuck_joint",
    "margin",
    "pseudoinverse",
    "along",
    "compliance",
    "cartesian",
    "stuck_along",
    "stuck_compliance",
    "breakaway",
)
"""Quantities in the order of the record: those of the joint angles alone; then those that also need
tensions; the rigidity of the cables; a regular K_θ; a regular K_θ of the stuck arm."""

(
    TIP,
    JACOBIAN,
    CABLE_LENGTHS,
    LENGTH_JACOBIAN,
    GRAVITY_TORQUE,
    GRAVITY,
    TENSION,
    RESIDUAL,
    ACTIVE,
    LOAD,
    CABLE_STIFFNESS,
    PASSIVE,
    JOINT,
    STUCK_JOINT,
    MARGIN,
    PSEUDOINVERSE,
    ALONG,
    COMPLIANCE,
    CARTESIAN,
    STUCK_ALONG,
    STUCK_COMPLIANCE,
    BREAKAWAY,
) = range(len(QUANTITIES))

DIRECTIONAL = ("along", "stuck_along", "breakaway")
"""Quantities that have a value for each direction."""


def shapes(nv: int, cables: int, directions: int) -> tuple[tuple[int, ...], ...]:
    """Return the shape of each quantity at one posture, for nv joint coordinates."""
    matrix = (nv, nv)
    return (
        (4, 4),
        (6, nv),
        (cables,),
        (cables, nv),
        (nv,),
        matrix,
        (cables,),
        (nv,),
        matrix,
        matrix,
        (cables,),
        matrix,
        matrix,
        matrix,
        (),
        (3, 3),
        (directions,),
        (6, 6),
        (3, 3),
        (directions,),
        (6, 6),
        (directions,),
    )


def starts(nv: int, cables: int, directions: int) -> Indices:
    """Return the index at which each quantity begins in a record, and the record's length.

    A record is the row of all quantities of a posture.
    """
    sizes = [math.prod(shape) for shape in shapes(nv, cables, directions)]
    return np.array([0, *np.cumsum(sizes)], dtype=np.intp)
