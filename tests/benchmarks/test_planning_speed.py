"""Planning, against what a script with scipy would do; each compares the numbers first."""

from typing import Any

import numpy as np
from scipy.optimize import minimize, nnls

import cdsm
from cdsm import presets
from cdsm.support.values import Array
from tests.benchmarks.naive import NaiveArm, difference, naive_joint_stiffness
from tests.benchmarks.test_speed import GRAVITY, RIGIDITY, SIZES, arm
from tests.benchmarks.timing import Clock, seconds

UP = np.array([0.0, 0.0, 1.0])
BOUND = 50.0


def with_slsqp(pose: cdsm.Posture, target: float) -> Array:
    """SLSQP from the least tensions, with the library's stiffness and gradients by differences."""
    least = cdsm.distribute_tension(pose, BOUND).values
    unit = float(least.max())
    torque = least @ pose.length_jacobian
    found: Any = minimize(
        lambda x: 0.5 * float(x @ x),
        least / unit,
        method="SLSQP",
        bounds=[(BOUND / unit, 800.0 / unit)] * least.size,
        constraints=[
            {"type": "eq", "fun": lambda x: unit * x @ pose.length_jacobian - torque},
            {"type": "eq", "fun": lambda x: cdsm.stiffness(pose, unit * x).along(UP) / target - 1},
        ],
        options={"ftol": 1e-12, "maxiter": 300},
    )
    return np.asarray(unit * found.x)


def test_planning_is_twice_as_fast_as_slsqp_with_differences(clock: Clock | None) -> None:
    """Both from the least tensions; the plan sees to the kinks of the rigidity, too."""
    one = presets.virtual_prototype()
    pose = one.at(np.full(one.nv, presets.TEN_DEGREES))
    target = 90e3

    def planned(starts: int) -> cdsm.StiffnessPlan:
        return cdsm.plan_stiffness(pose, UP, target, BOUND, 800.0, starts=starts)

    slow, plan = with_slsqp(pose, target), planned(1)
    np.testing.assert_allclose(slow, plan.tension.values, rtol=1e-5)
    assert abs(float(plan.achieved) / target - 1.0) < 1e-9

    if clock:
        each = min(seconds(lambda: planned(3), 3) for _ in range(10))
        print(f"\nplan, n = 5: with three starts {1e3 * each:.1f} ms")
        clock.race(
            "plan, n = 5: faster than SLSQP",
            lambda: with_slsqp(pose, target),
            lambda: planned(1),
            least=2.0,
            fast_repeat=3,
            rounds=5,
        )


def test_sample_of_a_path_is_twice_as_fast_as_a_plan_from_scratch(clock: Clock | None) -> None:
    one = presets.virtual_prototype()
    s = np.linspace(0.0, 0.3, 12)
    q = presets.TEN_DEGREES * (1.0 + 0.3 * np.sin(np.outer(s, np.linspace(0.5, 5.0, one.nv))))
    targets = 80e3 + 10e3 * s

    def along_path() -> cdsm.PathPlan:
        return cdsm.plan_path(one, UP, targets, BOUND, angles=q)

    def one_by_one() -> list[cdsm.StiffnessPlan]:
        pairs = zip(q, targets, strict=True)
        return [cdsm.plan_stiffness(one.at(a), UP, target, BOUND) for a, target in pairs]

    path = along_path()
    assert path.complete
    alone = [np.linalg.norm(plan.tension.values) for plan in one_by_one()]
    np.testing.assert_allclose(np.linalg.norm(path.tensions, axis=1), alone, rtol=1e-7)

    if clock:
        each = min(seconds(along_path, 1) for _ in range(5)) / s.size
        print(f"\nsample of a path, n = 5: {1e3 * each:.2f} ms")
        what = "sample of a path, n = 5: faster than from scratch"
        clock.race(what, one_by_one, along_path, least=2.0, fast_repeat=1, rounds=4)


def naive_step(naive: NaiveArm, q: Array) -> tuple[Array, Array]:
    """Tensions and K_θ of a throw-away script: differences, and least squares with a penalty."""

    def measured(x: Array) -> Array:
        lengths, energy, *_ = naive.state(x)
        return np.append(lengths, energy)

    J = difference(measured, q, 1e-5)
    # min ‖F‖² with F >= bound, the balance as rows of great weight; what is above the bound is
    # not negative
    rows = np.vstack([1e6 * J[:-1].T, np.eye(len(J) - 1)])
    start = np.full(len(J) - 1, BOUND)
    wanted = np.append(-1e6 * J[-1], np.zeros(start.size)) - rows @ start
    tension = start + nnls(rows, wanted)[0]
    return tension, naive_joint_stiffness(naive, q, tension, np.zeros(6), RIGIDITY)


def test_inner_loop_is_three_hundred_times_faster_than_differences(clock: Clock | None) -> None:
    """Posture, tension distribution and stiffness: what a controller does in every cycle."""
    one = arm(5)
    naive = NaiveArm(5, gravity=GRAVITY, **SIZES)
    q = np.random.default_rng(5).uniform(-0.17, 0.17, one.nv)

    def cycle() -> cdsm.Stiffness:
        pose = one.at(q)
        return cdsm.stiffness(pose, cdsm.distribute_tension(pose, BOUND))

    K = cycle()
    tension, joint = naive_step(naive, q)
    # the crosses weigh 1e-6 kg here, and second differences leave 1e-6
    np.testing.assert_allclose(tension, K.tension, atol=1e-3)
    np.testing.assert_allclose(joint, K.joint, atol=1e-5 * abs(K.joint).max())

    if clock:
        rate = 1.0 / min(seconds(cycle, 200) for _ in range(10))
        print(f"\nposture + tension + stiffness, n = 5: {1e-3 * rate:.2f} kHz")
        what = "posture + tension + stiffness, n = 5: faster than differences"
        clock.race(what, lambda: naive_step(naive, q), cycle, least=300.0, rounds=10)
