"""Strain, tension, energy and rigidity of a wire belong together."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.integrate import quad

import cdsm
from cdsm.support.values import Array
from cdsm.wires.rising_curve import slopes_at_points
from tests.support.strategies import tabulated_elasticities

STRAND = cdsm.StrandElasticity.eq19_repaired()
TABLE = cdsm.TabulatedElasticity(
    tuple(np.linspace(5.0, 800.0, 60)), tuple(STRAND.strain(np.linspace(5.0, 800.0, 60)))
)
LAWS = {"linear": cdsm.LinearElasticity(48e3), "strand": STRAND, "table": TABLE}


@pytest.mark.parametrize("name", LAWS)
def test_tension_inverts_strain(name: str) -> None:
    law = LAWS[name]
    tension = np.array([[6.0, 31.0, 31.5], [120.0, 400.0, 799.0]])
    # strain is flat where the wire is stiff: 1e-16 of strain are some 1e-12 N there
    np.testing.assert_allclose(law.tension(law.strain(tension)), tension, rtol=1e-11)


@pytest.mark.parametrize("name", LAWS)
def test_energy_by_strain_is_tension_and_tension_by_strain_is_rigidity(name: str) -> None:
    law = LAWS[name]
    tension = np.array([12.0, 60.0, 250.0, 700.0])
    strain = np.asarray(law.strain(tension))
    errors = []
    for step in (2e-5, 1e-5):
        up, down = law.tension(strain + step), law.tension(strain - step)
        force = (law.energy(up) - law.energy(down)) / (2.0 * step)
        rigidity = (up - down) / (2.0 * step)
        errors.append([force / tension - 1.0, rigidity / law.rigidity(tension) - 1.0])
    coarse, fine = (abs(np.array(error)).max(axis=1) for error in errors)
    assert np.all(coarse < 2e-2)
    # second order (to 1e-9 if exact); a table's third derivative jumps at its points
    assert np.all(fine < np.maximum(0.3 * coarse, 1e-9))


@pytest.mark.parametrize("name", LAWS)
def test_strain_out_of_reach_is_refused(name: str) -> None:
    for strain in (-1e-3, 1e12):
        with pytest.raises(cdsm.ElasticityRangeError, match="no tension of the domain"):
            LAWS[name].tension(strain)


def test_table_passes_through_its_points() -> None:
    np.testing.assert_allclose(
        TABLE.strain(TABLE.tensions), np.subtract(TABLE.strains, TABLE.strains[0]), rtol=1e-13
    )
    assert tuple(TABLE.domain) == (5.0, 800.0)


@pytest.mark.parametrize(
    ("tensions", "strains"),
    [
        ((1.0,), (0.0,)),
        ((1.0, 1.0), (0.0, 1.0)),
        ((1.0, 2.0), (1.0, 0.0)),
        ((1.0, 2.0), (0.0, 1.0, 2.0)),
        ((-1.0, 2.0), (0.0, 1.0)),
        ((1.0, float("nan")), (0.0, 1.0)),
        ((0.0, 5e-324, 100.0), (0.0, 0.002, 0.005)),  # a slope beyond float64
        ((0.0, 1e-9, 100.0), (0.0, 1e7, 2e7)),  # a slope beyond all materials
        ((0.0, 1.0, 2.0), (-1e10, 1e-8, 2e-8)),  # equal, once counted from the first
    ],
)
def test_table_that_does_not_rise_is_refused(
    tensions: tuple[float, ...], strains: tuple[float, ...]
) -> None:
    with pytest.raises(cdsm.InvalidInput):
        cdsm.TabulatedElasticity(tensions, strains)


# --- the curve between the points -----------------------------------------------------------

EXACT: dict[str, tuple[Callable[[Array], Array], Callable[[Array], Array]]] = {
    "Eq. 19": (STRAND.strain, STRAND.rigidity),
    "power 0.3": (lambda F: 1e-3 * F**0.3, lambda F: 1e3 * F**0.7 / 0.3),
    "power 0.7": (lambda F: 1e-3 * F**0.7, lambda F: 1e3 * F**0.3 / 0.7),
    "exponential": (lambda F: 5e-3 * np.log1p(F / 20.0), lambda F: (F + 20.0) / 5e-3),
    "exponential, then straight": (
        lambda F: 1e-3 * np.log1p(F / 3.0) + F / 5e4,
        lambda F: 1.0 / (1e-3 / (F + 3.0) + 2e-5),
    ),
    "toe": (
        lambda F: 2e-3 * (1.0 - np.exp(-F / 30.0)) + F / 5e4,
        lambda F: 1.0 / (2e-3 / 30.0 * np.exp(-F / 30.0) + 2e-5),
    ),
}
"""Strain and rigidity of wires that stiffen."""


def even(low: float, high: float) -> Array:
    return np.linspace(low, high, 5)


def twofold(low: float, high: float) -> Array:
    """Each step is twice the one before."""
    return np.asarray(low + (high - low) * np.array([0.0, 1.0, 3.0, 7.0, 15.0]) / 15.0)


def one_two_five(low: float, high: float) -> Array:
    points = np.outer(10.0 ** np.arange(3), [1.0, 2.0, 5.0]).ravel()
    return points[(points >= low) & (points <= high)][-5:]


@pytest.mark.parametrize("wire", EXACT)
@pytest.mark.parametrize(
    ("spacing", "within"), [(even, 0.02), (twofold, 0.08), (one_two_five, 0.09)]
)
def test_five_exact_points_give_the_rigidity_in_the_last_interval(
    spacing: Callable[[float, float], Array], within: float, wire: str
) -> None:
    """With the slope of PCHIP at the end they were up to 9, 260 and 872 % off."""
    strain, rigidity = EXACT[wire]
    for high in (120.0, 200.0, 400.0, 800.0):
        for low in (2.5, 5.0, 10.0, 15.0):
            points = spacing(low, high)
            if len(points) < 5:
                continue
            law = cdsm.TabulatedElasticity(tuple(points), tuple(strain(points)))
            F = np.linspace(points[-2], points[-1], 80)
            np.testing.assert_allclose(law.rigidity(F), rigidity(F), rtol=within)


def test_rigidity_converges_with_the_square_of_the_step() -> None:
    strain, rigidity = EXACT["toe"]
    F = np.linspace(0.0, 200.0, 2001)
    errors = []
    for count in (40, 80, 160):
        points = np.linspace(0.0, 200.0, count + 1)
        law = cdsm.TabulatedElasticity(tuple(points), tuple(strain(points)))
        errors.append(abs(law.rigidity(F) / rigidity(F) - 1.0).max())
    assert errors[0] < 0.02
    for coarse, fine in pairwise(errors):
        assert fine < coarse / 3.5


def test_wire_that_stiffens_until_its_last_point_has_no_pole_there() -> None:
    """Once EA rose to 1.7 MN at the end of the first, and the second was refused."""
    tensions, strains = (0.0, 10.0, 30.0, 80.0, 200.0), (0.0, 0.02, 0.03, 0.036, 0.042)
    law = cdsm.TabulatedElasticity(tensions, strains)
    assert float(law.rigidity(200.0)) == pytest.approx(29e3, rel=0.02)
    assert (np.diff(law.rigidity(np.linspace(0.0, 200.0, 400))) > 0.0).all()
    steeper = cdsm.TabulatedElasticity((*tensions[:-1], 300.0), (*strains[:-1], 0.045))
    assert float(steeper.rigidity(300.0)) == pytest.approx(41e3, rel=0.02)


@settings(deadline=None)
@given(tabulated_elasticities())
def test_curve_meets_its_points_and_its_rigidity_the_bound(law: cdsm.TabulatedElasticity) -> None:
    points, strains = np.array(law.tensions), np.array(law.strains)
    np.testing.assert_allclose(law.strain(points), strains - strains[0], rtol=1e-12, atol=1e-18)
    chords = np.diff(points) / np.diff(strains)
    around = np.max([chords, np.append(chords[1:], 0.0), np.append(0.0, chords[:-1])], axis=0)
    for low, high, most in zip(points, points[1:], around, strict=False):
        F = np.linspace(low, high, 60)
        assert (np.diff(law.strain(F)) > 0.0).all()
        assert (law.rigidity(F) > 0.0).all()
        assert (law.rigidity(F) <= 2.1 * most).all()
    inside = points[1:-1]
    above = np.nextafter(inside, np.inf)
    # one unit in the last place can be 1e-13 of a piece along which EA changes ten-thousandfold
    np.testing.assert_allclose(law.rigidity(above), law.rigidity(inside), rtol=1e-8)


def test_bound_of_the_rigidity_is_nearly_reached() -> None:
    """It holds for every a and b that the slopes at the points can have."""
    t = np.linspace(0.0, 1.0, 1001)
    u = 1.0 - t
    for M in (1.0, 1.5, 2.0, 2.5, 10.0, 1e3):
        worst = 0.0
        for a in np.geomspace(1.0 / M, 3.0, 25):
            for b in np.geomspace(1.0 / M, 3.0, 25):
                D, N = t * t + (a + b) * t * u + u * u, b * t * t + 2.0 * t * u + a * u * u
                worst = max(worst, float((D * D / N).max()))
        assert worst <= max(2.1, M) * (1.0 + 1e-12)
        assert worst >= 0.95 * max(2.0, M)


@pytest.mark.parametrize("seed", range(4))
def test_strain_energy_and_slope_are_integrals_and_derivative_of_the_rigidity(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.cumsum([rng.uniform(0.0, 5.0), *rng.uniform(1.0, 60.0, 5)])
    strains = np.cumsum([0.3, *np.diff(points) / 10.0 ** rng.uniform(3.0, 5.0, 5)])
    law = cdsm.TabulatedElasticity(tuple(points), tuple(strains))
    for k in range(5):
        a, b = points[k], points[k] + 0.7 * (points[k + 1] - points[k])
        for asked, integrand in (
            (law.strain, lambda x: 1.0 / law.rigidity(x)),
            (law.energy, lambda x: x / law.rigidity(x)),
        ):
            expected = quad(integrand, a, b, epsabs=0.0, epsrel=1e-12)[0]
            assert float(asked(b) - asked(a)) == pytest.approx(expected, rel=1e-11)
        step = 1e-4 * (b - a)
        rise = float(law.rigidity(b + step) - law.rigidity(b - step)) / (2.0 * step)
        assert float(law.rigidity_slope(b)) == pytest.approx(rise, rel=1e-5, abs=1e-6)
    below = np.nextafter(points[2], 0.0)
    assert law.rigidity_slope(points[2]) == pytest.approx(float(law.rigidity_slope(below)))


def test_slopes_at_points_follow_a_parabola_through_the_logarithms_of_the_chords() -> None:
    """It levels off at its last end; at its first it would go on faster than a straight line."""

    def log(y: Array) -> Array:
        return 7.0 - 0.5 * y + 0.06 * y**2

    rise = np.array([0.3, 0.2, 0.5, 0.4, 0.3])
    y = np.cumsum([0.0, *rise])
    middle = y[:-1] + rise / 2.0
    slopes = slopes_at_points(np.exp(log(middle)), rise)
    np.testing.assert_allclose(np.log(slopes[1:]), log(y[1:]), rtol=1e-13)
    straight = log(middle[0]) - (log(middle[1]) - log(middle[0])) / 0.25 * 0.15
    assert np.log(slopes[0]) == pytest.approx(straight, rel=1e-13)


def test_two_points_are_a_straight_line() -> None:
    law = cdsm.TabulatedElasticity((10.0, 60.0), (0.1, 0.2))
    F = np.linspace(10.0, 60.0, 7)
    np.testing.assert_allclose(law.rigidity(F), 500.0, rtol=1e-14)
    np.testing.assert_allclose(law.rigidity_slope(F), 0.0, atol=1e-12)
    np.testing.assert_allclose(law.energy(F), (F**2 - 100.0) / 1000.0, rtol=1e-13, atol=1e-15)
