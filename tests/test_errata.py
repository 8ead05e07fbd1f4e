"""What is misprinted or loose in the paper, one test each, named after its equation."""

import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.polynomial import Polynomial

import cdsm
from tests.arms import random_arm, random_posture, random_wrench
from tests.test_urdf import eq1, eq2, eq3, table1

PRINTED = cdsm.StrandElasticity.eq19_as_printed()
REPAIRED = cdsm.StrandElasticity.eq19_repaired()
JUST_ABOVE_31 = math.nextafter(31.0, 32.0)

# Table II [N/mm]
TABLE_2 = {
    "x": (4.08, 4.86, 5.76, 8.21, 12.71),
    "y": (2.23, 7.45, 7.24, 9.94, 10.29),
    "z": (8.88, 10.31, 16.43, 27.54, 35.25),
}


def test_eq3_product_runs_base_to_tip() -> None:
    arm = random_arm(1, 3)
    pose = random_posture(arm, 1)
    base_to_tip = eq3(arm.geometry, pose.q)
    rows = table1([link.length for link in arm.geometry.links], pose.q)
    tip_to_base = eq2(arm.geometry.base_length)
    for row in reversed(rows):  # the index of Eq. 3 runs from 2n down
        tip_to_base = tip_to_base @ eq1(*row)
    np.testing.assert_allclose(pose.tip, base_to_tip, rtol=0.0, atol=1e-14)
    assert abs(pose.tip - tip_to_base).max() > 0.01


def test_eq3_row_0_of_table_1_is_eq2_and_is_multiplied_once() -> None:
    np.testing.assert_allclose(eq1(math.radians(-90.0), 0.07, 0.0), eq2(0.07), atol=1e-16)


@pytest.mark.parametrize("seed", range(5))
def test_eq10_to_12_hold_with_equality(seed: int) -> None:
    arm = random_arm(seed, 4)
    pose = random_posture(arm, seed)
    pull = cdsm.distribute_tension(pose, minimum=10.0, wrench=random_wrench(seed))
    torque = pull.wrench @ pose.jacobian - pull.values @ pose.length_jacobian - pose.gravity_torque
    assert abs(torque).max() < 1e-12 * max(1.0, pull.values.max())
    np.testing.assert_allclose(pull.residual, -torque, rtol=0.0, atol=1e-12)


def test_eq10_virtual_work_vanishes_to_second_order_in_the_displacement() -> None:
    arm = random_arm(2, 3)
    pose = random_posture(arm, 2, reach=0.4)
    W = random_wrench(2, moment=False)
    pull = cdsm.distribute_tension(pose, minimum=10.0, wrench=W)
    direction = np.random.default_rng(5).normal(size=arm.nv)

    def work(step: float) -> float:
        """W·δX − F·δL − G·δH over a displacement, links as point masses at mid-link."""
        near = arm.at(pose.q + step * direction)
        total = float(W[:3] @ (near.tip[:3, 3] - pose.tip[:3, 3]))
        total -= float(pull.values @ (near.cable_lengths - pose.cable_lengths))
        for k, link in enumerate(arm.geometry.links, start=1):
            middle = np.array([link.length / 2.0, 0.0, 0.0, 1.0])
            moved = (near.link_pose(f"link{k}") - pose.link_pose(f"link{k}")) @ middle
            crosses = near.link_pose(f"cross{k}") - pose.link_pose(f"cross{k}")
            total += float(arm.gravity @ (link.mass * moved[:3] + 1e-6 * crosses[:3, 3]))
        return total

    assert math.log10(abs(work(1e-2) / work(1e-3))) == pytest.approx(2.0, abs=0.1)


def test_eq18_is_a_secant_and_eq19_read_as_one_has_no_positive_tangent_up_to_31_newton() -> None:
    """If S(F) = F l_0/Δl, the tangent is S²/(S − F S'): negative over the whole lower range."""
    F = np.linspace(2.2, 31.0, 2001)
    S = Polynomial(REPAIRED.coefficients[0])
    tangent = S(F) ** 2 / (S(F) - F * S.deriv()(F))
    assert (tangent < 0.0).all()


def test_eq18_secant_and_tangent_differ_for_the_strand() -> None:
    assert float(REPAIRED.secant_rigidity(120.0)) < 0.5 * float(REPAIRED.rigidity(120.0))


def test_eq18_secant_is_the_tangent_where_rigidity_is_constant() -> None:
    wire = cdsm.presets.STEEL_WIRE_200GPA
    np.testing.assert_allclose(wire.secant_rigidity([1.0, 500.0]), wire.rigidity([1.0, 500.0]))


def test_eq19_as_printed_is_negative_from_11_newton() -> None:
    assert float(PRINTED.polynomial(31.0)) == pytest.approx(-787_884.0, abs=1.0)
    assert float(PRINTED.polynomial(11.0)) > 0.0
    assert (PRINTED.polynomial(np.linspace(11.01, 31.0, 500)) < 0.0).all()
    with pytest.raises(cdsm.ElasticityRangeError):
        PRINTED.rigidity(20.0)


