"""What a budget of uncertainty costs beside the stiffness itself, and a Monte Carlo run."""

import math

import numpy as np
import pytest

import cdsm
from tests.benchmarks.test_speed import problem
from tests.benchmarks.timing import Clock

TOLERANCES = cdsm.Tolerances(
    rigidity=0.05,
    joint_angle=math.radians(0.5),
    tension=2.0,
    lead=5e-3,
    hole_radius=1e-4,
    disk_offset=1e-4,
    link_length=1e-4,
    link_mass=6e-3,
)
DIRECTION = (0.0, 0.0, 1.0)


@pytest.mark.speed
@pytest.mark.parametrize("clock", ["speed"], indirect=True)
def test_a_budget_costs_some_five_stiffnesses(clock: Clock) -> None:
    one, q, tension = problem(5)
    clock.race(
        "budget of 8 sources, n = 5, over posture + stiffness + along",
        lambda: cdsm.uncertainty(one.at(q), tension, TOLERANCES, direction=DIRECTION),
        lambda: cdsm.stiffness(one.at(q), tension).along(DIRECTION),
        most=6.5,
        slow_repeat=50,
    )


@pytest.mark.speed
@pytest.mark.parametrize("clock", ["speed"], indirect=True)
def test_draws_are_faster_than_arms_built_one_by_one(clock: Clock) -> None:
    one, q, tension = problem(5)
    pose, draws = one.at(q), 2000
    rng = np.random.default_rng(0)
    angles = q + rng.normal(0.0, 1e-3, (20, q.size))

    def naive() -> None:  # 20 of them, as the description of each arm is checked anew
        for each in angles:
            arm = cdsm.Manipulator(one.geometry, cdsm.LinearElasticity(48e3))
            cdsm.stiffness(arm.at(each), tension).along(DIRECTION)

    clock.race(
        "2000 draws, n = 5: faster than 20 arms built one by one",
        naive,
        lambda: cdsm.monte_carlo(
            pose, tension, TOLERANCES, direction=DIRECTION, draws=draws, progress=False
        ),
        least=1.0,
    )
