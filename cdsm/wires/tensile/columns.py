"""Find the columns of displacement and force in a testing machine's table, in nine languages."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Final, NamedTuple

from cdsm.errors import TensileTestError
from cdsm.support.tables import Table

UNITS: Final = {
    "displacement": {
        "m": 1.0,
        "cm": 1e-2,
        "mm": 1e-3,
        "um": 1e-6,
        "µm": 1e-6,  # the sign of micro, then the Greek letter
        "μm": 1e-6,
        "in": 0.0254,
    },
    "strain": {"%": 1e-2, "mm/mm": 1.0, "m/m": 1.0, "-": 1.0},
    "force": {"mN": 1e-3, "N": 1.0, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605, "kgf": 9.80665},
}
"""Units of each kind of column in SI. A strain is a displacement divided by the gauge length."""

_WORDS: Final = {  # English, German, French, Spanish, Italian, Portuguese, Dutch, Chinese, Japanese
    "displacement": {
        *("displacement", "extension", "elongation", "stroke", "crosshead"),
        *("verlängerung", "längenänderung", "déplacement", "allongement"),
        *("desplazamiento", "alargamiento", "spostamento", "allungamento"),
        *(
            "deslocamento",
            "alongamento",
            "verplaatsing",
            "verlenging",
            "位移",
            "変位",
            "ストローク",
        ),
    },
    "strain": {"strain", "dehnung", "déformation", "deformazione", "rek", "应变", "ひずみ"},
    "force": {
        *("force", "load", "tension", "charge", "fuerza", "carga", "forza", "carico", "força"),
        *("kracht", "力", "载荷", "試験力", "荷重"),
    },
}
_ENDINGS: Final = {"weg": "displacement", "kraft": "force"}  # Standardweg, Prüfkraft, …
_KNOWN: Final = frozenset(unit for units in UNITS.values() for unit in units)
_BOTH: Final = ("displacement", "force")
USUAL: Final = {"displacement": "mm", "strain": "%", "force": "N"}
_FIRST_LINES = 50  # lines among which the header stands


class Column(NamedTuple):
    """Column of a table: index, name and unit from the header, and the kind of its quantity."""

    at: int
    name: str
    unit: str | None
    kind: str | None  # a key of UNITS

    def __str__(self) -> str:
        return f"{self.name!r} [{self.unit}]" if self.unit else f"{self.name!r}"


class Header(NamedTuple):
    """Header of a table: its line number, its columns, and the first row of data below it."""

    line: int  # number in the file
    columns: list[Column]
    first: int  # index of the first row of data

    def __str__(self) -> str:
        return f"the header {[column.name for column in self.columns]} of line {self.line}"


def find_header(table: Table, wanted: Sequence[str | int] | None) -> tuple[Header, Column, Column]:
    """Find the header of a table, and its columns of displacement (or strain) and force.

    ``wanted`` are the names or numbers of these two columns; None: known words in the header name
    them. If several of the first 50 lines name both, the one above the most rows of numbers is the
    header, since some machines write a table of results above the points. Raises TensileTestError
    if no header names both, or the header names one of them twice.
    """
    if not table.rows:
        raise TensileTestError("holds no data; a header and one line per point are needed.")
    top = [k for k, (line, _) in enumerate(table.rows) if line < table.rows[0][0] + _FIRST_LINES]
    headers = [_header(table, k) for k in top if not _is_data(table, k)]
    if wanted is not None and all(str(each).isdigit() for each in wanted):
        headers.append(_numbered(table))
    if not headers:
        raise TensileTestError(
            f"line {table.rows[0][0]}: there is no header. Begin with a line that names the "
            "columns and their units, such as: displacement [mm], force [N]"
        )

    def rank(header: Header) -> tuple[bool, int]:
        return all(_candidates(header, wanted)), _rows_of_data(table, header.first)

    header = max(headers, key=rank)
    found = _candidates(header, wanted)
    for kind, columns, asked in zip(_BOTH, found, wanted or (None, None), strict=True):
        if not columns and asked is not None:
            raise TensileTestError(f"there is no column {asked!r} in {header}; give one of these.")
        if len(columns) != 1:
            named = f": {' and '.join(map(str, columns))}" if columns else ""
            raise TensileTestError(
                f"{len(columns) or 'no'} columns of {kind} in {header}{named}. Give it such a name "
                f"as {kind} [{USUAL[kind]}], or say which columns to read: "
                "columns=('Extension', 'Load'), or by their numbers columns=(2, 3)."
            )
    return header, found[0][0], found[1][0]


def _is_data(table: Table, k: int) -> bool:
    """Return whether row k of a table has two numbers or more."""
    return sum(math.isfinite(table.number(cell)) for cell in table.rows[k][1]) > 1


def _rows_of_data(table: Table, first: int) -> int:
    """Count the consecutive rows of numbers that begin at row ``first`` of a table."""
    rows = range(first, len(table.rows))
    return next((k for k in rows if not _is_data(table, k)), len(table.rows)) - first


def _header(table: Table, k: int) -> Header:
    """Read row k of a table as a header; the row below may have the units of the columns."""
    below = table.rows[k + 1][1] if k + 1 < len(table.rows) else []
    units = [cell.strip("[]() ") for cell in below]
    has_units = not _KNOWN.isdisjoint(units)
    padded = units + [""] * len(table.rows[k][1])
    columns = [
        _column(at, cell, padded[at] if has_units else "")
        for at, cell in enumerate(table.rows[k][1])
    ]
    return Header(table.rows[k][0], columns, k + 1 + has_units)


def _numbered(table: Table) -> Header:
    """Return a header with the names "column 1", "column 2", … for columns chosen by number."""
    first = next((k for k in range(len(table.rows)) if _is_data(table, k)), 0)
    line, cells = table.rows[first]
    columns = [Column(at, f"column {at + 1}", None, None) for at in range(len(cells))]
    return Header(line, columns, first)


def _column(at: int, cell: str, below: str) -> Column:
    """Read cell number ``at`` of a header: name, unit and kind of its column.

    The unit is in brackets, or is the last word of the cell, or is in the cell below: ``below``.
    """
    groups = [each.strip() for each in re.findall(r"[\[(]([^\])]*)[\])]", cell)]
    name = re.sub(r"\s*[\[(][^\])]*[\])]", "", cell).strip()
    known = [each for each in groups if each in _KNOWN]
    tail = re.search(r"[\s_]+(\S+)$", name) or re.search(r"/(\S+)$", name)
    if not groups and tail and tail[1] in _KNOWN:
        known, name = [tail[1]], name[: tail.start()]
    name = name or cell
    unit = (known or [below] * bool(below) or groups or [None])[-1]
    words = re.split(r"[\s_/.,:;-]+", name.lower())
    kinds = {kind for kind, those in _WORDS.items() if not those.isdisjoint(words)}
    kinds |= {kind for end, kind in _ENDINGS.items() if any(word.endswith(end) for word in words)}
    if kinds and "force" not in kinds:  # the unit tells an extension from a strain
        kinds = {each for each in ("displacement", "strain") if unit in UNITS[each]} or kinds
    return Column(at, name, unit, kinds.pop() if len(kinds) == 1 else None)


def _candidates(header: Header, wanted: Sequence[str | int] | None) -> list[list[Column]]:
    """Return the columns that may be the displacement, and those that may be the force.

    They are those that ``wanted`` names, or if None, those named by known words.
    """
    if wanted is not None:
        return [_wanted(header, name, kind) for name, kind in zip(wanted, _BOTH, strict=True)]

    def of(kind: str) -> list[Column]:
        found = [column for column in header.columns if column.kind == kind]
        return [column for column in found if column.unit in (None, *UNITS[kind])] or found

    return [of("displacement") or of("strain"), of("force")]


def _wanted(header: Header, name: str | int, kind: str) -> list[Column]:
    """Return the columns with the given name, or number from 1 on, and set their ``kind``.

    A column of displacement becomes one of strain if its unit is one of strains.
    """
    if str(name).isdigit():
        found = [column for column in header.columns if column.at == int(name) - 1]
    else:
        plain = _column(0, str(name).strip(), "").name.lower()
        found = [column for column in header.columns if column.name.lower() == plain]
    if kind == "displacement":
        strains = UNITS["strain"]
        return [each._replace(kind="strain" if each.unit in strains else kind) for each in found]
    return [each._replace(kind=kind) for each in found]
