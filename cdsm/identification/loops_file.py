"""Read loops of weight tests from a CSV file, with units."""

from __future__ import annotations

import os
from collections.abc import Sequence
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import FileError, InvalidInput, warn
from cdsm.identification.cells import LENGTH, axis_in, link_in
from cdsm.identification.weight_loop import WeightLoop
from cdsm.joint_columns import JointColumns
from cdsm.manipulator import Manipulator
from cdsm.support.tables import NEWTONS, TEXT, Columns, Row
from cdsm.support.validation import instance
from cdsm.support.values import Array


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
    units = {"test": TEXT, "direction": TEXT, "force": NEWTONS, "minimum": NEWTONS, "link": TEXT}
    units |= dict.fromkeys(("displacement", *"xyz"), LENGTH) | dict.fromkeys(cables, NEWTONS)
    table = Columns(path, units | joints.units, "loops")
    file = _LoopsFile(table, arm, joints, _readings(table), _tensions(table, cables))
    file.check_header(given=minimum is not None)
    bound = None if minimum is None else np.asarray(minimum).tolist()
    loops = list[WeightLoop]()
    for label, group in groupby(table.rows, lambda row: table.text(row, "test")):
        rows = [*group]
        if not label:
            table.refuse(f"line {rows[0][0]}: the test has no name")
        if label in [earlier.label for earlier in loops]:
            table.refuse(f"line {rows[0][0]}: the test {label} goes on after another one")
        try:
            fields: dict[str, Any] = {"minimum": bound} | file.loop(label, rows)
            loops.append(WeightLoop(**fields, displacement_std=displacement_std, label=label))
        except InvalidInput as error:
            if error.name in ("minimum", "displacement_std"):
                raise
            raise FileError(path, f"test {label}: {error}") from None
    return tuple(loops)


def _readings(table: Columns) -> list[str]:
    """Return the columns of what was read; none of planned tests."""
    if "displacement" in table:
        return ["displacement"]
    return [*"xyz"] if any(axis in table for axis in "xyz") else []


def _tensions(table: Columns, cables: Sequence[str]) -> list[str]:
    """Return the columns of the tensions before the tests, if any."""
    measured = [name for name in cables if name in table]
    if "minimum" not in table:
        return [*cables] if measured else []
    if measured:
        table.refuse(f"has columns minimum and {measured[0]}; give one of them")
    return ["minimum"]


_AGAINST = -0.9  # correlation of force and displacement below which signs are doubted


class _LoopsFile(NamedTuple):
    """A file of loops, and the columns in which it has what was read and the tensions."""

    table: Columns
    arm: Manipulator
    joints: JointColumns
    readings: list[str]
    tensions: list[str]

    def check_header(self, *, given: bool) -> None:
        """Refuse a file without the columns that are needed; ``given``: minimum is an argument."""
        table = self.table
        for name in ("test", "direction"):
            if name not in table:
                table.refuse(f"has no column {name}")
        angles = [name for name in self.arm.joint_names if name in table]
        for name in ("force", *self.readings, *self.tensions, *angles):
            table.factor(name)
        if self.tensions and given:
            table.refuse("has tensions; leave out minimum")
        if not self.tensions and not given:
            first = self.arm.cables.names[0]
            remedy = f"add a column minimum [N] or one for each cable, such as {first} [N]"
            table.refuse(f"has no tensions; {remedy}, or give minimum")

    def loop(self, label: str, rows: list[Row]) -> dict[str, Any]:
        """Return the fields of a loop that its rows have."""
        table = self.table
        columns = ["direction", "link", *self.tensions, *self.joints.units]
        for name in columns:
            self._require_fixed(rows, name)
        first = rows[0]
        fields: dict[str, Any] = {"direction": axis_in(table, first)}
        fields["link"] = link_in(table, first, "link", self.arm)
        before = [table.number(first, name) for name in self.tensions]
        if self.tensions == ["minimum"]:
            fields["minimum"] = before[0]
        elif self.tensions:
            fields["tension"] = tuple(before)
        if self.readings:
            fields["displacements"] = self._displacements(label, rows)
        fields["angles"] = tuple(self.joints.angles(table, rows[:1])[0].tolist())
        fields["forces"] = tuple(table.number(row, "force") for row in rows)
        if self.readings:
            self._doubt_signs(label, fields)
        return fields

    def _doubt_signs(self, label: str, fields: dict[str, Any]) -> None:
        """Warn of a place that moves against the force on it, as no stable arm moves."""
        force = np.array(fields["forces"]) - np.mean(fields["forces"])
        moved = fields["displacements"]
        moved = moved if moved.ndim == 1 else moved @ np.array(fields["direction"])
        moved = moved - moved.mean()
        if force @ moved < _AGAINST * np.linalg.norm(force) * np.linalg.norm(moved):
            where = f"{self.table.path}: test {label}: its readings go against the force"
            warn(f"{where}. Check the signs of force and displacement, and the direction.")

    def _displacements(self, label: str, rows: list[Row]) -> Array:
        """Return what was read (n,), or (n, 3) [m]."""
        read = np.array([[self.table.number(row, name) for name in self.readings] for row in rows])
        if (moved := float(np.ptp(read, axis=0).max())) > self.arm.length:
            self.table.refuse(
                f"test {label}: its readings span {moved:.4g} m, more than the arm is long, "
                f"{self.arm.length:.4g} m; give the unit in which they were read"
            )
        return read[:, 0] if len(self.readings) == 1 else read

    def _require_fixed(self, rows: list[Row], name: str) -> None:
        """Refuse later cells of a column that differ from the first one of a test."""
        first = self.table.text(rows[0], name)
        for row in rows[1:]:
            if (entry := self.table.text(row, name)) not in (first, ""):
                self.table.refuse(
                    f"line {row[0]}, column {name}: {entry!r} given, but {first!r} at the "
                    "beginning of the test, which fixes it; begin another test"
                )
