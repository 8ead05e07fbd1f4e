"""Read loops of weight tests and positions of the tip from CSV files, with units."""

from __future__ import annotations

import os
from itertools import groupby
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.dead_loads import Load
from cdsm.errors import FileError, InvalidInput
from cdsm.identification.measurement import WeightLoop
from cdsm.identification.tip_position import TipPosition
from cdsm.joint_columns import JointColumns
from cdsm.loads import link_point
from cdsm.manipulator import Manipulator
from cdsm.support.tables import FORCE, TEXT, Columns, Row
from cdsm.support.validation import AXES, instance

_LENGTH: Final = {"mm": 1e-3, "um": 1e-6, "µm": 1e-6, "m": 1.0}
_MASS: Final = {"kg": 1.0, "g": 1e-3}


def read_loops(
    path: str | os.PathLike[str],
    arm: Manipulator,
    *,
    displacement_std: float,
    minimum: ArrayLike | None = None,
) -> tuple[WeightLoop, ...]:
    """Read loops of a weight test from a CSV file: a header, then a line per reading.

    The header names the columns, with the unit in brackets; the order is free:

    - ``test``: name of the loop; its lines are consecutive, in the order of the forces.
    - A column per joint, such as ``joint1_1 [deg]`` or ``[rad]``; ``[mm]`` or ``[m]`` for prismatic
      joints: the angle before the first force. A joint without a column is at 0. A column of a
      joint that mimics another one is checked.
    - ``direction``: direction of the forces, an axis such as ``-z``.
    - Optional: ``link``, on which the forces act and which is read; an empty cell is the tip.
    - ``force [N]``: force along the direction, 0 where nothing hangs.
    - ``displacement [mm]``: reading along the direction; or ``x [mm]``, ``y [mm]`` and ``z [mm]``.
      The unit may be um or m, and the offset is arbitrary. A file of planned tests has no readings.
    - A column per cable, such as ``cable1_1 [N]``: the tension before the first force. Or
      ``minimum [N]``: the lower bound with which the tensions are distributed.

    A cell of a joint, a cable, ``link``, ``direction`` or ``minimum`` may be empty after the first
    line of a test. Lines that begin with # are ignored. Columns with other names are ignored too.
    But a name that looks like a misspelling of one of these names, or like a joint or cable that
    the arm does not have, and one that would change the answer, such as ``mass``, are errors.

    Args:
        path: The file.
        arm: The arm, whose joints and cables the columns name.
        displacement_std: Standard deviation of a reading [m].
        minimum: Lower bound of the tensions [N], one number or (C,), if the file has no tensions.

    Raises:
        FileError: The file cannot be read, a column is missing or has no unit, or an entry is
            wrong; the line and the column are named.
        InvalidInput: ``displacement_std`` or ``minimum`` is invalid.

    Example:
        >>> import cdsm
        >>> arm = cdsm.Manipulator.read("examples/arm.toml")
        >>> loops = cdsm.read_loops("examples/data/LOOPS.csv", arm, displacement_std=2e-5)
        >>> len(loops), loops[0].label
        (2, 'down')
    """
    joints = JointColumns(instance("arm", arm, Manipulator))
    cables = arm.cables.names
    units = {"test": TEXT, "direction": TEXT, "force": FORCE, "minimum": FORCE, "link": TEXT}
    units |= dict.fromkeys(("displacement", *"xyz"), _LENGTH) | dict.fromkeys(cables, FORCE)
    units |= joints.units
    table = Columns(path, units, "loops")
    refuse = table.refuse
    text = table.text
    number = table.number

    def fixed(rows: list[Row], name: str) -> Row:
        """Return the first row of a test, whose cell of a column later rows repeat."""
        first = text(rows[0], name)
        for row in rows[1:]:
            if (entry := text(row, name)) not in (first, ""):
                refuse(
                    f"line {row[0]}, column {name}: {entry!r} given, but {first!r} at the "
                    "beginning of the test, which fixes it; begin another test"
                )
        return rows[0]

    def loop(label: str, rows: list[Row]) -> WeightLoop:
        direction = text(fixed(rows, "direction"), "direction")
        if direction not in AXES:
            fault = f"{direction!r} is no axis; give one of {', '.join(AXES)}"
            refuse(f"line {rows[0][0]}, column direction: {fault}")
        link = _link(table, fixed(rows, "link"), "link", arm) if "link" in table else None
        before = [number(fixed(rows, name), name) for name in tensions]
        read = np.array([[number(row, name) for name in readings] for row in rows])
        if readings and (moved := float(np.ptp(read, axis=0).max())) > arm.length:
            refuse(
                f"test {label}: its readings span {moved:.4g} m, more than the arm is long, "
                f"{arm.length:.4g} m; give the unit in which they were read"
            )
        for name in joints.units:
            fixed(rows, name)
        return WeightLoop(
            direction=AXES[direction],
            angles=tuple(joints.angles(table, rows[:1])[0].tolist()),
            forces=tuple(number(row, "force") for row in rows),
            displacements=(read[:, 0] if len(readings) == 1 else read) if readings else None,  # type: ignore[arg-type]
            tension=tuple(before) if tensions and tensions != ["minimum"] else None,
            minimum=before[0] if tensions == ["minimum"] else bound,
            displacement_std=displacement_std,
            label=label,
            link=link,
        )

    axes = [*"xyz"] if any(axis in table for axis in "xyz") else []
    readings = ["displacement"] if "displacement" in table else axes
    measured_cables = [name for name in cables if name in table]
    tensions = ["minimum"] if "minimum" in table else [*cables] if measured_cables else []
    if measured_cables and tensions == ["minimum"]:
        refuse(f"has columns minimum and {measured_cables[0]}; give one of them")
    for name in ("test", "direction"):
        if name not in table:
            refuse(f"has no column {name}")
    angles = [name for name in arm.joint_names if name in table]
    for name in ("force", *readings, *tensions, *angles):
        table.factor(name)
    if tensions and minimum is not None:
        refuse("has tensions; leave out minimum")
    if not tensions and minimum is None:
        remedy = f"add a column minimum [N] or one for each cable, such as {cables[0]} [N]"
        refuse(f"has no tensions; {remedy}, or give minimum")
    bound = None if minimum is None else np.asarray(minimum).tolist()
    loops = list[WeightLoop]()
    for label, group in groupby(table.rows, lambda row: text(row, "test")):
        rows = [*group]
        if not label:
            refuse(f"line {rows[0][0]}: the test has no name")
        if label in [earlier.label for earlier in loops]:
            refuse(f"line {rows[0][0]}: the test {label} goes on after another one")
        try:
            loops.append(loop(label, rows))
        except InvalidInput as error:
            if error.name in ("minimum", "displacement_std"):
                raise
            raise FileError(path, f"test {label}: {error}") from None
    return tuple(loops)


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
    units = {"label": TEXT} | dict.fromkeys("xyz", _LENGTH) | dict.fromkeys(names, _LENGTH)
    units |= {"direction": TEXT, "force": FORCE, "mass": _MASS}
    units |= {"link": TEXT, "load_link": TEXT}
    table = Columns(path, units, "positions")
    axes, cables = ([name for name in group if name in table] for group in ("xyz", names))
    if not axes or not cables:
        table.refuse(f"needs a column x, y or z [mm], and one of a cable, such as {names[0]} [mm]")
    motors = "tension" if table.unit[cables[0]] in FORCE else "pull"
    if motors == "tension":
        table.units |= dict.fromkeys(cables, FORCE)
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
            direction = table.text(row, "direction")
            if direction not in AXES:
                fault = f"{direction!r} is no axis; give one of {', '.join(AXES)}"
                table.refuse(f"line {row[0]}, column direction: {fault}")
            force[:3] += newtons * np.asarray(AXES[direction])
        if table.text(row, "mass"):
            force[:3] += table.number(row, "mass") * arm.gravity
        link = _link(table, row, "load_link", arm)
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
        fields["link"] = _link(table, row, "link", arm)
        positions.append(TipPosition(**fields, std=std, label=table.text(row, "label")))
    return tuple(positions)


def _link(table: Columns, row: Row, column: str, arm: Manipulator) -> str | None:
    """Return the link in a cell; None for the tip, if it is empty or there is no such column."""
    if column not in table or not (link := table.text(row, column)):
        return None
    try:
        link_point(arm, link)
    except InvalidInput as error:
        fault = str(error).removeprefix("link: ").rstrip(".")
        table.refuse(f"line {row[0]}, column {column}: {fault}")
    return link
