"""Read what load cells and encoders said from a CSV file, with units."""

from __future__ import annotations

import os
from typing import Final, NamedTuple

import numpy as np

from cdsm.errors import FileError, InvalidInput
from cdsm.joints import require_followers
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.tables import ANGLE, Columns
from cdsm.support.validation import instance
from cdsm.support.values import Array, frozen

_LENGTH: Final = {"mm": 1e-3, "m": 1.0}
_FORCE: Final = {"N": 1.0}
_TEXT: Final[dict[str, float]] = {}


class LoadCellReading(NamedTuple):
    """What was read at one time.

    Attributes:
        label: Its name, or the number of its line.
        posture: The posture by the encoders.
        motor_tension: F of the load cells (C,) [N].
    """

    label: str
    posture: Posture
    motor_tension: Array


def read_load_cells(path: str | os.PathLike[str], arm: Manipulator) -> tuple[LoadCellReading, ...]:
    """Read load cells and encoders from a CSV file: a header, then a line per reading.

    The header names the columns, with the unit in brackets; the order is free: one of each cable,
    such as ``cable1_1 [N]``; one of each joint, such as ``joint1_1 [deg]`` or ``[rad]`` (``[mm]``
    or ``[m]`` where it slides), or none where it is at 0; optional ``label``. Columns of joints
    that follow others are checked.

    Raises:
        FileError: The file cannot be read, a column is missing or has no unit, or an entry is
            wrong; the line and the column are named.
    """
    joints = instance("arm", arm, Manipulator).joint_names
    cables = arm.cables.names
    pairs = zip(joints, arm.slides, strict=True)
    units = {"label": _TEXT} | dict.fromkeys(cables, _FORCE)
    units |= {name: _LENGTH if slides else ANGLE for name, slides in pairs}
    followers = [name for name in arm.body.all_joints if name not in joints]
    units |= dict.fromkeys(followers, ANGLE | _LENGTH)
    table = Columns(path, units, "readings")
    for name in cables:
        table.factor(name)
    if not any(name in table for name in joints):
        unit = "mm" if arm.slides[0] else "deg"
        table.refuse(f"has no angle; give a column for each joint, such as {joints[0]} [{unit}]")
    readings = []
    for row in table.rows:
        q = [table.number(row, name) if name in table else 0.0 for name in joints]
        logged = {name: np.array([table.number(row, name)]) for name in followers if name in table}
        try:
            require_followers(arm.body.coupling, arm.body.all_joints, np.array([q]), logged)
            pose = arm.at(q, check_limits=False)
        except InvalidInput as error:
            raise FileError(path, f"line {row[0]}: {error}") from None
        F = frozen(np.array([table.number(row, name) for name in cables]))
        readings.append(LoadCellReading(table.text(row, "label") or f"line {row[0]}", pose, F))
    return tuple(readings)
