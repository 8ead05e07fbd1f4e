"""Numbers within the sentences that results print: they are those of the result, in its units."""

import math
from dataclasses import replace

import numpy as np
import pytest

import cdsm
from tests.estimation.test_loads import TIP, held, readme
from tests.support.printed import Printed, numbers, require_all, table
from tests.support.sweeps import short_arm
from tests.support.tracking import small_path

POSE = short_arm(cdsm.presets.STRAND_1X19, lead=0.3).at(np.full(6, 0.1))
PULL = cdsm.distribute_tension(POSE, 40.0)
LOOSE = short_arm(spring=1500.0, lead=0.5).at(np.array([0.1, 0.0, 0.08, 0.0, 0.05, 0.02]))


def test_changes_of_the_stiffness_have_a_row_for_each_cable() -> None:
    change = cdsm.stiffness_gradient(cdsm.stiffness(POSE, PULL))
    rows = table(str(change), "cable  ")
    assert [*rows] == [*POSE.arm.cables.names]
    for cells, stiffer, firmer in zip(
        rows.values(), change.cable_stiffness, change.margin, strict=True
    ):
        printed = cells["cable stiffness"], cells["smallest joint stiffness"]
        require_all(zip(printed, (stiffer, firmer), strict=True))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_tensions_say_what_is_missing_for_balance(sign: float) -> None:
    more = sign * np.eye(len(PULL))[4]
    off = replace(PULL, values=PULL.values + more)
    missing = abs(POSE.length_jacobian.T @ more).max()
    require_all([(numbers(str(off), "static residual: {}")[0], missing)], digits=2)


@pytest.mark.parametrize("maximum", [math.inf, 60.0])
def test_a_saturation_says_from_where_more_tension_adds_little(maximum: float) -> None:
    curve = cdsm.saturation(POSE, "z", maximum=maximum)
    text = str(curve)
    most = numbers(text, "along (0, 0, 1) is at most {}, at a lower bound of {}")
    require_all(zip(most, (curve.along.max(), curve.stiffest), strict=True))
    from_where = numbers(text, "saturates at {}: {} of that")
    require_all(zip(from_where, (curve.bound, curve.fraction), strict=True))
    require_all([(numbers(text, "looked at up to {}")[0], curve.minimum[-1])])
    assert curve.limit.message in text
    falls = curve.stiffest < curve.minimum[-1]
    assert falls == (maximum == math.inf)
    assert falls == ("tension makes the arm softer" in text)
    if falls:
        require_all([(numbers(text, "above {} tension makes")[0], curve.stiffest)])


def test_the_report_says_what_small_loads_measure_while_cables_stick() -> None:
    rough = POSE.arm.with_friction(0.1).at(POSE.q)
    F = cdsm.distribute_tension(rough, 40.0)
    notes = "\n".join(cdsm.stiffness(rough, F).report().notes)
    loads = numbers(notes, "Below {}, {}, {} along x, y, z they stick", "N")
    stuck = numbers(notes, "and a load measures {}, {}, {}", "N/mm")
    holds = [cdsm.breakaway(rough, F, u).load for u in "xyz"]
    K = cdsm.stuck_stiffness(rough, F)
    require_all(zip(loads, holds, strict=True), digits=2)
    measured = [Printed(number.text, "N/mm") for number in stuck]
    require_all(zip(measured, [K.along(u) for u in "xyz"], strict=True))


def test_a_weight_says_how_many_holes_slide_under_the_whole_of_it() -> None:
    rough = POSE.arm.with_friction(0.1).at(POSE.q)
    test = cdsm.weight_test(rough, cdsm.distribute_tension(rough, 40.0), [0.0, 0.0, -2.0], steps=4)
    assert test.history is not None
    counts = np.count_nonzero(test.history.sliding, axis=1)
    assert counts[0] < counts[-1]
    size, _, *holes = numbers(str(test), "this weight, {}, measures {}; {} of {} holes slide")
    require_all([(size, 2.0)])
    assert [int(each.text) for each in holes] == [counts[-1], len(test.history.holes)]


