"""CASPR's model files: read into a manipulator, or refused by name."""

import pickle
import re
from pathlib import Path

import numpy as np
import pytest

import cdsm
from tests.support import caspr_models
from tests.support.differences import assert_second_order
from tests.support.locked import unbalanced_torque

LAW = cdsm.LinearElasticity(2e4)

LINK = """
<link_rigid num="{num}" name="{name}">
  <joint type="{kind}" q_initial="0" q_min="{low}" q_max="{high}"{more}/>
  <physical>
    <mass>{mass}</mass>
    <com_location>0.01 0.05 -0.02</com_location>
    <end_location>0.0 0.12 0.0</end_location>
    <inertia ref="{ref}">
      <Ixx>0.003</Ixx><Iyy>0.002</Iyy><Izz>0.004</Izz><Ixy>0.0001</Ixy><Ixz>0</Ixz><Iyz>0</Iyz>
    </inertia>
  </physical>
  <parent><num>{parent}</num><location>0.01 0.1 0.03</location></parent>
</link_rigid>"""

CABLE = """
<cable_ideal name="{name}" attachment_reference="{ref}">
  <properties><force_min>{low}</force_min><force_max>{high}</force_max></properties>
  <attachments>
    <attachment><link>0</link><location>0.05 0.0 0.04</location></attachment>
    <attachment><link>1</link><location>0.04 0.06 0.03</location></attachment>
    <attachment><link>2</link><location>-0.03 0.02 0.04</location></attachment>
  </attachments>
</cable_ideal>"""

DOCTYPE = '<!DOCTYPE {0} SYSTEM "../../../templates/{1}.dtd">\n'


def link(num: int, kind: str, parent: int | None = None, **changes: object) -> str:
    size = caspr_models.coordinates(kind)
    fields = {"num": num, "name": f"part {num}", "kind": kind, "more": "", "mass": 0.3}
    fields |= {"low": " ".join(["-0.5"] * size), "high": " ".join(["0.6"] * size), "ref": "com"}
    return LINK.format(**{"parent": num - 1 if parent is None else parent, **fields, **changes})


def cable(**changes: object) -> str:
    return CABLE.format(**{"name": "one", "ref": "joint", "low": 1, "high": 80, **changes})


def folder(path: Path, links: str, cables: str, doctype: bool = True) -> Path:
    head = DOCTYPE if doctype else ""
    texts = {
        "bodies": '<?xml version="1.0" encoding="utf-8"?>\n'
        f"{head.format('bodies_system', 'bodies')}"
        f"<bodies_system><links>{links}</links></bodies_system>",
        "cables": f"{head.format('cables', 'cables')}"
        f'<cables default_cable_set="all"><cable_set id="all">{cables}</cable_set>'
        f'<cable_set id="none"></cable_set></cables>',
    }
    for name, text in texts.items():
        (path / f"toy_{name}.xml").write_text(text, encoding="utf-8")
    return path


BRANCHES = (
    ("trunk", "U_XZ", 0),
    ("right", "S_FIXED_XYZ", 1),  # behind "left" by name
    ("left", "S_EULER_XYZ", 1),
    ("head", "S_FIXED_XYZ", 1),
    ("right hand", "R_AXIS", 2),  # carried by the second, numbered after the fourth
    ("left hand", "PLANAR_XZ", 3),
    ("right finger", "S_FIXED_XYZ", 5),
)
"""Links with their joints and parents, numbered across the branches."""

COORDINATES = {
    "U_XY": 2, "U_YZ": 2, "U_XZ": 2, "R_X": 1, "R_Y": 1, "R_Z": 1, "R_AXIS": 1, "P_AXIS": 1,
    "S_EULER_XYZ": 3, "S_FIXED_XYZ": 3, "P_X": 1, "P_XY": 2, "P_XZ": 2, "T_XYZ": 3,
    "PLANAR_XY": 3, "PLANAR_YZ": 3, "PLANAR_XZ": 3, "SPATIAL_EULER_XYZ": 6,
}  # fmt: skip


