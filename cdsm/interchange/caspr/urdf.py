"""The links of a CASPR model as URDF."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from cdsm.interchange.caspr.bodies import Body
from cdsm.interchange.caspr.fields import BASE
from cdsm.support.validation import Array
from cdsm.urdf import TIP, urdf_text

if TYPE_CHECKING:
    import yourdfpy

_COMMENT: Final = "\n  Made by cdsm from a CASPR model. Units: m, rad, kg.\n"


def to_urdf(name: str, bodies: Sequence[Body]) -> str:
    """URDF text; ``tool0`` sits at the end of the last link."""
    import yourdfpy

    links, joints = [yourdfpy.Link(name=BASE)], []
    names = [BASE, *(body.name for body in bodies)]
    for body in bodies:
        parent, place = names[body.parent], body.place
        for i, (kind, label, axis, low, high) in enumerate(body.joints, start=1):
            last = i == len(body.joints)
            child = body.name if last else f"{body.name}_{i}"
            joints.append(_joint(label, kind, parent, child, place, axis, (low, high)))
            links.append(_link(body) if last else yourdfpy.Link(name=child))
            parent, place = child, np.zeros(3)
    links.append(yourdfpy.Link(name=TIP))
    origin = np.eye(4)
    origin[:3, 3] = bodies[-1].end
    joints.append(
        yourdfpy.Joint(
            name=f"{TIP}_joint", type="fixed", parent=names[-1], child=TIP, origin=origin
        )
    )
    return urdf_text(yourdfpy.Robot(name=name or "caspr", links=links, joints=joints), _COMMENT)


def _link(body: Body) -> yourdfpy.Link:
    import yourdfpy

    if body.mass == 0.0:
        return yourdfpy.Link(name=body.name)
    origin = np.eye(4)
    origin[:3, 3] = body.centre
    inertial = yourdfpy.Inertial(origin=origin, mass=body.mass, inertia=body.inertia)
    return yourdfpy.Link(name=body.name, inertial=inertial)


def _joint(
    name: str,
    kind: str,
    parent: str,
    child: str,
    place: Array,
    axis: tuple[float, ...],
    limits: tuple[float, float],
) -> yourdfpy.Joint:
    import yourdfpy

    origin = np.eye(4)
    origin[:3, 3] = place
    limit = yourdfpy.Limit(effort=0.0, velocity=0.0, lower=limits[0], upper=limits[1])
    return yourdfpy.Joint(
        name=name,
        type=kind,
        parent=parent,
        child=child,
        origin=origin,
        axis=np.array(axis),
        limit=limit,
    )
