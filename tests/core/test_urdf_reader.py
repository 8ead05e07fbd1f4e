"""URDFs of strangers: what is let in, and that everything else is refused by name."""

from pathlib import Path

import pytest

import cdsm
from cdsm.support.xml import DEEPEST
from cdsm.urdf_reader import read_urdf

LINK = (
    '<link name="{0}"><inertial><mass value="0.2"/>'
    '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
)
LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
HINGE = (
    '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/>'
    f'<axis xyz="0 1 0"/>{LIMIT}</joint>'
)


def robot(*parts: str, name: str = "bot") -> str:
    return f'<robot name="{name}">{"".join(parts)}</robot>'


def chain() -> list[str]:
    return [
        LINK.format("a"),
        LINK.format("b"),
        LINK.format("c"),
        HINGE.format("j1", "a", "b"),
        HINGE.format("j2", "b", "c"),
    ]


def changed(before: str, after: str) -> str:
    text = robot(*chain())
    assert before in text
    return text.replace(before, after, 1)


def test_text_and_file_are_read_alike(tmp_path: Path) -> None:
    text = robot(*chain())
    path = tmp_path / "bot.urdf"
    path.write_text(text, encoding="utf-8")
    assert read_urdf(text) == read_urdf(path) == read_urdf(str(path)) == text


def test_declaration_and_byte_order_mark_are_no_faults(tmp_path: Path) -> None:
    path = tmp_path / "bot.urdf"
    text = '<?xml version="1.0" encoding="ISO-8859-1"?>\n' + robot(*chain(), name="bött")
    path.write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert "bött" in read_urdf(path)


def test_generated_arms_pass() -> None:
    arm = cdsm.presets.virtual_prototype()
    assert read_urdf(arm.urdf) == arm.urdf


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            changed('type="revolute"', 'type="continuous"'),
            "j1: type 'continuous' is not supported",
        ),
        (changed('type="revolute"', 'type="floating"'), "fix the base"),
        (changed('type="revolute"', 'type="planar"'), "two prismatic and one revolute"),
        (changed('type="revolute"', 'type="bendy"'), "one of revolute, prismatic, fixed"),
        (changed("<axis", '<mimic joint="j2"/><axis'), "joint j1: mimics"),
        (changed('xyz="0 1 0"', 'xyz="0 0 0"'), "joint j1: axis '0 0 0' has no direction"),
        (changed('xyz="0 1 0"', 'xyz="0 1"'), "3 numbers are needed"),
        (changed('xyz="0 1 0"', 'xyz="0 nan 0"'), "it must be finite"),
        (changed('lower="-1"', 'lower="2"'), "joint j1: lower limit 2 above the upper one 1"),
        (changed('lower="-1"', 'lower="-inf"'), "j1: lower limit: '-inf' given"),
        (changed("<axis", "<orgin/><axis"), "joint j1: <orgin> is not known; did you mean origin?"),
        (
            changed("<axis", '<origin rpy_="0 0 1"/><axis'),
            "joint j1: <origin> has rpy_, which is not known; did you mean rpy?",
        ),
        (changed('xyz="0 1 0"', 'xzy="0 1 0"'), "joint j1: <axis> has xzy"),
        (changed("<axis", "<origin/><origin/><axis"), "joint j1: has 2 <origin>; one is needed"),
        (changed('<link name="a">', '<link name="a"><inertail/>'), "link a: <inertail> is not"),
        (changed("<joint", '<jiont name="j0"/><joint'), "<jiont> is not known"),
        (
            changed("<link", '<xacro:arm xmlns:xacro="http://ros.org/wiki/xacro"/><link'),
            "<xacro:arm> is left; run xacro",
        ),
        (changed(' effort="1"', ""), 'joint j1: <limit> has no effort; write effort="0"'),
        (
            changed('<limit lower="-1" upper="1" effort="1" velocity="1"/>', ""),
            "j1: has no <limit>",
        ),
        (changed('<mass value="0.2"/>', '<mass value="-0.2"/>'), "link a: mass -0.2 kg"),
        (changed('<mass value="0.2"/>', '<mass value="1,5"/>'), "link a: mass: '1,5' given"),
        (changed('<mass value="0.2"/>', ""), "link a: mass"),
        (changed('ixx="1e-4"', 'ixx="3e-4"'), "link a: principal moments"),
        (changed('ixx="1e-4"', 'ixx="-1e-4"'), "which no body has"),
        (changed('ixx="1e-4"', 'ixx="1_0"'), "a number is needed"),
        (changed('<child link="c"/>', '<child link="b"/>'), "joins link b to itself"),
        (changed('<parent link="b"/>', '<parent link="x"/>'), "there is no link x"),
        (changed('<parent link="a"/>', ""), "joint j1: has no <parent"),
        (changed('<link name="c">', '<link name="b">'), "link b: the name is used twice"),
        (changed('name="j2"', 'name="j1"'), "joint j1: the name is used twice"),
        (changed('<link name="c">', "<link>"), "has no name"),
        (changed('<robot name="bot">', "<robot>"), "<robot> has no name"),
        (robot(*chain(), LINK.format("d")), "roots a, d"),
        (
            robot(*chain(), HINGE.format("j3", "a", "c")),
            "two parents, by the joints j2 and j3",
        ),
        (robot(*chain(), HINGE.format("j3", "c", "a")), "roots none"),
        (
            robot(
                *chain(),
                LINK.format("d"),
                LINK.format("e"),
                HINGE.format("j3", "d", "e"),
                HINGE.format("j4", "e", "d"),
            ),
            "the links d, e hang on each other",
        ),
        (robot(LINK.format("a")), "no joint that moves"),
        (robot(), "no joint that moves"),
        ("<robot name='x'><link", "not well-formed"),
        ("<html></html>", "root element <html>"),
        ('<!DOCTYPE robot [<!ENTITY x "y">]>' + robot(*chain()), "DOCTYPE"),
        ('<!DOCTYPE robot SYSTEM "file:///etc/passwd">' + robot(*chain()), "DOCTYPE"),
        (robot(*chain(), "<x>" * DEEPEST + "</x>" * DEEPEST), "deeper than"),
        (robot(*chain(), f'<link name="{"n" * 20_000}"/>'), "20000 characters"),
    ],
)
def test_faults_are_named(text: str, said: str) -> None:
    with pytest.raises(cdsm.UrdfError) as caught:
        read_urdf(text)
    assert said in str(caught.value)
    assert len(str(caught.value)) < 4000


