"""Which components of loads on which links are sought."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.applied import Loads, PointLoad
from cdsm.dead_loads import LinkPoint, Load, point_on
from cdsm.errors import InvalidInput
from cdsm.estimation.balanced_loads import LoadTorques
from cdsm.manipulator import Manipulator
from cdsm.posture import Posture
from cdsm.support.result import COMPONENTS
from cdsm.support.validation import vector
from cdsm.support.values import Array, frozen

ROWS: Final = {"force": (0, 1, 2), "moment": (3, 4, 5), "wrench": (0, 1, 2, 3, 4, 5)}
"""Rows of a wrench by the words for them."""

LinksLike = Mapping[str, str | Sequence[int | str]]
"""What is sought on each link: ``"force"``, ``"moment"``, ``"wrench"``, or rows of the wrench."""


@dataclass(frozen=True, eq=False)
class Components:
    """The m components of loads that are sought, link by link."""

    at: tuple[LinkPoint, ...]  # where, for each link
    rows: tuple[tuple[int, ...], ...]  # of the wrench, for each link

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each, such as ``fx at tool0``."""
        pairs = zip(self.at, self.rows, strict=True)
        return tuple(f"{COMPONENTS[row]} at {at.link}" for at, rows in pairs for row in rows)

    @property
    def units(self) -> tuple[str, ...]:
        """N of each component of a force, N m of a moment."""
        return tuple("N" if row < 3 else "N m" for rows in self.rows for row in rows)

    @property
    def link_numbers(self) -> list[int]:
        """Number of the link of each component."""
        return [k for k, rows in enumerate(self.rows) for _ in rows]

    def wrenches(self, values: Array) -> list[Array]:
        """Return the wrench (6,) on each link from the values of the components (m,)."""
        wrenches = []
        first = 0
        for rows in self.rows:
            W = np.zeros(6)
            W[list(rows)] = values[first : first + len(rows)]
            wrenches.append(W)
            first += len(rows)
        return wrenches

    def loads(self, values: Array) -> tuple[Load, ...]:
        """Return the loads with these values."""
        return tuple(
            Load(at.link, tuple(W[:3]), tuple(W[3:]), tuple(at.local))
            for at, W in zip(self.at, self.wrenches(values), strict=True)
        )

    def columns(self, pose: Posture) -> LoadTorques:
        """Compute their torques at a posture."""
        pairs = zip(self.at, self.rows, strict=True)
        torque = [at.jacobian(pose)[list(rows)].T for at, rows in pairs]
        numbers = np.array([row for rows in self.rows for row in rows], np.intp)
        length = pose.arm.length

        def stiffness(values: Array) -> Array:
            K = np.zeros((pose.q.size, pose.q.size))
            if values.any():
                pairs = zip(self.at, self.wrenches(values), strict=True)
                K = K + Loads([PointLoad(at, W) for at, W in pairs]).stiffness(pose)
            return K

        return LoadTorques(
            torque=np.hstack([np.zeros((pose.q.size, 0)), *torque]),
            scale=frozen(np.where(numbers < 3, 1.0, length)),
            stiffness=stiffness,
        )


def components_of(
    arm: Manipulator, links: LinksLike | None, points: Mapping[str, ArrayLike] | None
) -> Components:
    """Return what is sought; InvalidInput if a link, a component or a point is none."""
    sought: Any = {arm.tip_link: "force"} if links is None else links
    if not isinstance(sought, Mapping) or not sought:
        raise InvalidInput(
            "links",
            f"{sought!r} given; give a dict of what is sought on each link, such as "
            f'{{"{arm.tip_link}": "force"}}.',
        )
    points = {} if points is None else points
    if not isinstance(points, Mapping):
        raise InvalidInput("points", f"{points!r} given; give a dict of points (3,) by links.")
    for link, place in points.items():
        if link not in sought:
            raise InvalidInput("points", f"{link!r} is not among links; it has {[*sought]}.")
        vector(f"points[{link!r}]", place, 3, "a point (3,) [m] in the frame of the link", "length")
    geometry = arm.definition.geometry
    at = tuple(point_on(arm.body, geometry, link, points.get(link)) for link in sought)
    for k, point in enumerate(at):
        for other in at[:k]:
            if other.key == point.key:
                raise InvalidInput(
                    "links",
                    f"{other.link} and {point.link} are one point of one body: no reading tells "
                    "their loads apart. Give one of them.",
                )
    return Components(at, tuple(_rows(link, rows) for link, rows in sought.items()))


def _rows(link: str, rows: Any) -> tuple[int, ...]:
    """Return rows of a wrench, checked."""
    name = f"links[{link!r}]"
    if isinstance(rows, str):
        if rows in ROWS:
            return ROWS[rows]
        rows = [rows] if rows in COMPONENTS else rows
    rows = rows.tolist() if isinstance(rows, np.ndarray) else rows
    entries = [*rows] if isinstance(rows, (list, tuple)) else [rows]
    found = [COMPONENTS.index(entry) if entry in COMPONENTS else entry for entry in entries]
    known = [
        row
        for row in found
        if isinstance(row, (int, np.integer)) and not isinstance(row, bool) and 0 <= row < 6
    ]
    if not found or len(known) < len(found):
        words = ", ".join(f'"{word}"' for word in ROWS)
        raise InvalidInput(
            name,
            f"{rows!r} given; give {words}, or rows of the wrench: 0 to 5, or "
            f"{', '.join(COMPONENTS)}.",
        )
    if len({*known}) < len(known):
        raise InvalidInput(name, f"{rows!r} names a component twice.")
    return tuple(sorted(map(int, known)))
