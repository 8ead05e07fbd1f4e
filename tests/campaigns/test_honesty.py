"""The honesty benchmark in small, and its truth held against closed forms and differences."""

import numpy as np
import pytest

import cdsm
from cdsm.support.values import Array
from tests.benchmarks import honesty
from tests.benchmarks.exact import (
    EXTENDED,
    ExactArm,
    _gauss,
    eq19,
    eq19_strain,
    least_tension,
    smallest_eigenvalue,
    wide,
)
from tests.benchmarks.questions import FAMILIES
from tests.benchmarks.verdicts import (
    Outcome,
    Pull,
    Reading,
    judge_stiffness,
    judge_tension,
    true_stiffness,
    true_tension,
)
from tests.support import arms
from tests.support.differences import assert_second_order

pytestmark = pytest.mark.skipif(not EXTENDED, reason="long double is no longer than double here")


def test_cdsm_gives_no_wrong_answer_unflagged_and_naive_routes_do() -> None:
    tally = honesty.count(300, seed=7)
    assert tally.wrong == []
    for route in honesty.OURS:
        assert tally.total(route) == 300
        assert tally.total(route, Outcome.WRONG) == 0
        # a library that refuses or evades everything is honest, and no use
        assert tally.total(route, Outcome.RIGHT) > 250
    for route in {*honesty.TENSION, *honesty.STIFFNESS} - {*honesty.OURS}:
        assert tally.total(route, Outcome.WRONG) > 0.2 * tally.total(route)


# --- the truth ------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["universal", "hinged"])
def test_exact_derivatives_are_those_of_exact_lengths_places_and_energy(kind: str) -> None:
    arm = arms.random_arm(3, 3, kind)
    exact, q = ExactArm(arm.geometry, arm.gravity), arms.random_posture(arm, 3).q
    motion = exact.at(q)

    def lengths(q: Array) -> Array:
        return exact.at(q).lengths.astype(np.float64)

    def slopes(q: Array) -> Array:
        motion = exact.at(q)
        parts = (motion.slopes.ravel(), motion.torque, motion.jacobian.ravel())
        return np.concatenate(parts).astype(np.float64)

    nv = arm.nv
    bends = (motion.bends.reshape(-1, nv), motion.gravity, motion.turning.reshape(-1, nv))
    assert_second_order(lengths, motion.slopes.astype(np.float64), q)
    assert_second_order(slopes, np.concatenate(bends).astype(np.float64), q)


def test_exact_weight_is_that_of_a_pendulum() -> None:
    geometry = cdsm.Geometry.hinged(
        joints=1,
        twist=0.0,
        link_length=0.05,
        base_length=0.02,
        disk_offset=0.01,
        hole_radius=0.03,
        link_mass=0.4,
    )
    motion = ExactArm(geometry, np.array([0.0, 0.0, -9.81])).at(np.array([0.3]))
    # a turn about y lowers the link: V = −m g (l/2) sin q
    moment = 0.4 * 9.81 * 0.025
    np.testing.assert_allclose(motion.torque.astype(float), [-moment * np.cos(0.3)], rtol=1e-15)
    np.testing.assert_allclose(motion.gravity.astype(float), [[moment * np.sin(0.3)]], rtol=1e-15)


def test_proofs_of_least_tension_are_those_of_problems_solved_by_hand() -> None:
    A, b = wide([[1.0, -1.0, 0.0]]), wide([1.0])
    low, high = wide([0.5, 0.5, 0.25]), wide([2.0, np.inf, 1.0])
    found = least_tension(A, b, low, high)
    assert found.values is not None
    np.testing.assert_allclose(found.values.astype(float), [1.5, 0.5, 0.25], rtol=1e-15)
    # one millionth of a thousandth too little: proven all the same, to the digit
    short = least_tension(A, b, low, wide([1.5 - 1e-9, np.inf, 1.0]))
    assert short.values is None
    assert short.missing == pytest.approx(1e-9, rel=1e-6)


