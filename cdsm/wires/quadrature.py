"""Integrate Fⁿ dF/p(F) over piecewise polynomials p, to rounding, by a Gauss rule on panels.

With p = EA, n = 0 gives the strain of a wire and n = 1 its energy. A panel is an interval of F.

1/p is analytic except at the roots of p. For an interval, take the ellipse whose foci are the two
ends and which passes through the nearest root. ρ is the sum of its half-axes, divided by the
half-width of the interval. The error of a Gauss rule on the interval falls by ρ² per node. So the
panels are chosen from the roots, with ρ of 6 or more where possible. On a part of a panel the rule
is even more accurate.

scipy's quad takes about 300 times as long (tests/benchmarks/test_equilibrium_speed.py). Bisection,
until rules of 12 and 24 nodes agree, needs no roots. But near a root, the rounding of p keeps the
two rules apart: roots at 50 ± 1e-4 i N give more than 1e5 panels, and only 76 with this method.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, zip_longest
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from cdsm.kernels.compiling import compiled
from cdsm.support.values import Array

NODES, WEIGHTS = (leggauss(12)[0] + 1.0) / 2.0, leggauss(12)[1] / 2.0

_NEAREST = 6.0
"""Least ρ of a panel. The error of 12 nodes is ρ^-24 = 2e-19 times the growth of 1/p."""

_ROUNDING = 1e-14
"""A polynomial below this fraction of the sum of its terms' magnitudes is taken as zero."""

_NEGLIGIBLE = 1e-30  # share of the largest term of a polynomial: a smaller term is neglected
_NARROWEST = 4  # width of a panel in units in the last place; panels shrink towards a root


def coefficient_table(rows: Sequence[Sequence[float]]) -> Array:
    """Return the coefficients of several polynomials as one array (powers, polynomials).

    Each of ``rows`` has the coefficients of a polynomial, lowest power first. Missing powers are
    zero.
    """
    return np.array(list(zip_longest(*rows, fillvalue=0.0)))


def piecewise(joins: Array, table: Array, F: Array) -> Array:
    """Evaluate a piecewise polynomial at F of any shape.

    Column i of ``table`` (powers, polynomials) is the polynomial up to join i, lowest power first.
    """
    return np.asarray(_polynomials(joins, table, F.ravel()).reshape(F.shape))


@compiled
def _polynomials(joins: Array, table: Array, F: Array) -> Array:
    result = np.empty(F.shape[0])
    for i in range(F.shape[0]):
        result[i] = _horner(table, np.searchsorted(joins, F[i]), F[i])
    return result


@compiled
def _horner(table: Array, column: int, F: float) -> float:
    value = 0.0
    for row in range(table.shape[0] - 1, -1, -1):
        value = value * F + table[row, column]
    return value


@compiled
def _integrals(edges: Array, table: Array, before: Array, power: int, F: Array) -> Array:
    """Integrate Fⁿ dF/p(F), n = ``power``, from the low end of the panels to each F (N,).

    ``edges``, ``table`` and ``before`` are the fields ``edges``, ``coefficients`` and ``before`` of
    :class:`Panels`.
    """
    result = np.empty(F.shape[0])
    for i in range(F.shape[0]):
        panel = np.searchsorted(edges[1:-1], F[i])  # an edge belongs to the panel below it
        start = edges[panel]
        width, total = F[i] - start, 0.0
        for node in range(NODES.shape[0]):
            x = start + width * NODES[node]
            part = WEIGHTS[node] / _horner(table, panel, x)
            total += part * x if power else part
        result[i] = before[power, panel] + width * total
    return result