def test_a_remedy_that_is_printed_holds_the_arm_and_less_of_it_does_not() -> None:
    """The printed factor is rounded to the safe side."""
    K = cdsm.stiffness(LOOSE, cdsm.distribute_tension(LOOSE, 100.0))
    (fault,) = (fault for fault in K.report().faults if "UNSTABLE" in fault)
    assert "no other EA of wires alone would hold it" in fault
    (spring,) = numbers(fault, "k_series {} times as high, or more")
    (bound,) = numbers(fault, "lower bounds {} times as high, or less")

    def is_held(spring: float = 1.0, bound: float = 1.0) -> bool:
        cables = [
            replace(cable, series_stiffness=spring * cable.series_stiffness)
            for cable in LOOSE.arm.cables
        ]
        there = LOOSE.arm.with_cables(cables).at(LOOSE.q)
        F = K.tension if bound == 1.0 else cdsm.distribute_tension(there, bound * 100.0)
        return cdsm.stiffness(there, F).is_stable

    for name, number, towards in (("spring", spring, 0.998), ("bound", bound, 1.002)):
        factor = float(number.text)
        assert is_held(**{name: factor})
        assert not is_held(**{name: towards * factor})


def test_modes_say_how_fast_a_deflection_grows_and_which_joint_moves_most() -> None:
    modes = cdsm.modes(cdsm.stiffness(LOOSE, cdsm.distribute_tension(LOOSE, 100.0)))
    signs = np.where(np.arange(len(modes.frequencies)) % 2, 1.0, -1.0)  # a shape has no sign
    modes = replace(modes, shapes=signs * modes.shapes, growth_shapes=-modes.growth_shapes)
    names = np.array(LOOSE.arm.joint_names)
    text = str(modes)
    rows = table(text, "mode  ")
    for cells, frequency, shape in zip(
        rows.values(), modes.frequencies, modes.shapes.T, strict=True
    ):
        require_all([(cells["frequency"], frequency)])
        assert cells["moves most"].text == names[abs(shape).argmax()]
    lines = [line for line in text.splitlines() if line.startswith("UNSTABLE")]
    for line, rate, shape in zip(lines, modes.growth_rates, modes.growth_shapes.T, strict=True):
        (time,) = numbers(line, "grows by e in {} s")
        require_all([(time, 1.0 / rate)])
        assert f"most of it at {names[abs(shape).argmax()]}," in line


def test_an_arm_that_no_tension_holds_says_where_it_was_looked_at() -> None:
    held_by_none = replace(cdsm.critical_tension(LOOSE), stable=())
    ends = numbers(str(held_by_none), "UNSTABLE at every lower bound from {} to {}")
    require_all(zip(ends, held_by_none.examined, strict=True))


def test_tensions_at_the_joints_are_those_behind_the_last_hole() -> None:
    pose = readme(0.1)
    W = [*TIP, 0.1, -0.05, 0.02]
    found = cdsm.estimate_tensions(pose, held(pose, W), tension_std=0.5, wrench=W)
    rows = table(str(found), "cable ")
    assert [*rows] == [*pose.arm.cables.names]
    lasts = pose.segments.chains.start[1:] - 1
    for cells, motor, last in zip(rows.values(), found.motor_tension, lasts, strict=True):
        require_all([(cells["motor"], motor)])
        value, _, half = cells["at its end"].text.partition(" ± ")
        pair = Printed(value, "N"), Printed(half, "N")
        ends = found.segment_tension[last], found.segment_std[last]
        require_all(zip(pair, ends, strict=True), digits=None)
        alone = numbers(cells["by friction alone"].text, "{} to {}", "N")
        ends = found.segment_low[last], found.segment_high[last]
        assert ends[0] < motor < ends[1]
        require_all(zip(alone, ends, strict=True))
    known = numbers(str(found), "wrench at the tip ({}, {}, {}, {}, {}, {})")
    require_all(zip(known, W, strict=True))


def test_a_closed_loop_says_what_it_estimates_and_which_motors_are_at_a_bound() -> None:
    run = cdsm.track(small_path(0.1), steps=2, minimum=10.0, maximum=250.0)
    text = str(run)
    require_all([(numbers(text, "rigidity of the wires, as estimated {}")[0], run.rigidity[-1])])
    force = numbers(text, "force at the tip, as estimated ({}, {}, {})")
    require_all(zip(force, run.estimated_force[-1], strict=True), digits=3)
    band = numbers(text, "± ({}, {}, {}) by friction")
    require_all(zip(band, run.estimated_force_band[-1], strict=True), digits=2)
    inside = numbers(text, "inside the first-order band {} of {} steps")
    require_all(zip(inside, (run.inside.mean(), run.inside.size), strict=True))
    assert "motors clamped at a tension bound none" in " ".join(text.split())
    clamped = run.saturated.copy()
    clamped[-1, 2] = True
    text = " ".join(str(replace(run, saturated=clamped)).split())
    assert f"tension bound {run.arm.cables.names[2]} rigidity" in text
