"""Chains of cables over pulleys and through sheaths, for cables that stick and slide there.

A pulley is a hole whose wrap angle is the angle by which the cable turns on it. The border between
the segments before and behind it is a *mark* on the pulley, fixed to its link: a segment is the
free piece and the arc up to the mark, counted backwards where the mark is beyond the contact. Then
∂l/∂θ of a segment is that of its free pieces with held contacts, and Σ T ∂l/∂θ is the torque, that
of unequal tensions on the pulley included.

- A post that does not turn lets T₂/T₁ grow up to e^{μβ}. One mark stretches the wire on the arc by
  (μβ)²/12 too much; beyond μβ = 0.3 the post is therefore divided into several marks.
- A pulley on a bearing with ρ = μ_bearing r_bearing/r lets it grow up to exp(2 atanh(ρ sin(Φ/2))).
- A pulley that the cable does not touch is a hole without friction; the straight cable is divided
  evenly among its segments. So histories keep their segments.
- A sheath is a row of holes, each with its share of the bend.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple, Self

import numpy as np

from cdsm.cable import Cable
from cdsm.cable_path import Pulley, Sheath, Site
from cdsm.errors import InvalidInput
from cdsm.pulleys.wrapping import Wrapping
from cdsm.pulleys.wraps import Wraps
from cdsm.rigid_body import RigidBody
from cdsm.routing import Indices, cross, dot
from cdsm.support.values import Array, frozen

STRAIGHT = 1e-9
"""Wrap angle [rad] below which a cable counts as straight in a hole: the angle is rounding."""

_WHOLE_POST = 0.3  # μβ up to which one mark is within 0.75 % of the stretch of the arc


class _Division(NamedTuple):
    """How S segments are made of the pieces of one pattern of touching pulleys."""

    share: Array  # of each piece in each segment (S, pieces)
    before: Indices  # piece that arrives at each hole that is a site (P,); −1: none
    behind: Indices  # piece that departs from it (P,); −1: none


class Curvature(NamedTuple):
    """Second derivatives of the segments of chains over pulleys."""

    wrapping: Wrapping
    share: Array  # of each piece in each segment (S, pieces)

    def hessian(self, tension: Array) -> Array:
        """Compute Σ T_j ∂²l_j/∂θ² (nv, nv) [N m/rad] of the segments with tensions T (S,) [N]."""
        routing = self.wrapping.pattern.routing
        weight = tension @ self.share
        H = routing.hessian(self.wrapping.spans, weight)
        return np.asarray(H + self.wrapping.shifts.hessian(weight))

    def hessians(self, tension: Array, count: int) -> Array:
        """Compute the same sums for each of ``count`` cables (count, nv, nv)."""
        routing = self.wrapping.pattern.routing
        weight = tension @ self.share
        H = routing.hessians(self.wrapping.spans, weight, routing.cable, count)
        return np.asarray(H + self.wrapping.shifts.hessians(weight, routing.cable, count))


class Lengths(NamedTuple):
    """Segments and holes at a posture."""

    length: Array  # l (S,) [m]
    jacobian: Array  # ∂l/∂θ (S, nv) [m/rad]
    wrap: Array  # angle by which the cable turns at each hole (P,) [rad]
    wrap_jacobian: Array  # its derivative (P, nv)
    curvature: Curvature


@dataclass(frozen=True, eq=False)
class ChainPaths:
    """Segments and holes of cables over pulleys, whatever the posture.

    Attributes:
        wraps: The paths of the cables; leads are sites of theirs.
        cable: Cable of each segment (S,).
        fixed: Length of sheaths in each segment (S,) [m].
        after: Segment that begins at each entry of all paths (E,); of its last mark, at a pulley.
        hole: Segment before each hole (P,).
        place: Place of each hole among the sites of its cable, from 0 (P,).
        friction: μ of each hole, or ρ of a bearing (P,).
        wrap: Angle of each hole beyond that between its segments (P,) [rad].
        site: Entry of each hole that is a site (P,); −1: it is none.
        pulley: Pulley of each hole (P,); −1: none.
        first: First hole of each pulley; its other holes follow.
        count: Number of holes of each pulley.
        marks: First mark of each pulley, from the axis, in the frame of its joint (…, 3).
        spacing: Angle between marks of each pulley [rad].
    """

    wraps: Wraps
    cable: Indices
    fixed: Array
    after: Indices
    hole: Indices
    place: Indices
    friction: Array
    wrap: Array
    site: Indices
    pulley: Indices
    first: Indices
    count: Indices
    marks: Array
    spacing: Array

    @classmethod
    def of(cls, cables: Sequence[Cable], body: RigidBody) -> Self:
        """Divide cables at their holes, pulleys and sheaths into segments."""
        led = [_led(cable) for cable in cables]
        wraps = Wraps.of(body, led, every=True)
        angle, marks = _middle(wraps)
        cable_of: list[int] = []
        fixed: list[float] = []
        after: list[int] = []
        holes: list[tuple[int, int, float, float, int, int]] = []
        first: list[int] = []
        counts: list[int] = []

        def begin(c: int, length: float = 0.0) -> None:
            cable_of.append(c)
            fixed.append(length)

        for c, cable in enumerate(led):
            begin(c)
            skipped = len(cable.sites) - len(cables[c].sites)
            last = len(cable.sites) - 1
            for k, element in enumerate(cable.sites):
                place = k - skipped
                if isinstance(element, Sheath):
                    piece = element.length / element.pieces
                    fixed[-1] += piece / 2.0
                    for i in range(element.pieces):
                        bend = element.wrap / element.pieces
                        holes.append((len(fixed) - 1, place, element.friction, bend, -1, -1))
                        begin(c, piece if i < element.pieces - 1 else piece / 2.0)
                    continue
                entry = len(after)
                if isinstance(element, Pulley):
                    number = len(first)
                    grip = element.friction * max(float(angle[number]), 0.0)
                    n = max(math.ceil(grip / _WHOLE_POST), 1)
                    first.append(len(holes))
                    counts.append(n)
                    mu = element.friction or element.bearing
                    for _ in range(n):
                        holes.append((len(fixed) - 1, place, mu, 0.0, -1, number))
                        begin(c)
                elif 0 < k < last:
                    mu, bend = element.friction, element.wrap
                    holes.append((len(fixed) - 1, place, mu, bend, entry, -1))
                    begin(c)
                after.append(len(fixed) - 1)
        hole, place_of, friction, wrap, site, pulley = np.array(holes).reshape(-1, 6).T
        count = np.array(counts, np.intp)
        return cls(
            wraps=wraps,
            cable=frozen(np.array(cable_of, np.intp)),
            fixed=frozen(np.array(fixed)),
            after=frozen(np.array(after, np.intp)),
            hole=frozen(hole.astype(np.intp)),
            place=frozen(place_of.astype(np.intp)),
            friction=frozen(friction.copy()),
            wrap=frozen(wrap.copy()),
            site=frozen(site.astype(np.intp)),
            pulley=frozen(pulley.astype(np.intp)),
            first=frozen(np.array(first, np.intp)),
            count=frozen(count),
            marks=frozen(_first_marks(wraps, marks, angle, count)),
            spacing=frozen(np.maximum(angle, 0.0) / np.maximum(count, 1)),
        )

    def at(self, twist: Array, placement: Array) -> Lengths:
        """Compute the segments from the world twists and the poses of the joints' frames."""
        wrapping = self.wraps.at(twist, placement)
        division = self.division(tuple(wrapping.contacts.touches))
        routing = wrapping.pattern.routing
        spans = wrapping.spans
        length = self.fixed + division.share @ spans.length
        self._add_arcs(length, wrapping, placement)
        rate = np.zeros((spans.length.size, routing.joint_count))
        s, m = np.nonzero(routing.sign)
        rate[s, routing.path[s, m]] = spans.rate[s, m]
        jacobian = division.share @ routing.reduced(rate)
        wrap, gradient = self._turns(wrapping, division)
        return Lengths(length, jacobian, wrap, gradient, Curvature(wrapping, division.share))

    @cached_property
    def division(self) -> Callable[[tuple[bool, ...]], _Division]:
        """How the segments are made of pieces, while the cables touch these of the pulleys."""
        return lru_cache(64)(self._divide)

    def _divide(self, touches: tuple[bool, ...]) -> _Division:
        wraps = self.wraps
        pattern = wraps.pattern(touches)
        routing = pattern.routing
        E = len(wraps.row)
        P = len(wraps.pulleys)
        # entries at the ends of each piece
        entries = np.concatenate([np.arange(E), wraps.entry, wraps.entry])
        source = entries[np.array(pattern.source, np.intp)]
        pulley_at = np.full(E, -1)
        pulley_at[wraps.entry] = np.arange(P)
        share = np.zeros((self.fixed.size, routing.cable.size))
        for s, (first, second) in enumerate(zip(routing.first, routing.second, strict=True)):
            low, high = source[first], source[second]
            # from the segment behind the first entry to the one before the second
            begin = self.after[low]
            end = self.after[high]
            if pulley_at[high] >= 0:
                end -= self.count[pulley_at[high]]
            elif (self.site == high).any():
                end -= 1
            share[begin : end + 1, s] = 1.0 / (end + 1 - begin)
        arriving = dict(zip(routing.second.tolist(), range(routing.cable.size), strict=True))
        departing = dict(zip(routing.first.tolist(), range(routing.cable.size), strict=True))
        node_of = {int(entry): n for n, entry in enumerate(pattern.source) if entry < E}
        nodes = [node_of.get(int(entry), -1) for entry in self.site]
        return _Division(
            share,
            np.array([arriving.get(node, -1) for node in nodes], np.intp),
            np.array([departing.get(node, -1) for node in nodes], np.intp),
        )

    def hole_places(self, wrapping: Wrapping, placement: Array) -> tuple[Array, Array]:
        """Return where each hole is (P, 3) [m], and the unit direction of the cable there (P, 3).

        Both are 0 at pulleys that the cable does not touch. Holes of a sheath divide the straight
        line between its sites; before the first site they are at this one.
        """
        division = self.division(tuple(wrapping.contacts.touches))
        wraps = self.wraps
        frames = placement[wraps.row]
        entries = np.einsum("exy,ey->ex", frames[:, :3, :3], wraps.point) + frames[:, :3, 3]
        points, along = np.zeros((2, self.hole.size, 3))
        at = np.flatnonzero(self.site >= 0)
        points[at] = entries[self.site[at]]
        along[at] = wrapping.spans.direction.T[division.behind[at]]
        chosen = wrapping.pattern.pulley
        for p, arrival, first in zip(
            chosen.tolist(),
            wrapping.pattern.contact[: chosen.size].tolist(),
            self._first_turns(wrapping, placement).tolist(),
            strict=True,
        ):
            radial = wrapping.node[:, arrival] - wrapping.centre[:, p]
            for i in range(int(self.count[p])):
                turn = min(max(first + i * self.spacing[p], 0.0), wrapping.contacts.angle[p])
                hole = self.first[p] + i
                points[hole], along[hole] = wrapping.on_arc(p, radial, turn)
        for hole in np.flatnonzero((self.site < 0) & (self.pulley < 0)).tolist():
            points[hole], along[hole] = self._in_sheath(hole, entries)
        return points, along

    def _in_sheath(self, hole: int, entries: Array) -> tuple[Array, Array]:
        """Return the place (3,) of a hole in a sheath, and a direction there, from those (E, 3)."""
        cable = self.cable[self.hole]
        same = np.flatnonzero((cable == cable[hole]) & (self.place == self.place[hole]))
        behind = int(np.searchsorted(self.after, self.hole[hole], side="right"))
        before = behind - 1
        part = (hole - same[0] + 0.5) / same.size
        if before < 0 or self.cable[self.after[before]] != cable[hole]:  # it begins the cable
            before, behind, part = behind, behind + 1, 0.0
        way = entries[behind] - entries[before]
        return entries[before] + part * way, way / (float(np.linalg.norm(way)) or 1.0)

    def _add_arcs(self, length: Array, wrapping: Wrapping, placement: Array) -> None:
        """Add the arcs of touching pulleys, from contact to mark and from mark to contact."""
        chosen = wrapping.pattern.pulley
        if not chosen.size:
            return
        n = self.count[chosen]
        spacing = self.spacing[chosen]
        angle = wrapping.angle[chosen]
        begin = self._first_turns(wrapping, placement)
        arc = np.array(wrapping.arcs)[chosen] / np.where(angle > 0.0, angle, 1.0)  # per angle
        hole = self.hole[self.first[chosen]]
        np.add.at(length, hole, arc * begin)
        np.add.at(length, hole + n, arc * (angle - begin - (n - 1) * spacing))
        for i, several in enumerate(n.tolist()):
            length[hole[i] + 1 : hole[i] + several] += arc[i] * spacing[i]

    def _first_turns(self, wrapping: Wrapping, placement: Array) -> Array:
        """Compute the angle from the arrival to the first mark of each touching pulley [rad]."""
        wraps = self.wraps
        chosen = wrapping.pattern.pulley
        axis = wrapping.axis[:, chosen]
        contact = wrapping.pattern.contact[: chosen.size]
        radial = wrapping.node[:, contact] - wrapping.centre[:, chosen]
        radial = radial - dot(axis, radial) * axis
        rotation = placement[wraps.row[wraps.entry[chosen]], :3, :3]
        mark = np.einsum("pxy,py->xp", rotation, self.marks[chosen])
        # of the turn in which it is nearest to its place on the arc
        begin = np.arctan2(dot(axis, cross(radial, mark)), dot(radial, mark))
        spread = (self.count[chosen] - 1) * self.spacing[chosen]
        expected = 0.5 * (wrapping.angle[chosen] - spread)
        return np.asarray(begin + 2.0 * np.pi * np.round((expected - begin) / (2.0 * np.pi)))

    def _turns(self, wrapping: Wrapping, division: _Division) -> tuple[Array, Array]:
        """Compute by which angle the cables turn at each hole (P,), and its derivative (P, nv)."""
        routing = wrapping.pattern.routing
        spans = wrapping.spans
        wrap = np.zeros(self.hole.size)
        nv = len(routing.coupling.leaders) if routing.coupling else routing.joint_count
        gradient = np.zeros((self.hole.size, nv))
        # sites: φ = atan2(|u × v|, u·v), ∂φ = −(v·∂u + u·∂v)/sin φ, seen from the link of the hole
        at = np.flatnonzero((division.before >= 0) & (division.behind >= 0))
        if at.size:
            before, behind = division.before[at], division.behind[at]
            u, v = spans.direction[:, before], spans.direction[:, behind]
            normal = cross(u, v)
            sine = np.sqrt(dot(normal, normal))
            wrap[at] = np.arctan2(sine, dot(u, v))
            turning, turned = self._piece_rates(wrapping)
            rate = dot(v[:, :, None], (turning - turned)[:, before])
            rate += dot(u[:, :, None], turning[:, behind])
            gradient[at] = -rate / np.where(sine > STRAIGHT, sine, np.inf)[:, None]
        chosen = wrapping.pattern.pulley
        if chosen.size:
            angles, rates = wrapping.shifts.wrap
            for angle, rate, p in zip(angles.tolist(), rates, chosen.tolist(), strict=True):
                n = int(self.count[p])
                holes = slice(int(self.first[p]), int(self.first[p]) + n)
                if rho := self.wraps.pulleys[p].bearing:
                    half = angle / 2.0
                    wrap[holes] = 2.0 * math.atanh(rho * abs(math.sin(half))) / rho
                    slope = math.copysign(math.cos(half), math.sin(half) * math.cos(half))
                    slope /= 1.0 - (rho * math.sin(half)) ** 2
                    gradient[holes] = slope * rate
                else:
                    wrap[holes] = angle / n
                    gradient[holes] = rate / n
        return wrap, gradient

    def _piece_rates(self, wrapping: Wrapping) -> tuple[Array, Array]:
        """Return ∂u/∂θ of all pieces seen from their first ends, and their turns w = z × u."""
        routing = wrapping.pattern.routing
        spans = wrapping.spans
        S = spans.length.size
        moved, turned = np.zeros((2, 3, S, routing.joint_count))
        s, m = np.nonzero(routing.sign)
        joint = routing.path[s, m]
        u = spans.direction
        moved[:, s, joint] = spans.motion[:, s, m] - spans.rate[s, m] * u[:, s]
        turned[:, s, joint] = cross(spans.axis[:, s, m], u[:, s])
        turning = routing.reduced(moved) / spans.length[:, None]
        if wrapping.pattern.pulley.size:
            turning[:, wrapping.pattern.ends.segment] = wrapping.shifts.turning
        return turning, routing.reduced(turned)


