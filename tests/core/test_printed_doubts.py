"""Numbers in the sentences that say what is doubtful: those of the result, named as there."""

from dataclasses import replace

import numpy as np
import pytest

import cdsm
from cdsm.identification import identify
from cdsm.status import Status
from tests.estimation.test_posture import Q, W, wired
from tests.identification.test_search import EXACT, FREE, prototype
from tests.support.printed import Printed, numbers, require_all
from tests.support.sweeps import short_arm

POSE = short_arm(cdsm.presets.STRAND_1X19, lead=0.3).at(np.full(6, 0.1))


@pytest.mark.parametrize("factor", [0.6, 1.5])
def test_the_worst_residual_of_an_identification_has_its_name_and_sign(factor: float) -> None:
    """It is negative where the measured stiffness is larger than that of any such arm."""
    wrong = [*EXACT[:4], replace(EXACT[4], value=factor * EXACT[4].value), *EXACT[5:]]
    found = identify(prototype, wrong, FREE)
    off = (found.predicted - found.measured) / [each.std for each in wrong]
    k = max(range(len(wrong)), key=lambda i: abs(off[i]))
    others = np.delete(off, k)
    extreme = off[k] > others.max(), off[k] < others.min()
    assert extreme == (factor < 1.0, factor > 1.0)
    (worst,) = numbers(str(found), f"worst at {wrong[k].label} with {{}}")
    assert worst.text[0] == "+-"[factor > 1.0]
    require_all([(worst, off[k])], digits=3)


def test_the_joint_known_worst_has_its_deviation_and_what_friction_changes() -> None:
    arm, F, wire = wired(0.1)
    found = cdsm.estimate_posture(
        arm, F, tension_std=0.5, rest_lengths=wire, rest_length_std=1e-5, wrench=W, start=Q
    )
    whole = found.angle_std + found.angle_band
    k = whole.tolist().index(max(whole))
    assert found.angle_std[k] != pytest.approx(found.angle_band[k], rel=0.1)
    name = arm.joint_names[k]
    ends = numbers(str(found), f"known worst: {name}, ± {{}} std, friction ± {{}}")
    assert {each.unit for each in ends} == {"°"}
    require_all(zip(ends, (found.angle_std[k], found.angle_band[k]), strict=True), digits=3)


def test_draws_that_are_left_out_are_counted_with_their_cause() -> None:
    level = cdsm.distribute_tension(POSE, 10.0)
    own = cdsm.Tolerances(tension=cdsm.Tolerance(4.0, correlation=1))
    run = cdsm.monte_carlo(POSE, level, own, direction="z", draws=2000, progress=False)
    kept = int((run.status == Status.OK).sum())
    assert 0 < 2000 - kept < kept
    text = str(run)
    (drawn,) = numbers(text, "N/mm, {} draws")
    (left,) = numbers(text, "it does not exist for {} more draws")
    assert (int(drawn.text), int(left.text)) == (kept, 2000 - kept)
    causes = {Status(code).name for code in run.status.tolist()} - {"OK"}
    assert {*text.rpartition("left out: ")[2].split(", ")} == causes


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_a_weight_test_says_by_how_much_the_arm_left_its_reference(friction: float) -> None:
    pose = POSE.arm.with_friction(friction).at(POSE.q)
    pull = cdsm.distribute_tension(pose, 60.0).values + 15.0 * np.eye(len(pose.arm.cables))[1]
    force = [0.0, 0.0, -2.0]
    test = cdsm.weight_test(pose, pull, force, steps=2)
    start = pose.tip[:3, 3]
    free = test.unloaded.pose.tip[:3, 3] - start
    said = [(free, "its tip moved by ({}, {}, {}) mm")]
    if test.history is not None:
        rough = cdsm.load_cycle(pose, pull, np.zeros((1, 6))).tip[-1] - start
        assert np.linalg.norm(rough - free) > 0.02 * np.linalg.norm(free)
        said.append((rough, "with friction by ({}, {}, {}) mm"))
    assert (test.history is not None) == (friction > 0.0)
    (sentence,) = (each for each in test.warnings if each.startswith("LEFT ITS REFERENCE"))
    assert sentence in str(test)
    for moved, words in said:
        printed = [Printed(each.text, "mm") for each in numbers(sentence, words)]
        require_all(zip(printed, moved, strict=True), digits=3)
