"""Find the law of a wire by its name, its rigidity EA, or its file."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING, Final

from cdsm.errors import InvalidInput, UnknownName
from cdsm.wires.elasticity import Elasticity, LinearElasticity
from cdsm.wires.laws import StrandElasticity

if TYPE_CHECKING:
    from cdsm.cable import Cable

STRAND: Final = StrandElasticity.eq19_repaired()
"""The paper's 1×19 steel strand of 1.2 mm (Section IV-C): Eq. 19, repaired and continuous."""

SOLID: Final = LinearElasticity.of_wire(200e9, 1.2e-3)
"""Solid wire of the strand's diameter with the paper's 200 GPa (Section IV-B)."""

WIRES: Final[dict[str, Elasticity]] = {"1x19-1.2mm": STRAND, "solid-1.2mm": SOLID}
"""Laws by the name of their wire."""

_FILES = (".toml", ".csv", ".txt", ".tsv")  # a table of points is refused: it must be fitted first
_NAMED = 3  # largest number of different wires that a text names

Wire = Elasticity | str | float | os.PathLike[str]
"""Ways to give a wire: its law, a name of :data:`WIRES`, EA [N], or the path of a WIRE.toml."""


def as_wire(wire: Wire) -> Elasticity:
    """Return the law EA(F) of a wire that is given in one of several ways.

    Args:
        wire: A law, a name of :data:`WIRES`, a constant rigidity EA [N], or the path of a TOML file
            as :meth:`Elasticity.write` writes it.

    Raises:
        UnknownName: No wire has this name.
        InvalidInput: ``wire`` is of another type, or its rigidity is outside its range in
            :data:`RANGES`.
        FileError: The file cannot be read or does not describe an elasticity.
    """
    if isinstance(wire, Elasticity):
        return wire
    if isinstance(wire, str) and wire in WIRES:
        return WIRES[wire]
    if isinstance(wire, os.PathLike) or (isinstance(wire, str) and wire.endswith(_FILES)):
        return Elasticity.read(wire)
    if isinstance(wire, str):
        raise UnknownName("wire", wire, WIRES, "Or give a rigidity EA in N, or a file WIRE.toml.")
    if isinstance(wire, bool) or not isinstance(wire, (int, float)):
        raise InvalidInput("wire", f"{wire!r} given; give a name, a rigidity EA in N, or a file.")
    return LinearElasticity(wire)


def name_of(law: Elasticity) -> str | None:
    """Return the name under which :data:`WIRES` has a law, or None if it does not have it."""
    return next((name for name, known in WIRES.items() if known == law), None)


def label(law: Elasticity) -> str:
    """Return a short text for a law: the name of its wire, its EA, or its kind and tensions."""
    known = name_of(law)
    if known is not None:
        return known
    if law._constant is not None:
        return f"EA {law._constant:.6g} N"
    text = f"{law._kind}, {law.rest:.4g} to {law.high:.4g} N"
    original = next((each for each, known in WIRES.items() if known._given == law._given), None)
    if original is not None and law._kind == "strand":
        text = original
    if law._factor != 1.0:
        text += f", EA times {law._factor:.6g}"
    if law._slack:
        EA = float(law.rigidity(0.0))
        text += f", with a slack branch of EA {EA:.4g} N below {law.rest:.4g} N"
    return text


def wires_text(cables: Iterable[Cable]) -> str:
    """Describe the wires of cables and the springs in series with them, as text.

    If there are two or three kinds, the text says how many cables have each; more kinds are only
    counted.
    """
    counts = Counter(
        label(cable.elasticity)
        + (
            f" on a spring of {cable.series_stiffness / 1000.0:.4g} N/mm"
            if cable.series_stiffness < math.inf
            else ""
        )
        for cable in cables
    )
    if len(counts) == 1:
        return next(iter(counts))
    if len(counts) > _NAMED:
        return f"of {len(counts)} kinds"
    return ", ".join(f"{name} ({count} of {counts.total()})" for name, count in counts.items())
