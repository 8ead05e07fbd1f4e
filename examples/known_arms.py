"""Write arms that people know from papers into ``urdf/``: one ARM.toml and one URDF each.

    python examples/known_arms.py

Two are the prototypes of the paper that cdsm implements, as its presets assume them. Four have the
dimensions of models of CASPR (darwinlau/CASPR, BSD-3-Clause, commit a6971ee), one is a structure
that was measured. The comment of each TOML says where its numbers are from, and which are chosen.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import tensegrity_simplex

import cdsm

FOLDER = Path(__file__).parents[1] / "urdf"

WIRE = cdsm.LinearElasticity(48e3)
"""Chosen: EA [N] of a steel strand of 1.2 mm; cables of CASPR do not stretch."""

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
"""Axes of joints."""

Point = tuple[float, float, float]


class Body(NamedTuple):
    """A link behind joints whose axes meet in one point.

    Attributes:
        name: Of the link.
        at: That point in the frame of the link before [m].
        axes: Of the joints, in their order.
        limit: Of the joints, in both directions [rad].
        mass: [kg].
        centre: Centre of mass [m].
        inertia: ixx, iyy, izz about it [kg m²].
    """

    name: str
    at: Point
    axes: tuple[Point, ...]
    limit: float
    mass: float
    centre: Point
    inertia: Point


def chain(name: str, bodies: Sequence[Body], tip: Point) -> str:
    """Write the URDF of bodies in series; ``tool0`` is at ``tip`` of the last one."""
    rows = [f'<robot name="{name}">', '  <link name="base"/>']
    parent = "base"
    for body in bodies:
        at = body.at
        for i, axis in enumerate(body.axes, start=1):
            last = i == len(body.axes)
            child = body.name if last else f"{body.name}_{i}"
            rows += [
                f'  <link name="{child}">',
                *(_inertial(body) if last else ()),
                "  </link>",
                f'  <joint name="{body.name}_joint{i}" type="revolute">',
                f'    <parent link="{parent}"/>',
                f'    <child link="{child}"/>',
                f'    <origin xyz="{_text(at)}"/>',
                f'    <axis xyz="{_text(axis)}"/>',
                f'    <limit lower="{-body.limit}" upper="{body.limit}" effort="1" velocity="1"/>',
                "  </joint>",
            ]
            parent, at = child, (0.0, 0.0, 0.0)
    rows += [
        '  <link name="tool0"/>',
        '  <joint name="tool0_joint" type="fixed">',
        f'    <parent link="{parent}"/>',
        '    <child link="tool0"/>',
        f'    <origin xyz="{_text(tip)}"/>',
        "  </joint>",
        "</robot>",
        "",
    ]
    return "\n".join(rows)


def _inertial(body: Body) -> list[str]:
    ixx, iyy, izz = body.inertia
    return [
        "    <inertial>",
        f'      <origin xyz="{_text(body.centre)}"/>',
        f'      <mass value="{body.mass}"/>',
        f'      <inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/>',
        "    </inertial>",
    ]


def _text(point: Sequence[float]) -> str:
    return " ".join(map(repr, point))


def sjtu_snake() -> cdsm.Manipulator:
    """Build the snake of Tang et al. (2017): 12 universal joints, 36 cables."""
    radius, after, before, length = 0.019, 0.01357, 0.09257, 0.09921
    bodies = [
        Body(
            f"link{k}",
            (length if k > 1 else 0.0, 0.0, 0.0),
            (Z, Y),
            0.35,
            0.061973305,
            (0.0477162, 0.0, 0.0),
            (2.459410464e-5, 8.238686351e-5, 8.257404573e-5),
        )
        for k in range(1, 13)
    ]
    cables = []
    for k in range(1, 13):
        for j in range(3):
            angle = math.radians(60 - 10 * k - 120 * j)
            y, z = radius * math.sin(angle), radius * math.cos(angle)
            sites = [cdsm.Site("base", (-after, y, z))]
            for i in range(1, k + 1):
                sites += [cdsm.Site(f"link{i}", (x, y, z)) for x in (after, before)]
            cables.append(cdsm.Cable(f"cable{k}_{j + 1}", tuple(sites[:-1]), WIRE))
    urdf = chain("sjtu_snake", bodies, (length, 0.0, 0.0))
    return cdsm.Manipulator.from_urdf(urdf, cables, tip="tool0")


def carex() -> cdsm.Manipulator:
    """Build the exoskeleton of Mao and Agrawal (2012): shoulder and elbow, 6 cables."""
    upper = Body(
        "upper_arm",
        (0.0, 0.0, 0.0),
        (X, Y, Z),
        3.1416,
        3.0,
        (0.0, 0.0, -0.13),
        (0.0225, 0.0225, 1e-4),
    )
    fore = Body(
        "forearm", (0.0, 0.0, -0.3), (Y,), 3.1416, 2.0, (0.0, 0.0, -0.12), (0.0131, 0.0131, 1e-4)
    )
    front, back = (0.2, 0.0, 0.0), (-0.2, 0.0, 0.0)
    routes: list[tuple[Point, Point, Point | None]] = [
        (front, (0.065, 0.0, -0.26), (0.06, 0.0, -0.24)),
        (front, (0.0, -0.065, -0.26), None),
        (back, (-0.065, 0.0, -0.26), (-0.06, 0.0, -0.24)),
        (back, (0.0, -0.065, -0.26), None),
        (back, (-0.046, 0.046, -0.26), None),
        ((0.1732, 0.0, 0.1), (0.046, 0.046, -0.26), None),
    ]
    cables = []
    for k, (start, cuff, end) in enumerate(routes, start=1):
        sites = [cdsm.Site("base", start), cdsm.Site("upper_arm", cuff)]
        sites += [cdsm.Site("forearm", end)] if end else []
        cables.append(cdsm.Cable(f"cable{k}", tuple(sites), WIRE, minimum=3.0, maximum=45.0))
    return cdsm.Manipulator.from_urdf(
        chain("carex", [upper, fore], (0.0, 0.0, -0.28)), cables, tip="tool0"
    )


def myo_shoulder() -> cdsm.Manipulator:
    """Build the shoulder of the robot of Richter et al. (2016): 3 joints in one point, 9 cables."""
    upper = Body(
        "upper_arm", (0.0, 0.0, 0.0), (X, Y, Z), 3.1416, 1.0, (0.0, 0.0, -0.225), (1.0, 1.0, 1.0)
    )
    routes: list[tuple[Point, Point]] = [
        ((-0.06, 0.045, -0.1), (-0.015, 0.015, -0.045)),
        ((-0.06, 0.08, -0.05), (0.015, 0.015, -0.03)),
        ((-0.06, 0.082, 0.01), (0.015, 0.025, -0.175)),
        ((-0.015, 0.045, 0.038), (0.0, 0.025, -0.335)),
        ((0.05, 0.0, 0.04), (0.015, 0.025, -0.175)),
        ((0.015, -0.045, 0.005), (0.015, 0.025, -0.175)),
        ((-0.06, -0.08, 0.01), (0.015, -0.015, -0.03)),
        ((-0.06, -0.082, -0.05), (0.015, -0.015, -0.04)),
        ((-0.06, -0.055, -0.1), (0.015, -0.015, -0.05)),
    ]
    cables = [
        cdsm.Cable(
            f"cable{k}",
            (cdsm.Site("base", start), cdsm.Site("upper_arm", end)),
            WIRE,
            minimum=0.1,
            maximum=1000.0,
        )
        for k, (start, end) in enumerate(routes, start=1)
    ]
    return cdsm.Manipulator.from_urdf(
        chain("myo_shoulder", [upper], (0.0, 0.0, -0.45)), cables, tip="tool0"
    )


def bm_arm() -> cdsm.Manipulator:
    """Build the BM-Arm of CASPR: shoulder and elbow, 6 cables; the straight arm points along y."""
    upper = Body(
        "upper_arm",
        (0.0, 0.0, 0.0),
        (X, Y, Z),
        1.0,
        0.9810187,
        (6.11879e-5, 0.142722, 9.20007e-5),
        (0.0217208, 2.0494929e-4, 0.0217454),
    )
    lower = Body(
        "lower_arm",
        (0.0, 0.367, 0.0),
        (X,),
        1.0,
        0.1313765,
        (0.0, 0.0801433, 0.0),
        (4.9116366e-4, 1.9877175e-5, 4.9029819e-4),
    )
    routes: list[tuple[Point, str, Point]] = [
        ((-0.106066, 0.021, -0.106066), "upper_arm", (-0.0248764, 0.2195, 1.8743851e-4)),
        ((-0.106066, 0.021, 0.106066), "upper_arm", (-0.0248764, 0.2545, 1.8743851e-4)),
        ((0.106066, 0.021, -0.106066), "upper_arm", (0.025124, 0.2195, 1.8743851e-4)),
        ((0.106066, 0.021, 0.106066), "upper_arm", (0.025124, 0.2545, 1.8743851e-4)),
        ((0.0, 0.021, 0.25), "lower_arm", (0.0, 0.0705005, 0.0249999)),
        ((0.0, 0.021, -0.25), "lower_arm", (0.0, 0.0705005, -0.0250003)),
    ]
    cables = [
        cdsm.Cable(
            f"cable{k}",
            (cdsm.Site("base", start), cdsm.Site(link, end)),
            WIRE,
            minimum=10.0,
            maximum=80.0,
        )
        for k, (start, link, end) in enumerate(routes, start=1)
    ]
    return cdsm.Manipulator.from_urdf(
        chain("bm_arm", [upper, lower], (0.0, 0.243, 0.0)), cables, tip="tool0"
    )


CASPR = "Dimensions: CASPR (github.com/darwinlau/CASPR, BSD-3-Clause, commit a6971ee), model"
CHOSEN = "Chosen here: the wire (CASPR's cables do not stretch)"

SOURCES = {
    sjtu_snake: f"""\
