"""A law that has the rigidity of another law, multiplied by a factor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from numpy.typing import ArrayLike

from cdsm.elasticity.domain import Domain
from cdsm.elasticity.law import Elasticity
from cdsm.support.values import Array


@final
@dataclass(frozen=True)
class ScaledElasticity(Elasticity):
    """Law with the rigidity of another law, times a factor: EA(F) = factor · EA_law(F)."""

    law: Elasticity
    factor: float

    @property
    def domain(self) -> Domain:
        """Domain of ``law``, which scaling does not change."""
        return self.law.domain

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
