"""Tension distribution: optimality, closed forms, infeasible bounds, and wrong solvers."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
import qpsolvers

import cdsm
from cdsm.support.values import Array
from tests.support.arms import (
    STEEL,
    random_arm,
    random_posture,
    random_wrench,
)

ARM = random_arm(1, 3)
POSE = random_posture(ARM, 1)
NAN, INF = math.nan, math.inf


def torque_of(pose: cdsm.Posture, wrench: Array) -> Array:
    """τ of Eq. 13: what the cables have to exert."""
    return wrench @ pose.jacobian - pose.gravity_torque


def refused(
    pose: cdsm.Posture, low: Array, high: Array, wrench: Array, solver: str = "daqp"
) -> cdsm.InfeasibleTension:
    with pytest.raises(cdsm.InfeasibleTension) as caught:
        cdsm.distribute_tension(pose, low, high, wrench, solver)
    return caught.value


@pytest.mark.parametrize("seed", range(4))
def test_bounds_too_tight_say_what_is_missing_and_how_far_to_widen(seed: int) -> None:
    pose = random_posture(random_arm(seed, 3), seed)
    count = len(pose.arm.cables)
    low = np.random.default_rng(seed).uniform(5.0, 30.0, count)
    high = low + 0.5
    wrench = random_wrench(seed)
    error = refused(pose, low, high, wrench)
    assert 0.0 < error.relaxation < INF
    assert set(error.binding) <= {cable.name for cable in pose.arm.cables}
    assert "lower minimum" in str(error)
    assert "raise maximum" in str(error)

    advice = re.search(r"Widening every bound by (\S+) N would be enough", str(error))
    assert advice is not None
    enough = float(advice[1])
    assert enough == pytest.approx(error.relaxation, rel=1e-3)
    pull = cdsm.distribute_tension(pose, np.maximum(low - enough, 0.0), high + enough, wrench)
    assert abs(pull.residual).max() < 1e-9
    less = 0.9 * error.relaxation
    refused(pose, np.maximum(low - less, 0.0), high + less, wrench)


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
    for part in ("No bounds would help", "Change the posture, the load, or the routing"):
        assert part in str(error)


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


def hinge(pairs: int = 1) -> cdsm.Posture:
    """One joint with pairs of cables at either side, straight, heavy only by its load."""
    geometry = cdsm.Geometry(
        base_length=0.0,
        hole_radius=0.01,
        joints=(cdsm.Joint(axes=((0.0, 1.0, 0.0),), disk_offset=0.005),),
        links=(cdsm.Link(length=0.016, mass=0.0),),
        cables=tuple(
            cdsm.CableRoute(joint=1, angle=angle)
            for angle in (0.5 * np.pi, -0.5 * np.pi)
            for _ in range(pairs)
        ),
    )
    return cdsm.Manipulator(geometry, STEEL).at([0.0])


def test_closed_form_of_a_hinge() -> None:
    """The pulling side carries the torque above the bound of the other; twins share it."""
    for pairs in (1, 2, 3):
        pose = hinge(pairs)
        wrench = np.array([0.0, 0.0, 0.0, 0.0, 0.4, 0.0])
        torque, J = torque_of(pose, wrench)[0], pose.length_jacobian[:, 0]
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


def lie(solution: qpsolvers.Solution, how: str) -> qpsolvers.Solution:
    """Spoil a solution; the solver calls it found."""
    x = np.array(solution.x, dtype=np.float64)
    null = np.linalg.svd(POSE.length_jacobian.T)[2][-1]
    spoiled = {
        "balance is broken": x * 1.001,
        "not the least": x + 1e-3 * null,
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


@pytest.mark.parametrize("how", ["balance is broken", "not the least"])
def test_a_point_near_the_optimum_is_corrected(how: str, monkeypatch: pytest.MonkeyPatch) -> None:
    solve, truth = qpsolvers.solve_problem, cdsm.distribute_tension(POSE, minimum=10.0).values
    monkeypatch.setattr(qpsolvers, "solve_problem", lambda *a, **k: lie(solve(*a, **k), how))
    found = cdsm.distribute_tension(POSE, minimum=10.0).values
    np.testing.assert_allclose(found, truth, rtol=1e-12)


@pytest.mark.parametrize(
    "how", ["NaN", "infinite", "no point", "no multipliers", "multipliers of another point"]
)
def test_solver_that_calls_a_wrong_point_optimal_is_caught(
    how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    solve = qpsolvers.solve_problem
    monkeypatch.setattr(qpsolvers, "solve_problem", lambda *a, **k: lie(solve(*a, **k), how))
    with pytest.raises(cdsm.CdsmError, match=r"'daqp'.*though one exists") as caught:
        cdsm.distribute_tension(POSE, minimum=10.0, maximum=500.0)
    assert caught.value.status == "SOLVER_FAILED"
    found = re.search(r"tensions of up to (\S+) N", str(caught.value))
    assert found is not None
    assert 10.0 <= float(found[1]) <= 500.0


def test_the_rule_that_is_too_narrow_is_named() -> None:
    cables = [replace(ARM.cables[0], minimum=50.0), *ARM.cables[1:]]
    pose = ARM.with_cables(cables).at(POSE.q)
    own = r"40 N \(maximum\) for \S+ is below 50 N \(the cable's own minimum\)"
    with pytest.raises(cdsm.InvalidInput, match=own):
        cdsm.distribute_tension(pose, 0.0, 40.0)
    weak = ARM.with_cables([replace(each, maximum=30.0) for each in ARM.cables]).at(POSE.q)
    own = r"30 N \(the cable's own maximum\) for \S+ is below 40 N \(minimum\)"
    with pytest.raises(cdsm.InvalidInput, match=own):
        cdsm.distribute_tension(weak, 40.0)
    with pytest.raises(cdsm.InvalidInput, match=r"3 N \(maximum\) for \S+ is below 5 N"):
        cdsm.distribute_tension(POSE, 5.0, 3.0)
    with pytest.raises(cdsm.InvalidInput, match=r"minimum: -1 N given for .*; cables only pull"):
        cdsm.distribute_tension(POSE, -1.0)
