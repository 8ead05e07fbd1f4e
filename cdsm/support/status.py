"""What became of a posture among many, instead of the error that a single one raises."""

from __future__ import annotations

from enum import IntEnum, unique

import numpy as np
from numpy.typing import NDArray

from cdsm.errors import (
    CableError,
    CdsmError,
    ElasticityRangeError,
    InfeasibleTension,
    JointLimitError,
    SingularStiffness,
    SolverError,
)


@unique
class Status(IntEnum):
    """What became of a row, and so which quantities exist; those that do not are NaN.

    It names the first failure, for which the functions of a single posture raise an error. An arm
    that buckles is no failure: its margin is negative. Nor is an infinite stiffness ``along`` a
    direction in which the tip cannot move.
    """

    OK = 0
    """Everything asked for exists."""
    BEYOND_LIMITS = 1
    """A joint angle is beyond its limit (JointLimitError): nothing exists."""
    COINCIDENT_SITES = 2
    """Two neighbouring sites of a cable coincide (CableError): nothing exists."""
    INFEASIBLE = 3
    """No tension within the bounds balances the arm (InfeasibleTension): what depends on the joint
    angles alone exists, nothing that needs tensions."""
    SOLVER_FAILED = 4
    """The solver finds no tensions, though there are some (SolverError): as INFEASIBLE."""
    OUTSIDE_ELASTICITY = 5
    """A tension is outside the domain of the cable's elasticity (ElasticityRangeError): tensions,
    residual, active and load part exist, nothing that needs the stiffness of the cables."""
    SINGULAR = 6
    """K_θ is singular (SingularStiffness): along, compliance and cartesian do not exist, nor does
    pseudoinverse if the tip is IMMOBILE too."""
    IMMOBILE = 7
    """The tip can hardly move in some direction (SingularStiffness): all but cartesian and
    pseudoinverse exists."""

    @classmethod
    def of(cls, error: CdsmError) -> Status | None:
        """The status that stands for an error; None where no posture raises such an error."""
        return next((status for kind, status in _ERRORS.items() if isinstance(error, kind)), None)


_ERRORS: dict[type[CdsmError], Status] = {
    JointLimitError: Status.BEYOND_LIMITS,
    CableError: Status.COINCIDENT_SITES,
    InfeasibleTension: Status.INFEASIBLE,
    SolverError: Status.SOLVER_FAILED,
    ElasticityRangeError: Status.OUTSIDE_ELASTICITY,
    SingularStiffness: Status.SINGULAR,
}


def summary(status: NDArray[np.uint8]) -> str:
    """How many rows have which status."""
    counts = np.bincount(status, minlength=len(Status))
    listed = [f"{counts[each]} {each.name}" for each in Status if counts[each] or each == Status.OK]
    return f"{len(status)} postures: {', '.join(listed)}"
