"""Paths over pulleys that cannot be: each is refused with the pulley and what to do."""

import pickle
from typing import Any

import numpy as np
import pytest

import cdsm
from cdsm import JointPulley, Pulley, Sheath, Site
from tests.support.arms import STEEL
from tests.support.pulleys import Link, arm_of

FINGER = [
    Link("palm", "base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    Link("phalanx", "palm", (0.03, 0.0, 0.0), (0.0, 1.0, 0.0)),
]
START, END = Site("palm", (-0.02, 0.0, 0.008)), Site("phalanx", (0.022, 0.0, 0.002))
PULLEY = Pulley("palm", (0.03, 0.0, 0.0), (0.0, 1.0, 0.0), 0.008)


def _pulley(**changes: Any) -> Pulley:
    values = {"link": "palm", "position": (0.03, 0.0, 0.0), "axis": (0, 1, 0), "radius": 0.008}
    return Pulley(**{**values, **changes})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"axis": (0.0, 0.0, 0.0)}, "palm has no direction"),
        ({"radius": -0.008}, "radius"),
        ({"radius": 0.0}, "radius"),
        ({"turns": -1}, "pulley on palm; a whole number, 0 or more"),
        ({"turns": 0.5}, "pulley on palm; a whole number, 0 or more"),
        ({"bearing": 1.5}, "pulley on palm; 0 to 1"),
        ({"friction": 0.1, "bearing": 0.1}, "pulley on palm has friction and bearing"),
        ({"groove": 1}, "groove"),
        ({"link": " "}, "link"),
        ({"position": (0.0, np.nan, 0.0)}, "position"),
    ],
)
def test_a_pulley_that_cannot_be_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=words):
        _pulley(**changes)


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ([PULLEY, START, END], "begins at the pulley on palm"),
        ([START, END, PULLEY], "ends at the pulley on palm"),
        ([START, PULLEY], "1 given; two or more Site|ends at the pulley on palm"),
        ([START, END, Sheath(0.1)], "ends in a sheath"),
        ([START, Sheath(0.1), PULLEY, END], "a sheath and the pulley on palm; put a Site between"),
        ([START, PULLEY, Sheath(0.1), END], "a sheath and the pulley on palm; put a Site between"),
        ([START, Sheath(0.1), Sheath(0.1), END], "are sheaths; put a Site between"),
        ([START, "pulley", END], "Site, Pulley or Sheath"),
    ],
)
def test_a_path_that_cannot_be_is_refused(path: list[Any], words: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match="flexor"):
        cdsm.Cable("flexor", tuple(path), STEEL)
    with pytest.raises(cdsm.InvalidInput, match=words):
        cdsm.Cable("flexor", tuple(path), STEEL)


def test_a_lead_and_a_sheath_are_the_same_wire() -> None:
    with pytest.raises(cdsm.InvalidInput, match="give one of them"):
        cdsm.Cable("flexor", (Sheath(0.4), START, END), STEEL, lead=0.1)


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ([Site("palm", (0.025, 0.0, 0.002)), PULLEY, END], "site is inside the pulley on palm"),
        ([START, _pulley(link="hand"), END], "hand"),
        (
            [Site("palm", (0.03, 0.001, 0.008)), PULLEY, END],
            "on the rim of the pulley on palm .* 1 mm beside its groove",
        ),
        (
            [START, PULLEY, _pulley(position=(0.04, 0.0, 0.0)), END],
            r"the pulley on palm \(entry 3 of its path\) overlaps",
        ),
    ],
)
def test_an_arm_that_cannot_be_is_refused(path: list[Any], words: str) -> None:
    with pytest.raises(cdsm.InvalidInput, match=words):
        arm_of(FINGER, path)


