"""Which parameters measurements determine: rank, covariance, undetermined combinations.

To first order, a change dp of the parameters changes the residuals by J dp. Changes in the null
space of J are undetermined combinations of parameters: they change no residual.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import qr

from cdsm.identification.intervals import RANK_TOLERANCE
from cdsm.support.values import Array, frozen


@dataclass(frozen=True, eq=False)
class Determination:
    """Which linear combinations of P parameters the measurements determine, from the Jacobian J."""

    names: tuple[str, ...]  # names of the parameters p (P,)
    jacobian: Array  # J = ∂r/∂p (n, P) with the residuals r in standard deviations
    ranges: Array  # width of the range in which each parameter is sought (P,), such as its bounds

    @property
    def rank(self) -> int:
        """Number of linear combinations of the parameters that are determined: the rank of J."""
        return int(self.determined.sum())

    @cached_property
    def covariance(self) -> Array:
        """Covariance (JᵀJ)⁻¹ (P, P); undetermined parameters have infinite variance."""
        values, right = self._svd
        inner = right[self.determined].T / values[self.determined]
        covariance = inner @ inner.T / np.outer(self._column_norms, self._column_norms)
        null = self._null_projector
        return frozen(np.where(null != 0.0, np.copysign(math.inf, null), covariance))

    @cached_property
    def correlation(self) -> Array:
        """Correlations (P, P) [-] of the parameters.

        Two undetermined parameters have the correlation of their undetermined combinations: ±1 if
        there is only one such combination. A determined and an undetermined parameter have 0.
        """
        is_determined = self.is_determined
        matrix = np.where(np.outer(is_determined, is_determined), self.covariance, 0.0)
        matrix = np.where(np.outer(~is_determined, ~is_determined), self._null_projector, matrix)
        root = np.sqrt(np.diag(matrix))
        return frozen(np.clip(matrix / np.outer(root, root), -1.0, 1.0))

    @property
    def is_determined(self) -> Any:
        """Whether each parameter alone is determined, boolean (P,)."""
        return np.diag(self._null_projector) == 0.0

    @property
    def to_fix(self) -> Any:
        """Indices of parameters whose values must be fixed so that all others are determined.

        There is one index for each undetermined combination.
        """
        return qr(self._null, mode="r", pivoting=True)[1][: len(self._null)]

    @property
    def coordinates(self) -> Array:
        """Matrix A (P, rank) whose columns span the determined changes of the parameters.

        So changes A c are determined for every c (rank,).
        """
        scaled = self._svd[1][self.determined].T
        return np.asarray(scaled / self._column_norms[:, None])

    @property
    def open_combinations(self) -> list[str]:
        """Undetermined combinations as text, such as "a by +1 and b by -0.3".

        Changing the parameters together by these amounts changes no residual. No amount is above
        1 % of the range of its parameter.
        """
        if not len(self._null):
            return []
        # easiest to read: one dependent parameter per combination
        null = np.linalg.solve(self._null[:, self.to_fix], self._null)
        scale = np.where(np.isinf(self._column_norms), 1.0, self._column_norms)
        written = []
        for row in null:
            row = np.where(abs(row) > 1e-4, row, 0.0) / scale
            # readable size: no parameter moves by more than 1 % of its range
            row = 0.01 * row / (abs(row) / self.ranges).max()
            terms = [(row[i], self.names[i]) for i in np.flatnonzero(row)]
            written.append(" and ".join(f"{name} by {part:+.4g}" for part, name in terms))
        return written

    @cached_property
    def _column_norms(self) -> Array:
        """Norms of the columns of J (P,); inf for a column that is zero to rounding."""
        norms = np.linalg.norm(self.jacobian, axis=0)
        # zero column: over its range, the parameter moves no residual by a millionth of its σ
        zero = norms * self.ranges < RANK_TOLERANCE
        return np.where(zero, math.inf, norms)

    @cached_property
    def _svd(self) -> tuple[Array, Array]:
        """Singular values and right singular vectors of J, with columns scaled to unit length.

        Columns that are zero to rounding are set to zero.
        """
        _, values, right = np.linalg.svd(self.jacobian / self._column_norms, full_matrices=False)
        return values, right

    @cached_property
    def determined(self) -> Any:
        """Whether each singular value of the scaled J is above rounding, boolean.

        If it is, the combination of parameters in its right singular vector is determined.
        """
        values = self._svd[0]
        return values > RANK_TOLERANCE * max(values[0], RANK_TOLERANCE)

    @property
    def _null(self) -> Array:
        """Undetermined combinations of the scaled parameters, orthonormal rows (P − rank, P)."""
        return np.asarray(self._svd[1][~self.determined])

    @cached_property
    def _null_projector(self) -> Array:
        """Orthogonal projector (P, P) onto the undetermined combinations of the scaled parameters.

        Entries that are rounding are set to zero.
        """
        projector = self._null.T @ self._null
        return np.where(abs(projector) > 1e-8, projector, 0.0)