def test_elements_of_other_programs_are_no_faults() -> None:
    others = changed("<axis", '<dynamics damping="1"/><drive kind="belt"/><axis')
    others = others.replace("<link", '<gazebo/><ros2_control name="r"/><link', 1)
    others = others.replace("effort=", 'command_effort="2" gear_velocity="3" effort=')
    assert read_urdf(others) == others


def test_billion_laughs_are_not_expanded() -> None:
    entities = '<!ENTITY a "ha">' + "".join(
        f'<!ENTITY {chr(98 + i)} "{f"&{chr(97 + i)};" * 10}">' for i in range(9)
    )
    with pytest.raises(cdsm.UrdfError):
        read_urdf(f"<!DOCTYPE robot [{entities}]>" + robot(*chain(), name="&j;"))


def test_text_larger_than_any_robot_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "big.urdf"
    path.write_text(robot(*chain(), f"<!--{'x' * 11_000_000}-->"), encoding="utf-8")
    with pytest.raises(cdsm.CdsmError, match="larger than"):
        read_urdf(path)
    with pytest.raises(cdsm.UrdfError, match="larger than"):
        read_urdf(path.read_text(encoding="utf-8"))


def test_all_faults_are_told_at_once() -> None:
    text = changed('<mass value="0.2"/>', '<mass value="-1"/>').replace(
        'xyz="0 1 0"', 'xyz="0 0 0"'
    )
    with pytest.raises(cdsm.UrdfError) as caught:
        read_urdf(text)
    assert str(caught.value).count("\n  - ") == 3


def test_moments_of_inertia_may_be_let_pass() -> None:
    text = changed('ixx="1e-4"', 'ixx="3e-4"')
    assert read_urdf(text, check_inertia=False) == text


def test_two_hundred_joints_are_too_many_only_above_the_cap() -> None:
    def arm(count: int) -> str:
        links = [LINK.format(f"l{i}") for i in range(count + 1)]
        return robot(*links, *(HINGE.format(f"j{i}", f"l{i}", f"l{i + 1}") for i in range(count)))

    read_urdf(arm(200))
    with pytest.raises(cdsm.UrdfError, match="201 joints that move; 200 are taken"):
        read_urdf(arm(201))


def test_a_chain_that_would_overflow_the_stack_is_refused() -> None:
    links = "".join(f'<link name="l{i}"/>' for i in range(1001))
    joint = '<joint name="j{0}" type="{2}"><parent link="l{0}"/><child link="l{1}"/>{3}</joint>'
    limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
    joints = "".join(
        joint.format(i, i + 1, "fixed" if i else "revolute", "" if i else limit)
        for i in range(1000)
    )
    with pytest.raises(cdsm.UrdfError, match="1000 joints one behind the other; 400 are taken"):
        read_urdf(f'<robot name="r">{links}{joints}</robot>')
