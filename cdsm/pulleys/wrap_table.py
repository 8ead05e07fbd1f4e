"""The table of contacts of cables with pulleys at a posture."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, final

import numpy as np
from numpy.typing import NDArray

from cdsm.support.format import aligned
from cdsm.support.result import Result, unit
from cdsm.support.values import Array, frozen

if TYPE_CHECKING:
    from cdsm.posture import Posture


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class WrapTable(Result):
    """Contacts of cables with pulleys at a posture: P rows, cable by cable, from the actuator on.

    Attributes:
        posture: The posture.
        cable: Name of the cable (P,).
        entry: Number of the pulley among the entries of the cable's path, from 1 (P,).
        link: Link of the pulley (P,).
        touches: Whether the cable touches the pulley (P,).
        angle: Wrap angle Φ (P,) [rad]. Of a pulley that the cable clears it is negative: the cable
            would have to turn by this much more to touch.
        fleet_angles: Angle of the free cable to the plane of the pulley, on arrival and on
            departure (P, 2) [rad]; NaN where the cable does not touch, or ends on the rim.
        arrival: Contact at which the cable arrives, in base axes (P, 3) [m]; NaN likewise.
        departure: Contact at which it departs, in base axes (P, 3) [m]; NaN likewise.
    """

    _rows = "pulley"

    posture: Posture
    cable: tuple[str, ...]
    entry: tuple[int, ...]
    link: tuple[str, ...]
    touches: NDArray[np.bool_] = field(metadata=unit("1", "pulley"))
    angle: Array = field(metadata=unit("rad", "pulley"))
    fleet_angles: Array = field(metadata=unit("rad", "pulley", "side"))
    arrival: Array = field(metadata=unit("m", "pulley", "axis"))
    departure: Array = field(metadata=unit("m", "pulley", "axis"))

    def __str__(self) -> str:
        heads = ["cable", "entry", "link", "wrap [deg]", "fleet [deg]", ""]
        rows = [heads]
        degrees = np.rad2deg(self.angle)
        fleet = np.rad2deg(self.fleet_angles)
        for i, touches in enumerate(self.touches.tolist()):
            sides = [f"{value:z.2f}" for value in fleet[i] if np.isfinite(value)]
            words = " / ".join(sides) if touches else "–"
            state = "" if touches else "does not touch"
            place = [self.cable[i], str(self.entry[i]), self.link[i]]
            rows.append([*place, f"{degrees[i]:.2f}", words, state])
        return "\n".join(aligned(rows))


def wrap_table(pose: Posture) -> WrapTable:
    """Return the contacts of all cables with all pulleys; an empty table without pulleys."""
    wrapping = pose.wrapping
    places = [
        (cable.name, i, element.link)
        for cable in pose.arm.cables
        for i, element in enumerate(cable.sites, start=1)
        if element in cable.pulleys
    ]
    P = len(places)
    names, entries, links = zip(*places, strict=True) if places else ((), (), ())
    touches = np.zeros(P, np.bool_) if wrapping is None else wrapping.touches
    fleet = np.full((P, 2), np.nan)
    contacts = np.full((2, P, 3), np.nan)
    if wrapping is not None:
        chosen = wrapping.pattern.pulley
        T = chosen.size
        fleet[chosen] = wrapping.shifts.fleet.reshape(2, T).T
        contacts[:, chosen] = wrapping.node[:, wrapping.pattern.contact].T.reshape(2, T, 3)
    return WrapTable(
        posture=pose,
        cable=names,
        entry=entries,
        link=links,
        touches=frozen(touches),
        angle=frozen(np.zeros(0) if wrapping is None else wrapping.angle),
        fleet_angles=frozen(fleet),
        arrival=frozen(contacts[0].copy()),
        departure=frozen(contacts[1].copy()),
    )
