"""Entries of a sweep that are looked at one by one, to find why they have no answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, final

import numpy as np
from numpy.typing import NDArray

from cdsm.applied import Applied
from cdsm.errors import listed
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.status import Status
from cdsm.support.values import Array
from cdsm.tension import Tension, distribute_tension

_EXAMINED: Final = 64  # postures that are looked at one by one, some milliseconds each


@final
@dataclass(frozen=True, eq=False)
class Entries:
    """Entries of a sweep with one lower bound, upper bound and wrench.

    Attributes:
        arm: The arm.
        q: Joint angles (N, nv) [rad], or ways [m].
        status: :class:`Status` of each entry (N,).
        minimum: Lower bound [N] of the tensions.
        maximum: Upper bound [N] of the tensions.
        wrench: What acts: W (6,) at the tip, or loads.
        worst_friction: Whether the bounds are narrowed for friction.
    """

    arm: Manipulator
    q: Array
    status: NDArray[np.int8]
    minimum: float
    maximum: float
    wrench: Applied
    worst_friction: bool = False

    def count(self, cause: Status) -> int:
        """Return the number of entries with a status."""
        return int(np.count_nonzero(self.status == cause))

    def sample(self, cause: Status) -> list[Posture]:
        """Return up to 64 postures with a status, spread evenly."""
        rows = np.flatnonzero(self.status == cause)
        chosen = rows[np.unique(np.linspace(0, len(rows) - 1, _EXAMINED).astype(int))]
        return [self.arm.at(self.q[row]) for row in chosen]

    def least_tension(self, pose: Posture) -> Tension:
        """Compute the tensions of an entry; errors are those of ``distribute_tension``."""
        return distribute_tension(
            pose, self.minimum, self.maximum, self.wrench, worst_friction=self.worst_friction
        )


def counted(names: dict[str, int]) -> str:
    """List names with their counts: ``joint1 (3), joint2 (1)``."""
    return listed([f"{name} ({count})" for name, count in names.items()])
