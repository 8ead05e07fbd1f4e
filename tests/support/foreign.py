"""Robots that no Geometry describes: branches, slides, and cables between anything."""

from typing import Any

import numpy as np

import cdsm

_INERTIAL = (
    '<inertial><origin xyz="{1} 0.01 -0.02" rpy="0.3 0.2 0.1"/><mass value="{0}"/>'
    '<inertia ixx="2e-3" iyy="3e-3" izz="4e-3" ixy="1e-4" ixz="2e-4" iyz="-3e-4"/></inertial>'
)


def link_element(name: str, mass: float = 0.0) -> str:
    inside = _INERTIAL.format(mass, 0.1 * mass) if mass else ""
    return f'<link name="{name}">{inside}</link>'


def joint_element(
    name: str, kind: str, parent: str, child: str, xyz: str, rpy: str, axis: str
) -> str:
    limit = "" if kind == "fixed" else '<limit lower="-0.9" upper="1.1" effort="1" velocity="1"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>{limit}</joint>'
    )


TREE = "".join(
    [
        '<robot name="crab">',
        link_element("floor"),
        link_element("trunk", 0.8),
        link_element("slider", 0.4),
        link_element("arm", 0.3),
        link_element("hand", 0.2),
        link_element("tail", 0.5),
        link_element("fin", 0.1),
        link_element("tip"),
        joint_element("a", "revolute", "floor", "trunk", "0.1 0 0.2", "0.1 0 0.3", "0 1 0"),
        joint_element("b", "prismatic", "trunk", "slider", "0.2 0.05 0", "0 0.2 0", "1 0.5 0"),
        joint_element("c", "revolute", "slider", "arm", "0.15 0 0", "0 0 0.4", "0 0.6 0.8"),
        joint_element("d", "prismatic", "arm", "hand", "0.1 0 0", "0.2 0 0", "0 0 1"),
        joint_element("e", "revolute", "trunk", "tail", "-0.1 0 0.1", "0 0.5 0", "1 0 1"),
        joint_element("f", "prismatic", "tail", "fin", "-0.1 0.1 0", "0 0 0", "0 1 0"),
        joint_element("g", "fixed", "hand", "tip", "0.08 0 0.02", "0 0.3 0", "1 0 0"),
        "</robot>",
    ]
)


def cables(law: cdsm.Elasticity) -> tuple[cdsm.Cable, ...]:
    """Cables along and across the branches, some over several links."""
    ways = [
        ("floor", "trunk"),
        ("floor", "slider", "arm", "tip"),
        ("tail", "hand"),
        ("fin", "trunk", "arm"),
        ("floor", "tail", "fin"),
        ("trunk", "hand"),
        ("fin", "tip"),
        ("floor", "fin"),
        ("slider", "arm", "hand"),
    ]
    rng = np.random.default_rng(3)
    return tuple(
        cdsm.Cable(
            name=f"c{i}",
            sites=tuple(cdsm.Site(link, tuple(rng.uniform(-0.08, 0.08, 3))) for link in way),
            elasticity=law,
            lead=0.1 * (i % 3),
            series_stiffness=4e4 if i % 4 == 1 else np.inf,
            control="force" if i == 7 else "position",
        )
        for i, way in enumerate(ways)
    )


def crab(law: cdsm.Elasticity | None = None, **options: Any) -> cdsm.Manipulator:
    law = law or cdsm.LinearElasticity(3e4)
    return cdsm.Manipulator.from_urdf(TREE, cables(law), tip="tip", **options)


POSTURE = np.array([0.3, -0.2, 0.5, 0.1, -0.4, 0.2])
TENSION = np.array([30.0, 25.0, 40.0, 15.0, 50.0, 22.0, 18.0, 35.0, 28.0])
