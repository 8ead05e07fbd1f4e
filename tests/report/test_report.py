"""The report: it passes where K_θ is right, fails where it is not, and says where it cannot."""

import json
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike

import cdsm
from cdsm.definition import TERMS_OF_K
from cdsm.stiffness_matrix import Report
from cdsm.support.values import Array, frozen
from tests.support import arms, foreign, locked
from tests.support.printed import Printed, require_all, table
from tests.support.sweeps import short_arm

STRAND = cdsm.presets.STRAND_1X19
TERMS = (*TERMS_OF_K, "joint")
EVERY = (*TERMS, *(f"{name} torque" for name in TERMS_OF_K), "batch")


def having(report: Report, verdict: str) -> set[str]:
    return {each.name for each in report.comparisons if each.verdict == verdict}


def with_matrix(K: cdsm.Stiffness, name: str, matrix: Array) -> cdsm.Stiffness:
    if name == "joint":
        return replace(K, joint=frozen(matrix))
    return replace(K, terms={**K.terms, name: frozen(matrix)})


def with_one(pose: cdsm.Posture, tension: float) -> cdsm.Stiffness:
    """Balanced tensions but for the first cable."""
    F = cdsm.distribute_tension(pose, 15.0).values.copy()
    F[0] = tension
    return cdsm.stiffness(pose, F)


def hybrid(seed: int, reach: float = 0.6) -> cdsm.Stiffness:
    """A random arm of all laws, springs, drives and joint springs, its tensions not in balance."""
    kind = ("universal", "hinged")[seed % 2]
    arm = locked.hybrid(arms.random_arm(seed, 1 + seed % 4, kind), list(locked.LAWS.values()))
    arm = arm.with_springs({name: (1.0 + i, 0.1) for i, name in enumerate(arm.joint_names)})
    pose = arms.random_posture(arm, seed, reach)
    wrench = arms.random_wrench(seed, moment=seed % 3 == 0)
    return cdsm.stiffness(pose, arms.random_tension(arm, seed), wrench=wrench)


# --- the comparisons --------------------------------------------------------------------------


@settings(max_examples=20, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000), reach=st.sampled_from([0.0, 0.3, 0.9, 0.99]))
def test_right_stiffness_agrees_within_the_error_estimates(seed: int, reach: float) -> None:
    report = hybrid(seed, reach).report()
    assert having(report, "agrees") == set(EVERY), report.faults
    size = report.comparisons[TERMS.index("joint")].largest
    assert all(each.off <= max(3.0 * each.error, 1e-9 * size) for each in report.comparisons)


@settings(max_examples=3, deadline=None, derandomize=True)
@given(seed=st.integers(1, 10_000).map(lambda seed: 3 * seed))  # with a moment
def test_every_wrong_term_is_found_and_named(seed: int) -> None:
    K = hybrid(seed)
    order = np.roll(np.arange(K.posture.arm.nv), 1)
    for term in TERMS:
        matrix = getattr(K, term)
        one = matrix.copy()
        one[np.unravel_index(abs(matrix).argmax(), matrix.shape)] *= 1.0001
        wrongs = [1.0001 * matrix, -matrix, 2.0 * matrix, one]
        wrongs += [matrix[order][:, order]] if order.size > 2 and term != "springs" else []
        wrongs += [matrix.T.copy()] if term == "load" and order.size > 1 else []
        for wrong in wrongs:
            report = with_matrix(K, term, wrong).report()
            assert having(report, "DIFFERS") == {term, "batch"}
            assert not report.passed
            assert report.faults[0].startswith(f"{term}: off by")
    assert order.size == 1 or any("not symmetric" in note for note in K.report().notes)


