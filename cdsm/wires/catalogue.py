"""Find the law of a wire by its name, its rigidity EA or its file; tables of laws in TOML."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from inspect import signature
from pathlib import Path
from typing import Any, Final, TypeGuard

from cdsm.errors import LINES, FileError, GeometryError, InvalidInput, did_you_mean, listed, unknown
from cdsm.support.files import read_text, write_text
from cdsm.support.records import read_toml, toml_text
from cdsm.support.validation import flag
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import LinearElasticity, StrandElasticity, TabulatedElasticity
from cdsm.wires.ropes import RopeElasticity, names_like, rope_name, rope_of_name

STRAND: Final = StrandElasticity.eq19_repaired()
"""The paper's 1×19 steel strand of 1.2 mm (Section IV-C): Eq. 19, repaired and continuous."""

SOLID: Final = LinearElasticity.of_wire(200e9, 1.2e-3)
"""Solid wire of the strand's diameter with the paper's 200 GPa (Section IV-B)."""

WIRES: Final[dict[str, Elasticity]] = {"1x19-1.2mm": STRAND, "solid-1.2mm": SOLID}
"""Laws by the name of their wire."""

_KINDS: Final[dict[str, Callable[..., Elasticity]]] = {
    "linear": LinearElasticity,
    "rope": RopeElasticity,
    "strand": StrandElasticity,
    "tabulated": TabulatedElasticity,
}
_HEAD: Final = "# Elasticity of a wire: tensions and rigidity in N, strains without unit\n"
_MEASURED: Final = ".csv", ".txt", ".tsv"  # files of measured points

Wire = Elasticity | str | float | os.PathLike[str]
"""Ways to give a wire: its law, a name of :data:`WIRES`, that of a rope such as ``7x7-0.8mm``, EA
[N], or the path of a WIRE.toml."""


def as_wire(wire: Wire) -> Elasticity:
    """Return the law of a wire: itself, by a name, EA [N], or a WIRE.toml.

    Raises InvalidInput (also for another type, or EA outside its range) or FileError.
    """
    if isinstance(wire, Elasticity):
        return wire
    if is_file(wire) or isinstance(wire, os.PathLike):
        return read_law(wire)
    if isinstance(wire, str):
        return law_of_name(wire, {}, "Or give EA in N, or a file WIRE.toml.")
    if isinstance(wire, bool) or not isinstance(wire, (int, float)):
        raise InvalidInput("wire", f"{wire!r} given; give a name, EA in N, or a file.")
    return LinearElasticity(wire)


def law_of_name(name: str, others: Mapping[str, Elasticity], remedy: str) -> Elasticity:
    """Return the law of a wire of :data:`WIRES`, of ``others``, or of a rope; or InvalidInput."""
    laws = {**WIRES, **others}
    if name in laws:
        return laws[name]
    if rope := rope_of_name(name):
        return rope
    raise unknown("wire", name, [*laws, *names_like(name)], remedy)


def is_file(wire: object) -> TypeGuard[str]:
    """Return whether the name of a wire is that of a file."""
    return isinstance(wire, str) and wire.endswith((".toml", *_MEASURED))


def read_law(path: str | os.PathLike[str]) -> Elasticity:
    """Read a law as :meth:`Elasticity.read`."""
    if str(path).lower().endswith(_MEASURED):
        raise FileError(path, "looks like measured points. Fit it first: `cdsm fit`.")
    try:
        return from_table(read_toml(read_text(path)))
    except GeometryError as error:
        faults = error.faults
    raise FileError(path, f"is not an elasticity:{listed(faults, 20, LINES)}")


def write_law(law: Elasticity, path: str | os.PathLike[str]) -> Path:
    """Write a law as :meth:`Elasticity.write`."""
    return write_text(path, _HEAD + toml_text(table_of(law)))


def table_of(law: Elasticity) -> dict[str, Any]:
    """Return the TOML table of a law; InvalidInput if it was made from a function."""
    if not law.kind:
        problem = f"{law!r} was made from a function. Tabulate its strain to save it."
        raise InvalidInput("elasticity", problem)
    table = {"kind": law.kind, **law.arguments}
    if law.kind == "linear" or law.factor != 1.0:
        table["rigidity" if law.kind == "linear" else "factor"] = law.factor
    return table | ({"slack_below": True} if law.low < law.rest else {})


def from_table(table: object) -> Elasticity:
    """Build a law from a parsed TOML table; GeometryError lists what is wrong with it."""
    entries: dict[str, Any] = dict(table) if isinstance(table, dict) else {"kind": table}
    usual: dict[str, Any] = {"kind": None, "factor": 1.0, "slack_below": False}
    if "rope" in entries:
        usual["kind"] = "rope"
    kind, factor, slack = (entries.pop(key, value) for key, value in usual.items())
    if kind not in [*_KINDS]:
        raise GeometryError([f"kind: must be one of {', '.join(_KINDS)}, but is {kind!r}"])
    parameters = signature(_KINDS[kind]).parameters
    keys = [*parameters]
    required = [
        key for key, parameter in parameters.items() if parameter.default is parameter.empty
    ]
    missing = [key for key in required if key not in entries]
    others = [(key, did_you_mean(key, keys)) for key in entries if key not in keys]
    faults = [f"{key}: is missing" for key in missing]
    faults += [f"{key}: is not a key of a {kind} law{meant}" for key, meant in others]
    try:
        law = _KINDS[kind](**{key: entries.get(key) for key in keys})
        law = law if factor == 1.0 else law.scaled(factor)
        law = law.slack_below() if flag("slack_below", slack) else law
    except InvalidInput as error:
        faults += [] if error.name in missing else [str(error)]
    if faults:
        raise GeometryError(faults)
    return law


def name_of(law: Elasticity) -> str | None:
    """Return the name of a law, by which :func:`as_wire` finds it, or None if it has none."""
    named = next((name for name, known in WIRES.items() if known == law), None)
    rope = rope_name(law)
    return named or (None if rope in WIRES else rope)


def diameter_of(law: Elasticity) -> float | None:
    """Return the diameter [m] of a rope, or that with which the name of a wire ends, or None."""
    if law.kind == "rope":
        return float(law.arguments["diameter"])
    name = name_of(law)
    return None if name is None else 1e-3 * float(name.rpartition("-")[2].removesuffix("mm"))


def label(law: Elasticity) -> str:
    """Return a short text for a law: the name of its wire, its EA, or its kind and tensions."""
    if law.kind == "rope":
        sizes = law.arguments
        rope = f"{sizes['rope']} of {1e3 * sizes['diameter']:g} mm"
        return name_of(law) or f"{rope}, EA {law.constant_rigidity:.6g} N"
    if law.constant_rigidity or name_of(law):
        return name_of(law) or f"EA {law.constant_rigidity:.6g} N"
    text = f"{law.kind or 'function'}, {law.rest:.4g} to {law.high:.4g} N"
    text = "1x19-1.2mm" if law.arguments == STRAND.arguments else text
    text += f", EA times {law.factor:.6g}" if law.factor != 1.0 else ""
    branch = f", with a slack branch of EA {law.rigidity(law.low):.4g} N below {law.rest:.4g} N"
    return text + branch * (law.low < law.rest)
