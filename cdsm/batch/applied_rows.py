"""What acts on an arm in many rows: at its tip, and on links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cdsm.applied import Applied, Loads, PointLoad, TipLoad, as_loads, tip_part
from cdsm.dead_loads import LinkPoint
from cdsm.routing import Indices
from cdsm.support.values import Array, frozen


@dataclass(frozen=True, eq=False)
class RowLoads:
    """Loads on links, for all postures or for each."""

    points: tuple[LinkPoint, ...]
    wrenches: Array  # (1, L, 6) for all rows or (N, L, 6): force [N], then moment [N m]

    def of(self, rows: Indices | slice) -> RowLoads:
        """Return the loads of some rows."""
        if len(self.wrenches) == 1:
            return self
        return RowLoads(self.points, frozen(self.wrenches[rows]))


class AppliedRows(NamedTuple):
    """What acts on an arm in each row."""

    at_tip: Array  # W (6,) for all rows or (N, 6): force [N], then moment [N m]
    loads: RowLoads | None = None  # on links

    @classmethod
    def of(cls, cases: Sequence[Applied]) -> AppliedRows:
        """Return rows in each of which another case acts."""
        at_tip = frozen(np.array([tip_part(applied) for applied in cases]))
        on_links = [as_loads(applied).on_links for applied in cases]
        points = {load.at.key: load.at for loads in on_links for load in loads}
        if not points:
            return cls(at_tip)
        place = {key: i for i, key in enumerate(points)}
        wrenches = np.zeros((len(cases), len(points), 6))
        for row, loads in zip(wrenches, on_links, strict=True):
            for load in loads:
                row[place[load.at.key]] += load.wrench
        return cls(at_tip, RowLoads(tuple(points.values()), frozen(wrenches)))

    def case(self, row: int) -> Applied:
        """Return what acts in a row."""
        at_tip = self.at_tip if self.at_tip.ndim == 1 else frozen(self.at_tip[row].copy())
        if self.loads is None:
            return at_tip
        wrenches = self.loads.wrenches[row if len(self.loads.wrenches) > 1 else 0]
        pairs = zip(self.loads.points, wrenches, strict=True)
        return Loads((TipLoad(at_tip), *(PointLoad(at, frozen(W.copy())) for at, W in pairs)))

    def of_rows(self, rows: Indices) -> AppliedRows:
        """Return what acts in some rows, of as many rows as there are."""
        return AppliedRows(self.at_tip[rows], self.loads.of(rows) if self.loads else None)
