"""Laws of wires: constant rigidity EA, polynomials EA(F) (Eq. 19), or a measured curve."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final, final

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.support.validation import LARGEST, RANGES, SMALLEST, number_array, quantity, scalar
from cdsm.support.values import Array
from cdsm.support.warning import warn
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.table import Table, tabulate

EQ19: Final = (
    (-556.89, 377.99, -70.49, 8.74, -0.46, 1.12e-2, -9.946263022943622e-05),
    (-1924.5, 493.34505, -2.26495, 5.38168e-3, -6.93505e-6, 4.58495e-9, -1.21505e-12),
)
"""Coefficients of Eq. 19 with more digits, so that the branches meet; see eq19_repaired."""
_USUAL: Final = 1e3, 1e9  # EA [N] of real wires
_MEET: Final = 1e-9  # relative difference of two polynomials at their join that is rounding
_LINE: Final = Table(np.array([0.0, RANGES["tension"].high]), np.array([[1.0], [0.0]]))


@final
class LinearElasticity(Elasticity):
    """Elasticity with constant EA: a solid wire, or a strand in its elastic stage.

    ``rigidity`` is EA [N]. A CdsmWarning doubts it below 1 kN and above 1e9 N. Raises InvalidInput
    if it is not a number, or outside its range.
    """

    def __init__(self, rigidity: float) -> None:
        EA = quantity("rigidity", rigidity, "rigidity")
        if not _USUAL[0] <= EA <= _USUAL[1]:
            doubt = "kN" if _USUAL[0] > EA else "E instead of EA"
            warn(f"a wire with EA = {EA:g} N is unusual: {doubt}? EA is needed in N.")
        super().__init__(0.0, math.inf, 0.0, "linear", {}, EA, _LINE)

    @classmethod
    def of_wire(cls, young_modulus: float, diameter: float) -> LinearElasticity:
        """Return EA = E π d²/4 of a solid wire, E [Pa] and d [m] positive, else InvalidInput."""
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
    Eq. 18, the tangent S²/(S − F S') would be negative up to 31 N.

    ``coefficients`` are one tuple per range, lowest power first [N, 1, 1/N, …]; ``joins`` are the
    tensions [N] at which one range ends and the next begins. Raises InvalidInput if a number is
    invalid, 0 <= low < joins < high does not hold, two ranges do not meet, or EA is not positive.
    """

    coefficients = property(lambda law: law._given["coefficients"], doc="As given, in tuples.")
    joins = property(lambda law: law._given["joins"], doc="As given [N], in a tuple.")

    def __init__(
        self,
        coefficients: Sequence[Sequence[float]],
        joins: Sequence[float],
        low: float,
        high: float,
    ) -> None:
        if not isinstance(coefficients, (list, tuple)):
            raise InvalidInput("coefficients", f"{coefficients!r} given; give a tuple per range.")
        rows, joins = tuple(_row("coefficients", row) for row in coefficients), _row("joins", joins)
        low, high = scalar("low", low), scalar("high", high)
        if not rows or not all(rows):
            raise InvalidInput("coefficients", "need at least one range with one coefficient.")
        if len(joins) != len(rows) - 1:
            raise InvalidInput("joins", f"{len(joins)} given for {len(rows)} ranges; one fewer.")
        if low < 0.0 or any(a >= b for a, b in pairwise((low, *joins, high))):
            found = f"{low:g}, {joins}, {high:g} N"
            raise InvalidInput("joins", f"0 <= low < joins < high must rise, but are {found}.")
        for join, (before, after) in zip(joins, pairwise(rows), strict=True):
            below, above = polyval(join, before), polyval(join, after)
            if abs(above - below) > _MEET * abs(below):
                problem = f"the ranges do not meet at {join:g} N: {below:.7g} N below, {above:.7g} "
                raise InvalidInput(
                    "coefficients", f"{problem}N above. Give more digits, or a TabulatedElasticity."
                )
        given = {"coefficients": rows, "joins": joins, "low": low, "high": high}
        table = tabulate(lambda F: _piecewise(F, rows, joins), low, high, joins)
        super().__init__(low, high, low, "strand", given, 1.0, table)

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

    The curve is a C1 cubic between two points. Its slopes follow from a natural spline of ln Δε/ΔF
    of the chords over the middles of their strains, limited to ½ and 2½ times the chords beside.
    The error of EA is largest in the first steps from a soft low end: give more points there.

    ``tensions`` [N] and ``strains`` [-] of two or more points must rise, tensions from 0 or more,
    or InvalidInput is raised. Only differences of strains matter.
    """

    tensions = property(lambda law: law._given["tensions"], doc="As given [N], in a tuple.")
    strains = property(lambda law: law._given["strains"], doc="As given [-], in a tuple.")

    def __init__(self, tensions: Sequence[float], strains: Sequence[float]) -> None:
        from scipy.interpolate import CubicHermiteSpline, CubicSpline  # import slowly

        given = {"tensions": _row("tensions", tensions), "strains": _row("strains", strains)}
        F, strain = np.array(given["tensions"]), np.array(given["strains"])
        if F.size != strain.size or F.size < 2:
            raise InvalidInput("strains", f"{strain.size} given for {F.size} tensions; 2 or more.")
        for name, row, least in (("tensions", F, SMALLEST), ("strains", strain, 0.0)):
            if (steps := np.diff(row)).min() <= least:
                at = int(steps.argmin()) + 1
                rise = f"entry [{at}] is {row[at]:g} after {row[at - 1]:g}; they must rise."
                raise InvalidInput(name, rise)
        if F[0] < 0.0:
            raise InvalidInput("tensions", f"{F[0]:g} N is negative; cables only pull.")
        chords, strain = np.diff(strain) / np.diff(F), strain - strain[0]
        if not 1.0 / LARGEST < chords.min() <= chords.max() < LARGEST:
            raise InvalidInput("strains", "rise so steeply, or so little, that EA is no rigidity.")
        slopes = least = np.minimum(np.append(chords[0], chords), np.append(chords, chords[-1]))
        if chords.size > 1:
            middles = (strain[1:] + strain[:-1]) / 2.0
            ln = CubicSpline(middles, np.log(chords), bc_type="natural")(strain)
            slopes = np.exp(np.clip(ln, np.log(least / 2.0), np.log(2.5 * least)))
        low, high, table = (
            float(F[0]),
            float(F[-1]),
            Table(F, CubicHermiteSpline(F, strain, slopes).c),
        )
        super().__init__(low, high, low, "tabulated", given, 1.0, table)


def _piecewise(F: Array, rows: Sequence[Sequence[float]], joins: Sequence[float]) -> Array:
    return np.choose(np.searchsorted(joins, F), [polyval(F, row) for row in rows])


def _row(name: str, values: ArrayLike) -> tuple[float, ...]:
    if (numbers := number_array(name, values)).ndim != 1:
        raise InvalidInput(name, f"{values!r} given; a sequence of numbers is needed.")
    return tuple(numbers.tolist())
