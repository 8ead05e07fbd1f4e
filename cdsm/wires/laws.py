"""Wires whose rigidity depends on tension: polynomials as in Eq. 19, or a measured curve."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Final, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.elasticity import Domain, Elasticity
from cdsm.errors import ElasticityRangeError, InvalidInput
from cdsm.support.validation import LARGEST, SMALLEST, Array, number_array, scalar
from cdsm.wires.quadrature import Panels, coefficient_table, panels, piecewise
from cdsm.wires.rising_curve import RisingCurve

EQ19_PRINTED: Final = (
    (-556.89, 377.99, -70.49, 8.74, -0.46, 1.12e-2, -1e-4),
    (-1924.5, 493.35, -2.26, 0.0054, -6.94e-6, 4.58e-9, -1.22e-12),
)
"""Coefficients of Eq. 19 in the printed digits, but for the misprinted −1e-3 (see cdsm.paper)."""

EQ19: Final = (
    (-556.89, 377.99, -70.49, 8.74, -0.46, 1.12e-2, -9.946263022943622e-05),
    (-1924.5, 493.34505, -2.26495, 5.38168e-3, -6.93505e-6, 4.58495e-9, -1.21505e-12),
)
"""Coefficients of the same digits whose branches meet; see StrandElasticity.eq19_repaired."""

_MEET = 1e-9
"""Largest difference of two ranges at their join, as a part of the rigidity: rounding."""


@final
@dataclass(frozen=True)
class StrandElasticity(Elasticity):
    """EA(F) as polynomials in the tension, one per range: the form of Eq. 19.

    Neighbouring polynomials meet at their join, within 1e-9 of EA: a rigidity is continuous.

    The polynomials are read as the *tangent* rigidity. Read as the secant of Eq. 18 they would need
    the tangent S²/(S − F S'), which is negative wherever S grows faster than F: for Eq. 19 that is
    the whole range up to 31 N, so that reading is not offered.

    Attributes:
        coefficients: One tuple per range, lowest power first [N, 1, 1/N, …].
        joins: Tension [N] at which each range ends and the next begins; a join belongs to the
            range below it. One fewer than the ranges.
        low: Low end of the domain [N], excluded.
        high: High end of the domain [N], included.

    Raises:
        InvalidInput: Numbers or their count do not fit, the tensions do not rise, or two ranges do
            not meet at their join.
    """

    coefficients: tuple[tuple[float, ...], ...]
    joins: tuple[float, ...]
    low: float
    high: float

    def __post_init__(self) -> None:
        if not all(isinstance(each, (list, tuple)) for each in (self.coefficients, self.joins)):
            raise InvalidInput("coefficients", "give a tuple for each range, and a tuple of joins.")
        rows = tuple(tuple(_row("coefficients", row)) for row in self.coefficients)
        joins = tuple(_row("joins", self.joins))
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
        """Eq. 19 of a 1×19 strand of 1.2 mm, with digits that the paper did not print filled in.

        The first coefficient is read as −1e-4: the printed −1e-3 gives −787 884 N at 31 N, where
        the other branch gives 11 352 N. Every coefficient then keeps the printed digits, which
        leave EA(31 N) open by 6 kN and EA(810 N) by 35 kN. Within them this law is continuous, most
        level from 400 to 810 N, where the text calls EA near-constant, and else nearest to what is
        printed: :func:`cdsm.paper.digits.most_level` finds it by linear programs. Its slope still
        falls from 1022 to 368 at 31 N: no law of these digits has one slope there, and the least
        fall, from 662, takes every other digit to the end of its rounding. The
        polynomial is negative below 2.11 N: the domain is (2.2 N, 810 N].
        """
        return cls(EQ19, joins=(31.0,), low=2.2, high=810.0)

    @cached_property
    def domain(self) -> Domain:
        """(low, high]."""
        return Domain(self.low, self.high, low_included=False)

    def polynomial(self, tension: ArrayLike) -> Array:
        """The bare polynomials [N], unchecked: for plots and for seeing what a misprint does.

        Args:
            tension: F [N], any shape; the outer ranges extend beyond the domain.

        Raises:
            InvalidInput: Not finite numbers.
        """
        values = number_array("tension", tension)
        return piecewise(self._joins, self._table, values)

    def rigidity(self, tension: ArrayLike) -> Array:
        """EA(F) [N] of Eq. 19; see :meth:`Elasticity.rigidity`."""
        values = self.domain.check(tension)
        result = self.polynomial(values)
        if not (result > 0.0).all():
            bad = np.flatnonzero(result <= 0.0)
            raise ElasticityRangeError(
                f"the polynomial gives {result.ravel()[bad[0]]:.6g} N, and a rigidity must be "
                "positive. Narrow the domain, or correct the coefficients.",
                values.ravel()[bad].tolist(),
                bad.tolist(),
            )
        return result

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        """Derivative of the polynomials [-]; see :meth:`Elasticity.rigidity_slope`."""
        values = self.domain.check(tension)
        return piecewise(self._joins, self._slopes, values)

    def strain(self, tension: ArrayLike) -> Array:
        """∫ dF/EA(F) [-], to rounding; see :meth:`Elasticity.strain`."""
        return self._integral(tension, power=0)

    def energy(self, tension: ArrayLike) -> Array:
        """∫ F dF/EA(F) [N], to rounding; see :meth:`Elasticity.energy`."""
        return self._integral(tension, power=1)

    @cached_property
    def _joins(self) -> Array:
        return np.array(self.joins)

    @cached_property
    def _table(self) -> Array:
        return coefficient_table(self.coefficients)

    @cached_property
    def _slopes(self) -> Array:
        powers = np.arange(1, len(self._table))
        return np.vstack([powers[:, None] * self._table[1:], np.zeros(self._table.shape[1])])

    @cached_property
    def _panels(self) -> Panels:
        return panels(self.coefficients, (self.low, *self.joins, self.high))

    def _integral(self, tension: ArrayLike, power: int) -> Array:
        """∫ F^power dF/EA(F) from the low end of the domain."""
        values = self.domain.check(tension)
        bad = values > self._panels.end
        if np.count_nonzero(bad):
            raise ElasticityRangeError(
                "the rigidity is not positive everywhere below, so there is no strain. Narrow the "
                "domain, or correct the coefficients.",
                np.atleast_1d(values)[np.atleast_1d(bad)].tolist(),
                np.flatnonzero(bad).tolist(),
            )
        return self._panels.integral(values, power)


@final
@dataclass(frozen=True)
class TabulatedElasticity(Elasticity):
    """A rising curve through measured points of strain over tension: any wire, from its test.

    Between two points dε/dF = c N/D², with θ from 0 to 1, θ' = 1 − θ, N = b θ² + 2 θ θ' + a θ'²,
    D = θ² + (a + b) θ θ' + θ'², c = Δε/ΔF of the chord, and slopes a c and b c at the points
    (Gregory and Delbourgo, IMA J. Numer. Anal. 2, 1982). Strain is C1, and so is its inverse, the
    force-displacement curve; EA = 1/(dε/dF) is continuous and positive.

    The slopes at the points follow from ln EA of the chords, each assigned to the middle of its
    strain and interpolated over the strain. At an end it changes as a straight line does, or at
    least half as much where it levels off. A slope is at most 3 times that of either chord beside
    the point, and at least the smaller of them; at an end at least half of its chord's.

    So EA is at most 2.1 times the largest rigidity of its own chord and the two beside it: let that
    be M times its own, M at least 2 in the first and last interval; then 1/M <= a, b <= 3. EA over
    its own chord's is D²/N. That is convex in (a, b), thus largest in a corner: D <= 1 and
    N >= 1/M if both are 1/M; N >= D and D <= 2 if both are 3; max(2.1, M) if one is 3.

    How well five or more exact points give EA in the last interval, if the wire stiffens (Eq. 19,
    power laws, exponential toes): within 2 % for even steps, 8 % for steps that grow up to twofold,
    9 % for steps of 1, 2, 5, 10, … N, but 25 % and more for steps that grow faster. If the wire
    levels off between the last two points, which the points cannot show, up to 31 %. Nor do they
    show how EA rises in the first interval of a wire without stiffness at 0 N.

    Attributes:
        tensions: F of the points [N], rising from 0 or more.
        strains: ε of the points [-], rising; only differences count.

    Raises:
        InvalidInput: Fewer than two points, or they do not rise.
    """

    tensions: tuple[float, ...]
    strains: tuple[float, ...]

    def __post_init__(self) -> None:
        rows = []
        for name in ("tensions", "strains"):
            row = _row(name, getattr(self, name))
            if len(row) < 2 or any(a >= b for a, b in pairwise(row)):
                raise InvalidInput(name, f"{len(row)} points given; two or more, rising, needed.")
            rows.append(row)
            object.__setattr__(self, name, tuple(row))
        if len(rows[0]) != len(rows[1]):
            raise InvalidInput("strains", f"{len(rows[1])} given for {len(rows[0])} tensions.")
        if rows[0][0] < 0.0:
            raise InvalidInput("tensions", f"{rows[0][0]:g} N is negative; cables only pull.")
        steps = np.diff(rows[0])
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
        """[first, last] tension of the points."""
        return Domain(self.tensions[0], self.tensions[-1])

    def rigidity(self, tension: ArrayLike) -> Array:
        """1/(dε/dF) [N]; see :meth:`Elasticity.rigidity`."""
        return np.asarray(1.0 / self._curve.slope(self.domain.check(tension)))

    def rigidity_slope(self, tension: ArrayLike) -> Array:
        """−ε″/ε′² [-], at a point of the table that of the piece below.

        See :meth:`Elasticity.rigidity_slope`.
        """
        values = self.domain.check(tension)
        return np.asarray(-self._curve.second_derivative(values) / self._curve.slope(values) ** 2)

    def strain(self, tension: ArrayLike) -> Array:
        """ε [-] of the curve; see :meth:`Elasticity.strain`."""
        return self._curve.value(self.domain.check(tension))

    def energy(self, tension: ArrayLike) -> Array:
        """∫ F dε [N], to rounding; see :meth:`Elasticity.energy`."""
        return self._curve.moment(self.domain.check(tension))


def _row(name: str, values: ArrayLike) -> list[float]:
    numbers = number_array(name, values)
    if numbers.ndim != 1:
        raise InvalidInput(name, f"{values!r} given; a sequence of numbers is needed.")
    row: list[float] = numbers.tolist()
    return row
