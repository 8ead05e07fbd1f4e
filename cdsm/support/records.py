"""Frozen records of strictly checked fields, by pydantic, and their TOML."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import wraps
from typing import (
    Annotated,
    Any,
    TypeVar,
    cast,
    dataclass_transform,
    get_args,
    get_type_hints,
)

import numpy as np
import tomli_w
from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    TypeAdapter,
    ValidationError,
)
from pydantic.dataclasses import dataclass, is_pydantic_dataclass

from cdsm.errors import GeometryError, did_you_mean, listed
from cdsm.support.validation import LARGEST, RANGES, within

_Record = TypeVar("_Record")
_Each = TypeVar("_Each")
_Function = TypeVar("_Function", bound=Callable[..., Any])

_STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


def plain(value: object) -> object:
    """Convert numpy numbers and arrays to Python numbers and lists for strict validation."""
    return value.tolist() if isinstance(value, (np.generic, np.ndarray)) else value


def _name(value: str) -> str:
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,63}", value):
        allowed = "up to 64 of a-z, A-Z, 0-9, _ are needed, a letter first"
        raise ValueError(f"{value!r} given; {allowed}")
    return value


def in_range(kind: str, zero: bool = False, inf: bool = False) -> AfterValidator:
    """Refuse values outside ``RANGES[kind]``; ``zero`` also allows 0, ``inf`` infinity."""

    def check(value: float) -> float:
        if problem := within(kind, value, zero=zero, infinite=inf):
            raise ValueError(problem)
        return value

    return AfterValidator(check)


def gone(remedy: str) -> BeforeValidator:
    """Refuse any value of a key that files of an older cdsm have, and say what to do instead."""

    def refuse(_: object) -> None:
        raise ValueError(f"is gone: {remedy}")

    return BeforeValidator(refuse)


Integer = Annotated[int, BeforeValidator(plain)]
Number = Annotated[float, BeforeValidator(plain), Field(ge=-LARGEST, le=LARGEST)]
Length = Annotated[Number, in_range("length")]
LengthOrZero = Annotated[Number, in_range("length", zero=True)]
FrictionCoefficient = Annotated[Number, in_range("friction", zero=True)]
Wrap = Annotated[Number, in_range("wrap", zero=True)]
Mass = Annotated[Number, in_range("mass", zero=True)]
Bending = Annotated[Number, in_range("bending stiffness")]
Torsion = Annotated[
    float,
    Field(allow_inf_nan=True),
    BeforeValidator(plain),
    in_range("bending stiffness", inf=True),
]
Coordinate = Annotated[Number, Field(ge=-RANGES["length"].high, le=RANGES["length"].high)]
Vector = Annotated[tuple[Number, Number, Number], Field(strict=False), BeforeValidator(plain)]
Position = Annotated[
    tuple[Coordinate, Coordinate, Coordinate], Field(strict=False), BeforeValidator(plain)
]
Numbers = Annotated[Sequence[Number], BeforeValidator(plain)]
HoleAngles = Annotated[Numbers, Field(min_length=1, max_length=64)]
Name = Annotated[str, AfterValidator(_name)]

ONE = "(one)"
EACH = "(each)"
"""Tags of pydantic: one value for all joints, or one for each joint. Faults print no tags: (…)."""


def one_or_each(value: object) -> str:
    """Return EACH for a list or array, which has one entry for each joint; else ONE."""
    return EACH if isinstance(value, (list, tuple)) or getattr(value, "ndim", False) else ONE


PerJoint = Annotated[
    Annotated[_Each, Tag(ONE)] | Annotated[Sequence[_Each], BeforeValidator(plain), Tag(EACH)],
    Discriminator(one_or_each),
]
"""A value for all joints, or one for each joint, base to tip."""


class CrossFaults(ValueError):
    """Error that a check of a record raises for faults that concern several of its fields."""

    def __init__(self, faults: Iterable[str]) -> None:
        self.faults = tuple(faults)
        super().__init__("; ".join(self.faults))


@dataclass_transform(frozen_default=True, kw_only_default=True)
def record(cls: type[_Record]) -> type[_Record]:
    """Decorate a class as a frozen, strict pydantic dataclass.

    One :class:`GeometryError` lists all faults of the values of its fields.
    """
    made: Any = dataclass(frozen=True, kw_only=True, config=_STRICT)(cls)
    made.__init__ = _reporting(made.__init__, made)
    return made  # type: ignore[no-any-return]


def _reporting(validated: _Function, kind: Any) -> _Function:
    """Wrap a function that builds a ``kind``, so that a GeometryError lists pydantic's faults."""

    @wraps(validated)
    def call(*args: object, **values: object) -> object:
        try:
            return validated(*args, **values)
        except ValidationError as error:
            faults = _faults(error, kind)
        # not inside except: the context, pydantic's error, cannot be pickled, as a cluster does
        raise GeometryError(faults)

    return cast(_Function, call)


