"""Write and read the elasticity of a wire as TOML, exact to the last bit."""

from __future__ import annotations

import os
import re
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from cdsm.elasticity import Elasticity, LinearElasticity, SlackBelow
from cdsm.errors import LINES, FileError, GeometryError, InvalidInput, listed
from cdsm.support.files import read_text, write_text
from cdsm.support.records import Number, Rigidity, parse, read_toml, record, toml_lines
from cdsm.wires.laws import StrandElasticity, TabulatedElasticity

_MEASURED = re.compile(r'^"?[-+]?\d[\d.,eE+-]*"?\s*[;,\t]\s*"?[-+]?\d', re.MULTILINE)
"""Pattern of a line that begins with two numbers; such a file is a CSV, not a TOML."""

_Row = Annotated[tuple[Number, ...], Field(strict=False)]


@record
class _Linear:
    kind: Literal["linear"] = "linear"
    rigidity: Rigidity


@record
class _Strand:
    kind: Literal["strand"] = "strand"
    low: Number
    high: Number
    joins: _Row
    coefficients: Annotated[tuple[_Row, ...], Field(strict=False)]
    slack_below: bool | None = None


@record
class _Tabulated:
    kind: Literal["tabulated"] = "tabulated"
    tensions: _Row
    strains: _Row
    slack_below: bool | None = None


_KINDS: dict[str, tuple[type[Elasticity], type[_Linear | _Strand | _Tabulated]]] = {
    "linear": (LinearElasticity, _Linear),
    "strand": (StrandElasticity, _Strand),
    "tabulated": (TabulatedElasticity, _Tabulated),
}


def table_of(elasticity: Elasticity) -> list[str]:
    """Return the lines of a TOML table that describes an elasticity.

    Raises InvalidInput if it is not a linear, strand or tabulated one.
    """
    if isinstance(elasticity, SlackBelow):
        return [*table_of(elasticity.law), "slack_below = true"]
    for law, entry in _KINDS.values():
        if isinstance(elasticity, law):
            names = (field.name for field in fields(elasticity))  # type: ignore[arg-type]
            values = {name.removeprefix("_"): getattr(elasticity, name) for name in names}
            return toml_lines(entry(**values))
    raise InvalidInput(
        "elasticity",
        f"a {type(elasticity).__name__} given; files hold a LinearElasticity, "
        "StrandElasticity or TabulatedElasticity. Tabulate its strain to save it.",
    )


def from_table(data: object) -> Elasticity:
    """Build an elasticity from a parsed TOML table, or raise GeometryError or InvalidInput."""
    kind = data.get("kind") if isinstance(data, dict) else data
    if not isinstance(kind, str) or kind not in _KINDS:
        raise GeometryError([f"kind: must be one of {', '.join(_KINDS)}, but is {kind!r}"])
    law, entry = _KINDS[kind]
    values = dict(vars(parse(entry, data)))
    slack = values.pop("slack_below", None)
    made = law(**{name: value for name, value in values.items() if name != "kind"})
    return made.slack_below() if slack else made


def write_elasticity(elasticity: Elasticity, path: str | os.PathLike[str]) -> Path:
    """Write an elasticity to a TOML file. :func:`read_elasticity` returns an equal elasticity.

    Args:
        elasticity: Elasticity of kind linear, strand or tabulated.
        path: The file. An existing file is replaced.

    Raises:
        InvalidInput: The elasticity is of another kind, which cannot be written.
        FileError: The file cannot be written.
    """
    units = "# Elasticity of a wire: tensions and rigidity in N, strains without unit\n"
    return write_text(path, units + "\n".join(table_of(elasticity)) + "\n")


def read_elasticity(path: str | os.PathLike[str]) -> Elasticity:
    """Read an elasticity from a TOML file of :func:`write_elasticity` or written by hand.

    Args:
        path: The TOML file. Its ``kind`` is ``linear`` (with ``rigidity`` [N]), ``strand`` (with
            ``coefficients`` [N, 1, 1/N, …], ``joins``, ``low``, ``high`` [N]) or ``tabulated``
            (with ``tensions`` [N], ``strains`` [-]). With ``slack_below = true`` a strand or a
            table is continued to zero tension, see :meth:`Elasticity.slack_below`.

    Raises:
        FileError: The file cannot be read or does not describe an elasticity (all faults listed).
    """
    text = read_text(path, any_encoding=True)  # to know a table of a testing machine
    if _MEASURED.search(text):
        raise FileError(
            path,
            "looks like a table of measured points, not like the law of a wire. Fit it first: "
            "`cdsm fit`, or cdsm.read_tensile_csv and cdsm.fit_tensile_test.",
        )
    try:
        return from_table(read_toml(text))
    except GeometryError as error:
        faults = error.faults
    except InvalidInput as error:
        faults = (str(error),)
    raise FileError(path, f"is not an elasticity:{listed(faults, 20, LINES)}")
