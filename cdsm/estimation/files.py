"""Read what load cells and encoders said from a CSV file, with units."""

from __future__ import annotations

import os
from collections import Counter
from typing import NamedTuple

import numpy as np

from cdsm.errors import FileError, InvalidInput
from cdsm.estimation.result import beyond_noise
from cdsm.joint_columns import JointColumns
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.tables import NEWTONS, TEXT, Columns
from cdsm.support.validation import instance
from cdsm.support.values import Array, frozen


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
    that follow others are checked. Readings without a label, or with that of others, have their
    line in it.

    Raises:
        FileError: The file cannot be read, a column is missing or has no unit, or an entry is
            wrong; the line and the column are named.
    """
    joints = JointColumns(instance("arm", arm, Manipulator))
    cables = arm.cables.names
    units = {"label": TEXT} | dict.fromkeys(cables, NEWTONS) | joints.units
    table = Columns(path, units, "readings")
    for name in cables:
        table.factor(name)
    if not any(name in table for name in arm.joint_names):
        table.refuse(f"has no angle; give a column for each joint, such as {joints.first}")
    labels = [table.text(row, "label") for row in table.rows]
    counts = Counter(labels)
    readings = []
    for row, label in zip(table.rows, labels, strict=True):
        try:
            q = joints.angles(table, [row])[0]
            pose = arm.at(q, check_limits=bool(beyond_noise(arm, q).any()))
        except InvalidInput as error:
            raise FileError(path, f"line {row[0]}: {error}") from None
        F = frozen(np.array([table.number(row, name) for name in cables]))
        where = f"line {row[0]}"
        name = label if counts[label] == 1 else ", ".join(filter(None, (label, where)))
        readings.append(LoadCellReading(name or where, pose, F))
    return tuple(readings)
