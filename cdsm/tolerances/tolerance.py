"""Tolerances of what an arm is built from and of what is measured on it, and their TOML file."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal, Self, final, get_args

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import CdsmError, FileError, InvalidInput
from cdsm.support.files import read_text
from cdsm.support.records import read_toml
from cdsm.support.validation import number_array, one_of, scalar
from cdsm.support.values import Array, ReadOnlyState, frozen

Distribution = Literal["normal", "uniform", "triangular"]

_LARGEST = {"rigidity": 0.5, "joint_angle": 0.5, "hole_angle": 0.5}
"""Largest standard uncertainty that is a tolerance: half of EA, or half a radian."""

WIDTH = {"uniform": math.sqrt(3.0), "triangular": math.sqrt(6.0)}
"""Half-width of each bounded distribution over its standard deviation."""


@final
@dataclass(frozen=True, eq=False)
class Tolerance(ReadOnlyState):
    """Standard uncertainty of all inputs of one kind, e.g. of the radius of every hole.

    Attributes:
        standard: Standard uncertainty u (one sigma) of each input: [rad], [m], [N], [kg], or [-].
        distribution: ``"normal"``, ``"uniform"`` or ``"triangular"``. Only Monte Carlo needs it.
        correlation: Correlation ρ of every two inputs [-]: 0, each input has an error of its own;
            1, all have the same error. Or a correlation matrix (n, n) of the n inputs.

    Raises:
        InvalidInput: ``standard`` is negative or not a number; ``correlation`` is not between 0 and
            1, or is a matrix that is not symmetric, has no ones on its diagonal, or is not positive
            semidefinite.
        UnknownName: ``distribution`` is unknown.
    """

    standard: float
    distribution: Distribution = "normal"
    correlation: float | Array = 0.0

    def __post_init__(self) -> None:
        standard = scalar("standard", self.standard)
        if standard < 0.0:
            raise InvalidInput("standard", f"{standard:g} given; a tolerance is not negative.")
        one_of("distribution", self.distribution, get_args(Distribution))
        self.__dict__.update(standard=standard, correlation=_correlation(self.correlation))

    @classmethod
    def within(
        cls,
        half_width: float,
        distribution: Distribution = "uniform",
        correlation: float | ArrayLike = 0.0,
    ) -> Self:
        """Return the tolerance of inputs that are surely within ±a of their value.

        The standard uncertainty is a/√3 (uniform) or a/√6 (triangular); JCGM 100, 4.3.7 and 4.3.9.

        Args:
            half_width: a, in the unit of the inputs.
            distribution: ``"uniform"`` or ``"triangular"``.
            correlation: As for :class:`Tolerance`.

        Raises:
            InvalidInput: ``half_width`` is negative or not a number, or as for :class:`Tolerance`.
            UnknownName: ``distribution`` is neither of the two.
        """
        width = WIDTH[one_of("distribution of half-widths", distribution, WIDTH)]
        return cls(scalar("half_width", half_width) / width, distribution, correlation)  # type: ignore[arg-type]

    def spread(self, sensitivity: Array) -> Array:
        """Compute σ² R g (n,) of partial derivatives g (n,) and the correlations R of the inputs.

        gᵀ σ² R g is the variance that they cause (JCGM 100, Eq. 13). With one ρ for all pairs, R g
        is (1 − ρ) g + ρ Σ g.

        Raises:
            InvalidInput: The matrix of correlations is for another number of inputs.
        """
        g = sensitivity
        if isinstance(self.correlation, float):
            correlated = (1.0 - self.correlation) * g + self.correlation * g.sum()
        else:
            correlated = self.matrix(g.size) @ g
        return np.asarray(self.standard**2 * correlated)

    def matrix(self, count: int) -> Array:
        """Return the correlations (n, n) of n inputs.

        Args:
            count: n.

        Raises:
            InvalidInput: The matrix of correlations is for another number of inputs.
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

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Tolerance)
            and (self.standard, self.distribution) == (other.standard, other.distribution)
            and np.array_equal(self.correlation, other.correlation)
        )

    def __hash__(self) -> int:
        return hash((self.standard, self.distribution))


