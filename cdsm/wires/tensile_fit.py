"""Fit the elasticity of a wire to its tensile test."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.errors import InvalidInput
from cdsm.support.result import Result, quantity, unit
from cdsm.support.validation import checked_quantity, interval, number_array, scalar
from cdsm.support.values import Array, Plotted, frozen
from cdsm.wires.elasticity import Elasticity
from cdsm.wires.laws import TabulatedElasticity
from cdsm.wires.tensile_branch import FEWEST, loading, refuse
from cdsm.wires.tensile_curve import FittedCurve, fit_curve
from cdsm.wires.tensile_test import TensileTest

_NORMAL: Final = 1.959963984540054  # quantile of the normal distribution for 95 %
_EXACT: Final = 1e-4  # error of ln EA without noise: from the grid, and from the fitted table
_FEWEST_POINTS: Final = 41  # points that tell the scatter
_YIELD: Final = 0.8  # EA below this share of its plateau is plastic
_STEP: Final = 1.25  # ratio of tensions for d ln EA/d ln F; a smaller one takes noise for slope
_LEAST: Final = 1e3  # EA [N] below which a law is doubted, as of LinearElasticity
_CERTAIN: Final = 3.0  # standard deviations


class TestStage(NamedTuple):
    """Stage of a tensile test: ``pre-tensioning``, ``elastic`` or ``plastic``."""

    name: str
    low: float
    """Tension at which the stage begins [N]."""
    high: float
    """Tension at which the stage or the test ends [N]."""


class Band(NamedTuple):
    """95 % confidence band of EA(F), from the scatter of the points of a test.

    It is exp(m ± 1.96 s), with ln EA = m of a curve that is rougher than the fitted one, widened to
    contain the fit. s² is the variance of m, from the scatter of the points near each strain, plus
    the square of its bias by the smoothing, (JᵀJ + S)⁻¹ S x with the penalty xᵀ S x at the fitted
    x (S. N. Wood, Generalized Additive Models, 2017, section 6.10). The band holds at each tension
    for itself, and misses EA within some newtons of a kink. It ignores errors of calibration and
    gauge length, and drift.
    """

    tension: Array
    """Tensions F, shape (n,) [N]."""
    low: Array
    """Lower end of EA, shape (n,) [N]."""
    high: Array
    """Upper end of EA, shape (n,) [N]."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class TensileFit(Result, Plotted):
    """Elasticity fitted to a tensile test, with the test and the quality of the fit.

    Attributes:
        elasticity: Law of the wire, from the first load to the yield or the end of the branch.
        stages: Stages found in the rigidity curve: pre-tensioning, elastic, plastic, in this order.
        band: 95 % confidence :class:`Band` of EA.
        rms: Root mean square of measured minus fitted force at the fitted points [N].
        start: Displacement at the low end of the law [m].
        test: The test.
        notes: One sentence for each part of the test that was left out, and for each doubt.
    """

    elasticity: Elasticity
    stages: tuple[TestStage, ...]
    band: Band
    rms: float = field(metadata=unit("N"))
    start: float = field(metadata=unit("m"))
    test: TensileTest
    notes: tuple[str, ...] = ()

    _headline = "rigidity"
    _rows = "tension"
    _figure = "plot_tensile_fit"

    @quantity("N", "tension")
    def tension(self) -> Array:
        """About 200 tensions of the law, ascending, shape (n,) [N]."""
        return self.band.tension

    @quantity("N", "tension")
    def rigidity(self) -> Array:
        """Tangent rigidity EA at these tensions, shape (n,) [N]."""
        return frozen(self.elasticity.rigidity(self.tension))

    @quantity("N", "tension")
    def rigidity_low(self) -> Array:
        """Lower end of the band, shape (n,) [N]."""
        return self.band.low

    @quantity("N", "tension")
    def rigidity_high(self) -> Array:
        """Upper end of the band, shape (n,) [N]."""
        return self.band.high

    def __str__(self) -> str:
        F = self.tension[[0, -1]]
        EA = self.rigidity[[0, -1]]
        u = self.relative_uncertainty()
        length = 1e3 * self.test.gauge_length
        lines = [
            f"Tensile test of {self.test.force.size} points, gauge length {length:g} mm",
            f"  tension   {F[0]:.4g} N to {F[1]:.4g} N",
            f"  rigidity  {EA[0]:.4g} N to {EA[1]:.4g} N, ± {100.0 * u:.2g} % (one σ)",
            f"  rms       {self.rms:.3g} N of force",
            *(f"  stage     {name} {low:.4g} N to {high:.4g} N" for name, low, high in self.stages),
            *(f"  note      {note}" for note in self.notes),
        ]
        return "\n".join(lines)

    def relative_uncertainty(self, low: float | None = None, high: float | None = None) -> float:
        """Return the relative standard uncertainty of EA [-] from ``low`` to ``high`` [N].

        It is the root mean square, over these tensions, of the half-width of the band of ln EA over
        1.96; None is an end of the law. The band is widest near slack: give the tensions at which
        the cables work. For cables of one spool, ``Tolerance(u, correlation=1.0)``; it is too large
        in so far as errors at different tensions cancel.

        Raises:
            InvalidInput: ``low`` is not below ``high``, or one of them is outside the law.
        """
        first, last = self.tension[[0, -1]].tolist()
        a = first if low is None else scalar("low", low)
        b = last if high is None else scalar("high", high)
        if not first <= a < b <= last:
            raise InvalidInput(
                "low", f"from {a:g} to {b:g} N given; the band is from {first:g} to {last:g} N."
            )
        half = np.log(self.band.high / self.band.low) / 2.0
        half = np.interp(np.linspace(a, b, 200), self.tension, half)
        return float(np.sqrt(np.mean(half**2)) / _NORMAL)


