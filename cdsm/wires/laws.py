"""Laws of wires whose rigidity EA depends on tension: polynomials (Eq. 19), or a measured curve."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from typing import Final, final

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.support.validation import LARGEST, SMALLEST, number_array, scalar
from cdsm.support.values import Array
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.table import Table, tabulate

EQ19_PRINTED: Final = (
    (-556.89, 377.99, -70.49, 8.74, -0.46, 1.12e-2, -1e-4),
    (-1924.5, 493.35, -2.26, 0.0054, -6.94e-6, 4.58e-9, -1.22e-12),
)
"""Printed coefficients of Eq. 19. Only the misprinted −1e-3 is corrected (see cdsm.paper)."""

EQ19: Final = (
    (-556.89, 377.99, -70.49, 8.74, -0.46, 1.12e-2, -9.946263022943622e-05),
    (-1924.5, 493.34505, -2.26495, 5.38168e-3, -6.93505e-6, 4.58495e-9, -1.21505e-12),
)
"""Coefficients of Eq. 19 with more digits, so that the branches meet; see eq19_repaired."""

_MEET = 1e-9
"""Largest relative difference of two polynomials at their join. It allows for rounding."""


@final
class StrandElasticity(Elasticity):
    """Rigidity EA(F) as polynomials in the tension, one polynomial per range (form of Eq. 19).

    Neighbouring polynomials meet at their join, within 1e-9 of EA. A corner there is bridged
    smoothly: within 1.7 N of 31 N, EA of Eq. 19 differs by up to 0.74 % from its polynomials;
    elsewhere by 1e-8. The polynomials give the *tangent* rigidity: if they gave the secant S of
    Eq. 18, the tangent S²/(S − F S') would be negative up to 31 N.

    Args:
        coefficients: One tuple per range, lowest power first [N, 1, 1/N, …].
        joins: Tensions [N] at which one range ends and the next begins, one fewer than ranges.
        low: Smallest tension [N].
        high: Largest tension [N].

    Raises:
        InvalidInput: A number is invalid, the numbers of ranges and joins do not fit, ``low``,
            ``joins`` and ``high`` do not rise from 0 or more, two ranges do not meet, or EA is not
            positive.
    """

    coefficients: tuple[tuple[float, ...], ...]
    joins: tuple[float, ...]

    def __init__(
        self,
        coefficients: Sequence[Sequence[float]],
        joins: Sequence[float],
        low: float,
        high: float,
    ) -> None:
        if not all(isinstance(each, (list, tuple)) for each in (coefficients, joins)):
            raise InvalidInput("coefficients", "give a tuple for each range, and a tuple of joins.")
        rows, joins = tuple(_row("coefficients", row) for row in coefficients), _row("joins", joins)
        low, high = scalar("low", low), scalar("high", high)
        if not rows or not all(rows):
            raise InvalidInput("coefficients", "need at least one range with one coefficient.")
        if len(joins) != len(rows) - 1:
            raise InvalidInput(
                "joins", f"{len(joins)} given for {len(rows)} ranges; {len(rows) - 1} needed."
            )
        edges = (low, *joins, high)
        if low < 0.0 or any(a >= b for a, b in pairwise(edges)):
            raise InvalidInput("joins", f"0 <= low < joins < high must rise, but are {edges} N.")
        given = {"coefficients": rows, "joins": joins, "low": low, "high": high}
        super().__init__("strand", given, low, high)
        self.__dict__.update(coefficients=rows, joins=joins)
        for join in joins:
            below, above = self.polynomial([join, np.nextafter(join, np.inf)]).tolist()
            if abs(above - below) > _MEET * abs(below):
                raise InvalidInput(
                    "coefficients",
                    f"the ranges do not meet at {join:g} N: {below:.7g} N below, {above:.7g} N "
                    "above, and a rigidity is continuous. Choose digits with which they meet "
                    "(StrandElasticity.eq19_repaired() does it for Eq. 19), or use a "
                    "TabulatedElasticity.",
                )
        F = low + (high - low) * np.linspace(0.0, 1.0, 400) ** 4
        if not (bad := F[self.polynomial(F) <= 0.0]).size == 0:
            raise InvalidInput(
                "coefficients",
                f"the polynomials give {float(self.polynomial(bad[0])):.6g} N at {bad[0]:.4g} N, "
                "and a rigidity must be positive. Narrow the domain, or correct the coefficients.",
            )

    @classmethod
    def eq19_repaired(cls) -> StrandElasticity:
        """Return Eq. 19 of a 1×19 strand of 1.2 mm, with the digits missing in print filled in.

        The coefficient printed as −1e-3 is read as −1e-4: with −1e-3 the branch gives −787 884 N at
        31 N, where the other branch gives 11 352 N. The printed digits leave EA(31 N) uncertain by
        6 kN and EA(810 N) by 35 kN. Within these limits, the polynomials meet. The upper one is as
        flat as possible from 400 to 810 N, where the paper calls EA near-constant; the lower one is
        as near to the printed one as possible. Both were found by linear programs
        (``tests/laws/test_errata.py``). At 31 N, their slope falls from 1022 to 368: none with
        these digits has a continuous slope there. The polynomial is negative below 2.11 N, so the
        law begins at 2.2 N. It ends at 810 N.
        """
        return cls(EQ19, joins=(31.0,), low=2.2, high=810.0)

    def polynomial(self, tension: ArrayLike) -> Array:
        """Evaluate the polynomials EA(F) [N] at F of any shape, even beyond the law.

        Raises InvalidInput if ``tension`` is not finite numbers.
        """
        return self._piecewise(number_array("tension", tension), 0)

    @cached_property
    def _table(self) -> Table:
        return tabulate(
            self.polynomial, self.low, self.high, self.joins, lambda F: self._piecewise(F, 1)
        )

    def _piecewise(self, F: Array, order: int) -> Array:
        rows = [Polynomial(row).deriv(order)(F) for row in self.coefficients]
        return np.choose(np.searchsorted(self.joins, F), rows)


@final
class TabulatedElasticity(Elasticity):
    """Strain as an increasing function of tension, through measured points of any wire.

    The curve is a C1 cubic between two points. Its slopes follow from a natural spline of ln Δε/ΔF
    of the chords over the middles of their strains, limited to ½ and 2½ times the chords beside.

    EA from exact points of a wire that stiffens has a median error of 0.4 % for 30 even steps; the
    error is largest, up to 90 %, in the first steps from a soft low end: give more points there.

    Args:
        tensions: Tensions F of the points [N], ascending from 0 or more.
        strains: Strains ε of the points [-], ascending. Only their differences matter.

    Raises:
        InvalidInput: There are fewer than two points, or they are not ascending.
    """

    tensions: tuple[float, ...]
    strains: tuple[float, ...]

    def __init__(self, tensions: Sequence[float], strains: Sequence[float]) -> None:
        given = {"tensions": _row("tensions", tensions), "strains": _row("strains", strains)}
        for name, row in given.items():
            if len(row) < 2:
                raise InvalidInput(name, f"{len(row)} given; two or more are needed.")
            for i, (a, b) in enumerate(pairwise(row)):
                if a >= b:
                    raise InvalidInput(
                        name, f"entry [{i + 1}] is {b:g} after {a:g}; they must rise."
                    )
        F, strain = given.values()
        if len(F) != len(strain):
            raise InvalidInput("strains", f"{len(strain)} given for {len(F)} tensions.")
        if F[0] < 0.0:
            raise InvalidInput("tensions", f"{F[0]:g} N is negative; cables only pull.")
        if (steps := np.diff(F)).min() < SMALLEST:
            raise InvalidInput("tensions", f"two points are only {steps.min():g} N apart.")
        chords = np.diff(strain) / steps
        if not 1.0 / LARGEST < chords.min() <= chords.max() < LARGEST:
            raise InvalidInput("strains", "rise so steeply, or so little, that EA is no rigidity.")
        super().__init__("tabulated", given, F[0], F[-1])
        self.__dict__.update(given)

    @cached_property
    def _table(self) -> Table:
        from scipy.interpolate import CubicSpline

        F, strain = np.array(self.tensions), np.subtract(self.strains, self.strains[0])
        chords = np.diff(strain) / np.diff(F)
        slopes = least = np.minimum(np.append(chords[0], chords), np.append(chords, chords[-1]))
        if len(chords) > 1:
            middles = (strain[1:] + strain[:-1]) / 2.0
            ln = CubicSpline(middles, np.log(chords), bc_type="natural")(strain)
            slopes = np.exp(np.clip(ln, np.log(least / 2.0), np.log(2.5 * least)))
        return Table.through(F, strain, slopes)


def _row(name: str, values: ArrayLike) -> tuple[float, ...]:
    numbers = number_array(name, values)
    if numbers.ndim != 1:
        raise InvalidInput(name, f"{values!r} given; a sequence of numbers is needed.")
    return tuple(numbers.tolist())
