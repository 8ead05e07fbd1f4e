"""Cables through sites on the bodies of a tree: their lengths and the derivatives of these.

A joint has the world twist (v, z); a point x that it moves has ∂x/∂θ = v + z × x, for revolute and
prismatic joints alike. A segment from site a to site b, of length ℓ and direction u = (b − a)/ℓ, is
one chain of joints: those on the way up from a to the common ancestor (sign −1), then those down to
b (sign +1). Seen from the body of a, all of them move b:

    d_i = ±(v_i + z_i × b),   ∂ℓ/∂θ_i = u·d_i,
    ∂²ℓ/∂θ_i∂θ_j = ((d_i − (u·d_i) u)/ℓ ± u × z_i)·d_j   with i before j on the way from a to b.

Arrays have the components first, (3, …).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from cdsm.cable import Cable
from cdsm.cable_path import Pulley, Sheath, Site
from cdsm.errors import InvalidInput
from cdsm.joints import Coupling
from cdsm.rigid_body import RigidBody
from cdsm.support.values import Array, frozen

Indices = NDArray[np.intp]

SHORTEST_SEGMENT = 1e-9
"""Distance of two neighbouring sites [m] below which they coincide."""

_TINY = float(np.finfo(float).tiny)


class Spans(NamedTuple):
    """Segments of all cables at a posture: lengths, directions and their motions."""

    length: Array  # ℓ (S,) [m]
    direction: Array  # u (3, S)
    axis: Array  # ± z_i of the joints of each segment (3, S, m)
    motion: Array  # d_i (3, S, m)
    rate: Array  # ∂ℓ/∂θ_i (S, m)


class Node(NamedTuple):
    """A point of a cable on a link: a site, or a contact with a pulley."""

    row: int  # row of the joint that moves the link; the base is 0
    point: Array  # position in the frame of this joint (3,) [m]
    moves: bool = False  # whether it moves on the link, as contacts do
    linked: bool = True  # whether a straight segment leads to it from the node before


def located(body: RigidBody, cable: str, element: Site | Pulley) -> tuple[int, Array]:
    """Return the row of the joint that moves an entry of a cable, and its place in this frame [m].

    Raises InvalidInput, which names the cable, for an unknown link.
    """
    try:
        joint, rotation, translation = body.locate(element.link)
    except InvalidInput as error:
        raise InvalidInput(f"cable {cable!r}", str(error)) from None
    return joint, translation + rotation @ np.array(element.position)


@dataclass(frozen=True, eq=False)
class Routing:
    """Sites of cables on the bodies of a tree, and the segments between them.

    Attributes:
        joint_count: Number n of all joints; nv of them are independent.
        row: Row of the joint that moves each site (P,); the base is 0.
        point: Position of each site in the frame of this joint (P, 3) [m].
        cable: Cable of each segment (S,).
        first: Site at which each segment begins (S,).
        second: Site at which it ends (S,).
        path: Joints of each segment (S, m), in the order from a to b; padded by 0.
        sign: −1 or +1 for each of them (S, m); 0 for padding.
        fixed: Length that is in no segment (C,) [m]: leads, and segments within one body.
        coupling: How the joints follow from the independent ones; None: all are independent.
    """

    joint_count: int
    row: Indices
    point: Array
    cable: Indices
    first: Indices
    second: Indices
    path: Indices
    sign: Array
    fixed: Array
    coupling: Coupling | None = None

    @classmethod
    def of(cls, body: RigidBody, cables: Sequence[Cable], *, every: bool = False) -> Self:
        """Route cables through their sites; :mod:`cdsm.pulleys.wraps` routes those over pulleys.

        With ``every``, segments within one body count as segments.

        Raises InvalidInput for an unknown link, or if two neighbouring sites of a link coincide.
        """
        paths = []
        for cable in cables:
            nodes: list[Node] = []
            linked = True
            for element in cable.sites:
                if isinstance(element, Site):
                    place = located(body, cable.name, element)
                    nodes.append(Node(*place, linked=linked))
                linked = not isinstance(element, Sheath)
            paths.append(nodes)
        return cls.through(body, cables, paths, every=every)

    @classmethod
    def through(
        cls,
        body: RigidBody,
        cables: Sequence[Cable],
        paths: Sequence[Sequence[Node]],
        *,
        every: bool = False,
    ) -> Self:
        """Route cables through the nodes of their paths; leads and sheaths are fixed lengths."""
        row: list[int] = []
        point: list[Array] = []
        fixed = np.array([cable.guided for cable in cables], dtype=np.float64)
        segments: list[tuple[int, int, list[tuple[int, float]]]] = []
        for c, path in enumerate(paths):
            for i, node in enumerate(path):
                row.append(node.row)
                point.append(node.point)
                if i == 0 or not node.linked:
                    continue
                if row[-2] == row[-1] and not (node.moves or path[i - 1].moves):
                    length = math.dist(point[-2], point[-1])
                    if length < SHORTEST_SEGMENT:
                        problem = f"sites {i} and {i + 1} coincide; leave one out."
                        raise InvalidInput(f"cable {cables[c].name!r}", problem)
                    if not every:
                        fixed[c] += length
                        continue
                to_a = body.joints_to(row[-2])
                to_b = body.joints_to(row[-1])
                way = [(joint - 1, -1.0) for joint in reversed(to_a) if joint not in to_b]
                way += [(joint - 1, 1.0) for joint in to_b if joint not in to_a]
                segments.append((c, len(row) - 1, way))
        longest = max((len(way) for *_, way in segments), default=0)
        sequence = np.zeros((len(segments), longest), np.intp)
        sign = np.zeros(sequence.shape)
        for s, (*_, way) in enumerate(segments):
            for i, step in enumerate(way):
                sequence[s, i], sign[s, i] = step
        cable_of, end = (np.array([segment[i] for segment in segments], np.intp) for i in (0, 1))
        return cls(
            joint_count=len(body.all_joints),
            row=frozen(np.array(row, np.intp)),
            point=frozen(np.array(point)),
            cable=frozen(cable_of),
            first=frozen(end - 1),
            second=frozen(end),
            path=frozen(sequence),
            sign=frozen(sign),
            fixed=frozen(fixed),
            coupling=body.coupling,
        )

    def sites(self, placement: Array) -> Array:
        """Compute all sites (3, P) [m] from the poses (n+1, 4, 4) of the joints' frames."""
        return np.asarray(np.einsum("pxy,py->xp", placement[self.row, :3], self._homogeneous))

    @cached_property
    def _homogeneous(self) -> Array:
        return np.column_stack([self.point, np.ones(len(self.point))])

    def spans(self, twist: Array, site: Array) -> Spans:
        """Compute the segments from the world twists (6, n) and the sites (3, P)."""
        b = site[:, self.second]
        w = b - site[:, self.first]
        length = np.sqrt(dot(w, w))
        u = w / np.maximum(length, _TINY)  # the caller refuses coincident sites
        along = twist[:, self.path] * self.sign
        d = along[:3] + cross(along[3:], b[:, :, None])
        return Spans(length, u, along[3:], d, dot(u[:, :, None], d))

    def lengths(self, length: Array) -> Array:
        """Compute the lengths L (C,) [m] of all cables from those of the segments (S,)."""
        return _sum(self.cable, length, len(self.fixed)) + self.fixed

    def jacobian(self, spans: Spans) -> Array:
        """Compute J_L = ∂L/∂θ (C, nv)."""
        real, to = self._rates
        C = len(self.fixed)
        J = _sum(to, spans.rate[real], C * self.joint_count)
        return self.reduced(J.reshape(C, self.joint_count))

    def reduced(self, J: Array) -> Array:
        """Return derivatives (n, …) by the independent joints, from those by all of them."""
        return J @ self.coupling.matrix if self.coupling else J

    def hessian(self, spans: Spans, weight: Array) -> Array:
        """Compute Σ weight_s ∂²ℓ_s/∂θ² (nv, nv): H_L·F if the weights (S,) are tensions."""
        _, source, target = self._pairs
        pairs = self._products(spans, weight)[source]
        H = _sum(target, pairs, self.joint_count**2).reshape(self.joint_count, self.joint_count)
        return self.coupling.square(H) if self.coupling else H

    def hessians(self, spans: Spans, weight: Array, group: Indices, count: int) -> Array:
        """Compute the same sums for each of ``count`` groups of segments (count, nv, nv)."""
        segment, source, target = self._pairs
        pairs = self._products(spans, weight)[source]
        H = _sum(group[segment] * self.joint_count**2 + target, pairs, count * self.joint_count**2)
        H = H.reshape(count, self.joint_count, self.joint_count)
        return self.coupling.square(H) if self.coupling else H

    def _products(self, spans: Spans, weight: Array) -> Array:
        length, u, axis, d, rate = spans
        f = weight[:, None]
        c = (f / length[:, None]) * (d - rate * u[:, :, None]) + f * cross(u[:, :, None], axis)
        return dot(c[:, :, :, None], d[:, :, None]).ravel()

    @cached_property
    def _rates(self) -> tuple[NDArray[np.bool_], Indices]:
        """Which entries of ``path`` are joints, and where they are in J_L."""
        real = self.sign != 0.0
        return real, (self.cable[:, None] * self.joint_count + self.path)[real]

    @cached_property
    def _pairs(self) -> tuple[Indices, Indices, Indices]:
        """For each entry of a Hessian: its segment, its product, and its place in (n, n)."""
        S, m = self.path.shape
        real = self.sign != 0.0
        p, q = np.triu_indices(m)
        both = real[:, p] & real[:, q]
        i = self.path[:, p][both]
        j = self.path[:, q][both]
        segment = np.broadcast_to(np.arange(S)[:, None], both.shape)[both]
        source = (np.arange(S)[:, None] * m * m + p * m + q)[both]
        off = i != j
        return (
            np.concatenate([segment, segment[off]]),
            np.concatenate([source, source[off]]),
            np.concatenate([i * self.joint_count + j, (j * self.joint_count + i)[off]]),
        )


def dot(a: Array, b: Array) -> Array:
    """Compute a·b along the first axis."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def cross(a: Array, b: Array) -> Array:
    """Compute a × b along the first axis; np.cross takes 20 µs."""
    x = a[1] * b[2] - a[2] * b[1]
    out = np.empty((3, *x.shape))
    out[0] = x
    np.subtract(a[2] * b[0], a[0] * b[2], out=out[1])
    np.subtract(a[0] * b[1], a[1] * b[0], out=out[2])
    return out


def _sum(index: Indices, values: Array, count: int) -> Array:
    """Sum values (n,) by their index (n,) into (count,)."""
    return np.asarray(np.bincount(index, values, count), dtype=np.float64)
