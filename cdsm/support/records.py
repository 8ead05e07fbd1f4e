"""Frozen records of strictly checked fields, one error for all faults, and TOML of records."""

from __future__ import annotations

import difflib
import inspect
import json
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import fields
from functools import wraps
from typing import (
    Annotated,
    Any,
    TypeVar,
    cast,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

import numpy as np
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

from cdsm.errors import GeometryError
from cdsm.support.validation import LARGEST, RANGES, within

_Record = TypeVar("_Record")
_Function = TypeVar("_Function", bound=Callable[..., Any])

_STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


def _plain(value: object) -> object:
    """Convert numpy numbers and arrays to Python numbers and lists for strict validation."""
    return value.tolist() if isinstance(value, (np.generic, np.ndarray)) else value


def _name(value: str) -> str:
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,63}", value):
        allowed = "up to 64 of a-z, A-Z, 0-9, _ are needed, a letter first"
        raise ValueError(f"{value!r} given; {allowed}")
    return value


def _in_range(kind: str, zero: bool = False) -> Callable[[float], float]:
    """Return a validator that refuses values outside ``RANGES[kind]``; ``zero`` also allows 0."""

    def check(value: float) -> float:
        problem = within(kind, value, zero=zero)
        if problem:
            raise ValueError(problem)
        return value

    return check


Integer = Annotated[int, BeforeValidator(_plain)]
Number = Annotated[float, BeforeValidator(_plain), Field(ge=-LARGEST, le=LARGEST)]
Length = Annotated[Number, AfterValidator(_in_range("length"))]
LengthOrZero = Annotated[Number, AfterValidator(_in_range("length", zero=True))]
Friction = Annotated[Number, AfterValidator(_in_range("friction", zero=True))]
Wrap = Annotated[Number, AfterValidator(_in_range("wrap", zero=True))]
Mass = Annotated[Number, AfterValidator(_in_range("mass", zero=True))]
Rigidity = Annotated[Number, AfterValidator(_in_range("rigidity"))]
SpringStiffness = Annotated[Number, AfterValidator(_in_range("stiffness"))]
Tension = Annotated[Number, AfterValidator(_in_range("tension", zero=True))]
Coordinate = Annotated[Number, Field(ge=-RANGES["length"].high, le=RANGES["length"].high)]
Direction = Annotated[tuple[Number, Number, Number], Field(strict=False), BeforeValidator(_plain)]
Point = Annotated[
    tuple[Coordinate, Coordinate, Coordinate], Field(strict=False), BeforeValidator(_plain)
]
Name = Annotated[str, AfterValidator(_name)]

ONE, EACH = "(one)", "(each)"
"""Tags of pydantic: one value for all joints, or one for each joint. Faults do not print tags."""


def one_or_each(value: object) -> str:
    """Return EACH if a value is a list or array, with one entry for each joint; else ONE.

    pydantic chooses by this tag how it checks a field of the type PerJoint.
    """
    return EACH if isinstance(value, (list, tuple)) or getattr(value, "ndim", False) else ONE


_Each = TypeVar("_Each")

PerJoint = Annotated[
    Annotated[_Each, Tag(ONE)] | Annotated[Sequence[_Each], BeforeValidator(_plain), Tag(EACH)],
    Discriminator(one_or_each),
]
"""A value for all joints, or one for each joint, base to tip."""


_DEEPEST = 64  # maximum number of parts of a dotted key; a description of an arm needs two

_PART = r"""[ \t]*+(?:"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+'|[^\s.=\[\]{},#"']++)[ \t]*+"""
_DEEP_KEY = re.compile(rf"(?:\.{_PART}){{{_DEEPEST}}}")

_HINTED = 20  # maximum number of unknown keys for which a similar known key is suggested


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


def _reporting(validated: _Function, kind: Callable[..., Any]) -> _Function:
    """Wrap ``validated`` so that all faults that pydantic finds raise one GeometryError.

    ``validated`` builds a record or runs a function, after pydantic has checked the values given.
    ``kind`` is the record's class or the function: messages name the keywords of its signature.
    """

    @wraps(validated)
    def call(*args: object, **values: object) -> object:
        if len(args) > 1:  # the first one is the class or the object itself
            names = [each for each in inspect.signature(kind).parameters if each != "cls"]
            pairs = [f"{name}={value!r}" for name, value in zip(names, args[1:], strict=False)]
            raise GeometryError([f"takes keywords only: write {', '.join(pairs)}"])
        try:
            return validated(*args, **values)
        except ValidationError as error:
            faults = _faults(error, kind)
        # not inside except: the context, pydantic's error, cannot be pickled, as a cluster does
        raise GeometryError(faults)

    return cast(_Function, call)


def read_toml(text: str) -> dict[str, Any]:
    """Parse TOML; raise a :class:`GeometryError` that names the place of an error."""
    if _DEEP_KEY.search(text) is not None:  # the parser would need gigabytes for such a key
        raise GeometryError([f"is not TOML that is read here: a key has over {_DEEPEST} parts"])
    try:
        data = tomllib.loads(text)
        json.dumps(data, default=str)
    except (ValueError, RecursionError) as error:  # integers of too many digits raise too
        raise GeometryError([f"is not TOML: {error}"]) from None
    return data


