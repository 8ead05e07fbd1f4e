"""Tension distribution: infeasible bounds, and solvers whose answers are wrong."""

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import qpsolvers
from scipy.optimize import linprog

import cdsm
from cdsm.kernels import tension as tension_kernels
from cdsm.kernels.tension import DISTANCE, OPTIMALITY
from cdsm.support.values import Array
from cdsm.tension import distribution
from cdsm.tension.solvers import _polished, _shortfall
from tests.support.arms import (
    STEEL,
    random_arm,
    random_posture,
    random_wrench,
)

ARM = random_arm(1, 3)
POSE = random_posture(ARM, 1)
C = len(ARM.cables)
NAN, INF = math.nan, math.inf


def torque_of(pose: cdsm.Posture, wrench: Array) -> Array:
    """τ of Eq. 13: what the cables have to exert."""
    return wrench @ pose.jacobian - pose.gravity_torque


def least_missing(pose: cdsm.Posture, low: Array, high: Array, wrench: Array) -> float:
    """A proven lower bound of Σ|τ − J_Lᵀ F|, from the dual linear program.

    For any y with |y_i| <= 1 and any F within the bounds, Σ|τ − J_Lᵀ F| >= y·τ − (J_L y)·F, and
    with J_L y = p − n, p and n >= 0, that is at least y·τ − high·p + low·n.
    """
    tau, J = torque_of(pose, wrench), pose.length_jacobian
    count, nv = J.shape
    bounded = np.isfinite(high)
    best = linprog(
        np.concatenate([-tau, np.where(bounded, high, 0.0), -low]),
        A_eq=np.hstack([J, -np.eye(count), np.eye(count)]),
        b_eq=np.zeros(count),
        bounds=[
            *[(-1.0, 1.0)] * nv,
            *[(0.0, None) if b else (0.0, 0.0) for b in bounded],
            *[(0.0, None)] * count,
        ],
        method="highs",
    )
    assert best.status == 0
    return -float(best.fun)


def refused(
    pose: cdsm.Posture, low: Array, high: Array, wrench: Array, solver: str = "daqp"
) -> cdsm.InfeasibleTension:
    with pytest.raises(cdsm.InfeasibleTension) as caught:
        cdsm.distribute_tension(pose, low, high, wrench, solver)
    return caught.value


def check_missing(
    error: cdsm.InfeasibleTension, pose: cdsm.Posture, low: Array, high: Array, wrench: Array
) -> None:
    """``missing`` is attained by tensions within the bounds, and no tensions do better."""
    tau, J = torque_of(pose, wrench), pose.length_jacobian
    count, nv = J.shape
    # variables: F, then the largest |J_Lᵀ F − (τ − missing)|
    attained = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.vstack([np.hstack([J.T, -np.ones((nv, 1))]), np.hstack([-J.T, -np.ones((nv, 1))])]),
        b_ub=np.concatenate([tau - error.missing, error.missing - tau]),
        bounds=[*zip(low, high, strict=True), (0.0, None)],
        method="highs",
    )
    assert attained.status == 0
    assert attained.fun < 1e-9
    assert abs(error.missing).sum() == pytest.approx(least_missing(pose, low, high, wrench), 1e-9)
    assert error.joint == pose.arm.joint_names[int(abs(error.missing).argmax())]
    assert f"at {error.joint}" in str(error)
    assert not error.missing.flags.writeable


@pytest.mark.parametrize("seed", range(8))
def test_bounds_too_tight_say_what_is_missing_and_how_far_to_widen(seed: int) -> None:
    pose = random_posture(random_arm(seed, 3), seed)
    count = len(pose.arm.cables)
    low = np.random.default_rng(seed).uniform(5.0, 30.0, count)
    high = low + 0.5
    wrench = random_wrench(seed)
    error = refused(pose, low, high, wrench)
    check_missing(error, pose, low, high, wrench)
    assert 0.0 < error.relaxation < INF
    assert set(error.binding) <= {cable.name for cable in pose.arm.cables}
    assert "Lower minimum=, raise maximum=" in str(error)

    enough = error.relaxation * (1.0 + 1e-6)
    pull = cdsm.distribute_tension(pose, np.maximum(low - enough, 0.0), high + enough, wrench)
    assert abs(pull.residual).max() < 1e-9
    less = 0.9 * error.relaxation
    refused(pose, np.maximum(low - less, 0.0), high + less, wrench)


