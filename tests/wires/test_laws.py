"""Strain, tension, energy and rigidity of a wire belong together, whatever the law is made from."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.integrate import quad

import cdsm
from cdsm.support.validation import RANGES
from cdsm.support.values import Array
from tests.support.strategies import tabulated_elasticities

STEEL = cdsm.LinearElasticity(226_195.0)
STRAND = cdsm.StrandElasticity.eq19_repaired()
POINTS = np.linspace(5.0, 800.0, 60)
TABLE = cdsm.TabulatedElasticity(tuple(POINTS), tuple(STRAND.strain(POINTS)))


def ramp(F: Array) -> Array:
    return 5e3 + 100.0 * F


LAWS: dict[str, cdsm.Elasticity] = {
    "linear": STEEL,
    "strand": STRAND,
    "two ranges": cdsm.StrandElasticity(
        ((5.0, 1.0, 0.02), (-36.6, 3.0, -0.004)), (40.0,), 1.0, 300.0
    ),
    "table": TABLE,
    "function": cdsm.Elasticity.from_rigidity(ramp, 0.0, 1000.0),
    "scaled": STRAND.scaled(1.25),
    "slack": STRAND.slack_below(),
    "slack table": TABLE.slack_below(),
}
F = np.array([[6.0, 12.0, 28.0, 34.0], [60.0, 150.0, 250.0, 290.0]])


@pytest.mark.parametrize("name", LAWS)
def test_strain_and_energy_are_integrals_of_the_rigidity(name: str) -> None:
    law = LAWS[name]
    slack = ((0.0, 1.0), (1.0, 2.2), (0.0, 11.0)) if law.low < 1.0 else ()
    for a, b in ((6.0, 11.0), (33.0, 80.0), (80.0, 290.0), *slack):
        points = [p for p in (law.rest, *POINTS) if a < p < b]
        for power, of in enumerate((law.strain, law.energy)):

            def slope(f: float, power: int = power) -> float:
                return f**power / float(law.rigidity(f))

            area = quad(slope, a, b, points=points, limit=200)[0]
            near = 1e-8 if (a, b) in slack else 1e-7
            assert float(of(b) - of(a)) == pytest.approx(area, rel=near)


@pytest.mark.parametrize("name", LAWS)
def test_slope_and_secant_follow_from_the_rigidity_and_strain(name: str) -> None:
    """With S = (F − F_0)/ε the tangent is S²/(S − (F − F_0) S')."""
    law, h = LAWS[name], 1e-4
    slope = (law.rigidity(F + h) - law.rigidity(F - h)) / (2.0 * h)
    atol = 1e-6 * float(law.rigidity(F).max())
    np.testing.assert_allclose(law.rigidity_slope(F), slope, rtol=1e-5, atol=atol)
    S, h = law.secant_rigidity(F), 1e-3
    np.testing.assert_allclose(S * law.strain(F), F - law.rest, rtol=1e-12)
    slope = (law.secant_rigidity(F + h) - law.secant_rigidity(F - h)) / (2.0 * h)
    np.testing.assert_allclose(S**2 / (S - (F - law.rest) * slope), law.rigidity(F), rtol=1e-4)
    assert float(law.secant_rigidity(law.rest)) == float(law.rigidity(law.rest))


@pytest.mark.parametrize("name", LAWS)
def test_tension_inverts_strain_and_nothing_beyond_is_reached(name: str) -> None:
    law, most = LAWS[name], RANGES["tension"].high
    tension = np.array([law.low, *F.ravel(), min(law.high, 1e4)])
    np.testing.assert_allclose(law.tension(law.strain(tension)), tension, rtol=1e-12, atol=1e-12)
    assert float(law.strain(law.rest)) == pytest.approx(0.0, abs=1e-18)
    assert float(law.tension(0.0)) == pytest.approx(law.rest, abs=1e-12)
    beyond = float(law.strain(min(law.high, most))) * (1.0 + 1e-9)
    for strain in (float(law.strain(law.low)) - 1e-9, beyond):
        with pytest.raises(
            cdsm.ElasticityRangeError, match=r"^no tension .* strain.* reaches"
        ) as e:
            law.tension([0.0, strain])
        assert e.value.indices == (1,)


def test_tension_outside_the_law_is_an_error_with_data() -> None:
    for method in ("rigidity", "strain", "secant_rigidity", "rigidity_slope", "energy"):
        with pytest.raises(cdsm.ElasticityRangeError, match=r"2\.1 N, 900 N.*2\.2 N, 810 N") as e:
            getattr(STRAND, method)([[50.0, 2.1], [900.0, 31.0]])
        assert (e.value.tension, e.value.indices) == ((2.1, 900.0), (1, 2))
        with pytest.raises(cdsm.InvalidInput, match="tension"):
            getattr(STRAND, method)(math.nan)
        getattr(STRAND, method)([2.2, 810.0])


def test_linear_law_is_exact() -> None:
    tension = np.array([0.0, 1.0, 7.5, 1e5])
    for EA in (226_195.0, 49.0, *RANGES["rigidity"][1:]):
        law = cdsm.LinearElasticity(EA)
        np.testing.assert_array_equal(law.rigidity(tension), EA)
        np.testing.assert_array_equal(law.strain(tension), tension / EA)
        np.testing.assert_allclose(law.energy(tension), tension**2 / (2.0 * EA), rtol=1e-15)
    wire = cdsm.LinearElasticity.of_wire(200e9, 1.2e-3)
    np.testing.assert_allclose(wire.rigidity(5.0), 200e9 * math.pi * 1.2e-3**2 / 4.0, rtol=1e-15)


def test_rigidity_in_a_wrong_unit_is_doubted_once() -> None:
    for EA, doubt in ((48.0, "kN"), (200e9, "E instead of EA")):
        with pytest.warns(cdsm.CdsmWarning, match=doubt) as caught:
            cdsm.LinearElasticity(EA).scaled(1.1).rigidity(5.0)
        assert len(caught) == 1


def test_corner_of_eq19_is_bridged_and_nothing_else_changes() -> None:
    away, near = np.r_[2.2:29.6:500j, 32.4:810.0:500j], np.linspace(29.6, 32.4, 400)  # type: ignore[misc]
    for tension, off in ((away, 1e-8), (near, 7e-3)):
        np.testing.assert_allclose(STRAND.rigidity(tension), STRAND.polynomial(tension), rtol=off)
    slope = STRAND.rigidity_slope(near)
    assert (slope > 0.0).all()
    assert abs(np.diff(slope)).max() < 12.0  # no jump; that of the polynomials is 654


def test_function_is_sampled_to_eight_digits_and_its_corners_are_told() -> None:
    law = LAWS["function"]
    tension = np.linspace(0.0, 1000.0, 777)
    np.testing.assert_allclose(law.rigidity(tension), ramp(tension), rtol=1e-8)
    np.testing.assert_allclose(law.strain(tension), np.log1p(tension / 50.0) / 100.0, rtol=1e-10)
    constant = cdsm.Elasticity.from_rigidity(lambda _: 48e3, 0.0, 500.0)
    np.testing.assert_allclose(constant.rigidity(tension[:300]), 48e3, rtol=1e-12)

    def corner(F: Array) -> Array:
        return np.where(F < 100.0, 1e3 + 100.0 * F, 11e3)

    with pytest.raises(cdsm.InvalidInput, match="joins="):
        cdsm.Elasticity.from_rigidity(corner, 0.0, 500.0)
    law = cdsm.Elasticity.from_rigidity(corner, 0.0, 500.0, joins=(100.0,))
    np.testing.assert_allclose(law.rigidity(tension[:380]), corner(tension[:380]), rtol=1e-2)


def test_scaled_law_is_as_many_times_as_rigid_and_stretches_as_many_times_less() -> None:
    for law in LAWS.values():
        stiffer = law.scaled(1.25)
        for ask, factor in (("rigidity", 1.25), ("strain", 0.8), ("energy", 0.8)):
            expected = factor * getattr(law, ask)(F)
            np.testing.assert_allclose(getattr(stiffer, ask)(F), expected, rtol=1e-14)
        assert (stiffer.low, stiffer.high, stiffer.rest) == (law.low, law.high, law.rest)


def own(rigidity: Callable[[Array], Any]) -> cdsm.Elasticity:
    return cdsm.Elasticity.from_rigidity(rigidity, 0.0, 500.0)


def strand(*coefficients: tuple[float, ...], joins: Any = (), low: float = 0.0) -> object:
    return cdsm.StrandElasticity(coefficients, joins, low, 100.0)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        *[(lambda EA=EA: cdsm.LinearElasticity(EA), "rigidity") for EA in (0, -1.0, math.nan, "5")],
        (lambda: cdsm.LinearElasticity.of_wire(200e9, 0.0), "diameter"),
        (lambda: cdsm.LinearElasticity.of_wire(-1.0, 1e-3), "young_modulus"),
        (strand, "coefficients"),
        (lambda: strand(()), "coefficients"),
        (lambda: strand((math.nan,)), "coefficients"),
        (lambda: strand((1.0,), joins=(0.5,)), "joins"),
        (lambda: strand((1.0,), (1.0,), joins=(200.0,)), "rise"),
        (lambda: strand((10.0,), (20.0,), joins=(5.0,)), "not meet at 5 N: 10 N below, 20 N ab"),
        (lambda: strand((-20.0, 1.0), low=2.2), "Narrow the domain"),
        (lambda: strand((1.0,), low=100.0), "rise"),
        (lambda: strand((1.0,), low=-1.0), "0 <= low"),
        (lambda: own(lambda F: F * math.nan), "is nan N at"),
        (lambda: own(lambda F: 1e3 - 10.0 * F), "Narrow the domain"),
        (lambda: own(lambda _: np.ones(3)), "fails at .*array"),
        (lambda: own(lambda _: "stiff"), "fails at"),
        (lambda: own(lambda F: np.where(F < 50.0, 1e4, 1.1e4)), "jumps"),
        *[
            (lambda F=F, e=e: cdsm.TabulatedElasticity(F, e), "tensions|strains")
            for F, e in (
                ((1.0,), (0.0,)),
                ((1.0, 1.0), (0.0, 1.0)),
                ((1.0, 2.0), (1.0, 0.0)),
                ((1.0, 2.0), (0.0, 1.0, 2.0)),
                ((0.0, 5e-324, 100.0), (0.0, 0.002, 0.005)),  # a slope beyond float64
            )
        ],
        (lambda: STRAND.scaled(0.0), "factor"),
    ],
)
def test_bad_constructor_input_names_the_argument(make: Callable[[], object], said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        make()


EXACT: dict[str, tuple[Callable[[Array], Array], Callable[[Array], Array]]] = {
    "Eq. 19": (STRAND.strain, STRAND.rigidity),
    "power 0.3": (lambda F: 1e-3 * F**0.3, lambda F: 1e3 * F**0.7 / 0.3),
    "exponential": (lambda F: 5e-3 * np.log1p(F / 20.0), lambda F: (F + 20.0) / 5e-3),
    "toe": (
        lambda F: 2e-3 * (1.0 - np.exp(-F / 30.0)) + F / 5e4,
        lambda F: 1.0 / (2e-3 / 30.0 * np.exp(-F / 30.0) + 2e-5),
    ),
}
"""Strain and rigidity of wires that stiffen."""


@pytest.mark.parametrize("wire", EXACT)
def test_exact_points_give_the_rigidity(wire: str) -> None:
    strain, rigidity = EXACT[wire]
    points = np.geomspace(5.0, 800.0, 30)
    law = cdsm.TabulatedElasticity(tuple(points), tuple(strain(points)))
    np.testing.assert_allclose(law.strain(points), strain(points) - strain(points[0]), rtol=1e-12)
    tension = np.linspace(10.0, 800.0, 500)
    error = abs(law.rigidity(tension) / rigidity(tension) - 1.0)
    assert error.max() < 0.05
    assert np.median(error) < 3e-3


@settings(deadline=None)
@given(tabulated_elasticities())
def test_curve_meets_its_points_and_rises(law: cdsm.TabulatedElasticity) -> None:
    points, strains = np.array(law.tensions), np.array(law.strains)
    np.testing.assert_allclose(law.strain(points), strains - strains[0], rtol=1e-12, atol=1e-18)
    for low, high in pairwise(points):
        tension = np.linspace(low, high, 60)
        assert (law.rigidity(tension) > 0.0).all()
        assert (np.diff(law.strain(tension)) >= 0.0).all()
    above = np.nextafter(points[1:-1], np.inf)
    np.testing.assert_allclose(law.rigidity(above), law.rigidity(points[1:-1]), rtol=1e-6)