def parse(kind: type[_Record], data: object) -> _Record:
    """Build a record of class ``kind`` from parsed TOML; a GeometryError lists all faults."""
    # only from JSON does pydantic's strict mode accept a table as a record and an array as a tuple;
    # JSON has no dates, so they become strings, which only names accept
    return _reporting(TypeAdapter(kind).validate_json, kind)(json.dumps(data, default=str))


def toml_lines(record: object, keys: Iterable[str] | None = None) -> list[str]:
    """Return a TOML line for each field of a record, or each of ``keys``, that is not None."""
    names = keys or [field.name for field in fields(record)]  # type: ignore[arg-type]
    values = ((name, getattr(record, name)) for name in names)
    return [f"{name} = {toml_value(value)}" for name, value in values if value is not None]


def toml_value(value: object) -> str:
    """Write a text, a number, or a tuple or array of these as a TOML value."""
    value = _plain(value)
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, str):
        # JSON and TOML escape alike, except for DEL and the pairs of \\u that JSON writes for emoji
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)


def _places(kind: Any, place: str = "at the top of the file") -> dict[str, str]:
    """Return where each keyword of a function, or field of a record and its parts, belongs."""
    hints = get_type_hints(kind)
    hints.pop("return", None)
    found: dict[str, str] = {}
    for name, hint in hints.items():
        for origin, part in _parts(hint):
            found |= _places(part, f"in each of [[{name}]]" if origin is tuple else f"in [{name}]")
    return found | dict.fromkeys(hints, place)


def _parts(hint: Any, origin: Any = None) -> Iterator[tuple[Any, Any]]:
    """Yield the records inside a type, each with the innermost type that holds it."""
    if is_pydantic_dataclass(hint):
        yield origin, hint
    for part in get_args(hint):
        yield from _parts(part, get_origin(hint))


def did_you_mean(key: str, known: Iterable[str], least: float = 0.6) -> str:
    """Return ``; did you mean …?`` with the known key that is most similar to ``key``.

    The text is empty if no similarity, from 0 to 1, reaches ``least``.
    """
    near = difflib.get_close_matches(key[:100], list(known), n=1, cutoff=least)
    return f"; did you mean {near[0]}?" if near and near[0] != key else ""


def misspelt(name: str, known: Iterable[str], least: float = 0.6) -> str:
    """Return :func:`did_you_mean` for an unknown name; an empty text for a known one.

    Only known names whose length differs by at most one letter are suggested: a name of another
    length may belong to another program that uses the file.
    """
    known = tuple(known)
    as_long = [each for each in known if abs(len(each) - len(name)) < 2]
    return "" if name in known else did_you_mean(name, as_long, least)


def faults_at(where: str, error: ValueError) -> list[str]:
    """Return the fault, or faults, of a value, each after the key ``where`` of the value."""
    if several := getattr(error, "faults", ()):
        return [f"{where}.{each}".lstrip(".").replace(".[", "[") for each in several]
    own = f"{getattr(error, 'name', None)}: "  # the argument of an InvalidInput
    return [f"{where}: {str(error).removeprefix(own)}"]


def _faults(error: ValidationError, kind: Callable[..., Any]) -> list[str]:
    known = _places(kind)
    listed: list[str] = []
    hinted = 0
    faults = error.errors()
    for fault in faults:
        # joints[2].limit counts from 1 like the names of joints and cables
        where = "".join(
            f"[{part + 1}]" if isinstance(part, int) else f".{part}"
            for part in fault["loc"]
            if part not in (ONE, EACH, "[key]")  # of a table by names
        ).lstrip(".")
        cause = fault.get("ctx", {}).get("error")
        if isinstance(cause, ValueError):
            listed += faults_at(where, cause)
        elif fault["type"] == "too_short" and any(
            other["loc"][: len(fault["loc"])] == fault["loc"] and other is not fault
            for other in faults
        ):
            continue  # the list is only too short because its faulty entries do not count
        elif fault["type"] in ("missing", "missing_keyword_only_argument"):
            listed.append(f"{where}: is missing")
        elif fault["type"] == "unexpected_keyword_argument":
            key = str(fault["loc"][-1])
            hinted += 1
            hint = did_you_mean(key, known) if hinted <= _HINTED else ""
            if key in known and f"[{fault['loc'][0]}]" not in known[key]:
                hint = f"; it belongs {known[key]}"
            listed.append(f"{where}: is not a key that is known here{hint}")
        else:
            value = repr(fault["input"])
            value = value if len(value) <= 60 else f"{value[:57]}..."
            message = fault["msg"][0].lower() + fault["msg"][1:].replace("an object", "a table")
            listed.append(f"{where}: {message}, but is {value}".removeprefix(": "))
    return listed