def test_cables_that_stand_at_either_bound_are_named() -> None:
    arm = cdsm.Manipulator(cdsm.presets.experimental_prototype_geometry(), STEEL)
    pose = arm.at(np.zeros(3))
    # nothing but its own pair reaches the last joint, and nearly the same tension balances it
    low, high = np.full(6, 20.0), np.full(6, 400.0)
    low[4], high[5] = 300.0, 30.0
    with pytest.raises(cdsm.InfeasibleTension) as caught:
        cdsm.distribute_tension(pose, low, high)
    assert set(caught.value.binding) >= {"cable3_1", "cable3_2"}
    assert "cable3_1" in str(caught.value)


@pytest.mark.parametrize("seed", range(8))
def test_widening_by_the_number_in_the_message_is_enough(seed: int) -> None:
    pose = random_posture(random_arm(seed, 3), seed)
    low = np.random.default_rng(seed).uniform(5.0, 30.0, len(pose.arm.cables))
    error = refused(pose, low, low + 0.5, random_wrench(seed))
    advice = re.search(r"Widening every bound by (\S+) N would be enough", str(error))
    assert advice is not None
    wider = float(advice[1])
    cdsm.distribute_tension(
        pose, np.maximum(low - wider, 0.0), low + 0.5 + wider, random_wrench(seed)
    )


def test_only_the_upper_bound_may_be_too_tight() -> None:
    wrench = np.array([0.0, 0.0, 50.0, 0.0, 0.0, 0.0])
    low, high = np.zeros(C), np.full(C, 1.0)
    error = refused(POSE, low, high, wrench)
    check_missing(error, POSE, low, high, wrench)
    cdsm.distribute_tension(POSE, 0.0, 1.0 + error.relaxation * (1.0 + 1e-6), wrench)
    refused(POSE, low, high + 0.9 * error.relaxation, wrench)


def weak_arm() -> cdsm.Manipulator:
    """One cable per universal joint: most torques are beyond it, whatever the tension."""
    geometry = cdsm.Geometry.universal(
        joints=3,
        cables_per_joint=1,
        link_length=0.05,
        base_length=0.02,
        disk_offset=0.01,
        hole_radius=0.03,
        link_mass=0.2,
    )
    return cdsm.Manipulator(geometry, STEEL)


@pytest.mark.parametrize("maximum", [INF, 100.0])
@pytest.mark.parametrize("solver", ["daqp", "osqp"])
def test_torque_the_cables_cannot_exert_at_all_has_no_relaxation(
    maximum: float, solver: str
) -> None:
    pose = random_posture(weak_arm(), 4)
    low, high, wrench = np.zeros(3), np.full(3, maximum), np.zeros(6)
    error = refused(pose, low, high, wrench, solver)
    assert error.relaxation == INF
    check_missing(error, pose, low, high, wrench)
    for part in ("No bounds would help", "Change the posture, the load, or the routing"):
        assert part in str(error)


def test_infeasible_and_feasible_agree_between_solvers() -> None:
    wrench = np.array([0.0, 0.0, 5.0, 0.0, 0.0, 0.0])
    errors = [
        refused(POSE, np.zeros(C), np.full(C, 0.5), wrench, solver) for solver in ("daqp", "osqp")
    ]
    assert errors[0].relaxation == pytest.approx(errors[1].relaxation)
    assert abs(errors[0].missing).sum() == pytest.approx(abs(errors[1].missing).sum())


@pytest.mark.parametrize("seed", range(4))
def test_a_torque_missing_by_less_than_linear_programs_care_for_is_named(seed: int) -> None:
    """Nobody claims then that there are tensions after all."""
    pose = random_posture(random_arm(seed, 3), seed)
    J, count = pose.length_jacobian, len(pose.arm.cables)
    size = abs(J).max()
    # the least upper bound of all cables that balances the arm
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=np.column_stack([np.eye(count), -np.ones(count)]),
        b_ub=np.zeros(count),
        A_eq=np.column_stack([J.T / size, np.zeros(pose.arm.nv)]),
        b_eq=-pose.gravity_torque / size,
        bounds=[*[(20.0, None)] * count, (0.0, None)],
    )
    bound = float(found.x[-1])
    assert cdsm.distribute_tension(pose, 20.0, bound * (1.0 + 1e-8)).values.max() <= bound * 1.1
    with pytest.raises(cdsm.InfeasibleTension) as caught:
        cdsm.distribute_tension(pose, 20.0, bound * (1.0 - 1e-8))
    assert 0.0 < abs(caught.value.missing).max() < 1e-6
    assert caught.value.relaxation == pytest.approx(1e-8 * bound, rel=1.0)


