"""Speed, as ratios against naive baselines in the same run; each compares the numbers first."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pytest
import qpsolvers

import cdsm
from cdsm.support.values import Array
from tests.benchmarks.conftest import Clock
from tests.benchmarks.naive import NaiveArm, naive_joint_stiffness
from tests.support.arms import readme_geometry

ROWS = 4000
RIGIDITY = 48e3
GRAVITY = np.array([0.0, -9.81, 0.0])
SIZES: dict[str, Any] = {
    "cables_per_joint": 3,
    "link_length": 0.04,
    "base_length": 0.02,
    "disk_offset": 0.01,
    "hole_radius": 0.03,
    "link_mass": 0.5,
}
WRENCH = np.array([1.0, -2.0, 3.0, 0.1, 0.2, -0.1])


class Problem(NamedTuple):
    """An arm, and angles and tensions of many postures."""

    arm: cdsm.Manipulator
    q: Array
    tension: Array

    def stiffness(self) -> cdsm.Stiffness:
        """Stiffness of the first posture."""
        return cdsm.stiffness(self.arm.at(self.q[0]), self.tension[0], wrench=WRENCH)


def problem(joints: int, rows: int = ROWS) -> Problem:
    geometry = readme_geometry(joints=joints, lead=0.0, **SIZES)
    arm = cdsm.Manipulator(geometry, cdsm.LinearElasticity(RIGIDITY), gravity=GRAVITY)
    rng = np.random.default_rng(joints)
    q = rng.uniform(-0.17, 0.17, (rows, arm.nv))
    return Problem(arm, q, rng.uniform(20.0, 90.0, (rows, len(arm.cables))))


@pytest.mark.parametrize("many", [False, True])
def test_stiffness_beats_differences(many: bool, clock: Clock | None) -> None:
    one = problem(5)
    naive = NaiveArm(5, gravity=GRAVITY, **SIZES)

    def batch() -> Array:
        return cdsm.evaluate(one.arm, one.q, one.tension, WRENCH, ("joint",), threads=1)["joint"]

    differences = partial(naive_joint_stiffness, naive, one.q[0], one.tension[0], WRENCH, RIGIDITY)
    K = batch()[0] if many else one.stiffness().joint
    # second differences with h = 1e-4 truncate at h² and round at 1e-16/h²; the crosses weigh 1e-6
    np.testing.assert_allclose(K, differences(), atol=1e-6 * abs(K).max())
    if clock and many:
        what = "batch, n = 5, one core: faster than differences"
        clock.race(what, differences, batch, least=10_000.0, rows=ROWS, fast_repeat=1)
    elif clock:
        what = "posture + stiffness, n = 5: faster than differences"
        clock.race(what, differences, one.stiffness, least=200.0)


def test_ten_loads_on_links_cost_a_third_more_than_one_at_the_tip(clock: Clock | None) -> None:
    one = problem(20, 1)
    pose = one.arm.at(one.q[0])
    links = [f"link{k}" for k in range(2, 21, 2)]
    ten = [cdsm.Load(link, tuple(WRENCH[:3]), point=(0.01, 0.0, 0.005)) for link in links]

    def loaded() -> cdsm.Stiffness:
        return cdsm.stiffness(one.arm.at(one.q[0]), one.tension[0], wrench=ten)

    parts = [cdsm.stiffness(pose, one.tension[0], wrench=load).load for load in ten]
    np.testing.assert_allclose(loaded().load, sum(parts), atol=1e-13)
    if clock:
        what = "posture + stiffness, n = 20: cost of ten loads on links over one at the tip"
        clock.race(what, loaded, one.stiffness, most=1.3, slow_repeat=50)


def test_a_batch_with_loads_on_links_costs_a_third_more(clock: Clock | None) -> None:
    many = problem(5)
    hung = {"link2": WRENCH * [1, 1, 1, 0, 0, 0], "link3": np.tile(WRENCH, (ROWS, 1))}

    def batch(wrench: Any) -> Array:
        quantities = ("joint",)
        return cdsm.evaluate(many.arm, many.q, many.tension, wrench, quantities, threads=1)["joint"]

    pose = many.arm.at(many.q[7])
    alone = cdsm.stiffness(pose, many.tension[7], {"link2": hung["link2"], "link3": WRENCH}).joint
    np.testing.assert_allclose(batch(hung)[7], alone, rtol=0, atol=1e-12 * abs(alone).max())
    if clock:
        what = "batch, n = 5: cost of loads on two links over one at the tip"
        clock.race(what, partial(batch, hung), partial(batch, WRENCH), most=1.3, fast_repeat=1)


@pytest.mark.speed
@pytest.mark.parametrize("clock", ["speed"], indirect=True)
def test_cost_grows_less_than_fourfold_from_5_to_20_joints(clock: Clock) -> None:
    what = "posture + stiffness: cost of n = 20 over n = 5"
    slow, fast = problem(20, 1).stiffness, problem(5, 1).stiffness
    clock.race(what, slow, fast, most=4.0, slow_repeat=50)


# OSQP announces a change of its defaults at every call
@pytest.mark.filterwarnings("ignore:The default value of raise_error")
@pytest.mark.filterwarnings("ignore::qpsolvers.warnings.SparseConversionWarning")
def test_tension_distribution_is_faster_than_osqp_and_faster_still_in_a_batch(
    clock: Clock | None,
) -> None:
    one = problem(5)
    pose, count = one.arm.at(one.q[0]), len(one.arm.cables)
    low, high = np.full(count, 20.0), np.full(count, np.inf)
    balance = {"A": pose.length_jacobian.T, "b": -pose.gravity_torque}
    qp = qpsolvers.Problem(np.eye(count), np.zeros(count), lb=low, ub=high, **balance)
    osqp: Callable[[], Any] = partial(qpsolvers.solve_problem, qp, "osqp")
    single = partial(cdsm.distribute_tension, pose, 20.0)
    batch = partial(cdsm.distribute_tensions, one.arm, one.q, 20.0, threads=1)
    exact, many = single().values, batch()
    # what the defaults of OSQP are worth: within a few newtons
    np.testing.assert_allclose(osqp().x, exact, atol=3.0)
    assert many.ok.all()
    np.testing.assert_allclose(many.values[0], exact, rtol=0.0, atol=1e-9 * exact.max())
    if clock:
        what = "tension distribution, n = 5: faster than OSQP with its defaults"
        clock.race(what, osqp, single, least=4.0, slow_repeat=5)
        what = "batched tension, n = 5: faster than one by one"
        clock.race(what, single, batch, least=6.0, rows=ROWS, slow_repeat=50, fast_repeat=1)


@pytest.mark.parametrize(("joints", "most", "least"), [(5, 4.0, 18.0), (20, 4.0, 3.3)])
def test_one_posture_to_its_reading_costs_little_more_than_its_stiffness(
    joints: int, most: float, least: float, clock: Clock | None
) -> None:
    rows, low = 800, 20.0 if joints == 5 else 60.0
    one = problem(joints, rows)

    def single() -> float:
        pose = one.arm.at(one.q[0])
        return cdsm.stiffness(pose, cdsm.distribute_tension(pose, low)).along("z")

    def batch() -> Array:
        given: Any = {"minimum": low, "outputs": ("along",), "direction": "z", "threads": 1}
        return cdsm.evaluate(one.arm, one.q, **given)["along"]

    assert single() == pytest.approx(batch()[0], rel=1e-9)
    if clock:
        times: Any = {"slow_repeat": 20, "rounds": 10}
        what = f"at, tension, stiffness, along, n = {joints}: cost over posture + stiffness"
        clock.race(what, single, one.stiffness, most=most, fast_repeat=20, **times)
        what = f"at, tension, stiffness, along, n = {joints}: batch, times faster"
        clock.race(what, single, batch, least=least, rows=rows, fast_repeat=1, **times)
