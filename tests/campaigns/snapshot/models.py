"""Laws, geometries and arms of every kind, from fixed seeds."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.campaigns.snapshot.environment import cdsm


def own() -> Any:
    """A law of the user's own: EA = a + b F."""
    return cdsm.Elasticity.from_rigidity(lambda F: 2e4 + 50.0 * F, 0.0, 2000.0)


def laws() -> dict[str, Any]:
    forces = (0.0, 5.0, 20.0, 60.0, 150.0, 400.0, 900.0)
    return {
        "linear": cdsm.LinearElasticity(48e3),
        "wire": cdsm.LinearElasticity.of_wire(200e9, 1.2e-3),
        "strand": cdsm.presets.STRAND_1X19,
        "kink": cdsm.StrandElasticity(
            ((2e4, 30.0), (22100.0,)), joins=(70.0,), low=0.0, high=900.0
        ),
        "table": cdsm.TabulatedElasticity(forces, tuple(F**0.8 / 2e4 for F in forces)),
        "own": own(),
    }


def sizes(seed: int, joints: int) -> dict[str, Any]:
    rng = np.random.default_rng([seed, joints])
    offset = rng.uniform(0.006, 0.012)
    return {
        "joints": joints,
        "link_length": rng.uniform(0.03, 0.08),
        "base_length": rng.uniform(0.0, 0.05),
        "disk_offset": offset,
        "hole_radius": rng.uniform(1.5, 4.0) * offset,
        "link_mass": rng.uniform(0.02, 0.5),
        "lead": rng.uniform(0.0, 0.5) if seed % 2 else 0.0,
        "name": f"arm{seed}_{joints}",
    }


