"""The range of tensions on which an elasticity is defined."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import ElasticityRangeError, InvalidInput
from cdsm.support.validation import flag, number_array, quantity
from cdsm.support.values import Array


@final
@dataclass(frozen=True)
class Domain:
    """Range of tensions [N] on which an elasticity is defined; ``low, high = domain`` unpacks it.

    Attributes:
        low: Smallest tension [N].
        high: Largest tension [N], included unless infinite.
        low_included: Whether ``low`` itself belongs to the domain.

    Raises:
        InvalidInput: ``low`` and ``high`` are not two numbers with 0 <= low < high, or
            ``low_included`` is not a bool.
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
        """Return tensions [N] of any shape as a float array; check that they are in the domain.

        Raises:
            InvalidInput: ``tension`` is not finite numbers.
            ElasticityRangeError: Some tensions are outside the domain; the error lists them.
        """
        values = number_array("tension", tension)
        outside = values <= self.low if not self.low_included else values < self.low
        outside |= values > self.high
        if np.count_nonzero(outside):
            below = "; slack_below() continues one to 0 N" if (values <= self.low).any() else ""
            raise ElasticityRangeError(
                f"outside the domain {self} of the elasticity. Keep the tension inside it "
                f"(minimum=, maximum=), or use an elasticity that covers it{below}.",
                np.atleast_1d(values)[np.atleast_1d(outside)].tolist(),
                np.flatnonzero(outside).tolist(),
            )
        return values
