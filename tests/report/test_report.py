"""The report: it agrees where K_θ is right, differs where it is not, and says where it cannot."""

import json
import math
import re
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from scipy.optimize import OptimizeResult

import cdsm
from cdsm.report import Agreement, Report
from cdsm.report.differences import gradients, hessians
from cdsm.support.values import Array, frozen
from tests.interchange.test_caspr import toy
from tests.support import arms, foreign, locked
from tests.support.arms import readme_geometry

TERMS = ("active", "passive", "gravity", "load", "joint")


def named(report: Report, name: str) -> Agreement:
    return next(each for each in report.self_check.compared if each.name == name)


def virtual(law: cdsm.Elasticity = cdsm.presets.STRAND_1X19) -> cdsm.Posture:
    arm = cdsm.presets.virtual_prototype(law)
    return arm.at(np.full(arm.nv, np.deg2rad(10.0)))


def hybrid(seed: int, reach: float = 0.6) -> cdsm.Stiffness:
    """A random arm of all laws, springs and drives, its tensions not in balance."""
    kind = ("universal", "hinged")[seed % 2]
    arm = locked.hybrid(arms.random_arm(seed, 1 + seed % 4, kind), list(locked.LAWS.values()))
    pose = arms.random_posture(arm, seed, reach)
    wrench = arms.random_wrench(seed, moment=seed % 3 == 0)
    return cdsm.stiffness(pose, arms.random_tension(arm, seed), wrench=wrench)


# --- the self-check -------------------------------------------------------------------------


@settings(max_examples=20, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000), reach=st.sampled_from([0.0, 0.3, 0.9, 0.999]))
def test_right_stiffness_agrees_within_what_is_stated_and_to_a_millionth(
    seed: int, reach: float
) -> None:
    K = hybrid(seed, reach)
    report = K.report()
    assert report.self_check.passed, str(report.self_check)
    for each in report.self_check.compared:
        # the moment's load term has no potential; its torque has
        stated = [d for d in (each.potential, each.torque) if d is not None]
        assert stated
        assert all(d.found <= d.expected for d in stated)
        floor = 1e-8 * named(report, "joint").largest
        assert min(d.expected for d in stated) <= max(1e-6 * each.largest, floor)


@settings(max_examples=3, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000))
def test_every_wrong_term_is_found_and_named(seed: int) -> None:
    K = hybrid(seed)
    for term in TERMS:
        matrix = getattr(K, term)
        largest = np.unravel_index(abs(matrix).argmax(), matrix.shape)
        one = matrix.copy()
        one[largest] *= 1.0001
        for wrong in (1.0001 * matrix, -matrix, one):
            report = replace(K, **{term: frozen(wrong)}).report()
            assert named(report, term).verdict == "DIFFERS"
            assert not report.trustworthy
            assert any("Do not use this stiffness" in fault for fault in report.faults)


@pytest.mark.parametrize("term", TERMS)
def test_what_is_wrong_is_told_by_how_much(term: str) -> None:
    K = hybrid(1)  # no moment
    matrix = getattr(K, term)
    wrong = named(replace(K, **{term: frozen(1.01 * matrix)}).report(), term)
    for difference in (wrong.potential, wrong.torque):
        assert difference is not None
        assert abs(difference.found - 0.01 * abs(matrix).max()) <= difference.expected


def test_terms_that_do_not_add_up_are_noticed_however_small() -> None:
    K = cdsm.stiffness(virtual(), cdsm.distribute_tension(virtual(), 15.0))
    joint = K.joint + 1e-11 * abs(K.joint).max()  # far below what differences resolve
    found = named(replace(K, joint=frozen(joint)).report(), "joint")
    assert found.verdict == "DIFFERS"
    assert "not the sum" in found.reason


