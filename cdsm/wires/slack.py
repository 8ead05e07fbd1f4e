"""Continue a law of rigidity below its domain, down to zero tension: the slack branch."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.elasticity import Domain, Elasticity
from cdsm.errors import InvalidInput
from cdsm.support.values import Array

_SHORTEST: Final = 0.5
"""Least length of a slack wire, divided by its length at the low end of its law."""


@final
@dataclass(frozen=True)
class SlackBelow(Elasticity):
    """A law continued to 0 N with its rigidity at its low end; see :meth:`Elasticity.slack_below`.

    Attributes:
        law: The law. Within its domain, rigidity, strain and energy are those of the law, bit for
            bit.

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
        """Low end of the law [N], where the strain is zero."""
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
        """Compute ∫ dF/EA(F) [-] from the low end of the law; negative below it."""
        inside, below = self._split(tension)
        return np.where(below < 0.0, below / self._least, self.law.strain(inside))

    def energy(self, tension: ArrayLike) -> Array:
        """Compute ∫ F dF/EA(F) [N] from the low end of the law; negative below it."""
        inside, below = self._split(tension)
        slack = below * (2.0 * self.rest + below) / (2.0 * self._least)
        return np.where(below < 0.0, slack, self.law.energy(inside))

    def _split(self, tension: ArrayLike) -> tuple[Array, Array]:
        """Return max(F, low), inside the law, and min(F − low, 0), the part on the slack branch."""
        values = self.domain.check(tension)
        inside = np.maximum(values, self.law.domain.first)
        return inside, np.where(values < inside, values - self.rest, 0.0)
