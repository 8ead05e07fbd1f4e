"""Elasticity of the cable material: axial rigidity EA [N] as a function of tension [N].

A cable of unstretched length l_0 under tension F has the stiffness dF/dL = EA(F)/l_0. EA is the
*tangent* rigidity. This module is independent of the robot.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import ElasticityRangeError, InvalidInput
from cdsm.support.roots import rising_root
from cdsm.support.validation import RANGES, flag, number_array, quantity, scalar
from cdsm.support.values import Array

if TYPE_CHECKING:
    import os
    from pathlib import Path

    from matplotlib.figure import Figure

_STEP = 6e-6
"""Relative step of central differences: the cube root of the rounding of float64."""


@final
@dataclass(frozen=True)
class Domain:
    """Range of tensions [N] on which an elasticity is defined; iterates as (low, high).

    Attributes:
        low: Smallest tension [N].
        high: Largest tension [N], included unless infinite.
        low_included: Whether ``low`` belongs to the domain.

    Raises:
        InvalidInput: Not two numbers with 0 <= low < high, or ``low_included`` is not a bool.
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
        """Smallest tension in the domain [N]: ``low``, or the next float64 above ``low``."""
        return self.low if self.low_included else math.nextafter(self.low, math.inf)

    def check(self, tension: ArrayLike) -> Array:
        """Return the tensions as a float array of the same shape; check that all are in the domain.

        Args:
            tension: F [N], any shape.

        Raises:
            InvalidInput: ``tension`` is not finite numbers.
            ElasticityRangeError: Some tensions are outside the domain; the error lists them.
        """
        values = number_array("tension", tension)
        outside = values <= self.low if not self.low_included else values < self.low
        outside |= values > self.high
        if np.count_nonzero(outside):
            raise ElasticityRangeError(
                f"outside the domain {self} of the elasticity. Keep the tension inside it "
                "(minimum=, maximum=), or use an elasticity that covers it; slack_below() continues"
                " one to 0 N.",
                np.atleast_1d(values)[np.atleast_1d(outside)].tolist(),
                np.flatnonzero(outside).tolist(),
            )
        return values


