"""URDFs of bodies in series, from their sizes and masses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from lxml import etree

from cdsm.urdf import TIP, E, inertial, joint, origin, urdf_text

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


def moving_joint(
    kind: str,
    name: str,
    parent: str,
    child: str,
    *,
    at: Sequence[float],
    axis: Sequence[float],
    limit: float = 1.0,
) -> etree._Element:
    """Build a joint at a point [m] of ``parent``, with a limit in both directions [rad or m]."""
    ends = E.limit(lower=-limit, upper=limit, effort=1.0, velocity=1.0)
    return joint(kind, name, parent, child, origin(at), E.axis(xyz=tuple(axis)), ends)


def chain(name: str, bodies: Sequence[SerialBody], tip: Triple) -> str:
    """Write the URDF of bodies in series; ``tool0`` is at ``tip`` of the last one."""
    parts = [E.link(name="base")]
    parent = "base"
    for body in bodies:
        at = body.at
        mass = inertial(body.mass, np.diag(body.inertia), origin(body.centre))
        for i, axis in enumerate(body.axes, start=1):
            last = i == len(body.axes)
            child = body.name if last else f"{body.name}_{i}"
            label = f"{body.name}_joint{i}"
            parts += [
                E.link(*([mass] if last else []), name=child),
                moving_joint("revolute", label, parent, child, at=at, axis=axis, limit=body.limit),
            ]
            parent, at = child, (0.0, 0.0, 0.0)
    parts += [E.link(name=TIP), joint("fixed", "tool0_joint", parent, TIP, origin(tip))]
    return urdf_text(name, parts)
