"""Where more tension stops paying, against the stiffness itself and closed forms."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import cdsm
from cdsm import Status, presets
from tests.planning.test_range import stayed
from tests.support import arms
from tests.support.locked import BUCKLING, LENGTH, STRAND, H, R, hinge, soft_hinge, some_arm
from tests.support.paths import DOWN

SPRING = 2e3
LEAD = 0.3  # the springs stretch by less


def springy() -> cdsm.Posture:
    """A straight hinge of two strands behind soft springs, which buckles at some 350 N."""
    geometry = hinge(lead=LEAD).geometry
    cables = cdsm.serpentine_cables(geometry, STRAND, series_stiffness=SPRING)
    return cdsm.Manipulator(geometry, cables=cables, gravity=(0.0, 0.0, 0.0)).at([0.0])


def closed(F: float) -> float:
    """Its along(z), (2 k R² − F h)/lever², by hand: 1/k = l_0/EA + 1/k_series."""
    free = (LEAD + 2.0 * H - (F - STRAND.low) / SPRING) / (1.0 + float(STRAND.strain(F)))
    k = 1.0 / (free / float(STRAND.rigidity(F)) + 1.0 / SPRING)
    return (2.0 * k * R**2 - F * H) / LENGTH**2


def along(pose: cdsm.Posture, lower: float) -> float:
    return cdsm.stiffness(pose, cdsm.distribute_tension(pose, lower)).along(DOWN)


def test_hinge_behind_springs_has_its_closed_form_everywhere() -> None:
    """It stiffens as the strand does, then the active part softens it until it buckles."""
    found = cdsm.saturation(springy(), DOWN, 3.0)
    np.testing.assert_allclose(found.along, [closed(F) for F in found.minimum])
    places = np.linspace(3.0, 60.0, 20001)
    curve = np.array([closed(F) for F in places])
    # 200 bounds are 3 % apart
    assert found.stiffest == pytest.approx(places[curve.argmax()], rel=0.04)
    expected = brentq(lambda F: closed(F) - 0.95 * curve.max(), 3.0, places[curve.argmax()])
    assert found.bound == pytest.approx(expected, rel=1e-2)
    end = brentq(closed, 300.0, 400.0)
    assert found.limit is Status.UNSTABLE
    assert 0.95 * end < found.minimum[-1] < end
    np.testing.assert_array_equal(found.stiffness.tension, found.tension.values)
    assert found.stiffness.along(DOWN) == pytest.approx(0.95 * curve.max(), rel=1e-3)


@pytest.mark.parametrize("name", ["prototype", "universal-3-8-all"])
def test_bound_has_the_fraction_of_the_largest_stiffness(name: str) -> None:
    arm = presets.virtual_prototype() if name == "prototype" else some_arm(name)
    pose = arms.random_posture(arm, 11, 0.25)
    found = [cdsm.saturation(pose, DOWN, 5.0, fraction=part) for part in (0.5, 0.95, 1.0)]
    most = max(along(pose, b) for b in np.linspace(5.0, found[0].minimum[-1], 300))
    for each in found:
        assert each.along.max() == pytest.approx(most, rel=1e-3)
        assert along(pose, each.bound) == pytest.approx(each.fraction * most, rel=5e-3)
    assert found[0].bound < found[1].bound < found[2].bound == found[2].stiffest


def test_what_ends_the_curve_is_told() -> None:
    pose = arms.random_posture(presets.virtual_prototype(), 5)
    found = cdsm.saturation(pose, DOWN)
    assert found.limit is Status.OUTSIDE_ELASTICITY
    assert 0.9 * 810.0 < cdsm.distribute_tension(pose, found.minimum[-1]).values.max() <= 810.0
    limited = cdsm.saturation(pose, DOWN, maximum=300.0)
    assert limited.limit is Status.INFEASIBLE
    with pytest.raises(cdsm.InfeasibleTension):
        cdsm.distribute_tension(pose, limited.minimum[-1] * 1.05, 300.0)
    straight = cdsm.saturation(springy(), DOWN, 3.0, 20.0)
    assert (straight.limit, straight.minimum[-1]) == (Status.AT_MAXIMUM, pytest.approx(20.0))


def test_stiffness_that_tension_raises_without_end_never_saturates() -> None:
    found = cdsm.saturation(stayed(), DOWN, 10.0)
    assert (found.limit, found.bound) == (Status.OK, math.inf)
    assert found.stiffest == found.minimum[-1]
    only_softer = cdsm.saturation(soft_hinge().at([0.0]), DOWN, 10.0)
    assert only_softer.bound == only_softer.stiffest == 10.0
    assert only_softer.minimum[-1] == pytest.approx(BUCKLING, rel=0.05)
    with pytest.raises(cdsm.InvalidInput, match=r"fraction: 1\.1 given"):
        cdsm.saturation(stayed(), DOWN, 10.0, fraction=1.1)