class Panels(NamedTuple):
    """Intervals (panels) of tension on which a Gauss rule integrates; made by :func:`panels`.

    They reach from the low end of a law to its high end, or to :attr:`end`.
    """

    edges: Array  # tensions at which the panels begin and end (P+1,) [N]
    coefficients: Array  # of the polynomial on each panel, lowest power first, (powers, P)
    before: Array  # ∫ Fⁿ dF/p from the low end to the beginning of each panel, n = 0, 1, (2, P)
    end: float  # tension from which p is not positive [N]; inf if p is positive everywhere

    @property
    def pieces(self) -> tuple[Array, Array]:
        """Edges (3, P) and coefficients (powers, P) of the panels, as kernels need them.

        The rows of the edges are the low and the high end of each panel [N], and the strain at its
        low end [-].
        """
        return np.array([self.edges[:-1], self.edges[1:], self.before[0]]), self.coefficients

    def integral(self, F: Array, power: int) -> Array:
        """Compute ∫ Fⁿ dF/p(F), n = ``power``, from the low end of the panels to each F ≤ ``end``.

        p are the polynomials of the panels. F has any shape.
        """
        found = _integrals(self.edges, self.coefficients, self.before, power, F.ravel())
        return np.asarray(found.reshape(F.shape))


def panels(rows: Sequence[Sequence[float]], edges: Sequence[float]) -> Panels:
    """Return panels on which a Gauss rule integrates Fⁿ dF/p(F) to rounding, for polynomials p.

    ``rows`` are the coefficients of each p, lowest power first. Polynomial i is valid from
    ``edges[i]`` to ``edges[i + 1]`` [N]. The panels end where p is no longer positive.
    """
    ends: list[float] = [edges[0]]
    piece: list[int] = []
    end = np.inf
    for index, (row, (low, high)) in enumerate(zip(rows, pairwise(edges), strict=True)):
        p = Polynomial(_significant(row, high))
        end = _end_of_positive(p, low, high)
        inner = _panel_ends(np.asarray(p.roots(), dtype=np.complex128), low, min(end, high))
        ends += inner
        piece += [index] * len(inner)
        if end < np.inf:
            break
    coefficients = coefficient_table(rows)[:, piece]
    table = Panels(np.array(ends), coefficients, np.zeros((2, len(piece))), end)
    whole = np.array([table.integral(table.edges[1:], power) for power in (0, 1)])
    return table._replace(before=np.cumsum(whole, axis=1) - whole)


def _significant(row: Sequence[float], high: float) -> list[float]:
    """Return the coefficients of a polynomial without negligible highest powers.

    A term is negligible if it is below 1e-30 of the largest one at F = ``high``. Such terms would
    cause roots that overflow.
    """
    sizes = abs(np.array(row)) * high ** np.arange(len(row))
    last = np.flatnonzero(sizes > _NEGLIGIBLE * sizes.max()).max(initial=0)
    return list(row[: last + 1])


def _panel_ends(roots: NDArray[np.complex128], low: float, high: float) -> list[float]:
    """Choose panels from ``low`` to ``high`` by the ``roots`` of p; return their upper ends."""
    narrowest = _NARROWEST * np.spacing(high)
    ends: list[float] = []
    intervals = [(low, high)] if low < high else []
    while intervals:
        a, b = intervals.pop()
        # definition of the ellipse: |z − a| + |z − b| is ρ + 1/ρ half-widths
        reach = (abs(roots - a) + abs(roots - b)).min(initial=np.inf) / (b - a)
        if reach >= (_NEAREST + 1.0 / _NEAREST) / 2.0 or b - a <= narrowest:
            ends.append(b)
        else:
            intervals += [((a + b) / 2.0, b), (a, (a + b) / 2.0)]
    return ends


def _end_of_positive(p: Polynomial, low: float, high: float) -> float:
    """Return the first F in [low, high] where p(F) is not above its rounding error; inf if none."""
    rounding = Polynomial(_ROUNDING * abs(p.coef))  # high and low are not negative
    turns = np.sort(p.deriv().roots().real)
    before = low
    for point in (low, *turns[(turns > low) & (turns < high)].tolist(), high):
        if p(point) <= rounding(point):
            if point == low:
                return low
            from scipy.optimize import brentq  # slow to import, and rarely needed

            # subtract the error of the root: at most xtol and rtol together
            found = brentq(p - rounding, before, point, xtol=1e-15 * point, rtol=1e-15)
            return max(low, float(found - 2e-15 * point))
        before = point
    return np.inf
