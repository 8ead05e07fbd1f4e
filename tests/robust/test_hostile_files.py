"""URDFs that could crash Pinocchio or fill the memory, and files that cannot be read."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

import cdsm
from cdsm.support.files import write_file
from tests.support.foreign import TREE, crab
from tests.support.patience import HANGS


@pytest.mark.parametrize(
    "entities",
    [
        '<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;">',
        '<!ENTITY c SYSTEM "file:///etc/passwd">',
    ],
)
def test_entities_are_not_expanded(entities: str, tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    start = TREE.index("<robot")
    text = TREE[start:].replace("</robot>", "&c;</robot>")
    path.write_text(f"<!DOCTYPE robot [{entities}]>{text}", encoding="utf-8")
    with pytest.raises(cdsm.GeometryError, match="DOCTYPE"):
        cdsm.Manipulator.from_urdf(path, crab().cables, tip="tip")


def test_a_full_disk_leaves_the_file_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text("old", encoding="utf-8")

    def full(aside: Path) -> None:
        aside.write_text("half", encoding="utf-8")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(cdsm.FileError, match="cannot be written: No space left on device"):
        write_file(path, full)
    assert [each.read_text(encoding="utf-8") for each in tmp_path.iterdir()] == ["old"]


_CRASH = """
import sys, resource, warnings
import cdsm
warnings.simplefilter("ignore", cdsm.CdsmWarning)
from tests.support.foreign import joint_element, link_element

def tree(count, parent, kind="revolute"):
    #Links and joints of a tree, whose joint i hangs on the link of this number.
    links = [link_element(f"l{i}") for i in range(count + 1)]
    joints = [
        joint_element(f"j{i}", kind if i else "revolute", f"l{parent(i)}", f"l{i + 1}", *PLACE)
        for i in range(count)
    ]
    return "".join([*links, *joints])

PLACE = ("0.1 0 0", "0 0 0", "0 1 0")
two = link_element("l0") + link_element("l1")
hinge = joint_element("j", "revolute", "l0", "l1", *PLACE)
heavy = link_element("l0") + link_element("l1", 1.0)
ROBOTS = {
    "400 universal joints": tree(800, lambda i: i),
    "4500 fixed joints": tree(4500, lambda i: i, "fixed"),
    "3000 branches": tree(3000, lambda i: 0),
    "a loop": two + hinge + joint_element("k", "revolute", "l1", "l1", *PLACE),
    "no links": hinge,
    "nan mass": heavy.replace('mass value="1.0"', 'mass value="nan"') + hinge,
    "nan inertia": heavy.replace('ixx="2e-3"', 'ixx="nan"') + hinge,
    "infinite place": two + hinge.replace("0.1 0 0", "inf 0 0"),
    "huge place": two + hinge.replace("0.1 0 0", "1e300 0 0"),
    "nan limits": two + hinge.replace('lower="-0.9"', 'lower="nan"'),
    "a huge name": two.replace("l0", "l" * 1_000_000) + hinge.replace("l0", "l" * 1_000_000),
    "an empty name": two.replace('"l0"', '""') + hinge.replace('"l0"', '""'),
    "a name called universe": two.replace("l0", "universe") + hinge.replace("l0", "universe"),
    "a joint called universe": two + hinge.replace('name="j"', 'name="universe"'),
    "a joint called root_joint": two + hinge.replace('name="j"', 'name="root_joint"'),
    "a joint called as its link": two + hinge.replace('name="j"', 'name="l1"'),
    "a mesh that is not there": two.replace(
        '<link name="l1">',
        '<link name="l1"><visual><geometry><mesh filename="/no.stl"/></geometry></visual>'
        '<collision><geometry><mesh filename="package://no/no.dae"/></geometry></collision>',
    ) + hinge,
}
ALLOWED = {"a name called universe", "a joint called root_joint", "a joint called as its link",
           "a mesh that is not there", "a joint called universe", "huge place"}
resource.setrlimit(resource.RLIMIT_AS, (4 * 2**30,) * 2)
for name, inside in ROBOTS.items():
    links = ("l0", "l1")
    cable = cdsm.Cable(name="c", sites=tuple(cdsm.Site(l, (0.0, 0.01, 0.0)) for l in links),
                       elasticity=cdsm.LinearElasticity(1e4))
    try:
        arm = cdsm.Manipulator.from_urdf(f'<robot name="r">{inside}</robot>', (cable,), tip="l1")
        arm.at([0.1] * arm.nv)
        assert name in ALLOWED, name
        print("read", name)
    except cdsm.CdsmError as error:
        print(type(error).__name__, name)
"""


def test_robots_that_crash_pinocchio_are_refused() -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", _CRASH],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=HANGS,
        check=False,
    )
    assert done.returncode == 0, f"{done.returncode}\n{done.stdout}\n{done.stderr[-3000:]}"
    assert "GeometryError 4500 fixed joints" in done.stdout
