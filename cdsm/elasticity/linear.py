"""The elasticity with a constant rigidity."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.elasticity.domain import Domain
from cdsm.elasticity.law import Elasticity, positive_factor
from cdsm.errors import InvalidInput
from cdsm.support.validation import quantity, scalar
from cdsm.support.values import Array

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
        """Return the law EA = E π d²/4 of a solid wire, with E [Pa] and the diameter d [m].

        Raises InvalidInput if one of them is not positive.
        """
        for name, value in (("young_modulus", young_modulus), ("diameter", diameter)):
            if scalar(name, value) <= 0.0:
                raise InvalidInput(name, f"{value:g} given; it must be positive.")
        return cls(young_modulus * math.pi * (diameter * diameter) / 4.0)

    @property
    def domain(self) -> Domain:
        """All tensions: [0 N, inf N)."""
        return _ALL_TENSIONS

    def scaled(self, factor: float) -> LinearElasticity:
        """Return the law of factor × EA; see :meth:`Elasticity.scaled`."""
        return LinearElasticity(positive_factor(factor) * self._rigidity)

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
        """Compute F²/(2 EA) per unstretched length [J/m] = [N]; see :meth:`Elasticity.energy`."""
        return np.asarray(self.domain.check(tension) ** 2 / (2.0 * self._rigidity))
