"""Write TOML by tomli-w, with rows of numbers in one line; lay tables over others."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import tomli_w

from cdsm.errors import GeometryError, listed


class _Verbatim(float):
    """TOML as it stands: of a number, tomli-w writes the text that ``str`` makes of it."""

    toml = ""

    def __str__(self) -> str:
        return self.toml


def verbatim(toml: str) -> float:
    """Return a value that :func:`toml_text` writes as the given TOML, e.g. a text in '''."""
    value = _Verbatim()
    value.toml = toml
    return value


def one_line_each(tables: Iterable[Mapping[str, Any]]) -> float:
    """Return a value that :func:`toml_text` writes as an array, each of its tables in one line."""
    lines = [", ".join(toml_text(table).splitlines()) for table in tables]
    return verbatim("".join(["[\n", *(f"    {{ {line} }},\n" for line in lines), "]"]))


def toml_text(table: Mapping[str, Any]) -> str:
    """Write a nested table as TOML, without what is None or {}, and rows of numbers in one line."""
    return tomli_w.dumps(_written(table))


def _written(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _written(each) for key, each in value.items() if each not in (None, {})}
    if not isinstance(value, (list, tuple)):
        return value
    entries = [_written(each) for each in value]
    numbers = entries and all(isinstance(each, (int, float)) for each in entries)
    return verbatim(f"[{', '.join(map(str, entries))}]") if numbers else entries


def laid_over(old: Any, new: Any, where: str = "") -> Any:
    """Lay tables ``new`` over ``old``; keys of a list are names of its tables or count from 1."""
    if not isinstance(new, Mapping):
        return new
    if not isinstance(old, list):
        known = old if isinstance(old, dict) else {}
        laid = {k: laid_over(known.get(k), value, f"{where}{k}.") for k, value in new.items()}
        return {**known, **laid}
    entries = [each if isinstance(each, dict) else {} for each in old]
    names = [str(each.get("name", i)) for i, each in enumerate(entries, start=1)]
    unknown = [
        f"{where}{key}: there is only {listed(names, 12)}" for key in new if key not in names
    ]
    if unknown:
        raise GeometryError(unknown)
    return [
        laid_over(each, new[name], f"{where}{name}.") if name in new else each
        for name, each in zip(names, old, strict=True)
    ]
