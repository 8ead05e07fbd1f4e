"""Read printed tables and sentences back: names, numbers and units, in SI."""

import math
import re
from itertools import pairwise
from typing import Any, Final, NamedTuple

import pytest

UNITS: Final = {
    "": 1.0, "N": 1.0, "kg": 1.0, "N m": 1.0, "N m/rad": 1.0, "N/m": 1.0, "N/mm": 1e3, "m": 1.0,
    "mm": 1e-3, "µm": 1e-6, "°": math.pi / 180.0, "mJ": 1e-3, "%": 0.01, "Hz": 1.0, "σ": 1.0,
    "N s/m": 1.0, "ms": 1e-3, "own unit": 1.0,
}  # fmt: skip
"""Size of each printed unit in SI."""

_NUMBER = r"([-+]?\d[\d.]*(?:e[-+]?\d+)?|[-+]?inf|nan|-)"
_UNIT = r"(N m/rad|N/mm|N/m|N m|N s/m|N|kg|mm|µm|mJ|ms|m|°|%|Hz|σ)"
_FOREIGN = r"\.?\d| ?[kMGmcµ]?(?:N|m|g|Pa|J|rad)\b"  # goes on, or has a unit that is not known
_GAP = "  "


class Printed(NamedTuple):
    """A number as it is printed, and its unit."""

    text: str
    unit: str

    @property
    def size(self) -> float:
        return UNITS[self.unit]


def require_same(printed: Printed, value: float | None, digits: int | None = 4) -> None:
    """Require that a printed number is ``value`` [SI] to its digits; ``-`` and inf are None.

    ``digits`` are those of a format that leaves out zeros at the end; None: all are printed.
    """
    if value is None or math.isinf(value):
        assert printed.text in ("-", "inf"), (printed, value)
        return
    shown = float(printed.text)
    wanted = value / printed.size
    if abs(wanted) < 1e-9 * max(abs(shown), 1e-3):
        assert abs(shown) < 1e-9, (printed, value)
        return
    mantissa, _, exponent = printed.text.partition("e")
    places = len(mantissa.partition(".")[2])
    last = 10.0 ** (int(exponent or 0) - places)
    if digits is not None:
        last = min(last, 10.0 ** (math.floor(math.log10(abs(wanted))) - digits + 1))
    assert shown == pytest.approx(wanted, rel=0.0, abs=0.5001 * last), (printed, value)


def require_all(pairs: Any, digits: int | None = 4) -> None:
    """Require each (printed, value [SI]) of ``pairs`` to be the same; at least one is given."""
    count = 0
    for printed, value in pairs:
        require_same(printed, value, digits)
        count += 1
    assert count


def numbers(text: str, sentence: str, unit: str = "") -> list[Printed]:
    """The numbers of the first ``sentence`` in a text, each at a ``{}``, with their units.

    ``unit`` is that of numbers which have none of their own.
    """
    pattern = re.escape(" ".join(sentence.split()))
    pattern = pattern.replace(r"\{\}", f"{_NUMBER}(?: ?{_UNIT}(?![A-Za-z/]))?")
    pattern += f"(?![0-9])(?!{_FOREIGN})" * sentence.endswith("{}")
    found = re.search(pattern, "\n".join(" ".join(line.split()) for line in text.splitlines()))
    assert found is not None, f"{sentence!r} is not in\n{text}"
    pairs = zip(found.groups()[::2], found.groups()[1::2], strict=True)
    return [Printed(number, own or unit) for number, own in pairs]


def table(text: str, head: str) -> dict[str, dict[str, Printed]]:
    """The cells of the first table whose head begins with ``head``, by row and column.

    A unit in brackets in the head of a column is that of its cells; one in the head of the first
    column is that of all. Cells with a unit of their own keep it, and the column ``unit`` gives
    that of its row. Rows end at the first line that does not end where its columns end; remarks
    two spaces behind the last column are left out.
    """
    lines = text.splitlines()
    first = next((k for k, line in enumerate(lines) if line.lstrip().startswith(head)), None)
    assert first is not None, f"{head!r} is no head of a table in\n{text}"
    titles = [(m.group(), m.end()) for m in re.finditer(r"\S+(?: \S+)*", lines[first])]
    names = [_split(title) for title, _ in titles]
    shared = names[0][1] if not any(unit for _, unit in names[1:]) else ""
    rows: dict[str, dict[str, Printed]] = {}
    for line in lines[first + 1 :]:
        cells = _cells(line, [end for _, end in titles])
        if cells is None:
            break
        row = dict(zip((name for name, _ in names), cells, strict=True))
        whole = row.get("unit", shared)
        key = cells[0]
        assert key not in rows, f"two rows are called {key!r}"
        rows[key] = {}
        for (name, unit), cell in zip(names, cells, strict=True):
            number = re.fullmatch(f"{_NUMBER} {_UNIT}", cell)
            rows[key][name] = Printed(*number.groups()) if number else Printed(cell, unit or whole)
    assert rows, text
    return rows


def _split(title: str) -> tuple[str, str]:
    name, _, unit = title.partition(" [")
    return name, unit.rstrip("]")


def _cells(line: str, ends: list[int]) -> list[str] | None:
    """The cells of a line of a table whose columns end there; None if it is no such line."""
    if len(line) < ends[-1] or line[ends[-1] : ends[-1] + 2].strip():
        return None
    if any(line[end].strip() for end in ends[1:-1]):
        return None
    name, _, second = line[: ends[1]].strip().rpartition(_GAP)
    if not name:
        name, second = line[: ends[1]].strip(), ""
    cells = [name.strip(), second.strip()]
    cells += [line[low:high].strip() for low, high in pairwise(ends[1:])]
    return cells