def fit_tensile_test(
    displacement: ArrayLike,
    force: ArrayLike,
    gauge_length: float,
    *,
    between: tuple[float, float] = (-np.inf, np.inf),
) -> TensileFit:
    r"""Fit the tangent rigidity `EA(F) = l_0 dF/dΔl` [N] of a wire to its tensile test.

    The forces are fitted by a C1 curve with EA > 0, whose ln EA is a spline. Its smoothness follows
    from the data (restricted likelihood).

    One loading branch is fitted, the last complete one, so cycles that bed the wire in are left
    out. It reaches 95 % of the largest force; or it begins near zero and reaches 85 % of the
    complete branch before it, as peaks relax from cycle to cycle. Points far from their neighbours,
    slack, holds, and what follows the largest force are left out too; ``notes`` counts them, and
    names the other branches. What the wire creeps in a hold on the way is taken out.

    The law ends where plasticity begins: from there on, EA stays below 0.8 of its plateau, beyond
    its uncertainty. The first stage, pre-tensioning, ends where EA begins to grow slower than `√F`.

    A strain above 1, or a rigidity outside 1 N to 1e9 N, is refused as a wrong unit. A rigidity
    below 1 kN is doubted in ``notes``: kN, or exchanged columns?

    Args:
        displacement: Δl, shape (n,) [m], in the order recorded.
        force: F, shape (n,) [N].
        gauge_length: `l_0` [m].
        between: Smallest and largest force to fit [N]. It also chooses the branch: the last one
            that reaches 95 % of its upper end.

    Raises:
        InvalidInput: An argument is not finite numbers, the arrays differ in length, the gauge
            length is not positive, the wire is compressed, the force does not rise or jumps, the
            units are impossible, or fewer than 8 points are left or lie below the yield.

    Example:
        >>> import cdsm
        >>> test = cdsm.read_tensile_csv("examples/data/TEST.csv", gauge_length=0.5)
        >>> fit = cdsm.fit_tensile_test(test.displacement, test.force, test.gauge_length)
        >>> print(fit)
        Tensile test of 92 points, gauge length 500 mm
          tension   0.0444 N to 120.1 N
          rigidity  3.679e+04 N to 3.681e+04 N, ± 0.18 % (one σ)
          rms       0.11 N of force
          stage     elastic 0.0444 N to 120.1 N
          note      points after the largest force left out: 25
          note      points of holds left out: 6
    """
    u = number_array("displacement", displacement)
    F = number_array("force", force)
    length = checked_quantity("gauge_length", gauge_length, "length")
    if u.ndim != 1 or u.shape != F.shape:
        raise InvalidInput("force", f"shapes {u.shape} and {F.shape} given; a point needs both.")
    points = loading(u / length, F, interval("between", between, "N"))
    strain = points.strain
    pull = points.force
    notes = points.notes
    curve = fit_curve(strain, pull, points.noise, points.resolution)
    onset = _yield_onset(curve)
    most = float(pull.max())
    if onset is not None:  # fit again: the yield would distort the curve below it
        strain = strain[pull <= onset]
        pull = pull[pull <= onset]
        notes += (
            f"plastic from {onset:.4g} N on: {len(points.force) - len(pull)} points left out",
        )
        if len(pull) < FEWEST:
            refuse(
                f"the wire yields from {onset:.4g} N on, after {len(pull)} points; {FEWEST} are "
                "needed. Sample more finely below the yield."
            )
        curve = fit_curve(strain, pull, points.noise, points.resolution)
    if len(pull) < _FEWEST_POINTS:
        notes += (
            f"{len(pull)} points, fewer than {_FEWEST_POINTS}: the band may miss EA more often",
        )
    if curve.correlation > 4.0 / np.sqrt(len(pull)):
        notes += (
            f"neighbouring residuals go together (correlation {curve.correlation:.2f}): the force "
            "drifts, a grip slips, or EA bends too sharply. The band is too narrow",
        )
    grid, law = _as_law(curve, strain)
    notes = (*_doubts(float(law.rigidity(grid).max())), *notes)
    low = float(grid[0])
    high = float(grid[-1])
    begin = _pretension_end(curve)
    stages = [TestStage("elastic", low if begin is None else begin, high)]
    stages[:0] = [] if begin is None else [TestStage("pre-tensioning", low, begin)]
    stages += [] if onset is None else [TestStage("plastic", high, max(most, high))]
    middle, deviation = (np.interp(grid, curve.tension, a) for a in (curve.rough, curve.deviation))
    half = np.maximum(_NORMAL * deviation, _EXACT)
    level = np.log(law.rigidity(grid))
    ends = np.minimum(middle - half, level), np.maximum(middle + half, level)
    error = pull - np.interp(strain, curve.strain, curve.tension)
    return TensileFit(
        elasticity=law,
        stages=tuple(stages),
        band=Band(frozen(grid), *(frozen(np.exp(end)) for end in ends)),
        rms=float(np.sqrt(np.mean(error**2))),
        start=float(np.interp(low, curve.tension, curve.strain)) * length,
        test=TensileTest(frozen(u), frozen(F), length),
        notes=notes,
    )


