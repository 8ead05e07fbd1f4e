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


def robot(links: Iterable[Link], limit: float = 5.0) -> str:
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
            f'<limit lower="{-limit!r}" upper="{limit!r}" effort="1" velocity="1"/>{mimic}</joint>'
        )
    return "".join(parts) + "</robot>"


def arm_of(
    links: Iterable[Link],
    *paths: Iterable[Any],
    gravity: Any = (0.0, 0.0, 0.0),
    limit: float = 5.0,
    **settings: Any,
) -> cdsm.Manipulator:
    """The arm of these links with one cable for each path; its tip is the last link."""
    links = list(links)
    settings = {"elasticity": STEEL, **settings}
    cables = [cdsm.Cable(f"cable{i}", tuple(path), **settings) for i, path in enumerate(paths, 1)]
    return cdsm.Manipulator.from_urdf(
        robot(links, limit), cables, tip=links[-1].name, gravity=gravity
    )


RADII = (0.008, 0.006, 0.004)
"""Radii of the pulleys at the flexion joints of :func:`finger` [m]."""


def finger(*, plane: bool = True, chained: bool = True, groove: bool = True) -> cdsm.Manipulator:
    """A finger with an abduction joint and three flexion joints, over pulleys at these.

    With ``plane`` its cables stay in the planes of the pulleys as long as it is not abducted; with
    ``chained`` two more cables cross between two pulleys without a site between them.
    """
    links = [
        Link("l0", "base", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        Link("l1", "l0", (0.015, 0.0, 0.0), (0.0, 1.0, 0.0)),
        Link("l2", "l1", (0.045, 0.0, 0.0), (0.0, 1.0, 0.0)),
        Link("l3", "l2", (0.03, 0.0, 0.0), (0.0, 1.0, 0.0)),
    ]
    joints = (("l0", 0.015), ("l1", 0.045), ("l2", 0.03))

    def pulley(link: str, x: float, radius: float, side: float) -> cdsm.Pulley:
        return cdsm.Pulley(link, (x, 0.0, 0.0), (0.0, -side, 0.0), radius, groove)

    def over(count: int, side: float, start: cdsm.Site) -> list[Any]:
        path: list[Any] = [start]
        for k in range(count):
            path.append(pulley(*joints[k], RADII[k], side))
            hole = ((0.022, 0.015, 0.012)[k], 0.0, 0.002 * side)
            path.append(cdsm.Site(f"l{k + 1}", hole))
        return path

    def start(y: float, z: float) -> cdsm.Site:
        return cdsm.Site("base", (-0.03, 0.0 if plane else y, z))

    paths = [
        over(3, 1.0, start(0.004, 0.008)),
        over(2, 1.0, start(-0.004, 0.008)),
        over(3, -1.0, start(0.004, -0.008)),
        over(1, -1.0, start(-0.004, -0.008)),
    ]
    for side in (1.0, -1.0) if chained else ():
        crossed = [pulley("l0", 0.015, 0.008, side), pulley("l1", 0.045, 0.006, -side)]
        paths.append(
            [
                start(0.004 * side, 0.008 * side),
                *crossed,
                cdsm.Site("l2", (0.015, 0.0, 0.002 * side)),
            ]
        )
    rim = cdsm.Site("l1", (0.007, 0.0, 0.0))
    paths.append([start(0.002, 0.02), pulley("l1", 0.0, 0.007, 1.0), rim])
    for y in (0.012, -0.012):
        paths.append([cdsm.Site("base", (-0.02, y, 0.0)), cdsm.Site("l0", (0.01, y, 0.0))])
    law = cdsm.LinearElasticity(2e4)
    return arm_of(links, *paths, gravity=(0.0, 0.0, -9.81), elasticity=law, lead=0.3, limit=1.3)
