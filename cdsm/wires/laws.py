"""Laws of wires whose rigidity EA depends on tension: polynomials (Eq. 19), or a measured curve."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Final, final

import numpy as np
from numpy.polynomial.polynomial import polyder
from numpy.typing import ArrayLike

from cdsm.elasticity import Domain, Elasticity
from cdsm.elasticity.law import positive_factor
from cdsm.errors import ElasticityRangeError, InvalidInput
from cdsm.support.validation import LARGEST, SMALLEST, number_array, scalar
from cdsm.support.values import Array
from cdsm.wires.quadrature import Panels, coefficient_table, panels, piecewise
from cdsm.wires.rising_curve import RisingCurve

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
@dataclass(frozen=True)
class StrandElasticity(Elasticity):
    """Rigidity EA(F) as polynomials in the tension, one polynomial per range (form of Eq. 19).

    EA is continuous: neighbouring polynomials meet at their join, within 1e-9 of EA.

    The polynomials give the *tangent* rigidity. If they gave the secant S of Eq. 18, the tangent
    would be S²/(S − F S'). This is negative where S grows faster than F. For Eq. 19 that is the
    whole range up to 31 N, so the secant is not offered.

    Attributes:
        coefficients: One tuple per range, lowest power first [N, 1, 1/N, …].
        joins: Tensions [N] at which one range ends and the next begins. A join belongs to the range
            below it. There is one join fewer than ranges.
        low: Low end of the domain [N], excluded.
        high: High end of the domain [N], included.

    Raises:
        InvalidInput: A number is invalid, the numbers of ranges and joins do not fit, ``low``,
            ``joins`` and ``high`` are not ascending from 0 or more, or two ranges do not meet at
            their join.
    """

    coefficients: tuple[tuple[float, ...], ...]
    joins: tuple[float, ...]
    low: float
    high: float

    def __post_init__(self) -> None:
        if not all(isinstance(each, (list, tuple)) for each in (self.coefficients, self.joins)):
            raise InvalidInput("coefficients", "give a tuple for each range, and a tuple of joins.")
        rows = tuple(_row("coefficients", row) for row in self.coefficients)
        joins = _row("joins", self.joins)
        edges = (scalar("low", self.low), *joins, scalar("high", self.high))
        if not rows or not all(rows):
            raise InvalidInput("coefficients", "need at least one range with one coefficient.")
        if len(joins) != len(rows) - 1:
            raise InvalidInput(
                "joins", f"{len(joins)} given for {len(rows)} ranges; {len(rows) - 1} needed."
            )
        if edges[0] < 0.0 or any(a >= b for a, b in pairwise(edges)):
            raise InvalidInput("joins", f"0 <= low < joins < high must rise, but are {edges} N.")
        object.__setattr__(self, "coefficients", rows)
        object.__setattr__(self, "joins", joins)
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

    @classmethod
    def eq19_repaired(cls) -> StrandElasticity:
        """Return Eq. 19 of a 1×19 strand of 1.2 mm, with the digits missing in print filled in.

        The coefficient printed as −1e-3 is read as −1e-4: with −1e-3 the branch gives −787 884 N at
        31 N, where the other branch gives 11 352 N. The printed digits leave EA(31 N) uncertain by
        6 kN and EA(810 N) by 35 kN. Within these limits, this law is continuous. Its upper branch
        is as flat as possible from 400 to 810 N, where the paper calls EA near-constant. Its lower
        branch is as near to the printed one as possible. Both were found by linear programs
        (``tests/laws/test_errata.py``). At 31 N, the slope falls from 1022 to 368. No law with
        these digits has a continuous slope there. The polynomial is negative below 2.11 N, so the
        domain is (2.2 N, 810 N].
        """
        return cls(EQ19, joins=(31.0,), low=2.2, high=810.0)

    @cached_property
    def domain(self) -> Domain:
        """Domain (low, high] [N] of the law."""
        return Domain(self.low, self.high, low_included=False)

    def polynomial(self, tension: ArrayLike) -> Array:
        """Evaluate the polynomials EA(F) [N] at F of any shape, even beyond the domain.

        Raises InvalidInput if ``tension`` is not finite numbers.
        """
        values = number_array("tension", tension)
        return piecewise(self._joins, self._table, values)

    def scaled(self, factor: float) -> StrandElasticity:
        """Return the law of factor × EA(F); see :meth:`Elasticity.scaled`."""
        times = positive_factor(factor)
        rows = tuple(tuple(times * each for each in row) for row in self.coefficients)
        return replace(self, coefficients=rows)

    def rigidity(self, tension: ArrayLike) -> Array:
        """Compute EA(F) [N]; see :meth:`Elasticity.rigidity`."""
        values = self.domain.check(tension)
        result = piecewise(self._joins, self._table, values)
        bad = result <= 0.0
        if np.count_nonzero(bad):
            raise ElasticityRangeError(
                f"the polynomial gives {result[bad][0]:.6g} N, and a rigidity must be positive. "
                "Narrow the domain, or correct the coefficients.",
                values[bad].tolist(),
                np.flatnonzero(bad).tolist(),
            )
        return result

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        """Compute the derivative of the polynomials [-]; see :meth:`Elasticity.rigidity_slope`."""
        values = self.domain.check(tension)
        return piecewise(self._joins, self._slopes, values)

    def strain(self, tension: ArrayLike) -> Array:
        """Compute ∫ dF/EA(F) [-], exact to rounding; see :meth:`Elasticity.strain`."""
        return self._integral(tension, power=0)

    def energy(self, tension: ArrayLike) -> Array:
        """Compute ∫ F dF/EA(F) [N], exact to rounding; see :meth:`Elasticity.energy`."""
        return self._integral(tension, power=1)

    @cached_property
    def _joins(self) -> Array:
        return np.array(self.joins)

    @cached_property
    def _table(self) -> Array:
        return coefficient_table(self.coefficients)

    @cached_property
    def _slopes(self) -> Array:
        return np.asarray(polyder(self._table))

    @cached_property
    def panels(self) -> Panels:
        """Panels (intervals of tension) for the numerical integration of strain and energy."""
        return panels(self.coefficients, (self.low, *self.joins, self.high))

    def _integral(self, tension: ArrayLike, power: int) -> Array:
        """Integrate F^power dF/EA(F) from the low end of the domain to ``tension``, any shape."""
        values = self.domain.check(tension)
        bad = values > self.panels.end
        if np.count_nonzero(bad):
            raise ElasticityRangeError(
                "the rigidity is not positive everywhere below, so there is no strain. Narrow the "
                "domain, or correct the coefficients.",
                values[bad].tolist(),
                np.flatnonzero(bad).tolist(),
            )
        return self.panels.integral(values, power)


@final
@dataclass(frozen=True)
class TabulatedElasticity(Elasticity):
    """Strain as an increasing function of tension, through measured points of any wire.

    Between two points, the chord has the slope c = Δε/ΔF, and the curve has the slope dε/dF =
    c N/D², which is a c at the first point and b c at the second. N = b θ² + 2 θ θ' + a θ'² and
    D = θ² + (a + b) θ θ' + θ'², where θ rises with F from 0 to 1, and θ' = 1 − θ (Gregory and
    Delbourgo, IMA J. Numer. Anal. 2, 1982). Strain and its inverse are C1. EA = 1/(dε/dF) is
    continuous and positive.

    The slopes at the points follow from ln EA of the chords. Each chord's ln EA is assigned to the
    middle of its strain, and interpolated to the strains of the points. From the last middle to an
    end of the table, ln EA changes by 0.5 to 1 times the change of a straight line. A slope is at
    most 3 times that of either neighbouring chord, and at least the smaller of the two, or half of
    it at an end.
    EA on an interval is then at most 2.1 times the largest rigidity of its chord and the two
    neighbours: D²/N is convex in (a, b), so it is largest in a corner.

    The error of EA in the last interval, from five or more exact points of a wire that stiffens
    (Eq. 19, power laws, exponential toes), is 2 % for even steps, 8 % for steps that grow up to
    twofold, 9 % for steps of 1, 2, 5, 10, … N, and 25 % or more for steps that grow faster. It is
    up to 31 % if EA levels off between the last two points. If the first point is at 0 N, the
    points do not determine EA near 0 N.

    Attributes:
        tensions: Tensions F of the points [N], ascending from 0 or more.
        strains: Strains ε of the points [-], ascending. Only their differences matter.

    Raises:
        InvalidInput: There are fewer than two points, or they are not ascending.
    """

    tensions: tuple[float, ...]
    strains: tuple[float, ...]

    def __post_init__(self) -> None:
        for name in ("tensions", "strains"):
            row = _row(name, getattr(self, name))
            if len(row) < 2:
                raise InvalidInput(name, f"{len(row)} given; two or more are needed.")
            for i, (a, b) in enumerate(pairwise(row)):
                if a >= b:
                    raise InvalidInput(
                        name, f"entry [{i + 1}] is {b:g} after {a:g}; they must rise."
                    )
            object.__setattr__(self, name, row)
        F, strains = self.tensions, self.strains
        if len(F) != len(strains):
            raise InvalidInput("strains", f"{len(strains)} given for {len(F)} tensions.")
        if F[0] < 0.0:
            raise InvalidInput("tensions", f"{F[0]:g} N is negative; cables only pull.")
        steps = np.diff(F)
        if steps.min() < SMALLEST:
            raise InvalidInput("tensions", f"two points are only {steps.min():g} N apart.")
        chords = self._curve.chords
        if not chords.max() < LARGEST:
            raise InvalidInput("strains", "rise so steeply that there is no rigidity left.")
        if not chords.min() > 1.0 / LARGEST:
            raise InvalidInput("strains", "rise so little that the rigidity is not finite.")

    @cached_property
    def _curve(self) -> RisingCurve:
        return RisingCurve(np.array(self.tensions), np.subtract(self.strains, self.strains[0]))

    @cached_property
    def domain(self) -> Domain:
        """Domain of the law, from the first to the last tension of the points [N]."""
        return Domain(self.tensions[0], self.tensions[-1])

    def scaled(self, factor: float) -> TabulatedElasticity:
        """Return the law with the strains divided by the factor; see :meth:`Elasticity.scaled`."""
        times = positive_factor(factor)
        return replace(self, strains=tuple(strain / times for strain in self.strains))

    def rigidity(self, tension: ArrayLike) -> Array:
        """Compute EA = 1/(dε/dF) [N]; see :meth:`Elasticity.rigidity`."""
        return np.asarray(1.0 / self._curve.slope(self.domain.check(tension)))

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        """Compute −ε″/ε′² [-]; see :meth:`Elasticity.rigidity_slope`.

        At a point of the table, the value is that of the piece below the point.
        """
        values = self.domain.check(tension)
        return np.asarray(-self._curve.second_derivative(values) / self._curve.slope(values) ** 2)

    def strain(self, tension: ArrayLike) -> Array:
        """Compute ε [-]; see :meth:`Elasticity.strain`."""
        return self._curve.value(self.domain.check(tension))

    def energy(self, tension: ArrayLike) -> Array:
        """Compute ∫ F dε [N], exact to rounding; see :meth:`Elasticity.energy`."""
        return self._curve.moment(self.domain.check(tension))


def _row(name: str, values: ArrayLike) -> tuple[float, ...]:
    numbers = number_array(name, values)
    if numbers.ndim != 1:
        raise InvalidInput(name, f"{values!r} given; a sequence of numbers is needed.")
    return tuple(numbers.tolist())
