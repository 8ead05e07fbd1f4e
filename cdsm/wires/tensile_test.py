"""Read a tensile test, forces against displacements, from the CSV of a testing machine."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from typing import Final, NamedTuple, NoReturn

import numpy as np

from cdsm.errors import FileError, InvalidInput
from cdsm.support.tables import read_table
from cdsm.support.validation import checked_quantity, sequence_of
from cdsm.support.values import Array, frozen

_LENGTHS: Final = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "µm": 1e-6, "um": 1e-6, "in": 0.0254}
_STRAINS: Final = {"strain": 1.0, "%": 1e-2, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0, "-": 1.0}
_FORCES: Final = {"N": 1.0, "cN": 1e-2, "mN": 1e-3, "daN": 10.0, "kN": 1e3, "MN": 1e6} | {
    "lbf": 4.4482216152605,
    "kgf": 9.80665,
}
_UNITS: Final = {"displacement": _LENGTHS | _STRAINS, "force": _FORCES}
_MOVED: Final = re.compile(
    r"displacement|extension|elongation|extensometer|stroke|crosshead|position|travel|\bstrain"
)
_FORCE: Final = re.compile(r"\b(force|load)\b")
_MOVED_ABROAD: Final = re.compile(
    r"weg|dehnung|verlängerung|traverse|hub\b|déplacement|allongement|desplazamiento|alargamiento|"
    r"elongación|spostamento|allungamento|位移|变形|伸长"
)
_FORCE_ABROAD: Final = re.compile(r"kraft|\blast\b|force|effort|fuerza|carga|forza|carico|力|荷重")
_OTHER: Final = re.compile(r"\b(at|rate|max\w*|speed|limit|time)\b")  # such as "load rate"
_COMPUTED: Final = re.compile(r"strain.*\((displacement|extension)\)", re.I)
_BRACKETS: Final = re.compile(r"\s*[\[(]([^\[\]()]*)[\])]\s*$")
_LAST_WORD: Final = re.compile(r"(?<=\w)(?:\s+in\s+|[\s_/,]+)(\S+)$")
_NUMBER: Final = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_GAUGE: Final = re.compile(
    r"gau?ge[ _-]?length[^\w-]*(mm|cm|m|in)?\b[^\w-]*(-?[\d.,]*\d)\W*(mm|cm|m|in)?\b", re.I
)
_KNOWN: Final = {unit for units in _UNITS.values() for unit in units}
_MARK: Final = " Write decimals alike, with a point, or, in Python, say decimal=."
_HEADERS: Final = 50  # first lines, among which the header is


class TensileTest(NamedTuple):
    """Record of a tensile test, in the order in which the machine recorded it."""

    displacement: Array
    """Displacement of the crosshead or extensometer, shape (n,) [m]."""
    force: Array
    """Force, shape (n,) [N], tension positive."""
    gauge_length: float
    """Free length of the wire between the grips or the clips [m]."""
    source: str = ""
    """Columns that were read from a file; empty for arrays."""


def read_tensile_csv(
    path: str | os.PathLike[str],
    *,
    columns: Sequence[str] | None = None,
    units: Sequence[str] | None = None,
    decimal: str | None = None,
    gauge_length: float | None = None,
) -> TensileTest:
    """Read a tensile test from the text file of a testing machine, or from any CSV.

    The header is that of the first 50 lines which names both columns (in English) above the most
    rows of numbers. Commas, semicolons or tabs separate the columns. Units are in the header,
    ``Load [kN]``, ``Load (kN)``, ``load_kN``, or in the line below. If two columns may be the
    displacement, none is chosen silently. The gauge length may be in a line above the header, such
    as ``# gauge_length = 500 mm``.

    Args:
        path: The file.
        columns: Names of the columns of displacement (or strain) and force, if the header has other
            names, or several that fit; or their numbers, from ``"1"``, if two have one name.
        units: Their units, if the file has none: ``m``, ``cm``, ``mm``, ``µm`` or ``in``, of a
            strain ``strain``, ``mm/mm`` or ``%``; ``N``, ``mN``, ``cN``, ``daN``, ``kN``, ``MN``,
            ``lbf`` or ``kgf``.
        decimal: Decimal mark, ``.`` or ``,``; the other one may then separate thousands. Default: a
            point, or a comma if commas do not separate the columns; no thousands.
        gauge_length: `l_0` [m]; it counts more than that of the file. A strain needs none, as EA
            does not depend on it: the result is then a test of 1 m of wire, and ``source`` says so.

    Raises:
        InvalidInput: ``columns`` or ``units`` are not two texts; ``decimal`` is another mark.
        FileError: The file cannot be read; a column, a unit or the gauge length is missing, not
            known or not unique; or a cell is not a number (the line is named).

    Example:
        >>> import cdsm
        >>> test = cdsm.read_tensile_csv("examples/data/TEST.csv", gauge_length=0.5)
        >>> test.force.size, float(test.force.max().round(1))
        (92, 120.1)
    """
    for name, pair in (("columns", columns), ("units", units)):
        if pair is not None and len(sequence_of(name, pair, str)) != 2:
            raise InvalidInput(name, f"{pair!r} given; give two, of displacement and force.")
    if gauge_length is not None:
        checked_quantity("gauge_length", gauge_length, "length")
    if not (decimal is None or (isinstance(decimal, str) and decimal in (".", ","))):
        raise InvalidInput("decimal", f"{decimal!r} given; it is '.' or ','.")
    sheet = _read_sheet(path, decimal)
    header = _find_header(sheet, columns)
    displacement, force = (
        _find_column(sheet, header, kind, places, unit)
        for kind, places, unit in zip(_UNITS, header.columns, units or (None, None), strict=True)
    )
    rows = _rows_of_numbers(sheet, header, (displacement.place, force.place))
    length = _gauge_length(sheet, header) if gauge_length is None else gauge_length
    names = sheet.rows[header.row]
    source = " and ".join(
        repr(names[c.place]) + f" (column {c.place + 1})" * (names.count(names[c.place]) > 1)
        for c in (displacement, force)
    )
    source += f" of line {sheet.lines[header.row]}"
    strained = displacement.unit in _STRAINS
    if length is None:
        if not strained:
            sheet.refuse("has no gauge length; give one, or add a line # gauge_length = 500 mm.")
        length = 1.0
        source += "; no gauge length: displacements are those of 1 m of wire"
    to_m = displacement.factor * (length if strained else 1.0)
    u = np.array([sheet.values[k][displacement.place] for k in rows])
    F = np.array([sheet.values[k][force.place] for k in rows])
    return TensileTest(frozen(to_m * u), frozen(force.factor * F), length, source)


class _Sheet(NamedTuple):
    """The cells of a file, as texts and as numbers."""

    path: str | os.PathLike[str]
    lines: list[int]  # number of the line of each row in the file
    rows: list[list[str]]
    values: list[list[float]]  # the numbers in the cells; NaN where there is none
    comments: list[str]
    delimiter: str
    decimal: str | None

    def refuse(self, problem: str) -> NoReturn:
        """Raise FileError."""
        raise FileError(self.path, problem)


class _Header(NamedTuple):
    """A row that may name the columns of a test, and what is below it."""

    row: int
    units: list[str]  # cells of the row of units below it, if there is one
    first: int  # first row of numbers
    points: int  # rows of numbers
    columns: tuple[list[int], list[int]]  # that may be the displacement, and the force

    @property
    def names_both(self) -> bool:
        """Whether it names displacement and force, and not both by one column."""
        displacements, forces = self.columns
        return bool(displacements and forces and displacements != forces)


class _Column(NamedTuple):
    """A column of a test."""

    place: int
    unit: str
    factor: float  # to m, strains or N


def _read_sheet(path: str | os.PathLike[str], decimal: str | None) -> _Sheet:
    table = read_table(path, ";\t,", any_encoding=True)
    rows = [[cell.replace("μ", "µ") for cell in row] for _, row in table.rows]  # no Greek letter
    values = [[_number(cell, table.delimiter, decimal) for cell in row] for row in rows]
    lines = [line for line, _ in table.rows]
    return _Sheet(path, lines, rows, values, [*table.comments], table.delimiter, decimal)


def _find_header(sheet: _Sheet, columns: Sequence[str] | None) -> _Header:
    """Return the first header that names both columns above the most rows of numbers."""
    counts = [int(np.isfinite(row).sum()) for row in sheet.values]
    headers = []
    for row, (line, cells) in enumerate(zip(sheet.lines, sheet.rows, strict=True)):
        if line <= _HEADERS and not counts[row]:
            below = sheet.rows[row + 1] if row + 1 < len(sheet.rows) else []
            units = [cell.strip("[]() ") for cell in below]
            units = [] if _KNOWN.isdisjoint(units) else units
            first = row + 1 + bool(units)
            end = next((k for k in range(first, len(counts)) if counts[k] < 2), len(counts))
            headers.append(_Header(row, units, first, end - first, _fitting(cells, columns)))
    best = max(headers, key=lambda header: (header.names_both, header.points), default=None)
    if not sheet.rows:
        sheet.refuse("is empty; give a header and a line for each reading, as TEST.csv has.")
    if not any(counts):
        opening = ", ".join(sheet.rows[0])
        sheet.refuse(f"holds no readings: no line has numbers; its first line is {opening!r}.")
    if best is None or not best.names_both:
        names = sheet.rows[best.row if best else 0] if sheet.rows else []
        sheet.refuse(
            f"has no header that names {' and '.join(columns or ('displacement', 'force'))} in "
            f"its first {_HEADERS} lines; there are {', '.join(names) or 'none'}; {_guess(names)}"
        )
    return best


def _find_column(
    sheet: _Sheet, header: _Header, kind: str, places: list[int], unit: str | None
) -> _Column:
    """Return the only column of a kind, with its unit; ``unit`` is that of the argument."""
    names = sheet.rows[header.row]
    if len(places) > 1:
        several = " and ".join(names[place] for place in places)
        sheet.refuse(f"{several} may both be the {kind}; give {_choices(names, header)}.")
    known = _UNITS[kind]
    place = places[0]
    written = [_name_and_unit(names[place])[1], *header.units[place : place + 1]]
    read = next((text for text in (*written, unit) if text in known), None)
    if read is None or unit not in (None, read):
        sheet.refuse(
            f"has the {kind} {names[place]!r} in {' '.join(written).strip() or 'no unit'}, and "
            f"{unit or 'none'} is given as units; give one of {', '.join(known)}."
        )
    return _Column(place, read, known[read])


def _choices(names: list[str], header: _Header) -> str:
    """Return the columns to give if several columns fit: by name, or by number if two share it."""
    displacements, forces = header.columns
    texts = [_name_and_unit(name)[0] or name for name in names]
    shared = any(texts.count(texts[k]) > 1 for k in (*displacements, *forces))
    pairs = []
    for k in range(max(len(displacements), len(forces))):
        places = displacements[min(k, len(displacements) - 1)], forces[min(k, len(forces) - 1)]
        pairs.append([f"{place + 1}" if shared else texts[place] for place in places])
    return _given_as(pairs, " or ")


def _guess(names: list[str]) -> str:
    """Return which columns to give if the header names none in English; ``names`` are its cells."""
    texts = [_name_and_unit(name)[0] for name in names]
    if {"angle", "torque"} <= {text.lower() for text in texts}:
        return "points of a spring? Give --spring, or, in Python, read them by read_spring_csv()."
    moved = [text for text in texts if _MOVED_ABROAD.search(text.lower())]
    force = [text for text in texts if _FORCE_ABROAD.search(text.lower())]
    if not moved or not force or moved[0] == force[0]:
        return "which columns?"
    return f"give {_given_as([[moved[0], force[0]]], '')}."


def _given_as(pairs: list[list[str]], between: str) -> str:
    """Return pairs of columns as the option of the command and as the argument."""
    quoted = [[f'"{text}"' if "," in text else text for text in pair] for pair in pairs]
    options = between.join(f"--columns {','.join(pair)}" for pair in quoted)
    return f"{options}, or, in Python, columns={tuple(pairs[0])}"


def _rows_of_numbers(sheet: _Sheet, header: _Header, places: tuple[int, int]) -> range:
    """Return the rows of the test, of which both cells are numbers; text below is no part of it."""
    names = sheet.rows[header.row]
    last = 0
    for k, row in enumerate(sheet.rows):
        if len(row) > max(places) and re.search(r"\d", row[places[1]]):
            last = k
    rows = range(header.first, last + 1)
    for k in rows:
        row = sheet.rows[k]
        for place in places:
            cell = row[place] if place < len(row) else ""
            if not math.isfinite(_number(cell, sheet.delimiter, sheet.decimal)):
                mark = _MARK * ("," in cell)
                sheet.refuse(
                    f"line {sheet.lines[k]}: {cell!r} under {names[place]!r} is no number.{mark}"
                )
        if any(row[len(names) :]):
            cells = sheet.delimiter.join(row)
            sheet.refuse(f"line {sheet.lines[k]}: {cells!r} has too many cells.{_MARK}")
    text = "".join(sheet.rows[k][place] for k in rows for place in places)
    if not sheet.decimal and sheet.delimiter != "," and {",", "."} <= set(text):
        sheet.refuse(f"has numbers with commas and with points.{_MARK}")
    return rows


def _gauge_length(sheet: _Sheet, header: _Header) -> float | None:
    """Return the gauge length [m] above the header or in a comment; None if there is none."""
    above = map(" ".join, sheet.rows[: header.row])
    for match in _GAUGE.finditer("\n".join([*sheet.comments, *above])):
        if unit := match[1] or match[3]:
            return _number(match[2], ";", sheet.decimal) * _LENGTHS[unit.lower()]
    return None


def _fitting(row: list[str], columns: Sequence[str] | None) -> tuple[list[int], list[int]]:
    """Return the columns of a header that may be the displacement, and those of the force."""
    texts = [cell.lower() for cell in row]
    names = [_name_and_unit(cell)[0].lower() for cell in row]
    if columns is not None:
        displacement, force = (_named(column.strip().lower(), texts) for column in columns)
        return displacement, force
    places = [k for k, name in enumerate(names) if not _OTHER.search(name)]
    displacements = [k for k in places if _MOVED.search(names[k])]
    # "strain (extension)" is no other gauge than the extension
    measured = [k for k in displacements if not _COMPUTED.search(row[k])]
    return measured or displacements, [k for k in places if _FORCE.search(names[k])]


def _named(column: str, texts: list[str]) -> list[int]:
    """Return the columns that contain a text, or the one of a number from 1 on."""
    if column.isdecimal() and column not in texts:
        return [int(column) - 1] if 1 <= int(column) <= len(texts) else []
    return [k for k, text in enumerate(texts) if column in text]


def _name_and_unit(cell: str) -> tuple[str, str]:
    """Split a cell of a header such as ``Load [kN]`` or ``load_kN`` into name and unit, if any."""
    name = cell
    unit = ""
    while brackets := _BRACKETS.search(name):
        name = name[: brackets.start()]
        unit = unit or brackets[1].strip()
    if not unit and (last := _LAST_WORD.search(name)) and last[1] in _KNOWN:
        name = name[: last.start()]
        unit = last[1]
    return name, unit


def _number(cell: str, delimiter: str, decimal: str | None) -> float:
    """Return the number in a cell; NaN if there is none."""
    if decimal:
        other = "." if decimal == "," else ","
        cell = re.sub(rf"(?<=\d)[{other}](?=\d{{3}}(?!\d))", "", cell)
        cell = cell.replace(other, "?").replace(decimal, ".")
    elif delimiter != "," and "." not in cell:
        cell = cell.replace(",", ".")
    return float(cell) if _NUMBER.fullmatch(cell) else math.nan
