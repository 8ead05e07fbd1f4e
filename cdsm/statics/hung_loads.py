"""Loads on links in a history of loads: what acts on each, and how far it has moved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cdsm.applied import Applied, as_loads
from cdsm.batch.applied_rows import AppliedRows
from cdsm.dead_loads import LinkPoint
from cdsm.posture import Posture
from cdsm.support.values import Array, frozen, total


class HungLoad(NamedTuple):
    """What acts on a point of a link at n loads, and where it is."""

    point: LinkPoint
    wrenches: Array  # (n, 6): force [N], then moment [N m], base axes
    displacement: Array  # of the point since the reference (n, 3) [m]

    def to_dict(self) -> dict[str, object]:
        """Return it for JSON, with units in the keys."""
        return {
            "link": self.point.link,
            "point_m": self.point.local,
            "force_N": self.wrenches[:, :3],
            "moment_Nm": self.wrenches[:, 3:],
            "displacement_m": self.displacement,
        }


def hung_loads(
    reference: Posture, applied: Sequence[Applied], poses: Sequence[Posture]
) -> tuple[HungLoad, ...]:
    """Return the loads on links of a history, by the points of the links."""
    loads = AppliedRows.of(applied).loads
    if loads is None:
        return ()
    hung = []
    for k, point in enumerate(loads.points):
        places = np.array([point.position(pose) for pose in poses])
        moved = frozen(places - point.position(reference))
        hung.append(HungLoad(point, frozen(loads.wrenches[:, k].copy()), moved))
    return tuple(hung)


def total_force(applied: Applied) -> Array:
    """Return the sum (3,) [N] of all forces that act."""
    return total([load.wrench[:3] for load in as_loads(applied).loads])
