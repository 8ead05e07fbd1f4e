"""Write and read the elasticity of a wire as TOML, exact to the last bit."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from cdsm.errors import FileError, GeometryError, InvalidInput, listed
from cdsm.support.files import read_text, write_text
from cdsm.support.records import Number, Rigidity, parse, read_toml, record, toml_lines
from cdsm.wires.elasticity import Elasticity, LinearElasticity
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
    factor: Number | None = None
    slack_below: bool | None = None


@record
class _Tabulated:
    kind: Literal["tabulated"] = "tabulated"
    tensions: _Row
    strains: _Row
    factor: Number | None = None
    slack_below: bool | None = None


_KINDS: dict[str, tuple[type[Elasticity], type[_Linear | _Strand | _Tabulated]]] = {
    "linear": (LinearElasticity, _Linear),
    "strand": (StrandElasticity, _Strand),
    "tabulated": (TabulatedElasticity, _Tabulated),
}


def table_of(law: Elasticity) -> list[str]:
    """Return the lines of a TOML table of a law; InvalidInput if it was made from a function."""
    if law._kind not in _KINDS:
        raise InvalidInput(
            "elasticity",
            f"{law!r} was made from a function; files hold a LinearElasticity, StrandElasticity or "
            "TabulatedElasticity. Tabulate its strain to save it.",
        )
    values = dict(law._given)
    if law._kind == "linear":
        values["rigidity"] = law._factor
    elif law._factor != 1.0:
        values["factor"] = law._factor
    if law._slack:
        values["slack_below"] = True
    return toml_lines(_KINDS[law._kind][1](**values))


def from_table(data: object) -> Elasticity:
    """Build a law from a parsed TOML table, or raise GeometryError or InvalidInput."""
    kind = data.get("kind") if isinstance(data, dict) else data
    if not isinstance(kind, str) or kind not in _KINDS:
        raise GeometryError([f"kind: must be one of {', '.join(_KINDS)}, but is {kind!r}"])
    make, entry = _KINDS[kind]
    values = dict(vars(parse(entry, data)))
    del values["kind"]
    factor, slack = values.pop("factor", None), values.pop("slack_below", None)
    law = make(**values)
    if factor is not None:
        law = law.scaled(factor)
    return law.slack_below() if slack else law


def write_law(law: Elasticity, path: str | os.PathLike[str]) -> Path:
    """Write a law to a TOML file; see :meth:`Elasticity.write`."""
    units = "# Elasticity of a wire: tensions and rigidity in N, strains without unit\n"
    return write_text(path, units + "\n".join(table_of(law)) + "\n")


def read_law(path: str | os.PathLike[str]) -> Elasticity:
    """Read a law from a TOML file; see :meth:`Elasticity.read`."""
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
    raise FileError(path, f"is not an elasticity, {len(faults)} found:{listed(faults)}")
