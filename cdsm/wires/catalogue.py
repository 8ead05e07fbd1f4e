"""Find the law of a wire by its name, its rigidity EA or its file; tables of laws in TOML."""

from __future__ import annotations

import inspect
import math
import os
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Final, Literal

from pydantic import Field

from cdsm.errors import GeometryError, InvalidInput
from cdsm.support.records import Number, Rigidity, parse, record, toml_value
from cdsm.support.validation import one_of
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import LinearElasticity, StrandElasticity, TabulatedElasticity

if TYPE_CHECKING:
    from cdsm.cable import Cable

STRAND: Final = StrandElasticity.eq19_repaired()
"""The paper's 1×19 steel strand of 1.2 mm (Section IV-C): Eq. 19, repaired and continuous."""

SOLID: Final = LinearElasticity.of_wire(200e9, 1.2e-3)
"""Solid wire of the strand's diameter with the paper's 200 GPa (Section IV-B)."""

WIRES: Final[dict[str, Elasticity]] = {"1x19-1.2mm": STRAND, "solid-1.2mm": SOLID}
"""Laws by the name of their wire."""

_KINDS: Final[dict[str, type[Elasticity]]] = {
    "linear": LinearElasticity,
    "strand": StrandElasticity,
    "tabulated": TabulatedElasticity,
}
_FILES = (".toml", ".csv", ".txt", ".tsv")  # a table of points is refused: it must be fitted first

Wire = Elasticity | str | float | os.PathLike[str]
"""Ways to give a wire: its law, a name of :data:`WIRES`, EA [N], or the path of a WIRE.toml."""

_Row = Annotated[tuple[Number, ...], Field(strict=False)]


@record
class _Table:
    kind: Literal["linear", "strand", "tabulated"]
    rigidity: Rigidity | None = None
    low: Number | None = None
    high: Number | None = None
    joins: _Row | None = None
    coefficients: Annotated[tuple[_Row, ...], Field(strict=False)] | None = None
    tensions: _Row | None = None
    strains: _Row | None = None
    factor: Number | None = None
    slack_below: bool | None = None


def as_wire(wire: Wire) -> Elasticity:
    """Return the law of a wire: itself, by a name of :data:`WIRES`, EA [N], or a WIRE.toml.

    Raises UnknownName, InvalidInput (another type, or EA outside its range) or FileError.
    """
    if isinstance(wire, Elasticity):
        return wire
    if isinstance(wire, os.PathLike) or (isinstance(wire, str) and wire.endswith(_FILES)):
        return Elasticity.read(wire)
    if isinstance(wire, str):
        return WIRES[one_of("wire", wire, WIRES, "Or give EA in N, or a file WIRE.toml.")]
    if isinstance(wire, bool) or not isinstance(wire, (int, float)):
        raise InvalidInput("wire", f"{wire!r} given; give a name, a rigidity EA in N, or a file.")
    return LinearElasticity(wire)


def table_of(law: Elasticity) -> list[str]:
    """Return the lines of a TOML table of a law; InvalidInput if it was made from a function."""
    if law._kind not in _KINDS:
        problem = f"{law!r} was made from a function. Tabulate its strain to save it."
        raise InvalidInput("elasticity", problem)
    factor = {"factor": law._factor} if law._factor != 1.0 else {}
    values = {"rigidity": law._constant} if law._kind == "linear" else law._given | factor
    values = {"kind": law._kind, **values}
    lines = [f"{key} = {toml_value(value)}" for key, value in values.items()]
    return [*lines, "slack_below = true"] if law._slack else lines


def from_table(data: object) -> Elasticity:
    """Build a law from a parsed TOML table, or raise GeometryError or InvalidInput."""
    kind = data.get("kind") if isinstance(data, dict) else data
    if not isinstance(data, dict) or kind not in [*_KINDS]:
        raise GeometryError([f"kind: must be one of {', '.join(_KINDS)}, but is {kind!r}"])
    needed = [*inspect.signature(_KINDS[kind]).parameters]
    faults = [f"{key}: is missing" for key in needed if key not in data]
    try:
        given = {key: each for key, each in vars(parse(_Table, data)).items() if each is not None}
    except GeometryError as error:
        raise GeometryError([*error.faults, *faults]) from None
    del given["kind"]
    factor, slack = given.pop("factor", 1.0), given.pop("slack_below", False)
    faults += [f"{key}: is not a key of a {kind} law" for key in given if key not in needed]
    if faults:
        raise GeometryError(faults)
    law = _KINDS[kind](**given)
    law = law if factor == 1.0 else law.scaled(factor)
    return law.slack_below() if slack else law


def name_of(law: Elasticity) -> str | None:
    """Return the name under which :data:`WIRES` has a law, or None if it does not have it."""
    return next((name for name, known in WIRES.items() if known == law), None)


def label(law: Elasticity) -> str:
    """Return a short text for a law: the name of its wire, its EA, or its kind and tensions."""
    if law._constant is not None:
        return name_of(law) or f"EA {law._constant:.6g} N"
    kind = {"tabulated": "table", "": "function"}.get(law._kind, law._kind)
    text = f"{kind}, {law.rest:.4g} to {law.high:.4g} N"
    text = "1x19-1.2mm" if law._given == STRAND._given else text
    text += f", EA times {law._factor:.6g}" if law._factor != 1.0 else ""
    branch = f", with a slack branch of EA {law.rigidity(law.low):.4g} N below {law.rest:.4g} N"
    return text + branch if law._slack else text


def wires_text(cables: Sequence[Cable]) -> str:
    """Describe the wires of cables and their series springs; more than three kinds are counted."""
    counts = Counter[str]()
    for cable in cables:
        k = cable.series_stiffness
        spring = f" on a spring of {k / 1e3:.4g} N/mm" if k < math.inf else ""
        counts[label(cable.elasticity) + spring] += 1
    if len(counts) > 3:
        return f"of {len(counts)} kinds"
    texts = [f"{name} ({count} of {len(cables)})" for name, count in counts.items()]
    return ", ".join(texts if len(counts) > 1 else counts)
