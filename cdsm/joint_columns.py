"""Columns of a CSV file for the joints of an arm: ``joint1_1 [deg]``, ``[rad]``, ``[mm]``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from cdsm.joints import require_followers
from cdsm.manipulator import Manipulator
from cdsm.support.tables import ANGLE, SLIDE, Columns, Row
from cdsm.support.values import Array


class JointColumns(NamedTuple):
    """The columns of the joints of ``arm``, and of joints that follow them, which are checked."""

    arm: Manipulator

    @property
    def units(self) -> dict[str, dict[str, float]]:
        """Units of each column, by its name."""
        pairs = zip(self.arm.joint_names, self.arm.slides, strict=True)
        units = {name: SLIDE if slides else ANGLE for name, slides in pairs}
        return units | dict.fromkeys(self._followers, ANGLE | SLIDE)

    @property
    def first(self) -> str:
        """What the header says of the first joint: an example."""
        return f"{self.arm.joint_names[0]} [{'mm' if self.arm.slides[0] else 'deg'}]"

    def angles(self, table: Columns, rows: Sequence[Row]) -> Array:
        """Read q in ``rows`` (n, nv) [rad, m]; a joint without a column is at 0.

        Raises InvalidInput if a joint is not where the one that it follows puts it.
        """

        def column(name: str) -> Array:
            return np.array([table.number(row, name) for row in rows])

        rest = np.zeros(len(rows))
        names = self.arm.joint_names
        q = np.transpose([column(name) if name in table else rest for name in names])
        logged = {name: column(name) for name in self._followers if name in table}
        require_followers(self.arm.body.coupling, self.arm.body.all_joints, q, logged)
        return q

    @property
    def _followers(self) -> list[str]:
        return [name for name in self.arm.body.all_joints if name not in self.arm.joint_names]
