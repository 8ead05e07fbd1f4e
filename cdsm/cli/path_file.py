"""Read paths from CSV files: joint angles or tip positions, and stiffness, with units."""

from __future__ import annotations

from pathlib import Path
from typing import Final, NamedTuple, NoReturn

import numpy as np

from cdsm.errors import FileError
from cdsm.manipulator import Manipulator
from cdsm.support.tables import ANGLE, column_in, named_columns, read_table
from cdsm.support.values import Array

_LENGTH: Final = {"mm": 1e-3, "m": 1.0}
_STIFFNESS: Final = {"N/mm": 1e3, "N/m": 1.0}


class PathFile(NamedTuple):
    """A path of S samples, in SI."""

    angles: Array | None  # (S, nv) [rad], [m] where a joint slides; None if tips are given
    tips: Array | None  # (S, 3) [m]; None if angles are given
    target: Array | None  # wanted stiffness (S,) [N/m]; None without such a column


def read_path(path: Path, arm: Manipulator) -> PathFile:
    """Read a path from a CSV file: a header, then one line per sample.

    The header names the columns and their units. Joint columns have the names of the joints of
    the arm; joints without a column stay at 0. Other columns are ignored, unless their names look
    like typing errors or like a joint that the arm does not have: then FileError is raised. Lines
    that begin with # are comments.
    """

    def refuse(problem: str) -> NoReturn:
        raise FileError(path, f"{problem}.")

    table = read_table(path)
    if len(table.rows) < 2:
        refuse("holds no path; a header and one line per sample are needed")
    found = named_columns(table, (*arm.joint_names, *"xyz", "target"), refuse)

    def columns(wanted: dict[str, dict[str, float]], *, some: bool = False) -> Array | None:
        """Return the n columns that ``wanted`` names, (S, n) in SI; None if all are missing.

        ``wanted`` has the allowed units of each column, with the SI value of each unit. If some of
        the columns are missing, they are zero where ``some`` is True; else FileError is raised.
        """
        if not wanted.keys() & found.keys():
            return None
        values = []
        for name, known in wanted.items():
            if some and name not in found:
                values.append(np.zeros(len(table.rows) - 1))
                continue
            at, size = column_in(known, name, found, refuse)
            values.append(size * table.column(at, refuse))
        return np.array(values).T

    kinds = [_LENGTH if slides else ANGLE for slides in arm.slides]
    angles = columns(dict(zip(arm.joint_names, kinds, strict=True)), some=True)
    tips, target = columns(dict.fromkeys("xyz", _LENGTH)), columns({"target": _STIFFNESS})
    if (angles is None) == (tips is None):
        first = f"{arm.joint_names[0]} [{'mm' if arm.slides[0] else 'deg'}]"
        refuse(
            f"has columns for {'neither' if angles is None else 'both'} of joint angles ({first}, "
            "…) and tip positions (x [mm], y [mm], z [mm]); give one of them"
        )
    return PathFile(angles, tips, None if target is None else target[:, 0])