def test_cable_stiffness_that_is_not_that_of_the_passive_term_is_noticed() -> None:
    K = cdsm.stiffness(virtual(), cdsm.distribute_tension(virtual(), 15.0))
    found = named(
        replace(K, cable_stiffness=frozen((1.0 + 1e-9) * K.cable_stiffness)).report(), "passive"
    )
    assert found.verdict == "DIFFERS"
    assert "is not J_Lᵀ K_L J_L of its cables" in found.reason


@pytest.mark.parametrize("field", ["gravity_torque", "length_jacobian", "jacobian"])
def test_wrong_gradients_are_noticed_too(field: str) -> None:
    pose = arms.random_posture(arms.mixed_arm(), 2)
    tension, wrench = arms.random_tension(pose.arm, 2), arms.random_wrench(2)
    wrong = replace(pose, **{field: frozen(1.0001 * getattr(pose, field))})
    K = replace(cdsm.stiffness(pose, tension, wrench=wrench), posture=wrong)
    assert named(K.report(), "torque").verdict == "DIFFERS"


def test_wrong_lengths_are_noticed_too() -> None:
    pose = arms.random_posture(arms.mixed_arm(), 2)
    wrong = replace(pose, cable_lengths=frozen(pose.cable_lengths + 1e-9))
    K = replace(cdsm.stiffness(pose, arms.random_tension(pose.arm, 2)), posture=wrong)
    assert named(K.report(), "lengths").verdict == "DIFFERS"


def test_moment_has_no_potential_and_is_checked_by_the_torque() -> None:
    pose = virtual()
    pull = cdsm.distribute_tension(pose, 15.0, wrench=(0.0, 1.0, -2.0, 0.1, 0.2, 0.3))
    report = cdsm.stiffness(pose, pull).report()
    assert report.trustworthy
    for name in ("load", "joint"):
        assert named(report, name).potential is None
        assert named(report, name).torque is not None
    assert named(report, "passive").potential is not None
    assert any("moment at the tip has no potential" in note for note in report.notes)
    transposed = replace(report.stiffness, load=frozen(report.stiffness.load.T.copy()))
    assert named(transposed.report(), "load").verdict == "DIFFERS"


CRAB = foreign.crab(locked.TABLE)
TWELVE = cdsm.Manipulator(
    readme_geometry(joints=12, link_mass=0.05),
    cdsm.presets.STRAND_1X19,
)
SLIDING = cdsm.stiffness(CRAB.at(foreign.POSTURE), foreign.TENSION, wrench=arms.random_wrench(3))
STRAIGHT = cdsm.presets.virtual_prototype().at(np.zeros(10))
LONG = arms.random_posture(TWELVE, 1, 0.2)


@pytest.mark.parametrize(
    "K",
    [
        pytest.param(SLIDING, id="slides and branches"),
        pytest.param(cdsm.stiffness(LONG, cdsm.distribute_tension(LONG, 20.0)), id="12 joints"),
        pytest.param(
            cdsm.stiffness(STRAIGHT, cdsm.distribute_tension(STRAIGHT, 15.0)), id="straight"
        ),
        pytest.param(cdsm.stiffness(locked.hinge().at([0.2]), [30.0, 20.0]), id="one hinge"),
    ],
)
def test_arms_of_every_kind_agree(K: cdsm.Stiffness) -> None:
    report = K.report()
    assert report.self_check.passed, str(report.self_check)
    wrong = replace(K, active=frozen(1.0001 * K.active), passive=frozen(0.9999 * K.passive))
    verdicts = [each.verdict for each in wrong.report().self_check.terms]
    assert verdicts == ["DIFFERS", "DIFFERS", "agrees", "agrees", "DIFFERS"]


def test_caspr_model_agrees(tmp_path: Path) -> None:
    arm = toy(tmp_path)
    K = cdsm.stiffness(arm.at(np.full(arm.nv, 0.1)), np.full(len(arm.cables), 30.0))
    report = K.report()
    assert report.self_check.passed, str(report.self_check)
    assert report.cable_rank.rank < arm.nv
    assert any("cannot balance all" in note for note in report.notes)


