"""Divide cables into the segments between their holes, for cables that stick in holes.

The segments of a cable are its lead, then one segment between each two neighbouring sites. Between
two segments is a hole. Where the cable sticks in a hole, the segments on both sides are separate
springs. Each segment is therefore described as a :class:`Cable`: the code for cables computes its
length, its derivatives and its stiffness.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self, final

import numpy as np
from numpy.typing import NDArray

from cdsm.cable import Cable
from cdsm.cable_laws import CableLaws
from cdsm.cable_path import Site
from cdsm.pulleys.wrapped_segments import STRAIGHT, ChainPaths, Curvature, Lengths
from cdsm.rigid_body import RigidBody
from cdsm.routing import Indices, Routing, Spans, cross, dot
from cdsm.support.values import Array, ReadOnlyState, frozen


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Chains:
    """S segments and P holes of all C cables of an arm, in each cable from the actuator on.

    Attributes:
        segments: Each segment as a cable between two sites. The series spring is in the first
            segment of each cable. If the cable has friction, only this segment has the cable's
            motor control; the others are position-controlled. The lead is a segment along x of the
            link of the first site.
        cable: Index of the cable of each segment (S,).
        start: Index of the first segment of each cable, and S at the end (C+1,).
        hole: Index of the segment before each hole (P,); the segment after it has the next index.
        site: Index of each hole among the sites of its cable (P,).
        friction: μ of each hole (P,) [-].
        wrap: :attr:`Site.wrap` of each hole (P,) [rad].
        routing: Routing of the segments, each as a cable of its own.
        laws: Their elasticities.
        paths: Cables over pulleys and through sheaths; None: there are none.
    """

    segments: tuple[Cable, ...]
    cable: Indices
    start: Indices
    hole: Indices
    site: Indices
    friction: Array
    wrap: Array
    routing: Routing
    laws: CableLaws
    paths: ChainPaths | None = None

    @property
    def own(self) -> NDArray[np.bool_]:
        """Whether each segment is of the cable of each hole (S, P)."""
        return np.asarray(self.cable[:, None] == self.cable[self.hole])

    @property
    def behind(self) -> NDArray[np.bool_]:
        """Whether each hole lies between each segment and its motor (S, P)."""
        return np.asarray(self.own & (np.arange(self.cable.size)[:, None] > self.hole))

    @property
    def segment_names(self) -> tuple[str, ...]:
        """Name of each segment (S,): its cable, and its number from the actuator."""
        pairs = zip(self.segments, self.cable.tolist(), strict=True)
        first = self.start.tolist()
        return tuple(
            f"{cable.name} segment {s - first[c] + 1}" for s, (cable, c) in enumerate(pairs)
        )

    @property
    def hole_names(self) -> tuple[str, ...]:
        """Name of each hole (P,): its cable, and the number of the site from the actuator."""
        pairs = zip(self.hole.tolist(), self.site.tolist(), strict=True)
        return tuple(f"{self.segments[s].name} site {site + 1}" for s, site in pairs)

    @classmethod
    def of(cls, cables: Sequence[Cable], body: RigidBody) -> Self:
        """Divide cables at their holes into segments."""
        if not all(cable.is_plain for cable in cables):
            return cls._over_pulleys(cables, body)
        segments: list[Cable] = []
        start = [0]
        holes = []
        for cable in cables:
            sites = list(cable.only_sites("this is computed elsewhere."))
            if cable.lead > 0.0:
                x, y, z = sites[0].position
                sites.insert(0, replace(sites[0], position=(x - cable.lead, y, z)))
            for i, site in enumerate(sites[1:-1]):
                among = i + 1 + len(cable.sites) - len(sites)
                holes.append((len(segments) + i, among, site.friction, site.wrap))
            pairs = list(pairwise(replace(site, friction=0.0, wrap=0.0) for site in sites))
            first, rest = _springs_of(cable, pairs[0])
            segments += [first, *(replace(rest, sites=pair) for pair in pairs[1:])]
            start.append(len(segments))
        hole, places, friction, wrap = np.array(holes).reshape(-1, 4).T
        return cls(
            segments=tuple(segments),
            cable=frozen(np.repeat(np.arange(len(cables)), np.diff(start))),
            start=frozen(np.array(start)),
            hole=frozen(hole.astype(np.intp)),
            site=frozen(places.astype(np.intp)),
            friction=frozen(friction.copy()),
            wrap=frozen(wrap.copy()),
            routing=Routing.of(body, segments, every=True),
            laws=CableLaws(tuple(segments), whole=False),
        )

    @classmethod
    def _over_pulleys(cls, cables: Sequence[Cable], body: RigidBody) -> Self:
        """Divide cables of which some run over pulleys or through sheaths."""
        paths = ChainPaths.of(cables, body)
        counts = np.bincount(paths.cable, minlength=len(cables))
        segments: list[Cable] = []
        for cable, count in zip(cables, counts.tolist(), strict=True):
            sites = [site for site in cable.sites if isinstance(site, Site)]
            ends = [replace(site, friction=0.0, wrap=0.0) for site in (sites[0], sites[-1])]
            first, rest = _springs_of(cable, (ends[0], ends[1]))
            segments += [first, *[rest] * (count - 1)]
        return cls(
            segments=tuple(segments),
            cable=paths.cable,
            start=frozen(np.cumsum([0, *counts])),
            hole=paths.hole,
            site=paths.place,
            friction=paths.friction,
            wrap=paths.wrap,
            routing=paths.wraps.all_touching.routing,
            laws=CableLaws(tuple(segments), whole=False),
            paths=paths,
        )


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Segments(ReadOnlyState):
    """Lengths of the S segments of all cables, and wrap angles at their P holes, at a posture.

    Attributes:
        chains: The segments and holes, with the cable of each.
        lengths: Length l of each segment (S,) [m].
        length_jacobian: `∂l/∂θ` (S, nv) [m/rad]; zero for leads and segments within one link.
        wrap: Wrap angle φ at each hole (P,) [rad]: the angle by which the cable turns there, plus
            :attr:`Site.wrap`.
        wrap_jacobian: `∂φ/∂θ` (P, nv) [rad/rad]; 0 where the cable goes straight through.
    """

    chains: Chains
    lengths: Array
    length_jacobian: Array
    wrap: Array
    wrap_jacobian: Array
    _spans: Spans | None = None
    _curvature: Curvature | None = None

    @classmethod
    def at(cls, chains: Chains, twist: Array, placement: Array) -> Self:
        """Compute the segments from the world twists and the poses of the joints' frames.

        With the directions u and v before and behind a hole, `φ = atan2(|u × v|, u·v)` and

            `∂φ/∂θ_i = −(p·d_i/ℓ_u + q·e_i/ℓ_v)`,
            `p = ((u × v) × u)/|u × v|`,   `q = (v × (u × v))/|u × v|`.

        `d_i` and `e_i` are the motions of the segments' far ends, seen from the link of the hole.
        Where the cable goes straight through, φ has a kink; there the gradient is 0, the mean of
        both sides.
        """
        if chains.paths is not None:
            return cls._over_pulleys(chains, chains.paths.at(twist, placement))
        routing = chains.routing
        spans = routing.spans(twist, routing.sites(placement))
        hole = chains.hole
        u = spans.direction[:, hole]
        v = spans.direction[:, hole + 1]
        normal = cross(u, v)
        sine = np.sqrt(dot(normal, normal))
        normal = normal / np.where(sine > STRAIGHT, sine, np.inf)
        p = cross(normal, u) / spans.length[hole]
        q = cross(v, normal) / spans.length[hole + 1]
        # from the end at the hole to the other one, the first site
        along = (spans.length * spans.direction)[:, :, None]
        back = spans.motion - cross(spans.axis, along)
        gradient = np.zeros((hole.size, routing.joint_count))
        rows = np.arange(hole.size)[:, None]
        np.subtract.at(gradient, (rows, routing.path[hole]), dot(p[:, :, None], back[:, hole]))
        turned = dot(q[:, :, None], spans.motion[:, hole + 1])
        np.subtract.at(gradient, (rows, routing.path[hole + 1]), turned)
        return cls(
            chains=chains,
            lengths=frozen(spans.length),
            length_jacobian=frozen(routing.jacobian(spans)),
            wrap=frozen(np.arctan2(sine, dot(u, v)) + chains.wrap),
            wrap_jacobian=frozen(routing.reduced(gradient)),
            _spans=spans,
        )

    @classmethod
    def _over_pulleys(cls, chains: Chains, at: Lengths) -> Self:
        return cls(
            chains=chains,
            lengths=frozen(at.length),
            length_jacobian=frozen(at.jacobian),
            wrap=frozen(at.wrap + chains.wrap),
            wrap_jacobian=frozen(at.wrap_jacobian),
            _curvature=at.curvature,
        )

    @property
    def grip(self) -> Array:
        """Product μ φ of friction coefficient and wrap angle at each hole (P,) [-].

        A cable sticks in a hole while the larger of the tensions before and behind the hole is
        below `e^{μφ}` times the smaller one.
        """
        return self.chains.friction * self.wrap

    def hole_places(self, placement: Array) -> tuple[Array, Array]:
        """Return where each hole is (P, 3) [m], and the direction of the cable behind it (P, 3).

        ``placement`` are the poses of the joints' frames, at which the segments were computed. Both
        are 0 at pulleys that the cable does not touch.
        """
        if self._curvature is not None:
            assert self.chains.paths is not None
            return self.chains.paths.hole_places(self._curvature.wrapping, placement)
        assert self._spans is not None
        routing = self.chains.routing
        behind = self.chains.hole + 1
        sites = routing.sites(placement)
        return sites.T[routing.first[behind]], self._spans.direction.T[behind]

    @property
    def ratio(self) -> Array:
        """Largest ratio `T_{j+1}/T_j` (S,) [-] that the hole after segment j allows: `e^{μφ}`.

        The entry is 1 for the last segment of a cable, which has no hole after it.
        """
        ratios = np.ones(self.lengths.size)
        ratios[self.chains.hole] = np.exp(self.grip)
        return ratios

    def tension_stiffness(self, tension: Array) -> Array:
        """Compute `Σ T_j ∂²l_j/∂θ²` [N m/rad] over the segments j of each cable, (C, nv, nv).

        It is the cable's part of the active term of `K_θ`. ``tension`` is T (S,) [N].
        """
        cable = self.chains.cable
        count = int(cable[-1]) + 1
        if self._curvature is not None:
            return frozen(self._curvature.hessians(tension, count))
        assert self._spans is not None
        return frozen(self.chains.routing.hessians(self._spans, tension, cable, count))

    def active(self, tension: Array) -> Array:
        """Compute the active term `Σ T_j ∂²l_j/∂θ²` (nv, nv) [N m/rad] of all segments."""
        if self._curvature is not None:
            return frozen(self._curvature.hessian(tension))
        assert self._spans is not None
        return frozen(self.chains.routing.hessian(self._spans, tension))


def _springs_of(cable: Cable, ends: tuple[Site, Site]) -> tuple[Cable, Cable]:
    """Return the first segment of a cable, and one of the others, as cables between ``ends``."""
    first = replace(cable, sites=ends, lead=0.0)
    # without friction the motor holds the tension of all segments, and none is a spring
    control = "position" if any(cable.friction) else cable.control
    return first, replace(first, series_stiffness=math.inf, control=control)
