"""The paper's way from a tensile test to EA(F): two polynomials through measured slopes."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.polynomial import Polynomial

from cdsm._checks import Array
from cdsm._rigidity_curve import Points
from cdsm.errors import TensileTestError
from cdsm.wire import StrandElasticity

_DEGREE = 6
_HALF = 3  # neighbours on each side that a slope is taken over


def polynomials(points: Points, join: float) -> tuple[StrandElasticity, tuple[str, ...]]:
    """Two polynomials of degree 6 through the slopes, on the longest range they are positive on.

    Args:
        points: Of loading, strain rising.
        join: Tension [N] at which they meet; one polynomial if either side has too few points.

    Raises:
        TensileTestError: They are positive on less than half the range.
    """
    joins = joins_of(points, join)
    rows = coefficients(points, joins)
    low, high = max(float(points.force[0]), 0.0), float(points.force.max())
    tensions = np.linspace(low, high, 4001)
    rigidity = evaluate(rows, joins, tensions)
    positive = rigidity > 1e-6 * abs(rigidity).max()
    edges = np.flatnonzero(np.diff(np.pad(positive.astype(int), 1)))
    starts, ends = edges[::2], edges[1::2] - 1
    best = int(np.argmax(ends - starts)) if len(starts) else 0
    if not len(starts) or tensions[ends[best]] - tensions[starts[best]] < (high - low) / 2.0:
        raise TensileTestError(
            "the polynomials give no positive rigidity on half of the range "
            f"{low:.4g} N to {high:.4g} N. Use method='monotone', or another join."
        )
    start, end = float(tensions[starts[best]]), float(tensions[ends[best]])
    inside = [k for k, each in enumerate(joins) if start < each < end]
    pieces = (
        rows[inside[0] : inside[-1] + 2]
        if inside
        else [rows[int(start >= max(joins, default=np.inf))]]
    )
    note = (
        f"the polynomials are not positive beyond {start:.4g} N to {end:.4g} N: "
        "the domain is cut to that"
    )
    law = StrandElasticity(
        tuple(tuple(row) for row in pieces), tuple(joins[k] for k in inside), start, end
    )
    return law, () if positive.all() else (note,)


def joins_of(points: Points, join: float) -> tuple[float, ...]:
    """The join, if both sides of it have points enough for a polynomial."""
    below = int(np.count_nonzero(points.force <= join))
    enough = 2 * (_DEGREE + 1)
    return (join,) if min(below, len(points.force) - below) >= enough else ()


def coefficients(points: Points, joins: tuple[float, ...]) -> list[list[float]]:
    """Least-squares polynomials of the slopes over the force, lowest power first, one per range."""
    slopes, forces = _slopes(points)
    piece = np.searchsorted(joins, forces, side="left")
    rows = []
    for k in range(len(joins) + 1):
        here = piece == k
        if np.count_nonzero(here) <= _DEGREE:  # noise in a bootstrap sample can thin out a range
            here = np.argsort(abs(forces - joins[0]))[: 2 * (_DEGREE + 1)]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", np.exceptions.RankWarning)  # of few or close forces
            fitted = Polynomial.fit(forces[here], slopes[here], _DEGREE)
        rows.append(fitted.convert().coef.tolist())
    return rows


def evaluate(rows: list[list[float]], joins: tuple[float, ...], tensions: Array) -> Array:
    """The polynomials at tensions (n,) [N], EA (n,) [N]."""
    piece = np.searchsorted(joins, tensions, side="left")
    values = np.array([np.polyval(row[::-1], tensions) for row in rows])
    return np.asarray(values[piece, np.arange(len(tensions))])


def _slopes(points: Points) -> tuple[Array, Array]:
    """Slope dF/dε [N] of the line through each point and its neighbours, and its mean force [N]."""
    window = 2 * min(_HALF, (len(points.force) - 1) // 2) + 1
    strain, force = (
        np.lib.stride_tricks.sliding_window_view(each, window)
        for each in (points.strain, points.force)
    )
    offset = strain - strain.mean(axis=1, keepdims=True)
    return (offset * force).sum(axis=1) / (offset**2).sum(axis=1), force.mean(axis=1)
