"""Result of an identification: values, uncertainty, and undetermined combinations."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from cdsm.errors import InvalidInput
from cdsm.identification.intervals import profile_interval
from cdsm.identification.least_squares import LeastSquares, Test
from cdsm.identification.measurement import measurement_name
from cdsm.identification.tip_position import TipPosition
from cdsm.identification.weight_loop import WeightLoop
from cdsm.manipulator import Manipulator
from cdsm.stiffness_matrix.prints import frictionless_model
from cdsm.support.determination import Determination, chi_square_text, likely
from cdsm.support.format import aligned
from cdsm.support.progress import progress_allowed
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import scalar
from cdsm.support.values import Array, Plotted, frozen

_CORRELATED = 0.95  # a warning names two parameters whose correlation exceeds this value
_RIDGED = 0.9  # the print names two parameters whose correlation exceeds this value
_OWN = "own unit"
_MIXED = "N/m or m"


def independent_readings(measurements: Sequence[Test]) -> int:
    """Return the number of readings, less one for each axis of a loop: its offset is unknown."""
    offsets = sum(
        len(measurement.axes) for measurement in measurements if isinstance(measurement, WeightLoop)
    )
    return sum(measurement.readings.size for measurement in measurements) - offsets


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Identification(Result, Plotted):
    """Parameters of an arm that explain its measurements best; made by :func:`identify`.

    There are P parameters and n measured numbers: one for each stiffness, all readings of each
    loop, and all coordinates of each position. Each parameter has the unit in which ``model_of``
    takes it, its own unit. All arrays are read-only.

    Attributes:
        names: Names of the parameters, in the order of every (P,) array.
        values: Values of the parameters (P,).
        bounds: Bounds of the parameters (P, 2), low and high.
        measurements: The measurements.
        predicted: Predicted numbers (n,): stiffnesses [N/m], readings of loops [m] with fitted
            offsets, and coordinates of the tip [m].
        residuals: `r = (predicted − measured)/σ` (n,) [-].
        jacobian: `J = ∂r/∂p` (n, P).
        arm: Arm with these values.
        unfinished: Why the search ended before the optimum; empty if it did not.
        problem: The least squares that were solved.
    """

    _headline = "chi_square"
    _rows = "parameter"
    _figure = "plot_identification"

    names: tuple[str, ...] = field(metadata=unit("1", "parameter"))
    values: Array = field(metadata=unit(_OWN, "parameter"))
    bounds: Array = field(metadata=unit(_OWN, "parameter", "bound"))
    measurements: tuple[Test, ...]
    predicted: Array = field(metadata=unit(_MIXED, "reading"))
    residuals: Array = field(metadata=unit("1", "reading"))
    jacobian: Array
    arm: Manipulator
    unfinished: str
    problem: LeastSquares

    @property
    def parameters(self) -> dict[str, float]:
        """Values of the parameters by name, in the units of ``model_of``."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    @quantity(_MIXED, "reading")
    def measured(self) -> Array:
        """Measured numbers (n,): stiffnesses [N/m], displacements of loops and coordinates [m]."""
        return frozen(np.concatenate([measurement.readings for measurement in self.measurements]))

    @cached_property
    def measurement_of(self) -> NDArray[np.intp]:
        """Index of the measurement to which each of the n measured numbers belongs (n,)."""
        sizes = [measurement.readings.size for measurement in self.measurements]
        return frozen(np.repeat(np.arange(len(sizes)), sizes))

    @quantity(_OWN, "parameter")
    def std(self) -> Array:
        """Standard deviations of the parameters (P,); inf if undetermined."""
        return frozen(np.sqrt(np.diag(self.covariance)))

    @property
    def covariance(self) -> Array:
        """Covariance `(JᵀJ)⁻¹` (P, P) for the given σ, not scaled by χ².

        If only the ratios of the σ are known, multiply it by :attr:`reduced_chi_square`. The bounds
        have no influence. An undetermined parameter has infinite variance.
        """
        return self._determination.covariance

    @quantity("1", "parameter", "other_parameter")
    def correlation(self) -> Array:
        """Correlations (P, P) [-]; ±1 for two parameters with only one combination determined."""
        return self._determination.correlation

    @quantity("1")
    def chi_square(self) -> float:
        """`χ² = Σ r²` [-]. It is about :attr:`freedom` if the model and all σ are right."""
        return float(self.residuals @ self.residuals)

    @quantity("1")
    def freedom(self) -> int:
        """Degrees of freedom of χ²: n − :attr:`rank`, less one offset per axis of each loop."""
        return independent_readings(self.measurements) - self.rank

    @property
    def reduced_chi_square(self) -> float:
        """χ² per degree of freedom [-]; inf without degrees of freedom."""
        return self.chi_square / self.freedom if self.freedom else math.inf

    @quantity("1")
    def rank(self) -> int:
        """Number of combinations of parameters that the measurements determine, at most P."""
        return self._determination.rank

    @property
    def warnings(self) -> tuple[str, ...]:
        """One sentence for each reason not to trust the result; empty if there is none."""
        sentences = list[str]()
        for combination in self._determination.open_combinations:
            sentences.append(
                f"not identifiable (rank {self.rank} of {len(self.names)}): no prediction changes "
                f"with {combination}, so their values are one choice of many. Fix one, or measure "
                "what separates them."
            )
        for i, j in self.correlated():
            remedy = "Measure at other postures, directions or tensions."
            sentences.append(f"{self.ridge(i, j)} {remedy}")
        for name, side in self.at_bounds.items():
            limit = self.bounds[self.names.index(name), ("lower", "upper").index(side)]
            sentences.append(
                f"{name} is at its {side} bound, {limit:g}: the optimum lies there or beyond. "
                "Widen the bounds, or doubt the model."
            )
        if not self.is_explained:
            k = int(abs(self.residuals).argmax())
            sentences.append(
                f"the model does not explain the measurements within their σ: {self.verdict}, "
                f"worst at {self.reading_names[k]} with {self.residuals[k]:+.3g} σ. Standard "
                "deviations and intervals are valid for a right model only. Searches from other "
                "starts found nothing better: free another parameter, or doubt σ."
            )
        return (*sentences, *([self.unfinished] if self.unfinished else []))

    @property
    def is_explained(self) -> bool:
        """Whether at least one in a thousand right models would leave this χ² or more."""
        return likely(self.chi_square, self.freedom)

    @property
    def at_bounds(self) -> dict[str, str]:
        """Parameters that are at a bound, by name: at the lower or the upper one."""
        rows = zip(self.names, self.values, self.bounds, strict=True)
        return {
            name: ("lower", "upper")[limits.tolist().index(value)]
            for name, value, limits in rows
            if value in limits
        }

    def correlated(self, size: float = _CORRELATED) -> list[tuple[int, int]]:
        """Return the pairs of determined parameters whose correlation exceeds ``size``."""
        r = self.correlation
        finite = np.isfinite(self.std)
        pairs = zip(*np.triu_indices(len(self.names), 1), strict=True)
        return [(int(i), int(j)) for i, j in pairs if abs(r[i, j]) > size and finite[[i, j]].all()]

    def ridge(self, i: int, j: int) -> str:
        """Describe along which values of two parameters χ² hardly rises, in a sentence.

        Where `p_i` is off by its `σ_i`, the best `p_j` is off by `r σ_j`, and χ² is larger by 1.
        """
        r = self.correlation[i, j]
        a, b = (self.names[k] for k in (i, j))
        low, high = self.values[i] + self.std[i] * np.array([-1.0, 1.0])
        start, end = self.values[j] + r * self.std[j] * np.array([-1.0, 1.0])
        return (
            f"{a} and {b} are correlated at {r:+.4f}: mostly a combination of them is determined. "
            f"On the ridge from {a} {low:.4g}, {b} {start:.4g} to {a} {high:.4g}, {b} {end:.4g}, "
            "χ² rises by at most 1."
        )

    def confidence(
        self, level: float = 0.95, *, progress: bool = True
    ) -> dict[str, tuple[float, float]]:
        """Compute an interval (low, high) for each parameter, by name, in its own unit.

        It contains the true value with the probability ``level``, between 0 and 1.

        The interval of `p_i` follows from profile likelihood: fix `p_i`, fit the other parameters
        within their bounds; the interval has all `p_i` where χ² rises by `Δχ² ≤ q²`. q is the
        quantile of a normal variable. For a linear model the interval is value ± q·std. For other
        models it may be asymmetric. A limit is -inf or inf if Δχ² stays below `q²` up to the bound
        of the parameter, or as far as the model exists: then the measurements set no limit.

        This predicts all measurements some 30 P² times; ``progress`` shows a bar on the standard
        error, if that is a terminal. If the σ are known only up to a common factor, widen them by
        the square root of :attr:`reduced_chi_square` and identify again. Another minimum of χ² that
        fits as well stays unknown: try other starts of :func:`identify`.

        Raises:
            InvalidInput: ``level`` is not between 0 and 1; or χ² is lower elsewhere, where the
                error says.
        """
        if not 0.0 < (level := scalar("level", level)) < 1.0:
            raise InvalidInput("level", f"{level:g} given; it must lie between 0 and 1, as 0.95.")
        problem = self.problem
        rise = float(ndtri((1.0 + level) / 2.0) ** 2)
        best = problem.point(self.values)
        jacobian = self.jacobian * problem.slope(best)
        intervals = dict[str, tuple[float, float]]()
        counted = problem.counted("finding the confidence of the parameters: predictions")
        with progress_allowed(progress), counted:
            for i in range(best.size):
                known = math.isfinite(self.std[i])
                limits = profile_interval(problem, best, jacobian, i, rise) if known else None
                intervals[self.names[i]] = limits or (-math.inf, math.inf)
        return intervals

    def __str__(self) -> str:
        half = float(ndtri(0.975)) * self.std
        numbers = np.column_stack([self.values, self.std, self.values - half, self.values + half])
        rows = np.column_stack([numbers, self.bounds])
        lines: list[Sequence[str]] = [
            ("parameter [own unit]", "value", "std", "95 % from", "to", "low", "high")
        ]
        for name, row in zip(self.names, rows, strict=True):
            lines.append((name, *(f"{x:.4g}" for x in row)))
        tests: list[Sequence[str]] = [("measurement", "measured", "predicted", "worst residual")]
        for i, measurement in enumerate(self.measurements):
            rows = self.measurement_of == i
            texts = measurement.described(self.measured[rows], self.predicted[rows])
            worst = f"{max(self.residuals[rows], key=abs):.2f} σ"
            tests.append((measurement_name(i, measurement.label), *texts, worst))
        note = "(95 % from the std of the linear model; in Python, confidence() profiles χ²)"
        model = f"({frictionless_model(self.arm)}; secant where a force is given; "
        pulled = self.arm.has_friction and any(
            isinstance(m, TipPosition) for m in self.measurements
        )
        model += f"loops with friction; tips at rest{', pulled with friction' * pulled})"
        warned = self.correlated()
        ridges = [self.ridge(i, j) for i, j in self.correlated(_RIDGED) if (i, j) not in warned]
        shown = [*aligned(lines), note, *ridges, "", *aligned(tests), model, "", self.verdict]
        return "\n".join([*shown, *self.warnings])

    @property
    def reading_names(self) -> list[str]:
        """Name of each of the n measured numbers: the label, and the force's number or the axis."""
        pairs = enumerate(self.measurements)
        return [
            f"{measurement_name(i, measurement.label)}{suffix}"
            for i, measurement in pairs
            for suffix in measurement.reading_suffixes
        ]

    @property
    def verdict(self) -> str:
        """χ² with its probability: of right models and σ, so many have a smaller one."""
        text = chi_square_text(self.chi_square, self.freedom)
        return f"{text}, rank {self.rank} of {len(self.names)}"

    @cached_property
    def _determination(self) -> Determination:
        return Determination(self.names, self.jacobian, np.ptp(self.bounds, axis=1))

    def _labels(self) -> dict[str, Sequence[object]]:
        names = {"parameter": self.names, "other_parameter": self.names, "bound": ("low", "high")}
        return {**super()._labels(), **names}
