"""Stable tensions to begin from: found where there are any, and the same with more of them."""

from dataclasses import replace

import numpy as np
import pytest

import cdsm
from cdsm import presets
from cdsm.planning.starts import StartPoints
from cdsm.planning.stiffness_model import StiffnessModel
from tests.planning.test_range import BUMP
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


def test_random_starts_go_on_from_fewer() -> None:
    pose = arms.random_posture(arms.random_arm(12, 2, "universal", BUMP), 12, 0.4)
    model = StiffnessModel(pose, 10.0, 400.0, np.zeros(6), 1e-4)
    few, many = (StartPoints(model, model.region, count, 0) for count in (6, 17))
    np.testing.assert_array_equal(few.anchor.F, many.anchor.F)
    starts = [each.F for each in few.points]
    np.testing.assert_array_equal(starts, [each.F for each in many.points[: len(starts)]])
    inside = [[each.F for each in begin.between(n)] for begin, n in ((few, 4), (many, 9))]
    np.testing.assert_array_equal(inside[0], inside[1][: len(inside[0])])