@final
@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """Tolerances of an arm: how far it may be from what was described and measured.

    Each source is a :class:`Tolerance`, or a standard uncertainty (one sigma) as a number. A number
    for ``rigidity`` has the correlation 1: all cables are of one spool. Other numbers have the
    correlation 0: each joint, hole, disk and link has an error of its own.

    Attributes:
        rigidity: Of EA of each cable's law, relative [-].
        joint_angle: Of each joint angle [rad]; [m] where a joint slides.
        tension: Of each measured cable tension [N].
        lead: Of each cable's straight length before the base disk [m].
        hole_radius: Of the distance of each hole from the axis of its link [m].
        hole_angle: Of the angle of each hole about the axis of its link [rad].
        disk_offset: Of the distance of each disk from its joint [m].
        link_length: Of each link [m].
        link_mass: Of each link [kg].
        site: Of each coordinate of each cable site [m]. For arms from a URDF, which have no holes.

    Raises:
        InvalidInput: A tolerance is negative or not a number, or is so large that it is none.
    """

    rigidity: float | Tolerance = 0.0
    joint_angle: float | Tolerance = 0.0
    tension: float | Tolerance = 0.0
    lead: float | Tolerance = 0.0
    hole_radius: float | Tolerance = 0.0
    hole_angle: float | Tolerance = 0.0
    disk_offset: float | Tolerance = 0.0
    link_length: float | Tolerance = 0.0
    link_mass: float | Tolerance = 0.0
    site: float | Tolerance = 0.0

    def __post_init__(self) -> None:
        for name in SOURCES:
            value = getattr(self, name)
            try:
                if not isinstance(value, Tolerance):
                    value = Tolerance(value, correlation=float(name == "rigidity"))
            except InvalidInput as error:
                raise InvalidInput(name, str(error).removeprefix("standard: ")) from None
            largest = _LARGEST.get(name, math.inf)
            if value.standard > largest:
                raise InvalidInput(
                    name,
                    f"a standard uncertainty of {value.standard:g} given; up to {largest:g} is a "
                    f"tolerance. It is {'relative' if name == 'rigidity' else 'in rad'}.",
                )
            self.__dict__[name] = value

    @property
    def given(self) -> Mapping[str, Tolerance]:
        """All tolerances that are not zero, by source."""
        each = ((name, getattr(self, name)) for name in SOURCES)
        return {name: tolerance for name, tolerance in each if tolerance.standard > 0.0}

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Tolerances:
        """Read tolerances from a TOML file.

        Each key is a source. Its value is a standard uncertainty, or a table with ``standard`` or
        ``within`` (a half-width), ``distribution`` and ``correlation``.

        Raises:
            FileError: The file cannot be read, is not TOML, or does not hold tolerances.
        """
        text = read_text(path)
        try:
            return cls.from_table(read_toml(text))
        except CdsmError as error:
            raise FileError(path, f"does not hold tolerances: {error}") from None

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> Tolerances:
        """Build tolerances from a parsed TOML table: see :meth:`read`.

        Raises:
            UnknownName: A key is not a source, or not a key of a tolerance.
            InvalidInput: A value is not a tolerance.
        """
        found: dict[str, Any] = {}
        for name, value in table.items():
            one_of("source of uncertainty", name, SOURCES)
            found[name] = _of_table(name, value) if isinstance(value, dict) else value
        return cls(**found)


SOURCES = tuple(field.name for field in fields(Tolerances))
"""Names of all sources of uncertainty."""


def _of_table(name: str, table: dict[str, Any]) -> Tolerance:
    for key in table:
        one_of(f"key of {name}", key, ("standard", "within", "distribution", "correlation"))
    values = {"correlation": float(name == "rigidity")} | table
    if ("standard" in values) == ("within" in values):
        raise InvalidInput(name, "give one of standard and within.")
    if "within" in values:
        return Tolerance.within(values.pop("within"), **values)
    return Tolerance(**values)


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
            f"has the eigenvalue {least:.3g}; no errors are correlated so. Lower "
            "some of its entries.",
        )
    return frozen(matrix)
