"""Read and write wires of cables in TOML (by name, by EA, as tables) and settings of cables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Self

from pydantic import Field, model_validator

from cdsm.cable import Cable, Control
from cdsm.errors import GeometryError, InvalidInput, UnknownName
from cdsm.support.records import CrossFaults, SpringStiffness, Tension, record, toml_value
from cdsm.support.validation import one_of
from cdsm.wires.catalogue import WIRES, from_table, name_of, table_of
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import LinearElasticity


@record
class CableSettings:
    """Settings that a file gives for one cable or for all cables; None if not given."""

    wire: Any = None
    series_stiffness: SpringStiffness | None = None
    control: Control | None = None
    minimum: Tension | None = None
    maximum: Tension | None = None

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        low, high = self.minimum, self.maximum
        if low is not None and high is not None and low > high:
            raise CrossFaults([f"minimum: {low:g} N given, above the maximum of {high:g} N"])
        return self


@record
class CableKeys(CableSettings):
    """Top-level keys of a file of cables. The functions that read fields of type Any check them."""

    wires: Any = Field(default_factory=dict)
    cables: Any = None


SETTINGS = ("series_stiffness", "control", "minimum", "maximum")
"""Settings that are attributes of a :class:`Cable` with the same name."""


class FileWires(NamedTuple):
    """The laws EA(F) that a file gives for wires."""

    named: dict[str, Elasticity]  # of the tables [wires.NAME]
    usual: Elasticity | None  # of cables without a wire of their own
    forced: Elasticity | None  # replaces the laws of all cables

    def of(self, given: object) -> Elasticity | None:
        """Return the law of a cable whose key ``wire`` has the value ``given``; None if missing."""
        own = None if given is None else read_wire(given, self.named)
        return self.forced or own or self.usual


def read_wires(keys: CableKeys, forced: Elasticity | None) -> FileWires:
    """Read the wires of a file. The law ``forced`` replaces all. GeometryError lists the faults."""
    if not isinstance(keys.wires, dict):
        raise GeometryError([f"wires: is {keys.wires!r}; give tables [wires.NAME]"])
    named, usual, faults = {}, None, []
    for name, table in keys.wires.items():
        if name in WIRES:
            faults.append(f"wires.{name}: cdsm knows a wire of this name; choose another")
        try:
            named[name] = read_wire(table, {}, f"wires.{name}")
        except GeometryError as error:
            faults += error.faults
    try:
        usual = None if keys.wire is None else read_wire(keys.wire, named)
    except GeometryError as error:
        faults += error.faults
    if faults:
        raise GeometryError(faults)
    return FileWires(named, usual, forced)


def read_wire(given: object, named: Mapping[str, Elasticity], key: str = "wire") -> Elasticity:
    """Return the law of the wire ``given``: a name, EA [N], or a parsed table.

    ``named`` has the laws of the file's own wires by name. A GeometryError lists faults of ``key``.
    """
    try:
        if isinstance(given, dict):
            return from_table(given)
        if isinstance(given, str):
            known = {**WIRES, **named}
            return known[one_of("wire", given, known)]
        if isinstance(given, bool) or not isinstance(given, (int, float)):
            raise InvalidInput(key, f"{given!r} given; give a name, EA in N, or a table.")
        return LinearElasticity(given)
    except GeometryError as error:
        faults = [f"{key}.{fault}" for fault in error.faults]
    except UnknownName as error:
        faults = [f"{key}: {error} Or give EA in N, or a table [wires.NAME]."]
    except InvalidInput as error:
        faults = [f"{key}: {str(error).removeprefix(f'{error.name}: ')}"]
    raise GeometryError(faults)


def wire_entries(cables: Sequence[Cable]) -> tuple[list[str], list[str]]:
    """Return the TOML value of the key ``wire`` of each cable, and lines of tables [wires.NAME]."""
    values: dict[str, str] = {}
    lines: list[str] = []
    keys = []
    for cable in cables:
        law = cable.elasticity
        table = "\n".join(table_of(law))
        if table not in values:
            known = name_of(law)
            if known is None and isinstance(law, LinearElasticity):
                values[table] = toml_value(float(law.rigidity(0.0)))
            elif known is None:
                known = f"wire{1 + len(lines) // 3}"
                lines += [f"[wires.{known}]", table, ""]
            if known is not None:
                values[table] = toml_value(known)
        keys.append(values[table])
    return keys, lines
