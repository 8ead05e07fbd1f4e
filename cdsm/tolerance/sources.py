"""Tolerances of all sources of uncertainty of an arm, such as hole radii, and their TOML."""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Self, final

from cdsm.errors import LINES, CdsmError, FileError, GeometryError, InvalidInput, listed
from cdsm.support.files import read_text, write_text
from cdsm.support.records import read_toml, toml_value
from cdsm.support.validation import one_of, sequence_of
from cdsm.tolerance.tolerance import EVERY, Tolerance

LARGEST = dict.fromkeys(("rigidity", "spring", "friction"), 0.5) | dict.fromkeys(
    ("joint_angle", "hole_angle"), 0.3
)
"""Largest allowed standard uncertainty by source: half of EA or k_series, μ = 0.5, 0.3 rad."""

COMMON = ("rigidity", "friction")
"""Sources whose inputs share one error by default: wires of one spool, holes of one material."""

_KEYS = ("standard", "within", "distribution", "correlation", "of", "tensions")

OneOrMore = float | Tolerance | Sequence[Tolerance]
"""Types of a source of :class:`Tolerances`: a standard uncertainty, or one or more tolerances."""


@final
@dataclass(frozen=True, kw_only=True, repr=False)
class Tolerances:
    """Uncertainties of the dimensions of an arm and of the values measured on it.

    Each source of uncertainty is a :class:`Tolerance`, or a standard uncertainty (one sigma) as a
    number, or a list of tolerances; each entry is for the inputs in its attribute ``of``. A number
    for ``rigidity`` or ``friction`` has the correlation 1: all cables are of one spool, all disks
    of one material. Other numbers have the correlation 0: the errors of all joints, holes, disks
    and links are independent.

    Attributes:
        rigidity: EA of the law of each cable; relative [-].
        spring: Stiffness k_series of the spring in series with each cable, such as its anchor or
            its drive; relative [-].
        joint_angle: Each joint angle [rad]; [m] for prismatic joints.
        tension: Each measured cable tension [N].
        lead: Straight length of each cable before the base disk [m].
        hole_radius: Distance of each hole from the axis of its link [m].
        hole_angle: Angle of each hole about the axis of its link [rad].
        disk_offset: Distance of each disk from its joint [m].
        link_length: Length of each link [m].
        link_mass: Mass of each link [kg].
        friction: Coefficient μ of each hole with friction [-].
        site: Each coordinate of each cable site [m], the only tolerance of holes if the arm is
            from a URDF.

    Raises:
        InvalidInput: A tolerance is negative, not a number, or larger than a plausible error.
        UnknownName: There is no such source.
    """

    rigidity: OneOrMore = 0.0
    spring: OneOrMore = 0.0
    joint_angle: OneOrMore = 0.0
    tension: OneOrMore = 0.0
    lead: OneOrMore = 0.0
    hole_radius: OneOrMore = 0.0
    hole_angle: OneOrMore = 0.0
    disk_offset: OneOrMore = 0.0
    link_length: OneOrMore = 0.0
    link_mass: OneOrMore = 0.0
    friction: OneOrMore = 0.0
    site: OneOrMore = 0.0

    def __new__(cls, **given: OneOrMore) -> Self:
        """Raise UnknownName for a source that does not exist, before the fields are set."""
        for name in given:
            one_of("source of uncertainty", name, SOURCES)
        return super().__new__(cls)

    def __post_init__(self) -> None:
        for name in SOURCES:
            value = getattr(self, name)
            try:
                if isinstance(value, (list, tuple)):
                    value = sequence_of("tolerances", value, Tolerance)
                elif not isinstance(value, Tolerance):
                    value = Tolerance(value, correlation=float(name in COMMON))
                self.__dict__[name] = value
                for each in self.parts(name):
                    _require_size(name, each)
            except InvalidInput as error:
                said = str(error).removeprefix("standard: ").removeprefix(f"{name}: ")
                raise InvalidInput(name, said) from None

    def parts(self, source: str) -> tuple[Tolerance, ...]:
        """Return the tolerances of a ``source``, such as ``"hole_radius"``, that are not zero.

        Raises UnknownName if there is no such source.
        """
        value = getattr(self, one_of("source of uncertainty", source, SOURCES))
        every = value if isinstance(value, tuple) else (value,)
        return tuple(each for each in every if each.is_given)

    @cached_property
    def given(self) -> Mapping[str, tuple[Tolerance, ...]]:
        """All tolerances that are not zero, by source of uncertainty."""
        return {name: parts for name in SOURCES if (parts := self.parts(name))}

    def __repr__(self) -> str:
        return f"Tolerances({', '.join(f'{name}={getattr(self, name)!r}' for name in self.given)})"

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Tolerances:
        """Read tolerances from a TOML file of their own, or from ``[tolerances]`` of an ARM.toml.

        Each key is a source. Its value is a standard uncertainty, or a table with ``standard`` or
        ``within`` (a half-width), ``distribution``, ``correlation``, ``of`` and ``tensions``, or a
        list of such tables.

        Raises:
            FileError: The file cannot be read, is not TOML, or has no tolerances. Every
                fault is listed.
        """
        try:
            table = read_toml(read_text(path))
            own = table.get("tolerances", table)
            return from_table(own if isinstance(own, dict) else table)
        except GeometryError as error:
            raise FileError(
                path, f"does not hold tolerances:{listed(error.faults, 20, LINES)}"
            ) from None

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write a TOML file from which :meth:`read` builds equal tolerances; return its path.

        Raises:
            FileError: The file cannot be written; an existing file stays unchanged.
        """
        head = "# Tolerances of an arm, one sigma: rad, m, N, kg; rigidity and spring relative.\n"
        return write_text(path, "\n".join([head, *tolerance_lines(self)]) + "\n")


# help and completion show the fields, not the keywords of __new__
Tolerances.__new__.__signature__ = inspect.signature(Tolerances.__init__)  # type: ignore[attr-defined]

SOURCES = tuple(field.name for field in fields(Tolerances))
"""Names of all sources of uncertainty."""


def _require_size(source: str, tolerance: Tolerance) -> None:
    """Raise InvalidInput if a tolerance is too large for its ``source`` of uncertainty.

    Also raise it if the tolerance depends on ``tensions`` and the source is not ``rigidity``.
    """
    if tolerance.tensions is not None and source != "rigidity":
        raise InvalidInput(source, "does not depend on tensions; give one standard.")
    largest = LARGEST.get(source, math.inf)
    if isinstance(tolerance.standard, float) and tolerance.standard > largest:
        unit = "in rad" if "angle" in source else "relative"
        unit = "a coefficient" if source == "friction" else unit
        raise InvalidInput(
            source,
            f"a standard uncertainty of {tolerance.standard:g} given; up to {largest:g} is a "
            f"tolerance. It is {unit}.",
        )


def from_table(table: Mapping[str, Any]) -> Tolerances:
    """Build tolerances from a parsed TOML table; raise GeometryError that lists every fault."""
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
    """Build the tolerance of the source ``name`` from a number or a TOML table.

    Raises CdsmError if it is invalid.
    """
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
    return f"{{{', '.join(f'{key} = {toml_value(x)}' for key, x in values.items())}}}"
