"""Read and write text files of numbers: comment lines that begin with #, a header, rows."""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Final, NamedTuple, NoReturn

import numpy as np

from cdsm.errors import FileError, listed
from cdsm.support.files import read_text
from cdsm.support.records import misspelt
from cdsm.support.values import Array

_LONGEST_CELL = 1000  # maximum number of characters of a cell; numbers and names are shorter

ANGLE: Final = {"deg": math.pi / 180.0, "°": math.pi / 180.0, "rad": 1.0}
"""Units of angles in a header, in SI."""

_ALIKE = 0.8  # similarity of names that differ in one letter of five or more
_NUMBERED = re.compile(r"[^\d]+(?=\d)")  # what is before the number of a name
_TRIED = 500  # lines that tell the delimiter; titles are fewer


def csv_text(head: Iterable[object], rows: Iterable[Iterable[object]]) -> str:
    """Write a header and rows as CSV."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([head, *rows])
    return out.getvalue()


class Table(NamedTuple):
    """A table that was read from a text file. Its cells have no white space around them."""

    rows: list[tuple[int, list[str]]]  # line number and cells; the first row is the header
    comments: list[str]  # lines that begin with #
    delimiter: str  # between cells

    @property
    def header(self) -> list[str]:
        """Return the cells of the first row."""
        return self.rows[0][1]

    def column(self, at: int, refuse: Callable[[str], NoReturn], first: int = 1) -> Array:
        """Return the numbers of the column with index ``at``, from the row ``first`` on.

        If a cell is not a finite number, ``refuse`` is called, which raises an error.
        """
        numbers = []
        for line, cells in self.rows[first:]:
            cell = cells[at] if at < len(cells) else ""
            value = self.number(cell)
            if not math.isfinite(value):
                refuse(f"line {line}: {cell!r} is not a finite number")
            numbers.append(value)
        return np.array(numbers)

    def number(self, cell: str) -> float:
        """Return the number in a cell; NaN if the cell has no number."""
        try:
            return float(cell if self.delimiter == "," else cell.replace(",", "."))
        except ValueError:
            return math.nan


def read_table(
    path: str | os.PathLike[str], delimiters: str = ",", *, any_encoding: bool = False
) -> Table:
    """Read a table from a text file.

    The delimiter of the cells is the first of ``delimiters`` that splits most lines into two or
    more numbers. ``any_encoding`` is an argument of :func:`read_text`. FileError names a line that
    cannot be split into cells.
    """
    text = read_text(path, any_encoding=any_encoding)
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip()]
    comments = [line for _, line in lines if line.lstrip().startswith("#")]
    lines = [(k, line) for k, line in lines if not line.lstrip().startswith("#")]
    delimiter = max(delimiters, key=lambda each: _rows_of_numbers(lines[:_TRIED], each))
    rows = [(k, _cells(path, k, line, delimiter)) for k, line in lines]
    return Table(rows, comments, delimiter)


def _rows_of_numbers(lines: list[tuple[int, str]], delimiter: str) -> int:
    """Count the lines that have two or more numbers if ``delimiter`` splits them."""
    table = Table([], [], delimiter)
    cells = ([cell.strip(' "') for cell in line.split(delimiter)] for _, line in lines)
    return sum(sum(not math.isnan(table.number(cell)) for cell in row) > 1 for row in cells)


def name_and_unit(cell: str) -> tuple[str, str]:
    """Split a header cell such as ``joint1 [deg]``; without brackets the unit is empty."""
    found = re.fullmatch(r"(.*?)\s*(?:\[(.*)\])?", cell, re.DOTALL)
    assert found is not None
    return found[1], found[2] or ""


def named_columns(
    table: Table, known: Sequence[str], refuse: Callable[[str], NoReturn]
) -> dict[str, tuple[int, str]]:
    """Return index and unit of each column of a table, by the name of the column.

    Columns with other names than the ``known`` ones are allowed. ``refuse`` is called, which raises
    an error, if a name is given twice, looks like a misspelt known name, or has the letters of a
    known name before its number (a joint that the arm does not have). It is also called if
    semicolons separate the columns, or a row has more cells than the header.
    """
    if len(table.header) == 1 and ";" in table.header[0]:
        refuse("has its columns separated by semicolons; separate them by commas")
    width = len(table.header)
    for line, cells in table.rows[1:]:
        if any(cells[width:]):
            refuse(
                f"line {line}: has {len(cells)} cells, but the header {width}; write decimals with "
                "a point"
            )
    found: dict[str, tuple[int, str]] = {}
    kinds = {begin[0] for each in known if (begin := _NUMBERED.match(each))}
    for at, cell in enumerate(table.header):
        name, unit = name_and_unit(cell)
        if name in found:
            refuse(f"has two columns called {name}; give each once")
        if meant := misspelt(name, known, _ALIKE):
            refuse(f"has a column {name}, which is not known{meant} Rename it")
        begin = _NUMBERED.match(name)
        if name not in known and begin and begin[0] in kinds:
            refuse(f"has a column {name}, which is not known; there are {listed(known)}")
        found[name] = at, unit
    return found


def column_in(
    known: dict[str, float],
    name: str,
    found: dict[str, tuple[int, str]],
    refuse: Callable[[str], NoReturn],
) -> tuple[int, float]:
    """Return the index of the column ``name``, and the factor that converts its unit to SI.

    ``known`` has this factor for each allowed unit. ``found`` is a result of :func:`named_columns`.
    If the column is missing or has another unit, ``refuse`` is called, which raises an error.
    """
    at, unit = found.get(name, (-1, ""))
    if unit not in known:
        fault = f"the column {name} has no unit that is known"
        names = " or ".join(f"{name} [{unit}]" for unit in known)
        refuse(f"{fault if at >= 0 else f'has no column {name}'}; call it {names}")
    return at, known[unit]


def _cells(path: str | os.PathLike[str], number: int, line: str, delimiter: str) -> list[str]:
    try:
        cells = [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
    except csv.Error as error:
        raise FileError(path, f"line {number} is no line of a table: {error}.") from None
    longest = max(map(len, cells), default=0)
    if longest > _LONGEST_CELL:
        raise FileError(
            path,
            f"line {number} has a cell of {longest} characters; {_LONGEST_CELL} are read at most.",
        )
    return cells
