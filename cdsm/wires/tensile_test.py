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
            names, or several that fit.
        units: Their units, if the file has none: ``m``, ``cm``, ``mm``, ``µm`` or ``in``, of a
            strain ``strain``, ``mm/mm`` or ``%``; ``N``, ``mN``, ``cN``, ``daN``, ``kN``, ``MN``,
            ``lbf`` or ``kgf``.
        decimal: Decimal mark, ``.`` or ``,``; the other one may then separate thousands. Default: a
            point, or a comma if commas do not separate the columns; no thousands.
        gauge_length: l_0 [m]; it counts more than that of the file. A strain needs none, as EA does
            not depend on it: the result is then a test of 1 m of wire, and ``source`` says so.

    Raises:
        InvalidInput: ``columns`` or ``units`` are not two texts; ``decimal`` is another mark.
        FileError: The file cannot be read; a column, a unit or the gauge length is missing, not
            known or not unique; or a cell is not a number (the line is named).
    """
    for name, pair in (("columns", columns), ("units", units)):
        if pair is not None and len(sequence_of(name, pair, str)) != 2:
            raise InvalidInput(name, f"{pair!r} given; give two, of displacement and force.")
    if gauge_length is not None:
        checked_quantity("gauge_length", gauge_length, "length")
    if decimal not in (None, ".", ","):
        raise InvalidInput("decimal", f"{decimal!r} given; it is '.' or ','.")
    table = read_table(path, ";\t,", any_encoding=True)
    micro = [(line, [cell.replace("μ", "µ") for cell in row]) for line, row in table.rows]
    table = table._replace(rows=micro)  # not the Greek letter

    def refuse(problem: str) -> NoReturn:
        raise FileError(path, problem)

    rows = [row for _, row in table.rows]
    values = [[_number(cell, table.delimiter, decimal) for cell in row] for row in rows]
    counts = [int(np.isfinite(row).sum()) for row in values]
    heads = []
    for at, (line, row) in enumerate(table.rows):
        if line <= _HEADERS and not counts[at]:
            below = [cell.strip("[]() ") for cell in rows[at + 1]] if at + 1 < len(rows) else []
            below = [] if _KNOWN.isdisjoint(below) else below  # the units
            first = at + 1 + bool(below)
            points = next((k for k in range(first, len(rows)) if counts[k] < 2), len(rows)) - first
            fit = _fitting(row, columns)
            heads.append((all(fit) and fit[0] != fit[1], points, -at, first, below, fit))
    found, _, at, first, below, fit = max(heads, default=(False, 0, 0, 0, [], ([], [])))
    names = rows[-at] if rows else []
    if not found:
        refuse(
            f"has no header that names {' and '.join(columns or ('displacement', 'force'))} in "
            f"its first {_HEADERS} lines; there are {', '.join(names) or 'none'}; which columns?"
        )
    at = -at
    chosen = []
    for kind, places, given in zip(_UNITS, fit, units or (None, None), strict=True):
        if len(places) > 1:
            several = " and ".join(names[k] for k in places)
            refuse(f"{several} may both be the {kind}; give one as columns.")
        known = _UNITS[kind]
        place = places[0]
        written = [_name_and_unit(names[place])[1], *below[place : place + 1]]
        unit = next((each for each in (*written, given) if each in known), None)
        if unit is None or given not in (None, unit):
            refuse(
                f"has the {kind} {names[place]!r} in {' '.join(written).strip() or 'no unit'}, and "
                f"{given or 'none'} is given as units; give one of {', '.join(known)}."
            )
        chosen.append((place, unit, known[unit]))
    (x, x_unit, to_m), (y, _, to_N) = chosen
    ends = [k for k, row in enumerate(rows) if len(row) > max(x, y) and re.search(r"\d", row[y])]
    kept = range(first, max(ends, default=0) + 1)  # text below has no number
    for k in kept:
        line, row = table.rows[k]
        for place in (x, y):
            cell = row[place] if place < len(row) else ""
            if not math.isfinite(_number(cell, table.delimiter, decimal)):
                mark = _MARK * ("," in cell)
                refuse(f"line {line}: {cell!r} under {names[place]!r} is no number.{mark}")
        if any(row[len(names) :]):
            refuse(f"line {line}: {table.delimiter.join(row)!r} has too many cells.{_MARK}")
    text = "".join(rows[k][place] for k in kept for place in (x, y))
    if not decimal and table.delimiter != "," and {",", "."} <= set(text):
        refuse(f"has numbers with commas and with points.{_MARK}")
    for said in _GAUGE.finditer("\n".join([*table.comments, *map(" ".join, rows[:at])])):
        if gauge_length is None and (unit := said[1] or said[3]):
            gauge_length = _number(said[2], ";", decimal) * _LENGTHS[unit.lower()]
    source = f"{names[x]!r} and {names[y]!r} of line {table.rows[at][0]}"
    if gauge_length is None:
        if x_unit not in _STRAINS:
            refuse("has no gauge length; give one, or add a line # gauge_length = 500 mm.")
        gauge_length = 1.0
        source += "; no gauge length: displacements are those of 1 m of wire"
    to_m *= gauge_length if x_unit in _STRAINS else 1.0
    u, F = (np.array([values[k][place] for k in kept]) for place in (x, y))
    return TensileTest(frozen(to_m * u), frozen(to_N * F), gauge_length, source)


def _fitting(row: list[str], columns: Sequence[str] | None) -> tuple[list[int], list[int]]:
    """Return the columns of a header that may be the displacement, and those of the force."""
    cells = [(cell.lower(), _name_and_unit(cell)[0].lower()) for cell in row]
    if columns is not None:
        a, b = ([k for k, c in enumerate(cells) if each.strip().lower() in c] for each in columns)
        return a, b
    a, b = (
        [k for k, (_, name) in enumerate(cells) if w.search(name) and not _OTHER.search(name)]
        for w in (_MOVED, _FORCE)
    )
    # "strain (extension)" is no other gauge than the extension
    return [k for k in a if not _COMPUTED.search(row[k])] or a, b


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
