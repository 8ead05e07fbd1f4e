"""Read positions of the tip from a CSV file, with units."""

from __future__ import annotations

import os
from typing import Any, Final

import numpy as np

from cdsm.dead_loads import Load
from cdsm.identification.cells import LENGTH, axis_in, link_in
from cdsm.identification.tip_position import TipPosition
from cdsm.manipulator import Manipulator
from cdsm.support.tables import NEWTONS, TEXT, Columns, Row
from cdsm.support.validation import instance

_MASS: Final = {"kg": 1.0, "g": 1e-3}


def read_tip_positions(
    path: str | os.PathLike[str], arm: Manipulator, *, std: float
) -> tuple[TipPosition, ...]:
    """Read positions of the tip from a CSV file: a header, then a line per reading.

    The header names the columns, with the unit in brackets; the order is free:

    - ``x [mm]``, ``y [mm]``, ``z [mm]``, one or more: the coordinates, in mm, um or m.
    - A column per cable, such as ``cable1_1 [mm]``: the pull; or ``cable1_1 [N]``, the tension, but
      not both in one file. A cable without a column, or with an empty cell, is loose.
    - Optional: the load at the tip, ``force [N]`` along ``direction``, an axis such as ``-z``; and
      ``mass [kg]`` that hangs there. An empty cell is no load.
    - Optional: ``load_link``, on which the load acts, and ``link``, whose position was measured, as
      for :class:`~cdsm.Load` without a point. An empty cell is the tip.
    - Optional: ``label``.

    An empty cell of a coordinate was not measured. Lines that begin with # and columns with other
    names are ignored. But a name that looks like a misspelling of one of these, and one that would
    change the answer, such as ``moment`` or ``minimum``, are errors.

    Args:
        path: The file.
        arm: The arm, whose cables the columns name.
        std: Standard deviation of a coordinate [m].

    Raises:
        FileError: The file cannot be read, a column is missing or has no unit, or an entry is
            wrong; the line and the column are named.
        InvalidInput: ``std`` is invalid.

    Example:
        >>> import cdsm
        >>> arm = cdsm.Manipulator.read("examples/backbone.toml")
        >>> positions = cdsm.read_tip_positions("examples/data/TIPS.csv", arm, std=1e-3)
        >>> len(positions)
        6
    """
    names = instance("arm", arm, Manipulator).cables.names
    units = {"label": TEXT} | dict.fromkeys("xyz", LENGTH) | dict.fromkeys(names, LENGTH)
    units |= {"direction": TEXT, "force": NEWTONS, "mass": _MASS}
    units |= {"link": TEXT, "load_link": TEXT}
    table = Columns(path, units, "positions")
    axes, cables = ([name for name in group if name in table] for group in ("xyz", names))
    if not axes or not cables:
        table.refuse(f"needs a column x, y or z [mm], and one of a cable, such as {names[0]} [mm]")
    motors = "tension" if table.unit[cables[0]] in NEWTONS else "pull"
    if motors == "tension":
        table.units |= dict.fromkeys(cables, NEWTONS)
    loads = [name for name in ("force", "mass") if name in table]
    for name in (*axes, *cables, *loads):
        table.factor(name)
    if ("force" in table) != ("direction" in table):
        table.refuse("needs both columns of a load, force [N] and direction, such as -z")
    if "mass" in table and not arm.gravity.any():
        table.refuse("has a column mass, but the arm has no gravity; give force [N] and direction")

    if "load_link" in table and not loads:
        table.refuse("has a column load_link, but no load: add force [N] and direction, or mass")

    def wrench(row: Row) -> tuple[float, ...] | tuple[Load, ...]:
        """Return the load in a row: (6,) at the tip, or on its link."""
        force = np.zeros(6)
        if table.text(row, "force") and (newtons := table.number(row, "force")):
            force[:3] += newtons * np.asarray(axis_in(table, row))
        if table.text(row, "mass"):
            force[:3] += table.number(row, "mass") * arm.gravity
        link = link_in(table, row, "load_link", arm)
        return tuple(force.tolist()) if link is None else (Load(link, tuple(force[:3].tolist())),)

    positions = []
    for row in table.rows:
        filled = [name for name in (*axes, *cables) if table.text(row, name)]
        read = {name: table.number(row, name) for name in filled}
        if not read.keys() & {*axes}:
            table.refuse(f"line {row[0]}: no coordinate was measured")
        fields: dict[str, Any] = {axis: read[axis] for axis in axes if axis in read}
        fields[motors] = {name: value for name, value in read.items() if name in names}
        fields["wrench"] = wrench(row)
        fields["link"] = link_in(table, row, "link", arm)
        positions.append(TipPosition(**fields, std=std, label=table.text(row, "label")))
    return tuple(positions)
