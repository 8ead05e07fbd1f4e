"""Read and write tolerances in TOML: a file of their own, or ``[tolerances]`` of an ARM.toml."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cdsm.errors import CdsmError, FileError, GeometryError, InvalidInput, counted
from cdsm.support.files import read_text, write_text
from cdsm.support.records import read_toml, toml_value
from cdsm.support.validation import one_of
from cdsm.tolerance import COMMON, EVERY, SOURCES, Tolerance, Tolerances

_KEYS = ("standard", "within", "distribution", "correlation", "of", "tensions")


def read_tolerances(path: str | os.PathLike[str]) -> Tolerances:
    """Read tolerances from a file of their own or an ARM.toml; see :meth:`cdsm.Tolerances.read`."""
    try:
        table = read_toml(read_text(path))
        own = table.get("tolerances", table)
        return from_table(own if isinstance(own, dict) else table)
    except GeometryError as error:
        raise FileError(path, f"does not hold tolerances, {counted(error.faults)}") from None


def write_tolerances(tolerances: Tolerances, path: str | os.PathLike[str]) -> Path:
    """Write a file from which :func:`read_tolerances` builds equal tolerances."""
    head = "# Tolerances of an arm, one sigma: rad, m, N, kg; rigidity and spring relative.\n"
    return write_text(path, "\n".join([head, *tolerance_lines(tolerances)]) + "\n")


def from_table(table: Mapping[str, Any]) -> Tolerances:
    """Build tolerances from a parsed TOML table; raise GeometryError with every fault."""
    found: dict[str, Any] = {}
    faults = []
    for name, value in table.items():
        try:
            one_of("source of uncertainty", name, SOURCES)
            several = isinstance(value, list)
            parts = [_tolerance(name, each) for each in (value if several else [value])]
            found[name] = parts if several else parts[0]
            Tolerances(**{name: found[name]})
        except CdsmError as error:
            faults.append(f"{name}: {str(error).removeprefix(f'{name}: ')}")
    if faults:
        raise GeometryError(faults)
    return Tolerances(**found)


def _tolerance(name: str, value: object) -> Tolerance:
    """Build one tolerance from a number or a table; CdsmError if it is invalid."""
    if not isinstance(value, dict):
        return Tolerance(value, correlation=float(name in COMMON))  # type: ignore[arg-type]
    for key in value:
        one_of(f"key of {name}", key, _KEYS)
    values: dict[str, Any] = {"correlation": float(name in COMMON)} | value
    if ("standard" in values) == ("within" in values):
        raise InvalidInput(name, "give one of standard and within.")
    if "within" not in values:
        return Tolerance(**values)
    if "tensions" in values:
        raise InvalidInput(name, "tensions go with standard, not with within.")
    return Tolerance.within(values.pop("within"), **values)


def tolerance_lines(tolerances: Tolerances) -> list[str]:
    """Return one TOML line for each source of ``tolerances`` that is not zero."""
    every, none = ((name, getattr(tolerances, name)) for name in SOURCES), Tolerances()
    return [f"{name} = {_value(value)}" for name, value in every if value != getattr(none, name)]


def _value(value: Tolerance | tuple[Tolerance, ...]) -> str:
    """Return a tolerance as a TOML table, or several as a list of TOML tables."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_value, value))}]"
    values: dict[str, Any] = {"standard": value.standard, "correlation": value.correlation}
    if value.distribution != "normal":
        values["distribution"] = value.distribution
    if value.of != EVERY:
        values["of"] = value.of
    if value.tensions is not None:
        values["tensions"] = value.tensions
    return f"{{{', '.join(f'{key} = {toml_value(_plain(x))}' for key, x in values.items())}}}"


def _plain(value: Any) -> object:
    """Return an array as nested tuples, from which TOML is written; other values unchanged."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    return tuple(map(_plain, value)) if isinstance(value, list) else value