def test_equilibrium_is_checked_with_the_free_lengths_of_its_reference() -> None:
    pose, pull = locked.balanced("universal-3-8-all", moment=False)
    load = np.array([0.0, 1.0, -3.0, 0.0, 0.0, 0.0])
    K = cdsm.equilibrium(pose, pull, pull.wrench + load).stiffness
    np.testing.assert_allclose(
        K.free_lengths, locked.original_lengths(pose, pull.values), rtol=1e-12
    )
    report = K.report()
    assert report.trustworthy, report.faults
    assert any("follow from an equilibrium" in note for note in report.notes)
    # those of the arm at rest are the same, the lengths under tension belong to other springs
    assert replace(K, free_length=None).report().trustworthy
    stretched = replace(K, free_length=K.posture.cable_lengths)
    assert named(stretched.report(), "passive").verdict == "DIFFERS"


def test_cable_that_an_equilibrium_leaves_slack_gives_nothing() -> None:
    pose = locked.hinge().at([0.0])
    K = cdsm.equilibrium(pose, [20.0, 20.0], 1.5 * locked.MOMENT).stiffness
    assert K.tension[1] == 0.0
    report = K.report()
    assert report.trustworthy, report.faults
    assert any("slack cables, 0 N: cable1_2" in note for note in report.notes)


# --- where there is no derivative -------------------------------------------------------------


OWN = cdsm.Elasticity.from_rigidity(lambda _: 1e5, 0.0, 500.0)


class Contradicting(cdsm.Elasticity):
    """A law with a fault: its rigidity or its energy is 0.1 % too large."""

    fault: str

    def __init__(self, fault: str) -> None:
        super().__init__(0.0, 500.0, 0.0, "", {"fault": fault}, 1.0, OWN._table)
        self.fault = fault

    def _evaluate(self, F: Array) -> tuple[Array, Array]:
        strain, EA = super()._evaluate(F)
        return strain, np.asarray(EA * (1.001 if self.fault == "rigidity" else 1.0))

    def energy(self, tension: ArrayLike) -> Array:
        return np.asarray(super().energy(tension)) * (1.001 if self.fault == "energy" else 1.0)


def with_one(pose: cdsm.Posture, tension: float) -> cdsm.Stiffness:
    """Balanced tensions but for the first cable."""
    F = cdsm.distribute_tension(pose, 15.0).values.copy()
    F[0] = tension
    return cdsm.stiffness(pose, F)


@pytest.mark.parametrize(
    ("law", "tension", "said"),
    [
        (cdsm.presets.STRAND_1X19, 810.0, "high end of its law [2.2 N, 810 N]"),
        (cdsm.presets.STRAND_1X19, 2.2 + 1e-9, "low end of its law [2.2 N, 810 N]"),
        (cdsm.LinearElasticity(48e3), 0.0, "slack (0 N), and K_θ counts it as if it were taut"),
    ],
)
def test_one_sided_law_is_no_agreement(law: cdsm.Elasticity, tension: float, said: str) -> None:
    report = with_one(virtual(law), tension).report()
    for name in ("passive", "joint"):
        found = named(report, name)
        assert found.verdict == "not possible"
        assert found.potential is found.torque is None
        assert said in found.reason
    # the rest does not depend on the law
    for name in ("active", "gravity", "load", "torque", "lengths"):
        assert named(report, name).verdict == "agrees"
    assert not report.trustworthy
    assert any(fault.startswith("self-check not possible") for fault in report.faults)
    json.dumps(report.to_dict(), allow_nan=False)
    assert "not possible" in str(report)


@pytest.mark.parametrize("tension", [31.05, 31.0, 30.9, 2.3, 800.0])
def test_beside_a_kink_or_an_end_the_check_still_resolves(tension: float) -> None:
    assert with_one(virtual(), tension).report().self_check.passed