def test_a_slight_torque_that_no_cable_exerts_is_missing_all_the_same() -> None:
    """Less than HiGHS takes for nothing, 1e-7 of the largest, and more than is ever left over."""
    geometry = cdsm.Geometry(
        base_length=0.0,
        hole_radius=0.01,
        joints=(cdsm.Joint(axes=((0.0, 1.0, 0.0),), disk_offset=0.005),),
        links=(cdsm.Link(length=0.016, mass=0.0),),
        cables=(cdsm.CableRoute(joint=1, angle=0.0),),
    )
    pose = cdsm.Manipulator(geometry, STEEL).at([0.0])
    with pytest.raises(cdsm.InfeasibleTension) as caught:
        cdsm.distribute_tension(pose, minimum=1.0)
    np.testing.assert_allclose(caught.value.missing, -pose.gravity_torque, rtol=1e-9)


def test_a_solver_that_calls_the_infeasible_optimal_is_not_believed() -> None:
    """One cable for two axes: DAQP finds an optimum, which balances nothing."""
    sizes = {"link_length": 0.1, "base_length": 0.02, "disk_offset": 0.01, "hole_radius": 0.03}
    geometry = cdsm.Geometry.universal(joints=1, cables_per_joint=1, link_mass=0.1, **sizes)  # type: ignore[arg-type]
    for y, z in ((-0.0955, -0.4484), (0.1, 0.2), (-0.3, 0.05), (0.2, -0.6)):
        with pytest.raises(cdsm.InfeasibleTension):
            cdsm.distribute_tension(cdsm.Manipulator(geometry, STEEL).at([y, z]))


Lie = Callable[[qpsolvers.Solution], qpsolvers.Solution]


def point(solution: qpsolvers.Solution) -> Array:
    return np.array(solution.x, dtype=np.float64)


def with_x(solution: qpsolvers.Solution, x: Array | None) -> qpsolvers.Solution:
    solution.x = x
    return solution


def other_feasible(solution: qpsolvers.Solution) -> Array:
    """Another point that keeps bounds and balance, but is not the least."""
    _, _, rows = np.linalg.svd(np.asarray(solution.problem.A))
    step = rows[-1] if rows[-1].sum() > 0.0 else -rows[-1]
    return np.asarray(point(solution) + 1e-3 * step)


def without_duals(solution: qpsolvers.Solution, *names: str) -> qpsolvers.Solution:
    for name in names:
        setattr(solution, name, None)
    return solution


LIES: dict[str, Lie] = {
    "a bound is broken": lambda s: with_x(s, point(s) - 1e-3),
    "balance is broken": lambda s: with_x(s, point(s) * 1.001),
    "not the least": lambda s: with_x(s, other_feasible(s)),
    "NaN": lambda s: with_x(s, point(s) * NAN),
    "infinite": lambda s: with_x(s, point(s) + INF),
    "zero": lambda s: with_x(s, point(s) * 0.0),
    "no point": lambda s: with_x(s, None),
    "no multipliers": lambda s: without_duals(s, "y", "z", "z_box"),
    "no multipliers of the balance": lambda s: without_duals(s, "y"),
    "no multipliers of the bounds": lambda s: without_duals(s, "z_box"),
}


MENDABLE = ("balance is broken", "not the least")


"""Near the optimum, so that polishing finds it; what is returned is the optimum all the same."""


