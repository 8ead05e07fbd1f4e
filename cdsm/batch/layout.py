"""The record of a row: the quantities of a posture under tension, one after the other."""

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
"""The kernel certifies nothing; ``distribute_tension`` decides the row."""

QUANTITIES = (
    "tip",
    "jacobian",
    "cable_lengths",
    "length_jacobian",
    "gravity_torque",
    "gravity",
    "residual",
    "active",
    "load",
    "cable_stiffness",
    "passive",
    "joint",
    "margin",
    "pseudoinverse",
    "along",
    "compliance",
    "cartesian",
)
"""In the order of the record: first those of the joint angles alone, then those that need tensions,
then those that need the rigidity of the cables too, and last those that need a regular K_θ."""

(
    TIP,
    JACOBIAN,
    CABLE_LENGTHS,
    LENGTH_JACOBIAN,
    GRAVITY_TORQUE,
    GRAVITY,
    RESIDUAL,
    ACTIVE,
    LOAD,
    CABLE_STIFFNESS,
    PASSIVE,
    JOINT,
    MARGIN,
    PSEUDOINVERSE,
    ALONG,
    COMPLIANCE,
    CARTESIAN,
) = range(len(QUANTITIES))


def shapes(nv: int, cables: int, directions: int) -> tuple[tuple[int, ...], ...]:
    """Shape of each quantity, for one row."""
    matrix = (nv, nv)
    return (
        (4, 4),
        (6, nv),
        (cables,),
        (cables, nv),
        (nv,),
        matrix,
        (nv,),
        matrix,
        matrix,
        (cables,),
        matrix,
        matrix,
        (),
        (3, 3),
        (directions,),
        (6, 6),
        (3, 3),
    )


def starts(nv: int, cables: int, directions: int) -> Indices:
    """Where each quantity begins in the record, and where the last one ends."""
    sizes = [math.prod(shape) for shape in shapes(nv, cables, directions)]
    return np.array([0, *np.cumsum(sizes)], dtype=np.intp)