@pytest.mark.parametrize(
    "pose",
    [
        pytest.param(foreign.crab(locked.TABLE).at(foreign.POSTURE), id="prismatic, branches"),
        pytest.param(cdsm.presets.virtual_prototype().at(np.zeros(10)), id="strand, straight"),
        pytest.param(locked.hinge().at(0.99 * locked.hinge().upper), id="almost closed"),
    ],
)
def test_arms_of_every_kind_agree(pose: cdsm.Posture) -> None:
    K = cdsm.stiffness(pose, np.linspace(20.0, 30.0, len(pose.arm.cables)))
    assert having(K.report(), "agrees") == set(EVERY), K.report().faults
    wrong = with_matrix(K, "passive", 0.9999 * K.passive)
    assert "passive" in having(wrong.report(), "DIFFERS")


def test_equilibrium_is_checked_with_the_free_lengths_of_its_reference() -> None:
    pose, pull = locked.balanced("universal-3-8-all", moment=False)
    load = np.array([0.0, 1.0, -3.0, 0.0, 0.0, 0.0])
    K = cdsm.equilibrium(pose, pull, pull.wrench + load).stiffness
    assert K.report().passed, K.report().faults
    assert any("follow from an equilibrium" in note for note in K.report().notes)
    wrong = replace(K, free_length=K.posture.cable_lengths)
    assert "passive" in having(wrong.report(), "DIFFERS")
    slack = cdsm.equilibrium(locked.hinge().at([0.0]), [20.0, 20.0], 1.5 * locked.MOMENT).stiffness
    assert slack.tension[1] == 0.0
    assert slack.report().passed, slack.report().faults
    assert any("slack, 0 N" in note and "cable1_2" in note for note in slack.report().notes)


# --- laws -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("law", "tension", "said"),
    [
        (STRAND, 805.0, "within 1% of an end of its law, 2.2 to 810 N"),
        (STRAND, 2.21, "within 1% of an end of its law, 2.2 to 810 N"),
        (cdsm.LinearElasticity(48e3), 0.0, "slack (0 N), and K_θ counts it as if it were taut"),
    ],
)
def test_edge_of_a_law_is_not_possible(law: cdsm.Elasticity, tension: float, said: str) -> None:
    report = with_one(arms.prototype(law, 15.0)[0], tension).report()
    assert having(report, "not possible") == {"passive", "joint", "passive torque"}
    assert having(report, "DIFFERS") == set()
    assert report.unchecked[0].startswith(
        "check not possible for passive and joint and passive torque: cable1_1"
    )
    assert said in report.unchecked[0]


def test_balanced_tensions_at_the_edge_of_a_law_are_not_checked_rather_than_wrong() -> None:
    pose = arms.prototype(STRAND, 15.0)[0]
    report = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 2.21)).report()
    assert (report.outcome, report.passed, report.faults) == ("NOT CHECKED", False, ())
    assert report.to_dict()["outcome"] == "NOT CHECKED"
    for page in (str(report), report.to_html()):
        assert "NOT CHECKED" in page
        assert "within 1% of an end of its law" in page
        assert "FAIL" not in page


