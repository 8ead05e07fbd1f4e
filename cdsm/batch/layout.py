"""Layout of a record, an array of all quantities of one posture, one after the other."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdsm._former.tree import Indices
from cdsm.support.status import Status

Codes = NDArray[np.uint8]
Flags = NDArray[np.bool_]

# kernels take plain integers
OK = int(Status.OK)
BEYOND_LIMITS = int(Status.BEYOND_LIMITS)
COINCIDENT_SITES = int(Status.COINCIDENT_SITES)
INFEASIBLE = int(Status.INFEASIBLE)
OUTSIDE_ELASTICITY = int(Status.OUTSIDE_ELASTICITY)
UNDECIDED = 255
"""Internal status: the guess of tensions is not optimal; a search or a solver follows."""
POSTPONED = 254
"""Internal status: the tensions are known; quantities that need them are computed later."""

JOINTS: Final = ("joint", "joint_column")
MOTIONS: Final = ("motion", "motion_column")
AXES: Final = ("axis", "axis_column")

DIMENSIONS: Final[dict[str, tuple[tuple[str, ...], str]]] = {
    # these need the joint angles alone
    "tip": (("row", "column"), "1"),
    "jacobian": (("motion", "joint"), "1"),
    "cable_lengths": (("cable",), "m"),
    "length_jacobian": (("cable", "joint"), "lever"),
    "gravity_torque": (("joint",), "torque"),
    "gravity": (JOINTS, "stiffness"),
    # these also need tensions
    "tension": (("cable",), "N"),
    "residual": (("joint",), "torque"),
    "active": (JOINTS, "stiffness"),
    "load": (JOINTS, "stiffness"),
    # these also need the rigidity of the cables
    "cable_stiffness": (("cable",), "N/m"),
    "passive": (JOINTS, "stiffness"),
    "joint": (JOINTS, "stiffness"),
    # these also need a regular K_θ
    "margin": ((), "stiffness"),
    "pseudoinverse": (AXES, "N/m"),
    "along": (("direction",), "N/m"),
    "compliance": (MOTIONS, "1"),
    "cartesian": (AXES, "N/m"),
}
"""Dimensions and unit of each quantity, in the order in which a record contains them.

The unit is 1 for matrices whose entries have different SI units. Units of "torque",
"stiffness" and "lever" depend on the joints of the arm: N m, N m/rad and m/rad, or N, N/m and 1 for
prismatic joints.
"""

QUANTITIES: Final = tuple(DIMENSIONS)

TIP, JACOBIAN, CABLE_LENGTHS, LENGTH_JACOBIAN, GRAVITY_TORQUE, GRAVITY = range(6)
TENSION, RESIDUAL, ACTIVE, LOAD, CABLE_STIFFNESS, PASSIVE, JOINT = range(6, 13)
MARGIN, PSEUDOINVERSE, ALONG, COMPLIANCE, CARTESIAN = range(13, 18)

DIRECTIONAL: Final = tuple(name for name, (dims, _) in DIMENSIONS.items() if "direction" in dims)
"""Quantities that have a value for each direction."""


def shapes(nv: int, cables: int, directions: int) -> dict[str, tuple[int, ...]]:
    """Return the shape of each quantity at one posture.

    The arguments are the numbers of joints, of cables, and of directions u.
    """
    sizes = {"joint": nv, "cable": cables, "direction": directions}
    sizes |= {"row": 4, "column": 4, "motion": 6, "axis": 3}
    return {
        name: tuple(sizes[each.removesuffix("_column")] for each in dims)
        for name, (dims, _) in DIMENSIONS.items()
    }


def starts(shapes: Mapping[str, tuple[int, ...]]) -> Indices:
    """Return the index at which each quantity begins in a record; its length is the last entry."""
    sizes = [math.prod(shape) for shape in shapes.values()]
    return np.array([0, *np.cumsum(sizes)], dtype=np.intp)
