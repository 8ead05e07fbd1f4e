"""Tolerances: standard uncertainties of the dimensions and measured values of an arm."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Literal, Self, final, get_args

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.support.validation import number_array, one_of, scalar, sequence_of, text
from cdsm.support.values import Array, ReadOnlyState, frozen

Distribution = Literal["normal", "uniform", "triangular"]

LARGEST = {"rigidity": 0.5, "joint_angle": 0.5, "hole_angle": 0.5, "friction": 0.5}
"""Largest allowed standard uncertainty by source: half of EA, 0.5 rad, or μ = 0.5."""

COMMON = ("rigidity", "friction")
"""Sources whose inputs share one error by default: wires of one spool, holes of one material."""

WIDTH = {"uniform": math.sqrt(3.0), "triangular": math.sqrt(6.0)}
"""Half-width of each bounded distribution, divided by its standard deviation [-]."""

EVERY = "*"
"""Pattern of the names of all inputs."""


@final
@dataclass(frozen=True, eq=False)
class Tolerance(ReadOnlyState):
    """Standard uncertainty of inputs of one kind, e.g. of the radius of every hole.

    Attributes:
        standard: Standard uncertainty u (one sigma) of each input: [rad], [m], [N], [kg], or [-].
            A rigidity may have one value for each of ``tensions``, shape (n,) [-]; between them, u
            is interpolated linearly.
        distribution: ``"normal"``, ``"uniform"`` or ``"triangular"``. Only Monte Carlo needs it.
        correlation: Correlation ρ of every two inputs [-]: 0: the errors are independent; 1: all
            inputs have the same error. Or a correlation matrix (n, n) of the n inputs.
        of: Names of the inputs that have this tolerance, as a pattern: ``"cable1_*"``. Default all.
        tensions: Rising tensions (n,) [N] at which ``standard`` (n,) is given; None: one standard.

    Raises:
        InvalidInput: ``standard`` is negative or not a number; ``correlation`` is not between 0 and
            1, or is a matrix that is not symmetric, has no ones on its diagonal, or is not positive
            semidefinite; ``tensions`` do not rise or are not as many as the standards.
        UnknownName: ``distribution`` is unknown.
    """

    standard: float | Array
    distribution: Distribution = "normal"
    correlation: float | Array = 0.0
    of: str = EVERY
    tensions: Array | None = None

    def __post_init__(self) -> None:
        one_of("distribution", self.distribution, get_args(Distribution))
        standard: float | Array
        tensions = None
        if self.tensions is None:
            standard = scalar("standard", self.standard)
        else:
            tensions, standard = (
                frozen(number_array(name, getattr(self, name))) for name in ("tensions", "standard")
            )
            if tensions.ndim != 1 or tensions.size < 2 or standard.shape != tensions.shape:
                raise InvalidInput(
                    "tensions",
                    f"shape {tensions.shape} given for standards of shape {standard.shape}; both "
                    "are (n,), with at least two tensions.",
                )
            if not (np.diff(tensions) > 0.0).all():
                raise InvalidInput("tensions", "do not rise.")
        least = float(np.min(standard))
        if least < 0.0:
            raise InvalidInput("standard", f"{least:g} given; a tolerance is not negative.")
        self.__dict__.update(
            standard=standard,
            correlation=_correlation(self.correlation),
            of=text("of", self.of),
            tensions=tensions,
        )

    @classmethod
    def within(
        cls,
        half_width: float,
        distribution: Distribution = "uniform",
        correlation: float | ArrayLike = 0.0,
        of: str = EVERY,
    ) -> Self:
        """Return the tolerance of inputs that are surely within ±a of their value.

        The standard uncertainty is a/√3 (uniform) or a/√6 (triangular); JCGM 100, 4.3.7 and 4.3.9.

        Args:
            half_width: a, in the unit of the inputs.
            distribution: ``"uniform"`` or ``"triangular"``.
            correlation: As for :class:`Tolerance`.
            of: As for :class:`Tolerance`.

        Raises:
            InvalidInput: ``half_width`` is negative or not a number, or as for :class:`Tolerance`.
            UnknownName: ``distribution`` is not one of these two.
        """
        width = WIDTH[one_of("distribution of half-widths", distribution, WIDTH)]
        return cls(scalar("half_width", half_width) / width, distribution, correlation, of)  # type: ignore[arg-type]

    @property
    def is_given(self) -> bool:
        """Whether the standard uncertainty is not zero."""
        standard = self.standard
        return standard > 0.0 if isinstance(standard, float) else bool(standard.any())

    def at(self, tension: Array) -> float | Array:
        """Return the standard uncertainty: one number, or (C,) at tensions (C,) [N] if it varies.

        Raises:
            InvalidInput: A tension is outside the range of :attr:`tensions`.
        """
        if self.tensions is None:
            return self.standard
        low, high = float(self.tensions[0]), float(self.tensions[-1])
        beyond = tension[(tension < low) | (tension > high)]
        if beyond.size:
            raise InvalidInput(
                "rigidity",
                f"its tolerance is known from {low:.4g} to {high:.4g} N, but a cable has "
                f"{beyond[0]:.4g} N. Change the tensions, or give a tolerance that covers them.",
            )
        return np.asarray(np.interp(tension, self.tensions, self.standard))

    def matrix(self, count: int) -> Array:
        """Return the correlation matrix (n, n) of n inputs.

        Args:
            count: n.

        Raises:
            InvalidInput: ``correlation`` is a matrix of another size.
        """
        if isinstance(self.correlation, float):
            return self.correlation + (1.0 - self.correlation) * np.eye(count)
        matrix = self.correlation
        if len(matrix) != count:
            raise InvalidInput(
                "correlation",
                f"is for {len(matrix)} inputs, but the arm has {count}; give one "
                "number for all pairs, or a matrix of all inputs.",
            )
        return matrix

    def variance(self, values: Array) -> float:
        """Compute vᵀ R v, R the correlation matrix (n, n), v ``values``.

        If ``correlation`` is one number ρ, vᵀ R v = (1 − ρ) v·v + ρ (Σ v)².

        Raises:
            InvalidInput: ``correlation`` is a matrix of another size.
        """
        rho = self.correlation
        if isinstance(rho, float):
            common = rho * float(values.sum()) ** 2 if rho else 0.0
            return (1.0 - rho) * float(values @ values) + common
        return max(float(values @ self.matrix(values.size) @ values), 0.0)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Tolerance) and all(
            np.array_equal(getattr(self, field.name), getattr(other, field.name))
            for field in fields(self)
        )

    def __hash__(self) -> int:
        return hash((self.distribution, self.of))


OneOrMore = float | Tolerance | Sequence[Tolerance]
"""Types of a source of :class:`Tolerances`: a standard uncertainty, or one or more tolerances."""


@final
@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """Uncertainties of the dimensions of an arm and of the values measured on it.

    Each source of uncertainty is a :class:`Tolerance`, or a standard uncertainty (one sigma) as a
    number, or a list of tolerances for different inputs, named by their ``of``. A number for
    ``rigidity`` or ``friction`` has the correlation 1: all cables are of one spool, all disks of
    one material. Other numbers have the correlation 0: the errors of all joints, holes, disks and
    links are independent.

    Attributes:
        rigidity: EA of the law of each cable; relative [-].
        joint_angle: Each joint angle [rad]; [m] where a joint slides.
        tension: Each measured cable tension [N].
        lead: Straight length of each cable before the base disk [m].
        hole_radius: Distance of each hole from the axis of its link [m].
        hole_angle: Angle of each hole about the axis of its link [rad].
        disk_offset: Distance of each disk from its joint [m].
        link_length: Length of each link [m].
        link_mass: Mass of each link [kg].
        friction: Coefficient μ of each hole with friction [-].
        site: Each coordinate of each cable site [m]. Only for arms from a URDF.

    Raises:
        InvalidInput: A tolerance is negative, not a number, or larger than a plausible error.
    """

    rigidity: OneOrMore = 0.0
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
        """Return the tolerances of a source that are not zero.

        Args:
            source: Name of the source, one of the attributes.

        Raises:
            UnknownName: There is no such source.
        """
        value = getattr(self, one_of("source of uncertainty", source, SOURCES))
        every = value if isinstance(value, tuple) else (value,)
        return tuple(each for each in every if each.is_given)

    @cached_property
    def given(self) -> Mapping[str, tuple[Tolerance, ...]]:
        """All tolerances that are not zero, by source."""
        found = {}
        for name in SOURCES:
            value = getattr(self, name)
            if isinstance(value, tuple) or value.is_given:
                found[name] = self.parts(name)
        return {name: parts for name, parts in found.items() if parts}

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Tolerances:
        """Read tolerances from a TOML file; ``[tolerances]`` of an ARM.toml has the same keys.

        Each key is a source. Its value is a standard uncertainty, or a table with ``standard`` or
        ``within`` (a half-width), ``distribution``, ``correlation``, ``of`` and ``tensions``, or a
        list of such tables.

        Raises:
            FileError: The file cannot be read, is not TOML, or does not hold tolerances. Every
                fault is listed.
        """
        from cdsm.arm_file.tolerances import read_tolerances  # pydantic: slow to import

        return read_tolerances(path)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write a TOML file from which :meth:`read` builds equal tolerances; return its path.

        Raises:
            FileError: The file cannot be written; an existing file stays unchanged.
        """
        from cdsm.arm_file.tolerances import write_tolerances

        return write_tolerances(self, path)


