"""Integrals over piecewise polynomials: exact to rounding, whatever their roots, and pickled."""

import dataclasses
import pickle
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

import cdsm
from cdsm.support.values import Array

STRAND = cdsm.StrandElasticity.eq19_repaired()
lower, upper = STRAND.coefficients
# the lower branch of Eq. 19 with its misprint
PRINTED = cdsm.StrandElasticity(((*lower[:-1], -1e-3),), (), 2.2, 31.0)


def one(*row: float, low: float = 0.0, high: float = 100.0) -> cdsm.StrandElasticity:
    return cdsm.StrandElasticity((row,), (), low, high)


def samples(law: cdsm.StrandElasticity) -> Array:
    """Tensions over the whole domain, most of them near its low end."""
    return law.low + (law.high - law.low) * np.geomspace(1e-12, 1.0, 61)


def test_strain_and_energy_have_the_digits_of_closed_forms() -> None:
    # ∫ dF/(a + bF) = log(1 + bF/a)/b, ∫ F dF/(a + bF) = F/b − a/b² log(1 + bF/a)
    for a, b in ((100.0, 2.0), (1e-3, 5.0), (1e5, 1e-3)):
        law = one(a, b)
        F = samples(law)
        np.testing.assert_allclose(law.strain(F), np.log1p(b * F / a) / b, rtol=3e-15)
        x = b * F / a
        large = x > 0.5  # below, the closed form cancels
        energy = (x - np.log1p(x)) * a / b**2
        np.testing.assert_allclose(law.energy(F)[large], energy[large], rtol=2e-14)
        small = x < 1e-4
        series = a / b**2 * (x**2 / 2 - x**3 / 3 + x**4 / 4)
        np.testing.assert_allclose(law.energy(F)[small], series[small], rtol=1e-11)


def test_roots_on_both_sides_of_the_real_axis_are_no_trouble() -> None:
    # EA = (F − 50)² + d²: poles at 50 ± i d, as near as one likes
    for d in (30.0, 1.0, 1e-2, 1e-4):
        law = one(2500.0 + d**2, -100.0, 1.0)
        F = samples(law)
        expected = (np.arctan((F - 50.0) / d) + np.arctan(50.0 / d)) / d
        # the polynomial itself loses 1e-16·5000/d² of its value at its lowest
        np.testing.assert_allclose(
            law.strain(F), expected, rtol=1e-13 + 1e-12 / d**2, atol=1e-15 / d
        )


@pytest.mark.parametrize("power", [0, 1])
def test_eq19_integrates_to_thirteen_digits(power: int) -> None:
    F = np.array([2.25, 5.0, 30.0, 31.0, 31.5, 100.0, 500.0, 810.0])
    method = (STRAND.strain, STRAND.energy)[power]
    edges = [2.2, 2.3, 2.6, 4.0, 10.0, 31.0, 60.0, 200.0, 810.0]
    for value in F:
        total = 0.0
        for low, high in pairwise(edges):
            row = STRAND.coefficients[0 if high <= 31.0 else 1]
            if value > low:
                total += quad(
                    lambda f, row=row: f**power / np.polyval(row[::-1], f),
                    low,
                    min(value, high),
                    epsabs=0.0,
                    epsrel=2e-14,
                )[0]
        assert float(method(value)) == pytest.approx(total, rel=1e-13)


def test_parts_add_up_and_shapes_are_kept() -> None:
    F = samples(STRAND).reshape(61, 1, 1)
    assert STRAND.strain(F).shape == F.shape
    assert STRAND.energy(np.zeros((0, 3)) + 5.0).shape == (0, 3)
    together = STRAND.strain(F).ravel()
    alone = [float(STRAND.strain(float(value))) for value in F.ravel()]
    np.testing.assert_allclose(together, alone, rtol=1e-14)
    assert (np.diff(together) > 0.0).all()


def test_strain_is_a_number_up_to_the_very_last_tension_that_has_one() -> None:
    # Eq. 19 with a coefficient written twice, as found by spoiling files: it is zero near 8.4 N
    row = (-556.89, 377.99, -70.49, 8.74, 1.12e-2, -0.46, 1.12e-2, -1e-4)
    rng = np.random.default_rng(0)
    laws = [one(*row, low=2.2, high=31.0)]
    for _ in range(200):  # a zero anywhere, of any slope
        zero, a, b = rng.uniform(5.0, 50.0), 10.0 ** rng.uniform(-6, 6), rng.uniform(0.0, 1.0)
        laws.append(one(a * zero, a * (b * zero - 1.0), -a * b))
    for law in laws:
        end = law.panels.end
        F = end * (1.0 - np.geomspace(1e-15, 1e-2, 80)[::-1])
        for values in (law.strain(F), law.energy(F), law.strain([end])):
            assert np.isfinite(values).all()
            assert np.diff(values).min(initial=0.0) >= 0.0
        with pytest.raises(cdsm.ElasticityRangeError, match="not positive everywhere"):
            law.strain(end * (1.0 + 1e-13))


@pytest.mark.parametrize(
    ("law", "end"),
    [
        (one(10.0, -1.0), 10.0),  # a root
        (one(2500.0, -100.0, 1.0), 50.0),  # two in one
        (one(0.0, 1.0), 0.0),  # at the low end
        (PRINTED, 11.003354655),
    ],
)
def test_there_is_no_strain_from_the_first_zero_on(law: cdsm.StrandElasticity, end: float) -> None:
    after = np.nextafter(end, 1e3) if end == 0.0 else end
    for method in (law.strain, law.energy):
        with pytest.raises(cdsm.ElasticityRangeError, match="correct the coefficients") as caught:
            method([after, law.high])
        assert caught.value.indices == (0, 1)
    if end > 0.0:
        # two roots in one are uncertain by the root of rounding
        values = law.strain(np.linspace(0.9 * end, end * (1.0 - 1e-6), 20))
        assert np.isfinite(values).all()
        assert (np.diff(values) > 0.0).all()


def test_range_after_a_join_starts_afresh() -> None:
    law = cdsm.StrandElasticity(((10.0,), (5.0, 1.0)), (5.0,), 0.0, 9.0)
    np.testing.assert_allclose(law.strain([5.0, 9.0]), [0.5, 0.5 + np.log(14.0 / 10.0)], rtol=1e-15)


def test_law_that_has_been_used_is_the_same_law() -> None:
    used, fresh = cdsm.StrandElasticity.eq19_repaired(), cdsm.StrandElasticity.eq19_repaired()
    strain = used.strain(50.0)
    again = pickle.loads(pickle.dumps(used))
    assert used == fresh == again == dataclasses.replace(used)
    assert hash(used) == hash(fresh) == hash(again)
    assert repr(used) == repr(fresh)
    assert again.strain(50.0) == fresh.strain(50.0) == strain
    assert dataclasses.replace(used, high=700.0).domain.high == 700.0


def test_tension_inverts_strain_to_rounding() -> None:
    F = samples(STRAND)[1:]
    for law in (STRAND, one(100.0, 2.0)):
        values = F[law.high >= F]
        back = law.tension(law.strain(values))
        # rounding of the strain is worth 1e-16 of it times EA, at most 1e-12 N
        np.testing.assert_allclose(back, values, rtol=1e-13, atol=2e-12)
