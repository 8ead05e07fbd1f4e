"""Numba kernels of the passive stiffness of cables that stick in holes, for blocks of postures.

A hole holds a cable if it has friction and the cable bends there. The part of a cable between two
such holes is called a section. While the cable sticks, each section is a spring of length l and
original length l_0, with

    k = 1/(l_0/EA + 1/k_series),   passive stiffness Σ k g gᵀ over all sections,   g = ∂l/∂θ.

Only the first section of a cable has the series spring. The k of the first section is 0 if the
motor controls the force. The holes that hold depend on the posture, so sections end at other holes
in other postures.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm.kernels.chains import STRAIGHT
from cdsm.kernels.compiling import Index, Width, inlined, inner, lanes, upwards
from cdsm.kernels.segments import Segments, set_derivative
from cdsm.kernels.tree import Frames, Indices, Routing, turned
from cdsm.support.values import Array


class Holes(NamedTuple):
    """Holes and leads of all C cables; the P sites are in the order of :class:`Routing`.

    Attributes:
        first: Index of the first site of each cable, and P at the end (C+1,).
        friction: μ of each site (P,) [-]; 0 if the site is not a hole.
        wrap: Constant angle added to the wrap angle at each site (P,) [rad].
        lead: Length of each lead (C,) [m].
        axis: Direction of each lead in the frame of the joint of its first site (C, 3).
        locked: 1 for each cable with a locked motor, 0 where the motor controls the force (C,).
        series: 1/k_series of each cable (C,) [m/N].
        rest: Tension at which the series spring of each cable is unstrained (C,) [N].
    """

    first: Indices
    friction: Array
    wrap: Array
    lead: Array
    axis: Array
    locked: Array
    series: Array
    rest: Array


class Sticking(NamedTuple):
    """The section of a cable to which a kernel is adding segments, in W postures."""

    length: Array  # l without the spring (W,) [m]
    soft: Array  # compliance of the spring (W,) [m/N]
    locked: Array  # 1, or 0 if its motor controls the force (W,)
    gradient: Array  # g = ∂l/∂θ (nv, W)
    holds: Array  # 1 where the present hole holds, else 0 (W,)
    stiffness: Array  # k of the section (W,) [N/m]
    product: Array  # scratch of :func:`_add_square` (W,)
    before: Array  # direction of the cable before the hole (3, W)


@inlined
def sticking_scratch(nv: int, width: int) -> Sticking:
    """Allocate the :class:`Sticking` of a block of ``width`` postures."""
    a, gradient, before = np.empty((6, width)), np.zeros((nv, width)), np.empty((3, width))
    return Sticking(a[0], a[1], a[2], gradient, a[3], a[4], a[5], before)


@inner
def add_stuck_stiffness(
    routing: Routing,
    holes: Holes,
    frames: Frames,
    rotation: Array,
    tension: Array,
    wire: Array,
    scratch: Segments,
    section: Sticking,
    passive: Array,
    width: Width,
) -> None:
    """Add the passive stiffness Σ k g gᵀ of all sections to ``passive`` (nv, nv, W), i ≤ j only.

    k is the stiffness of a section, and g the gradient of its length. ``wire`` is EA (1 + ε) (C, W)
    [N], also of cables whose motor controls the force.
    """
    segment, joint, across = routing.segment, routing.joint, scratch.direction
    d, along, inverse = scratch.derivative, scratch.along, scratch.inverse
    nv = np.uint64(passive.shape[0])
    s = 0
    for c in upwards(0, holes.lead.shape[0]):
        low, high = nv, np.uint64(0)  # joints that change the section
        open_first_section(holes, c, tension, section, width)
        set_lead(routing, holes, c, rotation, section.before, width)
        end = np.uint64(holes.first[c + np.uint64(1)]) - np.uint64(1)
        for p in upwards(np.uint64(holes.first[c]), end):
            set_vector(frames.site, p, scratch, width)
            if holes.friction[p] > 0.0:
                set_holding(holes.wrap[p], section.before, across, section.holds, width)
                if low < high:
                    _add_square(wire, c, section, low, high, passive, width)
                    if _all_hold(section.holds, width):
                        low, high = nv, np.uint64(0)
                open_next_section(section, width)
            for r in upwards(0, across.shape[0]):
                for w in lanes(width):
                    section.before[r, w] = across[r, w]
            for w in lanes(width):
                section.length[w] += scratch.length[w]
            # add u·d to g; segments that no joint changes are not in the routing
            if s < segment.shape[0] - 1 and np.uint64(segment[s, 1]) == p:
                for w in lanes(width):
                    inverse[w] = 1.0 / scratch.length[w]
                for t in range(segment[s, 3], segment[s + 1, 3]):
                    j = np.uint64(joint[t])
                    sign, at = (1.0, p + np.uint64(1)) if t >= segment[s, 4] else (-1.0, p)
                    set_derivative(frames, sign, at, j, d, width)
                    for w in lanes(width):
                        along[w] = (
                            across[0, w] * d[0, w] + across[1, w] * d[1, w] + across[2, w] * d[2, w]
                        )
                    i = j - np.uint64(1)
                    for w in lanes(width):
                        section.gradient[i, w] += along[w] * inverse[w]
                    low, high = min(low, i), max(high, j)
                s += 1
        if low < high:
            for w in lanes(width):
                section.holds[w] = 1.0
            _add_square(wire, c, section, low, high, passive, width)


@inner
def open_first_section(
    holes: Holes, c: Index, tension: Array, section: Sticking, width: Width
) -> None:
    """Begin the first section of cable c: set length, spring compliance and motor mode.

    The length (W,) [m] starts as the lead minus the elongation of the series spring.
    """
    for w in lanes(width):
        section.length[w] = holes.lead[c] - holes.series[c] * (tension[c, w] - holes.rest[c])
    for w in lanes(width):
        section.soft[w], section.locked[w] = holes.series[c], holes.locked[c]


@inner
def set_lead(
    routing: Routing, holes: Holes, c: Index, rotation: Array, out: Array, width: Width
) -> None:
    """Fill ``out`` (3, W) with the direction of the lead of cable c in base axes."""
    i = np.uint64(routing.row[holes.first[c]])
    x, y, z = holes.axis[c, 0], holes.axis[c, 1], holes.axis[c, 2]
    for r in upwards(0, out.shape[0]):
        for w in lanes(width):
            out[r, w] = turned(rotation, i, r, x, y, z, w)


@inner
def set_vector(site: Array, p: Index, scratch: Segments, width: Width) -> None:
    """Fill ``scratch`` with the vector (3, W) from site p to the next one, and its length (W,).

    The vector is stored as ``direction``, but it is not divided by its length. For
    :func:`set_holding` only its direction counts; :func:`add_stuck_stiffness` divides by the length
    itself. ``site`` has the positions of the sites (P, 3, W) [m].
    """
    across, length = scratch.direction, scratch.length
    far = p + np.uint64(1)
    for r in upwards(0, across.shape[0]):
        for w in lanes(width):
            across[r, w] = site[far, r, w] - site[p, r, w]
    for w in lanes(width):
        square = (
            across[0, w] * across[0, w] + across[1, w] * across[1, w] + across[2, w] * across[2, w]
        )
        length[w] = math.sqrt(square)


@inner
def set_holding(own: float, a: Array, b: Array, holds: Array, width: Width) -> None:
    """Fill ``holds`` (W,): 1 where the cable bends at the hole, so that friction acts, else 0.

    a and b (3, W) are vectors along the cable before and after the hole; ``own`` is the constant
    angle added to the wrap angle [rad].
    """
    more = own - STRAIGHT
    for w in lanes(width):
        x = a[1, w] * b[2, w] - a[2, w] * b[1, w]
        y = a[2, w] * b[0, w] - a[0, w] * b[2, w]
        z = a[0, w] * b[1, w] - a[1, w] * b[0, w]
        sizes = (a[0, w] * a[0, w] + a[1, w] * a[1, w] + a[2, w] * a[2, w]) * (
            b[0, w] * b[0, w] + b[1, w] * b[1, w] + b[2, w] * b[2, w]
        )
        turns = x * x + y * y + z * z - STRAIGHT * STRAIGHT * sizes
        back = -(a[0, w] * b[0, w] + a[1, w] * b[1, w] + a[2, w] * b[2, w])
        most = turns if turns > back else back
        most = most if most > more else more
        holds[w] = 1.0 if most > 0.0 else 0.0


@inner
def set_stiffness(wire: Array, c: Index, section: Sticking, width: Width) -> None:
    """Fill ``section.stiffness`` (W,) [N/m] with k of the sections that end at the current hole.

    It is 0 where the hole does not hold the cable. ``wire`` is EA (1 + ε) (C, W) [N].
    """
    length, soft, locked, holds = section.length, section.soft, section.locked, section.holds
    for w in lanes(width):
        section.stiffness[w] = holds[w] * locked[w] / (length[w] / wire[c, w] + soft[w])


@inner
def open_next_section(section: Sticking, width: Width) -> None:
    """Begin a new section in the postures in which the current hole holds the cable.

    The new section has the length 0, no series spring, and a stiffness as with a locked motor.
    """
    length, soft, locked, holds = section.length, section.soft, section.locked, section.holds
    for w in lanes(width):
        length[w] = 0.0 if holds[w] > 0.0 else length[w]
        soft[w] = 0.0 if holds[w] > 0.0 else soft[w]
        locked[w] = 1.0 if holds[w] > 0.0 else locked[w]


@inner
def _add_square(
    wire: Array, c: Index, section: Sticking, low: Index, high: Index, passive: Array, width: Width
) -> None:
    """Add k g gᵀ of the sections that end at the current hole to ``passive``; set their g to zero.

    k is the stiffness of a section, and g the gradient of its length. g is zero except for the
    joints from ``low`` to ``high`` − 1. ``wire`` is EA (1 + ε) (C, W) [N].
    """
    g, k, product, holds = section.gradient, section.stiffness, section.product, section.holds
    set_stiffness(wire, c, section, width)
    for i in upwards(low, high):
        for w in lanes(width):
            product[w] = k[w] * g[i, w]
        for j in upwards(i, high):
            for w in lanes(width):
                passive[i, j, w] += product[w] * g[j, w]
    for i in upwards(low, high):
        for w in lanes(width):
            g[i, w] = 0.0 if holds[w] > 0.0 else g[i, w]


@inner
def _all_hold(holds: Array, width: Width) -> bool:
    passing = 0
    for w in lanes(width):
        passing += 1 if holds[w] == 0.0 else 0
    return passing == 0
