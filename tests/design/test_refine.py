"""Refinement under friction and tolerances."""

import pytest

import cdsm
from tests.design.test_problem import LAW, problem, small_arm

TOLERANCES = cdsm.Tolerances(
    rigidity=0.05, hole_radius=1e-4, hole_angle=5e-3, disk_offset=1e-4, tension=0.5
)


@pytest.mark.slow
@pytest.mark.parametrize("law", [LAW, cdsm.presets.STRAND_1X19])
def test_a_design_under_friction_and_tolerances_is_refined(law: cdsm.Elasticity) -> None:
    least = 3.1e4 if law is LAW else 1.1e4
    task = problem(
        arm=cdsm.Manipulator(small_arm(friction=0.1).geometry, law),
        variables=(
            cdsm.Variable("hole_radius", 0.015, 0.03),
            cdsm.Variable("disk_offset", 0.005, 0.02),
            cdsm.Variable("minimum", 5.0, 50.0),
        ),
        objectives=(cdsm.Objective("motor_force"),),
        constraints=(cdsm.Constraint("stiffness", "z", at_least=least),),
        worst_friction=True,
        tolerances=TOLERANCES,
    )
    searched = cdsm.search_designs(task, generations=8, population=16, seed=1)
    refined = cdsm.refine_design(task, searched.design(0))
    again = cdsm.evaluate_designs(task, [refined.design(0)])
    assert again.feasible[0] == 1.0
    assert again["motor_force"][0] < 0.99 * searched.values(0)["motor_force"]
    # the constraint decides: it is met with its margin, and not by more than needed
    assert again["stiffness (0, 0, 1)"][0] == pytest.approx(least, rel=1e-5)
    assert again["stiffness (0, 0, 1)"][0] >= least
