"""Force-displacement record of a tensile test, read from CSV with its units."""

from __future__ import annotations

import math
import os
import re
from dataclasses import dataclass
from typing import Final, NoReturn, final

from cdsm.errors import TensileTestError
from cdsm.support.tables import Table, read_table
from cdsm.support.validation import number_array, scalar
from cdsm.support.values import Array, ReadOnlyState, frozen

_UNITS: Final = {
    "displacement": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6},
    "force": {"mN": 1e-3, "N": 1.0, "kN": 1e3, "MN": 1e6},
}
_USUAL: Final = {"displacement": "mm", "force": "N"}
_WORDS: Final = {
    "displacement": ("displacement", "extension", "elongation", "stroke"),
    "force": ("force", "load", "tension"),
}
_GAUGE = re.compile(
    r"gauge[ _-]?length\s*+[=:]?\s*+([-+\d.,eE]+)\s*[\[(]?([^\W\d]*)", re.IGNORECASE
)


@final
@dataclass(frozen=True, eq=False)
class TensileTest(ReadOnlyState):
    """Record of a tensile test, in the order in which the machine recorded it.

    Attributes:
        displacement: Displacement of the crosshead or extensometer, shape (n,) [m].
        force: Force, shape (n,) [N], tension positive.
        gauge_length: Free length of the wire between the grips or the clips [m].

    Raises:
        InvalidInput: A field is not finite numbers.
        TensileTestError: The arrays differ in length, or the gauge length is not positive.
    """

    displacement: Array
    force: Array
    gauge_length: float

    def __post_init__(self) -> None:
        for name in ("displacement", "force"):
            array = number_array(name, getattr(self, name))
            if array.ndim != 1:
                raise TensileTestError(f"{name} has shape {array.shape}; a list (n,) is needed.")
            object.__setattr__(self, name, frozen(array))
        if self.displacement.shape != self.force.shape:
            raise TensileTestError(
                f"{self.displacement.size} displacements but {self.force.size} forces; "
                "each point needs both."
            )
        length = scalar("gauge_length", self.gauge_length)
        if length <= 0.0:
            raise TensileTestError(
                f"the gauge length is {length:g} m; it must be positive: the free length of the "
                "wire between the grips [m]."
            )
        object.__setattr__(self, "gauge_length", length)


def read_tensile_csv(
    path: str | os.PathLike[str],
    *,
    displacement_unit: str | None = None,
    force_unit: str | None = None,
    gauge_length: float | None = None,
) -> TensileTest:
    """Read a tensile test from CSV. If the header lacks a unit, give the unit as an argument.

    The first line that is not a comment is the header. It names one column displacement, extension,
    elongation or stroke, and one column force, load or tension. Each name has a unit:
    ``displacement [mm]``, ``Load (kN)``, ``force_N``. The units may also form the next line. Other
    columns are ignored. Commas, semicolons or tabs separate the columns. Decimal commas are allowed
    with semicolons and tabs. A comment may give the gauge length: ``# gauge_length = 500 mm``.

    Args:
        path: The file.
        displacement_unit: ``m``, ``cm``, ``mm`` or ``um``, if the header has no unit.
        force_unit: ``mN``, ``N``, ``kN`` or ``MN``, if the header has no unit.
        gauge_length: l_0 [m], if no comment gives it.

    Raises:
        FileError: The file cannot be read.
        TensileTestError: There is no header; a column, a unit or the gauge length is missing, given
            twice or not understood; or an entry is not a finite number (the line is named).
    """
    table = read_table(path, "\t;,")
    try:
        header, first = _header(table)
        displacement = _column(table, header, first, "displacement", displacement_unit)
        force = _column(table, header, first, "force", force_unit)
        length = _gauge_length(table, gauge_length)
    except TensileTestError as error:
        raise TensileTestError(f"{path}: {error}") from None
    return TensileTest(displacement, force, length)


def _header(table: Table) -> tuple[list[str], int]:
    """Return column names with units, and the first row of numbers. Row 1 may hold units."""
    if not table.rows:
        raise TensileTestError("holds no data; a header and one line per point are needed.")
    header = table.header
    if not any(math.isnan(table.number(cell)) for cell in header):
        raise TensileTestError(
            f"line {table.rows[0][0]}: there is no header. Begin with a line that names the "
            "columns and their units, such as: displacement [mm], force [N]"
        )
    units = table.rows[1][1] if len(table.rows) > 1 else ["1"]
    if not all(re.fullmatch(r"[\[(]?\s*[^\W\d]*\s*[\])]?", cell) for cell in units):
        return header, 1
    units = [unit.strip("[]() ") for unit in (*units, *[""] * len(header))]
    return [f"{a} [{b}]" if b else a for a, b in zip(header, units, strict=False)], 2


def _column(table: Table, header: list[str], first: int, kind: str, given: str | None) -> Array:
    """Return the displacement or the force from row ``first`` on, in SI units."""
    names = [re.split(r"[\s\[(_/,]", cell.lower(), maxsplit=1)[0] for cell in header]
    at = [k for k, name in enumerate(names) if name in _WORDS[kind]]
    if len(at) != 1:
        raise TensileTestError(
            f"{len(at) or 'no'} columns of {kind} in the header {header}; exactly one must be "
            f"called {' or '.join(_WORDS[kind])}, with its unit, such as: {kind} [{_USUAL[kind]}]"
        )
    # the unit stands in brackets, or after the last underscore, blank or slash
    cell, known, keyword = header[at[0]], _UNITS[kind], f"{kind}_unit"
    unit = re.search(r"[\[(]([^\])]*)[\])]", cell) or re.search(r"[_/\s]([^\s_/]+)$", cell)
    found = unit[1].strip() if unit else None
    for each in (found, given):
        if each is not None and each not in known:
            raise TensileTestError(
                f"the unit {each!r} of the {kind} is not known; use {', '.join(known)}, in the "
                f"header or as {keyword}=."
            )
    if found is not None and given is not None and found != given:
        raise TensileTestError(
            f"the header has the {kind} in {found}, but {keyword}={given!r}; drop one."
        )
    chosen = found or given
    if chosen is None:
        raise TensileTestError(
            f"the {kind} has no unit. Put it into the header, such as {kind} [{_USUAL[kind]}], or "
            f"pass {keyword}=."
        )
    return known[chosen] * table.column(at[0], _bad_cell, first)


def _bad_cell(problem: str) -> NoReturn:
    raise TensileTestError(
        f"{problem}; write one point per line, with a decimal point (a comma only where "
        "semicolons or tabs separate)."
    )


def _gauge_length(table: Table, given: float | None) -> float:
    lengths = [] if given is None else [scalar("gauge_length", given)]
    decimal_comma = table._replace(delimiter=";")
    for number, unit in _GAUGE.findall("\n".join(table.comments)):
        value = decimal_comma.number(number)
        if math.isnan(value) or unit not in _UNITS["displacement"]:
            raise TensileTestError(
                f"the gauge length {number!r} {unit!r} is not understood; write it with its unit: "
                "# gauge_length = 500 mm"
            )
        lengths.append(value * _UNITS["displacement"][unit])
    if not lengths:
        raise TensileTestError(
            "has no gauge length. Pass gauge_length= [m], or add a line: # gauge_length = 500 mm"
        )
    if max(lengths) - min(lengths) > 1e-9 * abs(max(lengths)):
        raise TensileTestError(f"gauge lengths of {lengths} m are given; give one.")
    return lengths[0]
