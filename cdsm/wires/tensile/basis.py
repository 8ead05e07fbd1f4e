"""Build B-splines for log EA as a function of the tension, for the fit of a tensile test."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from cdsm.support.values import Array
from cdsm.wires.tensile.loading import Points

_INTERVALS = 48  # of the spline, at most; more do not change the curve of a wire
_GRID = 1200  # tensions: strain error below 1e-4 where EA varies thousandfold


class Basis(NamedTuple):
    """B-splines of log EA on a grid of tensions, with their roughness penalty."""

    tensions: Array  # grid (g,) [N]
    splines: Array  # values of k splines on the grid (g, k)
    roughness: Array  # matrix (k, k) of the roughness penalty

    @classmethod
    def of(cls, points: Points, noise: float) -> Basis:
        """Build splines from F_0, 3 ``noise`` [N] below the first force, to the largest force.

        F_0 is not below zero. The knots are equally spaced in the mean of log(F − F_0 + corner) and
        F, each scaled to 0…1. The corner is F_0, but at least 8 times the noise and 0.5 % of the
        largest force. From F_0 up to F_0 + corner, the knots are nearly equally spaced in F; far
        above, they are wider apart.
        """
        low, high = max(float(points.force[0]) - 3.0 * noise, 0.0), float(points.force.max())
        corner = max(low, 8.0 * noise, 5e-3 * high)
        fine = low + corner * np.expm1(np.linspace(0.0, np.log1p((high - low) / corner), 8 * _GRID))
        place = np.log1p((fine - low) / corner) / np.log1p((high - low) / corner)
        place = (place + (fine - low) / (high - low)) / 2.0
        t = np.linspace(0.0, 1.0, _GRID)
        intervals = int(np.clip(len(points.force) // 2, 3, _INTERVALS))
        # with uniform knots beyond the ends, a straight log EA has no difference penalty
        beyond = np.arange(1, 4) / intervals
        knots = np.concatenate((-beyond[::-1], np.linspace(0.0, 1.0, intervals + 1), 1.0 + beyond))
        splines = BSpline.design_matrix(t, knots, 3).toarray()
        second = np.diff(np.eye(splines.shape[1]), 2, axis=0)
        return cls(np.interp(t, place, fine), splines, second.T @ second)
