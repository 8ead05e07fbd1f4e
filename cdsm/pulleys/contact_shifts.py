"""How contacts of cables with pulleys shift on their links, and what this adds to H_L.

A contact that were a hole would be held. On a pulley it slips along the cable, which changes
nothing, and it shifts sideways: up the flank of a groove, or along the axis of a smooth cylinder.
:class:`~cdsm.routing.Routing` has the Hessian with held contacts; here is the rest.

A free piece runs from A to B, with the length ℓ and the direction u. Seen from A, a joint moves B's
contact by d and turns the piece by w = z × u. At a contact, n is the outward normal, b = n × u, and
sin γ = a·u.

**Grooves.** As γ grows the contact moves out along n, and as the piece turns it moves along b. The
piece turns by N D instead of (1 − uuᵀ) d/ℓ:

    N = (ℓ 1 + K_A + K_B)⁻¹ − uuᵀ/ℓ,   D = d + K_B w,
    K_A = κ S,   K_B = −κ S,   S = n bᵀ + b nᵀ,   κ = r sin γ/cos² γ,

each K with the pulley of its own end, and 0 if that end is no groove. The piece adds

    ∂²ℓ = Dᵀ N D − wᵀ K_B w   in place of   dᵀ (1 − uuᵀ) d/ℓ.

**Smooth cylinders.** Unrolled, the cable stays one straight line. Its contacts shift along b, the
first by η and the last by η + s σ, with the wrapped length s and the change σ of the helix angle:

    η − ℓ₁ σ = −ℓ₁ C₁,   C₁ = b₁·(N D − w),    η + (s + ℓ₂) σ = −ℓ₂ C₂,   C₂ = −b₂·N D.

C are the rates of the kinks that held contacts would get. Smooth neighbours shift each other, so a
chain is one linear system. It adds Σ C η over the contacts. Nothing is divided by s or ℓ, so that
a cable that is about to lift off (s = 0) is an ordinary case.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from cdsm.routing import Indices, Routing, Spans, cross, dot
from cdsm.support.values import Array

IN_PLANE = 1e-12
"""Sine of γ, and kink per radian, that are rounding."""

_ONE = np.eye(3)


class Ends(NamedTuple):
    """Free pieces at the 2 T contacts, T on arrival and then T on departure; none on a rim."""

    segment: Indices  # segments of the routing that are free pieces at pulleys (G,)
    piece: Indices  # of each contact, among the G (2T,)
    free: NDArray[np.bool_]  # whether there is one (2T,)
    way: Array  # −1 on arrival, where the contact is B of its piece; +1 on departure (2T,)
    before: Indices  # the touching pulley right before each (T,); −1: a site
    contacts: Indices  # of each piece, at B and at A (2, G); 2T: there is none
    entries: tuple[Indices, ...]  # joints of the pieces: piece, segment, place in path, joint

    @classmethod
    def of(cls, routing: Routing, piece_in: Indices, piece_out: Indices, before: Indices) -> Self:
        """Describe the segments that arrive and depart (T,) each; −1: the cable ends on the rim."""
        both = np.concatenate([piece_in, piece_out])
        free = both >= 0
        segment = np.unique(both[free])
        piece = np.searchsorted(segment, np.where(free, both, 0)) % max(segment.size, 1)
        contacts = np.full((2, segment.size), len(both))
        side = np.repeat([0, 1], len(before))
        contacts[side[free], piece[free]] = np.flatnonzero(free)
        g, m = np.nonzero(routing.sign[segment])
        return cls(
            segment=segment,
            piece=piece,
            free=free,
            way=np.repeat([-1.0, 1.0], len(before)),
            before=before,
            contacts=contacts,
            entries=(g, segment[g], m, routing.path[segment][g, m]),
        )

    def repeated(self, postures: int) -> Ends:
        """Return the ends at N postures, one posture behind the other on either side.

        Their segments are the free pieces alone, G of each posture.
        """
        G = self.segment.size
        T = len(self.before)
        place = np.arange(postures)[:, None]
        shape = (2, postures, T)
        piece = self.piece.reshape(2, 1, T) + G * place
        before = np.where(self.before >= 0, self.before + T * place, -1)
        side, t = np.divmod(self.contacts[:, None], max(T, 1))  # side 2: there is none
        contacts = T * postures * side + np.where(side < 2, t + T * place, 0)
        g, _, m, joint = self.entries
        every = (g + G * place).ravel()
        return Ends(
            segment=np.arange(postures * G),
            piece=piece.ravel(),
            free=np.broadcast_to(self.free.reshape(2, 1, T), shape).ravel(),
            way=np.broadcast_to(self.way.reshape(2, 1, T), shape).ravel(),
            before=before.ravel(),
            contacts=contacts.reshape(2, -1),
            entries=(every, every, np.tile(m, postures), np.tile(joint, postures)),
        )


class _Contacts(NamedTuple):
    """All 2 T contacts."""

    normal: Array  # n (3, 2T)
    across: Array  # b (3, 2T)


class _Pieces(NamedTuple):
    """Motions of the G free pieces; all (3, G, nv) but N and K_B, (G, 3, 3)."""

    length: Array  # ℓ (G,)
    moved: Array  # d
    turned: Array  # w
    effective: Array  # D
    compliance: Array  # N
    flank: Array | None  # K_B; None: no cable climbs a flank
    turn: Array  # N D


class _Slips(NamedTuple):
    """Shifts along smooth cylinders; 0 in grooves."""

    kink: Array  # C (2T, nv)
    shift: Array  # η and η + s σ (2T, nv)
    tilt: Array  # σ (T, nv)


@dataclass(frozen=True, eq=False, kw_only=True)
class Shifts:
    """Contacts of the T pulleys that cables touch, at a posture; or at several, T in all.

    Attributes:
        routing: Cables through sites and contacts.
        spans: Their segments.
        ends: The free pieces at the contacts.
        radial: From the centres to the contacts (3, 2T) [m].
        axis: a (3, T).
        radius: r (T,) [m].
        groove: Whether each has a groove (T,).
        arc: Wrapped length s (T,) [m].
        angle: Wrap angle Φ (T,) [rad].
        slope: tan γ of the helix (T,).
        postures: Number N of the postures, whose contacts are those of :meth:`Ends.repeated`.
    """

    routing: Routing
    spans: Spans
    ends: Ends
    radial: Array
    axis: Array
    radius: Array
    groove: NDArray[np.bool_]
    arc: Array
    angle: Array
    slope: Array
    postures: int = 1

    @cached_property
    def _axes(self) -> Array:
        """Axis of the pulley of each contact (3, 2T)."""
        return np.concatenate([self.axis, self.axis], axis=1)

    @cached_property
    def _contacts(self) -> _Contacts:
        axis = self._axes
        out = self.radial - dot(axis, self.radial) * axis
        normal = out / np.sqrt(dot(out, out))
        return _Contacts(normal, cross(normal, self._direction))

    @cached_property
    def _direction(self) -> Array:
        """Directions u of the free pieces at the contacts (3, 2T); 0 where there is none."""
        direction = self.spans.direction[:, self.ends.segment[self.ends.piece]]
        return np.asarray(direction * self.ends.free)

    @cached_property
    def _sine(self) -> Array:
        return dot(self._axes, self._direction)

    @property
    def fleet(self) -> Array:
        """Angle γ of each free piece to the plane of the pulley (2T,) [rad]; NaN on a rim."""
        return np.where(self.ends.free, np.arcsin(np.clip(self._sine, -1.0, 1.0)), np.nan)

    @cached_property
    def _climb(self) -> Array | None:
        """κ with its sign (2T,) [m] where cables leave a groove; None: all in their planes."""
        sine = self._sine * np.concatenate([self.groove, self.groove])
        if abs(sine).max(initial=0.0) <= IN_PLANE:
            return None
        radius = np.concatenate([self.radius, self.radius])
        return np.asarray(self.ends.way * radius * sine / (1.0 - sine * sine))

    @cached_property
    def _pieces(self) -> _Pieces:
        ends = self.ends
        spans = self.spans
        length = spans.length[ends.segment]
        u = spans.direction[:, ends.segment]
        # one column for each joint
        moved, turned = np.zeros((2, 3, ends.segment.size, self.routing.joint_count))
        g, segment, m, joint = ends.entries
        moved[:, g, joint] = spans.motion[:, segment, m]
        turned[:, g, joint] = cross(spans.axis[:, segment, m], u[:, g])
        if self.routing.coupling:
            moved = self.routing.reduced(moved)
            turned = self.routing.reduced(turned)
        # N = (1 − uuᵀ)/ℓ; with the flanks K of grooves at both ends, of which K² = k² (1 − uuᵀ),
        # N = (ℓ (1 − uuᵀ) − K)/(ℓ² − k²)
        scale = length[:, None, None]
        plane = _ONE - u.T[:, :, None] * u.T[:, None]
        if self._climb is None:
            compliance = plane / scale
            turn = _apply(compliance, moved)
            return _Pieces(length, moved, turned, moved, compliance, None, turn)
        normal, across = self._contacts
        nb = normal.T[:, :, None] * (self._climb * across).T[:, None]
        flank = np.zeros((len(nb) + 1, 3, 3))
        flank[:-1] = nb + nb.transpose(0, 2, 1)
        at_b, at_a = flank[ends.contacts]
        both = at_a + at_b
        square = 0.5 * np.einsum("gxy,gxy->g", both, both)[:, None, None]
        compliance = (scale * plane - both) / (scale * scale - square)
        effective = moved + _apply(at_b, turned)
        turn = _apply(compliance, effective)
        return _Pieces(length, moved, turned, effective, compliance, at_b, turn)

    @cached_property
    def _slips(self) -> _Slips | None:
        """Shifts along smooth cylinders; None: there are none, or they do not shift."""
        if self.groove.all():
            return None
        ends = self.ends
        T = len(self.radius)
        smooth = ends.free & ~np.concatenate([self.groove, self.groove])
        # C₁ = b·(N D − w) on arrival, C₂ = −b·N D on departure
        rate = self._pieces.turn[:, ends.piece]
        rate[:, :T] -= self._pieces.turned[:, ends.piece[:T]]
        kink = dot(self._contacts.across[:, :, None], rate) * (-ends.way * smooth)[:, None]
        if abs(kink).max() <= IN_PLANE:
            return None
        first, tilt = self._unrolled(kink)
        last = first + self.arc[:, None] * tilt
        return _Slips(kink, np.concatenate([first, last]), tilt)

    def _unrolled(self, kink: Array) -> tuple[Array, Array]:
        """Solve for η and σ (T, nv): on the unrolled surface the cable stays straight."""
        ends = self.ends
        postures = self.postures
        T = len(self.radius) // postures
        across = self._contacts.across
        N = self._pieces.compliance[ends.piece]
        length = self._pieces.length[ends.piece] * ends.free
        # ℓ bᵀ N b: 1, but for a groove at the other end of the piece; 1 on the rim
        both = np.where(ends.free, length * _form(across, N, across), 1.0)
        stiff = both.reshape(2, postures, T)
        free = length.reshape(2, postures, T)
        arc = self.arc.reshape(postures, T)
        i = np.arange(T)
        M = np.zeros((postures, 2 * T, 2 * T))
        M[:, i, i] = stiff[0]
        M[:, i, T + i] = -free[0]
        M[:, T + i, i] = stiff[1]
        M[:, T + i, T + i] = stiff[1] * arc + free[1]
        # neighbours share a piece, and each sees the other's contact shift
        every = np.flatnonzero(ends.before >= 0)
        first = ends.before[every]
        shared = length[every] * _form(across[:, postures * T + first], N[every], across[:, every])
        n, j = np.divmod(every, T)
        k = first % T
        M[n, j, k] -= shared
        M[n, j, T + k] -= shared * arc[n, k]
        M[n, T + k, j] -= shared
        # nothing shifts in a groove
        held = np.flatnonzero(np.concatenate([self.groove[:T], self.groove[:T]]))
        M[:, held] = 0.0
        M[:, held, held] = 1.0
        sides = (-length[:, None] * kink).reshape(2, postures, T, -1)
        given = sides.transpose(1, 0, 2, 3).reshape(postures, 2 * T, -1)
        shifts = _solved(M, given)
        return tuple(side.reshape(postures * T, -1) for side in np.split(shifts, 2, axis=1))  # type: ignore[return-value]

    @cached_property
    def _factors(self) -> tuple[tuple[Array, Array], ...]:
        """Columns (3, G, nv) whose products add to ∂²ℓ of each piece with held contacts."""
        x = self._pieces
        if x.flank is None:
            return ()
        u = self.spans.direction[:, self.ends.segment, None]
        held = x.moved - dot(u, x.moved) * u
        return (
            (x.effective, x.turn),
            (held / -x.length[:, None], held),
            (-x.turned, _apply(x.flank, x.turned)),
        )

    @property
    def _are_none(self) -> bool:
        """Whether contacts add nothing."""
        return self._climb is None and self._slips is None

    def hessian(self, weight: Array) -> Array | float:
        """Compute what shifts add to Σ weight_s ∂²ℓ_s (nv, nv), weights (S,); 0: nothing.

        Only the sum over the pieces of a cable is symmetric.
        """
        if self._are_none:
            return 0.0
        F = weight[self.ends.segment, None]
        n = self._pieces.moved.shape[2]
        H = np.zeros((n, n))
        for left, right in self._factors:
            H += (F * left).reshape(-1, n).T @ right.reshape(-1, n)
        if self._slips is not None:
            H += (F[self.ends.piece] * self._slips.kink).T @ self._slips.shift
        return 0.5 * (H + H.T)

    def hessian_of_each(self, weight: Array) -> Array | float:
        """Compute the same (N, nv, nv) of N postures, with weights (N, G) of the free pieces."""
        if self._are_none:
            return 0.0
        N = len(weight)
        n = self._pieces.moved.shape[2]
        H = np.zeros((N, n, n))
        for left, right in self._factors:
            weighted = _of_each(left * weight.reshape(-1, 1), N)
            H += weighted.transpose(0, 2, 1) @ _of_each(right, N)
        if self._slips is not None:
            both = (2, -1, n)  # sides
            kink = (self._slips.kink * weight.ravel()[self.ends.piece, None]).reshape(both)
            shift = _of_each(self._slips.shift.reshape(both), N)
            H += _of_each(kink, N).transpose(0, 2, 1) @ shift
        return np.asarray(0.5 * (H + H.transpose(0, 2, 1)))

    def hessians(self, weight: Array, group: Indices, count: int) -> Array | float:
        """Compute what shifts add to the same sums of each of ``count`` groups of segments (S,)."""
        if self._are_none:
            return 0.0
        n = self._pieces.moved.shape[2]
        added = np.zeros((self.ends.segment.size, n, n))
        for left, right in self._factors:
            added += left.transpose(1, 2, 0) @ right.transpose(1, 0, 2)
        if self._slips is not None:
            work = self._slips.kink[:, :, None] * self._slips.shift[:, None]
            np.add.at(added, self.ends.piece, work)
        H = np.zeros((count, n, n))
        segment = self.ends.segment
        np.add.at(H, group[segment], weight[segment, None, None] * added)
        return np.asarray(0.5 * (H + H.transpose(0, 2, 1)))

    @cached_property
    def turning(self) -> Array:
        """Rate ∂u/∂θ (3, G, nv) of the direction of each free piece, seen from its first end."""
        if self._slips is None:
            return self._pieces.turn
        # the contact at B moves by η b, the one at A by (η + s σ) b the other way
        ends = self.ends
        slip = self._slips.shift * -ends.way[:, None]
        moved = self._contacts.across[:, :, None] * slip
        shift = np.zeros_like(self._pieces.turn)
        np.add.at(shift.transpose(1, 0, 2), ends.piece, moved.transpose(1, 0, 2))
        return self._pieces.turn + _apply(self._pieces.compliance, shift)

    @cached_property
    def wrap(self) -> tuple[Array, Array]:
        """Angle β (T,) [rad] by which the cable turns on each pulley, and ∂β/∂θ (T, nv).

        β = Φ in a groove, Φ cos γ on a helix. With the rate ∂u of the direction of a free piece,
        seen from the pulley,

            ∂β/∂θ = n·∂u/cos γ on arrival minus on departure;

        on a helix times cos γ, and −Φ sin γ σ more.
        """
        ends = self.ends
        T = len(self.radius)
        normal = self._contacts.normal
        sine = self._sine
        rate = self.turning[:, ends.piece]
        rate[:, :T] -= self._pieces.turned[:, ends.piece[:T]]
        about = dot(normal[:, :, None], rate)
        about *= (ends.free / np.sqrt(1.0 - sine * sine))[:, None]
        cosine = 1.0 / np.sqrt(1.0 + self.slope**2)
        gradient = cosine[:, None] * (about[:T] - about[T:])
        if self._slips is not None:
            gradient -= (self.angle * self.slope * cosine)[:, None] * self._slips.tilt
        return np.asarray(self.angle * cosine), np.asarray(gradient)


def _apply(matrix: Array, columns: Array) -> Array:
    """Multiply matrices (G, 3, 3) by columns (3, G, n)."""
    return np.asarray((matrix @ columns.transpose(1, 0, 2)).transpose(1, 0, 2))


def _of_each(columns: Array, postures: int) -> Array:
    """Put the columns (k, postures · m, n) of each posture below each other: (postures, k m, n)."""
    k, _, n = columns.shape
    parts = columns.reshape(k, postures, -1, n)
    return parts.transpose(1, 0, 2, 3).reshape(postures, -1, n)


def _form(a: Array, matrix: Array, b: Array) -> Array:
    """Compute aᵀ M b (T,) for vectors (3, T) and matrices (T, 3, 3)."""
    return np.asarray(np.einsum("xt,txy,yt->t", a, matrix, b))


def _solved(matrix: Array, given: Array) -> Array:
    """Solve M x = given of each posture; NaN where M is singular.

    It is never singular where all contacts exist; batches also compute rows that they refuse.
    """
    try:
        return np.asarray(np.linalg.solve(matrix, given), np.float64)
    except np.linalg.LinAlgError:
        found = np.full(given.shape, np.nan)
        for row, (M, right) in enumerate(zip(matrix, given, strict=True)):
            with suppress(np.linalg.LinAlgError):
                found[row] = np.linalg.solve(M, right)
        return found
