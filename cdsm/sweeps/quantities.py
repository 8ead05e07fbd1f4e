"""Quantities of a sweep and status of its entries.

Dataset, store, CSV and maps take names, units and dimensions from the one table of this module.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Final, final

from cdsm.batch import Status

CASES: Final = ("elasticity", "wrench", "minimum")
"""Dimensions of the cases; each exists only if several values of the argument are given."""


class SweepStatus(IntEnum):
    """Status of an entry of a sweep; the names are the ``flag_meanings`` of ``status``.

    The first eight are those of :class:`~cdsm.Status`. NaN stands in a Dataset only where the
    status says so, as listed here. Infinity is a value: the stiffness in a direction in which no
    joint moves the tip.
    """

    OK = Status.OK
    """All requested quantities exist."""
    BEYOND_LIMITS = Status.BEYOND_LIMITS
    """A joint angle is beyond its limit: no quantity exists."""
    COINCIDENT_SITES = Status.COINCIDENT_SITES
    """Two neighbouring sites of a cable coincide: no quantity exists."""
    INFEASIBLE = Status.INFEASIBLE
    """No tensions within the bounds balance the arm: tensions and stiffness do not exist."""
    SOLVER_FAILED = Status.SOLVER_FAILED
    """The solver found no tensions, though tensions exist: as INFEASIBLE."""
    OUTSIDE_ELASTICITY = Status.OUTSIDE_ELASTICITY
    """A tension is outside the domain of its law: the stiffness does not exist."""
    SINGULAR = Status.SINGULAR
    """K_θ is singular (the arm is about to buckle): Cartesian quantities do not exist."""
    IMMOBILE = Status.IMMOBILE
    """The tip cannot move in some direction: cartesian and pseudoinverse do not exist. Set only if
    one of these two is requested."""
    UNSTABLE = 8
    """The arm buckles (margin ≤ 0): softest, stiffest and anisotropy do not exist. If the tip is
    also immobile, cartesian and pseudoinverse do not exist."""
    WORKER_LOST = 9
    """The workers that computed the entry died several times: no quantity exists."""
    PENDING = 10
    """The entry is not computed yet (a store of a stopped run): no quantity exists."""


STAGES: Final = ("pose", "tension", "joint", "tip", "matrix", "principal")
"""Conditions for a quantity to exist; each needs those before it, but principal needs no matrix."""

LOST: Final[dict[SweepStatus, tuple[str, ...]]] = {
    SweepStatus.OK: (),
    SweepStatus.BEYOND_LIMITS: STAGES,
    SweepStatus.COINCIDENT_SITES: STAGES,
    SweepStatus.INFEASIBLE: STAGES[1:],
    SweepStatus.SOLVER_FAILED: STAGES[1:],
    SweepStatus.OUTSIDE_ELASTICITY: STAGES[2:],
    SweepStatus.SINGULAR: STAGES[3:],
    SweepStatus.IMMOBILE: ("matrix",),
    SweepStatus.UNSTABLE: ("principal",),
    SweepStatus.WORKER_LOST: STAGES,
    SweepStatus.PENDING: STAGES,
}
"""Stages whose quantities are NaN, for each status."""


@final
@dataclass(frozen=True)
class Quantity:
    """Output of a sweep: a variable of the Dataset.

    Attributes:
        long_name: Name in words.
        units: SI units in the notation of UDUNITS.
        stage: Condition for the quantity to exist: one of :data:`STAGES`.
        dims: Dimensions after those of poses and cases.
    """

    long_name: str
    units: str
    stage: str
    dims: tuple[str, ...] = ()

    @property
    def cases(self) -> tuple[str, ...]:
        """Return the :data:`CASES` on which the quantity depends."""
        return {"pose": (), "tension": CASES[1:]}.get(self.stage, CASES)


_JOINTS = ("joint", "joint_column")
_AXES = ("axis", "axis_column")

QUANTITIES: Final[dict[str, Quantity]] = {
    "tip_position": Quantity("position of the tip in base axes", "m", "pose", ("axis",)),
    "cable_lengths": Quantity("cable lengths L, lead included (Eq. 8)", "m", "pose", ("cable",)),
    "gravity_torque": Quantity("gravity torque g = dV/dq", "N m", "pose", ("joint",)),
    "gravity_stiffness": Quantity("gravity part of K, dg/dq", "N m rad-1", "pose", _JOINTS),
    "tension": Quantity("least cable tensions F in balance (Eq. 17)", "N", "tension", ("cable",)),
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
    "anisotropy": Quantity("stiffest over softest", "1", "principal"),
    "softest_direction": Quantity("softest direction, unit length", "1", "principal", ("axis",)),
    "stiffest_direction": Quantity("stiffest direction, unit length", "1", "principal", ("axis",)),
}

DEFAULT: Final = ("tip_position", "along", "margin", "softest", "stiffest", "anisotropy")
"""Default outputs; maps are drawn from them."""