def test_a_posture_that_puts_a_site_into_a_pulley_names_both_and_the_remedy() -> None:
    near = Site("phalanx", (-0.012, 0.0, 0.003))
    arm = arm_of(FINGER, [START, _pulley(position=(0.015, 0.0, 0.002)), near, END])
    arm.at([0.0, -2.5])
    with pytest.raises(cdsm.InvalidInput, match=r"cable1.*pulley on palm.*inside it") as caught:
        arm.at([0.0, 0.0])
    assert "smaller radius" in str(caught.value)


def test_a_cable_too_far_beside_a_groove_is_refused_and_a_smooth_pulley_takes_it() -> None:
    start = Site("palm", (0.02, 0.02, 0.008))
    with pytest.raises(cdsm.InvalidInput, match="too far beside its groove"):
        arm_of(FINGER, [start, PULLEY, END]).at([0.0, 0.5])
    arm_of(FINGER, [start, _pulley(groove=False), END]).at([0.0, 0.5])


def test_an_end_on_the_rim_of_a_pulley_of_another_link_is_refused() -> None:
    """The site would slide on the surface; fixed to the link of the pulley it does not."""
    rim = Site("phalanx", (0.008, 0.0, 0.0))
    with pytest.raises(cdsm.InvalidInput, match="rim of the pulley on palm"):
        arm_of(FINGER, [START, PULLEY, rim]).at([0.0, 0.3])


def test_an_arm_says_which_pulleys_its_cables_do_not_touch() -> None:
    high = Site("palm", (-0.02, 0.0, 0.009)), Site("phalanx", (0.022, 0.0, 0.009))
    with pytest.warns(cdsm.CdsmWarning, match="cable1 does not touch the pulley on palm"):
        arm_of(FINGER, [high[0], PULLEY, high[1]])


@pytest.mark.parametrize("turn", ["+", "-"])
def test_a_pulley_at_a_joint_is_one_on_its_axis(turn: Any) -> None:
    sign = 1.0 if turn == "+" else -1.0
    ends = Site("palm", (-0.02, 0.0, sign * 0.002)), Site("phalanx", (0.022, 0.0, sign * 0.002))
    arm = arm_of(FINGER, [ends[0], JointPulley("to_phalanx", 0.008, turn), ends[1]])
    (pulley,) = arm.cables[0].pulleys
    assert pulley == Pulley("palm", (0.03, 0.0, 0.0), (0.0, sign, 0.0), 0.008)
    pose = arm.at([0.1, 0.2])
    assert pose.moment_arms["cable1", "to_phalanx"] == pytest.approx(-sign * 0.008, abs=1e-15)


def test_a_pulley_at_a_joint_that_is_none_is_refused() -> None:
    with pytest.raises(cdsm.InvalidInput, match=r"cable1.*knuckle"):
        arm_of(FINGER, [START, JointPulley("knuckle", 0.008), END])


def test_files_of_arms_keep_pulleys_and_sheaths(tmp_path: Any) -> None:
    flexor = [Sheath(0.4, wrap=3.1, friction=0.1), START, PULLEY, END]
    drum = [START, _pulley(groove=False, turns=1, axis=(0.1, 2.0, 0.0)), END]
    arm = arm_of(FINGER, flexor, drum)
    file = arm.write(tmp_path / "ARM.toml")
    assert cdsm.Manipulator.read(file) == arm
    assert arm.at([0.1, 0.2]).cable_lengths[0] > 0.4