@pytest.mark.parametrize(("fault", "size"), [("rigidity", 1e-3), ("energy", 1e-3)])
def test_law_that_contradicts_itself_is_found(fault: str, size: float) -> None:
    pose = virtual(Contradicting(fault))
    found = named(cdsm.stiffness(pose, cdsm.distribute_tension(pose, 15.0)).report(), "passive")
    assert found.verdict == "DIFFERS"
    assert found.potential is not None
    assert found.potential.found == pytest.approx(size * found.largest, rel=2e-3)
    sound = virtual(OWN)
    assert cdsm.stiffness(sound, cdsm.distribute_tension(sound, 15.0)).report().trustworthy


def test_segments_that_all_but_vanish_are_not_stepped_across() -> None:
    arm = locked.hinge()
    for reach in (0.99, 0.9999, 1.0 - 1e-6):  # holes R (1 − reach) apart, some nanometres at last
        report = cdsm.stiffness(arm.at(reach * arm.upper), [20.0, 20.0]).report()
        verdicts = {each.verdict for each in report.self_check.compared}
        assert "DIFFERS" not in verdicts, str(report.self_check)
    # at nanometres the lengths themselves have no digits left to difference
    assert cdsm.stiffness(arm.at(0.99 * arm.upper), [20.0, 20.0]).report().self_check.passed


# --- the differences --------------------------------------------------------------------------


def waves(places: Array) -> Array:
    x, y = places.T
    return np.stack([np.exp(x) * np.cos(2.0 * y), np.sin(3.0 * x + y)], axis=-1)


def test_differences_are_right_to_what_they_state() -> None:
    noise = np.full(2, 2e-16)
    first, off = gradients(waves, 2, 0.125, lambda h: noise)
    np.testing.assert_allclose(first, [[1.0, 0.0], [3.0, 1.0]], rtol=0.0, atol=1e-12)
    assert (abs(first - [[1.0, 0.0], [3.0, 1.0]]).max(axis=1) <= off).all()
    assert off.max() < 1e-11
    second, off = hessians(waves, 2, 0.125, lambda h: noise)
    exact = np.array([[[1.0, 0.0], [0.0, -4.0]], np.zeros((2, 2))])
    assert (abs(second - exact).max(axis=(1, 2)) <= off).all()
    assert off.max() < 1e-8


@pytest.mark.parametrize("at", [0.0, 1e-3, 0.03])
def test_kink_of_the_derivative_is_covered_by_the_stated_error(at: float) -> None:
    def bent(places: Array) -> Array:  # its second derivative has a corner
        x = places[:, :1]
        return x**2 + abs(x - at) ** 3

    second, off = hessians(bent, 1, 0.125, lambda h: np.array([1e-17]))
    assert abs(second[0, 0, 0] - 2.0 - 6.0 * at) <= off[0]


def test_what_has_no_limit_has_no_finite_error() -> None:
    def step(places: Array) -> Array:
        return np.sign(places[:, :1])

    _, off = gradients(step, 1, 0.125, lambda h: np.array([1e-16]))
    assert math.isinf(off[0])


def test_steps_out_of_a_domain_are_left_out_and_the_reason_kept() -> None:
    def narrow(width: float) -> Any:
        def f(places: Array) -> Array:
            if abs(places).max() > width:
                raise cdsm.InvalidInput("x", "is too far.")
            return np.sin(places[:, :1])

        return f

    first, _ = gradients(narrow(0.02), 1, 0.125, lambda h: np.array([1e-16]))
    assert first[0, 0] == pytest.approx(1.0, abs=1e-12)
    with pytest.raises(cdsm.InvalidInput, match="is too far"):
        gradients(narrow(0.0), 1, 0.125, lambda h: np.array([1e-16]))


# --- balance and optimality -------------------------------------------------------------------


