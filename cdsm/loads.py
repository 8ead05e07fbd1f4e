"""Loads on any links of an arm, as a user gives them; :mod:`cdsm.applied` has their formulas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.applied import Applied, LinkPoint, Loads, PointLoad, TipLoad
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.support.validation import one_of, vector, wrench_vector
from cdsm.support.values import Array, frozen


@final
@dataclass(frozen=True)
class Load:
    """Dead load on a link: a force and a moment that keep their direction as the arm moves.

    Attributes:
        link: Name of the link, not of the base.
        force: f (3,) [N], base axes.
        moment: m (3,) [N m], base axes.
        point: Where the force acts (3,) [m], in the frame of the link. None: at the centre of its
            disk, if the link of a generated arm has one disk, else at the origin of its frame.

    Raises:
        InvalidInput: A vector is not three finite numbers. The arm refuses unknown links.

    Example:
        >>> import cdsm
        >>> camera = cdsm.Load("link2", force=(0.0, -1.5, 0.0))
        >>> arm = cdsm.presets.virtual_prototype()
        >>> pose = arm.at([0.1] * 10)
        >>> F = cdsm.distribute_tension(pose, minimum=5.0, wrench=[camera])
        >>> round(F["cable1_1"], 2)
        35.08
    """

    link: str
    force: tuple[float, ...] = (0.0, 0.0, 0.0)
    moment: tuple[float, ...] = (0.0, 0.0, 0.0)
    point: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.link, str):
            raise InvalidInput("link", f"{self.link!r} given; give the name of a link.")
        units = {"force": "force", "moment": "wrench", "point": "length"}
        for name, quantity in units.items():
            value = getattr(self, name)
            if value is not None:
                checked = vector(name, value, 3, f"a {name} (3,)", quantity)
                object.__setattr__(self, name, tuple(checked.tolist()))

    @property
    def wrench(self) -> Array:
        """Force [N], then moment [N m] (6,)."""
        return frozen(np.array([*self.force, *self.moment]))


LoadsLike = ArrayLike | Mapping[str, ArrayLike] | Sequence[Load] | Load | Loads
"""A wrench (6,) at the tip; or wrenches by the names of links; or loads."""


def link_point(arm: Manipulator, link: object, point: ArrayLike | None = None) -> LinkPoint:
    """Return a point of a link, given in the frame of the link (3,) [m].

    None: the centre of the disk of the link, if a generated arm has one there, else the origin of
    its frame. Raises InvalidInput if there is no such link, or no joint moves it.
    """
    body = arm.body
    name = one_of("link", link, body.link_names)
    row, rotation, translation = body.locate(name)
    joints = np.array(body.joints_to(row), np.intp) - 1
    if not joints.size:
        raise InvalidInput(
            "link", f"{name!r} is the base: no joint moves it, and no load bends it."
        )
    if point is None:
        disks = arm.geometry.disks if arm.is_serpentine else ()
        centres = [disk.x for disk in disks if disk.link == name]
        local = np.array([centres[0] if len(centres) == 1 else 0.0, 0.0, 0.0])
    else:
        local = vector("point", point, 3, "a point (3,) [m] in the frame of the link", "length")
    offset = translation + rotation @ local
    return LinkPoint(name, frozen(local), row, frozen(np.asarray(offset)), joints)


def loads_of(arm: Manipulator, wrench: object, name: str = "wrench") -> Applied:
    """Return what acts on an arm: the wrench (6,) if it acts at the tip alone, or its loads.

    Raises InvalidInput if a link does not exist or is the base, or two loads act at one point.
    """
    if isinstance(wrench, Loads):  # made here before
        return wrench
    items = _items(wrench, name)
    if items is None:
        return wrench_vector(name, wrench)  # type: ignore[arg-type]
    loads: dict[object, TipLoad | PointLoad] = {}
    for load in items:
        at = link_point(arm, load.link, load.point)
        at_tip = load.link == arm.tip_link and not at.local.any()
        key = "tip" if at_tip else at.key
        if key in loads:
            raise InvalidInput(name, f"two loads act on {load.link} at one point; add them up.")
        loads[key] = TipLoad(load.wrench) if at_tip else PointLoad(at, load.wrench)
    if not loads:
        return wrench_vector(name, np.zeros(6))
    if [*loads] == ["tip"]:
        return loads["tip"].wrench
    return Loads(tuple(loads.values()))


def _items(wrench: object, name: str) -> list[Load] | None:
    """Return loads as a list; None if they are given as numbers."""
    if isinstance(wrench, Load):
        return [wrench]
    if isinstance(wrench, Mapping):
        pairs = {link: wrench_vector(f"{name}[{link!r}]", W) for link, W in wrench.items()}
        return [Load(link, tuple(W[:3]), tuple(W[3:])) for link, W in pairs.items()]
    if isinstance(wrench, (list, tuple)) and any(isinstance(load, Load) for load in wrench):
        for load in wrench:
            if not isinstance(load, Load):
                raise InvalidInput(name, f"{load!r} is no Load; give loads only.")
        return list(wrench)
    return None
