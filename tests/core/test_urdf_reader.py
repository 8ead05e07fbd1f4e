"""URDFs of strangers: what is let in, and that everything else is refused by name."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

import cdsm
from cdsm.urdf_reader import read_urdf

DATA = Path(__file__).parents[1] / "data"
GRIPPER = (DATA / "gripper.urdf").read_text(encoding="utf-8")
CABLES = cdsm.read_cables(DATA / "gripper_cables.toml")

LINK = (
    '<link name="{0}"><inertial><mass value="0.2"/>'
    '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
HINGE = (
    '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/>'
    f'<axis xyz="0 1 0"/>{LIMIT}</joint>'
)


def robot(*parts: str) -> str:
    return f'<robot name="bot">{"".join(parts)}</robot>'


CHAIN = [*map(LINK.format, "abc"), HINGE.format("j1", "a", "b"), HINGE.format("j2", "b", "c")]


def changed(before: str, after: str) -> str:
    text = robot(*CHAIN)
    assert before in text
    return text.replace(before, after, 1)


def gripper(before: str, after: str) -> cdsm.Manipulator:
    assert before in GRIPPER
    return cdsm.Manipulator.from_urdf(GRIPPER.replace(before, after, 1), CABLES, tip="fl")


@pytest.mark.parametrize("blank", [" ", "\n", "&#13;", "\u00a0"])
def test_white_space_around_numbers_changes_nothing(
    blank: str, capfd: pytest.CaptureFixture[str]
) -> None:
    text = GRIPPER.replace(
        "<inertial>", '<visual><geometry><box size="1 2 3"/></geometry></visual><inertial>'
    )
    numbers = re.compile(r'(?<=\s)(xyz|value|size|i..|lower|upper|effort|velocity)="([^"]*)"')
    plain = read_urdf(text)
    found = list(numbers.finditer(text))
    assert len(found) > 50
    for each in found:
        spaced = f'{each[1]}="{blank}{blank.join(each[2].split(" "))}{blank}"'
        assert read_urdf(text[: each.start()] + spaced + text[each.end() :]) == plain
    everywhere = numbers.sub(rf'\1="{blank}\2{blank}"', text).replace(" 0", f"{blank}0")
    assert read_urdf(everywhere) == plain
    digits = read_urdf(changed("1e-4", "1.00000000000000023E-4 "))
    inertia = etree.fromstring(digits).find("link/inertial/inertia")
    assert float(str(inertia.get("ixx"))) == 1.00000000000000023e-4
    assert capfd.readouterr().err == ""  # Pinocchio complains of nothing


def test_an_axis_left_out_is_x() -> None:
    joint = '<origin xyz="0.1 0 0"/><axis xyz="0 1 0"/>'
    arm = gripper(joint, joint.replace('<axis xyz="0 1 0"/>', ""))
    np.testing.assert_allclose(arm.at([0.0, 0.3]).jacobian[3:, 1], [1.0, 0.0, 0.0], atol=1e-15)


def test_limits_that_look_like_degrees_are_doubted() -> None:
    with pytest.warns(cdsm.CdsmWarning, match=r"joint j2: limits -90 to 90 rad .* Degrees\?"):
        gripper('lower="-1" upper="1"', 'lower="-90" upper="90"')


def test_links_that_move_without_mass_are_noted() -> None:
    inertial = re.search("<inertial>.*?</inertial>", GRIPPER)
    assert inertial is not None
    with pytest.warns(cdsm.CdsmWarning, match="links that move without mass: l1"):
        gripper(inertial[0], "")
    cross = GRIPPER.replace(inertial[0], "").replace('<origin xyz="0.1 0 0"/>', "")
    with warnings.catch_warnings():  # l1 is now the cross of a universal joint
        warnings.simplefilter("error")
        read_urdf(cross)


LINKS = [LINK.format(f"l{i}") for i in range(402)]
FIXED = HINGE.replace("revolute", "fixed")
LONG = [*LINKS, HINGE.format("j0", "l0", "l1")]
LONG += [FIXED.format(f"j{i}", f"l{i}", f"l{i + 1}") for i in range(1, 401)]
CIRCLE = HINGE.format("j3", "d", "e"), HINGE.format("j4", "e", "d")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (changed('type="revolute"', 'type="floating"'), "fix the base"),
        (changed('type="revolute"', 'type="bendy"'), "one of revolute, continuous"),
        (changed("<axis", '<mimic joint="j9"/><axis'), "joint j1: mimics 'j9'"),
        (changed('xyz="0 1 0"', 'xyz="0 0 0"'), "joint j1: its axis"),
        (changed('xyz="0 1 0"', 'xyz="0 nan 0"'), "finite"),
        (changed('lower="-1"', 'lower="2"'), "joint j1: lower limit 2"),
        (changed("<link", '<xacro:arm xmlns:xacro="http://ros.org/wiki/xacro"/><link'), "xacro"),
        (changed(' effort="1"', ""), 'joint j1: <limit> has no effort; write effort="0"'),
        (changed('<mass value="0.2"/>', '<mass value="-0.2"/>'), "link a: mass -0.2 kg"),
        (changed('<mass value="0.2"/>', ""), "link a: has no <mass>"),
        (changed('ixx="1e-4"', 'ixx="3e-4"'), "link a: principal moments"),
        (changed('<parent link="b"/>', '<parent link="x"/>'), "no link x"),
        (changed('<link name="c">', '<link name="b">'), "link b: the name is used twice"),
        (robot(*CHAIN, LINK.format("d")), "roots a, d"),
        (robot(*CHAIN, HINGE.format("j3", "a", "c")), "two parents, by the joints j2 and j3"),
        (robot(*CHAIN, *map(LINK.format, "de"), *CIRCLE), "the links d, e hang on each other"),
        (robot(*LONG), "401 joints one behind the other"),
        (robot(LINK.format("a")), "has 0 joints that move"),
        ("<robot name='x'><link", "not well-formed"),
        ("<mujoco></mujoco>", "MJCF"),
        (robot(*CHAIN, "<x>" * 300 + "</x>" * 300), "depth"),
    ],
)
def test_faults_are_named(text: str, said: str) -> None:
    with pytest.raises(cdsm.GeometryError) as caught:
        read_urdf(text)
    assert said in str(caught.value)
    assert len(str(caught.value)) < 4000


def test_all_faults_are_told_at_once() -> None:
    text = changed('<mass value="0.2"/>', '<mass value="-1"/>').replace(
        'xyz="0 1 0"', 'xyz="0 0 0"'
    )
    with pytest.raises(cdsm.GeometryError) as caught:
        read_urdf(text)
    assert str(caught.value).count("\n  - ") == 3
