"""Tension distribution: optimality, closed forms, infeasible bounds, and wrong solvers."""

import math
import re
import warnings
from concurrent import futures
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import qpsolvers

import cdsm
from cdsm import paper
from cdsm.support.values import Array
from tests.support.arms import STEEL, random_arm, random_posture, random_wrench, readme_geometry

ARM = random_arm(1, 3)
POSE = random_posture(ARM, 1)
NAN, INF = math.nan, math.inf


def refused(pose: cdsm.Posture, *bounds: Any, **options: Any) -> cdsm.InfeasibleTension:
    with pytest.raises(cdsm.InfeasibleTension) as caught:
        cdsm.distribute_tension(pose, *bounds, **options)
    return caught.value


# --- closed form ----------------------------------------------------------------------------


def hinge(*angles: float) -> cdsm.Posture:
    """One straight joint about y with cables in holes at these angles, heavy by a milligram."""
    geometry = cdsm.Geometry(
        base_length=0.0,
        hole_radius=0.01,
        joints=(cdsm.Joint(axes=((0.0, 1.0, 0.0),), disk_offset=0.005),),
        links=(cdsm.Link(length=0.016, mass=0.0),),
        cables=tuple(cdsm.CableRoute(joint=1, angle=angle) for angle in angles),
    )
    return cdsm.Manipulator(geometry, STEEL).at([0.0])


def test_closed_form_of_a_hinge() -> None:
    """The pulling side carries the torque above the bound of the other; twins share it."""
    for pairs in (1, 2, 3):
        pose = hinge(*[0.5 * np.pi] * pairs, *[-0.5 * np.pi] * pairs)
        wrench = np.array([0.0, 0.0, 0.0, 0.0, 0.4, 0.0])
        torque = (wrench @ pose.jacobian - pose.gravity_torque)[0]  # τ of Eq. 13
        J = pose.length_jacobian[:, 0]
        pulls = J * torque > 0.0
        pull = cdsm.distribute_tension(pose, 12.0, wrench=wrench)
        expected = np.where(pulls, 12.0 + abs(torque / J) / pairs, 12.0)
        np.testing.assert_allclose(pull.values, expected, rtol=1e-12)
        assert set(pull.at_minimum) == {pose.arm.cables[c].name for c in np.flatnonzero(~pulls)}
        # one cable that pulls is held fixed: the others carry what is left
        if pairs == 3:
            held = pose.arm.cables[int(pulls.argmax())].name
            fixed = cdsm.distribute_tension(pose, 12.0, wrench=wrench, fixed={held: 14.0})
            expected[pulls] += (expected[pulls] - 14.0) / 2.0
            expected[int(pulls.argmax())] = 14.0
            np.testing.assert_allclose(fixed.values, expected, rtol=1e-12)
            assert fixed[held] == 14.0


# --- bounds ---------------------------------------------------------------------------------


def test_what_was_asked_and_what_held_are_two_numbers() -> None:
    cables = [replace(ARM.cables[0], minimum=20.0, maximum=400.0), *ARM.cables[1:]]
    pose = ARM.with_cables(cables).at(POSE.q)
    fixed = {ARM.cables.names[1]: 60.0}
    pull = cdsm.distribute_tension(pose, 5.0, 500.0, fixed=fixed)
    np.testing.assert_array_equal(pull.minimum, 5.0)
    np.testing.assert_array_equal(pull.maximum, 500.0)
    assert pull.minimum_held[:3].tolist() == [20.0, 60.0, 5.0]
    assert pull.maximum_held[:3].tolist() == [400.0, 60.0, 500.0]
    assert set(pull.at_minimum) == {name for name in pull if pull[name] in (5.0, 20.0, 60.0)}


# --- what cannot be balanced ----------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_bounds_too_tight_say_what_is_missing_and_how_far_to_widen(seed: int) -> None:
    pose, wrench = random_posture(random_arm(seed, 3), seed), random_wrench(seed)
    low = np.random.default_rng(seed).uniform(5.0, 30.0, len(pose.arm.cables))
    high = low + 0.5
    error = refused(pose, low, high, wrench)
    assert 0.0 < error.relaxation < INF
    assert set(error.binding) <= {cable.name for cable in pose.arm.cables}
    advice = re.search(r"Widening every bound by (\S+) N would be enough", str(error))
    assert advice is not None
    enough, less = float(advice[1]), 0.9 * error.relaxation
    assert enough == pytest.approx(error.relaxation, rel=1e-3)
    pull = cdsm.distribute_tension(pose, np.maximum(low - enough, 0.0), high + enough, wrench)
    assert abs(pull.residual).max() < 1e-9
    refused(pose, np.maximum(low - less, 0.0), high + less, wrench)


@pytest.mark.parametrize(
    ("low", "high", "given"),
    [
        (5.0, 30.0, {"cable1_2": 40.0, "cable2_2": 45.0, "cable3_2": 50.0}),
        (60.0, 90.0, {"cable1_2": 70.0, "cable2_2": 2.5, "cable3_2": 65.0}),
        (5.0, 90.0, {"cable1_2": 300.0, "cable2_2": 10.0, "cable3_2": 10.0}),
    ],
)
def test_advice_widens_the_bounds_of_cables_that_are_not_fixed(
    low: float, high: float, given: dict[str, float]
) -> None:
    pose = paper.experimental_prototype().at(np.deg2rad([-12.0, -18.0, -20.0]))
    # one unknown per joint is left, so the widening it needs is known: solve it independently
    J = pose.length_jacobian
    load = -pose.gravity_torque - J[1::2].T @ np.array(list(given.values()))
    rest = np.linalg.solve(J[::2].T, load)
    assert rest.min() > 0.0
    needed = max(float((rest - high).max()), float((low - rest).max()))
    error = refused(pose, low, high, fixed=given)
    assert error.relaxation == pytest.approx(needed, rel=1e-9)
    assert not set(error.binding) & set(given)
    enough, less = needed * (1.0 + 1e-6), 0.9 * needed
    pull = cdsm.distribute_tension(pose, max(low - enough, 0.0), high + enough, fixed=given)
    np.testing.assert_array_equal(pull.values[1::2], list(given.values()))
    refused(pose, max(low - less, 0.0), high + less, fixed=given)