@pytest.mark.parametrize("solver", ["daqp", "osqp", "clarabel"])
def test_distributed_tensions_are_found_optimal(solver: str) -> None:
    geometry = replace(
        cdsm.presets.virtual_prototype_geometry(),
        cables=tuple(
            cdsm.CableRoute(joint=k, angle=0.3 * k + 2.0 * math.pi * i / 5)
            for k in range(1, 6)
            for i in range(5)
        ),
    )
    pose = cdsm.Manipulator(geometry, cdsm.presets.STRAND_1X19).at(np.full(10, 0.17))
    free = cdsm.distribute_tension(pose, 15.0)
    first = free.values.argmax()
    capped = np.where(np.arange(25) == first, 0.95 * free.values, np.inf)
    pull = cdsm.distribute_tension(pose, 15.0, capped, solver=solver)
    report = cdsm.stiffness(pose, pull).report()
    found = report.optimality
    assert found is not None
    assert found.optimal
    assert found.stationarity is not None
    assert max(found.feasibility, found.stationarity) < 1e-9
    assert found.at_minimum == pull.at_minimum
    assert found.at_maximum == pull.at_maximum == (pose.arm.cables[first].name,)
    assert report.trustworthy, report.faults


def test_balanced_tensions_that_are_not_the_least_are_found() -> None:
    pose = virtual()
    pull = cdsm.distribute_tension(pose, 15.0)
    more = cdsm.distribute_tension(pose, 20.0).values
    given = replace(pull, values=more)
    report = cdsm.stiffness(pose, given).report()
    assert report.imbalance < 1e-12
    assert report.optimality is not None
    assert report.optimality.stationarity is not None
    assert report.optimality.stationarity > 1e-3
    assert [fault for fault in report.faults if "of daqp are not optimal" in fault]
    # bare, they claim nothing
    bare = cdsm.stiffness(pose, more).report()
    assert bare.optimality is None
    assert bare.trustworthy, bare.faults
    assert "given, not distributed" in bare.notes[0]


def test_stationarity_is_that_of_the_closed_form() -> None:
    """Two cables on one hinge, F = (1, 1) T: −F = λ a with a = (1, −1) leaves T both ways."""
    pose = locked.hinge().at([0.0])
    pull = cdsm.distribute_tension(pose, 10.0)
    np.testing.assert_allclose(pull.values, 10.0, rtol=1e-12)
    lax = replace(pull, minimum=frozen(np.array([5.0, 5.0])))
    found = cdsm.stiffness(pose, lax).report().optimality
    assert found is not None
    assert found.at_minimum == ()
    # in units of the larger of the bound and one: 10/8 of the next power of two, over itself
    assert found.stationarity == pytest.approx(1.0, rel=1e-12)


def test_tensions_out_of_balance_are_a_fault_with_the_joint_and_the_torque() -> None:
    pose = locked.hinge().at([0.0])
    report = cdsm.stiffness(pose, [30.0, 20.0]).report()
    # arms of R both ways
    assert report.residual == pytest.approx(10.0 * locked.R, rel=1e-12)
    assert report.imbalance == pytest.approx(10.0 / 50.0, rel=1e-12)
    assert report.self_check.passed
    assert not report.trustworthy
    assert "the residual is 0.3 N m at joint1" in report.faults[0]


def test_joints_that_slide_are_compared_by_their_lever_where_balance_is_missed() -> None:
    # out of balance by 84.7 N at f, the largest number; by more torque, 66.7 N m, at a
    K = cdsm.stiffness(
        foreign.crab().at(foreign.POSTURE), foreign.TENSION, wrench=(0, 0, 0, 0, 75.0, 0)
    )
    arm = K.posture.arm
    assert arm.joint_names[int(abs(K.residual).argmax())] == "f"
    report = K.report()
    assert (report.residual_joint, report.residual) == ("a", abs(K.residual[0]))
    assert abs(K.residual[5]) * arm.length < report.residual
    assert "N m at a," in next(each for each in report.faults if "balance" in each)