def test_smallest_eigenvalue_is_that_of_a_matrix_with_known_ones() -> None:
    rng = np.random.default_rng(3)
    V = wide(np.linalg.qr(rng.normal(size=(5, 5)))[0])
    for _ in range(3):
        V = V @ (3 * wide(np.eye(5)) - V.T @ V) / 2
    for least in (1e-14, -1e-14):
        values = wide([least, 1.0, 1.0, 2.0, 700.0])
        assert float(smallest_eigenvalue((V * values) @ V.T)) == pytest.approx(least, rel=1e-4)


def test_eq19_of_the_truth_is_that_of_the_strand() -> None:
    F = np.array([2.3, 15.0, 29.0, 33.0, 400.0, 810.0])
    np.testing.assert_allclose(
        eq19(F).astype(float), cdsm.presets.STRAND_1X19.rigidity(F), rtol=1e-9
    )
    # the coefficients of float64 are those decimal digits to 1e-16, which cancel down to EA
    np.testing.assert_allclose(
        eq19_strain(F).astype(float), cdsm.presets.STRAND_1X19.strain(F), rtol=1e-11
    )


def test_strain_of_the_truth_is_that_of_any_division_into_panels() -> None:
    F = np.array([2.2001, 2.3, 7.0, 31.0, 60.0, 810.0])
    fine = []
    for tension in F:
        edges = np.concatenate(
            [
                np.geomspace(2.2, min(tension, 31.0), 200),
                np.linspace(31.0, tension, 200) if tension > 31.0 else [],
            ]
        )
        fine.append(_gauss(wide(edges[:-1]), wide(edges[1:])).sum())
    np.testing.assert_allclose((eq19_strain(F) / wide(fine) - 1).astype(float), 0.0, atol=1e-16)


# --- the judge ------------------------------------------------------------------------------


def test_the_judge_notices_every_kind_of_wrong_stiffness() -> None:
    group = FAMILIES["edge of buckling"](np.random.default_rng(1))
    readings = honesty.single_stiffness(group)
    row = next(i for i, each in enumerate(readings) if each.compliance is not None)
    reading, truth = readings[row], true_stiffness(group, group.exact.at(group.q[row]), row)
    assert truth is not None
    assert reading.joint is not None
    assert reading.margin is not None
    assert reading.along is not None
    assert reading.compliance is not None
    assert judge_stiffness(truth, reading).outcome is Outcome.RIGHT
    for wrong, what in (
        (reading._replace(joint=reading.joint + 1e-8 * truth.size), "K_θ"),
        (reading._replace(margin=reading.margin + 1e-8 * truth.size), "margin"),
        (reading._replace(stable=not reading.stable), "stable"),
        (reading._replace(compliance=reading.compliance * (1 + 1e-5)), "compliance"),
        (reading._replace(along=reading.along * (1 + 1e-5)), "along"),
        (reading._replace(along=np.full(3, np.inf)), "along"),
        (reading._replace(along=np.full(3, np.nan)), "along"),
    ):
        verdict = judge_stiffness(truth, wrong)
        assert verdict.outcome is Outcome.WRONG, what
        assert what in verdict.what
    assert judge_stiffness(truth, Reading(flagged=True)).outcome is Outcome.REFUSED
    assert judge_stiffness(None, Reading(flagged=True)).outcome is Outcome.RIGHT
    assert judge_stiffness(None, reading).outcome is Outcome.WRONG


def test_the_judge_notices_every_kind_of_wrong_tension() -> None:
    group = FAMILIES["edge of feasibility"](np.random.default_rng(1))
    seen = set()
    for row, pull in enumerate(honesty.single_tension(group)):
        motion = group.exact.at(group.q[row])
        least, force = true_tension(group, motion, row)
        given = (group, motion, row, least, force)
        assert judge_tension(*given, pull).outcome in (Outcome.RIGHT, Outcome.CLOSE)
        if pull.values is not None:
            seen.add("feasible")
            for wrong in (pull.values + 1e-6 * force, pull.values * np.nan):
                assert judge_tension(*given, Pull(wrong)).outcome is Outcome.WRONG
            assert judge_tension(*given, Pull(None, True)).outcome is Outcome.WRONG
            assert judge_tension(*given, Pull(None)).outcome is Outcome.REFUSED
        elif least.missing > 1e-8:
            seen.add("infeasible")
            assert group.low is not None
            assert judge_tension(*given, Pull(group.low[row])).outcome is Outcome.WRONG
    assert seen == {"feasible", "infeasible"}