def tree(path: Path, rows: tuple[tuple[str, str, int], ...]) -> Path:
    """The folder of a model of such links, each with limits of its own, and six cables."""
    rng = np.random.default_rng(len(rows))
    links, at = "", 0
    for number, (name, kind, parent) in enumerate(rows, start=1):
        count = COORDINATES[kind]
        low, high = (
            " ".join(f"{side * (0.7 + 0.01 * i):g}" for i in range(at, at + count))
            for side in (-1, 1)
        )
        more = ' axis="1 -2 0.5"' if kind.endswith("AXIS") else ""
        links += link(number, kind, parent, name=name, low=low, high=high, more=more)
        at += count
    cables = ""
    for c in range(6):
        sites = sorted(rng.choice(len(rows) + 1, size=4, replace=False))
        points = "".join(
            f"<attachment><link>{site}</link>"
            f"<location>{' '.join(f'{x:.4f}' for x in rng.uniform(-0.1, 0.1, 3))}</location>"
            "</attachment>"
            for site in sites
        )
        cables += (
            f'<cable_ideal name="c{c}" attachment_reference="{"com" if c % 2 else "joint"}">'
            "<properties><force_min>1</force_min><force_max>90</force_max></properties>"
            f"<attachments>{points}</attachments></cable_ideal>"
        )
    return folder(path, links, cables)


def assert_is_the_files(path: Path) -> cdsm.Manipulator:
    """Assert that the lengths at any q, and the limits, are those of the XML in its order."""
    arm = cdsm.read_caspr(path, elasticity=LAW)
    bodies, cables = path / "toy_bodies.xml", path / "toy_cables.xml"
    np.testing.assert_array_equal([arm.lower, arm.upper], caspr_models.limits(bodies))
    rng = np.random.default_rng(arm.nv)
    for _ in range(5):
        q = rng.uniform(arm.lower, arm.upper)
        expected = caspr_models.lengths(bodies, cables, q)
        np.testing.assert_allclose(arm.at(q).cable_lengths, expected, rtol=1e-14, atol=0.0)
        np.testing.assert_allclose(arm.at(q).cable_lengths, expected, rtol=1e-14, atol=0.0)
    return arm


@pytest.mark.parametrize("kind", COORDINATES)
def test_coordinates_of_each_joint_type_are_the_files(kind: str, tmp_path: Path) -> None:
    assert caspr_models.coordinates(kind) == COORDINATES[kind]
    assert_is_the_files(tree(tmp_path, (("b", "U_YZ", 0), ("a", kind, 1), ("c", "R_Z", 2))))


def test_coordinates_across_branches_are_the_files(tmp_path: Path) -> None:
    arm = assert_is_the_files(tree(tmp_path, BRANCHES))
    assert arm.joint_names[11:15] == (
        *("right hand_turn", "left hand_slide_x", "left hand_slide_z", "left hand_y"),
    )


@pytest.mark.parametrize("tip", ["right finger", "left hand", "head"])
def test_derivatives_hold_whatever_the_order_of_q(tip: str, tmp_path: Path) -> None:
    """Every term of Eq. 16 where parents come after children; the tip on each branch."""
    last = next(i for i, row in enumerate(BRANCHES) if row[0] == tip) + 1
    whole = cdsm.read_caspr(tree(tmp_path, BRANCHES), elasticity=LAW)
    arm = cdsm.Manipulator.from_urdf(
        whole.urdf,
        whole.cables,
        tip=BRANCHES[last - 1][0],
        joint_names=whole.joint_names,
        gravity=(1.0, -3.0, -9.0),
    )
    q = np.random.default_rng(last).uniform(arm.lower, arm.upper) / 2.0
    W = np.array([3.0, -2.0, 5.0, 0.4, -0.3, 0.2])
    F = np.linspace(20.0, 60.0, 6)
    pose = arm.at(q)
    K = cdsm.stiffness(pose, F, wrench=W)
    assert_second_order(lambda y: arm.at(y).cable_lengths, pose.length_jacobian, q)
    assert_second_order(lambda y: arm.at(y).tip[:3, 3], pose.jacobian[:3], q)
    assert_second_order(unbalanced_torque(K), K.joint, q, size=100.0)
    joint = cdsm.evaluate(arm, q[None], F[None], W[None], ("joint",))["joint"][0]
    np.testing.assert_allclose(joint, K.joint, rtol=0.0, atol=1e-13 * abs(K.joint).max())
    assert pickle.loads(pickle.dumps(arm)).joint_names == whole.joint_names


