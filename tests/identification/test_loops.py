"""Loops of weight tests: friction and rigidity from loads that come and go."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

import cdsm
from cdsm.identification import WeightLoop, identify

TRUE = {"friction": 0.1, "rigidity": 48e3}
FREE = {"friction": (0.0, 0.5), "rigidity": (1e4, 2e5)}
FORCES = (0.0, 8.0, 16.0, 24.0, 16.0, 8.0, 0.0)
NOISE: Any = {"displacement_std": 5e-6}


def hinge(
    friction: float = 0.1, rigidity: float = 48e3, lead: float = 0.3, hole_radius: float = 0.025
) -> cdsm.Manipulator:
    geometry = cdsm.Geometry.hinged(
        joints=1, twist=0.0, cables_per_joint=2, link_length=0.15, base_length=0.02,
        disk_offset=0.02, hole_radius=hole_radius, link_mass=0.1, lead=lead, friction=friction,
    )  # fmt: skip
    return cdsm.Manipulator(geometry, elasticity=cdsm.LinearElasticity(rigidity))


PLANNED = [
    WeightLoop(
        direction="-z", angles=(angle,), forces=FORCES, minimum=200.0, label=f"at {angle}", **NOISE
    )
    for angle in (0.45, -0.4)
]


def measured(seed: int, planned: list[WeightLoop] = PLANNED) -> list[WeightLoop]:
    """What the true arm gives, with errors of readings."""
    random = np.random.default_rng([seed, 20])
    return [loop.simulated(hinge(), random) for loop in planned]


FOUND = identify(hinge, measured(0), FREE, start={"friction": 0.3, "rigidity": 3e4})


def test_friction_and_rigidity_come_back_within_five_per_cent() -> None:
    # linearised, σ is 1.3 % and 0.2 %: 5 % is four σ
    for name, (low, high) in FOUND.confidence().items():
        assert FOUND.parameters[name] == pytest.approx(TRUE[name], rel=0.05)
        assert low < TRUE[name] < high
    assert not FOUND.warnings
    assert FOUND.freedom == 2 * (len(FORCES) - 1) - 2
    assert 0.1 * FOUND.freedom < FOUND.chi_square < 3.0 * FOUND.freedom


def test_loops_of_a_load_cycle_give_the_arm_that_made_them() -> None:
    # another way to compute the readings; in three axes, and off by a zero of the gauge
    loops = []
    for loop in PLANNED:
        pose = hinge().at(loop.angles)
        wrenches = np.c_[loop.applied, np.zeros((len(FORCES), 3))]
        pull = cdsm.distribute_tension(pose, 200.0)
        tip = cdsm.load_cycle(pose, pull, wrenches, substeps=64).tip
        read = tuple(map(tuple, (tip + np.array([0.3, -2.0, 5.0])).tolist()))
        loops.append(replace(loop, displacements=read))
    found = identify(hinge, loops, FREE, start={"friction": 0.2, "rigidity": 6e4})
    for name, true in TRUE.items():
        assert found.parameters[name] == pytest.approx(true, rel=5e-3)
    assert found.chi_square < 1.0  # rests between the loads, 0.2 % of the motion
    np.testing.assert_allclose(found.predicted, found.measured, atol=2e-6)
    assert found.freedom == 2 * 3 * (len(FORCES) - 1) - 2


def intervals_hold(seed: int) -> list[bool]:
    """Simulate an experiment of two loops; whether the intervals of a fit hold the truth."""
    planned = [replace(loop, forces=(0.0, 12.0, 24.0, 12.0, 0.0)) for loop in PLANNED]
    fit = identify(hinge, measured(seed, planned), FREE)
    problem = fit.problem
    truth = problem.point(np.array(list(TRUE.values())))
    best = problem.point(fit.values)
    # an interval holds a value if Δχ² with the parameter fixed there is at most its level²
    held = []
    for i in range(truth.size):
        fixed = best.copy()
        fixed[i] = truth[i]
        others = np.flatnonzero(np.arange(truth.size) != i)
        fixed = problem.search(fixed, others, profile=True)
        held.append(problem.cost(fixed) - fit.chi_square <= norm.ppf(0.975) ** 2)
    return held


def test_intervals_of_a_few_experiments_hold_the_truth() -> None:
    assert np.sum([intervals_hold(seed) for seed in range(3)]) >= 5


@pytest.mark.long
def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    """Of friction and of rigidity, in 200 experiments of two loops each."""
    shares = np.mean([intervals_hold(seed) for seed in range(200)], axis=0)
    assert ((shares >= 0.90) & (shares <= 0.98)).all(), shares


ONE = replace(PLANNED[0], forces=(0.0, 5.0)).simulated(hinge())


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        (lambda: replace(PLANNED[0], forces=(5.0, 5.0, 5.0)), "forces.*at least two sizes"),
        (lambda: replace(PLANNED[0], displacements=(1e-3, 2e-3)), r"displacements.*\(7, 3\)"),
        (lambda: replace(PLANNED[0], minimum=None), "tension.*neither"),
        (lambda: identify(hinge, PLANNED, FREE), r"measurements\[0\]: at 0.45 has no readings"),
        (lambda: identify(hinge, [ONE], FREE), "1 independent reading given for 2 .*, friction"),
        (lambda: identify(hinge, measured(0), {"viscosity": (0.0, 1.0)}), "viscosity"),
    ],
)
def test_bad_loops_name_the_offender_and_the_remedy(bad: Callable[[], object], said: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=said):
        bad()
