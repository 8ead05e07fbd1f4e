"""The quantities of a sweep, and the status of its entries.

The one table of names, units and dimensions: the Dataset, the store, the CSV and the maps read it.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Final, final

from cdsm.batch import Status

CASES: Final = ("elasticity", "wrench", "minimum")
"""Dimensions beside those of the pose set, each only where several values were given."""


class SweepStatus(IntEnum):
    """What became of an entry of a sweep; its names are the ``flag_meanings`` of ``status``.

    That of :class:`~cdsm.Status`, with what only a sweep can tell.

    NaN stands in a Dataset only where the status says so, as listed here. Infinite is a value: the
    stiffness in a direction in which no joint moves the tip.
    """

    OK = Status.OK
    """All there."""
    BEYOND_LIMITS = Status.BEYOND_LIMITS
    """A joint angle beyond its limit: nothing."""
    COINCIDENT_SITES = Status.COINCIDENT_SITES
    """Two neighbouring sites of a cable coincide: nothing."""
    INFEASIBLE = Status.INFEASIBLE
    """No tension within the bounds balances the arm: no tension, no stiffness."""
    SOLVER_FAILED = Status.SOLVER_FAILED
    """The solver found no tension, though there is one: no tension, no stiffness."""
    OUTSIDE_ELASTICITY = Status.OUTSIDE_ELASTICITY
    """A tension outside the domain of the elasticity: no stiffness."""
    SINGULAR = Status.SINGULAR
    """K_θ is singular, just about to buckle: no Cartesian quantity."""
    IMMOBILE = Status.IMMOBILE
    """The tip cannot move in some direction: no cartesian, no pseudoinverse. Only where one of
    them was asked for."""
    UNSTABLE = 8
    """The arm buckles, its margin is not positive: no softest, stiffest or anisotropy; and as
    IMMOBILE where it is that too."""
    WORKER_LOST = 9
    """The worker that computed it died, time and again: nothing."""
    PENDING = 10
    """Not computed yet, in a store whose run was stopped: nothing."""


STAGES: Final = ("pose", "tension", "joint", "tip", "matrix", "principal")
"""In the order in which a quantity needs more to exist; the last two both need the tip's."""

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
"""The stages whose quantities are NaN."""


@final
@dataclass(frozen=True)
class Quantity:
    """A variable of the Dataset.

    Attributes:
        long_name: In words.
        units: As UDUNITS writes them, SI.
        stage: What must exist for it: one of :data:`STAGES`.
        dims: Its dimensions after those of poses and cases.
    """

    long_name: str
    units: str
    stage: str
    dims: tuple[str, ...] = ()

    @property
    def cases(self) -> tuple[str, ...]:
        """Which of :data:`CASES` it depends on."""
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
"""The default outputs, from which a map is drawn."""
