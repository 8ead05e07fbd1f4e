"""How stiff the cable material is: axial rigidity EA [N] as a function of tension [N].

A cable of free length l_0 under tension F has the stiffness dF/dL = EA(F)/l_0, where EA is the
*tangent* rigidity. Nothing here knows of a robot.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import final

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike
from scipy.integrate import quad_vec

from cdsm._checks import SMALLEST, Array, number_array, scalar
from cdsm.errors import ElasticityRangeError, InvalidInput


@final
@dataclass(frozen=True)
class Domain:
    """The tensions [N] an elasticity is defined on; iterates as (low, high).

    Attributes:
        low: Smallest tension [N].
        high: Largest tension [N], included unless infinite.
        low_included: Whether ``low`` itself belongs to the domain.

    Raises:
        InvalidInput: Not two numbers with 0 <= low < high.
    """

    low: float
    high: float
    low_included: bool = True

    def __post_init__(self) -> None:
        high = self.high
        if not (isinstance(high, float) and high == math.inf):
            high = scalar("high", high)
        if not 0.0 <= scalar("low", self.low) < high:
            raise InvalidInput("low", f"0 <= low < high needed, but are {self.low}, {self.high} N.")

    def __iter__(self) -> Iterator[float]:
        return iter((self.low, self.high))

    def __contains__(self, tension: float) -> bool:
        above = tension >= self.low if self.low_included else tension > self.low
        return above and tension <= self.high

    def __str__(self) -> str:
        left = "[" if self.low_included else "("
        right = ")" if math.isinf(self.high) else "]"
        return f"{left}{self.low:g} N, {self.high:g} N{right}"

    def check(self, tension: ArrayLike) -> Array:
        """Return the tensions as a float array of the same shape if all lie in the domain.

        Args:
            tension: F [N], any shape.

        Raises:
            InvalidInput: Not finite numbers.
            ElasticityRangeError: Some lie outside; the error says which.
        """
        values = number_array("tension", tension)
        outside = values <= self.low if not self.low_included else values < self.low
        outside |= values > self.high
        if np.count_nonzero(outside):
            raise ElasticityRangeError(
                f"outside the domain {self} of the elasticity. Keep the tension inside it "
                "(minimum=, maximum=), or use an elasticity that covers it.",
                np.atleast_1d(values)[np.atleast_1d(outside)].tolist(),
                np.flatnonzero(outside).tolist(),
            )
        return values


class Elasticity(ABC):
    """Axial elasticity of a cable. All methods take any shape and return the same shape."""

    @property
    @abstractmethod
    def domain(self) -> Domain:
        """The tensions [N] for which the elasticity is defined."""

    @abstractmethod
    def rigidity(self, tension: ArrayLike) -> Array:
        r"""Tangent rigidity EA(F) = l_0 dF/dΔl [N]: what K_L is made of (caption of Fig. 5).

        Args:
            tension: F [N], any shape.

        Raises:
            ElasticityRangeError: A tension outside :attr:`domain`, or one at which the law gives no
                positive rigidity.
        """

    @abstractmethod
    def strain(self, tension: ArrayLike) -> Array:
        r"""Strain Δl/l_0 = ∫ dF/EA(F) [-] since the low end of the domain.

        Args:
            tension: F [N], any shape.

        Raises:
            ElasticityRangeError: As for :meth:`rigidity`.
        """

    def secant_rigidity(self, tension: ArrayLike) -> Array:
        r"""Secant rigidity ΔF/(Δl/l_0) [N] of Eq. 18, both Δ taken from the low end of the domain.

        Equal to :meth:`rigidity` at the low end, and everywhere if EA is constant.

        Args:
            tension: F [N], any shape.

        Raises:
            ElasticityRangeError: As for :meth:`rigidity`.
        """
        values = self.domain.check(tension)
        strain = self.strain(values)
        secant = np.array(self.rigidity(values))
        np.divide(values - self.domain.low, strain, out=secant, where=strain > 0.0)
        return secant


_ALL_TENSIONS = Domain(0.0, math.inf)


@final
@dataclass(frozen=True, init=False, repr=False)
class LinearElasticity(Elasticity):
    """EA constant: a solid wire, or a strand in its elastic stage.

    Args:
        rigidity: EA [N].

    Raises:
        InvalidInput: EA is not a positive finite number.
    """

    _rigidity: float

    def __init__(self, rigidity: float) -> None:
        value = scalar("rigidity", rigidity)
        if value < SMALLEST:
            raise InvalidInput(
                "rigidity", f"{value:g} N given; EA must be positive, at least {SMALLEST:g} N."
            )
        object.__setattr__(self, "_rigidity", value)

    def __repr__(self) -> str:
        return f"LinearElasticity(rigidity={self._rigidity!r})"

    @classmethod
    def of_wire(cls, young_modulus: float, diameter: float) -> LinearElasticity:
        """EA = E π d²/4 of a solid round wire.

        Args:
            young_modulus: E [Pa].
            diameter: d [m].

        Raises:
            InvalidInput: Either is not a positive finite number.
        """
        for name, value in (("young_modulus", young_modulus), ("diameter", diameter)):
            if scalar(name, value) <= 0.0:
                raise InvalidInput(name, f"{value:g} given; it must be positive.")
        return cls(young_modulus * math.pi * (diameter * diameter) / 4.0)

    @property
    def domain(self) -> Domain:
        """[0 N, inf N)."""
        return _ALL_TENSIONS

    def rigidity(self, tension: ArrayLike) -> Array:
        """EA [N], whatever the tension; see :meth:`Elasticity.rigidity`."""
        rigidity = self.domain.check(tension)
        rigidity.fill(self._rigidity)
        return rigidity

    def strain(self, tension: ArrayLike) -> Array:
        """F/EA [-]; see :meth:`Elasticity.strain`."""
        return self.domain.check(tension) / self._rigidity


@final
@dataclass(frozen=True)
class StrandElasticity(Elasticity):
    """EA(F) as polynomials in the tension, one per range: the form of Eq. 19.

    The polynomials are read as the *tangent* rigidity. Read as the secant of Eq. 18 they would need
    the tangent S²/(S − F S'), which is negative wherever S grows faster than F: for Eq. 19 that is
    the whole range up to 31 N, so that reading is not offered.

    Attributes:
        coefficients: One tuple per range, lowest power first [N, 1, 1/N, …].
        joins: Tension [N] at which each range ends and the next begins; a join belongs to the
            range below it. One fewer than the ranges.
        low: Low end of the domain [N], excluded.
        high: High end of the domain [N], included.

    Raises:
        InvalidInput: Numbers or their count do not fit, or the tensions do not rise.
    """

    coefficients: tuple[tuple[float, ...], ...]
    joins: tuple[float, ...]
    low: float
    high: float

    def __post_init__(self) -> None:
        if not all(isinstance(each, (list, tuple)) for each in (self.coefficients, self.joins)):
            raise InvalidInput("coefficients", "give a tuple for each range, and a tuple of joins.")
        rows = tuple(tuple(_row("coefficients", row)) for row in self.coefficients)
        joins = tuple(_row("joins", self.joins))
        edges = (scalar("low", self.low), *joins, scalar("high", self.high))
        if not rows or not all(rows):
            raise InvalidInput("coefficients", "need at least one range with one coefficient.")
        if len(joins) != len(rows) - 1:
            raise InvalidInput(
                "joins", f"{len(joins)} given for {len(rows)} ranges; {len(rows) - 1} needed."
            )
        if edges[0] < 0.0 or any(a >= b for a, b in pairwise(edges)):
            raise InvalidInput("joins", f"0 <= low < joins < high must rise, but are {edges} N.")
        object.__setattr__(self, "coefficients", rows)
        object.__setattr__(self, "joins", joins)

    @classmethod
    def eq19_repaired(cls) -> StrandElasticity:
        """Eq. 19 with its first coefficient read as −1e-4: a 1×19 strand of 1.2 mm.

        The printed −1e-3 gives −787 884 N at 31 N, where the other branch gives 11 352 N; −1e-4
        gives 10 870 N and rises all the way, so it is almost surely what was meant. Even so the
        polynomial is negative below 2.11 N and steps up by 4.4 % at 31 N, and it keeps rising to
        810 N and beyond, where the text says the strand yields: hence the domain (2.2 N, 810 N].
        """
        return cls._eq19(-1e-4)

    @classmethod
    def eq19_as_printed(cls) -> StrandElasticity:
        """Eq. 19 exactly as printed, for comparison: it has no positive rigidity from 11 to 31 N.

        See :meth:`eq19_repaired`, which is the one to compute with.
        """
        return cls._eq19(-1e-3)

    @classmethod
    def _eq19(cls, first: float) -> StrandElasticity:
        return cls(
            coefficients=(
                (-556.89, 377.99, -70.49, 8.74, -0.46, 1.12e-2, first),
                (-1924.5, 493.35, -2.26, 0.0054, -6.94e-6, 4.58e-9, -1.22e-12),
            ),
            joins=(31.0,),
            low=2.2,
            high=810.0,
        )

    @property
    def domain(self) -> Domain:
        """(low, high]."""
        return Domain(self.low, self.high, low_included=False)

    def polynomial(self, tension: ArrayLike) -> Array:
        """The bare polynomials [N], unchecked: for plots and for seeing what a misprint does.

        Args:
            tension: F [N], any shape; the outer ranges extend beyond the domain.

        Raises:
            InvalidInput: Not finite numbers.
        """
        values = number_array("tension", tension)
        piece = np.searchsorted(self.joins, values, side="left")
        result = np.empty_like(values)
        for index, row in enumerate(self.coefficients):
            here = piece == index
            result[here] = np.polyval(row[::-1], values[here])
        return result

    def rigidity(self, tension: ArrayLike) -> Array:
        """EA(F) [N] of Eq. 19; see :meth:`Elasticity.rigidity`."""
        values = self.domain.check(tension)
        result = self.polynomial(values)
        if not (result > 0.0).all():
            bad = np.flatnonzero(result <= 0.0)
            raise ElasticityRangeError(
                f"the polynomial gives {result.ravel()[bad[0]]:.6g} N, and a rigidity must be "
                "positive. If this is Eq. 19 as printed, use StrandElasticity.eq19_repaired().",
                values.ravel()[bad].tolist(),
                bad.tolist(),
            )
        return result

    def strain(self, tension: ArrayLike) -> Array:
        """∫ dF/EA(F) [-], by adaptive quadrature; see :meth:`Elasticity.strain`."""
        values = self.domain.check(tension)
        total = np.zeros_like(values)
        edges = (self.low, *self.joins, self.high)
        for row, (start, end) in zip(self.coefficients, pairwise(edges), strict=True):
            polynomial = Polynomial(row)
            upper = np.clip(values, start, end)
            self._require_positive(polynomial, start, upper)
            if upper.size == 0 or upper.max() <= start:
                continue

            def integrand(
                x: float, p: Polynomial = polynomial, start: float = start, upper: Array = upper
            ) -> Array:
                # in logarithmic steps from where EA is small: F = start + (upper - start) x³
                width = upper - start
                return np.asarray(3.0 * x**2 * width / p(start + width * x**3))

            total = total + quad_vec(integrand, 0.0, 1.0, epsabs=0.0, epsrel=1e-14, norm="max")[0]
        return np.asarray(total)

    @staticmethod
    def _require_positive(polynomial: Polynomial, start: float, upper: Array) -> None:
        """Refuse to integrate over tensions where the polynomial falls to zero or below."""
        turns = polynomial.trim().deriv().roots().real
        points = np.array([start, *turns[(turns > start) & (turns < upper.max(initial=start))]])
        scale = abs(polynomial(points)).max(initial=0.0)
        lowest = polynomial(points) <= 1e-12 * scale
        bad = polynomial(upper) <= 0.0
        if lowest.any():
            bad |= upper >= points[lowest].min()
        bad &= upper > start
        if bad.any():
            raise ElasticityRangeError(
                "the rigidity is not positive everywhere below, so there is no strain. If this is "
                "Eq. 19 as printed, use StrandElasticity.eq19_repaired().",
                np.atleast_1d(upper)[np.atleast_1d(bad)].tolist(),
                np.flatnonzero(bad).tolist(),
            )


def _row(name: str, values: ArrayLike) -> list[float]:
    numbers = number_array(name, values)
    if numbers.ndim != 1:
        raise InvalidInput(name, f"{values!r} given; a sequence of numbers is needed.")
    row: list[float] = numbers.tolist()
    return row
