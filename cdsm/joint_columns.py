"""Columns of a CSV file for the joints of an arm: ``joint1_1 [deg]``, ``[rad]``, ``[mm]``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from cdsm.errors import warn
from cdsm.joints import require_followers
from cdsm.manipulator import Manipulator
from cdsm.support.tables import ANGLE, SLIDE, Columns, Row
from cdsm.support.values import Array

TINY: Final = math.radians(0.2)
"""Largest angle [rad] in degrees that looks as if it is in radians."""


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

        if rows and rows[0] is table.rows[0]:
            self._doubt_radians(table)
        rest = np.zeros(len(rows))
        names = self.arm.joint_names
        q = np.transpose([column(name) if name in table else rest for name in names])
        logged = {name: column(name) for name in self._followers if name in table}
        require_followers(self.arm.body.coupling, self.arm.body.all_joints, q, logged)
        return q

    def _doubt_radians(self, table: Columns) -> None:
        """Warn of a file whose angles are so small that they may be in radians."""
        names = [name for name in self.arm.joint_names if table.unit.get(name) in ("deg", "°")]
        cells = [(row, name) for name in names for row in table.rows if table.text(row, name)]
        angles = [table.number(*cell) for cell in cells]
        if 0.0 < max(map(abs, angles), default=0.0) < TINY:
            small = f"{table.path}: all angles are below {math.degrees(TINY):g}°"
            warn(f"{small}, as if in radians. If they are, call the columns {names[0]} [rad], …")

    @property
    def _followers(self) -> list[str]:
        return [name for name in self.arm.body.all_joints if name not in self.arm.joint_names]
