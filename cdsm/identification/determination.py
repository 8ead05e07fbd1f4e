"""Which parameters measurements determine, and how well: rank, covariance, intervals.

To first order, a change dp of the parameters changes the residuals by J dp. Changes in the null
space of J are undetermined combinations of parameters: they change no residual.

Intervals are those of the profile likelihood: fix a parameter p_i at some value and fit all others.
The least χ² is then higher than that of the best fit by Δχ²(p_i). The interval has the values with
Δχ² up to a quantile, whether the search uses p_i or its logarithm. Source: Bates and Watts,
Nonlinear Regression Analysis, 1988, chapter 6.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from scipy.linalg import qr
from scipy.optimize import brentq

from cdsm.errors import InvalidInput
from cdsm.identification.least_squares import LeastSquares
from cdsm.support.values import Array, frozen

_LOWER = 1e-2  # fall of χ² below that of the best fit that refutes it
_TRIALS = 20  # steps outward from the optimum
_EDGE = 1e-2  # distance from the end of the model, in half widths
_TOLERANCE = 1e-6  # smaller singular values of J, its columns scaled to length 1, are zero


@dataclass(frozen=True, eq=False)
class Determination:
    """Which linear combinations of P parameters the measurements determine, from the Jacobian J."""

    names: tuple[str, ...]  # names of the parameters p (P,)
    jacobian: Array  # J = ∂r/∂p (n, P) with the residuals r in standard deviations
    ranges: Array  # width of the range in which each parameter is sought (P,), such as its bounds

    @property
    def rank(self) -> int:
        """Number of linear combinations of the parameters that are determined: the rank of J."""
        return len(self._parts[0])

    @cached_property
    def covariance(self) -> Array:
        """Covariance (JᵀJ)⁻¹ (P, P); undetermined parameters have infinite variance."""
        inner = self.coordinates
        null = self._null_projector
        return frozen(np.where(null != 0.0, np.copysign(np.inf, null), inner @ inner.T))

    @cached_property
    def correlation(self) -> Array:
        """Correlations (P, P) [-] of the parameters.

        Two undetermined parameters have the correlation of their undetermined combinations: ±1 if
        there is only one such combination. A determined and an undetermined parameter have 0.
        """
        null = self._null_projector
        is_open = np.diag(null) != 0.0
        matrix = np.where(is_open[:, None] | is_open, null, self.covariance)
        matrix = np.where(is_open[:, None] == is_open, matrix, 0.0)
        root = np.sqrt(np.diag(matrix))
        return frozen(np.clip(matrix / np.outer(root, root), -1.0, 1.0))

    @property
    def coordinates(self) -> Array:
        """Matrix A (P, rank): changes A c are determined for every c, and J A is orthonormal."""
        size, known, _ = self._parts
        return np.asarray(known.T / size / self._norms[:, None])

    @property
    def open_combinations(self) -> tuple[str, ...]:
        """Undetermined combinations as text, such as "a by +1 and b by -0.3".

        Changing the parameters together by these amounts changes no residual. No amount is above
        1 % of the range of its parameter.
        """
        null = self._parts[2]
        texts = []
        if not len(null):
            return ()
        # easiest to read: one dependent parameter per combination
        dependent = qr(null, mode="r", pivoting=True)[1][: len(null)]
        for row in np.linalg.solve(null[:, dependent], null):
            row = np.where(abs(row) > 1e-4, row, 0.0)
            row /= np.where(np.isinf(self._norms), 1.0, self._norms)
            row *= 0.01 / (abs(row) / self.ranges).max()
            parts = [f"{self.names[i]} by {row[i]:+.4g}" for i in np.flatnonzero(row)]
            texts.append(" and ".join(parts))
        return tuple(texts)

    @cached_property
    def _norms(self) -> Array:
        """Norms of the columns of J (P,); inf for one that moves no residual by 1e-6 of its σ."""
        norms = np.linalg.norm(self.jacobian, axis=0)
        return np.where(norms * self.ranges < _TOLERANCE, np.inf, norms)

    @cached_property
    def _parts(self) -> tuple[Array, Array, Array]:
        """Singular values > 0 of the scaled J, their right vectors, and those of the null space."""
        _, size, right = np.linalg.svd(self.jacobian / self._norms)
        rank = int((size > _TOLERANCE * max(size[0], _TOLERANCE)).sum())
        return size[:rank], right[:rank], right[rank:]

    @cached_property
    def _null_projector(self) -> Array:
        """Orthogonal projector (P, P) onto the null space of the scaled J, without rounding."""
        null = self._parts[2]
        projector = null.T @ null
        return np.where(abs(projector) > 1e-8, projector, 0.0)


def interval(
    problem: LeastSquares, best: Array, jacobian: Array, i: int, rise: float
) -> tuple[float, float]:
    """Return the smallest and the largest value of parameter ``i`` with Δχ² ≤ ``rise``.

    ``best`` (P,) is the scaled optimum, ``jacobian`` (n, P) ∂r/∂x there. A limit is -inf or inf if
    there is none before the bound or the end of the model. Raises InvalidInput if the profile falls
    below the supposed optimum.
    """
    others = np.flatnonzero(np.arange(best.size) != i)
    least = problem.cost(best)
    beside = jacobian[:, others]
    tangent = np.linalg.lstsq(beside, -jacobian[:, i], rcond=1e-6)[0]
    width = math.sqrt(rise) / float(np.linalg.norm(jacobian[:, i] + beside @ tangent))

    precision = 3e-4 if problem.has_rests else 1e-6  # in half widths

    @cache
    def excess(u: float) -> float:
        """Return √Δχ² − √rise with x_i = u, almost linear in u; inf where there is no model."""
        x = best.copy()
        x[i] = u
        x[others] = np.clip(best[others] + (u - best[i]) * tangent, 0.0, 1.0)
        if not math.isfinite(problem.cost(x)):
            x[others] = best[others]
        if others.size and u != best[i]:
            x = problem.search(x, others, profile=True)
        if not math.isfinite(problem.cost(x)):
            return math.inf
        delta = problem.cost(x) - least
        if delta < -_LOWER:
            fault = f"χ² is {-delta:.3g} lower at {problem.describe(x)} than at this result."
            raise InvalidInput("start", f"{fault} Give identify() that as the start.")
        return math.sqrt(max(delta, 0.0)) - math.sqrt(rise)

    def limit(side: float) -> float:
        near = float(best[i])
        step = width
        end = math.inf
        for _ in range(_TRIALS):
            far = min(max(near + side * step, 0.0), 1.0)
            if far == near:
                return side * math.inf
            if excess(far) == math.inf:
                end = abs(far - near)  # the model ends in between
                step = step / 2.0
                if end < _EDGE * width:
                    break
            elif excess(far) >= 0.0:
                x = best.copy()
                x[i] = brentq(excess, near, far, xtol=precision * width, rtol=1e-12)
                return float(problem.values(x)[i])
            else:
                end -= abs(far - near)
                near = far
                step = min(1.6 * step, end / 2.0)
        return side * math.inf

    return limit(-1.0), limit(1.0)
