"""How stiff the cable material is: axial rigidity EA [N] as a function of tension [N].

A cable of free length l_0 under tension F has the stiffness dF/dL = EA(F)/l_0, where EA is the
*tangent* rigidity. Nothing here knows of a robot.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import ElasticityRangeError, InvalidInput
from cdsm.support.validation import RANGES, flag, number_array, quantity, scalar
from cdsm.support.values import Array

_STEP = 6e-6
"""Relative step of central differences: the cube root of the rounding of float64."""


@final
@dataclass(frozen=True)
class Domain:
    """The tensions [N] an elasticity is defined on; iterates as (low, high).

    Attributes:
        low: Smallest tension [N].
        high: Largest tension [N], included unless infinite.
        low_included: Whether ``low`` itself belongs to the domain.

    Raises:
        InvalidInput: Not two numbers with 0 <= low < high, or ``low_included`` no flag.
    """

    low: float
    high: float
    low_included: bool = True

    def __post_init__(self) -> None:
        low = quantity("low", self.low, "tension", zero=True)
        high = quantity("high", self.high, "tension", infinite=True)
        flag("low_included", self.low_included)
        if not low < high:
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

    @property
    def first(self) -> float:
        """Smallest tension that belongs to it [N]: ``low``, or the next number above."""
        return self.low if self.low_included else math.nextafter(self.low, math.inf)

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
    """Axial elasticity of a cable. All methods take any shape and return the same shape.

    A law of your own defines :attr:`domain`, :meth:`rigidity`, :meth:`strain` and :meth:`energy`.
    Its rigidity must be positive and continuous; it may bend sharply. :class:`~cdsm.Manipulator`
    samples it and refuses a jump of more than 0.01 % that it finds.
    """

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

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        r"""dEA/dF [-]: how the tangent rigidity grows with tension.

        Unless a law knows better, the central difference over F ± 6e-6 max(F, 1 N), good for some
        ten digits. Beside an end of :attr:`domain` it is one-sided.

        Args:
            tension: F [N], any shape.

        Raises:
            ElasticityRangeError: A tension outside :attr:`domain`.
        """
        values = self.domain.check(tension)
        step = _STEP * np.maximum(values, 1.0)
        before = np.maximum(values - step, self.domain.first)
        after = np.minimum(values + step, self.domain.high)
        return np.asarray((self.rigidity(after) - self.rigidity(before)) / (after - before))

    @abstractmethod
    def strain(self, tension: ArrayLike) -> Array:
        r"""Strain Δl/l_0 = ∫ dF/EA(F) [-] since the low end of the domain.

        Args:
            tension: F [N], any shape.

        Raises:
            ElasticityRangeError: As for :meth:`rigidity`.
        """

    @abstractmethod
    def energy(self, tension: ArrayLike) -> Array:
        r"""Elastic energy ∫ F dε = ∫ F dF/EA(F) [N] = [J/m] per metre of free length.

        Counted, like :meth:`strain`, from the low end of the domain.

        Args:
            tension: F [N], any shape.

        Raises:
            ElasticityRangeError: As for :meth:`rigidity`.
        """

    def tension(self, strain: ArrayLike) -> Array:
        r"""Tension F [N] at a strain: the inverse of :meth:`strain`.

        Args:
            strain: Δl/l_0 [-] since the low end of the domain, any shape.

        Raises:
            InvalidInput: Not numbers.
            ElasticityRangeError: A strain that no tension of the domain gives.
        """
        wanted = number_array("strain", strain)
        return tension_at(
            wanted, self.domain, self.strain, lambda F: 1.0 / self.rigidity(F), "strain"
        )

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
        InvalidInput: EA is not a number, or outside its range in :data:`RANGES`.
    """

    _rigidity: float

    def __init__(self, rigidity: float) -> None:
        object.__setattr__(self, "_rigidity", quantity("rigidity", rigidity, "rigidity"))

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

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        """Zero [-]; see :meth:`Elasticity.rigidity_slope`."""
        return np.zeros_like(self.domain.check(tension))

    def strain(self, tension: ArrayLike) -> Array:
        """F/EA [-]; see :meth:`Elasticity.strain`."""
        return self.domain.check(tension) / self._rigidity

    def energy(self, tension: ArrayLike) -> Array:
        """F²/(2 EA) [N]; see :meth:`Elasticity.energy`."""
        return np.asarray(self.domain.check(tension) ** 2 / (2.0 * self._rigidity))


