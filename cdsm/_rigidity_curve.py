"""A smooth, positive rigidity curve through noisy points of force over strain.

log EA is a cubic B-spline in a coordinate that spreads both small and large tensions, so EA > 0 and
F(ε) is C1 whatever the data. What is fitted is the force at each strain, never a quotient of
differences, which noise would swamp. How smooth: restricted likelihood, from the data themselves.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import least_squares

from cdsm._checks import Array

_INTERVALS = 48
_GRID = 1200  # quadrature error below 1e-4 of the strain where EA varies thousandfold


def _running_integral(values: Array, tensions: Array, axis: int = -1) -> Array:
    """∫ values dF from the first tension to each, by the trapezoidal rule."""
    from scipy.integrate import cumulative_trapezoid  # only where wanted: it imports slowly

    integral: Array = cumulative_trapezoid(values, tensions, axis=axis, initial=0.0)
    return integral


@dataclass(frozen=True)
class Points:
    """Averaged points of a test, strain rising: strain [-], force [N], and how many each averages.

    All three have shape (n,).
    """

    strain: Array
    force: Array
    count: Array

    def part(self, kept: NDArray[np.bool_] | slice) -> Points:
        """The points at the given places."""
        return Points(self.strain[kept], self.force[kept], self.count[kept])


@dataclass(frozen=True)
class Basis:
    """B-splines (g, k) over a grid of tensions (g,) [N], and their roughness (k, k)."""

    tensions: Array
    splines: Array
    roughness: Array

    @classmethod
    def over(cls, low: float, high: float, corner: float, points: int) -> Basis:
        """Splines over [low, high] N, evenly spread in ½ log(F + corner) + ½ F, each scaled to 1.

        Args:
            low: Smallest tension [N].
            high: Largest tension [N].
            corner: Tension [N] below which the spacing is even.
            points: Number of points to be fitted.
        """
        fine = low + corner * np.expm1(np.linspace(0.0, np.log1p((high - low) / corner), 8 * _GRID))
        place = np.log1p((fine - low) / corner) / np.log1p((high - low) / corner)
        place = (place + (fine - low) / (high - low)) / 2.0
        t = np.linspace(0.0, 1.0, _GRID)
        tensions = np.interp(t, place, fine)
        intervals = int(np.clip(points // 2, 3, _INTERVALS))
        knots = np.pad(np.linspace(0.0, 1.0, intervals + 1), 3, mode="edge")
        # uniform knots beyond the ends make the difference penalty vanish for a straight log EA
        knots[:3] = -np.arange(3, 0, -1) / intervals
        knots[-3:] = 1.0 + np.arange(1, 4) / intervals
        splines = BSpline.design_matrix(t, knots, 3).toarray()
        second = np.diff(np.eye(splines.shape[1]), 2, axis=0)
        return cls(tensions, splines, second.T @ second)


@dataclass(frozen=True)
class Curve:
    """A fitted curve: coefficients of log EA (k,), and the strain at its low end [-]."""

    basis: Basis
    coefficients: Array
    start: float
    smoothing: float

    @cached_property
    def rigidity(self) -> Array:
        """EA (g,) [N] on the grid."""
        return np.asarray(np.exp(self.basis.splines @ self.coefficients))

    @cached_property
    def strain(self) -> Array:
        """ε (g,) [-] on the grid, of the same origin as the points."""
        return self.start + _running_integral(1.0 / self.rigidity, self.basis.tensions)

    def force(self, strain: Array) -> Array:
        """Tension (n,) [N] at strains (n,); straight beyond the ends."""
        tensions, rigidity, grid = self.basis.tensions, self.rigidity, self.strain
        inside = np.interp(strain, grid, tensions)
        before = np.minimum(strain - grid[0], 0.0) * rigidity[0]
        return np.asarray(inside + before + np.maximum(strain - grid[-1], 0.0) * rigidity[-1])

    def jacobian(self, strain: Array) -> Array:
        """Derivative (n, k + 1) of :meth:`force` by the coefficients and the start."""
        tensions, grid = self.basis.tensions, self.strain
        inside = np.clip(strain, grid[0], grid[-1])
        at = np.clip(np.searchsorted(grid, inside) - 1, 0, len(grid) - 2)
        share = ((inside - grid[at]) / (grid[at + 1] - grid[at]))[:, None]
        by_coefficients = _running_integral(
            self.basis.splines / self.rigidity[:, None], tensions, axis=0
        )
        stretch = (1.0 - share) * by_coefficients[at] + share * by_coefficients[at + 1]
        rigidity = (1.0 - share) * self.rigidity[at, None] + share * self.rigidity[at + 1, None]
        beyond = (self.force(strain) - np.interp(strain, grid, tensions))[:, None]
        edge = np.where(strain < grid[0], 0, -1)
        slope = beyond * self.basis.splines[edge]  # the straight ends turn with their EA
        return np.hstack((rigidity * stretch + slope, -rigidity))

    def refitted(self, points: Points, evaluations: int = 60) -> Curve:
        """The curve of the same smoothing through other points, by Levenberg and Marquardt."""
        size = self.basis.splines.shape[1]
        weight = np.sqrt(points.count)
        rough = np.sqrt(self.smoothing) * np.diff(np.eye(size), 2, axis=0)
        rough = np.hstack((rough, np.zeros((size - 2, 1))))
        # strain and log EA are orders apart: the last unknown counts in the span of the strain
        unit = float(np.ptp(points.strain))

        def of(x: Array) -> Curve:
            return replace(self, coefficients=np.clip(x[:-1], -30.0, 40.0), start=x[-1] * unit)

        def residual(x: Array) -> Array:
            error = weight * (of(x).force(points.strain) - points.force)
            return np.concatenate((np.clip(error, -1e12, 1e12), rough @ x))

        def slope(x: Array) -> Array:
            rows = weight[:, None] * of(x).jacobian(points.strain)
            rows[:, -1] *= unit
            return np.vstack((rows, rough))

        x = np.append(self.coefficients, self.start / unit)
        found = least_squares(
            residual, x, slope, method="lm", max_nfev=evaluations, xtol=1e-6, ftol=1e-6
        )
        return of(found.x)

    def spread(self, points: Points) -> tuple[Array, float, Array]:
        """Covariance (k + 1, k + 1) of the unknowns, noise of one point [N], leverages (n,)."""
        rows = np.sqrt(points.count)[:, None] * self.jacobian(points.strain)
        penalty = np.zeros((rows.shape[1], rows.shape[1]))
        penalty[:-1, :-1] = self.smoothing * self.basis.roughness
        normal = rows.T @ rows + penalty
        # scaled to a unit diagonal: the start of the curve counts in other units
        scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
        regular = normal / np.outer(scale, scale) + 1e-10 * np.eye(len(scale))
        inverse = cho_solve(cho_factor(regular), np.eye(len(scale))) / np.outer(scale, scale)
        leverage = np.clip(((rows @ inverse) * rows).sum(axis=1), 0.0, 1.0)
        error = points.force - self.force(points.strain)
        freedom = max(len(error) - leverage.sum(), 1.0)
        variance = float((points.count * error**2).sum() / freedom)
        return inverse * variance, np.sqrt(variance), leverage

    def deviation(self, points: Points) -> Array:
        """Standard deviation (g,) of log EA on the grid."""
        splines = self.basis.splines
        covariance = self.spread(points)[0][:-1, :-1]
        return np.asarray(np.sqrt(((splines @ covariance) * splines).sum(axis=1)))


def fit_curve(points: Points, basis: Basis, noise: float) -> Curve:
    """Fit the curve, its smoothing by restricted likelihood (Fellner and Schall's iteration).

    Args:
        points: What to fit.
        basis: Where log EA may bend.
        noise: First estimate of the noise of one point [N], and a floor for it.
    """
    tensions = basis.tensions
    size = basis.splines.shape[1]
    # start: secants between the points, coarse enough to be positive
    force = np.maximum.accumulate(points.force) + 1e-9 * tensions[-1] * np.arange(len(points.force))
    places = tensions[:: _GRID // 12]
    secants = np.diff(places) / np.maximum(
        np.diff(np.interp(places, force, points.strain)), 1e-3 * np.ptp(points.strain) / 12
    )
    guess = np.interp(tensions, (places[1:] + places[:-1]) / 2.0, np.log(secants))
    ridge = basis.splines.T @ basis.splines + 1e-3 * basis.roughness + 1e-9 * np.eye(size)
    coefficients: Array = np.linalg.solve(ridge, basis.splines.T @ guess).astype(np.float64)
    floor = (1e-6 * float(np.ptp(points.force))) ** 2
    smoothing = 10.0 * max(noise**2, floor)
    curve = Curve(basis, coefficients, float(points.strain[0]), smoothing)
    for _ in range(25):
        curve = curve.refitted(points)
        covariance, sigma, _ = curve.spread(points)
        variance = max(sigma**2, floor)
        rough = float(curve.coefficients @ basis.roughness @ curve.coefficients)
        known = np.trace(covariance[:-1, :-1] @ basis.roughness) / max(sigma**2, 1e-300)
        bends = max(size - 2 - curve.smoothing * known, 1e-3)
        wanted = variance * bends / max(rough, 1e-12)
        wanted = float(np.clip(wanted, 1e-6 * variance, 1e8 * variance))
        if abs(np.log(wanted / curve.smoothing)) < 0.05:
            break
        curve = replace(curve, smoothing=wanted)
    return curve