# --- ranks, stability, laws, readings ---------------------------------------------------------


@pytest.mark.parametrize("angle", [0.0, 0.2, -0.3])
def test_closure_of_a_pair_is_the_ratio_of_its_moment_arms(angle: float) -> None:
    report = cdsm.stiffness(locked.hinge().at([angle]), [20.0, 20.0]).report()
    above, below = locked.half(1.0, angle)[1], -locked.half(-1.0, angle)[1]
    assert report.closure == pytest.approx(min(above, below) / max(above, below), rel=1e-9)
    assert (report.cable_rank.rank, report.cable_rank.full) == (1, 1)


def test_cables_that_all_pull_one_way_close_nothing() -> None:
    arm = locked.hinge()
    above = replace(arm.cables[0], name="again")
    report = cdsm.stiffness(arm.with_cables([arm.cables[0], above]).at([0.0]), [9.0, 9.0]).report()
    assert report.closure == 0.0
    assert any("cannot all be pretensioned" in note for note in report.notes)


def test_report_says_that_a_closure_is_not_known(monkeypatch: pytest.MonkeyPatch) -> None:
    def failed(*given: Any, **options: Any) -> OptimizeResult:
        return OptimizeResult(status=4, message="numerical difficulties")

    monkeypatch.setattr("cdsm.tension.ratio.least", failed)
    report = cdsm.stiffness(locked.hinge().at([0.0]), [20.0, 20.0]).report()
    assert "grow without a torque is not known: HiGHS failed" in str(report)
    assert report.to_dict()["closure"] is None
    assert not any("pretensioned" in note for note in report.notes)


def test_straight_arm_has_the_ranks_of_a_straight_arm() -> None:
    report = cdsm.stiffness(STRAIGHT, cdsm.distribute_tension(STRAIGHT, 15.0)).report()
    # y, z and the turns about them
    assert (report.jacobian_rank.rank, report.jacobian_rank.full) == (4, 6)
    assert (report.translation_rank.rank, report.translation_rank.full) == (2, 3)
    assert math.isinf(report.translation_rank.condition)
    assert report.readings is not None
    assert math.isinf(report.readings.along[0])
    assert np.isnan(report.readings.cartesian).all()
    told = report.to_dict()
    assert told["readings_N_per_m"]["along"][0] is None  # type: ignore[index]
    assert told["rank"]["translation"]["condition"] is None  # type: ignore[index]
    assert report.trustworthy, report.faults


def test_condition_does_not_depend_on_the_unit_of_length() -> None:
    def conditions(scale: float) -> list[float]:
        sizes: dict[str, Any] = {
            "joints": 4,
            "cables_per_joint": 3,
            "link_mass": 0.0,
            **{
                key: scale * value
                for key, value in (
                    ("link_length", 0.05),
                    ("base_length", 0.02),
                    ("disk_offset", 0.01),
                    ("hole_radius", 0.02),
                )
            },
        }
        arm = cdsm.Manipulator(cdsm.Geometry.universal(**sizes), arms.STEEL)
        report = cdsm.stiffness(arm.at(np.full(8, 0.1)), np.full(12, 20.0)).report()
        ranks = (report.jacobian_rank, report.translation_rank, report.cable_rank)
        return [rank.condition for rank in ranks]

    np.testing.assert_allclose(conditions(1.0), conditions(1000.0), rtol=1e-9)


def test_unstable_arm_is_not_trusted_and_its_margin_is_that_of_the_closed_form() -> None:
    pose = locked.soft_hinge().at([0.0])
    for push, stands in ((15.0, True), (30.0, False)):
        pull = cdsm.distribute_tension(pose, 20.0, wrench=(-push, 0.0, 0.0, 0.0, 0.0, 0.0))
        report = cdsm.stiffness(pose, pull).report()
        assert report.self_check.passed
        # 2 (EA + F) R²/(lead + 2h) − F h − P ℓ
        assert report.margin == pytest.approx(1.8 - 0.2 - push * locked.LENGTH, rel=1e-12)
        assert report.trustworthy is stands
        assert any("UNSTABLE" in fault for fault in report.faults) is not stands
        assert any("joint1 most" in fault for fault in report.faults) is not stands


