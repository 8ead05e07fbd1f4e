"""Read a tensile test, forces against displacements, from CSV with its units."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NoReturn, final

from cdsm.errors import InvalidInput, TensileTestError
from cdsm.support.tables import Table, read_table, readings
from cdsm.support.validation import number_array, scalar, whole_number
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.wires.tensile.columns import UNITS, USUAL, Column, Header, find_header

_GAUGE = re.compile(
    r"gauge[ _-]?length\s*+[=:]?\s*+([-+\d.,eE]+)\s*[\[(]?([^\W\d]*)", re.IGNORECASE
)
_TITLE = re.compile(  # Einspannlänge: from grip to grip; Messlänge: of an extensometer
    r"(?:gau?ge[ _-]?length|einspannlänge|messlänge)(?: L_?0)?(\D{0,60}?)([\d.,]+)"
    r"[ \t]*[\[(]?([^\W\d]*)",
    re.IGNORECASE,
)


@final
@dataclass(frozen=True, eq=False)
class TensileTest(ReadOnlyState):
    """Record of a tensile test, in the order in which the machine recorded it.

    Attributes:
        displacement: Displacement of the crosshead or extensometer, shape (n,) [m].
        force: Force, shape (n,) [N], tension positive.
        gauge_length: Free length of the wire between the grips or the clips [m].
        source: Columns and units that were read from a file; empty for arrays.

    Raises:
        InvalidInput: A field is not finite numbers.
        TensileTestError: The arrays differ in length, or the gauge length is not positive.
    """

    displacement: Array
    force: Array
    gauge_length: float
    source: str = ""

    def __repr__(self) -> str:
        return f"<TensileTest of {self.force.size} points>"

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
    columns: Sequence[str | int] | None = None,
    skip: int = 0,
    units: Sequence[str] | None = None,
    displacement_unit: str | None = None,
    force_unit: str | None = None,
    gauge_length: float | None = None,
) -> TensileTest:
    """Read a tensile test from the text file of a testing machine, or from any CSV.

    The header is one of the first 50 lines and names both columns; of several such lines, it is the
    one before the most rows of numbers. Titles and tables of results may stand before it. The names
    are a displacement, extension, elongation or stroke, and a force or load, in English or another
    language (Standardweg, Standardkraft, Déplacement, Fuerza, 位移, …). Each name has a unit:
    ``displacement [mm]``, ``Load (kN)``, ``force_N``, ``Kraft/N``. The units may also form the next
    line. A strain in % or mm/mm is read where there is no displacement. Other columns are ignored.

    Commas, semicolons or tabs separate the columns. Decimal commas are allowed with semicolons and
    tabs. If both points and commas occur, one must separate thousands, and the numbers must show
    which. The text is UTF-8, UTF-16 or Windows-1252. The gauge length may be given by a comment,
    ``# gauge_length = 500 mm``, or by a title line with ``Gauge length``, ``Einspannlänge`` or
    ``Messlänge``.

    Args:
        path: The file.
        columns: Displacement or strain, and force: the names of their columns, or their numbers
            from 1 on. Default: by the names in the header.
        skip: Number of lines at the top that are not read.
        units: Units of displacement and force, if the header has none.
        displacement_unit: ``m``, ``cm``, ``mm``, ``um`` or ``in``; of a strain ``%`` or ``mm/mm``.
            The same as the first of ``units``; give one or the other.
        force_unit: ``mN``, ``N``, ``kN``, ``MN``, ``lbf`` or ``kgf``. The same
            as the second of ``units``.
        gauge_length: l_0 [m], if the file does not give it. A strain needs none, since EA does not
            depend on it: the result is then a test of 1 m of wire, and ``source`` says so.

    Raises:
        FileError: The file cannot be read.
        InvalidInput: ``columns`` or ``units`` are not two entries, or ``skip`` is negative.
        TensileTestError: There is no header; a column, a unit or the gauge length is missing, given
            twice or not understood; or an entry is not a finite number (the line is named).
    """
    for name, pair in (("columns", columns), ("units", units)):
        if pair is not None and (not isinstance(pair, (list, tuple)) or len(pair) != 2):
            raise InvalidInput(name, f"{pair!r} given; give two, of displacement and force.")
    skip = whole_number("skip", skip, 0, 1_000_000)
    given = units or (displacement_unit, force_unit)
    table = read_table(path, "\t;,", skip=skip, any_encoding=True)
    try:
        header, *read = find_header(table, columns)
        scales = [_scale(each, unit) for each, unit in zip(read, given, strict=True)]
        table = table.with_decimal_mark(_refuse, header.first)
        displacement, force = (table.column(each.at, _bad_cell, header.first) for each in read)
        length = _gauge_length(table, header, gauge_length)
        if length is None and read[0].kind != "strain":
            raise TensileTestError(
                "has no gauge length. Pass gauge_length= [m], or add a line: "
                "# gauge_length = 500 mm"
            )
    except TensileTestError as error:
        raise TensileTestError(f"{path}: {error}") from None
    assumed = "; no gauge length: displacements are those of 1 m of wire" if length is None else ""
    length = 1.0 if length is None else length
    if read[0].kind == "strain":
        scales[0] *= length
    places = [each.at for each in read]
    others = [each for each in header.columns if each.kind and each.at not in places]
    unread = f"; not read: {', '.join(map(str, others))}" if others else ""
    source = f"{' and '.join(map(str, read))} of line {header.line}{unread}{assumed}"
    return TensileTest(scales[0] * displacement, scales[1] * force, length, source)


def _scale(column: Column, given: str | None) -> float:
    """Return the factor that converts a column to SI, from its own unit or the unit ``given``.

    Raises TensileTestError if there is no unit, it is not known, or the two differ.
    """
    kind = column.kind or ""
    known, keyword = UNITS[kind], "force_unit" if kind == "force" else "displacement_unit"
    for each in (column.unit, given):
        if each and each not in known:
            raise TensileTestError(
                f"the unit {each!r} of the {kind} {column.name!r} is not known; use "
                f"{', '.join(known)}, in the header or as {keyword}=."
            )
    if column.unit and given and column.unit != given:
        raise TensileTestError(
            f"the header has the {kind} in {column.unit}, but {keyword}={given!r}; drop one."
        )
    unit = column.unit or given
    if not unit:
        raise TensileTestError(
            f"the {kind} {column.name!r} has no unit. Put it into the header, such as "
            f"{column.name} [{USUAL[kind]}], or pass {keyword}= or units=('mm', 'N')."
        )
    return known[unit]


def _refuse(problem: str) -> NoReturn:
    raise TensileTestError(f"{problem}.")


def _bad_cell(problem: str) -> NoReturn:
    raise TensileTestError(
        f"{problem}; write one point per line, with a decimal point (a comma only where "
        "semicolons or tabs separate)."
    )


def _gauge_length(table: Table, header: Header, given: float | None) -> float | None:
    """Return the gauge length [m], given or read from the file; None if there is none."""
    known = UNITS["displacement"]
    lengths = [] if given is None else [scalar("gauge_length", given)]
    for number, unit in _GAUGE.findall("\n".join(table.comments)):
        value = _length(table, number)
        if math.isnan(value) or unit not in known:
            raise TensileTestError(
                f"the gauge length {number!r} {unit!r} is not understood; write it with its unit: "
                "# gauge_length = 500 mm"
            )
        lengths.append(value * known[unit])
    if not lengths:
        titles = (" ".join(cells) for line, cells in table.rows if line < header.line)
        for between, number, unit in _TITLE.findall("\n".join(titles)):
            before = re.findall(r"[\[(]\s*([^\W\d]+)\s*[\])]", between)
            unit = unit if unit in known else next(iter(before), "")
            if unit in known and math.isfinite(value := _length(table, number)):
                lengths.append(value * known[unit])
    if not lengths:
        return None
    if max(lengths) - min(lengths) > 1e-9 * abs(max(lengths)):
        listed = " and ".join(f"{1e3 * length:g} mm" for length in dict.fromkeys(lengths))
        raise TensileTestError(f"the gauge length is {listed}; give one, as gauge_length= [m].")
    return lengths[0]


def _length(table: Table, text: str) -> float:
    """Read the number of a gauge length; NaN if it is not clear which mark is the decimal one."""
    found = set(readings(text, table.marks) or readings(text, ",."))
    return found.pop() if len(found) == 1 else math.nan