def test_inertia_about_the_joint_is_moved_to_the_centre(tmp_path: Path) -> None:
    links = link(1, "R_Y", ref="joint", mass=0.05) + link(2, "R_X", mass=0)
    arm = cdsm.read_caspr(folder(tmp_path, links, cable()), elasticity=LAW)
    # of one link about its joint's y axis that is what the file says
    assert arm.body.mass_matrix(np.zeros(2))[0, 0] == pytest.approx(0.002, rel=1e-12)


def test_files_may_be_given_one_by_one(tmp_path: Path) -> None:
    folder(tmp_path, link(1, "R_Y") + link(2, "R_X"), cable() + cable(), doctype=False)
    bodies, cables = tmp_path / "toy_bodies.xml", tmp_path / "toy_cables.xml"
    arm = cdsm.read_caspr(bodies, cables, elasticity=LAW, cable_set="all")
    assert arm == cdsm.read_caspr(tmp_path, elasticity=LAW)
    first, again = arm.cables
    assert (first.name, again.name) == ("one", "one #2")
    assert (first.minimum, first.maximum, first.elasticity) == (1.0, 80.0, LAW)
    with pytest.raises(cdsm.InvalidInput, match="file of the cables"):
        cdsm.read_caspr(bodies, elasticity=LAW)
    for name, said in (
        ("al", "no set of cables is called 'al'"),
        ("none", "holds no cables; sets with cables are 'all'"),
    ):
        with pytest.raises(cdsm.FileError, match=said):
            cdsm.read_caspr(tmp_path, elasticity=LAW, cable_set=name)


TWO = link(1, "R_Y") + link(2, "R_X")
PULLEY = cable().replace("<attachment><link>0", "<base_rotating_pulley><link>0")
PULLEY = PULLEY.replace("</attachment>", "</base_rotating_pulley>", 1)


@pytest.mark.parametrize(
    ("links", "cables", "said"),
    [
        (link(1, "R_Y").replace("R_Y", "S_QUATERNION"), cable(), "'S_QUATERNION' is not supported"),
        (link(1, "R_Y") + link(3, "R_X"), cable(), "numbered ['1', '3']; 1 to"),
        (link(1, "R_Y") + link(2, "R_X", parent=2), cable(), "its parent is link 2; one of 0 to 1"),
        (link(1, "R_Y", mass=-1), cable(), "<mass> -1 kg"),
        (link(1, "R_Y", ref="moon"), cable(), "com or joint is needed"),
        (link(1, "R_Y", low="0.7"), cable(), "q_min 0.7 is above q_max 0.6"),
        (link(1, "R_Y"), cable(), "one: <link> is link 2; one of 0 to 1"),
        (TWO, cable().replace("cable_ideal", "cable_vsd"), "<cable_vsd> one: only <cable_ideal>"),
        (TWO, PULLEY, "<base_rotating_pulley> is not supported"),
        (TWO, cable(low=9, high=4), "tensions from 9 to 4 N"),
    ],
)
def test_what_cannot_be_mapped_is_named(links: str, cables: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(cdsm.FileError, match=re.escape(said)):
        cdsm.read_caspr(folder(tmp_path, links, cables), elasticity=LAW)


@pytest.mark.parametrize("kind", ['SYSTEM "file:///etc/passwd"', '[<!ENTITY a "b">]'])
def test_no_other_doctype_is_let_pass(kind: str, tmp_path: Path) -> None:
    file = folder(tmp_path, TWO, cable(), doctype=False) / "toy_bodies.xml"
    _, body = file.read_text(encoding="utf-8").split("\n", 1)
    file.write_text(f"<!DOCTYPE bodies_system {kind}>{body}")
    with pytest.raises(cdsm.FileError, match="DOCTYPE"):
        cdsm.read_caspr(tmp_path, elasticity=LAW)
