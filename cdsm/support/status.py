"""Status of each posture of a batch or sweep, instead of the error that one posture raises."""

from __future__ import annotations

from enum import IntEnum, unique

import numpy as np
from numpy.typing import NDArray

from cdsm.support.format import plural


@unique
class Status(IntEnum):
    """Status of one posture of a batch or sweep. It says which quantities exist; others are NaN.

    The status names the first failure. A computation of a single posture raises the error in
    brackets instead, whose ``status`` is the name. A negative margin (unstable arm) and an infinite
    stiffness ``along`` (immobile direction) are not failures; a sweep tells the first apart as
    UNSTABLE.
    """

    OK = 0
    """All requested quantities exist."""
    BEYOND_LIMITS = 1
    """A joint angle is beyond its limit (InvalidInput): no quantity exists."""
    COINCIDENT_SITES = 2
    """Two neighbouring sites of a cable coincide (InvalidInput): no quantity exists."""
    INFEASIBLE = 3
    """No tensions within the bounds balance the arm (InfeasibleTension): only quantities of the
    joint angles alone exist."""
    SOLVER_FAILED = 4
    """The solver finds no tensions, though some exist (CdsmError): only quantities of the joint
    angles alone exist."""
    OUTSIDE_ELASTICITY = 5
    """A tension is outside the domain of its law (ElasticityRangeError): tensions, residual, active
    and load terms exist; quantities that need the cable stiffness do not."""
    SINGULAR = 6
    """K_θ is singular (SingularStiffness): along, compliance and cartesian do not exist. If the tip
    is also IMMOBILE, pseudoinverse does not exist."""
    IMMOBILE = 7
    """The tip can hardly move in some direction (SingularStiffness): cartesian and pseudoinverse do
    not exist, all other quantities exist."""
    UNSTABLE = 8
    """Only in sweeps: the arm buckles (margin ≤ 0): softest, stiffest and isotropy do not exist. If
    the tip is also IMMOBILE, cartesian and pseudoinverse do not exist."""
    PENDING = 9
    """Only in stores of sweeps: not computed yet, no quantity exists."""


def summary(status: NDArray[np.uint8]) -> str:
    """Count the postures with each status in a text: ``9 postures: 8 OK, 1 SINGULAR``."""
    counts = np.bincount(status, minlength=len(Status))
    listed = [f"{counts[each]} {each.name}" for each in Status if counts[each] or each == Status.OK]
    return f"{plural(len(status), 'posture')}: {', '.join(listed)}"