SOURCES = tuple(field.name for field in fields(Tolerances))
"""Names of all sources of uncertainty."""


def _require_size(source: str, tolerance: Tolerance) -> None:
    """Raise InvalidInput if a tolerance is too large, or has tensions where it must not."""
    if tolerance.tensions is not None and source != "rigidity":
        raise InvalidInput(source, "does not depend on tensions; give one standard.")
    largest = LARGEST.get(source, math.inf)
    if isinstance(tolerance.standard, float) and tolerance.standard > largest:
        unit = {"rigidity": "relative", "friction": "a coefficient"}.get(source, "in rad")
        raise InvalidInput(
            source,
            f"a standard uncertainty of {tolerance.standard:g} given; up to {largest:g} is a "
            f"tolerance. It is {unit}.",
        )


def _correlation(value: object) -> float | Array:
    """Return one correlation, or a checked, read-only matrix of correlations."""
    matrix = number_array("correlation", value)  # type: ignore[arg-type]
    if matrix.ndim == 0:
        if not 0.0 <= matrix <= 1.0:
            raise InvalidInput("correlation", f"{matrix:g} given; a number from 0 to 1 is needed.")
        return float(matrix)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise InvalidInput("correlation", f"shape {matrix.shape} given; (n, n) is needed.")
    if not (np.allclose(matrix, matrix.T) and np.allclose(matrix.diagonal(), 1.0)):
        raise InvalidInput(
            "correlation",
            "is not symmetric with ones on its diagonal; give correlations, not covariances.",
        )
    least = float(np.linalg.eigvalsh(matrix)[0])
    if least < -1e-9 * len(matrix):
        raise InvalidInput(
            "correlation",
            f"is not positive semidefinite: it has the eigenvalue {least:.3g}, and no errors are "
            "correlated so. Lower some of its entries.",
        )
    return frozen(matrix)