class Elasticity(ABC):
    """Axial elasticity of a cable. All methods take any shape and return the same shape.

    A user-defined law must define :attr:`domain`, :meth:`rigidity`, :meth:`strain` and
    :meth:`energy`. The rigidity must be positive and continuous; its slope may jump.
    :class:`~cdsm.Manipulator` samples the rigidity and refuses a law if it finds a jump of more
    than 0.01 %.
    """

    @property
    @abstractmethod
    def domain(self) -> Domain:
        """Tensions [N] for which the elasticity is defined."""

    @staticmethod
    def read(path: str | os.PathLike[str]) -> Elasticity:
        """Read an elasticity from a TOML file, as :func:`~cdsm.read_elasticity`.

        Raises:
            FileError: The file cannot be read or does not describe an elasticity.
        """
        from cdsm.wires.files import read_elasticity  # which imports this module

        return read_elasticity(path)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the elasticity to a TOML file, as :func:`~cdsm.write_elasticity`; return its path.

        Raises:
            InvalidInput: A file cannot hold an elasticity of this kind.
            FileError: The file cannot be written.
        """
        from cdsm.wires.files import write_elasticity  # which imports this module

        return write_elasticity(self, path)

    def plot(self) -> Figure:
        """Plot tangent and secant rigidity [kN] over the tension [N]."""
        from cdsm.plots import plot_elasticity  # matplotlib imports slowly

        return plot_elasticity(self)

    @property
    def rest(self) -> float:
        """Tension [N] at which the strain is zero: the low end of :attr:`domain`."""
        return self.domain.low

    def slack_below(self) -> Elasticity:
        """Return this law with a slack branch: it is continued down to zero tension.

        Below the low end F_0 of this law, EA keeps its value EA(F_0), so it stays continuous and
        positive. Strains count from F_0 as before, so answers within the law stay the same. Below
        it ε = (F − F_0)/EA(F_0) is negative. The cable is slack at ε = −F_0/EA(F_0), and below.

        The branch is an assumption; no tensile test has measured it. The strand of Eq. 19 has
        EA = 16.4 N from 2.2 N down and is slack after shortening by 13 %: it is that soft where
        its polynomial begins. A law that begins at zero is returned as it is.

        Raises:
            InvalidInput: The wire would be shorter than half its length when it is slack.
        """
        from cdsm.wires.slack import SlackBelow

        return self if 0.0 in self.domain else SlackBelow(self)

    @abstractmethod
    def rigidity(self, tension: ArrayLike) -> Array:
        """Compute the tangent rigidity EA(F) = l_0 dF/dΔl [N]; K_L uses it (caption of Fig. 5).

        Args:
            tension: F [N], any shape.

        Raises:
            ElasticityRangeError: A tension is outside :attr:`domain`, or the law has no positive
                rigidity there.
        """

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        """Compute dEA/dF [-], the slope of the tangent rigidity.

        By default it is the central difference over F ± 6e-6 max(F, 1 N), with about ten correct
        digits. Near an end of :attr:`domain` the difference is one-sided. A law may override it.

        Args:
            tension: F [N], any shape.

        Raises:
            ElasticityRangeError: A tension is outside :attr:`domain`.
        """
        values = self.domain.check(tension)
        step = _STEP * np.maximum(values, 1.0)
        before = np.maximum(values - step, self.domain.first)
        after = np.minimum(values + step, self.domain.high)
        return np.asarray((self.rigidity(after) - self.rigidity(before)) / (after - before))

    @abstractmethod
    def strain(self, tension: ArrayLike) -> Array:
        """Compute the strain Δl/l_0 = ∫ dF/EA(F) [-] from :attr:`rest`, the domain's low end.

        Args:
            tension: F [N], any shape.

        Raises:
            ElasticityRangeError: As for :meth:`rigidity`.
        """

    @abstractmethod
    def energy(self, tension: ArrayLike) -> Array:
        """Compute the elastic energy ∫ F dε = ∫ F dF/EA(F) [N] = [J/m] per unstretched metre.

        It starts at :attr:`rest`, like :meth:`strain`.

        Args:
            tension: F [N], any shape.

        Raises:
            ElasticityRangeError: As for :meth:`rigidity`.
        """

    def tension(self, strain: ArrayLike) -> Array:
        """Compute the tension F [N] at a strain: the inverse of :meth:`strain`.

        Args:
            strain: Δl/l_0 [-] from :attr:`rest`, any shape.

        Raises:
            InvalidInput: ``strain`` is not numbers.
            ElasticityRangeError: No tension of the domain gives one of the strains.
        """
        wanted = number_array("strain", strain)
        return tension_at(
            wanted, self.domain, self.strain, lambda F: 1.0 / self.rigidity(F), "strain"
        )

    def secant_rigidity(self, tension: ArrayLike) -> Array:
        """Compute the secant rigidity ΔF/(Δl/l_0) [N] of Eq. 18 from :attr:`rest`.

        It equals :meth:`rigidity` there, and everywhere if EA is constant. Argument and
        errors are those of :meth:`rigidity`.
        """
        values = self.domain.check(tension)
        strain = self.strain(values)
        secant = np.array(self.rigidity(values))
        np.divide(values - self.rest, strain, out=secant, where=strain != 0.0)
        return secant


_ALL_TENSIONS = Domain(0.0, math.inf)


@final
@dataclass(frozen=True, init=False, repr=False)
class LinearElasticity(Elasticity):
    """Elasticity with constant EA: a solid wire, or a strand in its elastic stage.

    Args:
        rigidity: EA [N].

    Raises:
        InvalidInput: EA is not a number, or is outside its range in :data:`RANGES`.
    """

    _rigidity: float

    def __init__(self, rigidity: float) -> None:
        object.__setattr__(self, "_rigidity", quantity("rigidity", rigidity, "rigidity"))

    def __repr__(self) -> str:
        return f"LinearElasticity(rigidity={self._rigidity!r})"

    @classmethod
    def of_wire(cls, young_modulus: float, diameter: float) -> LinearElasticity:
        """Compute EA = E π d²/4 of a solid round wire.

        Args:
            young_modulus: E [Pa].
            diameter: d [m].

        Raises:
            InvalidInput: E or d is not a positive finite number.
        """
        for name, value in (("young_modulus", young_modulus), ("diameter", diameter)):
            if scalar(name, value) <= 0.0:
                raise InvalidInput(name, f"{value:g} given; it must be positive.")
        return cls(young_modulus * math.pi * (diameter * diameter) / 4.0)

    @property
    def domain(self) -> Domain:
        """All tensions: [0 N, inf N)."""
        return _ALL_TENSIONS

    def rigidity(self, tension: ArrayLike) -> Array:
        """Return EA [N] for every tension; see :meth:`Elasticity.rigidity`."""
        rigidity = self.domain.check(tension)
        rigidity.fill(self._rigidity)
        return rigidity

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        """Return zero [-]; see :meth:`Elasticity.rigidity_slope`."""
        return np.zeros_like(self.domain.check(tension))

    def strain(self, tension: ArrayLike) -> Array:
        """Compute F/EA [-]; see :meth:`Elasticity.strain`."""
        return self.domain.check(tension) / self._rigidity

    def energy(self, tension: ArrayLike) -> Array:
        """Compute F²/(2 EA) [N]; see :meth:`Elasticity.energy`."""
        return np.asarray(self.domain.check(tension) ** 2 / (2.0 * self._rigidity))


_ROUNDING = 1e-15
"""Relative rounding of a strain: a few units in the last place."""

# denser at the low end, where most laws are soft; the first and last points are exactly 0 and 1
_GRID = np.linspace(0.0, 1.0, 25) ** 3


def tension_at(
    wanted: Array,
    domain: Domain,
    stretch: Callable[[Array], Array],
    slope: Callable[[Array], Array],
    name: str,
) -> Array:
    """Find the tensions F [N] at which a rising function stretch(F) has the wanted values.

    ``wanted`` is a strain [-] or an elongation [m] of any shape; the error calls it ``name``.
    ``stretch`` is zero or less at the low end of ``domain``, and ``slope`` is its derivative. If no
    tension of the domain gives one of the values, ElasticityRangeError is raised.
    """
    low, high, most = *domain, RANGES["tension"].high
    if math.isinf(high):  # an unbounded law: search only as far as needed
        high = max(1.0, 2.0 * low)
        while float(stretch(np.array(high))) < wanted.max(initial=0.0) and high < most:
            high = min(2.0 * high, most)
    grid = np.maximum(low + (high - low) * _GRID, domain.first)
    grid[-1] = high  # low + (high - low) may differ from high by rounding
    reached = stretch(grid)
    # a law's last digit may depend on the array size, and ``high`` belongs to the domain
    outside = (wanted < min(reached[0], 0.0)) | (wanted > reached[-1] * (1.0 + _ROUNDING))
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
