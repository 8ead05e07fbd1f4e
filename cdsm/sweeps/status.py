"""Status of the entries of a sweep, and the quantities that do not exist for each status."""

from __future__ import annotations

from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdsm.support.status import Status
from cdsm.sweeps.quantities import STAGES


class SweepStatus(IntEnum):
    """Status of an entry of a sweep; the names are the ``flag_meanings`` of ``status``.

    The first eight are those of :class:`~cdsm.Status`. A quantity is NaN in a Dataset only if it
    does not exist for the status, as listed here. Infinity is a valid result: the stiffness in a
    direction in which no joint moves the tip.
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
    """The solver found no tensions, though there are some: NaN for tensions and stiffness."""
    OUTSIDE_ELASTICITY = Status.OUTSIDE_ELASTICITY
    """A tension is outside the domain of its law: the stiffness does not exist."""
    SINGULAR = Status.SINGULAR
    """K_θ is singular (the arm is about to buckle): Cartesian quantities do not exist."""
    IMMOBILE = Status.IMMOBILE
    """The tip cannot move in some direction: cartesian and pseudoinverse do not exist. Set only if
    one of these two is requested."""
    UNSTABLE = 8
    """The arm buckles (margin ≤ 0): softest, stiffest and isotropy do not exist. If the tip is
    also immobile, cartesian and pseudoinverse do not exist."""
    WORKER_LOST = 9
    """The workers that computed the entry died several times: no quantity exists."""
    PENDING = 10
    """The entry is not computed yet (a store of a stopped run): no quantity exists."""


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


def exists(stage: str, status: NDArray[np.int8]) -> NDArray[np.bool_]:
    """Return for each entry of ``status`` whether the quantities of a stage exist.

    ``stage`` is one of :data:`~cdsm.sweeps.quantities.STAGES`. The result has the shape of
    ``status``.
    """
    return np.array([stage not in LOST[kind] for kind in sorted(LOST)])[status]