def test_eq19_as_printed_and_repaired_differ_in_the_first_coefficient_only() -> None:
    assert PRINTED.coefficients[0][-1] == -1e-3
    assert REPAIRED.coefficients[0][-1] == -1e-4
    assert PRINTED.coefficients[0][:-1] == REPAIRED.coefficients[0][:-1]
    assert PRINTED.coefficients[1] == REPAIRED.coefficients[1]


def test_eq19_as_printed_misses_the_other_branch_and_repaired_meets_it_within_5_percent() -> None:
    upper = float(PRINTED.polynomial(JUST_ABOVE_31))
    assert float(PRINTED.polynomial(31.0)) / upper < -69.0
    assert float(REPAIRED.polynomial(31.0)) / upper == pytest.approx(1.0, abs=0.05)


def test_eq19_first_coefficient_that_would_close_the_gap_is_close_to_the_repaired_one() -> None:
    rest = Polynomial(REPAIRED.coefficients[0][:-1])
    closing = (float(REPAIRED.polynomial(JUST_ABOVE_31)) - float(rest(31.0))) / 31.0**6
    assert closing == pytest.approx(-9.946e-5, rel=1e-3)


def test_eq19_repaired_jumps_by_4_percent_at_31_newton() -> None:
    lower = float(REPAIRED.rigidity(31.0))
    upper = float(REPAIRED.rigidity(JUST_ABOVE_31))
    assert lower == pytest.approx(10_870.0, abs=1.0)
    assert upper == pytest.approx(11_352.0, abs=1.0)
    assert (upper - lower) / upper == pytest.approx(0.042, abs=0.0005)
    assert (upper - lower) / lower == pytest.approx(0.044, abs=0.0005)


def test_eq19_repaired_is_negative_below_2_11_newton() -> None:
    assert (REPAIRED.polynomial(np.linspace(0.0, 2.10, 200)) < 0.0).all()
    assert float(REPAIRED.polynomial(2.11)) > 0.0
    roots = Polynomial(REPAIRED.coefficients[0]).roots()
    real = roots[(abs(roots.imag) < 1e-9) & (roots.real > 0.0) & (roots.real < 31.0)].real
    assert real == pytest.approx([2.109], abs=1e-3)


def test_eq19_repaired_rises_all_through_its_domain() -> None:
    F = np.linspace(2.2001, 810.0, 5000)
    assert (REPAIRED.rigidity(F) > 0.0).all()
    assert (np.diff(REPAIRED.rigidity(F)) > 0.0).all()


def test_eq19_repaired_still_gains_13_percent_where_the_text_says_near_constant() -> None:
    start, end = REPAIRED.rigidity([400.0, 810.0])
    assert start == pytest.approx(43_700.0, abs=50.0)
    assert end == pytest.approx(49_600.0, abs=50.0)
    assert end / start - 1.0 == pytest.approx(0.137, abs=0.001)


def test_eq19_has_no_drop_after_810_newton() -> None:
    beyond = REPAIRED.polynomial(np.linspace(810.0, 980.0, 500))
    assert (np.diff(beyond) > 0.0).all()


def test_section_vb_error_is_relative_to_the_model() -> None:
    measured, calculated = 0.131, 0.139
    assert (calculated - measured) / calculated == pytest.approx(0.0575, abs=1e-4)
    assert (calculated - measured) / measured == pytest.approx(0.061, abs=1e-3)


@pytest.mark.parametrize(("axis", "increment"), [("x", 2.11), ("y", 3.61), ("z", 2.97)])
def test_table2_increment_is_last_minus_first_over_first(axis: str, increment: float) -> None:
    first, *_, last = TABLE_2[axis]
    assert (last - first) / first == pytest.approx(increment, abs=0.006)
    assert abs(last / first - increment) > 0.9


def test_table2_y_column_is_not_monotone() -> None:
    falls = {axis: [b - a for a, b in pairwise(v)] for axis, v in TABLE_2.items()}
    assert [axis for axis, steps in falls.items() if min(steps) < 0.0] == ["y"]


def test_fig6_increase_by_4_24_times_is_a_ratio_of_5_24() -> None:
    """Recomputed on the virtual prototype, from a lower bound of 15 N to one of 120 N."""
    pose = cdsm.presets.virtual_prototype().at(np.full(10, cdsm.presets.TEN_DEGREES))
    first, last = (
        cdsm.stiffness(pose, cdsm.distribute_tension(pose, minimum=bound)).pseudoinverse()[0, 0]
        for bound in (15.0, 120.0)
    )
    assert last / first - 1.0 == pytest.approx(4.24, rel=0.02)
    assert last / first == pytest.approx(5.24, rel=0.02)
