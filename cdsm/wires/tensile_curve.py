"""Fit a curve EA(F) to the loading branch of a tensile test.

ln EA is a spline of the tension, on a scale that is half logarithmic and half linear; the strain is
the integral of 1/EA. The penalty on the second differences of ln EA is the one of the largest
restricted likelihood (REML; S. N. Wood, Generalized Additive Models, 2017, section 6.2).
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import BSpline
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import least_squares, minimize_scalar

from cdsm.support.values import Array
from cdsm.wires.tensile_branch import refuse

_SPLINES: Final = 36  # splines, tensions of the grid, points (more are averaged)
_GRID = 600
_MOST = 400
_JUMP = 10.0  # EA over the steepest measured chord; beyond it, the curve has overshot a jump
_PARTS = 6  # part of the points over which their scatter is averaged
_FEWEST_NEAR = 20  # fewest points of such an average
_ROUGHER = 100.0  # smoothing of the fit over that of the curve for the band


class FittedCurve(NamedTuple):
    """The fitted curve on a grid of g tensions."""

    tension: Array  # (g,) [N]
    strain: Array  # (g,) [-]
    level: Array  # ln EA (g,)
    rough: Array  # ln EA of a rougher curve, whose bias is far below its scatter (g,)
    deviation: Array  # root of variance and squared bias of ``rough`` (g,)
    correlation: float  # of neighbouring residuals


def _grid(force: Array, noise: float) -> tuple[Array, Array]:
    """Return a grid of tensions (g,) [N] from the first load on, and the splines there (g, k)."""
    low = max(float(force.min()) - 3.0 * noise, 0.0)
    high = float(force.max())
    corner = max(low, 8.0 * noise, 5e-3 * high)
    top = np.log1p((high - low) / corner)
    fine = low + corner * np.expm1(np.linspace(0.0, top, 8 * _GRID))
    place = (np.log1p((fine - low) / corner) / top + (fine - low) / (high - low)) / 2.0
    t = np.linspace(0.0, 1.0, _GRID)
    splines = min(_SPLINES, 4 + len(force) // 3)
    knots = np.arange(-3, splines + 1) / (splines - 3)
    rows = BSpline.design_matrix(np.minimum(t, 1.0 - 1e-12), knots, 3).toarray()
    return np.interp(t, place, fine), rows


def _local_squares(error: Array, strain: Array) -> Array:
    """Return the mean square of the errors (n,) near each strain.

    Noise of the displacement counts as EA times as much force: it is larger where EA is.
    """
    order = np.argsort(strain, kind="stable")
    half = max(len(error) // _PARTS, _FEWEST_NEAR) // 2
    total = np.concatenate([[0.0], np.cumsum(error[order] ** 2)])
    places = np.arange(len(error))
    first = np.clip(places - half, 0, None)
    last = np.clip(places + half + 1, None, len(error))
    squares = np.empty_like(error)
    squares[order] = (total[last] - total[first]) / (last - first)
    return squares


def fit_curve(strain: Array, force: Array, noise: float, resolution: float = 0.0) -> FittedCurve:
    """Fit a curve to points with ``noise`` [N] in their forces, and choose its smoothing.

    Steps of a load cell of this ``resolution`` [N] may drift along a ramp, and look like bends of
    EA: errors below it do not count for the smoothing.

    The parameters x are the k coefficients of ln EA and the strain at the stiff end, over the range
    of the strain.
    """
    groups = np.array_split(np.arange(len(force)), min(len(force), _MOST))
    strain, force = (np.array([a[group].mean() for group in groups]) for a in (strain, force))
    count = np.array([len(group) for group in groups])
    weight = np.sqrt(count / count.mean())
    tension, splines = _grid(force, noise)
    n = len(force)
    k = splines.shape[1]
    span = np.ptp(strain)
    reach = np.ptp(force)
    bends = np.hstack([np.diff(np.eye(k), 2, axis=0), np.zeros((k - 2, 1))])
    upper = np.argsort(strain)[n // 2 :]
    chord = np.polyfit(strain[upper], force[upper], 1)[0]
    start = np.log(max(chord, 1e-3 * reach / span))

    def curve(x: Array) -> tuple[Array, Array]:
        """Return EA (g,) and strain (g,); a step too far does no harm."""
        EA = np.exp(np.clip(splines @ x[:-1], start - 16.0, start + 6.0))
        total = cumulative_trapezoid(1.0 / EA, tension, initial=0.0)
        return EA, x[-1] * span + total - total[-1]

    def error(x: Array) -> Array:
        """Return weighted errors (n,) [N]; the curve is straight beyond its ends."""
        EA, grid = curve(x)
        beyond = np.minimum(strain - grid[0], 0.0) * EA[0]
        beyond += np.maximum(strain - grid[-1], 0.0) * EA[-1]
        fitted = np.interp(strain, grid, tension) + beyond
        return np.asarray(weight * np.clip(fitted - force, -1e9, 1e9))

    def slope(x: Array) -> Array:
        EA, grid = curve(x)
        by = cumulative_trapezoid(splines / EA[:, None], tension, axis=0, initial=0.0)
        rows = EA[:, None] * np.hstack([by - by[-1], np.full((len(EA), 1), -span)])
        i = np.clip(np.searchsorted(grid, strain) - 1, 0, len(grid) - 2)
        s = np.clip((strain - grid[i]) / (grid[i + 1] - grid[i]), 0.0, 1.0)[:, None]
        return np.asarray(weight[:, None] * ((1.0 - s) * rows[i] + s * rows[i + 1]))

    def penalty(power: float) -> Array:
        """Return the root of the penalty S for a smoothing of 10^power units."""
        return np.asarray(max(noise, 1e-4 * reach) * 10.0 ** (power / 2.0) * bends)

    def solve(power: float, x: Array) -> tuple[Array, float, Array]:
        """Return x, −2 log likelihood and (JᵀJ + S)⁻¹ for a smoothing of 10^power units."""
        root = penalty(power)
        x = least_squares(
            lambda x: np.append(error(x), root @ x),
            x,
            lambda x: np.vstack([slope(x), root]),
            method="lm",
            max_nfev=80,
            xtol=1e-6,
            ftol=1e-6,
        ).x
        J = slope(x)
        r = error(x)
        normal = J.T @ J + root.T @ root
        scale = np.sqrt(np.diag(normal))  # strain and ln EA are orders apart
        factor = cho_factor(normal / np.outer(scale, scale) + 1e-11 * np.eye(k + 1))
        inverse = cho_solve(factor, np.eye(k + 1)) / np.outer(scale, scale)
        left = r @ r + n * max(1e-6 * reach, resolution) ** 2
        score = (n - 3) * np.log(left + np.sum((root @ x) ** 2))
        score += 2.0 * np.log(np.diag(factor[0]) * scale).sum() - (k - 2) * np.log(10.0) * power
        return x, float(score), inverse

    x = np.append(np.full(k, start), strain.max() / span)
    scores = {}
    for power in (6, 4, 2, 0, -2, -4):  # from a straight ln EA on: each start is near
        x, score, _ = solve(power, x)
        scores[score] = power, x
    power, x = scores[min(scores)]
    around = {"bounds": (power - 2, power + 2), "method": "bounded", "options": {"xatol": 0.2}}
    best = minimize_scalar(lambda p: solve(p, x)[1], **around).x
    x = solve(best, x)[0]
    rougher = best - np.log10(_ROUGHER)
    rough, _, inverse = solve(rougher, x)
    root = penalty(rougher)
    J = slope(rough)
    freedom = max(n - float(np.sum((J @ inverse) * J)), 1.0)
    local = _local_squares(error(rough), strain) * n / freedom
    covariance = inverse @ (J.T * local) @ J @ inverse
    variance = np.sum((splines @ covariance[:-1, :-1]) * splines, axis=1)
    bias = splines @ (inverse @ (root.T @ (root @ x)))[:-1]
    (EA, grid) = curve(x)
    r = error(x)
    order = np.argsort(strain, kind="stable")
    step = max(1, n // 50)
    rise, along = (a[order[step:]] - a[order[:-step]] for a in (force, strain))
    if EA.max() > _JUMP * np.max(rise / np.maximum(along, 1e-4 * span)):
        refuse(
            f"the force is discontinuous near {tension[EA.argmax()]:.4g} N, and no smooth curve "
            "follows it. Look for a wire gripped anew, or units that change midway."
        )
    correlation = float(r[1:] @ r[:-1] / (r @ r or 1.0))
    if np.std(r) < max(1e-4 * reach, resolution / 2.0):  # what is left is no noise
        correlation = 0.0
    level = splines @ rough[:-1]
    return FittedCurve(tension, grid, np.log(EA), level, np.sqrt(variance + bias**2), correlation)
