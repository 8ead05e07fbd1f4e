"""Why postures of a sweep have tensions, but no stiffness."""

from pathlib import Path

import numpy as np
import pytest

import cdsm
from cdsm.stiffness_matrix.verdict import weakest_joint
from cdsm.sweeps.entries import Entries
from cdsm.sweeps.failing import explain_outside, explain_unstable
from tests.cli.test_commands import call
from tests.support.sweeps import short_arm

SNAKE = Path(__file__).parents[1] / "data" / "snake.toml"
NO_LOAD = np.zeros(6)
Q = np.random.default_rng(3).uniform(-0.15, 0.15, (12, 6))
OUTSIDE = np.full(12, cdsm.Status.OUTSIDE_ELASTICITY, dtype=np.int8)


def test_cables_below_and_above_their_law_and_without_wire_are_named() -> None:
    law = cdsm.presets.STRAND_1X19
    arm = short_arm(law)
    low = explain_outside(Entries(arm, Q, OUTSIDE, 1.0, np.inf, NO_LOAD))
    assert low is not None
    (below,) = (passing for passing in low.passing if passing.place.startswith("below"))
    assert f"{law.low:.4g} N" in below.place
    assert set(below.cables) <= {*arm.cables.names}
    assert below.tension == pytest.approx(1.0)
    high = explain_outside(Entries(arm, Q, OUTSIDE, 1.01 * law.high, np.inf, NO_LOAD))
    assert high is not None
    (above,) = high.passing
    assert set(above.cables.values()) == {len(Q)}
    assert above.tension >= 1.01 * law.high
    assert f"above {law.high:.4g} N, where the law ends" in str(high)
    springy = explain_outside(Entries(short_arm(spring=500.0), Q, OUTSIDE, 60.0, np.inf, NO_LOAD))
    assert springy is not None
    assert "the series spring leaves no wire" in str(springy)


def test_the_joint_that_moves_most_is_that_of_the_print() -> None:
    arm = short_arm(spring=8000.0, lead=0.3)
    rows = cdsm.sweep(arm, Q, minimum=100.0, outputs=["margin"])["status"].values
    unstable = explain_unstable(Entries(arm, Q, rows, 100.0, np.inf, NO_LOAD))
    assert unstable is not None
    assert unstable.count == np.count_nonzero(rows == cdsm.Status.UNSTABLE) == unstable.examined
    poses = [arm.at(q) for q in Q[rows == cdsm.Status.UNSTABLE]]
    weakest = [
        weakest_joint(cdsm.stiffness(pose, cdsm.distribute_tension(pose, 100.0))) for pose in poses
    ]
    assert unstable.joints == {joint: weakest.count(joint) for joint in unstable.joints}
    assert f"most moves {next(iter(unstable.joints))}" in str(unstable)
    fine = np.zeros(len(Q), dtype=np.int8)
    assert explain_unstable(Entries(arm, Q, fine, 1.0, np.inf, NO_LOAD)) is None
    assert explain_outside(Entries(arm, Q, fine, 1.0, np.inf, NO_LOAD)) is None


def test_the_command_says_which_cable_and_which_joint() -> None:
    words = ("sweep", SNAKE, "--angles", 8, "--set", "series_stiffness=2000")
    text = call(*words, "--minimum", "10,20").output
    pose = cdsm.Manipulator.read(SNAKE, changes={"series_stiffness": 2000.0}).at(
        np.full(12, np.deg2rad(8.0))
    )
    K = cdsm.stiffness(pose, cdsm.distribute_tension(pose, 10.0))
    assert "the arm buckles at 1 of 1 posture\n" in text
    assert f"most moves {weakest_joint(K)} (1)" in text
    text = call(*words[:-1], "wire=1x19-1.2mm", "--set", "minimum=1.0", "--minimum", 1.0).output
    assert "below 2.2" in text
    assert "where the law begins: cable" in text
