"""The bounds of the parameters, mapped on the unit cube that is searched."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import numpy as np

from cdsm.support.validation import Array

_DECADES = 100.0
"""Ratio of positive bounds beyond which a parameter is searched by its logarithm."""


@final
@dataclass(frozen=True, eq=False)
class Box:
    """Parameters in own units between their bounds (P, 2), and as points of the unit cube."""

    bounds: Array

    def parameters(self, point: Array) -> Array:
        """Parameters (P,) in own units at a point of the unit cube."""
        values = np.where(self._by_log, self.low * self._ratio**point, self.low + point * self.size)
        # the bounds themselves at 0 and 1, whatever rounding says
        values = np.where(point == 1.0, self.high, values)
        return np.asarray(np.clip(values, self.low, self.high), dtype=np.float64)

    def point(self, values: Array) -> Array:
        """Inverse of :meth:`parameters`."""
        linear = (values - self.low) / self.size
        safe = np.where(self._by_log, values / np.where(self._by_log, self.low, 1.0), 1.0)
        by_log = np.log(safe) / np.where(self._by_log, np.log(self._ratio), 1.0)
        return np.asarray(np.clip(np.where(self._by_log, by_log, linear), 0.0, 1.0))

    def stretch(self, point: Array) -> Array:
        """Derivative of :meth:`parameters` (P,)."""
        by_log = self.parameters(point) * np.log(self._ratio)
        return np.asarray(np.where(self._by_log, by_log, self.size))

    def only(self, i: int) -> Box:
        """The box of one parameter, for any number of its values."""
        return Box(self.bounds[i : i + 1])

    @property
    def low(self) -> Array:
        """Lower bounds (P,), in own units."""
        return self.bounds[:, 0]

    @property
    def high(self) -> Array:
        """Upper bounds (P,), in own units."""
        return self.bounds[:, 1]

    @cached_property
    def size(self) -> Array:
        """How far the bounds are apart (P,), in own units."""
        return np.asarray(self.high - self.low)

    @cached_property
    def _by_log(self) -> Any:
        return (self.low > 0.0) & (self.high > _DECADES * self.low)

    @cached_property
    def _ratio(self) -> Array:
        safe = np.where(self._by_log, self.low, 1.0)
        return np.asarray(np.where(self._by_log, self.high / safe, 1.0))
