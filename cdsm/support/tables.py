"""Tables of numbers in text files: comments behind #, a header, and a line per row."""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Callable
from typing import NamedTuple, NoReturn

import numpy as np

from cdsm.errors import FileError
from cdsm.support.files import read_text
from cdsm.support.values import Array

_LONGEST_CELL = 1000
"""Characters of a cell: longer than any number or name."""


class Table(NamedTuple):
    """The cells of a table, white space around them removed.

    Attributes:
        rows: Line number and cells of every line that is no comment; the first is the header.
        comments: The lines that begin with #.
        delimiter: What separates the cells; with another than a comma, decimal commas are read.
    """

    rows: list[tuple[int, list[str]]]
    comments: list[str]
    delimiter: str

    @property
    def header(self) -> list[str]:
        """The cells of the first row."""
        return self.rows[0][1]

    def column(self, at: int, refuse: Callable[[str], NoReturn], first: int = 1) -> Array:
        """The numbers of a column from a row on; ``refuse`` is called for what is none."""
        numbers = []
        for line, cells in self.rows[first:]:
            cell = cells[at] if at < len(cells) else ""
            value = self.number(cell)
            if not math.isfinite(value):
                refuse(f"line {line}: {cell!r} is not a finite number")
            numbers.append(value)
        return np.array(numbers)

    def number(self, cell: str) -> float:
        """The number in a cell; NaN if there is none."""
        try:
            return float(cell if self.delimiter == "," else cell.replace(",", "."))
        except ValueError:
            return math.nan


def read_table(path: str | os.PathLike[str], delimiters: str = ",") -> Table:
    """Read a table.

    Args:
        path: The file.
        delimiters: What may separate the cells; the first of these that is in the header does, or
            else the last.

    Raises:
        FileError: The file cannot be read, or a line is no line of a table; the line is named.
    """
    lines = [(k, line) for k, line in enumerate(read_text(path).splitlines(), 1) if line.strip()]
    comments = [line for _, line in lines if line.lstrip().startswith("#")]
    lines = [(k, line) for k, line in lines if not line.lstrip().startswith("#")]
    header = lines[0][1] if lines else ""
    delimiter = next((each for each in delimiters if each in header), delimiters[-1])
    rows = [(k, _cells(path, k, line, delimiter)) for k, line in lines]
    return Table(rows, comments, delimiter)


def name_and_unit(cell: str) -> tuple[str, str]:
    """The parts of a header such as ``joint1 [deg]``; without brackets the unit is empty."""
    found = re.fullmatch(r"(.*?)\s*(?:\[(.*)\])?", cell, re.DOTALL)
    assert found is not None
    return found[1], found[2] or ""


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