Snake of Shanghai Jiao Tong University: L. Tang, J. Wang, Y. Zheng, G. Gu, L. Zhu, X. Zhu, Design of
a cable-driven hyper-redundant robot with experimental validation, Int. J. Adv. Robot. Syst. 14(5),
2017, doi 10.1177/1729881417734458: 12 sections, 24 joints, 36 cables, as its abstract says.
{CASPR} MCDM/SJTUSnake, which names no
paper; its set of cables from the base. It rounds holes to 1e-6 m: here they lie on their circle,
one each 10 degrees. Turned: x is along the straight arm (y there). Left out: products of inertia.
{CHOSEN}. It bounds no tension.""",
    carex: f"""\
CAREX: Y. Mao, S. K. Agrawal, Design of a cable-driven arm exoskeleton (CAREX) for neural
rehabilitation, IEEE Trans. Robot. 28(4), 922-931, 2012.
{CASPR} MCDM/CAREX, which names that
paper. The arm hangs along -z. Bounds of the tension: CASPR's.
{CHOSEN}, and izz of the links (0 there).""",
    myo_shoulder: f"""\
Shoulder of the MYO-arm: C. Richter et al., Musculoskeletal robots: scalability in neural control,
IEEE Robot. Autom. Mag. 23(4), 128-137, 2016, doi 10.1109/MRA.2016.2535081.
{CASPR}
SCDM/spherical_manipulators/myorob_shoulder, which names that paper. The arm hangs along -z. Mass
and inertia of 1 are CASPR's, so are the bounds of the tension.
{CHOSEN}.""",
    bm_arm: f"""\
