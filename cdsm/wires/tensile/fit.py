"""Fit the elasticity of a wire to its tensile test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, final

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from cdsm.errors import InvalidInput, TensileTestError
from cdsm.support.validation import RANGES, scalar
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tolerances import EVERY, Tolerance
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import TabulatedElasticity
from cdsm.wires.tensile.loading import FEWEST, Points, loading
from cdsm.wires.tensile.record import TensileTest
from cdsm.wires.tensile.spline import NEAR, Curve, fit_curve
from cdsm.wires.tensile.stages import doubts, pretension_end, refuse_jumps, yield_onset

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CONFIDENCE: Final = 0.95
_UNKNOWN: Final = 1e9  # largest factor from EA to an end of the band; more would tell nothing
_EXACT: Final = 1e-4  # error of ln EA without noise: from the grid, and from the fitted table
_KNOTS: Final = 200  # tensions in a fitted table, about: enough for linear interpolation


@final
@dataclass(frozen=True)
class Stage:
    """Stage of a tensile test.

    Attributes:
        name: ``pre-tensioning``, ``elastic`` or ``plastic``.
        low: Tension at which the stage begins [N].
        high: Tension at which the stage or the test ends [N].
    """

    name: str
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.name} {self.low:.4g} N to {self.high:.4g} N"


@final
@dataclass(frozen=True, eq=False)
class Band(ReadOnlyState):
    """95 % confidence band of EA(F), from the scatter of the points of a test.

    At each tension it contains EA with a probability of 95 %.

    The band exp(m ± t s) belongs to a rougher curve than the fitted one: the bias of the rougher
    curve is far below its scatter. m is ln EA of the rougher curve, s the standard deviation of m
    from the residuals near each tension, and t the quantile of Student's distribution. The fitted
    law is smoother: where it leaves this interval, the band is widened to contain it. t s is at
    least 1e-4, the error of a fit without noise.

    In 100 tests of 400 points each, of three wires with 0.5 N and 2 N of noise, the band contained
    EA in 95.9 % of all cases, and in 90 to 100 % at each of 14 tensions. Within a few newtons of a
    kink of the force as a function of strain, it misses EA.

    With fewer than 41 points it may contain EA less often, and ``TensileFit.notes`` says so: one
    scatter is then taken for all tensions, and a bend of EA between two points shows in no
    residual. In 20 tests each of four wires with 0.05 N and 0.5 N of noise, it contained EA at 95
    to 100 % of the tensions with 60 or 30 points, at 92 to 99 % with 18, and at 82 to 94 % with 12;
    with 30 points and 2 N, EA of Eq. 19 at 72 %.

    The band ignores errors of calibration and gauge length, and errors that neighbouring points
    share (drift, ripple, slip). ``TensileFit.notes`` names shared errors if the residuals show
    them. A load cell with steps coarser than the noise also causes shared errors: with 400 points
    even in strain and steps of 0.5 N, the band contains EA of Eq. 19 at 89 % of the tensions
    without noise, at 90 % with 0.1 N of noise, and at 93 % with 0.5 N (8 tests each).

    Attributes:
        tensions: Tensions F, shape (n,) [N].
        low: Lower end of EA, shape (n,) [N].
        high: Upper end of EA, shape (n,) [N].
    """

    tensions: Array
    low: Array
    high: Array


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class TensileFit(ReadOnlyState):
    """Elasticity fitted to a tensile test, with the test and the quality of the fit.

    Attributes:
        elasticity: Law of the wire, from the first load to the yield or the end of the test.
        stages: Stages found in the rigidity curve: pre-tensioning, elastic, plastic, in this order.
        rms: Root mean square of measured minus fitted force over the domain [N]. Averaged points
            count as one point.
        tensions: About 200 tensions F over the domain, ascending, shape (n,) [N].
        band: 95 % confidence :class:`Band` of EA at these tensions.
        test: The test.
        start: Displacement at the low end of the domain [m].
        notes: One sentence for each part of the test that was not used, and for each doubt.
    """

    elasticity: Elasticity
    stages: tuple[Stage, ...]
    rms: float
    tensions: Array
    band: Band
    test: TensileTest
    start: float
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        low, high = self.elasticity.low, self.elasticity.high
        return f"<TensileFit, {low:.4g} to {high:.4g} N>"

    def __str__(self) -> str:
        low, high = self.elasticity.low, self.elasticity.high
        ends = self.elasticity.rigidity(self.tensions[[0, -1]])
        return "\n".join(
            [
                f"Tensile test of {self.test.force.size} points, gauge length "
                f"{1e3 * self.test.gauge_length:g} mm",
                f"  tension   {low:.4g} N to {high:.4g} N",
                f"  rigidity  {ends[0]:.4g} N to {ends[1]:.4g} N",
                f"  rms       {self.rms:.3g} N of force",
                *(f"  stage     {stage}" for stage in self.stages),
                *(f"  note      {note}" for note in self.notes),
            ]
        )

    def tolerance(
        self, low: float | None = None, high: float | None = None, *, of: str = EVERY
    ) -> Tolerance:
        """Return the band as a tolerance for the rigidity of cables made of this wire.

        The standard uncertainty of EA at a tension is half the width of the band of ln EA, divided
        by 1.96. The tolerance has its root mean square from ``low`` to ``high`` [N], the tensions
        at which the cables work; None: an end of the domain. The band is widest near slack. The
        cables are assumed to be of one spool and share one error; ``of`` are their names, as for
        :class:`~cdsm.Tolerance`.

        Raises:
            InvalidInput: ``low`` is not below ``high``, or one of them is outside the domain.
        """
        first, last = self.band.tensions[[0, -1]].tolist()
        a = first if low is None else scalar("low", low)
        b = last if high is None else scalar("high", high)
        if not first <= a < b <= last:
            raise InvalidInput(
                "low", f"from {a:g} to {b:g} N given; the band is from {first:g} to {last:g} N."
            )
        half = np.log(self.band.high / self.band.low) / 2.0
        half = np.interp(np.linspace(a, b, _KNOTS), self.band.tensions, half)
        standard = np.sqrt(np.mean(half**2)) / ndtri((1.0 + _CONFIDENCE) / 2.0)
        return Tolerance(float(standard), correlation=1.0, of=of)

    def plot(self) -> Figure:
        """Plot force [N] against displacement [mm] with the fit; EA [kN] with band and stages."""
        from cdsm.plots.measured import plot_tensile_fit  # matplotlib imports slowly

        return plot_tensile_fit(self)


def fit_tensile_test(displacement: ArrayLike, force: ArrayLike, gauge_length: float) -> TensileFit:
    r"""Fit the tangent rigidity EA(F) = l_0 dF/dΔl [N] of a wire to its tensile test.

    The forces are fitted by a C1 curve with EA > 0, whose log EA is a spline. Its smoothness
    follows from the data (restricted likelihood).

    Points of equal displacement are averaged. The fit ignores unloading, points after the largest
    force, single points far from their neighbours, and slack, which ends where the force rises
    beyond three standard deviations of its noise. ``notes`` lists these points, points far from the
    curve, falls of the force (a grip slips) and correlated residuals (drift).

    The domain ends where plasticity begins: from there on, EA stays below 0.8 of its largest value,
    beyond its uncertainty. The first of the ``stages``, pre-tensioning, ends where EA begins to
    grow slower than √F.

    Wrong units are found only if the strain is above 1 or the rigidity is outside 1 N to 1e9 N.
    For example, forces in kN that are taken as N fit a thin thread. So read the report.

    Args:
        displacement: Δl, shape (n,) [m], in the order recorded.
        force: F, shape (n,) [N].
        gauge_length: l_0 [m].

    Raises:
        InvalidInput: An argument is not finite numbers.
        TensileTestError: The arrays differ in length, there are fewer than 8 points, the gauge
            length is not positive, the wire is compressed, the force does not rise or is
            discontinuous, the units are impossible (the likely mistake is named), or fewer than
            8 points lie below the yield.
    """
    test = TensileTest(displacement, force, gauge_length)  # type: ignore[arg-type]
    points, noise, notes = loading(test)
    curve = fit_curve(points, noise)
    most = float(points.force.max())
    spread = curve.spread(points)
    onset = yield_onset(curve.basis.tensions, curve.rigidity, spread.deviation)
    if onset is not None:
        points = points.part(curve.force(points.strain) <= onset)
        if len(points.force) < FEWEST:
            raise TensileTestError(
                f"the wire yields from {onset:.4g} N on, after {len(points.force)} points; a fit "
                f"needs at least {FEWEST}. Sample more finely below the yield."
            )
        curve = fit_curve(points, noise)  # fit again: the yield would distort the curve below it
        spread = curve.spread(points)
        notes += (f"plastic from {onset:.4g} N on: left out",)
    refuse_jumps(curve, points)
    if len(points.force) < NEAR:
        notes += (
            f"{len(points.force)} points, fewer than {NEAR}, give the band: it may contain EA less "
            "often than 95 %, since a bend of EA between two points shows in no scatter. Record "
            "more points where EA bends",
        )
    elasticity = _as_law(curve, points)
    grid = curve.basis.tensions
    tensions = frozen(_grid(elasticity.low, elasticity.high, grid))
    start = np.interp(tensions[0], grid, curve.strain) - elasticity.strain(tensions[0])
    strain = points.strain - start
    fitted = np.interp(strain, elasticity.strain(tensions), tensions)
    inside = (strain >= 0.0) & (fitted < tensions[-1])
    deviation = np.interp(tensions, grid, spread.deviation)
    elastic_from = pretension_end(tensions, elasticity.rigidity(tensions), deviation)
    return TensileFit(
        elasticity=elasticity,
        stages=_stages(tensions, elastic_from, onset, most),
        rms=float(np.sqrt(np.mean((points.force - fitted)[inside] ** 2))),
        tensions=tensions,
        band=_band(tensions, elasticity, curve, points),
        test=test,
        start=float(start) * test.gauge_length,
        notes=notes + doubts(points, spread, test.gauge_length),
    )


def _stages(
    tensions: Array, elastic_from: float | None, onset: float | None, most: float
) -> tuple[Stage, ...]:
    low, high = float(tensions[0]), float(tensions[-1])
    stages = [Stage("elastic", low if elastic_from is None else elastic_from, high)]
    if elastic_from is not None:
        stages.insert(0, Stage("pre-tensioning", low, elastic_from))
    if onset is not None:
        stages.append(Stage("plastic", high, max(most, high)))
    return tuple(stages)


def _as_law(curve: Curve, points: Points) -> TabulatedElasticity:
    """Return a fitted curve as a table of strains, over the range of forces of the points."""
    grid = curve.basis.tensions
    # the ends follow from the fit: noise would shift the extreme forces
    first, last = curve.force(points.strain[[0, -1]])
    low = max(grid[0], float(first))
    low = low if low >= RANGES["tension"].low else 0.0  # rounding of a test that begins at zero
    tensions = _grid(low, min(grid[-1], float(last)), grid)
    strain = np.interp(tensions, grid, curve.strain)
    return TabulatedElasticity(tuple(tensions.tolist()), tuple((strain - strain[0]).tolist()))


def _band(tensions: Array, law: Elasticity, curve: Curve, points: Points) -> Band:
    middle, half = (
        np.interp(tensions, curve.basis.tensions, each)
        for each in curve.interval(points, _CONFIDENCE)
    )
    half, fitted = np.clip(half, _EXACT, np.log(_UNKNOWN)), law.rigidity(tensions)
    low = np.minimum(np.exp(middle - half), fitted)
    return Band(tensions, frozen(low), frozen(np.maximum(np.exp(middle + half), fitted)))


def _grid(low: float, high: float, grid: Array) -> Array:
    """Choose about 200 tensions (n,) [N]: ``low``, some of ``grid`` between, and ``high``."""
    inside = grid[(grid > low) & (grid < high)][5 :: len(grid) // _KNOTS]
    return np.array([low, *inside[:-1], high])
