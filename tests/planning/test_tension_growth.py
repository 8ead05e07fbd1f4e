"""Where more tension stops paying, against differences of the stiffness itself."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.optimize import brentq

import cdsm
from cdsm import presets
from cdsm.support.values import Array
from tests.planning.test_range import stayed
from tests.support import arms
from tests.support.differences import assert_second_order
from tests.support.locked import (
    BUCKLING,
    EA,
    LEAD,
    LENGTH,
    STRAND,
    H,
    R,
    hinge,
    soft_hinge,
    some_arm,
)
from tests.support.paths import DOWN

SPRING = 2e3


def springy() -> cdsm.Posture:
    """A straight hinge of two strands behind soft springs, which buckles at some 350 N."""
    geometry = hinge().geometry
    cables = cdsm.serpentine_cables(geometry, STRAND, series_stiffness=SPRING)
    return cdsm.Manipulator(geometry, cables=cables, gravity=(0.0, 0.0, 0.0)).at([0.0])


def closed(F: float) -> tuple[float, float]:
    """Its along(z), (2 k R² − F h)/lever², and the slope of that, by hand.

    1/k = l_0/EA + 1/k_series with l_0 = (2h − x)/(1 + ε), the spring being x = (F − F_low)/k_series
    longer than at rest; d l_0/dF = −1/(k_series (1 + ε)) − l_0/((1 + ε) EA).
    """
    EA, rate = float(STRAND.rigidity(F)), float(STRAND.rigidity_slope(F))
    stretched = 1.0 + float(STRAND.strain(F))
    free = (2.0 * H - (F - STRAND.low) / SPRING) / stretched
    shorter = (1.0 / SPRING + free / EA) / stretched
    k = 1.0 / (free / EA + 1.0 / SPRING)
    slope = k**2 * (free / EA**2 * rate + shorter / EA)
    return (2.0 * k * R**2 - F * H) / LENGTH**2, (2.0 * slope * R**2 - H) / LENGTH**2


def along(pose: cdsm.Posture, wrench: ArrayLike = (0.0,) * 6) -> Callable[[Array], Array]:
    """The stiffness under the least tensions as a function of their lower bound (1,)."""

    def value(lower: Array) -> Array:
        pull = cdsm.distribute_tension(pose, float(lower[0]), wrench=wrench)
        return np.array(cdsm.stiffness(pose, pull).along(DOWN))

    return value


# --- the slope ------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", ["prototype", "universal-3-8-all", "hinged-4-0-all"])
@pytest.mark.parametrize("moment", [False, True])
def test_slope_of_the_curve_is_the_derivative(name: str, moment: bool) -> None:
    """Cables at the bound rise with it, and the others balance them."""
    arm = presets.virtual_prototype() if name == "prototype" else some_arm(name)
    pose = arms.random_posture(arm, 11, reach=0.25)
    W = arms.random_wrench(4, moment)
    found = cdsm.saturation(pose, DOWN, 5.0, wrench=W)
    tried = 0
    for place, value, slope in found.curve[8:-8:12]:
        ends = [cdsm.distribute_tension(pose, b, wrench=W) for b in (place - 0.25, place + 0.25)]
        jumps = any(
            min(F, G) <= 31.0 <= max(F, G) for F, G in zip(*(e.values for e in ends), strict=True)
        )
        if ends[0].at_minimum != ends[1].at_minimum or jumps or place < 5.5:
            continue
        f = along(pose, W)
        assert f(np.array([place])) == pytest.approx(value, rel=1e-12)
        # the tables of the elasticities have jumps in their third derivative
        step, x = 2.0**-3, np.array([place])
        rough = (f(x + step) - f(x - step)) / (2.0 * step)
        fine = (f(x + step / 4.0) - f(x - step / 4.0)) / (step / 2.0)
        assert abs(fine - slope) <= abs(rough - slope) / 8.0 + 1e-8 * abs(slope) + 1e-9 * value
        assert fine == pytest.approx(slope, rel=1e-4, abs=1e-8 * value)
        tried += 1
    assert tried >= 3


@pytest.mark.parametrize("lower", [12.0, 45.0, 200.0])
def test_differences_converge_to_the_slope_at_the_rate_they_must(lower: float) -> None:
    pose = springy()
    found = cdsm.saturation(pose, DOWN, lower)
    value, slope = closed(lower)
    np.testing.assert_allclose(found.curve[0], [lower, value, slope], rtol=1e-11)
    assert_second_order(
        along(pose), found.curve[0, 2:], np.array([lower]), step=0.5, size=value, tolerance=2e-7
    )


def test_beyond_saturation_tension_pays_less_than_the_fraction() -> None:
    pose = arms.random_posture(presets.virtual_prototype(), 5)
    found = cdsm.saturation(pose, DOWN, fraction=0.1)
    f = along(pose)

    def slope(lower: float, step: float = 1e-3) -> float:
        return float(f(np.array([lower + step])) - f(np.array([lower - step]))) / (2.0 * step)

    assert "pays less than 10 %" in str(found)
    assert slope(found.bound) == pytest.approx(0.1 * found.steepest_slope, rel=1e-4)
    assert max(found.curve[:, 2]) <= found.steepest_slope * (1.0 + 1e-9)
    assert found.stiffness.along(DOWN) == pytest.approx(
        float(f(np.array([found.bound]))), rel=1e-12
    )
    np.testing.assert_array_equal(found.stiffness.tension, found.tension.values)


def test_short_rise_where_the_arm_becomes_stable_is_told() -> None:
    geometry = cdsm.Geometry.universal(
        joints=4,
        cables_per_joint=3,
        link_length=0.06,
        base_length=0.03,
        disk_offset=0.012,
        hole_radius=0.025,
        link_mass=0.12,
        lead=0.3,
    )
    arm = cdsm.Manipulator(geometry, elasticity=cdsm.presets.STRAND_1X19)
    pose = arm.at([0.17, 0.09, 0.17, 0.09, -0.14, 0.0, -0.14, 0.0])
    found = cdsm.saturation(pose, "z")
    assert found.stiffness.along("z") < 0.01 * found.curve[:, 1].max()
    assert "give a minimum above this short rise" in str(found)
    assert "short rise" not in str(cdsm.saturation(pose, "z", minimum=10.0))


# --- closed form ----------------------------------------------------------------------------


def test_hinge_behind_springs_has_its_closed_form_everywhere() -> None:
    """It stiffens as the strand does, then the active part softens it until it buckles."""
    found = cdsm.saturation(springy(), DOWN, 3.0)
    places = np.linspace(3.0, 31.0, 4001)
    slopes = np.array([closed(F)[1] for F in places])
    # Eq. 19 begins so soft that the slope is largest there
    assert found.steepest == pytest.approx(places[slopes.argmax()], rel=1e-3)
    largest = closed(found.steepest)[1]
    assert found.steepest_slope == pytest.approx(largest, rel=1e-11)
    assert largest >= slopes.max() * (1.0 - 1e-9)
    after = next(F for F in places if found.steepest < F and closed(F)[1] < 0.1 * largest)
    expected = brentq(lambda F: closed(F)[1] - 0.1 * largest, after - 0.01, after, xtol=1e-12)
    assert found.bound == pytest.approx(expected, rel=1e-9)
    top = brentq(lambda F: closed(F)[1], found.bound, 31.0, xtol=1e-12)
    # at 31 N Eq. 19 bends sharply, and beyond the slope is lower still
    assert closed(32.0)[1] < closed(30.0)[1] < 0.0
    assert found.stiffest == pytest.approx(top, rel=1e-9)
    assert found.limit == "buckling"
    end = brentq(lambda F: closed(F)[0], 300.0, 400.0, xtol=1e-12)
    # the curve keeps a millionth of its length away from it
    assert found.end == pytest.approx(end - 1e-6 * (end - 3.0), rel=1e-9)
    np.testing.assert_allclose(found.curve[:, 1], [closed(F)[0] for F in found.curve[:, 0]])
    assert "tension makes the arm softer" in str(found)
    assert "where the arm buckles" in str(found)


def test_fraction_of_zero_is_the_maximum_and_near_one_the_steepest_place() -> None:
    pose = springy()
    found = {part: cdsm.saturation(pose, DOWN, 3.0, fraction=part) for part in (0.0, 0.3, 0.999)}
    assert found[0.0].bound == pytest.approx(found[0.0].stiffest, rel=1e-9)
    assert found[0.999].bound == pytest.approx(found[0.999].steepest, rel=1e-2)
    assert found[0.0].bound > found[0.3].bound > found[0.999].bound
    assert found[0.3].fraction == 0.3


def test_maximum_inside_the_domain_beats_every_other_bound() -> None:
    pose = arms.random_posture(some_arm("universal-3-8-all"), 11, 0.25)
    found = cdsm.saturation(pose, DOWN)
    assert found.curve[0, 0] < found.stiffest < found.end
    f = along(pose)
    best = float(f(np.array([found.stiffest])))
    values = [float(f(np.array([b]))) for b in np.linspace(3.0, found.end, 300)]
    assert max(values) <= best
    assert max(values) == pytest.approx(best, rel=1e-4)
    for beside in (0.98, 1.02):
        assert float(f(np.array([beside * found.stiffest]))) < best
    assert found.limit == "buckling"
    end = cdsm.critical_tension(pose).minimum
    assert found.end == pytest.approx(end, rel=2e-6)


# --- what ends the curve --------------------------------------------------------------------


def test_maximum_ends_the_curve_and_has_a_slope_there() -> None:
    """On the end itself no cable is free to balance the others; a hair before, they are."""
    pose = arms.random_posture(presets.virtual_prototype(), 5)
    found = cdsm.saturation(pose, DOWN, maximum=300.0, fraction=0.01)
    assert found.limit == "maximum"
    assert math.isinf(found.bound)  # it pays 1 % to the end
    with pytest.raises(cdsm.InfeasibleTension):
        cdsm.distribute_tension(pose, found.end * (1.0 + 1e-5), 300.0)
    pull = cdsm.distribute_tension(pose, found.end, 300.0)
    np.testing.assert_array_equal(found.tension.values, pull.values)
    before, last = found.curve[-1, 0] - 1e-2, found.curve[-1]
    value = cdsm.stiffness(pose, cdsm.distribute_tension(pose, before, 300.0)).along(DOWN)
    assert (last[1] - value) / 1e-2 == pytest.approx(last[2], rel=1e-3)
    straight = cdsm.saturation(springy(), DOWN, 3.0, 20.0)
    assert straight.end == pytest.approx(20.0, rel=2e-6)
    assert straight.curve[-1, 2] == pytest.approx(closed(straight.end)[1], rel=1e-9)


def test_end_of_the_elasticity_ends_the_curve() -> None:
    pose = arms.random_posture(presets.virtual_prototype(), 5)
    found = cdsm.saturation(pose, DOWN)
    assert found.limit == "elasticity"
    assert found.curve[-1, 0] == found.end
    pull = cdsm.distribute_tension(pose, found.end)
    assert pull.values.max() == pytest.approx(810.0, rel=1e-9)


def test_stiffness_that_tension_raises_without_end_never_saturates() -> None:
    found = cdsm.saturation(stayed(), DOWN, 10.0)
    assert found.limit == "none"
    assert math.isinf(found.bound)
    assert found.stiffest == found.end
    assert "and goes on" in str(found)


def test_straight_wire_without_a_lead_never_saturates() -> None:
    """K = 2 (EA + F)/2h R² − F h: the slope is R²/h − h over the lever squared, all the way."""
    found = cdsm.saturation(hinge().at([0.0]), DOWN, 10.0)
    assert found.limit == "none"
    assert math.isinf(found.bound)
    np.testing.assert_allclose(found.curve[:, 2], (R**2 / H - H) / LENGTH**2, rtol=1e-9)
    # far enough for what grows to be as large as what does not, and no further
    assert EA < found.end < 100.0 * EA
    assert math.isinf(cdsm.critical_tension(hinge().at([0.0])).minimum)


def test_tension_that_only_softens_saturates_at_once() -> None:
    found = cdsm.saturation(soft_hinge().at([0.0]), DOWN, 10.0)
    assert found.bound == found.stiffest == 10.0
    slope = 2.0 * R**2 / (LEAD + 2.0 * H) - H
    assert found.steepest_slope == pytest.approx(slope / LENGTH**2, rel=1e-9)
    assert found.end == pytest.approx(BUCKLING, rel=2e-6)
    assert "nowhere raises" in str(found)
    assert "pays less" not in str(found)


# --- the border -----------------------------------------------------------------------------

BAD: list[tuple[dict[str, Any], type[cdsm.CdsmError], str]] = [
    ({"fraction": 1.0}, cdsm.InvalidInput, "fraction: 1 given"),
    ({"fraction": -0.1}, cdsm.InvalidInput, "fraction: -0.1 given"),
    ({"fraction": math.nan}, cdsm.InvalidInput, "fraction"),
    ({"direction": (0.0, 0.0, 0.0)}, cdsm.InvalidInput, "zero vector"),
    ({"minimum": -1.0}, cdsm.InvalidInput, "minimum"),
    ({"minimum": [1.0, 2.0]}, cdsm.InvalidInput, "minimum: shape"),
    ({"minimum": 60.0, "maximum": 50.0}, cdsm.InvalidInput, "maximum: 50 N"),
    ({"maximum": math.nan}, cdsm.InvalidInput, "maximum"),
    ({"maximum": [1.0, 2.0]}, cdsm.InvalidInput, "maximum: shape"),
    ({"wrench": (1.0, 2.0)}, cdsm.InvalidInput, "wrench"),
    ({"wrench": (0.0, 0.0, 1e5, 0.0, 0.0, 0.0)}, cdsm.CdsmError, "810 N|balances the arm"),
    ({"minimum": 900.0}, cdsm.ElasticityRangeError, "domain"),
    ({"pose": "here"}, cdsm.InvalidInput, "pose"),
]


@pytest.mark.parametrize(("change", "error", "message"), BAD)
def test_bad_input_is_named(
    change: dict[str, Any], error: type[cdsm.CdsmError], message: str
) -> None:
    arm = presets.virtual_prototype()
    given = {"pose": arm.at(np.full(arm.nv, 0.1)), "direction": DOWN, "minimum": 5.0, **change}
    with pytest.raises(error, match=message):
        cdsm.saturation(**given)


def test_cable_at_a_higher_bound_of_its_own_does_not_rise() -> None:
    geometry = cdsm.Geometry.universal(
        joints=2,
        cables_per_joint=3,
        link_length=0.06,
        base_length=0.03,
        disk_offset=0.012,
        hole_radius=0.02,
        link_mass=0.05,
        lead=0.1,
    )
    plain = cdsm.Manipulator(geometry, presets.STRAND_1X19)
    cables = [replace(each, minimum=60.0 if i == 2 else 0.0) for i, each in enumerate(plain.cables)]
    pose = plain.with_cables(cables).at(np.deg2rad([6.0, -4.0, 5.0, 3.0]))

    def along(lower: float) -> float:
        return cdsm.stiffness(pose, cdsm.distribute_tension(pose, lower, 200.0)).along("z")

    curve = cdsm.saturation(pose, "z", 10.0, 200.0).curve
    # 60 N is where the common bound takes over; the slope jumps there and at kinks of the law
    assert np.isclose(curve[:, 0], 60.0, rtol=1e-8).any()
    for lower in (21.5, 36.0, 50.0, 72.0):
        at = int(abs(curve[:, 0] - lower).argmin())
        place, _, slope = curve[at]
        step = 1e-6 * place
        expected = (along(place + step) - along(place - step)) / (2.0 * step)
        assert slope == pytest.approx(expected, rel=1e-6)
