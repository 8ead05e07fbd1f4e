"""What cells of measured loops and positions of the tip have in common."""

from __future__ import annotations

from typing import Final

from cdsm.errors import InvalidInput
from cdsm.loads import link_point
from cdsm.manipulator import Manipulator
from cdsm.support.tables import Columns, Row
from cdsm.support.validation import AXES

LENGTH: Final = {"mm": 1e-3, "um": 1e-6, "µm": 1e-6, "m": 1.0}
"""Units of readings in a header, in SI."""


def axis_in(table: Columns, row: Row) -> tuple[float, float, float]:
    """Return the axis in the column ``direction`` of a row as a vector."""
    direction = table.text(row, "direction")
    if direction not in AXES:
        fault = f"{direction!r} is no axis; give one of {', '.join(AXES)}"
        table.refuse(f"line {row[0]}, column direction: {fault}")
    return AXES[direction]


def link_in(table: Columns, row: Row, column: str, arm: Manipulator) -> str | None:
    """Return the link in a cell; None for the tip, if it is empty or there is no such column."""
    if column not in table or not (link := table.text(row, column)):
        return None
    try:
        link_point(arm, link)
    except InvalidInput as error:
        fault = str(error).removeprefix("link: ").rstrip(".")
        table.refuse(f"line {row[0]}, column {column}: {fault}")
    return link