def read_toml(text: str) -> dict[str, Any]:
    """Parse TOML; raise a :class:`GeometryError` that names the place of an error."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # integers of too many digits raise too
        raise GeometryError([f"is not TOML: {error}"]) from None


def parse(kind: type[_Record], data: object) -> _Record:
    """Build a record of class ``kind`` from parsed TOML; a GeometryError lists all faults."""
    # only from JSON does pydantic's strict mode accept a table as a record and an array as a tuple;
    # JSON has no dates, so they become strings, which only names accept
    return _reporting(TypeAdapter(kind).validate_json, kind)(json.dumps(data, default=str))


def faults_at(where: str, error: ValueError) -> list[str]:
    """Return the fault, or faults, of a value, each after the key ``where`` of the value."""
    if several := getattr(error, "faults", ()):
        return [f"{where}.{fault}".lstrip(".").replace(".[", "[") for fault in several]
    prefix = f"{getattr(error, 'name', None)}: "  # the argument of an InvalidInput
    return [f"{where}: {str(error).removeprefix(prefix)}"]


def _keys(kind: Any) -> set[str]:
    """Return the keys of a record and of its parts."""
    hints = get_type_hints(kind) if is_pydantic_dataclass(kind) else {}
    return {*hints}.union(*map(_keys, (*hints.values(), *get_args(kind))))


def _is_tag(part: int | str) -> bool:
    """Return whether a part of a place is a tag of pydantic, such as ONE; keys have no brackets."""
    return isinstance(part, str) and part.startswith("(") and part.endswith(")")


def _faults(error: ValidationError, kind: Any) -> list[str]:
    listed: list[str] = []
    for fault in error.errors():
        # joints[2].limit counts from 1 like the names of joints and cables
        parts = (part for part in fault["loc"] if not _is_tag(part) and part != "[key]")
        shown = (f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in parts)
        where = "".join(shown).lstrip(".")
        cause = fault.get("ctx", {}).get("error")
        if isinstance(cause, ValueError):
            listed += faults_at(where, cause)
        elif fault["type"] == "too_short" and any(earlier.startswith(where) for earlier in listed):
            continue  # pydantic does not count faulty entries
        elif fault["type"].startswith("missing"):
            listed.append(f"{where}: is missing")
        elif fault["type"] == "unexpected_keyword_argument":
            key = str(fault["loc"][-1])
            top = len(fault["loc"]) > 1 and key in get_type_hints(kind)
            hint = "; it belongs at the top of the file" if top else did_you_mean(key, _keys(kind))
            listed.append(f"{where}: is not a key that is known here{hint}")
        elif fault["type"] == "unexpected_positional_argument":
            listed.append(f"{fault['input']!r} is given without its name; give it as a keyword")
        else:
            message = fault["msg"][0].lower() + fault["msg"][1:].replace("an object", "a table")
            listed.append(f"{where}: {message}, but is {fault['input']!r:.60}".removeprefix(": "))
    return listed


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


def set_texts(changes: Mapping[str, Any], where: str = "") -> list[str]:
    """Return changes of a file, which :func:`laid_over` lays, as texts ``KEY=VALUE`` of --set."""
    texts = list[str]()
    for key, value in changes.items():
        if isinstance(value, Mapping) and value:
            texts += set_texts(value, f"{where}{key}.")
        else:
            written = toml_text({"value": value}).partition("=")[2]
            texts.append(f"{where}{key}={written.strip()}")
    return texts


def one_line_each(tables: Iterable[Mapping[str, Any]]) -> float:
    """Return a value that :func:`toml_text` writes as an array, each of its tables in one line."""
    lines = [", ".join(toml_text(table).splitlines()) for table in tables]
    return verbatim("".join(["[\n", *(f"    {{ {line} }},\n" for line in lines), "]"]))


def toml_text(table: Mapping[str, Any]) -> str:
    """Write a nested table as TOML, without what is None or {}, and rows of numbers in one line."""
    return tomli_w.dumps(_written(table))


def _written(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _written(entry) for key, entry in value.items() if entry not in (None, {})}
    if not isinstance(value, (list, tuple)):
        return value
    entries = [_written(entry) for entry in value]
    numbers = entries and all(isinstance(entry, (int, float)) for entry in entries)
    return verbatim(f"[{', '.join(map(str, entries))}]") if numbers else entries


def laid_over(old: Any, new: Any, where: str = "") -> Any:
    """Lay tables ``new`` over ``old``; keys of a list are names of its tables or count from 1."""
    if not isinstance(new, Mapping):
        return new
    if not isinstance(old, list):
        known = old if isinstance(old, dict) else {}
        laid = {k: laid_over(known.get(k), value, f"{where}{k}.") for k, value in new.items()}
        return {**known, **laid}
    entries = [entry if isinstance(entry, dict) else {} for entry in old]
    names = [str(entry.get("name", i)) for i, entry in enumerate(entries, start=1)]
    unknown = [
        f"{where}{key}: there is only {listed(names, 12)}; tables are counted from 1"
        for key in new
        if key not in names
    ]
    if unknown:
        raise GeometryError(unknown)
    return [
        laid_over(entry, new[name], f"{where}{name}.") if name in new else entry
        for name, entry in zip(names, old, strict=True)
    ]