BM-Arm, an arm with six muscles: D. Lau, J. Eden, Y. Tan, D. Oetomo, CASPR: a comprehensive
cable-robot analysis and simulation platform, Proc. IEEE/RSJ IROS, 2016, comes with it.
{CASPR} MCDM/BMArm, which names no paper.
The arm points along y, gravity along -z. Bounds of the tension: CASPR's. Left out: products of
inertia. {CHOSEN}.""",
    tensegrity_simplex.simplex: """\
Tensegrity simplex: J. Feron, L. Rhode-Barbarigos, P. Latteur, J. Struct. Eng. 149(7), 2023; nodes,
rigidities and masses from its data, doi 10.14428/DVN/CDLVFV. Struts are links that can be
shortened; the cable inside each is as rigid as the strut. Chosen here: inertia 1e-9, since nodes
are points. See examples/tensegrity_simplex.py.""",
}
"""Where the numbers of each arm are from, and what is chosen."""


def files() -> dict[str, str]:
    """Return name and text of every file of ``urdf/``."""
    texts = {}
    for geometry in (
        cdsm.presets.virtual_prototype_geometry(),
        cdsm.presets.experimental_prototype_geometry(),
    ):
        texts[f"{geometry.name}.toml"] = geometry.to_toml()
        texts[f"{geometry.name}.urdf"] = cdsm.to_urdf(geometry)
    for build, source in SOURCES.items():
        arm, name = build(), build.__name__
        comment = "".join(f"# {line}\n" for line in source.splitlines())
        with TemporaryDirectory() as folder:
            text = arm.write(Path(folder, "arm.toml")).read_text(encoding="utf-8")
        beside, count = re.subn(r"text = '''.*?'''", f'file = "{name}.urdf"', text, flags=re.DOTALL)
        if count != 1:
            raise RuntimeError(f"{name}: {count} texts of a URDF in ARM.toml, 1 expected")
        texts[f"{name}.toml"] = comment + beside
        texts[f"{name}.urdf"] = arm.urdf
    return texts


if __name__ == "__main__":
    for name, text in files().items():
        print((FOLDER / name).write_text(text, encoding="utf-8"), name)
