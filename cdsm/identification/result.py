"""Result of an identification: values, uncertainty, and undetermined combinations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, final

import numpy as np
from scipy.linalg import qr
from scipy.special import ndtri, stdtrit

from cdsm.errors import InvalidInput
from cdsm.identification.intervals import NEGLIGIBLE, RANK_TOLERANCE, Profile
from cdsm.identification.measurement import Measurement, label
from cdsm.manipulator import Manipulator
from cdsm.support.format import MODEL
from cdsm.support.validation import flag, scalar
from cdsm.support.values import Array, ReadOnlyState, frozen

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Identification(ReadOnlyState):
    """Parameters of an arm that explain its measurements best; made by :func:`identify`.

    There are n measurements and P parameters. Each parameter has the unit in which ``model_of``
    takes it. All arrays are read-only.

    Attributes:
        names: Names of the parameters, in the order of every (P,) array.
        values: Values of the parameters (P,) [m, kg, N/m, …].
        bounds: Bounds of the parameters (P, 2), low and high [m, kg, N/m, …].
        measurements: The measurements.
        predicted: Stiffnesses of the model (n,) [N/m].
        jacobian: J = ∂r/∂p (n, P) [1/m, m/N, …], r in standard deviations.
        arm: Arm with these values.
        warnings: One sentence for each reason not to trust the result; empty if there is none.
        profiles: One :class:`Profile` of χ² for each parameter; None if it is not determined.
    """

    names: tuple[str, ...]
    values: Array
    bounds: Array
    measurements: tuple[Measurement, ...]
    predicted: Array
    jacobian: Array
    arm: Manipulator
    warnings: tuple[str, ...]
    profiles: tuple[Profile | None, ...]

    @property
    def parameters(self) -> dict[str, float]:
        """Values by name, as ``model_of`` takes them."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    @cached_property
    def measured(self) -> Array:
        """Measured stiffnesses (n,) [N/m]."""
        return frozen(np.array([each.value for each in self.measurements]))

    @cached_property
    def residuals(self) -> Array:
        """Residuals r = (predicted − measured)/σ (n,), in standard deviations [-]."""
        sigma = np.array([each.std for each in self.measurements])
        return frozen((self.predicted - self.measured) / sigma)

    @property
    def chi_square(self) -> float:
        """χ² = Σ r² [-]. It is about :attr:`freedom` if the model and all σ are right."""
        return float(self.residuals @ self.residuals)

    @property
    def freedom(self) -> int:
        """Degrees of freedom: n less :attr:`rank`."""
        return len(self.measurements) - self.rank

    @property
    def reduced_chi_square(self) -> float:
        """χ² per degree of freedom [-]; inf without degrees of freedom."""
        return self.chi_square / self.freedom if self.freedom else math.inf

    @property
    def rank(self) -> int:
        """Number of combinations of parameters that the measurements determine, at most P."""
        return int(self._determined.sum())

    @cached_property
    def covariance(self) -> Array:
        """Covariance (JᵀJ)⁻¹ (P, P) [m², m kg, …] for the given σ, not scaled by χ².

        If only the ratios of the σ are known, multiply it by :attr:`reduced_chi_square`. The bounds
        have no influence. An undetermined parameter has infinite variance.
        """
        values, right = self._svd
        inner = right[self._determined].T / values[self._determined]
        covariance = inner @ inner.T / np.outer(self._column_norms, self._column_norms)
        null = self._null_projector
        return frozen(np.where(null != 0.0, np.copysign(math.inf, null), covariance))

    @cached_property
    def std(self) -> Array:
        """Standard deviations of the parameters (P,) [m, kg, N/m, …]."""
        return frozen(np.sqrt(np.diag(self.covariance)))

    @cached_property
    def correlation(self) -> Array:
        """Correlations of the parameters (P, P) [-]. At ±1 only a combination is determined."""
        firm = np.diag(self._null_projector) == 0.0
        matrix = np.where(np.outer(firm, firm), self.covariance, 0.0)
        matrix = np.where(np.outer(~firm, ~firm), self._null_projector, matrix)
        root = np.sqrt(np.diag(matrix))
        return frozen(np.clip(matrix / np.outer(root, root), -1.0, 1.0))

    def confidence(
        self, level: float = 0.95, *, scaled: bool = False
    ) -> dict[str, tuple[float, float]]:
        """Compute intervals that hold each true parameter with a probability [m, kg, N/m, …].

        The interval of p_i follows from profile likelihood: hold p_i, fit the other parameters
        within their bounds, and require Δχ² ≤ q². q is the quantile of a normal variable. For a
        linear model the interval is value ± q·std. For other models it may be asymmetric. An end is
        -inf or inf if Δχ² stays below q² up to the bound of the parameter or the end of the model.
        Then the measurements set no end, and :attr:`warnings` report it at 95 %.

        Args:
            level: The probability, between 0 and 1.
            scaled: Whether the σ are known only up to a common factor, which χ² estimates. Then q
                is the quantile of Student's t times √(reduced χ²).

        Raises:
            InvalidInput: ``level`` is not between 0 and 1, or so near to 1 that the profiles do not
                reach it; or ``scaled`` is not a bool.
        """
        level = scalar("level", level)
        if not 0.0 < level < 1.0:
            raise InvalidInput("level", f"{level:g} given; it must lie between 0 and 1, as 0.95.")
        rise = self._rise(level, scaled=flag("scaled", scaled))
        intervals = {}
        for name, profile in zip(self.names, self.profiles, strict=True):
            low: float | None = -math.inf
            high: float | None = math.inf
            if profile is not None and math.isfinite(rise):
                low, high = profile.crossing(rise, -1), profile.crossing(rise, 1)
            if low is None or high is None:
                raise InvalidInput(
                    "level",
                    f"{level:.10g} given; the profile of {name} does not reach there. Give a level "
                    "farther from 1.",
                )
            intervals[name] = (low, high)
        return intervals

    def plot(self) -> Figure:
        """Plot predicted over measured stiffness [N/mm], and residuals in standard deviations."""
        from cdsm.plots.measured import plot_identification  # matplotlib imports slowly

        return plot_identification(self, self._labels, self._verdict)

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value:.4g}" for name, value in self.parameters.items())
        return f"<Identification {values}; {self._verdict}>"

    def __str__(self) -> str:
        columns = ("value", "std", "95 % from", "to", "low", "high")
        intervals = list(self.confidence().values())
        numbers = np.column_stack([self.values, self.std, intervals, self.bounds])
        lines = [_row("parameter [own unit]", *columns), *map(_row, self.names, *numbers.T), ""]
        lines.append(_row("measurement", "measured", "predicted", "residual"))
        lines.append(_row("", "[N/mm]", "[N/mm]", "[σ]"))
        residuals = [f"{residual:.2f}" for residual in self.residuals]
        lines += map(_row, self._labels, self.measured / 1e3, self.predicted / 1e3, residuals)
        lines += [f"({MODEL}; secant where a force is given)", "", self._verdict]
        return "\n".join([*lines, *(f"warning: {sentence}" for sentence in self.warnings)])

    @property
    def _labels(self) -> list[str]:
        return [label(i, each) for i, each in enumerate(self.measurements)]

    @property
    def _verdict(self) -> str:
        return (
            f"χ² = {self.chi_square:.4g} with {self.freedom} degrees of freedom, "
            f"rank {self.rank} of {len(self.names)}"
        )

    def _rise(self, level: float, *, scaled: bool) -> float:
        """Compute Δχ² [-] at the ends of an interval."""
        half = (1.0 + level) / 2.0
        if not scaled:
            return float(ndtri(half) ** 2)
        if not self.freedom:
            return math.inf
        return float(stdtrit(self.freedom, half) ** 2) * self.reduced_chi_square

    @property
    def _goals(self) -> tuple[list[float], float]:
        """Δχ² [-] at the ends of 95 % intervals, rising, and the largest Δχ² of the profiles."""
        exact, far = [self._rise(0.95, scaled=False)], self._rise(0.999, scaled=False)
        if self.freedom:
            exact.append(self._rise(0.95, scaled=True))
            far = max(far, self._rise(0.99, scaled=True))
        # without noise, χ² and all it scales are rounding
        return sorted(rise for rise in exact if rise > NEGLIGIBLE), far

    @cached_property
    def _column_norms(self) -> Array:
        """Norms of the columns of J (P,); inf for a zero column."""
        norms = np.linalg.norm(self.jacobian, axis=0)
        # zero column: over its range, the parameter moves no residual by a millionth of its σ
        zero = norms * np.ptp(self.bounds, axis=1) < RANK_TOLERANCE
        return np.where(zero, math.inf, norms)

    @cached_property
    def _svd(self) -> tuple[Array, Array]:
        """Singular values of J and right vectors. Its columns are scaled to unit length or zero."""
        _, values, right = np.linalg.svd(self.jacobian / self._column_norms, full_matrices=False)
        return values, right

    @cached_property
    def _determined(self) -> Any:
        values = self._svd[0]
        return values > RANK_TOLERANCE * max(values[0], RANK_TOLERANCE)

    @property
    def _null(self) -> Array:
        """Undetermined combinations of the scaled parameters, as orthonormal rows (·, P)."""
        return np.asarray(self._svd[1][~self._determined])

    @cached_property
    def _null_projector(self) -> Array:
        """Projector (P, P) on the undetermined combinations, with rounding set to zero."""
        projector = self._null.T @ self._null
        return np.where(abs(projector) > 1e-8, projector, 0.0)

    @property
    def _dependent(self) -> Any:
        """One parameter per undetermined combination. Holding these determines the others."""
        return qr(self._null, mode="r", pivoting=True)[1][: len(self._null)]

    @property
    def _null_combinations(self) -> list[str]:
        """Combinations that change no prediction, as text: "a by +1 and b by -0.3"."""
        if not len(self._null):
            return []
        # easiest to read: one dependent parameter per combination
        null = np.linalg.solve(self._null[:, self._dependent], self._null)
        scale = np.where(np.isinf(self._column_norms), 1.0, self._column_norms)
        written = []
        for row in null:
            row = np.where(abs(row) > 1e-4, row, 0.0) / scale
            # readable size: no parameter moves by more than 1 % of its range
            row = 0.01 * row / (abs(row) / np.ptp(self.bounds, axis=1)).max()
            terms = [(row[i], self.names[i]) for i in np.flatnonzero(row)]
            written.append(" and ".join(f"{name} by {part:+.4g}" for part, name in terms))
        return written


def _row(name: str, *cells: object) -> str:
    """Write a row of a table. Numbers have four digits."""
    texts = (f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in cells)
    return f"{name:<22}" + "".join(f"{text:>12}" for text in texts)
