"""URDFs of bodies in series, from their sizes and masses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

Triple = tuple[float, float, float]

JOINT_AXES: Final[tuple[Triple, Triple, Triple]] = (
    (1.0, 0.0, 0.0),
    (0.0, 1.0, 0.0),
    (0.0, 0.0, 1.0),
)
"""Axes x, y and z of joints."""


class SerialBody(NamedTuple):
    """A link behind joints whose axes meet in one point."""

    name: str
    at: Triple  # that point in the frame of the link before [m]
    axes: tuple[Triple, ...]  # of the joints, in their order
    limit: float  # of the joints, in both directions [rad]
    mass: float  # [kg]
    centre: Triple  # of mass [m]
    inertia: Triple  # ixx, iyy, izz about it [kg m²]


INERTIAL = """    <inertial>
      <origin xyz="{centre}"/>
      <mass value="{mass}"/>
      <inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/>
    </inertial>
"""
JOINT = """  <joint name="{name}_joint{i}" type="revolute">
    <parent link="{parent}"/>
    <child link="{child}"/>
    <origin xyz="{at}"/>
    <axis xyz="{axis}"/>
    <limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/>
  </joint>
"""
TIP_LINK = """  <link name="tool0"/>
  <joint name="tool0_joint" type="fixed">
    <parent link="{parent}"/>
    <child link="tool0"/>
    <origin xyz="{at}"/>
  </joint>
</robot>
"""


def numbers_of(point: Sequence[float]) -> str:
    """Write numbers with a blank between them."""
    return " ".join(map(repr, point))


def chain(name: str, bodies: Sequence[SerialBody], tip: Triple) -> str:
    """Write the URDF of bodies in series; ``tool0`` is at ``tip`` of the last one."""
    urdf = f'<robot name="{name}">\n  <link name="base"/>\n'
    parent = "base"
    for body in bodies:
        xx, yy, zz = body.inertia
        mass = INERTIAL.format(centre=numbers_of(body.centre), mass=body.mass, xx=xx, yy=yy, zz=zz)
        limits = {"lower": -body.limit, "upper": body.limit}
        for i, axis in enumerate(body.axes, start=1):
            last = i == len(body.axes)
            at = body.at if i == 1 else (0.0, 0.0, 0.0)
            ends = {"parent": parent, "child": body.name if last else f"{body.name}_{i}"}
            urdf += f'  <link name="{ends["child"]}">\n{mass if last else ""}  </link>\n'
            places = {"at": numbers_of(at), "axis": numbers_of(axis)}
            urdf += JOINT.format(name=body.name, i=i, **ends, **places, **limits)
            parent = ends["child"]
    return urdf + TIP_LINK.format(parent=parent, at=numbers_of(tip))