def _led(cable: Cable) -> Cable:
    """Return a cable with its lead as a segment along x of the link of the first site."""
    first = cable.sites[0]
    if cable.lead == 0.0 or not isinstance(first, Site):
        return cable
    x, y, z = first.position
    start = Site(first.link, (x - cable.lead, y, z))
    return replace(cable, lead=0.0, sites=(start, *cable.sites))


def _middle(wraps: Wraps) -> tuple[Array, Array]:
    """Return wrap angle (P,) and arrival (P, 3) of each pulley, seen from its axis.

    They are those at the angles halfway between the joint limits, or at 0. The arrivals are in the
    frames of the joints.
    """
    body = wraps.body
    finite = np.isfinite(body.lower) & np.isfinite(body.upper)
    middle = np.where(finite, (np.where(finite, body.lower, 0.0) + body.upper) / 2.0, 0.0)
    for q in (np.where(finite, middle, 0.0), body.straight):
        state = body.state(q)
        try:
            wrapping = wraps.at(state.twist, state.placement)
        except InvalidInput:
            continue
        rotation = state.placement[wraps.row[wraps.entry], :3, :3]
        radial = np.array(wrapping.contacts.arrival).reshape(-1, 3) - wrapping.centre.T
        axis = wrapping.axis.T
        radial -= np.einsum("px,px->p", axis, radial)[:, None] * axis
        return wrapping.angle, np.einsum("pyx,py->px", rotation, radial)
    # no posture to look at: marks anywhere
    across = np.cross(wraps.local_axis, np.eye(3)[abs(wraps.local_axis).argmin(axis=1)])
    return np.zeros(len(wraps.pulleys)), across


def _first_marks(wraps: Wraps, arrival: Array, angle: Array, count: Indices) -> Array:
    """Return the first mark of each pulley (P, 3): marks divide the arc evenly."""
    turn = angle / (2.0 * np.maximum(count, 1))
    across = np.cross(wraps.local_axis, arrival)
    return np.asarray(np.cos(turn)[:, None] * arrival + np.sin(turn)[:, None] * across)
