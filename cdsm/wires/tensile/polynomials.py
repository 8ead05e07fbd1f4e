"""Fit EA(F) by the method of the paper: two polynomials through measured slopes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.polynomial import Polynomial

from cdsm.errors import TensileTestError
from cdsm.support.validation import RANGES
from cdsm.support.values import Array
from cdsm.wires.laws import StrandElasticity
from cdsm.wires.tensile.loading import Points

_DEGREE = 6  # as in Eq. 19
_NARROW = 0.1  # least width of a range, as a share of its largest tension
_HALF = 3  # number of neighbours on each side that give a slope
_FEWEST = 2 * _HALF + 2 * (_DEGREE + 1)  # points: twice as many slopes as coefficients


def polynomials(points: Points, join: float) -> tuple[StrandElasticity, tuple[str, ...]]:
    """Fit two polynomials EA(F) that meet at ``join`` [N] to measured slopes; if few points, one.

    Return the law on the longest range where EA > 0, and a note if this is not the whole range.
    Raises TensileTestError if there are too few points, or EA > 0 on less than half of the range.
    """
    if len(points.force) < _FEWEST:
        raise TensileTestError(
            f"only {len(points.force)} points are left, and polynomials of degree {_DEGREE} need "
            f"at least {_FEWEST}. Use method='monotone', or sample more finely."
        )
    low, high = float(points.force[0]), float(points.force.max())
    low = low if low >= RANGES["tension"].low else 0.0
    joins = _joins_of(points, join)
    rows = _coefficients(points, joins)
    start, end = max(_positive(rows, (low, *joins, high)), key=lambda each: each[1] - each[0])
    if end - start < (high - low) / 2.0:
        raise TensileTestError(
            "the polynomials give no positive rigidity on half of the range "
            f"{low:.4g} N to {high:.4g} N. Use method='monotone', or another join."
        )
    if joins and not start < join < end:
        rows, joins = [rows[int(start >= join)]], ()
    law = StrandElasticity(tuple(map(tuple, rows)), joins, start, end)
    if (start, end) == (low, high):
        return law, ()
    note = (
        f"the polynomials are not positive beyond {start:.4g} N to {end:.4g} N: "
        "the domain is cut to that"
    )
    return law, (note,)


def _positive(rows: list[list[float]], edges: tuple[float, ...]) -> list[tuple[float, float]]:
    """Find the ranges of tension [N] where a piecewise polynomial is positive.

    ``rows`` has the coefficients of each polynomial, lowest power first. Polynomial i is valid from
    ``edges[i]`` to ``edges[i + 1]`` [N].
    """
    tensions = np.linspace(edges[0], edges[-1], 400)
    parts = [Polynomial(row)(tensions) for row in rows]
    values = np.choose(np.searchsorted(edges[1:-1], tensions), parts)
    margin = 1e-6 * float(abs(values).max())  # keeps the strain ∫ dF/EA finite
    ranges = [(edges[0], edges[0])]
    for row, low, high in zip(rows, edges[:-1], edges[1:], strict=True):
        rounding = 1e-13 * float(Polynomial(np.abs(row))(high))  # rounding of powers that cancel
        above = Polynomial(row) - max(margin, rounding)
        # the sign is constant between roots; a grid could miss a short dip
        roots = above.roots()
        real = np.sort(roots.real[abs(roots.imag) <= 1e-9 * abs(roots)])
        cuts = [low, *real[(real > low) & (real < high)].tolist(), high]
        for start, end in pairwise(cuts):
            if above((start + end) / 2.0) <= 0.0:
                continue
            if ranges[-1][1] == start:
                start = ranges.pop()[0]
            ranges.append((start, end))
    return ranges


def _joins_of(points: Points, join: float) -> tuple[float, ...]:
    """Return (``join``,), or () if the points allow only one polynomial.

    That is so if there are too few points below or above the join, or their range of forces is too
    narrow.
    """
    below = int(np.count_nonzero(points.force <= join))
    enough = 2 * (_DEGREE + 1)
    low, high = float(points.force.min()), float(points.force.max())
    # powers of nearly equal tensions cancel, and only rounding is left
    wide = join - low >= _NARROW * join and high - join >= _NARROW * high
    return (join,) if wide and min(below, len(points.force) - below) >= enough else ()


def _coefficients(points: Points, joins: tuple[float, ...]) -> list[list[float]]:
    """Fit polynomials EA(F) to measured slopes; return their coefficients, lowest power first.

    There is one polynomial for each range between ``joins`` [N]. Two polynomials share the value v
    at the join. With y = F − join, they are v + Σ a_k yᵏ and v + Σ b_k yᵏ: one linear least-squares
    problem in v, a and b.
    """
    slopes, forces = _slopes(points)
    if not joins:
        return [Polynomial.fit(forces, slopes, _DEGREE).convert().coef.tolist()]
    (join,) = joins
    below = forces <= join
    widths = join - float(forces.min()), float(forces.max()) - join
    y = (forces - join) / np.where(below, *widths)
    powers = y[:, None] ** np.arange(1, _DEGREE + 1)
    design = np.hstack([np.ones((len(y), 1)), powers * below[:, None], powers * ~below[:, None]])
    value, *rest = np.linalg.lstsq(design, slopes, rcond=None)[0].tolist()
    return [
        Polynomial([value, *terms], [join, join + width], [0.0, 1.0]).convert().coef.tolist()
        for terms, width in zip((rest[:_DEGREE], rest[_DEGREE:]), widths, strict=True)
    ]


def _slopes(points: Points) -> tuple[Array, Array]:
    """Fit a line through each point and its three neighbours on either side.

    Returns the slopes dF/dε [N] and the mean forces [N].
    """
    window = 2 * _HALF + 1
    strain, force = (
        np.lib.stride_tricks.sliding_window_view(each, window)
        for each in (points.strain, points.force)
    )
    offset = strain - strain.mean(axis=1, keepdims=True)
    return (offset * force).sum(axis=1) / (offset**2).sum(axis=1), force.mean(axis=1)
