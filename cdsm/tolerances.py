"""Tolerances: standard uncertainties of the numbers that describe an arm, and their TOML."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import Any, Final, Literal, Self, final, get_args

from cdsm.errors import LINES, CdsmError, FileError, GeometryError, InvalidInput, listed
from cdsm.parameters import METRE, NEWTON, PARAMETERS, RADIAN, Source
from cdsm.support.files import read_text, write_text
from cdsm.support.records import Number, parse, read_toml, record, toml_text
from cdsm.support.validation import one_of, scalar, sequence_of, text

Distribution = Literal["normal", "uniform"]

EVERY: Final = "*"  # pattern of the names of all inputs
_READINGS: Final[dict[str, Source]] = {
    "joint_angle": Source(unit=RADIAN, largest=0.3),
    "joint_position": Source(unit=METRE),
    "tension": Source(unit=NEWTON),
}
_SITE: Final[dict[str, Source]] = {"site": Source(unit=METRE)}


def sources() -> dict[str, Source]:
    """Return all numbers that may have a tolerance: parameters, each number once, and readings.

    Random errors are drawn in this order: another one gives other draws of the same seed.
    """
    numbers = {name: row for name, row in PARAMETERS.items() if row.shares is None}
    relative = {name: row for name, row in numbers.items() if row.is_relative}
    return relative | _READINGS | numbers | _SITE


@final
@dataclass(frozen=True)
class Tolerance:
    """Standard uncertainty of inputs of one kind, such as the radius of every hole.

    Attributes:
        standard: Standard uncertainty u (one sigma) of each input [rad], [m], [N], [kg] or [-].
        distribution: ``"normal"`` or ``"uniform"``. Only Monte Carlo needs it.
        correlation: Correlation ρ [-] of every two inputs, from 0 (independent errors) to 1 (one
            error for all).
        of: Names of the inputs that have this tolerance, as a pattern: ``"cable1_*"``.

    Raises InvalidInput, also for an unknown ``distribution``.

    Example:
        >>> import cdsm
        >>> round(cdsm.Tolerance.within(1e-4).standard, 9)
        5.7735e-05
    """

    standard: float
    _: KW_ONLY
    distribution: Distribution = "normal"
    correlation: float = 0.0
    of: str = EVERY

    def __post_init__(self) -> None:
        standard = scalar("standard", self.standard)
        rho = scalar("correlation", self.correlation)
        if standard < 0.0:
            raise InvalidInput("standard", f"{standard:g} given; a tolerance is not negative.")
        if not 0.0 <= rho <= 1.0:
            raise InvalidInput("correlation", f"{rho:g} given; a number from 0 to 1 is needed.")
        one_of("distribution", self.distribution, get_args(Distribution))
        self.__dict__.update(standard=standard, correlation=rho, of=text("of", self.of))

    @classmethod
    def within(cls, half_width: float, *, correlation: float = 0.0, of: str = EVERY) -> Self:
        """Return the tolerance of values surely within ±a: `u = a/√3` (JCGM 100, 4.3.7)."""
        standard = scalar("half_width", half_width) / math.sqrt(3.0)
        return cls(standard, distribution="uniform", correlation=correlation, of=of)


OneOrMore = float | Tolerance | Sequence[Tolerance]
"""Types of a source of :class:`Tolerances`: a standard uncertainty, or one or more tolerances."""


@final
@dataclass(frozen=True, init=False, repr=False)
class Tolerances:
    """Uncertainties of the dimensions of an arm and of the values measured on it.

    A source is a standard uncertainty (one sigma) as a number, a :class:`Tolerance`, or a list of
    tolerances, each for the inputs that its ``of`` names. A number for ``rigidity``,
    ``joint_stiffness``, ``bending_stiffness``, ``motor_stiffness`` or ``friction`` has the
    correlation 1, since cables are of one spool, a backbone is one rod, motors are of one kind and
    disks of one material; other numbers have the correlation 0. ``tolerances.lead`` is the tuple of
    the tolerances of a source that are not zero.

    Args:
        rigidity: EA of the law of each cable; relative [-].
        spring: `k_series` in series with each cable, such as its anchor or drive; relative [-].
        joint_stiffness: k of the spring of each joint, those of beams included; relative [-]. Of a
            spring with a law, it is that of all torques.
        exponent: Exponent of each spring with a law that is a power [-].
        bending_stiffness: EI of each neck, gap or link that bends; relative [-].
        joint_angle: Angle of each joint that turns [rad].
        joint_position: Coordinate of each joint that slides [m].
        tension: Each measured cable tension [N].
        lead: Straight length of each cable before the base disk [m].
        pulley_radius: Radius of the pulleys of each cable [m], one error for all of a cable.
        slack: Wire that each motor takes in before its cable pulls [m].
        gain: Wire taken in per pull that each motor reports [-].
        motor_stiffness: `k_m` of each motor that has one; relative [-].
        hole_radius: Distance of each hole from the axis of its link [m].
        hole_angle: Angle of each hole about the axis of its link [rad].
        disk_offset: Distance of each disk from its joint [m]; place of a backbone's disk.
        link_length: Length of each link [m]; of a backbone, of each gap before a disk.
        link_mass: Mass of each link [kg]; of a backbone, of each disk with the gap before it.
        friction: Coefficient μ of each hole with friction [-].
        site: Each coordinate of each cable site [m]; for an arm from a URDF, instead of its holes.

    Raises InvalidInput if one is negative, not a number, or larger than a plausible error.

    Example:
        >>> import cdsm
        >>> tolerances = cdsm.Tolerances(tension=0.5, hole_radius=cdsm.Tolerance.within(1e-4))
        >>> list(tolerances.given)
        ['tension', 'hole_radius']
    """

    _pairs: tuple[tuple[str, tuple[Tolerance, ...]], ...]

    def __init__(self, **errors: OneOrMore) -> None:
        checked = {name: _checked(name, value) for name, value in errors.items()}
        pairs = [(name, checked[name]) for name in sources() if checked.get(name)]
        object.__setattr__(self, "_pairs", tuple(pairs))

    def replace(self, **errors: OneOrMore) -> Tolerances:
        """Return tolerances with other ones of these sources: ``tolerances.replace(lead=1e-3)``."""
        return Tolerances(**{**self.given, **errors})

    @property
    def given(self) -> Mapping[str, tuple[Tolerance, ...]]:
        """All tolerances that are not zero, by source of uncertainty."""
        return dict(self._pairs)

    def __getattr__(self, name: str) -> tuple[Tolerance, ...]:
        if name.startswith("_") or name not in sources():
            raise AttributeError(f"Tolerances have no source {name!r}")
        return self.given.get(name, ())

    def __repr__(self) -> str:
        return f"Tolerances({', '.join(f'{name}={parts}' for name, parts in self.given.items())})"

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Tolerances:
        """Read tolerances from a TOML file of their own, or from ``[tolerances]`` of an ARM.toml.

        Each key is a source. Its value is a standard uncertainty, or a table with ``standard`` or
        ``within`` (a half-width), ``distribution``, ``correlation`` and ``of``, or a list of such
        tables. FileError, with every fault, if there are none that can be read.
        """
        try:
            table = read_toml(read_text(path))
            tolerances = table.get("tolerances", table)
            return tolerances_from(tolerances if isinstance(tolerances, dict) else table)
        except GeometryError as error:
            faults = listed(error.faults, 20, LINES)
            raise FileError(path, f"does not hold tolerances:{faults}") from None

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write a TOML file from which :meth:`read` builds equal tolerances, or FileError."""
        head = "# Tolerances of an arm, one sigma: rad, m, N, kg; rigidity and springs relative.\n"
        return write_text(path, head + "\n" + toml_text(tolerance_table(self)))


