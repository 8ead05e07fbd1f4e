"""Ranges and plans of arms that slide, hang slack, hold forces, have own laws or few cables."""

from collections.abc import Callable

import numpy as np
import pytest

import cdsm
from tests.planning.test_range import BUMP
from tests.support import arms, foreign
from tests.support.locked import STRAND, some_arm
from tests.support.paths import DOWN


def finger() -> cdsm.Posture:
    """A hinge and a slide; the slide has 10^5 N/m, which must not count as 10^5 N m/rad."""
    links = [("palm", 0.1), ("bone", 0.02), ("nail", 0.01)]
    ways = [("revolute", "0 0 0", "0 1 0"), ("prismatic", "0.05 0 0", "1 0 0")]
    parts = [foreign.link_element(*each) for each in links] + [
        foreign.joint_element(f"j{i}", kind, links[i][0], links[i + 1][0], xyz, "0 0 0", axis)
        for i, (kind, xyz, axis) in enumerate(ways)
    ]
    law = cdsm.LinearElasticity(4e3)
    sides = [(0.003, 0.003), (-0.003, -0.004), (0.003, -0.004), (-0.004, 0.003)]
    ends = [(("palm", (-0.01, 0.0, z)), ("nail", (0.0, 0.0, w))) for z, w in sides] + [
        (("bone", (0.08, 0.0, z)), ("nail", (-0.005, 0.0, z))) for z in (0.004, -0.004)
    ]
    cables = [
        cdsm.Cable(f"c{i}", (cdsm.Site(*a), cdsm.Site(*b)), law) for i, (a, b) in enumerate(ends)
    ]
    urdf = f'<robot name="finger">{"".join(parts)}</robot>'
    return cdsm.Manipulator.from_urdf(urdf, cables, tip="nail").at([0.05, 0.002])


def of_law(law: cdsm.Elasticity) -> cdsm.Posture:
    return arms.random_posture(arms.random_arm(2, 3, "hinged", law), 2, 0.4)


ARMS: dict[str, Callable[[], cdsm.Posture]] = {
    "slide": finger,
    "law that falls": lambda: of_law(BUMP),
    "slack branch": lambda: of_law(STRAND.slack_below()),
    "forces": lambda: arms.random_posture(some_arm("mixed-3-0-all"), 11, 0.25),
}


@pytest.mark.parametrize("name", ARMS)
def test_targets_within_the_range_are_hit(name: str) -> None:
    """From 0.5 N, below the low end of a strand, where its slack branch holds."""
    pose = ARMS[name]()
    low, high = {"slack branch": (0.5, 60.0), "forces": (40.0, 300.0)}.get(name, (5.0, 60.0))
    found = cdsm.stiffness_range(pose, "z", low, high, starts=6)
    assert found.high > 1.001 * found.low
    least = cdsm.distribute_tension(pose, low, high)
    for part in (0.02, 0.5, 0.98):
        target = found.low + part * (found.high - found.low)
        plan = cdsm.plan_stiffness(pose, "z", target, low, high)
        F = plan.tension.values
        assert cdsm.stiffness(pose, F).along("z") == pytest.approx(target, rel=1e-6)
        assert low <= F.min() <= F.max() <= high
        assert abs(plan.tension.residual).max() < 1e-10
        assert np.linalg.norm(F) >= np.linalg.norm(least.values) * (1.0 - 1e-12)


def test_at_least_as_stiff_costs_no_more_than_exactly_as_stiff() -> None:
    pose = arms.random_posture(arms.random_arm(3, 3, "universal", STRAND), 3, 0.4)
    found = cdsm.stiffness_range(pose, DOWN, 40.0, 300.0)
    least = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 40.0, 300.0))
    for target in (0.5 * (found.low + found.high), found.low):
        plan = cdsm.plan_stiffness(pose, DOWN, target, 40.0, 300.0, at_least=True)
        exact = cdsm.plan_stiffness(pose, DOWN, target, 40.0, 300.0)
        assert plan.reached
        assert plan.achieved >= target * (1.0 - 1e-6)
        assert np.linalg.norm(plan.tension) <= np.linalg.norm(exact.tension) * (1.0 + 1e-6)
        if target < least.along(DOWN):  # the least tensions will do
            np.testing.assert_allclose(plan.tension, least.tension, rtol=1e-6)
    with pytest.raises(cdsm.UnreachableStiffness):
        cdsm.plan_stiffness(pose, DOWN, 1.01 * found.high, 40.0, 300.0, at_least=True)


def test_the_table_of_a_path_has_the_unit_of_each_joint() -> None:
    arm = finger().arm
    q = np.array([[0.05, 0.002], [0.06, 0.002]])
    ends = [cdsm.stiffness_range(arm.at(each), "z", 5.0, 60.0) for each in q]
    targets = [(each.low + each.high) / 2.0 for each in ends]
    plan = cdsm.plan_path(arm, "z", targets, 5.0, 60.0, angles=q)
    turns, slides = arm.joint_names
    assert {f"{turns} [rad]", f"{slides} [m]"} <= {*plan.to_pandas().columns}
