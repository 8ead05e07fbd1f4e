"""Cables over pulleys: which pulleys they touch and where, their lengths, J_L and H_L.

:mod:`~cdsm.pulleys.contacts` finds the contacts. Then a cable is a polyline again, through its
sites and its contacts, and :class:`~cdsm.routing.Routing` computes it as if the contacts were holes
of the links:

- L is stationary in the places of its contacts, so J_L is exact. An arc adds its length r Φ/cos γ.
- H_L is exact in the plane of the pulley. Beside it :mod:`~cdsm.pulleys.contact_shifts` adds
  what follows from the shifts of the contacts.

Which pulleys touch is a pattern. An arm meets few patterns; the routing of each is built once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from cdsm.cable import Cable, Cables
from cdsm.cable_path import SURFACE, JointPulley, Pulley, Sheath, positions
from cdsm.errors import InvalidInput, listed
from cdsm.pulleys.contact_shifts import Ends
from cdsm.pulleys.contacts import (
    BESIDE,
    INSIDE,
    TOUCHES,
    UNSETTLED,
    Contacts,
    Pulleys,
    settle_row,
)
from cdsm.pulleys.wrapping import Wrapping
from cdsm.rigid_body import RigidBody
from cdsm.routing import SHORTEST_SEGMENT, Indices, Node, Routing, located
from cdsm.status import Status
from cdsm.support.values import Array, frozen

_PATTERNS = 64  # routings that an arm keeps, of the patterns that it met last

_FAULTS = {
    INSIDE: "a neighbouring point of the cable is inside it",
    BESIDE: "a neighbouring point of the cable is too far beside its groove to keep in it",
    UNSETTLED: "its contacts do not converge: it is too close to its neighbours, beside its groove",
}


class Pattern(NamedTuple):
    """Cables as polylines while they touch certain pulleys, T of all."""

    routing: Routing
    pulley: Indices  # touching pulleys (T,)
    cable: Indices  # cable of each (T,)
    contact: Indices  # nodes at which it arrives, then those at which it departs (2T,)
    ends: Ends  # free pieces at them
    source: list[int]  # of each node among the E entries of all paths, P arrivals, P departures


class PulleyRow(NamedTuple):
    """Pulleys that follow each other between two sites."""

    start: int  # entries of the sites among those of all paths
    end: int
    low: int  # the pulleys
    high: int


@dataclass(frozen=True, eq=False)
class Wraps:
    """The paths of all cables of an arm of which some run over pulleys.

    Attributes:
        body: The arm without cables.
        cables: The C cables.
        pulleys: All P pulleys, cable by cable.
        radius: r of each pulley (P,) [m].
        groove: Whether each pulley has a groove (P,).
        entry: Each pulley among the E entries of all paths that have a place on a link (P,).
        row: PulleyRow of the joint that moves each entry (E,); the base is 0.
        point: Position of each entry in the frame of this joint (E, 3) [m].
        local_axis: Axis of each pulley in this frame (P, 3).
        rows: Pulleys that follow each other between two sites.
        every: Whether segments within one body count as segments.
    """

    body: RigidBody
    cables: tuple[Cable, ...]
    pulleys: tuple[Pulley, ...]
    radius: Array
    groove: NDArray[np.bool_]
    entry: Indices
    row: Indices
    point: Array
    local_axis: Array
    rows: tuple[PulleyRow, ...]
    every: bool

    @classmethod
    def of(cls, body: RigidBody, cables: Sequence[Cable], *, every: bool = False) -> Self:
        """Route cables over a body; with ``every``, segments within one body count as segments.

        Raises InvalidInput, with the cable and the pulley: for an unknown link, a site inside a
        pulley of its link or on the rim beside its groove, and neighbouring pulleys of a link that
        overlap.
        """
        rows: list[int] = []
        points: list[Array] = []
        axes: list[Array] = []
        pulleys: list[Pulley] = []
        entries: list[int] = []
        runs: list[PulleyRow] = []
        for cable in cables:
            start = 0
            first = len(pulleys)
            for element in positions(cable.sites):
                row, point = located(body, cable.name, element)
                if isinstance(element, Pulley):
                    axis = np.array(element.axis)
                    rotation = body.locate(element.link)[1]
                    axes.append(rotation @ (axis / np.linalg.norm(axis)))
                    pulleys.append(element)
                    entries.append(len(rows))
                else:
                    if len(pulleys) > first:
                        runs.append(PulleyRow(start, len(rows), first, len(pulleys)))
                    start = len(rows)
                    first = len(pulleys)
                rows.append(row)
                points.append(point)
        wraps = cls(
            body=body,
            cables=tuple(cables),
            pulleys=tuple(pulleys),
            radius=frozen(np.array([pulley.radius for pulley in pulleys])),
            groove=frozen(np.array([pulley.groove for pulley in pulleys], np.bool_)),
            entry=frozen(np.array(entries, np.intp)),
            row=frozen(np.array(rows, np.intp)),
            point=frozen(np.array(points)),
            local_axis=frozen(np.array(axes).reshape(-1, 3)),
            rows=tuple(runs),
            every=every,
        )
        for run in runs:
            wraps._check(run)
        return wraps

    def at(self, twist: Array, placement: Array) -> Wrapping:
        """Compute the cables from the world twists (6, n) and the poses (n+1, 4, 4) of the joints.

        Raises InvalidInput, which names the pulley, if the cable cannot run over it.
        """
        entry = np.einsum("exy,ey->xe", placement[self.row, :3], self._homogeneous)
        axis = np.einsum("pxy,py->xp", placement[self.row[self.entry], :3, :3], self.local_axis)
        points = entry.T.tolist()
        contacts = self._settle(points, axis.T.tolist())
        pattern = self.pattern(tuple(contacts.touches))
        # the polyline through sites and contacts
        points += contacts.arrival
        points += contacts.departure
        node = np.array([points[i] for i in pattern.source]).T
        spans = pattern.routing.spans(twist, node)
        if spans.length.size and spans.length.min() < SHORTEST_SEGMENT:
            raise self._coincident(pattern, int(spans.length.argmin()))
        # arcs: r Φ in a groove, r Φ/cos γ on a helix
        radii, *_ = self._constants
        arcs = [r * angle for r, angle in zip(radii, contacts.angle, strict=True)]
        if not self.all_grooved:
            arcs = [
                arc * math.sqrt(1.0 + slope * slope)
                for arc, slope in zip(arcs, contacts.slope, strict=True)
            ]
        touching = [arcs[i] for i in pattern.pulley.tolist()]
        lengths = pattern.routing.lengths(spans.length)
        lengths = lengths + np.bincount(pattern.cable, touching, lengths.size)
        return Wrapping(
            wraps=self,
            pattern=pattern,
            contacts=contacts,
            node=node,
            spans=spans,
            lengths=lengths,
            jacobian=pattern.routing.jacobian(spans),
            arcs=arcs,
            centre=entry[:, self.entry],
            axis=axis,
        )

    @property
    def doubts(self) -> tuple[str, ...]:
        """Return a text of the pulleys that no cable touches in the straight arm, if there are."""
        state = self.body.state(self.body.straight)
        try:
            touches = self.at(state.twist, state.placement).contacts.touches
        except InvalidInput:
            return ()  # what is wrong there, a posture says
        labels = (self.label(i) for i, touching in enumerate(touches) if not touching)
        lifted = [f"{cable} does not touch {label}" for cable, label in labels]
        if not lifted:
            return ()
        remedy = "turn its axis over, if the cable runs on the other side."
        return (f"in the straight arm {listed(lifted, 3, '; ')}; {remedy}",)

    def _settle(self, points: list[list[float]], axes: list[list[float]]) -> Contacts:
        """Find the contacts at all P pulleys, from the entries of all paths and the axes."""
        P = len(self.pulleys)
        centres = [points[i] for i in self._entries]
        pulleys = Pulleys(centres, axes, *self._constants)
        contacts = Contacts(
            [[0.0, 0.0, 0.0] for _ in range(P)],
            [[0.0, 0.0, 0.0] for _ in range(P)],
            [0.0] * P,
            [0.0] * P,
            [True] * P,
        )
        for start, end, low, high in self.rows:
            outcome, pulley = settle_row(points[start], points[end], low, high, pulleys, contacts)
            if outcome != TOUCHES:
                raise self.fault(outcome, pulley)
        return contacts

    @cached_property
    def all_grooved(self) -> bool:
        """Whether every pulley has a groove."""
        return bool(self.groove.all())

    @cached_property
    def _homogeneous(self) -> Array:
        return np.column_stack([self.point, np.ones(len(self.point))])

    @cached_property
    def _constants(self) -> tuple[list[float], list[bool], list[int]]:
        """Radius, groove and turns of the pulleys, as lists."""
        turns = [pulley.turns for pulley in self.pulleys]
        return self.radius.tolist(), self.groove.tolist(), turns

    @cached_property
    def _entries(self) -> list[int]:
        entries: list[int] = self.entry.tolist()
        return entries

    def fault(self, outcome: int, pulley: int) -> InvalidInput:
        """Return the error of an outcome of :func:`~cdsm.pulleys.contacts.settle_row` there."""
        cable, label = self.label(pulley)
        message = (
            f"{label}: {_FAULTS[outcome]} at this posture. Move the pulley or its neighbours, "
        )
        message += "take a smaller radius, or change the posture."
        return InvalidInput(f"cable {cable!r}", message, Status.COINCIDENT_SITES)

    def _coincident(self, pattern: Pattern, segment: int) -> InvalidInput:
        """Return the error of a segment without length."""
        cable = self.cables[int(pattern.routing.cable[segment])].name
        ends = pattern.ends
        at = np.flatnonzero(ends.free & (ends.segment[ends.piece] == segment))
        message = "two neighbouring sites coincide at this posture, so the cable has no direction "
        message += "there. Move a site, or change the posture."
        if at.size:
            _, label = self.label(int(pattern.pulley[at[0] % len(pattern.pulley)]))
            message = f"a site of another link, or a pulley, touches the rim of {label} at this "
            message += "posture. A cable that is fixed to the rim has its site on the same link."
        return InvalidInput(f"cable {cable!r}", message, Status.COINCIDENT_SITES)

    def label(self, pulley: int) -> tuple[str, str]:
        """Return the name of a pulley's cable, and words for the pulley."""
        number = pulley
        for cable in self.cables:
            places = [i for i, element in enumerate(cable.sites) if isinstance(element, Pulley)]
            if number < len(places):
                place = places[number] + 1
                link = self.pulleys[pulley].link
                return cable.name, f"the pulley on {link} (entry {place} of its path)"
            number -= len(places)
        raise IndexError(pulley)

    @property
    def all_touching(self) -> Pattern:
        """The polylines of the cables while they touch all pulleys."""
        return self.pattern((True,) * len(self.pulleys))

    @cached_property
    def pattern(self) -> Callable[[tuple[bool, ...]], Pattern]:
        """The polylines of the cables while they touch these of the pulleys, (P,) in all."""
        return lru_cache(_PATTERNS)(self._pattern)

    def _pattern(self, touches: tuple[bool, ...]) -> Pattern:
        paths: list[list[Node]] = []
        pulley: list[int] = []
        cable: list[int] = []
        arrival: list[int] = []
        before: list[int] = []
        source: list[int] = []
        E = len(self.row)
        P = len(self.pulleys)
        place = 0  # entries of paths
        number = 0  # pulleys
        for c, cable_of in enumerate(self.cables):
            nodes: list[Node] = []
            last = -1  # touching pulley right before, of those that touch
            guided = False  # whether a sheath leads here
            for element in cable_of.sites:
                if isinstance(element, Sheath):
                    guided = True
                    continue
                row = int(self.row[place])
                point = self.point[place]
                if not isinstance(element, Pulley):
                    on_rim = last >= 0 and self._on_rim(place, pulley[last])
                    nodes.append(Node(row, point, linked=not (guided or on_rim)))
                    guided = False
                    source.append(place)
                    last = -1
                else:
                    if touches[number]:
                        linked = last >= 0 or not self._on_rim(source[-1], number)
                        nodes.append(Node(row, point, moves=True, linked=linked))
                        nodes.append(Node(row, point, moves=True, linked=False))
                        arrival.append(len(source))
                        before.append(last)
                        cable.append(c)
                        last = len(pulley)
                        pulley.append(number)
                        source += [E + number, E + P + number]
                    number += 1
                place += 1
            paths.append(nodes)
        routing = Routing.through(self.body, self.cables, paths, every=self.every)
        segment = {int(node): s for s, node in enumerate(routing.second)}
        return Pattern(
            routing=routing,
            pulley=np.array(pulley, np.intp),
            cable=np.array(cable, np.intp),
            contact=np.array([*arrival, *(node + 1 for node in arrival)], np.intp),
            ends=Ends.of(
                routing,
                np.array([segment.get(node, -1) for node in arrival], np.intp),
                np.array([segment.get(node + 2, -1) for node in arrival], np.intp),
                np.array(before, np.intp),
            ),
            source=source,
        )

    def _on_rim(self, site: int, pulley: int) -> bool:
        """Return whether a site is on the surface of a pulley of the same link."""
        radial, _ = self._offset(site, pulley)
        same = self.row[site] == self.row[self.entry[pulley]]
        return bool(same and abs(radial - self.radius[pulley]) <= SURFACE)

    def _offset(self, entry: int, pulley: int) -> tuple[float, float]:
        """Return distance from the axis, and height, of an entry on the same link as a pulley."""
        apart = self.point[entry] - self.point[self.entry[pulley]]
        axis = self.local_axis[pulley]
        height = float(axis @ apart)
        return float(np.linalg.norm(apart - height * axis)), height

    def _check(self, row: PulleyRow) -> None:
        """Refuse what is wrong with a row of pulleys at any posture."""
        pulleys = range(row.low, row.high)
        for site, pulley in ((row.start, row.low), (row.end, row.high - 1)):
            if self.row[site] != self.row[self.entry[pulley]]:
                continue
            radial, height = self._offset(site, pulley)
            cable, label = self.label(pulley)
            if radial < self.radius[pulley] - SURFACE:
                message = f"a site is inside {label}: {1e3 * radial:.6g} mm from its axis, the "
                message += f"radius is {1e3 * self.radius[pulley]:.6g} mm. Move one of them."
                raise InvalidInput(f"cable {cable!r}", message)
            if self._on_rim(site, pulley) and self.groove[pulley] and abs(height) > SURFACE:
                message = f"the cable ends on the rim of {label}, {1e3 * height:.6g} mm beside its "
                message += "groove. Put the site into the plane of the pulley."
                raise InvalidInput(f"cable {cable!r}", message)
        for first, second in pairwise(pulleys):
            places = self.entry[[first, second]]
            parallel = abs(self.local_axis[first] @ self.local_axis[second]) > 1.0 - 1e-9
            if self.row[places[0]] == self.row[places[1]] and parallel:
                apart, _ = self._offset(int(places[1]), first)
                if apart < self.radius[first] + self.radius[second] - SURFACE:
                    cable, label = self.label(second)
                    message = f"{label} overlaps the one before it: their axes are "
                    message += f"{1e3 * apart:.6g} mm apart. Move one, or take smaller radii."
                    raise InvalidInput(f"cable {cable!r}", message)


def placed(body: RigidBody, cables: Cables) -> Cables:
    """Return cables with the pulleys on links that those at joints stand for.

    Raises InvalidInput, which names the cable, if there is no such joint that turns.
    """
    return Cables(_placed(body, cable) for cable in cables)


def _placed(body: RigidBody, cable: Cable) -> Cable:
    path: list[object] = list(cable.sites)
    if not any(isinstance(element, JointPulley) for element in path):
        return cable
    for i, element in enumerate(path):
        if isinstance(element, JointPulley):
            try:
                path[i] = element.placed(*body.joint_axis(element.joint))
            except InvalidInput as error:
                raise InvalidInput(f"cable {cable.name!r}", str(error)) from None
    return replace(cable, sites=path)  # type: ignore[arg-type]