def _checked(name: str, value: Any) -> tuple[Tolerance, ...]:
    """Return the tolerances of a source that are not zero; InvalidInput names the source."""
    source = sources()[one_of("source of uncertainty", name, sources())]
    try:
        if not isinstance(value, (list, tuple, Tolerance)):
            value = Tolerance(value, correlation=float(source.is_common))
        one_or_more = [value] if isinstance(value, Tolerance) else value
        tolerances = sequence_of("tolerances", one_or_more, Tolerance)
    except InvalidInput as error:
        raise InvalidInput(name, str(error).removeprefix("standard: ")) from None
    u = max([0.0, *(tolerance.standard for tolerance in tolerances)])
    if u > source.largest:
        unit = "relative" if source.is_relative else f"in {source.unit.si or 'the number itself'}"
        problem = f"a standard uncertainty of {u:g} given; up to {source.largest:g} is a tolerance"
        raise InvalidInput(name, f"{problem}. It is {unit}.")
    return tuple(tolerance for tolerance in tolerances if tolerance.standard)


@record
class _Entry:
    """A tolerance as a table in TOML; the default of ``correlation`` depends on the source."""

    standard: Number | None = None
    within: Number | None = None
    distribution: Distribution | None = None
    correlation: Number | None = None
    of: str = EVERY

    def built(self, source: str) -> Tolerance:
        rho = self.correlation
        if rho is None:
            rho = float(sources()[source].is_common)
        if self.standard is not None and self.within is None:
            kind = self.distribution or "normal"
            return Tolerance(self.standard, distribution=kind, correlation=rho, of=self.of)
        if self.within is None or self.standard is not None:
            raise InvalidInput(source, "give one of standard and within.")
        if self.distribution == "normal":
            raise InvalidInput(source, "within is uniform; give standard with normal.")
        return Tolerance.within(self.within, correlation=rho, of=self.of)


def tolerances_from(table: Mapping[str, Any]) -> Tolerances:
    """Build tolerances from a parsed TOML table; raise GeometryError that lists every fault."""
    if not isinstance(table, Mapping):
        raise GeometryError([f"is {table!r}; give a table [tolerances]"])
    read = {}
    faults = []
    for name, value in table.items():
        try:
            one_of("source of uncertainty", name, sources())
            if isinstance(value, (dict, list)):
                tables = [value] if isinstance(value, dict) else value
                value = [parse(_Entry, entry).built(name) for entry in tables]
            read[name] = _checked(name, value)
        except GeometryError as error:
            faults += [f"{name}.{fault}" for fault in error.faults]
        except CdsmError as error:
            faults.append(f"{name}: {str(error).removeprefix(f'{name}: ')}")
    if faults:
        raise GeometryError(faults)
    return Tolerances(**read)


def tolerance_table(tolerances: Tolerances) -> dict[str, list[dict[str, Any]]]:
    """Return the table of TOML from which :func:`tolerances_from` builds equal tolerances."""
    tables = {name: map(vars, parts) for name, parts in tolerances.given.items()}
    usual = "normal", EVERY
    return {
        name: [{key: x for key, x in part.items() if x not in usual} for part in parts]
        for name, parts in tables.items()
    }
