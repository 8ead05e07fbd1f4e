"""Quantities of a sweep: names, units and dimensions in Dataset, store, CSV and maps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, final

Needs = Literal["posture", "tension", "stiffness", "stable arm"]


@final
@dataclass(frozen=True)
class Quantity:
    """Description of an output of a sweep, which is a variable of the Dataset."""

    needs: Needs  # what must exist for the quantity to exist
    long_name: str  # in words
    units: str  # SI, in the notation of UDUNITS
    dims: tuple[str, ...]  # its own dimensions, after those of poses and cases


CASES: Final = ("wrench", "minimum")
"""Dimensions of the cases; each exists only if several values of the argument are given."""

_JOINTS = ("joint", "joint_column")
_AXES = ("axis", "axis_column")
_K = "N m rad-1"

_TABLE: dict[Needs, dict[str, tuple[str, ...]]] = {  # words, unit and dimensions
    "posture": {
        "tip_position": ("position of the tip in base axes", "m", "axis"),
        "cable_lengths": ("cable lengths L, lead included (Eq. 8)", "m", "cable"),
        "gravity_torque": ("gravity torque g = dV/dq", "N m", "joint"),
        "gravity_stiffness": ("gravity part of K, dg/dq", _K, *_JOINTS),
        "tension_factor": ("largest min F / max F with J_L^T F = 0; 0: no wrench closure", "1"),
        "cable_clearance": ("least distance of two cables", "m"),
        "link_clearance": ("least distance of a cable from a backbone", "m"),
        "disk_clearance": ("least distance of a cable from a disk, or its hole's edge", "m"),
    },
    "tension": {
        "tension": ("least cable tensions F in balance (Eq. 17)", "N", "cable"),
        "payload": ("largest force in a direction within the tension limits", "N", "direction"),
        "force_radius": ("largest force in any direction within the tension limits", "N"),
    },
    "stiffness": {
        "cable_stiffness": ("cable stiffness, diagonal of K_L", "N m-1", "cable"),
        "active_stiffness": ("active part of K, H_L F (Eq. 16)", _K, *_JOINTS),
        "passive_stiffness": ("passive part of K, J_L^T K_L J_L (Eq. 16)", _K, *_JOINTS),
        "load_stiffness": ("load part of K (Eq. 16)", _K, *_JOINTS),
        "joint_stiffness": ("joint stiffness K (Eq. 16)", _K, *_JOINTS),
        "margin": ("stability margin, smallest eigenvalue of the symmetric part of K", _K),
        "translational_compliance": ("compliance C_vv, motion per force", "m N-1", *_AXES),
        "along": ("stiffness in a direction, 1/(u^T C_vv u) (Eq. 20)", "N m-1", "direction"),
        "cartesian": ("Cartesian stiffness, inverse of C_vv", "N m-1", *_AXES),
        "pseudoinverse": ("the paper's Cartesian stiffness, J+^T K J+", "N m-1", *_AXES),
    },
    "stable arm": {
        "softest": ("stiffness in the softest direction", "N m-1"),
        "stiffest": ("stiffness in the stiffest direction", "N m-1"),
        "isotropy": ("softest over stiffest", "1"),
        "softest_direction": ("softest direction, unit length", "1", "axis"),
        "stiffest_direction": ("stiffest direction, unit length", "1", "axis"),
    },
}

QUANTITIES: Final[dict[str, Quantity]] = {
    name: Quantity(needs, words, units, tuple(dims))
    for needs, table in _TABLE.items()
    for name, (words, units, *dims) in table.items()
}
"""All quantities that a sweep computes, by name."""

DEFAULT: Final = ("tip_position", "along", "margin", "softest", "stiffest", "isotropy")
"""Default outputs, which the maps need."""
