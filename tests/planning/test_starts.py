"""Stable tensions to begin from: found where there are any, and the same with more of them."""

from dataclasses import replace

import numpy as np
import pytest

import cdsm
from cdsm import presets
from tests.support import arms
from tests.support.locked import (
    BUCKLING,
    STRAND,
    soft_hinge,
)
from tests.support.paths import DOWN


def test_unstable_least_tensions_do_not_hide_stable_ones() -> None:
    """Eq. 19 starts soft: an arm that stands on its joints needs tension to stand."""
    geometry = presets.experimental_prototype_geometry(link_mass=0.6, lead=2.0)
    arm = cdsm.Manipulator(geometry, STRAND, gravity=(-9.81, 0.0, 0.0))
    pose = arm.at([0.05, -0.1, 0.05])
    assert not cdsm.stiffness(pose, cdsm.distribute_tension(pose, 3.0)).is_stable
    found = cdsm.stiffness_range(pose, DOWN, 3.0)
    for pull in (found.low_tension, found.high_tension):
        K = cdsm.stiffness(pose, pull)
        assert K.margin >= found.floor * (1.0 - 1e-9)
        assert K.is_stable
    assert found.low < 0.01 * found.high


@pytest.mark.parametrize("above", [-1e-6, 1e-6])
def test_arm_is_held_exactly_as_long_as_some_tension_holds_it(above: float) -> None:
    # from the critical tension on no tensions do: all are larger
    pose = soft_hinge().at([0.0])
    minimum = BUCKLING * (1.0 + above)
    if above < 0.0:
        assert cdsm.stiffness_range(pose, DOWN, minimum).high > 0.0
    else:
        with pytest.raises(cdsm.SingularStiffness, match=r"make the arm stable.*joint1"):
            cdsm.stiffness_range(pose, DOWN, minimum)


def test_arm_of_force_controlled_cables_is_told_why_nothing_holds_it() -> None:
    arm = presets.virtual_prototype()
    cables = [replace(cable, control="force") for cable in arm.cables]
    pose = cdsm.Manipulator(arm.geometry, cables=cables, gravity=arm.gravity).at(np.full(10, 0.1))
    for plan in (cdsm.stiffness_range, cdsm.saturation):
        with pytest.raises(cdsm.SingularStiffness, match='control="position"') as caught:
            plan(pose, DOWN, 50.0, 500.0)
        assert caught.value.direction.shape == (10,)


def test_end_of_the_range_that_a_crossing_meets_by_rounding_is_reached() -> None:
    pose = arms.random_posture(arms.random_arm(3, 3, "hinged", STRAND), 3, 0.3)
    u = (0.0, 1.0, 0.3)
    found = cdsm.stiffness_range(pose, u, 10.0)
    plan = cdsm.plan_stiffness(pose, u, found.low, 10.0)
    assert plan.achieved == pytest.approx(found.low, rel=1e-6)
    path = cdsm.plan_path(pose.arm, u, [3.0 * found.low, found.low], 10.0, angles=[pose.q] * 2)
    assert path.complete
