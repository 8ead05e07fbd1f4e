"""What a planned path tells the motors, as numbers, as a table and in print."""

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import cdsm
from cdsm import presets
from tests.support import arms
from tests.support.locked import (
    STRAND,
    some_arm,
)
from tests.support.paths import ARM, DOWN, waving


def test_unstrained_length_and_elongation_make_the_length() -> None:
    """Springs, strands, drives; a cable whose motor holds the force has none."""
    arm = some_arm("universal-3-8-all")
    q = np.outer(np.linspace(0.5, 1.0, 4), arms.random_posture(arm, 11, reach=0.25).q)
    found = cdsm.stiffness_range(arm.at(q[2]), DOWN, 40.0, 300.0, starts=4)
    plan = cdsm.plan_path(
        arm, DOWN, 0.5 * (found.low + found.high), 40.0, 300.0, angles=q, rate=200.0
    )
    assert len(plan.planned) >= 3
    held = [cable for cable in arm.cables if cable.control == "position"]
    assert len(held) < len(arm.cables)
    assert plan.unstrained_lengths.shape == (len(plan.planned), len(held))
    for k, K in enumerate(plan.stiffness):
        np.testing.assert_array_equal(plan.cable_lengths[k], K.posture.cable_lengths)
        lengths = iter(plan.unstrained_lengths[k])
        for cable, F, L in zip(arm.cables, plan.tensions[k], plan.cable_lengths[k], strict=True):
            if cable.control == "position":
                free = float(next(lengths))
                assert 0.0 < free < L
                assert free + float(cable.elongation(F, free)) == pytest.approx(L, rel=1e-14)


def test_csv_holds_every_sample_with_its_units_bit_by_bit(tmp_path: Path) -> None:
    cables = [replace(c, control="force") if c.name == "cable2_1" else c for c in ARM.cables]
    arm = cdsm.Manipulator(ARM.geometry, cables=cables, gravity=ARM.gravity)
    targets = [80e3, 1e7, 81e3]
    plan = cdsm.plan_path(arm, DOWN, targets, 50.0, angles=waving(3))
    path = plan.write(tmp_path / "motors.csv")
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["planned", "stiffness", "planned"]
    assert [row["sample"] for row in rows] == ["0", "1", "2"]
    assert rows[1]["reason"] == plan.infeasible[0].reason
    assert rows[1]["cable1_1 tension [N]"] == rows[0]["reason"] == ""
    names = [cable.name for cable in arm.cables]
    for k, row in enumerate((rows[0], rows[2])):
        for kind, unit, values in (
            ("tension", "N", plan.tensions),
            ("length", "m", plan.cable_lengths),
        ):
            told = [float(row[f"{name} {kind} [{unit}]"]) for name in names]
            np.testing.assert_array_equal(told, values[k])
        angles = [float(row[f"{name} [rad]"]) for name in arm.joint_names]
        np.testing.assert_array_equal(angles, plan.angles[k])
        held = [name for name in names if name != "cable2_1"]
        free = [float(row[f"{name} unstrained length [m]"]) for name in held]
        np.testing.assert_array_equal(free, plan.unstrained_lengths[k])
    assert not any("cable2_1 unstrained" in column for column in rows[0])
    reached = [float(row["stiffness [N/m]"]) for row in (rows[0], rows[2])]
    np.testing.assert_array_equal(reached, plan.achieved)
    noisy = replace(plan, angles=np.full_like(plan.angles, 1.2e-33))
    with noisy.write(path).open(encoding="utf-8", newline="") as file:
        assert next(csv.DictReader(file))["joint1_1 [rad]"] == "0.0"
    with pytest.raises(cdsm.FileError, match="does not exist"):
        plan.write(tmp_path / "absent" / "motors.csv")


def test_motors_pay_out_the_unstrained_length_whatever_the_stiffness_takes_for_it() -> None:
    s = np.linspace(0.0, math.pi, 9)
    plans = [
        cdsm.plan_path(
            presets.virtual_prototype(original_length=name),
            DOWN,
            70e3 + 20e3 * np.sin(s),
            50.0,
            angles=waving(9),
        )
        for name in ("unstrained", "stretched")
    ]
    for plan in plans:
        lengths = plan.unstrained_lengths * (1.0 + STRAND.strain(plan.tensions))
        np.testing.assert_allclose(lengths, plan.cable_lengths, rtol=1e-14)