def test_arm_without_any_stiffness_has_a_report() -> None:
    arm = locked.hinge()
    held = arm.with_cables([replace(cable, control="force") for cable in arm.cables])
    report = cdsm.stiffness(held.at([0.0]), [0.0, 0.0]).report()
    assert report.readings is None
    assert report.margin == 0.0
    assert not report.trustworthy
    assert any("there is no stiffness at the tip" in note for note in report.notes)
    json.dumps(report.to_dict(), allow_nan=False)


def test_cables_stand_where_their_law_says() -> None:
    law = cdsm.presets.STRAND_1X19
    report = with_one(virtual(law), 30.0).report()
    first = report.cables[0]
    assert first.tangent == law.rigidity(30.0)
    assert first.secant == law.secant_rigidity(30.0)
    assert (first.below, first.above) == (30.0 - 2.2, 810.0 - 30.0)
    assert first.stiffness == report.stiffness.cable_stiffness[0]
    assert any(
        "high end of their law: cable1_1" in n for n in with_one(virtual(), 790.0).report().notes
    )
    assert any(
        "low end of their law: cable1_1" in n for n in with_one(virtual(), 2.3).report().notes
    )


def test_force_controlled_cables_are_named_and_may_be_outside_their_law() -> None:
    arm = cdsm.presets.experimental_prototype()
    held = [cable.name for cable in arm.cables if cable.control == "force"]
    pose = arm.at([0.1, 0.2, -0.1])
    F = np.where([cable.control == "force" for cable in arm.cables], 900.0, 30.5)
    report = cdsm.stiffness(pose, F).report()
    assert report.self_check.passed
    assert f"force-controlled, no passive stiffness: {', '.join(held)}." in report.notes
    assert [each.tangent is None for each in report.cables] == [False, True] * 3


def test_readings_are_those_of_the_stiffness_and_the_spread_is_told() -> None:
    pose = virtual()
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 15.0))
    report = K.report()
    assert report.readings is not None
    np.testing.assert_array_equal(report.readings.along, [K.along(u) for u in np.eye(3)])
    np.testing.assert_array_equal(report.readings.cartesian, np.diag(K.cartesian))
    np.testing.assert_array_equal(report.readings.pseudoinverse, np.diag(K.pseudoinverse()))
    ratio = np.diag(K.pseudoinverse()) / [K.along(u) for u in np.eye(3)]
    np.testing.assert_allclose(report.readings.spread, ratio, rtol=1e-12)
    note = next(note for note in report.notes if "pseudoinverse differ" in note)
    assert "in x, y, z, by up to 8.87 times: use along" in note


# --- how it shows -----------------------------------------------------------------------------


def test_a_page_loads_nothing_and_escapes_names() -> None:
    arm = locked.hinge()
    evil = [replace(arm.cables[0], name="<script>&"), replace(arm.cables[1], control="force")]
    pose = arm.with_cables(evil).at([0.1])
    page = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 20.0)).report().to_html()
    assert page.startswith("<!DOCTYPE html>")
    assert "<script" not in page
    assert "http" not in page


def test_dict_holds_every_field() -> None:
    K = hybrid(3)
    told = K.report().to_dict()
    assert json.loads(json.dumps(told, allow_nan=False)) == told
    check = told["self_check"]
    assert isinstance(check, dict)
    assert [term["name"] for term in check["terms"]] == [*TERMS, "torque", "lengths"]
    assert set(check["terms"][0]) == {field.name for field in fields(Agreement)}
    assert len(told["cables"]) == len(K.tension)  # type: ignore[arg-type]
    assert told["optimality"] is None
    assert told["trustworthy"] is False  # not in balance


