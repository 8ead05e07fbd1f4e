"""Read loops of weight tests from CSV files, with units."""

from __future__ import annotations

import math
import os
from itertools import groupby
from typing import Any, Final, NamedTuple, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import FileError, InvalidInput
from cdsm.identification.loop import WeightLoop
from cdsm.manipulator import Manipulator
from cdsm.support.directions import AXES
from cdsm.support.tables import ANGLE, Table, column_in, named_columns, read_table
from cdsm.support.validation import instance

_LENGTH: Final = {"mm": 1e-3, "um": 1e-6, "µm": 1e-6, "m": 1.0}
_FORCE: Final = {"N": 1.0}
_NAMES: Final = ("test", "direction", "force", "displacement", *"xyz", "minimum")


class _Column(NamedTuple):
    at: int  # index in a row
    name: str
    size: float  # size of its unit in SI


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
      joints: the angle before the first force. A joint without a column is at 0.
    - ``direction``: direction of the forces, an axis such as ``-z``.
    - ``force [N]``: force along the direction, 0 where nothing hangs.
    - ``displacement [mm]``: reading along the direction; or ``x [mm]``, ``y [mm]`` and ``z [mm]``.
      The unit may be um or m, and the offset is arbitrary. A file of planned tests has no readings.
    - A column per cable, such as ``cable1_1 [N]``: the tension before the first force. Or
      ``minimum [N]``: the lower bound with which the tensions are distributed.

    A cell of a joint, a cable, ``direction`` or ``minimum`` may be empty after the first line of a
    test. Lines that begin with # are ignored. Columns with other names are ignored too, unless a
    name looks like a misspelling of one of these names, or like a joint or cable that the arm does
    not have: that is an error.

    Args:
        path: The file.
        arm: The arm, whose joints and cables the columns name.
        displacement_std: Standard deviation of a reading [m].
        minimum: Lower bound of the tensions [N], one number or (C,), if the file has no tensions.

    Raises:
        FileError: The file cannot be read, a column is missing or has no unit, or an entry is
            wrong; the line and the column are named.
        InvalidInput: ``displacement_std`` or ``minimum`` is invalid.
    """
    instance("arm", arm, Manipulator)
    table = read_table(path)
    return _Reader(path, arm, table).loops(minimum, displacement_std=displacement_std)


class _Reader:
    def __init__(self, path: str | os.PathLike[str], arm: Manipulator, table: Table) -> None:
        self._path, self._arm, self._table = path, arm, table
        if len(table.rows) < 2:
            self._refuse("holds no loops; a header and one line per reading are needed")
        known = *_NAMES, *arm.joint_names, *arm.cables.names
        self._header = named_columns(table, known, self._refuse)
        kinds = [_LENGTH if slides else ANGLE for slides in arm.slides]
        self._joints = [
            self._column(name, units) if name in self._header else None
            for name, units in zip(arm.joint_names, kinds, strict=True)
        ]
        self._test, self._direction = self._column("test"), self._column("direction")
        self._force = self._column("force", _FORCE)
        names = ["displacement"] if "displacement" in self._header else [*"xyz"]
        planned = not any(name in self._header for name in names)
        self._read = [] if planned else [self._column(name, _LENGTH) for name in names]
        self._tensions = self._tension_columns()

    def _tension_columns(self) -> list[_Column]:
        """Find the columns of the tensions, or the column of their lower bound."""
        cables = [name for name in self._arm.cables.names if name in self._header]
        if "minimum" in self._header:
            if cables:
                self._refuse(f"has columns minimum and {cables[0]}; give one of them")
            return [self._column("minimum", _FORCE)]
        return [self._column(name, _FORCE) for name in self._arm.cables.names] if cables else []

    def loops(self, minimum: ArrayLike | None, **std: float) -> tuple[WeightLoop, ...]:
        if not self._tensions and minimum is None:
            self._refuse(
                "has no tensions; add a column minimum [N] or one for each cable, such as "
                f"{self._arm.cables.names[0]} [N], or give minimum="
            )
        if self._tensions and minimum is not None:
            self._refuse("has tensions; leave out minimum=")
        bound = None if minimum is None else np.asarray(minimum).tolist()
        loops, rows = list[WeightLoop](), self._table.rows[1:]
        for label, group in groupby(rows, lambda row: self._cell(row, self._test)):
            own = list(group)
            if not label:
                self._refuse(f"line {own[0][0]}: the test has no name")
            if label in [loop.label for loop in loops]:
                self._refuse(f"line {own[0][0]}: the test {label} goes on after another one")
            loops.append(self._loop(label, own, bound, **std))
        return tuple(loops)

    def _loop(
        self, label: str, rows: list[tuple[int, list[str]]], bound: object, **std: float
    ) -> WeightLoop:
        first = rows[0]
        direction = self._same(rows, self._direction)
        if direction not in AXES:
            self._refuse(
                f"line {first[0]}, column direction: {direction!r} is no axis; give one of "
                f"{', '.join(AXES)}"
            )
        angles = [
            0.0 if column is None else self._number(first, column, self._same(rows, column))
            for column in self._joints
        ]
        forces = [self._number(row, self._force) for row in rows]
        tensions = [self._number(first, each, self._same(rows, each)) for each in self._tensions]
        given: dict[str, Any] = {"minimum": bound, **std}
        if self._tensions:
            alone = self._tensions[0].name == "minimum"
            given |= {"minimum": tensions[0]} if alone else {"minimum": None, "tension": tensions}
        read = np.array([[self._number(row, each) for each in self._read] for row in rows])
        if self._read:
            moved = float(np.ptp(read, axis=0).max())
            if moved > self._arm.length:
                self._refuse(
                    f"test {label}: its readings span {moved:.4g} m, more than the arm is long, "
                    f"{self._arm.length:.4g} m; give the unit in which they were read"
                )
            given["displacements"] = read[:, 0] if read.shape[1] == 1 else read
        try:
            return WeightLoop(
                direction=AXES[direction],
                angles=tuple(angles),
                forces=tuple(forces),
                label=label,
                **given,
            )
        except InvalidInput as error:
            if str(error).startswith(("minimum", *std)):
                raise
            raise FileError(self._path, f"test {label}: {error}") from None

    def _column(self, name: str, units: dict[str, float] | None = None) -> _Column:
        """Find the column ``name``, with one of ``units``; raise FileError if it is missing."""
        if units is not None:
            at, size = column_in(units, name, self._header, self._refuse)
            return _Column(at, name, size)
        if name not in self._header:
            self._refuse(f"has no column {name}")
        return _Column(self._header[name][0], name, 1.0)

    def _cell(self, row: tuple[int, list[str]], column: _Column) -> str:
        return row[1][column.at] if column.at < len(row[1]) else ""

    def _same(self, rows: list[tuple[int, list[str]]], column: _Column) -> str:
        """Return the cell of ``column`` in the first of ``rows``, the rows of one test.

        Raises FileError if a later row has another text in this column; it may be empty.
        """
        first = self._cell(rows[0], column)
        for row in rows[1:]:
            if self._cell(row, column) not in (first, ""):
                self._refuse(
                    f"line {row[0]}, column {column.name}: {self._cell(row, column)!r} given, but "
                    f"{first!r} at the beginning of the test, which fixes it; begin another test"
                )
        return first

    def _number(
        self, row: tuple[int, list[str]], column: _Column, cell: str | None = None
    ) -> float:
        cell = self._cell(row, column) if cell is None else cell
        value = self._table.number(cell)
        if not math.isfinite(value):
            self._refuse(f"line {row[0]}, column {column.name}: {cell!r} is not a finite number")
        return value * column.size

    def _refuse(self, problem: str) -> NoReturn:
        raise FileError(self._path, f"{problem}.")