@pytest.mark.parametrize("others", [{}, {"cable1_1": 20.0, "cable1_2": 20.0}])
def test_no_widening_helps_where_the_fixed_tensions_alone_miss_the_balance(
    others: dict[str, float],
) -> None:
    pose = paper.experimental_prototype().at(np.zeros(3))
    # nothing but its own pair of cables reaches the last joint
    given = {"cable3_1": 20.0, "cable3_2": 60.0, **others}
    error = refused(pose, 5.0, 800.0, fixed=given)
    assert error.relaxation == math.inf
    assert set(error.fixed) == set(given)
    cdsm.distribute_tension(pose, 5.0, 800.0)  # without them there are some
    missing = (-pose.gravity_torque - pose.length_jacobian[4:].T @ [20.0, 60.0])[2]
    assert error.missing[2] == pytest.approx(missing, rel=1e-9)


@pytest.mark.parametrize(("maximum", "solver"), [(INF, "daqp"), (100.0, "osqp")])
def test_torque_the_cables_cannot_exert_at_all_has_no_relaxation(
    maximum: float, solver: str
) -> None:
    """One cable per universal joint: most torques are beyond it, whatever the tension."""
    pose = random_posture(cdsm.Manipulator(readme_geometry(cables_per_joint=1), STEEL), 4)
    error = refused(pose, 0.0, maximum, solver=solver)
    assert error.relaxation == INF
    assert "No bounds would help" in str(error)


def test_a_slight_torque_that_no_cable_exerts_is_missing_all_the_same() -> None:
    """Less than HiGHS takes for nothing, 1e-7 of the largest, and more than is ever left over."""
    pose = hinge(0.0)
    np.testing.assert_allclose(refused(pose, 1.0).missing, -pose.gravity_torque, rtol=1e-9)


def test_a_solver_that_calls_the_infeasible_optimal_is_not_believed() -> None:
    """One cable for two axes: DAQP finds an optimum, which balances nothing."""
    sizes = {"link_length": 0.1, "base_length": 0.02, "disk_offset": 0.01, "hole_radius": 0.03}
    sizes |= {"link_mass": 0.1, "lead": 0.0, "joint_limit": 0.64}
    geometry = readme_geometry(joints=1, cables_per_joint=1, **sizes)
    for q in ((-0.0955, -0.4484), (0.1, 0.2), (-0.3, 0.05), (0.2, -0.6)):
        refused(cdsm.Manipulator(geometry, STEEL).at(q))


# --- solvers that lie -----------------------------------------------------------------------


def lie(solution: qpsolvers.Solution, how: str) -> qpsolvers.Solution:
    """Spoil a solution; the solver calls it found."""
    x = np.array(solution.x, dtype=np.float64)
    spoiled: dict[str, Array | None] = {
        "balance is broken": x * 1.001,
        "not the least": x + 1e-3 * np.linalg.svd(POSE.length_jacobian.T)[2][-1],
        "NaN": x * NAN,
        "infinite": x + INF,
        "no point": None,
    }
    solution.found = True
    solution.x = spoiled.get(how, x)
    if how == "multipliers of another point":
        solution.y = np.asarray(solution.y)[::-1].copy()
    if how == "no multipliers":
        solution.y = None
    return solution


NEAR = ("balance is broken", "not the least")
FAR = ("NaN", "infinite", "no point", "no multipliers", "multipliers of another point")


@pytest.mark.parametrize("how", [*NEAR, *FAR])
def test_a_wrong_optimum_is_corrected_if_it_is_near_and_caught_if_not(
    how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    solve, truth = qpsolvers.solve_problem, cdsm.distribute_tension(POSE, 10.0, 500.0).values
    monkeypatch.setattr(qpsolvers, "solve_problem", lambda *a, **k: lie(solve(*a, **k), how))
    if how in NEAR:
        found = cdsm.distribute_tension(POSE, 10.0, 500.0).values
        np.testing.assert_allclose(found, truth, rtol=1e-12)
        return
    with pytest.raises(cdsm.CdsmError, match=r"'daqp'.*though one exists") as caught:
        cdsm.distribute_tension(POSE, 10.0, 500.0)
    assert caught.value.status == cdsm.Status.SOLVER_FAILED


def test_a_solver_that_breaks_down_does_not_hide_that_nothing_balances_the_arm(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def breaks_down(*_: object, **__: object) -> None:
        raise qpsolvers.SolverError("it broke down")

    monkeypatch.setattr(qpsolvers, "solve_problem", breaks_down)
    with pytest.raises(cdsm.CdsmError, match=r"'daqp' failed: it broke down, though one exists"):
        cdsm.distribute_tension(POSE, 10.0, 500.0)
    with pytest.raises(cdsm.InfeasibleTension):
        cdsm.distribute_tension(POSE, 10.0, 10.5)


def test_solvers_in_threads_leave_the_filters_of_warnings_as_they_were() -> None:
    before = list(warnings.filters)
    with futures.ThreadPoolExecutor(8) as pool:
        jobs = [
            pool.submit(cdsm.distribute_tension, POSE, 10.0 + k, 500.0, solver="osqp")
            for k in range(40)
        ]
        assert all(job.result().values.min() >= 10.0 for job in jobs)
    assert warnings.filters == before
