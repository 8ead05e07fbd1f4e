"""Read and write text files of numbers: comment lines that begin with #, a header, rows."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Callable, Iterable, Sequence
from typing import Final, NamedTuple, NoReturn

import numpy as np

from cdsm.errors import FileError, did_you_mean, listed
from cdsm.support.files import read_text
from cdsm.support.values import Array

ANGLE: Final = {"deg": math.pi / 180.0, "°": math.pi / 180.0, "rad": 1.0}
"""Units of angles in a header, in SI."""


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
            numbers.append(self.number(cell))
            if not math.isfinite(numbers[-1]):
                refuse(f"line {line}: {cell!r} is not a finite number")
        return np.array(numbers)

    def number(self, cell: str) -> float:
        """Return the number in a cell, or NaN; commas are decimal marks if none is a delimiter."""
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
    lines = enumerate(read_text(path, any_encoding=any_encoding).splitlines(), start=1)
    filled = [(number, line) for number, line in lines if line.strip()]
    comments = [line for _, line in filled if line.lstrip().startswith("#")]
    kept = [(number, line) for number, line in filled if not line.lstrip().startswith("#")]
    tables = []
    for delimiter in delimiters:
        split = csv.reader([line for _, line in kept], delimiter=delimiter)
        try:
            rows = [(number, [cell.strip() for cell in next(split)]) for number, _ in kept]
        except (csv.Error, StopIteration) as error:
            at, why = kept[split.line_num - 1][0], f"{error}" or "a quote is not closed before it"
            raise FileError(path, f"line {at} is no line of a table: {why}.") from None
        tables.append(Table(rows, comments, delimiter))
    return max(tables, key=_rows_of_numbers)


def _rows_of_numbers(table: Table) -> int:
    rows = (cells for _, cells in table.rows)
    return sum(sum(not math.isnan(table.number(cell)) for cell in row) > 1 for row in rows)


def name_and_unit(cell: str) -> tuple[str, str]:
    """Split a header cell such as ``joint1 [deg]``; without brackets the unit is empty."""
    name, _, unit = cell.partition("[")
    return name.strip(), unit.strip().removesuffix("]")


def named_columns(
    table: Table, known: Sequence[str], refuse: Callable[[str], NoReturn]
) -> dict[str, tuple[int, str]]:
    """Return index and unit of each column of a table, by the name of the column.

    Columns with other names than the ``known`` ones are allowed, unless they are almost a known
    name or hold angles. ``refuse`` is called, which raises an error, for those, for a name that is
    given twice, for semicolons between the columns, and for a row with more cells than the header.
    """
    width = len(table.header)
    if width == 1 and ";" in table.header[0]:
        refuse("has its columns separated by semicolons; separate them by commas")
    for line, cells in table.rows[1:]:
        if any(cells[width:]):
            more = f"{len(cells)} cells, but the header {width}; write decimals with a point"
            refuse(f"line {line}: has {more}")
    found: dict[str, tuple[int, str]] = {}
    for at, (name, unit) in enumerate(map(name_and_unit, table.header)):
        as_long = [each for each in known if abs(len(each) - len(name)) < 2]
        hint = did_you_mean(name, as_long, least=0.8)
        if name in found:
            refuse(f"has two columns called {name}; give each once")
        if name not in known and (hint or unit in ANGLE):
            hint = f"{hint} There" if hint else "; there"
            refuse(f"has a column {name}, which is not known{hint} are {listed(known)}")
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
