"""Read positions of the tip from CSV files, with units."""

from __future__ import annotations

import math
import os
from typing import Any, Final, NoReturn

from cdsm.errors import FileError
from cdsm.identification.tip_position import TipPosition
from cdsm.manipulator import Manipulator
from cdsm.support.tables import column_in, named_columns, read_table
from cdsm.support.validation import instance

_LENGTH: Final = {"mm": 1e-3, "um": 1e-6, "µm": 1e-6, "m": 1.0}
_FORCE: Final = {"N": 1.0}


def read_tip_positions(
    path: str | os.PathLike[str], arm: Manipulator, *, std: float
) -> tuple[TipPosition, ...]:
    """Read positions of the tip from a CSV file: a header, then a line per reading.

    The header names the columns, with the unit in brackets; the order is free:

    - ``x [mm]``, ``y [mm]``, ``z [mm]``, one or more: the coordinates, in mm, um or m.
    - A column per cable, such as ``cable1_1 [mm]``: the pull; or ``cable1_1 [N]``, the tension, but
      not both in one file. A cable without a column, or with an empty cell, is loose.
    - Optional: ``label``.

    An empty cell of a coordinate was not measured. Lines that begin with # and columns with other
    names are ignored, unless a name looks like a misspelling of one of these.

    Args:
        path: The file.
        arm: The arm, whose cables the columns name.
        std: Standard deviation of a coordinate [m].

    Raises:
        FileError: The file cannot be read, a column is missing or has no unit, or an entry is
            wrong; the line and the column are named.
        InvalidInput: ``std`` is invalid.
    """
    names = instance("arm", arm, Manipulator).cables.names

    def refuse(problem: str) -> NoReturn:
        raise FileError(path, f"{problem}.")

    table = read_table(path)
    if len(table.rows) < 2:
        refuse("holds no positions; a header and one line per reading are needed")
    header = named_columns(table, ("label", *"xyz", *names), refuse)
    axes, cables = ([name for name in group if name in header] for group in ("xyz", names))
    if not axes or not cables:
        refuse(f"needs a column x, y or z [mm], and one of a cable, such as {names[0]} [mm]")
    motors = "tension" if header[cables[0]][1] in _FORCE else "pull"
    units = dict.fromkeys(axes, _LENGTH)
    units |= dict.fromkeys(cables, _FORCE if motors == "tension" else _LENGTH)
    columns = {name: column_in(units[name], name, header, refuse) for name in (*axes, *cables)}
    found = []
    for line, cells in table.rows[1:]:
        read = dict[str, float]()
        for name, (at, size) in columns.items():
            if text := "".join(cells[at : at + 1]):
                read[name] = size * table.number(text)
                if not math.isfinite(read[name]):
                    refuse(f"line {line}, column {name}: {text!r} is not a finite number")
        if not read.keys() & {*axes}:
            refuse(f"line {line}: no coordinate was measured")
        fields: dict[str, Any] = {axis: read[axis] for axis in axes if axis in read}
        fields[motors] = {name: value for name, value in read.items() if name in names}
        at = header.get("label", (len(cells), ""))[0]
        found.append(TipPosition(**fields, std=std, label="".join(cells[at : at + 1])))
    return tuple(found)
