"""Solve least squares within bounds, for a model that may not exist for some parameters.

    min Σ r_i(p)²   subject to   low ≤ p ≤ high

Each parameter is scaled to 0…1 between its bounds, so the search runs over a unit cube. Where the
model does not exist, the residuals are infinite, and scipy's search shortens its step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Literal

import numpy as np
from scipy.optimize import least_squares

from cdsm.errors import CdsmError, InvalidInput
from cdsm.support.values import Array

_DECADES = 100.0
"""Least ratio of positive bounds with which the logarithm of a parameter is searched instead."""

_ONE_SIDED, _CENTRAL, _ROUGH = 1e-7, 1e-5, 1e-4
"""Steps of the finite differences in the unit cube. They balance rounding and truncation."""

Method = Literal["trf", "dogbox"]
METHODS: tuple[Method, ...] = ("trf", "dogbox")
"""Searches of scipy in a useful order.

``trf`` converges from far away, but only approaches a bound. ``dogbox`` then goes exactly onto it.
"""

_INSIDE = 1e-6  # nearest start to a bound of trf, which may stop where it starts on one

_CACHED = 64  # points whose residuals are kept: a search evaluates some points repeatedly


class NoModelError(Exception):
    """The model has no residuals at these parameters. The text gives the reason."""


@contextmanager
def no_model(where: str = "") -> Iterator[None]:
    """Context in which a CdsmError becomes a NoModelError, whose text begins with ``where``."""
    try:
        yield
    except CdsmError as error:
        raise NoModelError(f"{where}{error}") from error


class Box:
    """Map between the P parameters within their bounds (P, 2) and the unit cube.

    A parameter whose bounds are positive and a factor of 100 or more apart is mapped by its
    logarithm.
    """

    def __init__(self, bounds: Array) -> None:
        self.bounds = bounds
        self.low, self.high = bounds.T
        self._by_log = (self.low > 0.0) & (self.high >= _DECADES * self.low)
        self._start = self._scaled(self.low)
        self._size = self._scaled(self.high) - self._start

    def _scaled(self, values: Array) -> Array:
        """Return the parameters (P,); those that are searched logarithmically as logarithms."""
        return np.asarray(np.log(values, out=values.copy(), where=self._by_log))

    def parameters(self, point: Array) -> Array:
        """Compute the parameters (P,) at a ``point`` (P,) of the unit cube."""
        scaled = self._start + point * self._size
        values = np.exp(scaled, out=scaled, where=self._by_log)
        # without rounding at 0 and 1
        values = np.where(point == 1.0, self.high, np.where(point == 0.0, self.low, values))
        return np.asarray(np.clip(values, self.low, self.high))

    def point(self, values: Array) -> Array:
        """Compute the point of the unit cube (P,) for ``values`` (P,) of the parameters."""
        return np.asarray(np.clip((self._scaled(values) - self._start) / self._size, 0.0, 1.0))

    def derivative(self, point: Array) -> Array:
        """Compute ∂parameter/∂point (P,) of each parameter at a ``point`` of the unit cube."""
        return np.where(self._by_log, self.parameters(point) * self._size, self._size)


class LeastSquares:
    """Problem min Σ r² over the unit cube, to which the parameters are scaled by their bounds.

    Args:
        residuals_of: Function that takes the parameters by name and returns r (n,). It may raise
            :class:`NoModelError`.
        count: Number n of residuals.
        bounds: (low, high) of each parameter.
        rough: Whether the residuals are less exact and have kinks, as those of loops: finite
            differences then take larger steps.
    """

    def __init__(
        self,
        residuals_of: Callable[[dict[str, float]], Array],
        count: int,
        bounds: Mapping[str, tuple[float, float]],
        rough: bool = False,
    ) -> None:
        self.names = tuple(bounds)
        self.box = Box(np.array(list(bounds.values()), dtype=np.float64))
        self.count = count
        self._residuals_of, self.rough = residuals_of, rough
        self._cached = lru_cache(maxsize=_CACHED)(self._evaluate)

    def parameters(self, point: Array) -> dict[str, float]:
        """Compute the parameters by name at a ``point`` (P,) of the unit cube."""
        return dict(zip(self.names, self.box.parameters(point).tolist(), strict=True))

    def describe(self, point: Array) -> str:
        """Write the parameters at a ``point`` (P,) of the unit cube as text: "a = 1.2, b = 3"."""
        return ", ".join(f"{name} = {x:.6g}" for name, x in self.parameters(point).items())

    def residuals(self, point: Array) -> Array:
        """Compute the residuals r (n,) at a point (P,) of the unit cube; inf without a model."""
        found = self._cached(point.tobytes())
        return np.full(self.count, math.inf) if isinstance(found, NoModelError) else found.copy()

    def failure(self, point: Array) -> NoModelError | None:
        """Return why the model does not exist at a point (P,) of the unit cube, or None."""
        found = self._cached(point.tobytes())
        return found if isinstance(found, NoModelError) else None

    def _evaluate(self, point: bytes) -> Array | NoModelError:
        try:
            return self._residuals_of(self.parameters(np.frombuffer(point)))
        except NoModelError as error:
            return error

    def cost(self, point: Array) -> float:
        """Compute Σ r² at a point of the unit cube."""
        r = self.residuals(point)
        return float(r @ r)

    def jacobian(
        self, point: Array, over: Sequence[int] | None = None, *, central: bool = False
    ) -> Array:
        """Compute ∂r/∂point (n, P) by one-sided or central finite differences.

        If ``over`` is given, only the columns of these parameters are computed. Near a bound, or
        where the model ceases to exist, central differences become one-sided second-order
        differences. Raises InvalidInput if the model exists at the point, but on neither side of
        it.
        """
        chosen = range(len(self.names)) if over is None else over
        return np.column_stack([self._column(point, i, central) for i in chosen])

    def _column(self, point: Array, i: int, central: bool) -> Array:
        here, step = (
            self.residuals(point),
            _ROUGH if self.rough else _CENTRAL if central else _ONE_SIDED,
        )

        def at(k: int) -> Array | None:
            """Compute the residuals (n,) k steps away; None beyond a bound, or without a model."""
            moved = point.copy()
            moved[i] += k * step
            if not 0.0 <= moved[i] <= 1.0:
                return None
            return self.residuals(moved) if self.failure(moved) is None else None

        for side in (1, -1):
            near = at(side)
            if near is None:
                continue
            if not central:
                return side * (near - here) / step
            if (far := at(-side)) is not None:
                return side * (near - far) / (2.0 * step)
            if (far := at(2 * side)) is not None:
                return side * (4.0 * near - far - 3.0 * here) / (2.0 * step)
        raise InvalidInput(
            "free",
            f"at {self.describe(point)} the model has a stiffness for all measurements, "
            f"but none for a slightly smaller or larger {self.names[i]}. Change the bounds.",
        )

    def search(
        self,
        start: Array,
        *,
        method: Method,
        tolerances: tuple[float, float, float],
        most: int,
        over: Sequence[int] | None = None,
        central: bool = False,
    ) -> Array:
        """Search for the minimum. Return the point of the unit cube where the search ends.

        Args:
            start: First point of the search.
            method: One of :data:`METHODS`.
            tolerances: scipy's ftol, xtol and gtol.
            most: Largest number of evaluations; evaluations for finite differences are not counted.
            over: Indices of the parameters that move; all if not given.
            central: Whether the finite differences are central.
        """
        moving = list(range(start.size)) if over is None else list(over)

        def at(x: Array) -> Array:
            point = start.copy()
            point[moving] = x
            return point

        first = start[moving]
        if method == "trf":
            first = np.clip(first, _INSIDE, 1.0 - _INSIDE)
        found = least_squares(
            lambda x: self.residuals(at(x)),
            first,
            lambda x: self.jacobian(at(x), moving, central=central),
            bounds=(0.0, 1.0),
            method=method,
            x_scale="jac",
            max_nfev=most,
            **dict(zip(("ftol", "xtol", "gtol"), tolerances, strict=True)),
        )
        return at(found.x)