def _doubts(rigidity: float) -> tuple[str, ...]:
    """Return a note on the largest rigidity [N] of a law, if hardly any wire has it."""
    if rigidity >= _LEAST:
        return ()
    return (
        f"EA is {rigidity:.4g} N at most, far too little for a wire: are displacement and force "
        "exchanged, or is the force in kN?",
    )


def _as_law(curve: FittedCurve, strain: Array) -> tuple[Array, TabulatedElasticity]:
    """Return about 200 tensions [N] over the strains (n,) that were fitted, and the law there."""
    low, high = np.interp([strain.min(), strain.max()], curve.strain, curve.tension)
    low = low if low > 1e-6 * high else 0.0
    inside = (curve.tension > low) & (curve.tension < high)
    F = np.array([low, *curve.tension[inside][1:-1:3], high])
    along = np.interp(F, curve.tension, curve.strain)
    return F, TabulatedElasticity(F.tolist(), (along - along[0]).tolist())


def _yield_onset(curve: FittedCurve) -> float | None:
    """Return F [N] from which EA surely stays below 0.8 of its plateau, which no slip raises."""
    F = curve.tension
    level = curve.level
    even = np.linspace(F[0], F[-1], 200)
    sure = np.interp(even, F, level - _CERTAIN * curve.deviation)
    limit = np.quantile(sure, 0.9) + np.log(_YIELD)
    onset = int(np.flatnonzero(level >= limit)[-1]) + 1
    return float(F[onset]) if (level + _CERTAIN * curve.deviation < limit)[onset:].any() else None


def _pretension_end(curve: FittedCurve) -> float | None:
    """Return F [N] beyond which EA grows slower than √F, midway from EA ∝ F to constant, if any."""
    F = curve.tension[(curve.tension > _STEP * curve.tension[0])]
    F = F[curve.tension[-1] > F * _STEP]
    sides = [np.interp(F * s, curve.tension, curve.level) for s in (_STEP, 1.0 / _STEP)]
    rise = sides[0] - sides[1]
    sure = np.interp(F, curve.tension, curve.deviation)
    steep = np.flatnonzero(rise >= np.maximum(np.log(_STEP), _CERTAIN * sure))
    return float(F[steep[-1]]) if len(steep) else None
