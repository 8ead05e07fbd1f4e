"""Tables of the strain ε(F) of a wire: polynomials between knots, found without a search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import InvalidInput
from cdsm.support.format import span
from cdsm.support.validation import RANGES
from cdsm.support.values import Array

_CELLS: Final = 800  # pieces of a function EA(F), to 1e-9 of Eq. 19
_ACCURACY: Final = 1e-8  # of EA between two knots
_NEAR: Final = 1.0  # distance [N] from a join within which there is no knot
_NODES, _WEIGHTS = (leggauss(8)[0] + 1.0) / 2.0, leggauss(8)[1] / 2.0


class Table(NamedTuple):
    """The strain ε(F) as polynomials between n + 1 knots; it is zero at the first knot."""

    knots: Array  # tensions (n + 1,) [N]
    coefficients: Array  # of ε in F − knot (k, n), highest power first
    cells: NDArray[np.intp] | None = None  # piece of each cell, even in (F − first knot)^¼
    scale: float = 0.0  # number of cells⁴ over the width of all [1/N]

    def place(self, F: Array) -> tuple[Any, Array]:
        """Return the piece of each tension [N] and the distance from the knot before it."""
        if self.cells is None:
            piece = self.knots[1:-1].searchsorted(F)
        else:
            cell = np.sqrt(np.sqrt((F - self.knots[0]) * self.scale))
            piece = self.cells.take(cell.astype(np.intp))
        return piece, F - self.knots.take(piece)

    def moments(self) -> Array:
        """Return the polynomials of ∫ε dF from the first knot (k + 1, n), highest power first."""
        c = self.coefficients / np.arange(len(self.coefficients), 0.0, -1.0)[:, None]
        moments = np.vstack([c, np.zeros(c.shape[1])])
        moments[-1, 1:] = np.cumsum(horner(moments, slice(None), np.diff(self.knots)))[:-1]
        return moments


def horner(coefficients: Array, piece: Any, x: Array) -> Array:
    """Evaluate the polynomials (k, n) of the pieces at x; the highest power comes first."""
    value = np.zeros(np.shape(x))
    for row in coefficients:
        value = value * x + row[piece]
    return value


def tabulate(
    rigidity: Callable[[Array], ArrayLike], low: float, high: float, joins: Sequence[float] = ()
) -> Table:
    """Tabulate ε = ∫ dF/EA from a function EA(F) [N] as quintics with ε, EA and dEA/dF of knots.

    Knots are even in (F − low)^¼: dense at the low end, where wires are soft. There is none near a
    join, so that a quintic bridges it. Raises InvalidInput.
    """
    joins = [join for join in joins if low < join < high]
    F = low + (high - low) * np.linspace(0.0, 1.0, _CELLS + 1) ** 4
    F[-1] = high
    near = np.min([abs(F - join) for join in joins], axis=0, initial=np.inf)
    F = F[(near > _NEAR) | (low == F) | (high == F)]
    ends = np.union1d(F, joins)  # the integral over a corner is that of its two sides
    width = np.diff(ends)[:, None]
    steps = (width * _WEIGHTS / _checked(rigidity, ends[:-1, None] + width * _NODES)).sum(axis=1)
    steps = np.add.reduceat(steps, np.flatnonzero(np.isin(ends[:-1], F)))
    before, after = np.maximum(F - 1e-5 * (F + 1.0), low), np.minimum(F + 1e-5 * (F + 1.0), high)
    slope = (_checked(rigidity, after) - _checked(rigidity, before)) / (after - before)
    EA, h = _checked(rigidity, F), np.diff(F)
    slope[-1] += (slope[-1] - slope[-2]) / h[-1] * (high - before[-1]) / 2.0  # one-sided there
    # a quintic has the step of ε, and ε′ and ε″ at both ends
    a, b = 1.0 / EA, -slope / EA**2
    d = (steps - a[:-1] * h - b[:-1] * h**2 / 2.0) / h**3
    e, f = (np.diff(a) - b[:-1] * h) / h**2, np.diff(b) / h
    c5, c4 = (6.0 * d - 3.0 * e + f / 2.0) / h**2, (-15.0 * d + 7.0 * e - f) / h
    c3, strain = 10.0 * d - 4.0 * e + f / 2.0, np.append(0.0, np.cumsum(steps)[:-1])
    c = np.array([c5, c4, c3, b[:-1] / 2.0, a[:-1], strain])
    places = _CELLS * ((F - low) / (high - low)) ** 0.25
    cells = np.searchsorted(places[1:-1], np.arange(_CELLS + 2) + 0.5)
    table = Table(F, c, cells, _CELLS**4 / (high - low))
    test = F[:-1] + 0.3 * h
    softness = horner(c[:-1] * np.arange(5.0, 0.0, -1.0)[:, None], *table.place(test))
    bridge = np.min([abs(test - join) for join in joins], axis=0, initial=np.inf) < 3.0 * _NEAR
    if (~bridge & (abs(softness * _checked(rigidity, test) - 1.0) > _ACCURACY)).any():
        raise InvalidInput(
            "rigidity",
            f"jumps or bends too sharply for {_CELLS} pieces from {low:g} to {high:g} N. EA must "
            "be continuous; give the tensions of its corners as joins=.",
        )
    return table


def _checked(rigidity: Callable[[Array], ArrayLike], F: Array) -> Array:
    """Return EA [N] of a function; InvalidInput if it fails or gives anything but rigidities."""
    _, least, most = RANGES["rigidity"]
    try:
        values = np.broadcast_to(np.asarray(rigidity(F), dtype=np.float64), F.shape)
    except Exception as error:
        problem = f"the function fails at {span(F)} N: {error!r}. It must return an array of the "
        raise InvalidInput("rigidity", f"{problem}shape of the tensions it gets.") from error
    if (bad := ~((values >= least) & (values <= most))).any():
        problem = f"is {values[bad][0]:.6g} N at {F[bad][0]:.6g} N, not {least:g} to {most:g} N. "
        raise InvalidInput("rigidity", f"{problem}Narrow the domain, or correct the law.")
    return values
