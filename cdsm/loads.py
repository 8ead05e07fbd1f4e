"""What acts on an arm, as a user gives it: a wrench at the tip, or loads on any links."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from cdsm.applied import Applied, Loads, PointLoad, TipLoad
from cdsm.dead_loads import LinkPoint, Load, doubt_still, placed_loads, point_on
from cdsm.errors import InvalidInput
from cdsm.manipulator import Manipulator
from cdsm.support.validation import one_of, wrench_vector

LoadsLike = ArrayLike | Mapping[str, ArrayLike] | Sequence[Load] | Load | Loads
"""A wrench (6,) at the tip; or wrenches by the names of links; or loads; {} or []: none."""


def link_point(arm: Manipulator, link: object, point: ArrayLike | None = None) -> LinkPoint | None:
    """Return a point of a link, given in the frame of the link (3,) [m]; None for the tip.

    Without a point it is the centre of the disk of the link, if a generated arm has one there, else
    the origin of its frame. Raises InvalidInput if there is no such link, or no joint moves it.
    """
    if link is None:
        _require_no_point(point)
        return None
    if point is None and one_of("link", link, arm.body.link_names) == arm.tip_link:
        return None
    at = point_on(arm.body, arm.definition.geometry, link, point)
    doubt_still(at)
    return at


def loads_of(arm: Manipulator, wrench: object, name: str = "wrench") -> Applied:
    """Return what acts on an arm: the wrench (6,) if it acts at the tip alone, or its loads.

    Raises InvalidInput if a link does not exist or is the base, or two loads act at one point.
    """
    if isinstance(wrench, Loads):  # of this arm, or of one like it
        return Loads(tuple(_moved_to(arm, load) for load in wrench.loads))
    items = loads_in(wrench, name)
    if items is None:
        return wrench_vector(name, wrench)  # type: ignore[arg-type]
    loads: list[TipLoad | PointLoad] = [
        TipLoad(W) if is_tip(arm, at) else PointLoad(at, W)
        for at, W in placed_loads(items, arm.body, arm.definition.geometry, name)
    ]
    if not loads:
        return wrench_vector(name, np.zeros(6))
    if len(loads) == 1 and isinstance(loads[0], TipLoad):
        return loads[0].wrench
    return Loads(tuple(loads))


def is_tip(arm: Manipulator, at: LinkPoint) -> bool:
    """Return whether a point is the tip."""
    return at.link == arm.tip_link and not at.local.any()


def loads_in(wrench: object, name: str) -> list[Load] | None:
    """Return loads as a list; None if they are given as numbers."""
    if not has_loads(wrench):
        return None
    return [load for load in kept_loads(name, wrench) if isinstance(load, Load)]


def _loads_by_link(name: str, wrench: Mapping[str, ArrayLike]) -> list[Load]:
    pairs = {link: wrench_vector(f"{name}[{link!r}]", W) for link, W in wrench.items()}
    return [Load(link, tuple(W[:3]), tuple(W[3:])) for link, W in pairs.items()]


def kept_loads(name: str, wrench: object) -> tuple[float, ...] | tuple[Load, ...]:
    """Return what acts on an arm that is not known yet: a wrench, or loads."""
    if isinstance(wrench, Load):
        return (wrench,)
    if isinstance(wrench, Mapping):
        return tuple(_loads_by_link(name, wrench))
    if isinstance(wrench, (list, tuple)) and has_loads(wrench):
        for load in wrench:
            if not isinstance(load, Load):
                raise InvalidInput(name, f"{load!r} is no Load; give loads only.")
        return tuple(wrench)
    return tuple(wrench_vector(name, wrench).tolist())  # type: ignore[arg-type]


def kept_point(
    link: object, point: ArrayLike | None
) -> tuple[str | None, tuple[float, ...] | None]:
    """Return a link and a point on it, of an arm that is not known yet."""
    if link is None:
        _require_no_point(point)
        return None, None
    load = Load(link, point=point)  # type: ignore[arg-type]
    return load.link, load.point


def _require_no_point(point: ArrayLike | None) -> None:
    if point is not None:
        raise InvalidInput("point", "is a point of a link: give link= too.")


def has_loads(value: object) -> bool:
    """Return whether what acts is given as loads, or by links, and not as numbers.

    An empty list is no loads, as an empty dict is.
    """
    if isinstance(value, (list, tuple)):
        return not value or any(isinstance(load, (Load, Loads, Mapping)) for load in value)
    return isinstance(value, (Load, Loads, Mapping))


def _moved_to(arm: Manipulator, load: TipLoad | PointLoad) -> TipLoad | PointLoad:
    """Return a load of another arm at the same point of a link of this one."""
    if isinstance(load, TipLoad):
        return load
    at = point_on(arm.body, arm.definition.geometry, load.at.link, load.at.local)
    return PointLoad(at, load.wrench)
