"""Cables over pulleys at a posture: where they touch, what is doubtful, how they are drawn."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cdsm.cable_path import Pulley, positions
from cdsm.pulleys.contact_shifts import Shifts
from cdsm.pulleys.contacts import Contacts
from cdsm.routing import Spans
from cdsm.support.values import Array, frozen

if TYPE_CHECKING:
    from cdsm.pulleys.wraps import Pattern, Wraps

_ARC_STEP = math.radians(10.0)  # angle between points that draw an arc
_NEAR = math.radians(0.1)  # wrap angle at which a remark says that the cable may lift off


@dataclass(frozen=True, eq=False)
class Wrapping:
    """Cables over P pulleys at a posture; the routing is that of T pulleys that touch.

    Attributes:
        wraps: The paths of the cables.
        pattern: Which pulleys touch, and the routing.
        contacts: Where they touch, and the wrap angles.
        node: Sites and contacts (3, N) [m].
        spans: Segments between them.
        lengths: L (C,) [m].
        jacobian: J_L = ∂L/∂θ (C, nv) [m/rad].
        arcs: Length of the cable on each pulley (P,) [m], if it touches.
        centre: Centres (3, P) [m].
        axis: Axes (3, P).
    """

    wraps: Wraps
    pattern: Pattern
    contacts: Contacts
    node: Array
    spans: Spans
    lengths: Array
    jacobian: Array
    arcs: list[float]
    centre: Array
    axis: Array

    @property
    def touches(self) -> NDArray[np.bool_]:
        """Whether the cable touches each pulley (P,)."""
        return np.array(self.contacts.touches)

    @property
    def angle(self) -> Array:
        """Wrap angle Φ (P,) [rad]; of a pulley that does not touch, negative."""
        return np.array(self.contacts.angle)

    @property
    def slope(self) -> Array:
        """Slope tan γ of the helix on each pulley (P,); 0 in a groove."""
        return np.array(self.contacts.slope)

    @cached_property
    def shifts(self) -> Shifts:
        """What the contacts do on their links when the joints move."""
        pattern = self.pattern
        chosen = pattern.pulley
        centre = self.centre[:, chosen]
        return Shifts(
            routing=pattern.routing,
            spans=self.spans,
            ends=pattern.ends,
            radial=self.node[:, pattern.contact] - np.concatenate([centre, centre], axis=1),
            axis=self.axis[:, chosen],
            radius=self.wraps.radius[chosen],
            groove=self.wraps.groove[chosen],
            arc=np.array(self.arcs)[chosen],
            angle=self.angle[chosen],
            slope=self.slope[chosen],
        )

    @cached_property
    def remarks(self) -> tuple[str, ...]:
        """What is doubtful: cables about to lift off, or beside a groove that they snap out of."""
        touches = self.contacts.touches
        remarks = []
        for i, angle in enumerate(self.contacts.angle):
            snapped = angle > 0.0 and not touches[i]
            if not snapped and abs(angle) >= _NEAR:
                continue
            cable, label = self.wraps.label(i)
            if snapped:
                remarks.append(
                    f"{cable} has snapped out of the groove of {label}, beside its plane: there L "
                    "has a step, and an equilibrium may not exist"
                )
            else:
                remarks.append(
                    f"{cable} is within {math.degrees(_NEAR):g}° of lifting off {label}: K_θ has "
                    "another value on the other side"
                )
        return tuple(remarks)

    @cached_property
    def paths(self) -> tuple[Array, ...]:
        """Points (n, 3) [m] along each cable: sites, and those on arcs, at most 10° apart."""
        wraps = self.wraps
        touches = self.contacts.touches
        points = self.centre.T
        paths: list[Array] = []
        node = 0
        pulley = 0
        for cable in wraps.cables:
            path: list[Array] = []
            for element in positions(cable.sites):
                if not isinstance(element, Pulley):
                    path.append(self.node[:, node])
                    node += 1
                else:
                    if touches[pulley]:
                        path += self._arc(pulley, self.node[:, node] - points[pulley])
                        node += 2
                    pulley += 1
            paths.append(frozen(np.array(path)))
        return tuple(paths)

    @cached_property
    def rims(self) -> Array:
        """Points (P, 37, 3) [m] on the circle of each pulley, at the radius of the cable."""
        turn = np.linspace(0.0, 2.0 * np.pi, 37)
        across = np.eye(3)[abs(self.axis).argmin(axis=0)]  # no pulley has its axis along it
        first = np.cross(self.axis.T, across)
        first *= (self.wraps.radius / np.linalg.norm(first, axis=1))[:, None]
        second = np.cross(self.axis.T, first)
        circle = np.cos(turn)[:, None] * first[:, None] + np.sin(turn)[:, None] * second[:, None]
        return frozen(self.centre.T[:, None] + circle)

    def _arc(self, pulley: int, begin: Array) -> list[Array]:
        """Return points on the arc of a pulley that begins at ``begin``, seen from the centre."""
        angle = self.contacts.angle[pulley]
        turns = np.linspace(0.0, angle, max(math.ceil(angle / _ARC_STEP), 1) + 1)
        return [self.on_arc(pulley, begin, turn)[0] for turn in turns.tolist()]

    def on_arc(self, pulley: int, begin: Array, turn: float) -> tuple[Array, Array]:
        """Return a point (3,) [m] on the arc of a pulley, and the unit direction of the cable.

        The arc begins at ``begin`` (3,) [m], seen from the centre; ``turn`` counts from there.
        """
        axis = self.axis[:, pulley]
        radial = begin - (axis @ begin) * axis
        across = np.cross(axis, radial)
        climb = self.contacts.slope[pulley] * self.wraps.radius[pulley] * axis
        start = self.centre[:, pulley] + (axis @ begin) * axis
        point = start + math.cos(turn) * radial + math.sin(turn) * across + turn * climb
        along = math.cos(turn) * across - math.sin(turn) * radial + climb
        return point, along / np.linalg.norm(along)
