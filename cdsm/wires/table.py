"""Tables of the strain ε(F) of a wire: polynomials between knots, evaluated without a search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import CdsmError, InvalidInput
from cdsm.support.format import span
from cdsm.support.validation import RANGES
from cdsm.support.values import Array

_CELLS: Final = (200, 400, 800, 1600)  # numbers of pieces that are tried
_ACCURACY: Final = 1e-8, 1e-11  # of EA between two knots; tried if its slope is known
_NEAR: Final = 1.0  # distance [N] from a join within which there is no knot
_NODES, _WEIGHTS = (leggauss(8)[0] + 1.0) / 2.0, leggauss(8)[1] / 2.0


class Table(NamedTuple):
    """The strain ε(F) as polynomials between n + 1 knots; it is zero at the first knot."""

    knots: Array  # tensions (n + 1,) [N]
    coefficients: Array  # of ε in F − knot (k, n), highest power first
    pieces: NDArray[np.intp] | None = None  # piece of each cell, even in (F − first knot)^¼

    def piece(self, tension: Array) -> Any:
        """Return the index of the piece of each tension [N]."""
        if len(self.knots) == 2:
            return np.zeros(np.shape(tension), dtype=np.intp)
        if self.pieces is None:
            return np.searchsorted(self.knots[1:-1], tension)
        first, last = self.knots[0], self.knots[-1]
        root = np.sqrt(np.sqrt((tension - first) * (1.0 / (last - first))))
        return self.pieces[(root * (len(self.pieces) - 2)).astype(np.intp)]

    def moments(self) -> Array:
        """Return the polynomials of ∫ε dF from the first knot (k + 1, n), highest power first."""
        c, width = self.coefficients, np.diff(self.knots)
        powers = np.arange(len(c), 0.0, -1.0)[:, None]
        moments = np.vstack([c / powers, np.zeros(c.shape[1])])
        moments[-1, 1:] = np.cumsum(horner(moments, width))[:-1]
        return moments


def horner(coefficients: Array, x: Array, piece: Any = slice(None)) -> Array:
    """Evaluate the polynomials (k, n) of the pieces at x; the highest power comes first."""
    value = coefficients[0][piece]
    for row in coefficients[1:]:
        value = value * x + row[piece]
    return np.asarray(value)


def tabulate(
    rigidity: Callable[[Array], ArrayLike],
    low: float,
    high: float,
    joins: Sequence[float] = (),
    slope: Callable[[Array], Array] | None = None,
) -> Table:
    """Tabulate ε = ∫ dF/EA from a function EA(F) [N] and, if it is known, its slope dEA/dF.

    Knots are even in (F − low)^¼: dense at the low end, where wires are soft. There is none near a
    join: a quintic bridges it, with ε, EA and dEA/dF of the knots on both sides. The knots double
    until EA between them is right to 1e-8, or 1e-11 with its slope. Raises InvalidInput.
    """
    joins = [join for join in joins if low < join < high]

    def difference(F: Array) -> Array:
        step = 1e-5 * (F + 1.0)
        before, after = np.maximum(F - step, low), np.minimum(F + step, high)
        rise = _checked(rigidity, after) - _checked(rigidity, before)
        return np.asarray(rise / (after - before))

    def away(F: Array, distance: float) -> NDArray[np.bool_]:
        return np.asarray(np.all([abs(F - join) > distance for join in joins] + [low <= F], axis=0))

    for cells in _CELLS:
        F = low + (high - low) * np.linspace(0.0, 1.0, cells + 1) ** 4
        F[-1] = high
        F = F[away(F, _NEAR) | (low == F) | (high == F)]
        ends = np.union1d(F, joins)  # the integral over a corner is that of its two sides
        width = np.diff(ends)[:, None]
        softness = 1.0 / _checked(rigidity, ends[:-1, None] + width * _NODES)
        steps = (width * _WEIGHTS * softness).sum(axis=1)
        steps = np.add.reduceat(steps, np.flatnonzero(np.isin(ends[:-1], F)))
        EA, bend = _checked(rigidity, F), (slope or difference)(F)
        c = _quintics(np.diff(F), steps, 1.0 / EA, -bend / EA**2)
        place = cells * ((F - low) / (high - low)) ** 0.25
        pieces = np.searchsorted(place[1:-1], np.arange(cells + 2) + 0.5)
        table = Table(F, c, pieces)
        test = F[:-1] + 0.3 * np.diff(F)
        piece = table.piece(test)
        slopes = c[:-1] * np.arange(5.0, 0.0, -1.0)[:, None]
        error = abs(horner(slopes, test - F[piece], piece) * _checked(rigidity, test) - 1.0)
        if (
            error[away(test, 3.0 * _NEAR)] <= _ACCURACY[slope is not None and cells < _CELLS[-1]]
        ).all():
            return table
    raise InvalidInput(
        "rigidity",
        f"jumps or bends too sharply for {cells} pieces from {low:g} to {high:g} N. EA must be "
        "continuous; give the tensions of its corners as joins=.",
    )


def _quintics(width: Array, step: Array, slope: Array, bend: Array) -> Array:
    """Return the quintics (6, n) of pieces from their widths and steps (n,), ε′ and ε″ (n + 1,).

    From the steps they are right near rounding; scipy's BPoly takes differences of the sums.
    """
    h, a, b = width, slope[:-1], bend[:-1]
    d = (step - a * h - b * h**2 / 2.0) / h**3
    e, f = (slope[1:] - a - b * h) / h**2, (bend[1:] - b) / h
    c3, c4, c5 = 10.0 * d - 4.0 * e + f / 2.0, -15.0 * d + 7.0 * e - f, 6.0 * d - 3.0 * e + f / 2.0
    before = np.append(0.0, np.cumsum(step)[:-1])
    return np.array([c5 / h**2, c4 / h, c3, b / 2.0, a, before])


def _checked(rigidity: Callable[[Array], ArrayLike], F: Array) -> Array:
    """Return EA [N] of a function; InvalidInput if it fails or gives anything but rigidities."""
    try:
        values = np.broadcast_to(np.asarray(rigidity(F), dtype=np.float64), F.shape)
    except CdsmError:
        raise
    except Exception as error:
        raise InvalidInput(
            "rigidity",
            f"the function fails at {span(F)} N: {error!r}. It gets an array of tensions [N] and "
            "must return an array of the same shape, or a number.",
        ) from error
    _, least, most = RANGES["rigidity"]
    bad = ~((values >= least) & (values <= most))
    if bad.any():
        raise InvalidInput(
            "rigidity",
            f"is {values[bad][0]:.6g} N at {F[bad][0]:.6g} N; {least:g} to {most:g} N is needed "
            "on the whole domain. Narrow the domain, or correct the law.",
        )
    return values
