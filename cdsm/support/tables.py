"""Read and write text files of numbers: comment lines that begin with #, a header, rows."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Callable, Iterable, Mapping
from typing import Final, NamedTuple, NoReturn

from cdsm.errors import FileError, did_you_mean, listed
from cdsm.support.files import read_text

ANGLE: Final = {"deg": math.pi / 180.0, "°": math.pi / 180.0, "rad": 1.0}
"""Units of angles in a header, in SI."""

SLIDE: Final = {"mm": 1e-3, "m": 1.0}
"""Units of a prismatic joint in a header, in SI."""

NEWTONS: Final = {"N": 1.0}
"""Units of forces and tensions in a header, in SI."""

TEXT: Final[dict[str, float]] = {}
"""Units of a text in a header: none."""

MEANINGFUL: Final = frozenset(
    {"force", "moment", "mass", "load", "direction", "displacement", "test", "target"}
    | {"tension", "pull", "minimum", "maximum", "link", "load_link"}
)
"""Names of columns that change an answer: a file whose reader does not know one is refused."""


def csv_text(head: Iterable[object], rows: Iterable[Iterable[object]]) -> str:
    """Write a header and rows as CSV."""
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([head, *rows])
    return out.getvalue()


Row = tuple[int, list[str]]  # line number and cells


class Table(NamedTuple):
    """A table that was read from a text file. Its cells have no white space around them."""

    rows: list[Row]  # the first row is the header
    comments: list[str]  # lines that begin with #
    delimiter: str  # between cells

    @property
    def header(self) -> list[str]:
        """Return the cells of the first row."""
        return self.rows[0][1]

    def number(self, cell: str) -> float:
        """Return the number in a cell, or NaN; commas are decimal marks if none is a delimiter."""
        try:
            return float(cell if self.delimiter == "," else cell.replace(",", "."))
        except ValueError:
            return math.nan


def _rows_of_numbers(table: Table) -> int:
    rows = (cells for _, cells in table.rows)
    return sum(sum(not math.isnan(table.number(cell)) for cell in row) > 1 for row in rows)


def _cells_of_header(table: Table) -> int:
    return len(table.header) if table.rows else 0


def read_table(
    path: str | os.PathLike[str],
    delimiters: str,
    *,
    rank: Callable[[Table], int] = _rows_of_numbers,
    any_encoding: bool = False,
) -> Table:
    """Read a table from a text file.

    The delimiter of the cells is the first of ``delimiters`` whose table has the highest ``rank``:
    by default, most lines with two or more numbers. ``any_encoding`` is an argument of
    :func:`read_text`. FileError names a line that cannot be split into cells.
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
            at = kept[split.line_num - 1][0]
            why = f"{error}" or "a quote is not closed before it"
            raise FileError(path, f"line {at} is no line of a table: {why}.") from None
        tables.append(Table(rows, comments, delimiter))
    return max(tables, key=rank)


def name_and_unit(cell: str) -> tuple[str, str]:
    """Split a header cell such as ``joint1 [deg]``; without brackets the unit is empty."""
    name, _, unit = cell.replace("(", "[").partition("[")
    return name.strip(), unit.rstrip(" )]").strip()


def column_names(path: str | os.PathLike[str]) -> list[str]:
    """Return the names of the columns of a CSV file, without their units."""
    table = read_table(path, ",;\t", rank=_cells_of_header)
    return [name_and_unit(cell)[0] for cell in table.header] if table.rows else []


class Columns:
    """Columns of a CSV file: a header of names with units, such as ``force [N]``, then rows.

    Commas, semicolons or tabs separate them; commas are decimal marks if they do not. ``units`` has
    the units of each known column with their factors to SI; of a text, none. Other columns are
    ignored, unless they are almost called as a known one, hold angles of unknown joints, or have a
    name of :data:`MEANINGFUL` or of ``refused``, which this reader does not read; those of
    ``results`` are not read, since they came from what is read.
    Spreadsheets also write empty columns at the end, and empty rows: they do not count.
    ``holds`` says what the rows are. FileError names each fault, with its line and column.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        units: Mapping[str, Mapping[str, float]],
        holds: str,
        refused: Iterable[str] = (),
        results: Iterable[str] = (),
    ) -> None:
        table = read_table(path, ",;\t", rank=_cells_of_header)
        self.path = path
        self.units = dict(units)
        self._number = table.number
        self.rows = [row for row in table.rows[1:] if any(row[1])]
        self._at = dict[str, int]()  # by name
        self.unit = dict[str, str]()
        if not self.rows:
            self.refuse(f"holds no {holds}; a header and a line for each are needed")
        width = max((k for k, cell in enumerate(table.header, 1) if cell), default=0)
        for line, cells in self.rows:
            if any(cells[width:]):
                more = f"{len(cells)} cells, but the header {width}; write decimals with a point"
                self.refuse(f"line {line}: has {more}")
        unread = {*MEANINGFUL, *refused} - {*results}
        for at, (name, unit) in enumerate(map(name_and_unit, table.header)):
            if name in self:
                self.refuse(f"has two columns called {name}; give each once")
            if name not in units and name in unread:
                known = f"a file of {holds} has {listed([*units], 12)}"
                self.refuse(
                    f"has a column {name}, which is not read: {known}. Rename it to keep it"
                )
            as_long = [column for column in units if abs(len(column) - len(name)) < 2]
            hint = did_you_mean(name, as_long, least=0.8)
            if name in units:
                self._at[name] = at
                self.unit[name] = unit
            elif hint or (unit in ANGLE and name.rpartition(" ")[2] not in units):
                hint = f"{hint} There" if hint else "; there"
                self.refuse(f"has a column {name}, which is not known{hint} are {listed([*units])}")

    def __contains__(self, name: str) -> bool:
        return name in self._at

    def refuse(self, problem: str) -> NoReturn:
        """Raise FileError."""
        raise FileError(self.path, f"{problem}.")

    def factor(self, name: str) -> float:
        """Return the factor to SI of a column; refuse it if it is missing or has no known unit."""
        if (unit := self.unit.get(name, "")) not in self.units[name]:
            fault = f"the column {name} has no unit that is known"
            names = " or ".join(f"{name} [{unit}]" for unit in self.units[name])
            self.refuse(f"{fault if name in self else f'has no column {name}'}; call it {names}")
        return self.units[name][unit]

    def text(self, row: Row, name: str) -> str:
        """Return the cell of a row in a column; empty if there is none."""
        at = self._at.get(name, len(row[1]))
        return "".join(row[1][at : at + 1])

    def number(self, row: Row, name: str) -> float:
        """Return the number of a row in a column, in SI."""
        value = self._number(cell := self.text(row, name))
        if not math.isfinite(value):
            self.refuse(f"line {row[0]}, column {name}: {cell!r} is not a finite number")
        return value * self.factor(name)
