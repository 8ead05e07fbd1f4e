"""Elasticity laws: tangent, secant and strain belong together, and the domain is kept."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.integrate import quad

import cdsm
from cdsm.elasticity import Domain, tension_at
from cdsm.support.validation import RANGES
from cdsm.support.values import Array

STEEL = cdsm.LinearElasticity(226_195.0)
STRAND = cdsm.StrandElasticity.eq19_repaired()
RAMP = cdsm.StrandElasticity(((100.0, 2.0),), (), 0.0, 500.0)
BUMP = cdsm.StrandElasticity(((5.0, 1.0, 0.02), (-36.6, 3.0, -0.004)), (40.0,), 1.0, 300.0)

# polynomials whose partial fractions are special: no root, a root twice, nearly twice, padded
CONSTANT = cdsm.StrandElasticity(((5000.0,),), (), 0.0, 100.0)
PADDED = cdsm.StrandElasticity(((5000.0, 20.0, 0.0, 0.0),), (), 0.0, 100.0)
PADDED_CONSTANT = cdsm.StrandElasticity(((5000.0, 0.0, 0.0),), (), 0.0, 100.0)
SQUARE = cdsm.StrandElasticity(((4.0, 4.0, 1.0),), (), 1.0, 100.0)
NO_CONSTANT = cdsm.StrandElasticity(((0.0, 0.0, 1.0),), (), 1.0, 100.0)
CUBE = cdsm.StrandElasticity(((1.0, 3.0, 3.0, 1.0),), (), 1.0, 100.0)

STRANDS: dict[str, cdsm.StrandElasticity] = {
    "Eq. 19 repaired": STRAND,
    "ramp": RAMP,
    "two ranges": BUMP,
}
SPECIAL: dict[str, cdsm.StrandElasticity] = {
    "constant": CONSTANT,
    "padded with zeros": PADDED,
    "constant, padded with zeros": PADDED_CONSTANT,
    "square": SQUARE,
    "square without a constant": NO_CONSTANT,
    "cube": CUBE,
}
LAWS: dict[str, cdsm.Elasticity] = {"linear": STEEL, **STRANDS}


def samples(law: cdsm.Elasticity, count: int = 9) -> Any:
    """Tensions inside the domain, away from its ends and joins."""
    low, high = law.domain
    inside = np.linspace(low, min(high, 1000.0), count + 2)[1:-1]
    joins = getattr(law, "joins", ())
    return np.array([F for F in inside if all(abs(F - join) > 1.0 for join in joins)])


SCALABLE: dict[str, cdsm.Elasticity] = {
    **LAWS,
    "table": cdsm.TabulatedElasticity((1.0, 10.0, 40.0, 90.0), (0.0, 4e-3, 8e-3, 1.2e-2)),
    "slack below": STRAND.slack_below(),
}


# --- all laws -------------------------------------------------------------------------------


METHODS = ("rigidity", "strain", "secant_rigidity")


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("shape", [(), (1,), (6,), (2, 3), (1, 2, 1, 3), (0,), (2, 0)])
def test_shape_is_kept(name: str, shape: tuple[int, ...]) -> None:
    law = LAWS[name]
    low, high = law.domain
    tension = np.full(shape, low + 0.3 * (min(high, 1000.0) - low))
    for method in METHODS:
        result = getattr(law, method)(tension)
        assert result.shape == shape
        assert result.dtype == np.float64


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("method", METHODS)
def test_scalars_give_what_arrays_give(name: str, method: str) -> None:
    law = LAWS[name]
    F = samples(law)
    together = getattr(law, method)(F)
    for value, expected in zip(F, together, strict=True):
        assert float(getattr(law, method)(float(value))) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("name", LAWS)
def test_tangent_is_the_derivative_of_tension_by_strain(name: str) -> None:
    law = LAWS[name]
    F = samples(law)

    def error(h: float) -> float:
        slope = 2.0 * h / (law.strain(F + h) - law.strain(F - h))
        return float(abs(slope / law.rigidity(F) - 1.0).max())

    assert error(1e-3) < 1e-5
    if name != "linear":
        # second order: an error a hundred times smaller for a step ten times smaller
        assert math.log10(error(0.2) / error(0.02)) == pytest.approx(2.0, abs=0.1)


def integrated(law: cdsm.StrandElasticity, F: float) -> float:
    """∫ dF/EA(F) from the low end by quadrature, range by range."""
    edges = (law.low, *law.joins, law.high)
    total = 0.0
    for row, (start, end) in zip(law.coefficients, pairwise(edges), strict=True):
        if start <= F:
            total += quad(
                lambda f, row=row: 1.0 / np.polyval(row[::-1], f),
                start,
                min(F, end),
                epsabs=0.0,
                epsrel=1e-13,
                limit=500,
            )[0]
    return total


@pytest.mark.parametrize("name", [*STRANDS, *SPECIAL])
def test_strain_is_the_integral_of_one_over_the_tangent_whatever_its_roots(name: str) -> None:
    law = {**STRANDS, **SPECIAL}[name]
    for F in (*samples(law, 6), law.high):
        assert float(law.strain(F)) == pytest.approx(integrated(law, F), rel=1e-12)


@pytest.mark.parametrize("name", LAWS)
def test_strain_rises_from_zero_at_the_low_end(name: str) -> None:
    law = LAWS[name]
    low, _ = law.domain
    assert float(law.strain(np.nextafter(low, np.inf))) == pytest.approx(0.0, abs=1e-12)
    assert (np.diff(law.strain(samples(law))) > 0.0).all()


@pytest.mark.parametrize("name", LAWS)
def test_secant_is_tension_over_strain_both_from_the_low_end(name: str) -> None:
    law = LAWS[name]
    F = samples(law)
    np.testing.assert_allclose(
        law.secant_rigidity(F) * law.strain(F), F - law.domain.low, rtol=1e-12
    )


@pytest.mark.parametrize("name", LAWS)
def test_tangent_follows_from_the_secant(name: str) -> None:
    """With S = (F − low)/ε the tangent is S²/(S − (F − low) S')."""
    law = LAWS[name]
    F = samples(law)
    h = 1e-3
    S = law.secant_rigidity(F)
    slope = (law.secant_rigidity(F + h) - law.secant_rigidity(F - h)) / (2.0 * h)
    np.testing.assert_allclose(S**2 / (S - (F - law.domain.low) * slope), law.rigidity(F), 1e-4)


@pytest.mark.parametrize("name", LAWS)
def test_secant_tends_to_the_tangent_at_the_low_end(name: str) -> None:
    law = LAWS[name]
    F = law.domain.low + 1e-6
    assert float(law.secant_rigidity(F)) == pytest.approx(float(law.rigidity(F)), rel=1e-4)


@pytest.mark.parametrize("name", LAWS)
def test_tension_inverts_strain_both_ends_included(name: str) -> None:
    law = LAWS[name]
    low, high = law.domain.first, min(law.domain.high, 1e4)
    F = np.array([low, *samples(law), high])
    # rounding of the strain, which is of that of the largest one, over its slope
    np.testing.assert_allclose(law.tension(law.strain(F)), F, rtol=1e-11, atol=1e-11)
    assert float(law.tension(0.0)) == pytest.approx(low, rel=1e-12, abs=1e-300)
    assert float(law.tension(law.strain(high))) == pytest.approx(high, rel=1e-12)


@pytest.mark.parametrize(("low", "high"), [(2.3, 11.4), (2.2, 11.4)], ids=["over", "under"])
def test_end_is_found_though_low_and_the_width_do_not_sum_to_it(low: float, high: float) -> None:
    assert low + (high - low) != high
    law = cdsm.StrandElasticity(((5e3,),), (), low, high)
    for F in (7.0, high):
        assert float(law.tension(law.strain(F))) == pytest.approx(F, rel=1e-12)


@pytest.mark.parametrize("name", LAWS)
def test_strain_out_of_reach_is_refused_with_the_reach(name: str) -> None:
    law = LAWS[name]
    largest = float(law.strain(min(law.domain.high, RANGES["tension"].high)))
    beyond = largest * (1.0 + 1e-9)
    for strain, said in ((-1e-9, "it reaches"), (beyond, f"it reaches {largest:.6g}.")):
        with pytest.raises(cdsm.ElasticityRangeError) as caught:
            law.tension([0.0, strain])
        assert str(caught.value).startswith("no tension of the domain")
        assert f"gives the strain {strain:.6g}; {said}" in str(caught.value)
        assert caught.value.indices == (1,)
        assert caught.value.tension == ()
    with pytest.raises(cdsm.ElasticityRangeError, match="strain -1;") as caught:  # the first of two
        law.tension([0.0, -1.0, 0.0, -2.0])
    assert caught.value.indices == (1, 3)


@pytest.mark.parametrize("name", LAWS)
def test_tension_at_a_strain_takes_a_handful_of_steps(name: str) -> None:
    """Newton's method doubles the digits each time; bisection alone would take fifty."""
    law, asked = LAWS[name], []

    def stretch(F: Array) -> Array:
        asked.append(F.size)
        return law.strain(F)

    F = samples(law)
    found = tension_at(
        law.strain(F), law.domain, stretch, lambda F: 1.0 / law.rigidity(F), "strain"
    )
    np.testing.assert_allclose(found, F, rtol=1e-11, atol=1e-11)
    # as many more as an unbounded domain is looked at, and the grid
    doublings = math.log2(F.max()) + 1.0 if math.isinf(law.domain.high) else 0.0
    assert len(asked) <= 8 + doublings


class Upright(cdsm.Elasticity):
    """Hardly any rigidity at one tension: ε = (√c ± √|F − c|)/EA, with an upright tangent at c."""

    def __init__(self, place: float) -> None:
        self.place = place

    @property
    def domain(self) -> Domain:
        return Domain(0.0, 100.0)

    def rigidity(self, tension: ArrayLike) -> Array:
        F = self.domain.check(tension)
        return np.asarray(2e3 * np.maximum(np.sqrt(abs(F - self.place)), 1e-9))

    def strain(self, tension: ArrayLike) -> Array:
        away = self.domain.check(tension) - self.place
        root = math.sqrt(self.place) + np.sign(away) * np.sqrt(abs(away))
        return np.asarray(root / 1e3)

    def energy(self, tension: ArrayLike) -> Array:
        raise NotImplementedError


@pytest.mark.parametrize("place", [3.0, 17.3, 50.0, 88.8])
def test_tension_is_found_where_newtons_method_goes_round_in_circles(place: float) -> None:
    """Of √|F − c| Newton's step from c + d is to c − d, and back, for any d."""
    law = Upright(place)
    F = np.array([0.5 * place, place, 0.5 * (place + 100.0)])
    np.testing.assert_allclose(law.tension(law.strain(F)), F, rtol=1e-9)


@pytest.mark.parametrize("name", ["linear", "Eq. 19 repaired"])
@pytest.mark.parametrize(
    "bad",
    [math.nan, math.inf, -math.inf, "50", None, 1j, True, [[1.0], [1.0, 2.0]], np.ma.zeros(2)],
    ids=repr,
)
def test_what_is_no_tension_is_invalid_input(name: str, bad: Any) -> None:
    for method in METHODS:
        with pytest.raises(cdsm.InvalidInput, match="tension"):
            getattr(LAWS[name], method)(bad)
    with pytest.raises(cdsm.InvalidInput, match="tension"):
        STRAND.polynomial(bad)


# --- domain ---------------------------------------------------------------------------------


def test_linear_domain_starts_at_zero_included() -> None:
    assert 0.0 in STEEL.domain
    assert -1e-300 not in STEEL.domain
    assert str(STEEL.domain) == "[0 N, inf N)"
    assert float(STEEL.rigidity(0.0)) == float(STEEL.secant_rigidity(0.0)) == 226_195.0
    assert float(STEEL.strain(0.0)) == 0.0


def test_strand_domain_is_half_open() -> None:
    assert tuple(STRAND.domain) == (2.2, 810.0)
    assert 2.2 not in STRAND.domain
    assert np.nextafter(2.2, 3.0) in STRAND.domain
    assert 810.0 in STRAND.domain
    assert np.nextafter(810.0, 811.0) not in STRAND.domain
    assert str(STRAND.domain) == "(2.2 N, 810 N]"
    STRAND.rigidity([np.nextafter(2.2, 3.0), 810.0])


@pytest.mark.parametrize("method", METHODS)
def test_tension_outside_the_domain_is_an_error_with_data(method: str) -> None:
    with pytest.raises(cdsm.ElasticityRangeError) as caught:
        getattr(STRAND, method)([[50.0, 2.2], [900.0, 31.0]])
    assert caught.value.tension == (2.2, 900.0)
    assert caught.value.indices == (1, 2)
    assert caught.value.cables == ()
    for part in ("2.2 N, 900 N", "(2.2 N, 810 N]", "minimum="):
        assert part in str(caught.value)


@pytest.mark.parametrize("method", METHODS)
def test_linear_law_refuses_negative_tension(method: str) -> None:
    with pytest.raises(cdsm.ElasticityRangeError) as caught:
        getattr(STEEL, method)(-1.0)
    assert caught.value.tension == (-1.0,)
    assert "[0 N, inf N)" in str(caught.value)


def test_long_list_of_offenders_is_cut_in_the_message_not_in_the_data() -> None:
    with pytest.raises(cdsm.ElasticityRangeError, match=r"N, and \d+ more") as caught:
        STRAND.rigidity(np.full(1000, 900.0))
    assert len(caught.value.tension) == 1000
    assert len(str(caught.value)) < 400


def test_rigidity_that_is_not_positive_is_refused_with_the_remedy() -> None:
    law = cdsm.StrandElasticity(((10.0, -1.0), (-20.0, 1.0)), (15.0,), 2.2, 100.0)
    with pytest.raises(cdsm.ElasticityRangeError, match="correct the coefficients") as caught:
        law.rigidity([5.0, 20.0, 15.0, 50.0])
    assert caught.value.tension == (20.0, 15.0)
    assert caught.value.indices == (1, 2)
    with pytest.raises(cdsm.ElasticityRangeError, match="correct the coefficients") as caught:
        law.strain([5.0, 12.0])
    assert caught.value.tension == (12.0,)
    assert float(law.strain(5.0)) > 0.0


def test_domain_checks_and_iterates() -> None:
    domain = Domain(1.0, 5.0, low_included=False)
    assert tuple(domain) == (1.0, 5.0)
    assert domain.check([2, 5]).tolist() == [2.0, 5.0]
    with pytest.raises(cdsm.ElasticityRangeError):
        domain.check(1.0)


def test_domain_is_of_more_than_one_tension() -> None:
    with pytest.raises(cdsm.InvalidInput, match="low < high"):
        Domain(5.0, 5.0)


# --- constructors ---------------------------------------------------------------------------


def test_smallest_and_largest_rigidity_are_allowed() -> None:
    _, low, high = RANGES["rigidity"]
    for rigidity in (low, high):
        assert float(cdsm.LinearElasticity(rigidity).rigidity(1.0)) == rigidity
    for beyond in (math.nextafter(low, 0.0), math.nextafter(high, math.inf)):
        with pytest.raises(cdsm.InvalidInput, match=r"rigidity: .* 1e-06 to 1e\+12 N is needed"):
            cdsm.LinearElasticity(beyond)


@pytest.mark.parametrize("diameter", [1e-4, 1.2e-3, 0.05])
def test_wire_rigidity_is_young_times_area(diameter: float) -> None:
    wire = cdsm.LinearElasticity.of_wire(200e9, diameter)
    expected = 200e9 * math.pi * diameter**2 / 4.0
    np.testing.assert_allclose(wire.rigidity([0.0, 1.0, 1e6]), expected, rtol=1e-15)


def test_linear_strain_is_tension_over_rigidity() -> None:
    F = np.array([0.0, 1.0, 7.5, 1e5])
    np.testing.assert_array_equal(STEEL.strain(F), F / 226_195.0)
    np.testing.assert_allclose(STEEL.secant_rigidity(F), 226_195.0, rtol=1e-15)


def test_equal_laws_are_equal_and_hash_alike() -> None:
    assert cdsm.LinearElasticity(5) == cdsm.LinearElasticity(5.0)
    assert len({STRAND, cdsm.StrandElasticity.eq19_repaired(), RAMP}) == 2
    assert repr(cdsm.LinearElasticity(5.0)) == "LinearElasticity(rigidity=5.0)"
    assert eval(repr(STRAND), {"StrandElasticity": cdsm.StrandElasticity}) == STRAND


def test_polynomial_is_unchecked_beyond_the_domain() -> None:
    values = STRAND.polynomial([[0.0, 31.0], [2000.0, -5.0]])
    assert values.shape == (2, 2)
    assert values[0, 0] == -556.89
    assert float(STRAND.polynomial(100.0)) == float(STRAND.rigidity(100.0))


BAD: dict[str, tuple[Callable[[], object], str]] = {
    **{
        f"rigidity {value!r:.20}": (lambda value=value: cdsm.LinearElasticity(value), "rigidity")  # type: ignore[misc]
        for value in (0, -1.0, math.nan, math.inf, "5", None, [5.0], 1j, True, np.ma.masked)
    },
    **{
        f"diameter {value!r}": (
            lambda value=value: cdsm.LinearElasticity.of_wire(200e9, value),  # type: ignore[misc]
            "diameter",
        )
        for value in (0.0, -1.0, math.nan, math.inf, "5", None, [5.0])
    },
    "young": (lambda: cdsm.LinearElasticity.of_wire(-1.0, 1e-3), "young_modulus"),
    "area underflows": (lambda: cdsm.LinearElasticity.of_wire(1.0, 1e-200), "rigidity"),
    "area overflows": (lambda: cdsm.LinearElasticity.of_wire(1.0, 1e200), "rigidity|diameter"),
    "no range": (lambda: cdsm.StrandElasticity((), (), 0.0, 1.0), "coefficients"),
    "empty range": (lambda: cdsm.StrandElasticity(((),), (), 0.0, 1.0), "coefficients"),
    "nan": (lambda: cdsm.StrandElasticity(((math.nan,),), (), 0.0, 1.0), "coefficients"),
    "text": (lambda: cdsm.StrandElasticity((("a",),), (), 0.0, 1.0), "coefficients"),  # type: ignore[arg-type]
    "number": (lambda: cdsm.StrandElasticity(3, (), 0.0, 1.0), "coefficients"),  # type: ignore[arg-type]
    "flat": (lambda: cdsm.StrandElasticity((1.0, 2.0), (), 0.0, 1.0), "coefficients"),  # type: ignore[arg-type]
    "joins": (lambda: cdsm.StrandElasticity(((1.0,),), (0.5,), 0.0, 1.0), "joins"),
    "no joins": (lambda: cdsm.StrandElasticity(((1.0,), (1.0,)), (), 0.0, 1.0), "joins"),
    "joins a number": (
        lambda: cdsm.StrandElasticity(((1.0,), (1.0,)), 0.5, 0.0, 1.0),  # type: ignore[arg-type]
        "joins",
    ),
    "joins None": (lambda: cdsm.StrandElasticity(((1.0,),), None, 0.0, 1.0), "joins"),  # type: ignore[arg-type]
    "join outside": (lambda: cdsm.StrandElasticity(((1.0,), (1.0,)), (2.0,), 0.0, 1.0), "rise"),
    "ranges apart": (
        lambda: cdsm.StrandElasticity(((10.0,), (20.0,)), (5.0,), 0.0, 9.0),
        "do not meet at 5 N: 10 N below, 20 N above",
    ),
    "empty domain": (lambda: cdsm.StrandElasticity(((1.0,),), (), 1.0, 1.0), "rise"),
    "negative low": (lambda: cdsm.StrandElasticity(((1.0,),), (), -1.0, 1.0), "0 <= low"),
    "low text": (lambda: cdsm.StrandElasticity(((1.0,),), (), "a", 1.0), "low"),  # type: ignore[arg-type]
    "high inf": (lambda: cdsm.StrandElasticity(((1.0,),), (), 0.0, math.inf), "high"),
    "high nan": (lambda: cdsm.StrandElasticity(((1.0,),), (), 0.0, math.nan), "high"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_constructor_input_names_the_argument(case: str) -> None:
    make, said = BAD[case]
    with pytest.raises(cdsm.InvalidInput, match=said):
        make()


def test_a_coefficient_too_small_to_matter_does_not() -> None:
    whole = cdsm.StrandElasticity(((3e5, 700.0),), (), 0.0, 20.0)
    more = cdsm.StrandElasticity(((3e5, 700.0, 2.2250738585072014e-308),), (), 0.0, 20.0)
    F = np.linspace(1.0, 20.0, 5)
    np.testing.assert_array_equal(more.strain(F), whole.strain(F))


# --- scaled ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SCALABLE)
def test_scaled_law_is_as_many_times_as_rigid_and_stretches_as_many_times_less(name: str) -> None:
    law = SCALABLE[name]
    stiffer, F = law.scaled(1.25), np.linspace(law.domain.first, min(law.domain.high, 500.0), 40)
    assert type(stiffer) is type(law)
    assert stiffer.domain == law.domain
    np.testing.assert_allclose(stiffer.rigidity(F), 1.25 * law.rigidity(F), rtol=1e-12)
    np.testing.assert_allclose(stiffer.strain(F), law.strain(F) / 1.25, rtol=1e-10, atol=1e-16)
    np.testing.assert_allclose(stiffer.energy(F), law.energy(F) / 1.25, rtol=1e-10, atol=1e-14)
    any_law = cdsm.Elasticity.scaled(law, 1.25)  # of a user-defined law
    np.testing.assert_allclose(any_law.rigidity(F), stiffer.rigidity(F), rtol=1e-12)
    np.testing.assert_allclose(any_law.strain(F), stiffer.strain(F), rtol=1e-10, atol=1e-16)


@pytest.mark.parametrize("factor", [0.0, -1.0, math.inf, math.nan, "x"])
def test_factor_that_is_not_positive_is_refused(factor: Any) -> None:
    for law in SCALABLE.values():
        with pytest.raises(cdsm.InvalidInput, match="factor"):
            law.scaled(factor)