# --- what a stranger stumbled over --------------------------------------------------------------


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000))
def test_table_that_bends_at_each_of_its_points_is_no_reason_for_distrust(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.cumsum([0.0, *rng.uniform(0.5, 5.0, 60)])
    strains = np.cumsum([0.0, *np.diff(0.01 * np.log1p(points / 10.0)) * rng.uniform(1.0, 1.3, 60)])
    law = cdsm.TabulatedElasticity(tuple(points), tuple(strains))
    arm = arms.random_arm(seed, 1 + seed % 4, ("universal", "hinged")[seed % 2], law)
    K = cdsm.stiffness(arms.random_posture(arm, seed), rng.uniform(15.0, 60.0, len(arm.cables)))
    for each in K.report().self_check.compared:
        assert each.verdict != "DIFFERS", each.reason


@pytest.mark.slow
def test_planned_tensions_are_not_asked_to_be_the_least() -> None:
    pose = virtual()
    attainable = cdsm.stiffness_range(pose, (0.0, 0.0, 1.0), 15.0, 300.0)
    target = 0.5 * (attainable.low + attainable.high)
    plan = cdsm.plan_stiffness(pose, (0.0, 0.0, 1.0), target, 15.0, 300.0)
    assert not plan.tension.least
    report = plan.stiffness.report()
    assert report.trustworthy, report.faults
    assert report.optimality is not None
    assert report.optimality.stationarity is None
    assert report.optimality.feasibility < 1e-12
    assert "the tensions were chosen for a stiffness: they are not the least." in report.notes
    assert "Tensions, chosen for a stiffness within their bounds" in str(report)
    assert "KKT" not in str(report)
    told: Any = report.to_dict()
    assert told["optimality"]["stationarity"] is None
    # but to balance the arm within the bounds
    off = replace(plan.tension, values=1.001 * plan.tension.values)
    (_, fault) = cdsm.stiffness(pose, off).report().faults
    assert "of daqp are not optimal" in fault
    assert "stationarity" not in fault


def test_what_slides_is_told_in_metres_and_every_number_has_its_unit() -> None:
    arm = foreign.crab()
    K = cdsm.stiffness(arm.at(foreign.POSTURE), foreign.TENSION)
    told: Any = K.report().to_dict()
    sliding = {arm.joint_names[i] for i in np.flatnonzero(arm.slides)}
    assert set(told["conventions"]["ways_m"]) == sliding
    assert not set(told["conventions"]["angles_rad"]) & sliding
    units = {each["name"]: each["unit"] for each in told["self_check"]["terms"]}
    assert units == {**dict.fromkeys(TERMS, "N m/rad"), "torque": "N m", "lengths": "m"}
    # nothing pulls, nothing weighs
    bare = cdsm.Manipulator(arms.random_arm(1, 1).geometry, arms.STEEL, gravity=(0.0, 0.0, 0.0))
    slack = cdsm.stiffness(bare.at(np.zeros(2)), np.zeros(len(bare.cables))).report()
    assert named(slack, "torque").largest == 0.0
    row = next(line for line in str(slack).splitlines() if line.startswith("  torque "))
    assert "N m/rad" not in row
    wrong = replace(K, passive=frozen(1.001 * K.passive)).report()
    assert re.search(r"off by \S+ N m/rad, with \S+ N m/rad its largest", wrong.faults[0])


def test_arm_written_in_millimetres_is_noticed() -> None:
    arm = cdsm.Manipulator(
        cdsm.Geometry.hinged(
            joints=1,
            twist=0.0,
            link_length=60.0,
            base_length=0.0,
            disk_offset=8.0,
            hole_radius=25.0,
            link_mass=0.1,
        ),
        arms.STEEL,
    )
    report = cdsm.stiffness(arm.at([0.1]), np.full(2, 50.0)).report()
    assert [note for note in report.notes if "60 m: it looks as if lengths are in mm" in note]
