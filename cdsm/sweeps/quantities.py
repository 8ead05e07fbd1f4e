"""Quantities of a sweep: names, units and dimensions in Dataset, store, CSV and maps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, final

CASES: Final = ("elasticity", "wrench", "minimum")
"""Dimensions of the cases; each exists only if several values of the argument are given."""

STAGES: Final = ("pose", "tension", "joint", "tip", "matrix", "principal")
"""What must exist for a quantity: posture, tensions, K_θ, C, (C_vv)⁻¹, or a stable arm.

Each stage needs all earlier stages, except that ``principal`` does not need ``matrix``.
"""


@final
@dataclass(frozen=True)
class Quantity:
    """Description of an output of a sweep, which is a variable of the Dataset."""

    long_name: str  # in words
    units: str  # SI, in the notation of UDUNITS
    stage: str  # what must exist for the quantity to exist: one of STAGES
    dims: tuple[str, ...] = ()  # its own dimensions, after those of poses and cases

    @property
    def cases(self) -> tuple[str, ...]:
        """Return those dimensions in :data:`CASES` on which the quantity depends."""
        return {"pose": (), "tension": CASES[1:]}.get(self.stage, CASES)


_JOINTS = ("joint", "joint_column")
_AXES = ("axis", "axis_column")

QUANTITIES: Final[dict[str, Quantity]] = {
    "tip_position": Quantity("position of the tip in base axes", "m", "pose", ("axis",)),
    "cable_lengths": Quantity("cable lengths L, lead included (Eq. 8)", "m", "pose", ("cable",)),
    "gravity_torque": Quantity("gravity torque g = dV/dq", "N m", "pose", ("joint",)),
    "gravity_stiffness": Quantity("gravity part of K, dg/dq", "N m rad-1", "pose", _JOINTS),
    "tension_factor": Quantity(
        "tension factor, largest min F / max F with J_L^T F = 0; 0: no wrench closure", "1", "pose"
    ),
    "cable_clearance": Quantity("least distance of two cables", "m", "pose"),
    "link_clearance": Quantity("least distance of a cable from a backbone", "m", "pose"),
    "disk_clearance": Quantity(
        "least distance of a cable from a disk, or in its hole from the edge", "m", "pose"
    ),
    "tension": Quantity("least cable tensions F in balance (Eq. 17)", "N", "tension", ("cable",)),
    "payload": Quantity(
        "largest force in a direction within the limits of the tensions",
        "N",
        "tension",
        ("direction",),
    ),
    "force_radius": Quantity(
        "largest force in any direction within the limits of the tensions", "N", "tension"
    ),
    "cable_stiffness": Quantity("cable stiffness, diagonal of K_L", "N m-1", "joint", ("cable",)),
    "active_stiffness": Quantity("active part of K, H_L F (Eq. 16)", "N m rad-1", "joint", _JOINTS),
    "passive_stiffness": Quantity(
        "passive part of K, J_L^T K_L J_L (Eq. 16)", "N m rad-1", "joint", _JOINTS
    ),
    "load_stiffness": Quantity("load part of K (Eq. 16)", "N m rad-1", "joint", _JOINTS),
    "joint_stiffness": Quantity("joint stiffness K (Eq. 16)", "N m rad-1", "joint", _JOINTS),
    "margin": Quantity(
        "stability margin, smallest eigenvalue of the symmetric part of K", "N m rad-1", "joint"
    ),
    "translational_compliance": Quantity(
        "translational compliance C_vv of the tip, displacement per force", "m N-1", "tip", _AXES
    ),
    "along": Quantity(
        "stiffness in a direction, 1/(u^T C_vv u) (Eq. 20)", "N m-1", "tip", ("direction",)
    ),
    "cartesian": Quantity("Cartesian stiffness, inverse of C_vv", "N m-1", "matrix", _AXES),
    "pseudoinverse": Quantity(
        "the paper's Cartesian stiffness, J+^T K J+", "N m-1", "matrix", _AXES
    ),
    "softest": Quantity("stiffness in the softest direction", "N m-1", "principal"),
    "stiffest": Quantity("stiffness in the stiffest direction", "N m-1", "principal"),
    "isotropy": Quantity("softest over stiffest", "1", "principal"),
    "softest_direction": Quantity("softest direction, unit length", "1", "principal", ("axis",)),
    "stiffest_direction": Quantity("stiffest direction, unit length", "1", "principal", ("axis",)),
}

DIRECTIONAL: Final = frozenset(
    name for name, each in QUANTITIES.items() if "direction" in each.dims
)
"""Names of the quantities that have a value for each direction."""

DEFAULT: Final = ("tip_position", "along", "margin", "softest", "stiffest", "isotropy")
"""Default outputs, which the maps need."""