@settings(max_examples=10, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000))
def test_table_that_bends_at_its_points_is_never_wrong(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.cumsum([0.0, *rng.uniform(0.5, 5.0, 60)])
    strains = np.cumsum([0.0, *np.diff(0.01 * np.log1p(points / 10.0)) * rng.uniform(1.0, 1.3, 60)])
    law = cdsm.TabulatedElasticity(tuple(points), tuple(strains))
    arm = arms.random_arm(seed, 1 + seed % 4, ("universal", "hinged")[seed % 2], law)
    K = cdsm.stiffness(arms.random_posture(arm, seed), rng.uniform(15.0, 60.0, len(arm.cables)))
    assert not having(K.report(), "DIFFERS")


OWN = cdsm.Elasticity.from_rigidity(lambda _: 1e5, 0.0, 500.0)


class Own(cdsm.Elasticity):
    """EA = 100 kN from 0 on; its rigidity or its energy is wrong by a factor."""

    off: tuple[float, float]

    def __init__(self, rigidity: float = 1.0, energy: float = 1.0) -> None:
        table = OWN._knots, OWN._coefficients, OWN._cells
        super().__init__(0.0, 500.0, 0.0, "", {"off": (rigidity, energy)}, 1.0, *table)
        object.__setattr__(self, "off", (rigidity, energy))

    def evaluate(self, F: Array) -> tuple[Array, Array]:
        strain, EA = super().evaluate(F)
        return strain, np.asarray(EA * self.off[0])

    def energy(self, tension: ArrayLike) -> Array:
        return np.asarray(super().energy(tension)) * self.off[1]


@pytest.mark.parametrize(
    ("law", "wrong"),
    [
        (Own(), set()),
        (Own(rigidity=1.001), {"passive", "joint"}),
        (Own(energy=1.001), {"passive torque"}),
    ],
)
def test_law_that_contradicts_itself_is_found(law: Own, wrong: set[str]) -> None:
    K = cdsm.stiffness(*arms.prototype(law, 15.0))
    assert having(K.report(), "DIFFERS") == wrong


# --- balance, optimality, stability -----------------------------------------------------------


def test_distributed_tensions_are_optimal() -> None:
    geometry = arms.readme_geometry(cables_per_joint=5)
    pose = arms.random_posture(cdsm.Manipulator(geometry, STRAND), 1, 0.3)
    free = cdsm.distribute_tension(pose, 15.0).values
    most = np.where(free == free.max(), 0.95 * free, np.inf)
    pull = cdsm.distribute_tension(pose, 15.0, most)
    assert pull.at_minimum
    assert len(pull.at_maximum) == 1
    report: Any = cdsm.stiffness(pose, pull).report()
    assert 0.0 <= report.kkt_residual < 1e-8
    assert report.passed, report.faults


def test_tensions_that_are_not_the_least_or_break_a_bound_are_found() -> None:
    pose = locked.hinge().at([0.0])
    pull = cdsm.distribute_tension(pose, 10.0)
    lax = cdsm.stiffness(pose, replace(pull, minimum_held=frozen(np.full(2, 5.0)))).report()
    # F = (10, 10) could fall along (1, 1): all of it is left
    assert lax.kkt_residual == pytest.approx(1.0, rel=1e-12)
    assert any("not optimal" in fault for fault in lax.faults)
    low = cdsm.stiffness(pose, replace(pull, minimum_held=frozen(np.full(2, 11.0)))).report()
    assert low.bound_violation == pytest.approx(0.1, rel=1e-12)
    planned = cdsm.stiffness(pose, replace(pull, values=pull.values + 1.0, least=False)).report()
    assert planned.passed, planned.faults
    assert "chosen for a stiffness" in planned.notes[0]
    own = cdsm.stiffness(pose, pull.values + 1.0).report()
    assert own.passed
    assert own.kkt_residual is None


def test_tensions_out_of_balance_are_a_fault_with_the_joint_and_the_torque() -> None:
    report = cdsm.stiffness(locked.hinge().at([0.0]), [30.0, 20.0]).report()
    assert report.largest_residual == pytest.approx(10.0 * locked.R, rel=1e-12)
    assert report.imbalance == pytest.approx(10.0 / 50.0, rel=1e-12)
    assert "the residual is 0.3 N m at joint1" in report.faults[0]
    # prismatic joints are compared by the torque with the arm's length as lever
    pose = foreign.crab().at(foreign.POSTURE)
    K = cdsm.stiffness(pose, foreign.TENSION, wrench=(0, 0, 0, 0, 75, 0))
    assert pose.arm.joint_names[int(abs(K.residual).argmax())] == "f"
    assert (K.report().residual_joint, K.report().largest_residual) == ("a", abs(K.residual[0]))
    assert f"(1 m counted as {1.0 / pose.arm.length:.4g} rad)" in str(K.report())


def test_unstable_arm_fails() -> None:
    pose = locked.soft_hinge().at([0.0])
    for push, stands in ((15.0, True), (30.0, False)):  # it buckles at 16 N
        pull = cdsm.distribute_tension(pose, 20.0, wrench=(-push, 0.0, 0.0, 0.0, 0.0, 0.0))
        report = cdsm.stiffness(pose, pull).report()
        assert having(report, "agrees") == set(EVERY)
        assert report.passed is stands
        assert any("UNSTABLE" in fault for fault in report.faults) is not stands


# --- notes and print --------------------------------------------------------------------------


def test_json_and_page_hold_the_report() -> None:
    arm = locked.hinge()
    names = [replace(cable, name=f"<b>{i}", control="force") for i, cable in enumerate(arm.cables)]
    report = cdsm.stiffness(arm.with_cables(names).at([0.0]), [0.0, 0.0]).report()
    told = report.to_dict()
    assert json.loads(json.dumps(told, allow_nan=False)) == told
    assert (told["passed"], told["largest_residual_Nm"]) == (False, 0.0)
    page = report.to_html("about <it>")
    assert "about &lt;it&gt;" in page
    assert "&lt;b&gt;0" in page
    assert "http:" not in page


def test_tables_have_each_number_under_its_title() -> None:
    """In text, where cells of a column stand below each other; the page has the same cells."""
    report: Any = hybrid(3).report()
    text = str(report)
    rows = table(text, "against finite differences")
    names = ["cdsm.evaluate, all terms" if each.name == "batch" else each.name
             for each in report.comparisons]  # fmt: skip
    assert [*rows] == names
    for cells, each in zip(rows.values(), report.comparisons, strict=True):
        require_all([(cells["largest entry"], each.largest)])
        assert cells["largest entry"].unit == each.unit
        shares = ("off by", each.off), ("error bound", each.error)
        for title, value in shares:
            require_all([(cells[title], value / (each.largest or 1.0))], digits=1)
        assert cells["verdict"].text == each.verdict
    assert any(cells["off by"] != cells["error bound"] for cells in rows.values())
    said = dict(re.findall(r"(?m)^(\S+(?: \S+)*)  +(\S.*)$", text))
    for what, value, digits in (
        ("residual of Eq. 13", report.largest_residual, 2),
        ("residual per torque", report.imbalance, 2),
        ("violation of bounds", report.bound_violation, 2),
        ("KKT residual (recomputed multipliers)", report.kkt_residual, 2),
        ("condition of K_θ", report.condition, 3),
    ):
        if value is None:
            assert said[what] == "-"
            continue
        require_all([(Printed(said[what].split()[0], ""), value)], digits=digits)
    assert said["residual of Eq. 13"].endswith(f"N m at {report.residual_joint}")


def test_what_is_near_its_end_is_noted_by_name() -> None:
    """Cables near both ends of their laws, slack or held by a force; joints near both limits."""
    arm = short_arm(STRAND)
    slack, held, *others = arm.cables
    slack = replace(slack, elasticity=cdsm.LinearElasticity(48e3))
    arm = arm.with_cables([slack, replace(held, control="force"), *others])
    q = np.linspace(0.1, 0.2, 6)
    q[1] = 0.995 * arm.lower[1]
    q[4] = 0.995 * arm.upper[4]
    F = np.full(9, 50.0)
    F[[0, 2, 5]] = 0.0, 1.02 * STRAND.low, 0.98 * STRAND.high
    notes = cdsm.stiffness(arm.at(q), F).report().notes
    cables, joints = arm.cables.names, arm.joint_names
    for words, names in (
        ("slack, 0 N; they stiffen one direction, raise minimum", cables[:1]),
        ("force-controlled, no passive stiffness", cables[1:2]),
        ("within 5 % of the low end of their law", cables[2:3]),
        ("within 5 % of the high end of their law", cables[5:6]),
        ("within 1 % of their range from a joint limit", (joints[1], joints[4])),
    ):
        assert f"{words}: {', '.join(names)}." in notes
    inside = cdsm.stiffness(arm.at(0.5 * q), np.full(9, 50.0)).report().notes
    assert not any(words in note for note in inside for words in ("within", "slack"))


def test_in_a_notebook_it_is_printed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """rich shows each line at once where it takes the session for a notebook."""
    report = cdsm.stiffness(locked.hinge().at([0.0]), [20.0, 20.0]).report()
    text = str(report)
    shown: list[object] = []
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    monkeypatch.setattr("rich.jupyter.display", lambda *lines: shown.extend(lines))
    assert str(report) == text
    assert shown == []