def test_every_optimality_condition_is_checked() -> None:
    A = POSE.length_jacobian.T
    low, high = np.full(A.shape[1], 10.0), np.full(A.shape[1], INF)
    problem = tension_kernels.Scaled(A / 0.01, -POSE.gravity_torque / 0.01, low, high, 0.01, 1.0)
    qp = qpsolvers.Problem(
        np.eye(low.size), np.zeros(low.size), A=problem.A, b=problem.b, lb=low, ub=high
    )
    solution = qpsolvers.solve_problem(qp, "daqp", primal_tol=1e-9)
    x, y, z = (np.asarray(each) for each in (solution.x, solution.y, solution.z_box))
    assert _shortfall(problem, (x, y, z)) == ""
    one = np.eye(low.size)[int(x.argmax())]  # a cable that is not at its bound
    for wrong in (
        (other_feasible(solution), y, z),  # not the least
        (x + 1e-3 * one, y, z),  # not balanced
        (x, y + 1e-3, z),  # multipliers of another point
        (x, y, z + 1e-3 * one),  # a multiplier of a bound that is not there
        (x, y, 2.0 * z),
    ):
        assert _shortfall(problem, wrong)
    # and as qpsolvers itself measures
    ours = tension_kernels.single_optimality(*problem[:4], x, y + 1e-3, z)
    solution.y = y + 1e-3
    theirs = (solution.primal_residual(), solution.dual_residual(), solution.duality_gap())
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-12)


def slightly_off(excess: float) -> tuple[tension_kernels.Scaled, tuple[Array, ...]]:
    """Two cables that share 10; the one has a little more, and multipliers that hide it.

    Constraints and stationarity hold exactly. The gap is 2e² + 9e; the optimum is √2 e away, but to
    know that one would have to know the optimum.
    """
    A, b = np.ones((1, 2)), np.array([10.0])
    problem = tension_kernels.Scaled(A, b, np.ones(2), np.full(2, 10.0), 1.0, 1.0)
    e = excess
    return problem, (np.array([5.0 - e, 5.0 + e]), np.array([-5.0]), np.array([e, -e]))


def test_duality_gap_bounds_the_distance_from_the_optimum() -> None:
    # √(2·9e) of 5: e from 1e-6 of it; rounding of a gap of 1e-11 is some 1e-14
    edge = (DISTANCE * 5.0) ** 2 / 18.0
    assert _shortfall(*slightly_off(0.9 * edge)) == ""
    assert "1.0e-06 away (1e-06 is allowed" in _shortfall(*slightly_off(1.1 * edge))


def test_what_is_missed_is_told_relative_to_the_largest_tension() -> None:
    problem, (x, y, z) = slightly_off(1.0)
    # 0.5 too much of 6.5; of the multipliers 1 is missing; the gap is 16 + 42.25 − 50 + 10 − 2.5
    said = _shortfall(problem, (x + np.array([0.0, 0.5]), y, z - np.array([0.0, 1.5])))
    for part in (
        f"balance and bounds are missed by {0.5 / 6.5:.1e}",
        f"stationarity by {1.0 / 6.5:.1e} (1e-09 is allowed)",
        f"may be {math.sqrt(2.0 * 15.75) / 6.5:.1e} away (1e-06 is allowed",
    ):
        assert part in said

    # and to 1 where all tensions are less: then the torque or the lower bounds set the scale
    small = problem._replace(b=0.1 * problem.b, low=0.1 * problem.low, high=0.1 * problem.high)
    said = _shortfall(small, (0.1 * x + np.array([0.0, 0.05]), 0.1 * y, 0.1 * z))
    assert "balance and bounds are missed by 5.0e-02" in said


def test_stationarity_is_asked_for_to_a_billionth_of_the_largest_tension() -> None:
    # two cables held at 5, so that multipliers of opposite sign leave no gap
    fixed = np.full(2, 5.0)
    problem = tension_kernels.Scaled(np.ones((1, 2)), np.array([10.0]), fixed, fixed, 1.0, 1.0)
    for part, accepted in ((0.9, True), (1.1, False)):
        off = part * OPTIMALITY * 5.0
        said = _shortfall(problem, (fixed, np.array([-5.0]), np.array([off, -off])))
        assert (said == "") == accepted


def test_gap_counts_a_small_multiplier_at_the_bound_it_belongs_to() -> None:
    # two cables that share 10, of which the first may pull 4.75: z = 5.25 − 4.75
    problem = tension_kernels.Scaled(
        np.ones((1, 2)), np.array([10.0]), np.ones(2), np.array([4.75, INF]), 1.0, 1.0
    )
    point = np.array([4.75, 5.25]), np.array([-5.25]), np.array([0.5, 0.0])
    assert tension_kernels.single_optimality(*problem[:4], *point) == (0.0, 0.0, 0.0)


