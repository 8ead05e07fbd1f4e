"""Small robots whose cables run over pulleys."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import cdsm
from tests.support.arms import STEEL


class Link(NamedTuple):
    """A link, and the joint that moves it on its parent."""

    name: str
    parent: str
    xyz: tuple[float, float, float]
    axis: tuple[float, float, float]
    kind: str = "revolute"
    follows: tuple[str, float] | None = None  # joint and multiplier


def robot(links: Iterable[Link]) -> str:
    """The URDF of a tree on the link ``base``; the joint of a link has the name ``to_<link>``."""
    parts = ['<robot name="hand"><link name="base"/>']
    for link in links:
        parts.append(
            f'<link name="{link.name}"><inertial><origin xyz="0.01 0 0"/><mass value="0.02"/>'
            '<inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        )
        xyz, axis = (" ".join(map(repr, v)) for v in (link.xyz, link.axis))
        mimic = (
            f'<mimic joint="to_{link.follows[0]}" multiplier="{link.follows[1]!r}"/>'
            if link.follows
            else ""
        )
        parts.append(
            f'<joint name="to_{link.name}" type="{link.kind}"><parent link="{link.parent}"/>'
            f'<child link="{link.name}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/>'
            f'<limit lower="-5" upper="5" effort="1" velocity="1"/>{mimic}</joint>'
        )
    return "".join(parts) + "</robot>"


def arm_of(
    links: Iterable[Link], *paths: Iterable[Any], gravity: Any = (0.0, 0.0, 0.0), **settings: Any
) -> cdsm.Manipulator:
    """The arm of these links with one cable for each path; its tip is the last link."""
    links = list(links)
    settings = {"elasticity": STEEL, **settings}
    cables = [cdsm.Cable(f"cable{i}", tuple(path), **settings) for i, path in enumerate(paths, 1)]
    return cdsm.Manipulator.from_urdf(robot(links), cables, tip=links[-1].name, gravity=gravity)
