"""Known laws come back from tests made of them, whatever wire, noise and density."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import cdsm
from cdsm.support.values import Array

REPEATABLE = settings(derandomize=True, database=None, deadline=None, max_examples=5)

POINTS = st.integers(60, 600)
NOISE = st.sampled_from([0.0, 0.1, 0.5, 2.0])  # [N]
GAUGE = st.floats(0.05, 2.0)  # [m]
SEED = st.integers(0, 10_000)

HIGHEST = 800.0  # [N]


def made(law: cdsm.Elasticity, low: float, points: int, gauge: float) -> tuple[Array, Array]:
    """Displacement [m] and force [N] of a perfect test, even in force."""
    force = np.linspace(low, HIGHEST, points)
    return gauge * (law.strain(force) - law.strain(low)), force


def misfit(fit: cdsm.TensileFit, law: cdsm.Elasticity, tensions: Array) -> float:
    """Relative rms error of EA."""
    return float(
        np.sqrt(np.mean((fit.elasticity.rigidity(tensions) / law.rigidity(tensions) - 1.0) ** 2))
    )


def of_slope(noise: float, points: int, window: float) -> float:
    """Standard deviation of a slope over a window of tension, as part of the slope.

    A line through n points even in x over a range w has the slope's deviation σ√12/(w√n). The fit
    looks at windows; how wide they are follows from the data, and half the range is what a smooth
    law leaves it.
    """
    inside = max(points * window / HIGHEST, 2.0)
    return float(noise * np.sqrt(12.0 / inside) / window)


@REPEATABLE
@given(POINTS, NOISE, GAUGE, SEED, st.floats(3.0, 6.0))
def test_constant_rigidity(
    points: int, noise: float, gauge: float, seed: int, decade: float
) -> None:
    law = cdsm.LinearElasticity(10.0**decade)
    displacement, force = made(law, 1.0, points, gauge)
    force = force + noise * np.random.default_rng(seed).normal(size=points)
    fit = cdsm.fit_tensile_test(displacement, force, gauge)
    inner = np.linspace(0.1 * HIGHEST, 0.9 * HIGHEST, 50)
    assert misfit(fit, law, inner) < 1e-6 + 6.0 * of_slope(noise, points, HIGHEST / 2.0)
    assert [stage.name for stage in fit.stages] == ["elastic"]
    assert fit.rms < 1e-6 * HIGHEST + 1.2 * noise


@REPEATABLE
@given(POINTS, NOISE, GAUGE, SEED)
def test_eq_19(points: int, noise: float, gauge: float, seed: int) -> None:
    law = cdsm.presets.STRAND_1X19
    displacement, force = made(law, 2.3, points, gauge)
    force = force + noise * np.random.default_rng(seed).normal(size=points)
    fit = cdsm.fit_tensile_test(displacement, force, gauge)
    inner = np.linspace(60.0, 780.0, 100)
    # EA bends over some 100 N; what is left without noise is the smoothed bend
    assert misfit(fit, law, inner) < 0.02 + 4.0 * of_slope(noise, points, 100.0)
    assert fit.stages[0].name == "pre-tensioning"
    assert 80.0 < fit.stages[0].high < 170.0  # the paper says 120 N


@REPEATABLE
@given(POINTS, NOISE, GAUGE, SEED, st.floats(0.05, 0.5), st.floats(20.0, 100.0))
def test_toe_and_constant(
    points: int, noise: float, gauge: float, seed: int, toe: float, width: float
) -> None:
    """EA rises from a share of its final value, with the tension, to a constant."""
    final = 48e3
    F = np.linspace(0.0, 1.1 * HIGHEST, 4000)
    compliance = (1.0 + (1.0 / toe - 1.0) * np.exp(-F / width)) / final
    strain = np.concatenate(
        [[0.0], np.cumsum((compliance[1:] + compliance[:-1]) / 2.0 * np.diff(F))]
    )
    law = cdsm.TabulatedElasticity(tuple(F.tolist()), tuple(strain.tolist()))
    displacement, force = made(law, 1.0, points, gauge)
    force = force + noise * np.random.default_rng(seed).normal(size=points)
    fit = cdsm.fit_tensile_test(displacement, force, gauge)
    inner = np.linspace(60.0, 780.0, 100)
    assert misfit(fit, law, inner) < 0.02 + 4.0 * of_slope(noise, points, 100.0)
    assert fit.stages[-1].name == "elastic"


@REPEATABLE
@given(GAUGE, SEED, st.floats(0.1, 10.0))
def test_the_law_does_not_depend_on_how_long_the_wire_was(
    gauge: float, seed: int, times: float
) -> None:
    displacement, force = made(cdsm.presets.STRAND_1X19, 2.3, 150, gauge)
    force = force + 0.5 * np.random.default_rng(seed).normal(size=150)
    one = cdsm.fit_tensile_test(displacement, force, gauge)
    other = cdsm.fit_tensile_test(times * displacement, force, times * gauge)
    low = max(one.elasticity.low, other.elasticity.low)
    high = min(one.elasticity.high, other.elasticity.high)
    tensions = np.linspace(low, high, 50)
    # the same points but for rounding; the search for the smoothness ends where it ends
    np.testing.assert_allclose(
        other.elasticity.rigidity(tensions), one.elasticity.rigidity(tensions), rtol=1e-4
    )
