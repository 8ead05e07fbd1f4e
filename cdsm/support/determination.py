"""What measurements determine, and whether a model explains them: rank, covariance, χ².

To first order, a change dp of the parameters changes the residuals by J dp. Changes in the null
space of J are undetermined combinations of parameters: they change no residual.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import qr
from scipy.special import chdtr, chdtrc

from cdsm.support.values import Array, frozen

_TOLERANCE = 1e-6  # smaller singular values of J, its columns scaled to length 1, are zero
_UNLIKELY = 1e-3  # least probability of χ²; below it, the model does not explain the measurements

INTERVAL = 1.96
"""Half width of an interval of 95 % in standard deviations."""


def interval_in_percent(std: Array, values: Array) -> Array:
    """Return the half widths of the intervals of 95 % in per cent of the values."""
    return 100.0 * INTERVAL * std / abs(values)


def likely(chi_square: float, freedom: int) -> bool:
    """Whether right models leave this χ² or more in one of a thousand experiments, or oftener."""
    return not freedom or float(chdtrc(freedom, chi_square)) >= _UNLIKELY


def chi_square_text(chi_square: float, freedom: int) -> str:
    """Return χ² with its probability: of right models and σ, so many have a smaller one."""
    text = f"χ² = {chi_square:.4g} with {freedom} degrees of freedom"
    if freedom:
        less = 100.0 * chdtr(freedom, chi_square)
        text += f" (right models and σ: smaller in {less:.3g} % of all experiments)"
    return text


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
