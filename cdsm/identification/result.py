"""Result of an identification: values, uncertainty, and undetermined combinations."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, final

import numpy as np
from scipy.special import ndtri, stdtrit

from cdsm.errors import InvalidInput
from cdsm.identification.determination import Determination
from cdsm.identification.intervals import NEGLIGIBLE, Profile
from cdsm.identification.loop import WeightLoop, measured
from cdsm.identification.measurement import Measurement, label
from cdsm.manipulator import Manipulator
from cdsm.support.format import MODEL, plain
from cdsm.support.validation import flag, scalar
from cdsm.support.values import Array, ReadOnlyState, frozen

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_LINEAR = 1.5  # an interval is printed as not linear if it is so many times wider or narrower


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Identification(ReadOnlyState):
    """Parameters of an arm that explain its measurements best; made by :func:`identify`.

    There are P parameters and n measured numbers: one for each stiffness, and all readings of each
    loop. Each parameter has the unit in which ``model_of`` takes it. All arrays are read-only.

    Attributes:
        names: Names of the parameters, in the order of every (P,) array.
        values: Values of the parameters (P,) [m, kg, N/m, …].
        bounds: Bounds of the parameters (P, 2), low and high [m, kg, N/m, …].
        measurements: The measurements.
        predicted: Predicted numbers (n,): stiffnesses [N/m], and readings of loops [m] with fitted
            offsets.
        residuals: Residuals r (n,) in standard deviations [-]. For a stiffness, r is (predicted −
            measured)/σ; for a reading of a loop with the fitted
            offset.
        jacobian: J = ∂r/∂p (n, P) [1/m, m/N, …].
        arm: Arm with these values.
        warnings: One sentence for each reason not to trust the result; empty if there is none.
        profiles: One :class:`Profile` of χ² for each parameter; None if it is not determined, or if
            :attr:`warnings` say why there are no intervals.
    """

    names: tuple[str, ...]
    values: Array
    bounds: Array
    measurements: tuple[Measurement | WeightLoop, ...]
    predicted: Array
    residuals: Array
    jacobian: Array
    arm: Manipulator
    warnings: tuple[str, ...]
    profiles: tuple[Profile | None, ...]

    @property
    def parameters(self) -> dict[str, float]:
        """Values of the parameters by name, in the units of ``model_of``."""
        return dict(zip(self.names, self.values.tolist(), strict=True))

    @cached_property
    def measured(self) -> Array:
        """Measured numbers (n,): stiffnesses [N/m], and tip displacements of weight loops [m]."""
        return frozen(np.concatenate([measured(each) for each in self.measurements]))

    @property
    def chi_square(self) -> float:
        """χ² = Σ r² [-]. It is about :attr:`freedom` if the model and all σ are right."""
        return float(self.residuals @ self.residuals)

    @property
    def freedom(self) -> int:
        """Degrees of freedom of χ²: n − :attr:`rank`, less one offset per axis of each loop."""
        loops = (each for each in self.measurements if isinstance(each, WeightLoop))
        zeros = sum(len(loop.axes) for loop in loops)
        return len(self.predicted) - zeros - self.rank

    @property
    def reduced_chi_square(self) -> float:
        """χ² per degree of freedom [-]; inf without degrees of freedom."""
        return self.chi_square / self.freedom if self.freedom else math.inf

    @property
    def rank(self) -> int:
        """Number of combinations of parameters that the measurements determine, at most P."""
        return self._determination.rank

    @property
    def covariance(self) -> Array:
        """Covariance (JᵀJ)⁻¹ (P, P) [m², m kg, …] for the given σ, not scaled by χ².

        If only the ratios of the σ are known, multiply it by :attr:`reduced_chi_square`. The bounds
        have no influence. An undetermined parameter has infinite variance.
        """
        return self._determination.covariance

    @cached_property
    def std(self) -> Array:
        """Standard deviations of the parameters (P,) [m, kg, N/m, …]."""
        return frozen(np.sqrt(np.diag(self.covariance)))

    @property
    def correlation(self) -> Array:
        """Correlations (P, P) [-]; ±1 for two parameters with only one combination determined."""
        return self._determination.correlation

    def confidence(
        self, level: float = 0.95, *, scaled: bool = False
    ) -> dict[str, tuple[float, float]]:
        """Compute an interval (low, high) for each parameter, by name [m, kg, N/m, …].

        It contains the true value with the probability ``level``.

        The interval of p_i follows from profile likelihood: fix p_i, fit the other parameters
        within their bounds; the interval has all p_i where χ² rises by Δχ² ≤ q². q is the quantile
        of a normal variable. For a linear model the interval is value ± q·std. For other models it
        may be asymmetric. A limit is -inf or inf if Δχ² stays below q² up to the bound of the
        parameter, or as far as the model exists. Then the measurements set no limit, and
        :attr:`warnings` report it at 95 %.

        No parameter has a limit if the fit is not an optimum; :attr:`warnings` say so. Another
        minimum of χ² that fits as well stays unknown: try other starts of :func:`identify`.

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

    def to_dict(self) -> dict[str, object]:
        """Return the result as plain numbers for JSON; each parameter in its own unit."""
        intervals = self.confidence()
        return plain(
            {
                "parameters": {
                    name: {"value": value, "std": std, "interval_95": intervals[name]}
                    for name, value, std in zip(self.names, self.values, self.std, strict=True)
                },
                "correlation": self.correlation,
                "chi_square": self.chi_square,
                "degrees_of_freedom": self.freedom,
                "rank": self.rank,
            }
        )

    def plot(self) -> Figure:
        """Plot predicted and measured stiffnesses [N/mm] and loops [mm], and residuals in σ."""
        from cdsm.plots.measured import plot_identification  # matplotlib imports slowly

        return plot_identification(self, self._labels, self._verdict)

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value:.4g}" for name, value in self.parameters.items())
        return f"<Identification {values}; {self._verdict}>"

    def __str__(self) -> str:
        columns = ("value", "std", "95 % from", "to", "low", "high")
        intervals = list(self.confidence().values())
        numbers = np.column_stack([self.values, self.std, intervals, self.bounds])
        lines = [_row("parameter [own unit]", *columns), *map(_row, self.names, *numbers.T)]
        lines += [*self._nonlinear_rows(), "", *self._stiffness_rows(), *self._loop_rows(), ""]
        lines.append(self._verdict)
        return "\n".join([*lines, *(f"warning: {sentence}" for sentence in self.warnings)])

    def _nonlinear_rows(self) -> list[str]:
        """Return the line that names parameters whose 95 % interval differs much from ±1.96 std.

        The list is empty if there is no such parameter.
        """
        low, high = np.array(list(self.confidence().values())).T
        ratio = (high - low) / (2.0 * math.sqrt(self._rise(0.95, scaled=False)) * self.std)
        chosen = np.isfinite(ratio) & ((ratio > _LINEAR) | (ratio < 1.0 / _LINEAR))
        names = ", ".join(name for name, bent in zip(self.names, chosen, strict=True) if bent)
        return [f"(not linear: trust the interval, not the std, of {names})"] if names else []

    def _stiffness_rows(self) -> list[str]:
        chosen = [k for k, each in enumerate(self._rows) if isinstance(each, Measurement)]
        if not chosen:
            return []
        names = [self._labels[k] for k in chosen]
        numbers = self.measured[chosen] / 1e3, self.predicted[chosen] / 1e3
        residuals = [f"{residual:.2f}" for residual in self.residuals[chosen]]
        return [
            _row("measurement", "measured", "predicted", "residual"),
            _row("", "[N/mm]", "[N/mm]", "[σ]"),
            *map(_row, names, *numbers, residuals),
            f"({MODEL}; secant where a force is given)",
        ]

    def _loop_rows(self) -> list[str]:
        rows = []
        for i, each in enumerate(self.measurements):
            if isinstance(each, WeightLoop):
                own = [k for k, row in enumerate(self._rows) if row is each]
                off = 1e6 * (self.predicted - self.measured)[own]
                spread = 1e6 * float(np.ptp(self.measured[own]))
                worst = f"{max(self.residuals[own], key=abs):.2f}"
                rms = float(np.sqrt(np.mean(off**2)))
                rows.append(_row(label(i, each), len(own), spread, rms, worst))
        if rows:
            rows.insert(0, _row("loop", "readings", "range", "rms off", "worst"))
            rows.insert(1, _row("", "", "[µm]", "[µm]", "[σ]"))
        return rows

    @cached_property
    def _rows(self) -> list[Measurement | WeightLoop]:
        """The measurement to which each of the n measured numbers belongs."""
        return [each for each in self.measurements for _ in measured(each)]

    @cached_property
    def _determination(self) -> Determination:
        return Determination(self.names, self.jacobian, np.ptp(self.bounds, axis=1))

    @property
    def _labels(self) -> list[str]:
        """Name of each of the n measured numbers: the label, and for loops the force's number."""
        names = []
        for i, each in enumerate(self.measurements):
            own = label(i, each)
            if isinstance(each, WeightLoop):
                numbers = np.repeat(np.arange(len(each.forces)) + 1, len(each.axes))
                names += [f"{own} force {number}" for number in numbers]
            else:
                names.append(own)
        return names

    @property
    def _verdict(self) -> str:
        return (
            f"χ² = {self.chi_square:.4g} with {self.freedom} degrees of freedom, "
            f"rank {self.rank} of {len(self.names)}"
        )

    def _rise(self, level: float, *, scaled: bool) -> float:
        """Compute Δχ² [-], the rise of χ² at the limits of a confidence interval of this ``level``.

        :meth:`confidence` explains ``scaled``.
        """
        half = (1.0 + level) / 2.0
        if not scaled:
            return float(ndtri(half) ** 2)
        if not self.freedom:
            return math.inf
        return float(stdtrit(self.freedom, half) ** 2) * self.reduced_chi_square

    @property
    def _goals(self) -> tuple[list[float], float]:
        """Values of Δχ² [-] that profiles reach: at the 95 % limits, ascending, and at the end.

        The 95 % limits are those with and without ``scaled``; see :meth:`confidence`.
        """
        exact, far = [self._rise(0.95, scaled=False)], self._rise(0.999, scaled=False)
        if self.freedom:
            exact.append(self._rise(0.95, scaled=True))
            far = max(far, self._rise(0.99, scaled=True))
        # without noise, χ² and all it scales are rounding
        return sorted(rise for rise in exact if rise > NEGLIGIBLE), far


def _row(name: str, *cells: object) -> str:
    """Write one line of a table: ``name`` and ``cells``; floats have four digits."""
    texts = (f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in cells)
    return f"{name:<22}" + "".join(f"{text:>12}" for text in texts)