def mixed() -> Any:
    """Hinges and universal joints, unequal links, cables that end early."""
    axes = (((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), ((0.1, 1.0, 0.3),), ((0.0, 0.3, 1.0), (0, 1, 0.2)))
    holes = ((1, (0.1, 2.3, 4.0)), (2, (0.9, 4.1)), (3, (0.4, 2.0, 3.3, 5.5)))
    limits = zip(axes, (0.008, 0.006, 0.01), (None, 0.5, 0.4), strict=True)
    return cdsm.Geometry(
        name="mixed",
        base_length=0.03,
        hole_radius=0.02,
        joints=tuple(cdsm.Joint(axes=a, disk_offset=h, limit=limit) for a, h, limit in limits),
        links=tuple(cdsm.Link(length=a, mass=m) for a, m in ((0.05, 0.2), (0.03, 0), (0.06, 0.35))),
        cables=tuple(
            cdsm.CableRoute(joint=k, angle=angle, lead=0.1 * (k % 2))
            for k, angles in holes
            for angle in angles
        ),
    )


def tree(name: str = "crab") -> str:
    """A URDF with branches and slides."""
    inside = (
        '<inertial><origin xyz="0.02 0.01 -0.02" rpy="0.3 0.2 0.1"/><mass value="{}"/><inertia '
        'ixx="2e-3" iyy="3e-3" izz="4e-3" ixy="1e-4" ixz="2e-4" iyz="-3e-4"/></inertial>'
    )
    limit = '<limit lower="-0.9" upper="1.1" effort="1" velocity="1"/>'
    masses = {"trunk": 0.8, "slider": 0.4, "arm": 0.3, "hand": 0.2, "tail": 0.5, "fin": 0.1}
    rows = (
        ("a", "revolute", "floor", "trunk", "0.1 0 0.2", "0.1 0 0.3", "0 1 0"),
        ("b", "prismatic", "trunk", "slider", "0.2 0.05 0", "0 0.2 0", "1 0.5 0"),
        ("c", "revolute", "slider", "arm", "0.15 0 0", "0 0 0.4", "0 0.6 0.8"),
        ("d", "prismatic", "arm", "hand", "0.1 0 0", "0.2 0 0", "0 0 1"),
        ("e", "revolute", "trunk", "tail", "-0.1 0 0.1", "0 0.5 0", "1 0 1"),
        ("f", "prismatic", "tail", "fin", "-0.1 0.1 0", "0 0 0", "0 1 0"),
        ("g", "fixed", "hand", "tip", "0.08 0 0.02", "0 0.3 0", "1 0 0"),
    )
    links = [f'<link name="{n}">{inside.format(m)}</link>' for n, m in masses.items()]
    joints = [
        f'<joint name="{n}" type="{kind}"><parent link="{p}"/><child link="{c}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>{"" if n == "g" else limit}</joint>'
        for n, kind, p, c, xyz, rpy, axis in rows
    ]
    parts = ['<link name="floor"/>', *links, '<link name="tip"/>', *joints]
    return f'<robot name="{name}">{"".join(parts)}</robot>'


def tree_cables(law: Any) -> tuple[Any, ...]:
    """Cables along and across the branches, some over several links."""
    ways = "floor trunk,floor slider arm tip,tail hand,fin trunk arm,floor tail fin,trunk hand"
    ways = ",".join([ways, "fin tip,floor fin,slider arm hand,tip floor,hand floor,floor arm"] * 3)
    rng = np.random.default_rng(3)
    return tuple(
        cdsm.Cable(
            name=f"c{i}",
            sites=tuple(cdsm.Site(link, tuple(rng.uniform(-0.6, 0.6, 3))) for link in way.split()),
            elasticity=law,
            lead=0.1 * (i % 3),
            series_stiffness=4e4 if i % 4 == 1 else np.inf,
            control="force" if i == 7 else "position",
        )
        for i, way in enumerate(ways.split(","))
    )


def caspr(kinds: tuple[str, ...]) -> Path:
    """A folder with a CASPR model of a chain of links, in the current folder."""
    folder = Path("_".join(kinds))
    folder.mkdir(exist_ok=True)
    counts = {"R": 1, "U": 2, "S": 3, "P": 1, "PLANAR": 3, "SPATIAL": 6, "T": 3}
    links = cables = ""
    for number, kind in enumerate(kinds, start=1):
        count = counts[kind.split("_")[0]]
        low, high = " ".join(["-0.5"] * count), " ".join(["0.6"] * count)
        links += (
            f'<link_rigid num="{number}" name="part {number}"><joint type="{kind}" '
            f'q_initial="0" q_min="{low}" q_max="{high}"/><physical><mass>0.3</mass>'
            "<com_location>0.01 0.05 -0.02</com_location><end_location>0 0.12 0</end_location>"
            '<inertia ref="com"><Ixx>0.003</Ixx><Iyy>0.002</Iyy><Izz>0.004</Izz><Ixy>0.0001</Ixy>'
            f"<Ixz>0</Ixz><Iyz>0</Iyz></inertia></physical><parent><num>{number - 1}</num>"
            "<location>0.01 0.1 0.03</location></parent></link_rigid>"
        )
    rng = np.random.default_rng(len(kinds))
    for i in range(30):
        sites = "".join(
            f"<attachment><link>{link}</link><location>{x:.3f} {y:.3f} {z:.3f}</location>"
            "</attachment>"
            for link in range(1 + len(kinds))
            for x, y, z in [rng.uniform(-0.6, 0.6, 3)]
        )
        cables += (
            f'<cable_ideal name="c{i}" attachment_reference="{"joint" if i % 2 else "com"}">'
            "<properties><force_min>1</force_min><force_max>900</force_max></properties>"
            f"<attachments>{sites}</attachments></cable_ideal>"
        )
    (folder / "toy_bodies.xml").write_text(f"<bodies_system><links>{links}</links></bodies_system>")
    sets = f'<cable_set id="all">{cables}</cable_set><cable_set id="none"></cable_set>'
    (folder / "toy_cables.xml").write_text(f'<cables default_cable_set="all">{sets}</cables>')
    return folder


def probe(joints: int = 2, law: str = "linear", seed: int = 1, **options: Any) -> Any:
    """A universal arm of random dimensions."""
    geometry = cdsm.Geometry.universal(cables_per_joint=3 + seed % 2, **sizes(seed, joints))
    gravity = np.random.default_rng(seed).normal(0.0, 6.0, 3)
    return cdsm.Manipulator(geometry, laws()[law], gravity=gravity, **options)


def arms() -> dict[str, Callable[[], Any]]:
    """How to make an arm of every kind."""
    presets, linear, order = cdsm.presets, laws()["linear"], list(laws())
    made: dict[str, Callable[[], Any]] = {
        "virtual": presets.virtual_prototype,
        "virtual_stretched": lambda: presets.virtual_prototype(
            laws()["linear"], lead=0.3, link_mass=0.2, original_length="stretched"
        ),
        "experimental": presets.experimental_prototype,
        "experimental_springs": lambda: presets.experimental_prototype(
            laws()["table"], series_stiffness=3e4, hole_radius=0.025, tool_length=0.15
        ),
        "mixed": lambda: cdsm.Manipulator(mixed(), laws()["wire"], gravity=(1.0, -3.0, -9.0)),
        "crab": lambda: cdsm.Manipulator.from_urdf(tree(), tree_cables(linear), tip="tip"),
        "crab_stretched": lambda: cdsm.Manipulator.from_urdf(
            tree(),
            tree_cables(laws()["table"]),
            tip="tip",
            joint_names=list("fedcba"),
            original_length="stretched",
        ),
        "reread": lambda: cdsm.Manipulator.from_urdf(
            cdsm.to_urdf(mixed()), cdsm.serpentine_cables(mixed(), linear), tip="tool0"
        ),
    }
    for kinds in (("R_Z", "U_XY"), ("S_FIXED_XYZ",), ("PLANAR_XZ", "P_X"), ("SPATIAL_EULER_XYZ",)):
        made["_".join(("caspr", *kinds))] = lambda kinds=kinds: cdsm.read_caspr(  # type: ignore[misc]
            caspr(kinds), elasticity=linear
        )
    for n in range(1, 7):
        law = order[n - 1]
        made[f"universal{n}"] = lambda n=n, law=law: probe(n, law, seed=n)  # type: ignore[misc]
        made[f"hinged{n}"] = lambda n=n, law=law: hinged(n, law)  # type: ignore[misc]
    return made


def hinged(joints: int, law: str) -> Any:
    """Hinges, cables with springs, one of them force-controlled."""
    twist = np.random.default_rng(joints).uniform(-1.5, 1.5)
    geometry = cdsm.Geometry.hinged(twist=twist, **sizes(joints, joints))
    first, *others = cdsm.serpentine_cables(geometry, laws()[law], series_stiffness=5e4)
    return cdsm.Manipulator(
        geometry,
        cables=[dataclasses.replace(first, control="force"), *others],
        original_length="stretched" if joints % 2 else "unstrained",
    )