_ROUNDING = 1e-15
"""Relative rounding of a strain: a few units in the last place."""

# denser at the low end, where most laws are soft; ends exactly at 0 and 1
_GRID = np.linspace(0.0, 1.0, 25) ** 3


def tension_at(
    wanted: Array,
    domain: Domain,
    stretch: Callable[[Array], Array],
    slope: Callable[[Array], Array],
    name: str,
) -> Array:
    """Tensions F [N] at which a rising stretch(F), zero at the low end, has the wanted values.

    Args:
        wanted: Strain [-] or elongation [m], any shape.
        domain: Tensions to look in.
        stretch: The rising law.
        slope: Its derivative by F.
        name: What is wanted, for the error.

    Raises:
        ElasticityRangeError: No tension of the domain gives one of the values.
    """
    low, high, most = *domain, RANGES["tension"].high
    if math.isinf(high):  # as far as is needed: an unbounded law stretches without end
        high = max(1.0, 2.0 * low)
        while float(stretch(np.array(high))) < wanted.max(initial=0.0) and high < most:
            high = min(2.0 * high, most)
    grid = np.maximum(low + (high - low) * _GRID, domain.first)
    grid[-1] = high  # which low + (high - low) may miss by rounding
    reached = stretch(grid)
    # one tension alone may give another last digit than among many, and the end belongs to it
    outside = (wanted < 0.0) | (wanted > reached[-1] * (1.0 + _ROUNDING))
    if outside.any():
        first = np.atleast_1d(wanted)[np.atleast_1d(outside)][0]
        raise ElasticityRangeError(
            f"no tension of the domain {domain} gives the {name} {first:.6g}; it reaches "
            f"{reached[-1]:.6g}.",
            [high],
            np.flatnonzero(outside).tolist(),
        )
    above = np.searchsorted(reached[1:-1], wanted) + 1
    guess = np.interp(wanted, reached, grid)
    return rising_root(wanted, guess, grid[above - 1], grid[above], stretch, slope)[0]


def rising_root(
    wanted: Array,
    guess: Array,
    lower: Array,
    upper: Array,
    stretch: Callable[[Array], Array],
    slope: Callable[[Array], Array],
) -> tuple[Array, Array]:
    """Tensions F [N] between bounds at which a rising stretch(F) has the wanted values, and slope.

    Newton's method inside a shrinking bracket, so that it converges for every rising law. All
    arrays have one shape; an upper bound may be infinite.

    scipy has nothing as fast: of 15 cables of the 1×19 strand, from 2 % beside the root, this takes
    a thirteenth of the time of ``scipy.optimize.elementwise.find_root`` (scipy 1.17), which has no
    derivative to use, and an eleventh of that of ``brentq``, cable by cable.
    """
    first, last, previous = lower, upper, np.full(np.shape(wanted), math.inf)
    guess = np.minimum(np.maximum(guess, first), last)
    for _ in range(200):  # bisection alone would take 60
        error, rise = np.asarray(stretch(guess)) - wanted, slope(guess)
        step = error / rise
        converged = abs(step) <= 1e-13 * np.maximum(guess, 1.0)  # rounding is near
        if converged.all():
            break
        lower = np.where(error <= 0.0, guess, lower)
        upper = np.where(error >= 0.0, guess, upper)
        newton = guess - step
        # where the law is nearly upright, Newton's method may cycle inside the bracket
        cycling = ~converged & (abs(step) > previous / 2.0) & np.isfinite(upper)
        halve = cycling | (newton < lower) | (newton > upper)
        following = np.where(halve, (lower + upper) / 2.0, newton)
        previous = abs(following - guess)
        guess = np.minimum(np.maximum(following, first), last)
    return np.asarray(guess), np.asarray(rise)
