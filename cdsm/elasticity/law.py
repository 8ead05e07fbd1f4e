"""The abstract law: rigidity, strain and energy of a cable as functions of its tension.

Two laws that change another law are here, too: one with a scaled rigidity, and one with a slack
branch.
"""

from __future__ import annotations

import math
import os
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final, final

import numpy as np
from numpy.typing import ArrayLike

import cdsm
from cdsm.elasticity.domain import Domain
from cdsm.elasticity.inverse import tension_at
from cdsm.errors import InvalidInput
from cdsm.support.validation import number_array, scalar
from cdsm.support.values import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_STEP = 6e-6  # relative step of central differences: the cube root of the rounding of float64

_SHORTEST: Final = 0.5
"""Least length of a slack wire, divided by its length at the low end of its law."""


class Elasticity(ABC):
    """Axial elasticity of a cable: its law EA(F).

    All methods take tensions or strains of any shape and return arrays of that shape. The law of
    a user must define :attr:`domain`, :meth:`rigidity`, :meth:`strain` and :meth:`energy`. The
    rigidity must be positive and continuous; its slope may be discontinuous.
    :class:`~cdsm.Manipulator` samples the rigidity and raises an error if it finds a discontinuity
    of more than 0.01 %.
    """

    @property
    @abstractmethod
    def domain(self) -> Domain:
        """Tensions [N] for which the elasticity is defined."""

    @staticmethod
    def read(path: str | os.PathLike[str]) -> Elasticity:
        """Read an elasticity from a TOML file; see :func:`~cdsm.read_elasticity`."""
        return cdsm.read_elasticity(path)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the elasticity to a TOML file; see :func:`~cdsm.write_elasticity`."""
        return cdsm.write_elasticity(self, path)

    def plot(self) -> Figure:
        """Plot tangent and secant rigidity [kN] against the tension [N]."""
        return cdsm.plots.plot_elasticity(self)

    @property
    def rest(self) -> float:
        """Tension [N] at which the strain is zero: by default the low end of :attr:`domain`."""
        return self.domain.low

    def slack_below(self) -> Elasticity:
        """Return this law with a slack branch: it is continued down to zero tension.

        Below the low end F_0 of this law, EA is constant, EA(F_0), so it stays continuous and
        positive. The strain is still zero at F_0, so nothing changes above F_0. Below F_0,
        ε = (F − F_0)/EA(F_0) is negative. The cable is slack at ε = −F_0/EA(F_0) and below.

        The branch is an assumption; no tensile test has measured it. The strand of Eq. 19 has
        EA = 16.4 N below 2.2 N and is slack after shortening by 13 %, since its polynomial is that
        soft at 2.2 N. A law whose domain contains zero is returned unchanged.

        Raises:
            InvalidInput: The wire would be shorter than half its length when it is slack.
        """
        return self if 0.0 in self.domain else SlackBelow(self)

    def scaled(self, factor: float) -> Elasticity:
        """Return this law with ``factor`` times its rigidity, e.g. for a wire of another spool.

        Strains and energies are divided by the factor [-]. Raises InvalidInput if the factor is not
        positive.
        """
        return ScaledElasticity(self, positive_factor(factor))

    @abstractmethod
    def rigidity(self, tension: ArrayLike) -> Array:
        """Compute the tangent rigidity EA(F) = l_0 dF/dΔl [N]; K_L uses it (the paper's Fig. 5).

        Args:
            tension: F [N], any shape.

        Raises:
            ElasticityRangeError: A tension is outside :attr:`domain`, or the law has no positive
                rigidity there.
        """

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        """Compute the slope dEA/dF [-] of the tangent rigidity, at tensions of any shape.

        By default it is the central difference over F ± 6e-6 max(F, 1 N), with about ten correct
        digits. Near an end of :attr:`domain` the difference is one-sided. A law may override this
        method. Raises ElasticityRangeError outside the domain.
        """
        values = self.domain.check(tension)
        step = _STEP * np.maximum(values, 1.0)
        before = np.maximum(values - step, self.domain.first)
        after = np.minimum(values + step, self.domain.high)
        return np.asarray((self.rigidity(after) - self.rigidity(before)) / (after - before))

    @abstractmethod
    def strain(self, tension: ArrayLike) -> Array:
        """Compute the strain Δl/l_0 = ∫ dF/EA(F) [-] from :attr:`rest` to F of any shape.

        Raises ElasticityRangeError as :meth:`rigidity` does.
        """

    @abstractmethod
    def energy(self, tension: ArrayLike) -> Array:
        """Compute the elastic energy ∫ F dε = ∫ F dF/EA(F) [N] = [J/m] per unstretched metre.

        The energy is zero at :attr:`rest`; F has any shape. Raises ElasticityRangeError as
        :meth:`rigidity` does.
        """

    def tension(self, strain: ArrayLike) -> Array:
        """Compute the tension F [N] at a strain: the inverse of :meth:`strain`.

        Args:
            strain: Δl/l_0 [-], zero at :attr:`rest`; any shape.

        Raises:
            InvalidInput: ``strain`` is not numbers.
            ElasticityRangeError: No tension in the domain gives one of the strains.
        """
        wanted = number_array("strain", strain)
        return tension_at(
            wanted, self.domain, self.strain, lambda F: 1.0 / self.rigidity(F), "strain"
        )

    def secant_rigidity(self, tension: ArrayLike) -> Array:
        """Compute the secant rigidity (F − F_0)/(Δl/l_0) [N] of Eq. 18, with F_0 = :attr:`rest`.

        It equals :meth:`rigidity` at F_0, and everywhere if EA is constant. Argument and errors are
        those of :meth:`rigidity`.
        """
        values = self.domain.check(tension)
        strain = self.strain(values)
        secant = np.array(self.rigidity(values))
        np.divide(values - self.rest, strain, out=secant, where=strain != 0.0)
        return secant


@final
@dataclass(frozen=True)
class ScaledElasticity(Elasticity):
    """The law of a stiffer or softer wire: EA(F) = ``factor`` · EA(F) of another ``law``."""

    law: Elasticity
    factor: float

    @property
    def domain(self) -> Domain:
        """Domain of ``law``, which scaling does not change."""
        return self.law.domain

    @property
    def rest(self) -> float:
        """Tension [N] at which the strain of ``law`` is zero."""
        return self.law.rest

    def rigidity(self, tension: ArrayLike) -> Array:
        """Compute EA [N] at tensions [N]."""
        return self.factor * self.law.rigidity(tension)

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        """Compute dEA/dF [-] at tensions [N]."""
        return self.factor * self.law.rigidity_slope(tension)

    def strain(self, tension: ArrayLike) -> Array:
        """Compute ε [-] at tensions [N]."""
        return self.law.strain(tension) / self.factor

    def energy(self, tension: ArrayLike) -> Array:
        """Compute ∫ F dε at tensions F [N], the energy per unstretched length [J/m] = [N]."""
        return self.law.energy(tension) / self.factor


@final
@dataclass(frozen=True)
class SlackBelow(Elasticity):
    """Law continued to 0 N with the rigidity at its low end; see :meth:`Elasticity.slack_below`.

    Attributes:
        law: The law. Within its domain, rigidity, strain and energy are unchanged, bit for bit.

    Raises:
        InvalidInput: The wire would be shorter than half its length when it is slack.
    """

    law: Elasticity

    def __post_init__(self) -> None:
        low, EA = self.rest, self._least
        if low > _SHORTEST * EA:
            raise InvalidInput(
                "slack_below",
                f"the rigidity at the low end, {low:g} N, is only {EA:.4g} N: a wire that keeps it "
                f"would be slack after shortening by {100.0 * low / EA:.3g} %. Begin the law at "
                "another tension.",
            )

    def __repr__(self) -> str:
        return f"{self.law!r}.slack_below()"

    @cached_property
    def domain(self) -> Domain:
        """Tensions from zero to the high end of the law [N]."""
        return Domain(0.0, self.law.domain.high)

    @property
    def rest(self) -> float:
        """Tension [N] at which the strain is zero: the low end of ``law``, not 0 N."""
        return self.law.rest

    @cached_property
    def _least(self) -> float:
        return float(self.law.rigidity(self.law.domain.first))

    def scaled(self, factor: float) -> SlackBelow:
        """Return the law of factor × EA, with its slack branch; see :meth:`Elasticity.scaled`."""
        return SlackBelow(self.law.scaled(factor))

    def rigidity(self, tension: ArrayLike) -> Array:
        """Compute EA(F) [N], constant on the slack branch; see :meth:`Elasticity.rigidity`."""
        return np.asarray(self.law.rigidity(self._split(tension)[0]))

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        """Compute dEA/dF [-], zero on the slack branch; see :meth:`Elasticity.rigidity_slope`."""
        inside, below = self._split(tension)
        return np.where(below < 0.0, 0.0, self.law.rigidity_slope(inside))

    def strain(self, tension: ArrayLike) -> Array:
        """Compute ∫ dF/EA(F) [-] from the low end of ``law`` to F; negative below that end."""
        inside, below = self._split(tension)
        return np.where(below < 0.0, below / self._least, self.law.strain(inside))

    def energy(self, tension: ArrayLike) -> Array:
        """Compute ∫ F dF/EA(F) [N] from the low end of ``law`` to F; negative below that end."""
        inside, below = self._split(tension)
        slack = below * (2.0 * self.rest + below) / (2.0 * self._least)
        return np.where(below < 0.0, slack, self.law.energy(inside))

    def _split(self, tension: ArrayLike) -> tuple[Array, Array]:
        """Split tensions F [N] at the low end of ``law``.

        Returns max(F, low), a tension of ``law``, and min(F − low, 0), the rest on the slack
        branch.
        """
        values = self.domain.check(tension)
        inside = np.maximum(values, self.law.domain.first)
        return inside, np.where(values < inside, values - self.rest, 0.0)


def checked_law(law: object) -> Elasticity:
    """Return ``law``; raise InvalidInput if it is not an Elasticity, or its domain no Domain."""
    if not isinstance(law, Elasticity):
        raise InvalidInput(
            "elasticity",
            f"{law!r} given; an Elasticity is needed: LinearElasticity(EA), a law of presets, or "
            "an object of your own subclass. The name of a wire is taken only in files, and by "
            "wire= of Manipulator.read and read_cables.",
        )
    if not isinstance(law.domain, Domain):
        raise InvalidInput(
            "elasticity",
            f"{law!r} has the domain {law.domain!r}; a Domain is needed, as Domain(0.0, 500.0).",
        )
    return law


def positive_factor(factor: float) -> float:
    """Return ``factor``, by which a rigidity is scaled; InvalidInput if it is not positive."""
    number = scalar("factor", factor)
    if not 0.0 < number < math.inf:
        raise InvalidInput("factor", f"{number:g} given; a positive number is needed.")
    return number