def test_polishing_makes_a_near_optimum_the_optimum_at_either_bound() -> None:
    # the first cable may pull 4, the third has a weak arm and stands at 1; y = −6 frees the second
    A, b = np.array([[1.0, 1.0, 0.1]]), np.array([10.1])
    problem = tension_kernels.Scaled(A, b, np.ones(3), np.array([4.0, INF, INF]), 1.0, 1.0)
    x, y, z = np.array([4.0, 6.0, 1.0]), np.array([-6.0]), np.array([2.0, 0.0, -0.4])
    assert _shortfall(problem, (x, y, z)) == ""
    near = x + np.array([-1e-6, 2e-6, 1e-6]), y, z
    assert _shortfall(problem, near)
    for got, exact in zip(_polished(problem, near), (x, y, z), strict=True):
        np.testing.assert_allclose(got, exact, rtol=1e-15, atol=1e-15)


@pytest.fixture
def guessless(monkeypatch: pytest.MonkeyPatch) -> None:
    """No guess is proven optimal, so the solver is asked."""
    monkeypatch.setattr(distribution, "single_guess", lambda *_: (np.full(C, NAN), False))


@pytest.mark.usefixtures("guessless")
@pytest.mark.parametrize("lie", LIES)
def test_solver_that_calls_a_wrong_point_optimal_is_caught(
    lie: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    solve = qpsolvers.solve_problem
    truth = cdsm.distribute_tension(POSE, minimum=10.0).values

    def lying(problem: qpsolvers.Problem, solver: str, **options: Any) -> qpsolvers.Solution:
        solution = LIES[lie](solve(problem, solver, **options))
        solution.found = True
        return solution

    monkeypatch.setattr(qpsolvers, "solve_problem", lying)
    if lie in MENDABLE:
        np.testing.assert_allclose(
            cdsm.distribute_tension(POSE, minimum=10.0).values, truth, rtol=1e-12
        )
    else:
        with pytest.raises(cdsm.SolverError, match="solver 'daqp'") as caught:
            cdsm.distribute_tension(POSE, minimum=10.0, maximum=500.0)
        assert caught.value.solver == "daqp"
        if found := re.search(r"tensions of up to (\S+) N", str(caught.value)):
            assert 10.0 <= float(found[1]) <= 500.0


@pytest.mark.parametrize("seed", range(5))
def test_proven_guess_is_the_optimum_of_the_solver_and_the_tension_of_a_batch(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    pose = random_posture(ARM, seed)
    wrench = random_wrench(seed)
    batch = cdsm.distribute_tensions(ARM, [pose.q] * 3, 10.0, wrench=wrench).values[1]
    with monkeypatch.context() as patch:
        patch.setattr(distribution, "solve", lambda *_: pytest.fail("the guess is the optimum"))
        guessed = cdsm.distribute_tension(pose, 10.0, wrench=wrench).values
    assert guessed.tobytes() == batch.tobytes()
    monkeypatch.setattr(distribution, "single_guess", lambda *_: (np.full(C, NAN), False))
    solved = cdsm.distribute_tension(pose, 10.0, wrench=wrench).values
    np.testing.assert_allclose(guessed, solved, rtol=0.0, atol=1e-9 * solved.max())


def test_solver_that_raises_is_reported_with_its_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object, **__: object) -> qpsolvers.Solution:
        raise RuntimeError("out of cheese")

    monkeypatch.setattr(qpsolvers, "solve_problem", failing)
    with pytest.raises(cdsm.SolverError, match=r"'osqp' failed: out of cheese.*daqp") as caught:
        cdsm.distribute_tension(POSE, solver="osqp")
    assert isinstance(caught.value.__cause__, RuntimeError)


@pytest.mark.usefixtures("guessless")
def test_solver_that_finds_nothing_where_something_is_gets_the_blame(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def blind(problem: qpsolvers.Problem, *_: object, **__: object) -> qpsolvers.Solution:
        return qpsolvers.Solution(problem, found=False, x=np.full(C, 2143289344.0))

    monkeypatch.setattr(qpsolvers, "solve_problem", blind)
    with pytest.raises(cdsm.SolverError, match="though one exists") as caught:
        cdsm.distribute_tension(POSE, minimum=10.0)
    assert caught.value.solver == "daqp"
