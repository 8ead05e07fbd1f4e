"""Laws of wires: constant rigidity EA, polynomials EA(F) (Eq. 19), or a measured curve."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, Final, final

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import ArrayLike, NDArray

from cdsm.errors import InvalidInput, warn
from cdsm.support.format import span
from cdsm.support.validation import (
    LARGEST,
    RANGES,
    SMALLEST,
    checked_quantity,
    number_array,
    scalar,
)
from cdsm.support.values import Array
from cdsm.wires.elasticity import Elasticity

EQ19: Final = (
    (-556.89, 377.99, -70.49, 8.74, -0.46, 1.12e-2, -9.946263022943622e-05),
    (-1924.5, 493.34505, -2.26495, 5.38168e-3, -6.93505e-6, 4.58495e-9, -1.21505e-12),
)
"""Coefficients of Eq. 19 with more digits, so that the branches meet; see eq19_repaired."""
_MEET: Final = 1e-9  # relative difference of two polynomials at their join that is rounding
LINE: Final = np.array([0.0, RANGES["tension"].high]), np.array([[0.0], [1.0]])
"""Knots and coefficients of the strain of constant EA, times EA."""
_CELLS: Final = 800  # pieces of a function EA(F), to 1e-9 of Eq. 19
_ACCURACY: Final = 1e-8  # of EA between two knots
_NEAR: Final = 1.0  # distance [N] from a join within which there is no knot
_NODES = (leggauss(8)[0] + 1.0) / 2.0
_WEIGHTS = leggauss(8)[1] / 2.0
_POWERS: Final = np.arange(3.0, 6.0)
_QUINTIC = np.linalg.inv([_POWERS**0, _POWERS, _POWERS * (_POWERS - 1.0)])  # by value, slope, bend


@final
class LinearElasticity(Elasticity):
    """Elasticity with constant EA: a solid wire, or a strand in its elastic stage.

    ``rigidity`` is EA [N]. A CdsmWarning doubts it below 1 kN and above 1e9 N. Raises InvalidInput
    if it is not a number, or outside its range.

    Example:
        >>> import cdsm
        >>> float(cdsm.LinearElasticity(48e3).strain(48.0))
        0.001
    """

    def __init__(self, rigidity: float) -> None:
        EA = checked_quantity("rigidity", rigidity, "rigidity")
        if not 1e3 <= EA <= 1e9:
            doubt = "kN" if EA < 1e3 else "E instead of EA"
            warn(f"a wire with EA = {EA:g} N is unusual: {doubt}? EA is needed in N.")
        super().__init__(0.0, math.inf, 0.0, "linear", {}, EA, *LINE)

    @classmethod
    def of_wire(cls, young_modulus: float, diameter: float) -> LinearElasticity:
        """Return `EA = E π d²/4` of a solid wire, E [Pa] and d [m] positive, else InvalidInput."""
        for name, value in (("young_modulus", young_modulus), ("diameter", diameter)):
            if scalar(name, value) <= 0.0:
                raise InvalidInput(name, f"{value:g} given; it must be positive.")
        return cls(young_modulus * math.pi * (diameter * diameter) / 4.0)


@final
class StrandElasticity(Elasticity):
    """Rigidity EA(F) as polynomials in the tension, one polynomial per range (form of Eq. 19).

    Neighbouring polynomials meet at their join, within 1e-9 of EA. A corner there is bridged
    smoothly: within 1.4 N of 31 N, EA of Eq. 19 differs by up to 0.7 % from its polynomials;
    elsewhere by 1e-8 at most. They give the *tangent* rigidity: if they gave the secant S of
    Eq. 18, the tangent `S²/(S − F S′)` would be negative up to 31 N.

    ``coefficients`` are one tuple per range, lowest power first [N, 1, 1/N, …]; ``joins`` are the
    tensions [N] at which one range ends and the next begins. Raises InvalidInput if a number is
    invalid, 0 <= low < joins < high does not hold, two ranges do not meet, or EA is not positive.

    Example:
        >>> import cdsm
        >>> law = cdsm.StrandElasticity.eq19_repaired()
        >>> round(float(law.rigidity(600.0)))
        42197
    """

    coefficients = property(lambda law: law.arguments["coefficients"], doc="As given, in tuples.")
    joins = property(lambda law: law.arguments["joins"], doc="As given [N], in a tuple.")

    def __init__(
        self,
        coefficients: Sequence[Sequence[float]],
        joins: Sequence[float],
        low: float,
        high: float,
    ) -> None:
        if not isinstance(coefficients, (list, tuple)) or not coefficients:
            raise InvalidInput("coefficients", f"{coefficients!r} given; give a tuple per range.")
        rows = tuple(_row("coefficients", row, 1) for row in coefficients)
        low, *joins, high = ends = rising(low, joins, high)
        if len(joins) != len(rows) - 1:
            raise InvalidInput("joins", f"{len(joins)} given for {len(rows)} ranges; one fewer.")
        for join, ranges in zip(joins, pairwise(rows), strict=True):
            below, above = (polyval(join, row) for row in ranges)
            if abs(above - below) > _MEET * abs(below):
                problem = (
                    f"ranges do not meet at {join:g} N: {below:.7g} N below, {above:.7g} N above. "
                )
                raise InvalidInput(
                    "coefficients", f"{problem}More digits, or a TabulatedElasticity."
                )
        values = {"coefficients": rows, "joins": tuple(joins), "low": low, "high": high}
        table = tabulate(lambda F: _piecewise(F, rows, joins), ends)
        super().__init__(low, high, low, "strand", values, 1.0, *table)

    @classmethod
    def eq19_repaired(cls) -> StrandElasticity:
        """Return Eq. 19 of a 1×19 strand of 1.2 mm, with the digits missing in print filled in.

        −1e-3 is read as −1e-4. The digits leave EA(31 N) uncertain by 6 kN, EA(810 N) by 35 kN.
        Within them, the upper polynomial is as flat as possible from 400 to 810 N, the lower one as
        near to the printed one as possible (linear programs in ``tests/laws/test_errata.py``).
        """
        return cls(EQ19, joins=(31.0,), low=2.2, high=810.0)

    def polynomial(self, tension: ArrayLike) -> Array:
        """Evaluate the polynomials EA(F) [N] at F of any shape, even beyond the law."""
        return _piecewise(number_array("tension", tension), self.coefficients, self.joins)


@final
class TabulatedElasticity(Elasticity):
    """Strain as an increasing function of tension, through measured points of any wire.

    The curve is a C1 cubic between two points. Its slopes follow from a natural spline of ln(Δε/ΔF)
    of the chords over the middles of their strains, limited to ½ and 2½ times the chords
    beside. The error of EA is largest in the first steps from a soft low end: give more points
    there.

    ``tensions`` [N] and ``strains`` [-] of two or more points must rise, tensions from 0 or more,
    or InvalidInput is raised. Only differences of strains matter.

    Example:
        >>> import cdsm
        >>> law = cdsm.TabulatedElasticity([0.0, 50.0, 100.0], [0.0, 0.002, 0.003])
        >>> round(float(law.strain(75.0)), 6)
        0.002558
    """

    tensions = property(lambda law: law.arguments["tensions"], doc="As given [N], in a tuple.")
    strains = property(lambda law: law.arguments["strains"], doc="As given [-], in a tuple.")

    def __init__(self, tensions: Sequence[float], strains: Sequence[float]) -> None:
        from scipy.interpolate import CubicHermiteSpline, CubicSpline  # import slowly

        values = {"tensions": _row("tensions", tensions, 2), "strains": _row("strains", strains, 2)}
        F, strain = map(np.array, values.values())
        if F.size != strain.size:
            raise InvalidInput("strains", f"{strain.size} given for {F.size} tensions.")
        if F[0] < 0.0:
            raise InvalidInput("tensions", f"{F[0]:g} N is negative; cables only pull.")
        for name, row, least in (("tensions", F, SMALLEST), ("strains", strain, 0.0)):
            at = int(np.diff(row).argmin()) + 1
            if row[at] - row[at - 1] <= least:
                rise = f"entry [{at}] is {row[at]:g} after {row[at - 1]:g}; they must rise."
                raise InvalidInput(name, rise)
        chords = np.diff(strain) / np.diff(F)
        strain = strain - strain[0]
        if not 1.0 / LARGEST < chords.min() <= chords.max() < LARGEST:
            raise InvalidInput("strains", "rise so steeply, or so little, that EA is no rigidity.")
        slopes = least = np.minimum(np.append(chords[0], chords), np.append(chords, chords[-1]))
        if chords.size > 1:
            middles = (strain[1:] + strain[:-1]) / 2.0
            ln = CubicSpline(middles, np.log(chords), bc_type="natural")(strain)
            slopes = np.exp(np.clip(ln, np.log(least / 2.0), np.log(2.5 * least)))
        low = float(F[0])
        high = float(F[-1])
        curve = CubicHermiteSpline(F, strain, slopes)
        super().__init__(low, high, low, "tabulated", values, 1.0, F, curve.c[::-1])


def _piecewise(F: Array, rows: Sequence[Sequence[float]], joins: Sequence[float]) -> Array:
    return np.choose(np.searchsorted(joins, F), [polyval(F, row) for row in rows])


def rising(low: float, joins: Sequence[float], high: float) -> tuple[float, ...]:
    """Return the ends of the ranges of a law [N], if they rise from 0 or more."""
    ends = scalar("low", low), *_row("joins", joins), scalar("high", high)
    if ends[0] < 0.0 or min(np.diff(ends)) <= 0.0:
        problem = f"0 <= low < high needed, with joins between that rise, but are {ends} N."
        raise InvalidInput("joins" if joins else "low", problem)
    return ends


def _row(name: str, values: ArrayLike, least: int = 0) -> tuple[float, ...]:
    numbers = number_array(name, values)
    if numbers.ndim != 1 or numbers.size < least:
        raise InvalidInput(name, f"{values!r} given; a sequence of {least} or more numbers needed.")
    return tuple(numbers.tolist())


def tabulate(
    rigidity: Callable[[Array], ArrayLike], ends: Sequence[float]
) -> tuple[Array, Array, NDArray[np.intp]]:
    """Tabulate ε = ∫ dF/EA from a function EA(F) [N] as quintics with ε, EA and dEA/dF of knots.

    Return knots (n + 1,), coefficients (6, n) and the piece of each cell, even in (F − low)^¼: so
    knots are dense at the low end, where wires are soft. No knot is near a join: a quintic bridges
    it. Raises InvalidInput.
    """
    low, *joins, high = ends

    def near(F: Array, distance: float) -> Any:
        return np.min([abs(F - join) for join in joins], axis=0, initial=np.inf) <= distance

    F = low + (high - low) * np.linspace(0.0, 1.0, _CELLS + 1) ** 4
    F[-1] = high
    kept = ~near(F, _NEAR) | (low == F) | (high == F)
    F = F[kept]
    sides = np.union1d(F, joins)  # the integral over a corner is that of its two sides
    width = np.diff(sides)[:, None]
    steps = (width * _WEIGHTS / _checked(rigidity, sides[:-1, None] + width * _NODES)).sum(axis=1)
    rise = np.add.reduceat(steps, np.flatnonzero(np.isin(sides[:-1], F)))
    before = np.maximum(F - 1e-5 * (F + 1.0), low)
    after = np.minimum(F + 1e-5 * (F + 1.0), high)
    slope = (_checked(rigidity, after) - _checked(rigidity, before)) / (after - before)
    EA = _checked(rigidity, F)
    h = np.diff(F)
    slope[-1] += (slope[-1] - slope[-2]) / h[-1] * (high - before[-1]) / 2.0  # one-sided there
    a = 1.0 / EA  # ε′ and ε″
    b = -slope / EA**2
    start = np.append(0.0, np.cumsum(rise)[:-1])
    first = a[:-1] * h
    second = b[:-1] * h**2
    more = _QUINTIC @ [rise - first - second / 2.0, np.diff(a) * h - second, np.diff(b) * h**2]
    c = np.vstack([start, a[:-1], b[:-1] / 2.0, more / h ** _POWERS[:, None]])
    test = F[:-1] + 0.3 * h
    softness = polyval(0.3 * h, polyder(c), tensor=False)
    wrong = abs(softness * _checked(rigidity, test) - 1.0) > _ACCURACY
    if (wrong & ~near(test, 3.0 * _NEAR)).any():
        raise InvalidInput(
            "rigidity",
            f"jumps or bends too sharply for {_CELLS} pieces from {low:g} to {high:g} N. EA must "
            "be continuous; give the tensions of its corners as joins=.",
        )
    return F, c, (np.cumsum(kept) - 1).clip(max=len(h) - 1)


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