def test_a_file_gives_a_pulley_at_a_joint_in_one_line(tmp_path: Any) -> None:
    arm = arm_of(FINGER, [START, JointPulley("to_phalanx", 0.008, "+"), END])
    file = arm.write(tmp_path / "ARM.toml")
    text = file.read_text(encoding="utf-8")
    line = next(line for line in text.splitlines() if "radius" in line)
    short = '    { joint = "to_phalanx", radius = 0.008, turn = "+" },'
    file.write_text(text.replace(line, short), encoding="utf-8")
    assert cdsm.Manipulator.read(file) == arm


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ('{ link = "palm", xyz = [0, 0, 0], radius = 0.008 }', r"sites\[2\].axis: is missing"),
        ('{ joint = "to_phalanx", radius = 0.008, turn = "left" }', r"sites\[2\].turn"),
        ('{ joint = "knuckle", radius = 0.008 }', "knuckle"),
        ("{ sheath = -0.4 }", r"sites\[2\].sheath"),
        ('{ link = "palm", xyz = [0, 0, 0], axis = [0, 0, 0], radius = 0.008 }', "no direction"),
        ('{ link = "palm", xyz = [0, 0, 0], radios = 0.008 }', "radius"),
    ],
)
def test_faults_of_files_name_the_entry(entry: str, words: str, tmp_path: Any) -> None:
    file = arm_of(FINGER, [START, PULLEY, END]).write(tmp_path / "ARM.toml")
    text = file.read_text(encoding="utf-8")
    line = next(line for line in text.splitlines() if "radius" in line)
    file.write_text(text.replace(line, f"    {entry},"), encoding="utf-8")
    with pytest.raises(cdsm.CdsmError, match=words):
        cdsm.Manipulator.read(file)


def test_postures_tell_where_cables_are_about_to_lift_off() -> None:
    arm = arm_of(FINGER, [START, PULLEY, END])
    wrap = arm.at([0.0, 0.0]).wraps.angle[0]
    near = arm.at([0.0, 0.001 - wrap])
    assert "lifting off the pulley on palm" in near.remarks[0]
    assert arm.at([0.0, 0.1 - wrap]).remarks == ()
    lifted = arm.at([0.0, -0.1 - wrap])
    assert not lifted.wraps.touches[0]
    assert "does not touch" in str(lifted.wraps)
    held = arm.with_springs({"to_palm": 1.0, "to_phalanx": 1.0}).at(near.q)
    assert near.remarks[0] in cdsm.stiffness(held, [5.0]).warnings


def test_the_table_of_wraps_has_contacts_on_the_pulley() -> None:
    pose = arm_of(FINGER, [START, PULLEY, END]).at([0.0, 0.4])
    table = pose.wraps
    assert table.cable == ("cable1",)
    assert table.entry == (2,)
    assert table.link == ("palm",)
    for contact in (table.arrival[0], table.departure[0]):
        assert np.hypot(*(contact - [0.03, 0.0, 0.0])[[0, 2]]) == pytest.approx(0.008, abs=1e-15)
    chord = np.linalg.norm(table.arrival - table.departure)
    assert chord == pytest.approx(2 * 0.008 * np.sin(table.angle[0] / 2), abs=1e-15)
    assert abs(table.fleet_angles).max() < 1e-15
    assert table.to_dict()["angle_rad"] == pytest.approx(table.angle)


def test_postures_are_the_same_after_pickling() -> None:
    pose = arm_of(FINGER, [START, PULLEY, END]).at([0.05, 0.4])
    again = pickle.loads(pickle.dumps(pose))
    np.testing.assert_array_equal(again.wraps.angle, pose.wraps.angle)
    np.testing.assert_array_equal(again.length_hessian, pose.length_hessian)


@pytest.mark.parametrize(
    ("element", "words"),
    [(PULLEY, "over the pulley on palm"), (Sheath(0.1), "through a sheath")],
)
def test_tolerances_refuse_pulleys_and_sheaths_by_name(element: Any, words: str) -> None:
    arm = arm_of(FINGER, [START, element, END])
    pose = arm.with_springs({"to_palm": 1.0, "to_phalanx": 1.0}).at([0.05, 0.4])
    with pytest.raises(cdsm.InvalidInput, match=f"site: .*cable1.*{words}, and .*pulley_radius"):
        cdsm.uncertainty(pose, [5.0], cdsm.Tolerances(site=1e-4), direction="y")
    budget = cdsm.uncertainty(pose, [5.0], cdsm.Tolerances(rigidity=0.05), direction="y")
    assert budget.contributions.keys() == {"rigidity"}
