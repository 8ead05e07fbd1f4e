"""Tolerances: standard uncertainties of the numbers that describe an arm, and their TOML."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, fields
from pathlib import Path
from typing import Any, Final, Literal, Self, final, get_args

from cdsm.errors import LINES, CdsmError, FileError, GeometryError, InvalidInput, listed
from cdsm.support.files import read_text, write_text
from cdsm.support.records import Number, parse, read_toml, record, toml_value
from cdsm.support.validation import one_of, scalar, sequence_of, text

Distribution = Literal["normal", "uniform"]

EVERY: Final = "*"
"""Pattern of the names of all inputs."""

COMMON: Final = ("rigidity", "friction")
"""Sources whose inputs share one error by default: wires of one spool, holes of one material."""

_LARGEST = {
    **dict.fromkeys(("rigidity", "spring"), (0.5, "It is relative.")),
    **dict.fromkeys(("joint_angle", "hole_angle"), (0.3, "It is in rad.")),
    "friction": (0.5, "It is a coefficient."),
}
"""Largest allowed standard uncertainty of a source, and its unit in words."""


@final
@dataclass(frozen=True)
class Tolerance:
    """Standard uncertainty of inputs of one kind, such as the radius of every hole.

    Attributes:
        standard: Standard uncertainty u (one sigma) of each input [rad], [m], [N], [kg] or [-].
        distribution: ``"normal"`` or ``"uniform"``. Only Monte Carlo needs it.
        correlation: Correlation ρ of every two inputs, from 0 (independent errors) to 1 (one error
            for all) [-].
        of: Names of the inputs that have this tolerance, as a pattern: ``"cable1_*"``.

    Raises:
        InvalidInput: ``standard`` is negative or not a number, ``correlation`` is not between 0
            and 1, or ``of`` is not a text.
        UnknownName: ``distribution`` is unknown.
    """

    standard: float
    _: KW_ONLY
    distribution: Distribution = "normal"
    correlation: float = 0.0
    of: str = EVERY

    def __post_init__(self) -> None:
        standard, rho = scalar("standard", self.standard), scalar("correlation", self.correlation)
        if standard < 0.0:
            raise InvalidInput("standard", f"{standard:g} given; a tolerance is not negative.")
        if not 0.0 <= rho <= 1.0:
            raise InvalidInput("correlation", f"{rho:g} given; a number from 0 to 1 is needed.")
        one_of("distribution", self.distribution, get_args(Distribution))
        self.__dict__.update(standard=standard, correlation=rho, of=text("of", self.of))

    @classmethod
    def within(cls, half_width: float, *, correlation: float = 0.0, of: str = EVERY) -> Self:
        """Return the tolerance of inputs that are surely within ±a of their value; u = a/√3.

        The distribution is uniform (JCGM 100, 4.3.7); a is ``half_width``, in the unit of the
        inputs. The other arguments and all errors are those of :class:`Tolerance`.
        """
        standard = scalar("half_width", half_width) / math.sqrt(3.0)
        return cls(standard, distribution="uniform", correlation=correlation, of=of)


OneOrMore = float | Tolerance | Sequence[Tolerance]
"""Types of a source of :class:`Tolerances`: a standard uncertainty, or one or more tolerances."""


@final
@dataclass(frozen=True, kw_only=True, repr=False)
class Tolerances:
    """Uncertainties of the dimensions of an arm and of the values measured on it.

    A source of uncertainty is a standard uncertainty (one sigma) as a number, a
    :class:`Tolerance`, or a list of tolerances, each for the inputs that its ``of`` names. It is
    kept as a tuple of those that are not zero. A number for ``rigidity`` or ``friction`` has the
    correlation 1: all cables are of one spool, all disks of one material. Other numbers have the
    correlation 0.

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

    def __post_init__(self) -> None:
        for name in SOURCES:
            self.__dict__[name] = _checked(name, getattr(self, name))

    @property
    def given(self) -> Mapping[str, tuple[Tolerance, ...]]:
        """All tolerances that are not zero, by source of uncertainty."""
        return {name: parts for name in SOURCES if (parts := getattr(self, name))}

    def __repr__(self) -> str:
        return f"Tolerances({', '.join(f'{name}={parts}' for name, parts in self.given.items())})"

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Tolerances:
        """Read tolerances from a TOML file of their own, or from ``[tolerances]`` of an ARM.toml.

        Each key is a source. Its value is a standard uncertainty, or a table with ``standard`` or
        ``within`` (a half-width), ``distribution``, ``correlation`` and ``of``, or a list of such
        tables.

        Raises:
            FileError: The file cannot be read, is not TOML, or has no tolerances. Every
                fault is listed.
        """
        try:
            table = read_toml(read_text(path))
            own = table.get("tolerances", table)
            return from_table(own if isinstance(own, dict) else table)
        except GeometryError as error:
            faults = listed(error.faults, 20, LINES)
            raise FileError(path, f"does not hold tolerances:{faults}") from None

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write a TOML file from which :meth:`read` builds equal tolerances; return its path.

        Raises:
            FileError: The file cannot be written; an existing file stays unchanged.
        """
        head = "# Tolerances of an arm, one sigma: rad, m, N, kg; rigidity and spring relative.\n"
        return write_text(path, "\n".join([head, *tolerance_lines(self)]) + "\n")


SOURCES: Final = tuple(field.name for field in fields(Tolerances))
"""Names of all sources of uncertainty."""


def _checked(source: str, value: object) -> tuple[Tolerance, ...]:
    """Return the tolerances of a source that are not zero; InvalidInput names the source."""
    try:
        if isinstance(value, (list, tuple)):
            given = sequence_of("tolerances", value, Tolerance)
        elif isinstance(value, Tolerance):
            given = (value,)
        else:
            given = (Tolerance(value, correlation=float(source in COMMON)),)  # type: ignore[arg-type]
    except InvalidInput as error:
        raise InvalidInput(source, str(error).removeprefix("standard: ")) from None
    largest, unit = _LARGEST.get(source, (math.inf, ""))
    for u in (each.standard for each in given):
        if u > largest:
            said = f"a standard uncertainty of {u:g} given; up to {largest:g} is a tolerance."
            raise InvalidInput(source, f"{said} {unit}")
    return tuple(each for each in given if each.standard)


@record
class _Entry:
    """A tolerance as a table in TOML; the default of ``correlation`` depends on the source."""

    standard: Number | None = None
    within: Number | None = None
    distribution: Distribution | None = None
    correlation: Number | None = None
    of: str = EVERY

    def built(self, source: str) -> Tolerance:
        rho = float(source in COMMON) if self.correlation is None else self.correlation
        if (self.standard is None) == (self.within is None):
            raise InvalidInput(source, "give one of standard and within.")
        if self.standard is not None:
            kind = self.distribution or "normal"
            return Tolerance(self.standard, distribution=kind, correlation=rho, of=self.of)
        if self.distribution == "normal" or self.within is None:
            raise InvalidInput(source, "within is uniform; give standard with normal.")
        return Tolerance.within(self.within, correlation=rho, of=self.of)


def from_table(table: Mapping[str, Any]) -> Tolerances:
    """Build tolerances from a parsed TOML table; raise GeometryError that lists every fault."""
    found, faults = {}, []
    for name, value in table.items():
        try:
            one_of("source of uncertainty", name, SOURCES)
            if isinstance(value, (dict, list)):
                tables = value if isinstance(value, list) else [value]
                value = [parse(_Entry, each).built(name) for each in tables]
            found[name] = _checked(name, value)
        except GeometryError as error:
            faults += [f"{name}.{fault}" for fault in error.faults]
        except CdsmError as error:
            faults.append(f"{name}: {str(error).removeprefix(f'{name}: ')}")
    if faults:
        raise GeometryError(faults)
    return Tolerances(**found)


def tolerance_lines(tolerances: Tolerances) -> list[str]:
    """Return one TOML line for each source of ``tolerances`` that is not zero."""
    tables = {name: [*map(_table, parts)] for name, parts in tolerances.given.items()}
    return [
        f"{name} = {one}" if not more else f"{name} = [{', '.join([one, *more])}]"
        for name, (one, *more) in tables.items()
    ]


def _table(value: Tolerance) -> str:
    """Return a tolerance as a TOML table."""
    values: dict[str, object] = {"standard": value.standard, "correlation": value.correlation}
    values |= {"distribution": value.distribution} if value.distribution != "normal" else {}
    values |= {"of": value.of} if value.of != EVERY else {}
    return f"{{{', '.join(f'{key} = {toml_value(x)}' for key, x in values.items())}}}"
