"""Tolerance of inputs of one kind, such as hole radii: standard uncertainty and distribution."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Literal, Self, final, get_args

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.support.validation import number_array, one_of, scalar, text
from cdsm.support.values import Array, ReadOnlyState, frozen

Distribution = Literal["normal", "uniform", "triangular"]

WIDTH = {"uniform": math.sqrt(3.0), "triangular": math.sqrt(6.0)}
"""Half-width of each bounded distribution, divided by its standard deviation [-]."""

EVERY = "*"
"""Pattern of the names of all inputs."""


@final
@dataclass(frozen=True, eq=False, repr=False)
class Tolerance(ReadOnlyState):
    """Standard uncertainty of inputs of one kind, e.g. of the radius of every hole.

    Attributes:
        standard: Standard uncertainty u (one sigma) of each input: [rad], [m], [N], [kg], or [-].
            A rigidity may have one value for each of ``tensions``, shape (n,) [-]; between them, u
            is interpolated linearly.
        distribution: ``"normal"``, ``"uniform"`` or ``"triangular"``. Only Monte Carlo needs it.
        correlation: Correlation ρ of every two inputs [-]: 0 if their errors are independent, 1 if
            all inputs have the same error. Or a correlation matrix (n, n) of the n inputs.
        of: Names of the inputs that have this tolerance, as a pattern: ``"cable1_*"``. Default all.
        tensions: Ascending tensions (n,) [N] at which ``standard`` (n,) is given; None: one value.

    Raises:
        InvalidInput: ``standard`` is negative or not a number; ``correlation`` is not between 0 and
            1, or is a matrix that is not symmetric, has no ones on its diagonal, or is not positive
            semidefinite; ``tensions`` are not ascending, or not as many as the standards.
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

        a is ``half_width``. The standard uncertainty is a/√3 (uniform) or a/√6 (triangular); JCGM
        100, 4.3.7 and 4.3.9.

        Args:
            half_width: a, in the unit of the inputs.
            distribution: ``"uniform"`` or ``"triangular"``.
            correlation: As for :class:`Tolerance`.
            of: As for :class:`Tolerance`.

        Raises:
            InvalidInput: ``half_width`` is negative or not a number; or see :class:`Tolerance`.
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
        """Return the standard uncertainty: one number, or (C,) if it depends on tension.

        ``tension`` (C,) are the tensions of the cables [N].

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
        """Return the matrix R (n, n) of the correlations of n = ``count`` inputs.

        Raises InvalidInput if :attr:`correlation` is a matrix of another size.
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
        """Compute the variance vᵀ R v of the sum of n correlated errors.

        v (n,) is ``values``: the standard deviations of the errors, with their signs in the sum. R
        is :meth:`matrix`. For one correlation ρ, vᵀ R v = (1 − ρ) v·v + ρ (Σ v)². Raises
        InvalidInput if the size of R is not n.
        """
        rho = self.correlation
        if isinstance(rho, float):
            common = rho * float(values.sum()) ** 2 if rho else 0.0
            return (1.0 - rho) * float(values @ values) + common
        return max(float(values @ self.matrix(values.size) @ values), 0.0)

    def __repr__(self) -> str:
        given = [f"standard={self.standard!r}"]
        for field in fields(self)[1:]:
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray) or value != field.default:
                given.append(f"{field.name}={value!r}")
        return f"Tolerance({', '.join(given)})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Tolerance) and all(
            np.array_equal(getattr(self, field.name), getattr(other, field.name))
            for field in fields(self)
        )

    def __hash__(self) -> int:
        return hash((self.distribution, self.of))


def _correlation(value: object) -> float | Array:
    """Check one correlation or a matrix (n, n); return a float, or the matrix as read-only."""
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
