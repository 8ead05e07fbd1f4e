"""Numba kernel of breakaway, for blocks of postures: the load at which a cable first slides.

An arm is stuck while its cables stick in their holes. Then a force f e at the tip, with a unit
vector e, moves the joints by θ̇ = K_θ⁻¹ J_vᵀ e per newton; a dot is a derivative with respect to f.
A cable sticks in a hole that has friction if it bends there. The part of a cable between two such
holes is a section, with tension T, length l and stiffness k. Without the force, all sections of a
cable have the tension F. Per newton of f, the tension changes by Ṫ = k l̇ in the section before a
hole, and by Ṫ′ = k′ l̇′ in the section after it. With the friction coefficient μ and the wrap angle
φ of the hole, the cable begins to slide in it, to first order, at

    f = μ φ/(|Ṫ′ − Ṫ|/F − μ φ̇),   φ̇ = −(u̇·v + u·v̇)/sin φ,

where u and v are the directions of the cable before and after the hole. The breakaway load is the
least f of all holes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cdsm.kernels.chains import STRAIGHT
from cdsm.kernels.compiling import Index, Width, inlined, inner, lanes, threaded, upwards
from cdsm.kernels.records import fetch
from cdsm.kernels.segments import Segments, segment_scratch, set_direction
from cdsm.kernels.stuck import (
    Holes,
    Sticking,
    open_first_section,
    open_next_section,
    set_holding,
    set_lead,
    set_stiffness,
    sticking_scratch,
)
from cdsm.kernels.tree import Frames, Routing, Tree, empty_frames, forward_kinematics
from cdsm.support.values import Array

ROUNDING = 1e-12
"""A hole never slides if its |Ṫ′ − Ṫ|/F − μ φ̇ is below this fraction of the largest |Ṫ′ − Ṫ|/F."""


class Velocities(NamedTuple):
    """Velocities of the arm: derivatives of positions with respect to the force f at the tip."""

    turn: Array  # angular velocity of each joint (nv+1, 3, W)
    origin: Array  # velocity of the origin of each joint (nv+1, 3, W)
    site: Array  # velocity of each site (P, 3, W)
    before: Array  # u̇ of the cable before the present hole (3, W)
    after: Array  # v̇ of the cable after it (3, W)
    longer: Array  # l̇ of the section up to this hole (W,)


class SlipRates(NamedTuple):
    """Terms of the load at which a cable begins to slide, for each hole where it sticks.

    A section follows the hole. The terms are stored in the row of the site where this section ends:
    the next hole where the cable sticks, or the end of the cable.
    """

    jump: Array  # |Ṫ′ − Ṫ|/F (P, W)
    turning: Array  # μ φ̇ (P, W)
    limit: Array  # μ φ (P, W), −1 in the rows of no hole
    last: Array  # of the last hole passed: Ṫ/F before it, μ φ̇ and μ φ (3, W)


@threaded
def set_breakaway(
    tree: Tree,
    routing: Routing,
    holes: Holes,
    q: Array,
    tension: Array,
    wire: Array,
    motion: Array,
    width: int,
    out: Array,
) -> None:
    """Fill ``out`` with the breakaway loads (b, D) [N] of b postures in D directions e.

    Args:
        tree: Joints of the arm.
        routing: Cable sites of the arm.
        holes: Holes of its cables.
        q: Joint angles (b, nv) [rad].
        tension: F (b, C) [N].
        wire: EA (1 + ε) (b, C) or (1, C) [N].
        motion: Joint motion θ̇ of the stuck arm per load, in B blocks of W postures (B, nv, D, W)
            [rad/N].
        width: W, the number of postures in a block.
        out: The loads; inf where no cable ever slides, 0 where no cable sticks.
    """
    nv, cables = motion.shape[1], routing.fixed.shape[0]
    rows, sites = tree.parent.shape[0], routing.row.shape[0]
    angles, F, EA = np.empty((nv, width)), np.empty((cables, width)), np.empty((cables, width))
    frames, scratch = empty_frames(tree, routing, width), segment_scratch(nv, width)
    rotation, section = np.empty((rows, 3, 3, width)), sticking_scratch(nv, width)
    links, holding = np.zeros((2, rows, 3, width)), np.empty((3, sites, width))
    moved, beside = np.empty((sites, 3, width)), np.empty((3, 3, width))
    rates = Velocities(links[0], links[1], moved, beside[0], beside[1], np.empty(width))
    slips = SlipRates(holding[0], holding[1], holding[2], beside[2])
    load = np.empty(width)
    for b in range(motion.shape[0]):
        first = b * width
        fetch(q, first, angles, width)
        fetch(tension, first, F, width)
        fetch(wire, first, EA, width)
        forward_kinematics(tree, routing, angles, np.empty((2, width)), rotation, frames, width)
        for d in range(motion.shape[2]):
            _set_velocities(tree, routing, frames, motion[b], d, rates, width)
            _set_slip_rates(
                routing, holes, frames, rotation, F, EA, scratch, section, rates, slips, width
            )
            _set_loads(slips, load, width)
            for w in range(min(width, q.shape[0] - first)):
                out[first + w, d] = load[w]


@inner
def _set_velocities(
    tree: Tree,
    routing: Routing,
    frames: Frames,
    motion: Array,
    direction: int,
    rates: Velocities,
    width: Width,
) -> None:
    """Fill ``rates`` with the velocities of joints and sites for one direction e of the force.

    ``motion`` (nv, D, W) is the joint motion θ̇ for each of D directions; e has the index
    ``direction``.
    """
    turn, moved, d = rates.turn, rates.origin, np.uint64(direction)
    for k in range(tree.order.shape[0]):
        i = np.uint64(tree.order[k])
        before, joint = np.uint64(tree.parent[i]), i - np.uint64(1)
        for r in upwards(0, turn.shape[1]):
            for w in lanes(width):
                turn[i, r, w] = turn[before, r, w] + frames.axis[i, r, w] * motion[joint, d, w]
        origin = frames.origin[before]
        _set_velocity(turn[before], moved[before], origin, frames.origin[i], moved[i], width)
        for r in range(3 if frames.slide.shape[0] else 0):
            for w in lanes(width):
                moved[i, r, w] += frames.slide[i, r, w] * motion[joint, d, w]
    for p in upwards(0, routing.row.shape[0]):
        i = np.uint64(routing.row[p])
        site = frames.site[p]
        _set_velocity(turn[i], moved[i], frames.origin[i], site, rates.site[p], width)


@inner
def _set_velocity(
    turn: Array, moved: Array, origin: Array, point: Array, velocity: Array, width: Width
) -> None:
    """Fill ``velocity`` (3, W) with v + ω × (x − o), the velocity of the ``point`` x of a link.

    ``origin`` is o, ``moved`` is its velocity v, and ``turn`` the angular velocity ω, (3, W) each.
    """
    for r in range(3):
        m, n = (r + 1) % 3, (r + 2) % 3
        for w in lanes(width):
            y, z = point[m, w] - origin[m, w], point[n, w] - origin[n, w]
            velocity[r, w] = moved[r, w] + turn[m, w] * z - turn[n, w] * y


@inner
def _set_slip_rates(
    routing: Routing,
    holes: Holes,
    frames: Frames,
    rotation: Array,
    tension: Array,
    wire: Array,
    scratch: Segments,
    section: Sticking,
    rates: Velocities,
    slips: SlipRates,
    width: Width,
) -> None:
    u, length, _, _, along, _ = scratch
    for p in upwards(0, slips.limit.shape[0]):
        for w in lanes(width):
            slips.jump[p, w], slips.limit[p, w] = 0.0, -1.0
    for c in upwards(0, holes.lead.shape[0]):
        open_first_section(holes, c, tension, section, width)
        set_lead(routing, holes, c, rotation, section.before, width)
        # the lead turns with the link of the first site, and keeps its length
        turn, zero = rates.turn[np.uint64(routing.row[holes.first[c]])], rates.origin[0]
        _set_velocity(turn, zero, zero, section.before, rates.before, width)
        for w in lanes(width):
            rates.longer[w], slips.last[2, w] = 0.0, -1.0
        end = np.uint64(holes.first[c + np.uint64(1)]) - np.uint64(1)
        for p in upwards(np.uint64(holes.first[c]), end):
            far = p + np.uint64(1)
            set_direction(frames.site, p, far, scratch, width)
            for w in lanes(width):
                along[w] = 0.0
            for r in upwards(0, u.shape[0]):
                for w in lanes(width):
                    along[w] += u[r, w] * (rates.site[far, r, w] - rates.site[p, r, w])
            for r in upwards(0, u.shape[0]):
                for w in lanes(width):
                    apart = rates.site[far, r, w] - rates.site[p, r, w]
                    rates.after[r, w] = (apart - along[w] * u[r, w]) / length[w]
            if holes.friction[p] > 0.0:  # where the cable bends, a section ends
                set_holding(holes.wrap[p], section.before, u, section.holds, width)
                _store_hole(holes, p, tension, wire, c, u, section, rates, slips, width)
            for r in upwards(0, u.shape[0]):
                for w in lanes(width):
                    section.before[r, w], rates.before[r, w] = u[r, w], rates.after[r, w]
            for w in lanes(width):
                section.length[w] += length[w]
                rates.longer[w] += along[w]
        for w in lanes(width):
            section.holds[w] = 1.0
        _store_hole(holes, end, tension, wire, c, u, section, rates, slips, width)


@inner
def _store_hole(
    holes: Holes,
    p: Index,
    tension: Array,
    wire: Array,
    c: Index,
    v: Array,
    section: Sticking,
    rates: Velocities,
    slips: SlipRates,
    width: Width,
) -> None:
    """Where cable c sticks in hole p, end its section there and begin the next one.

    The sections on both sides of the last sticking hole before p are then known, so the terms of
    that hole go to row p of ``slips``. Then p becomes the last one. v (3, W) is the direction of
    the cable after p.
    """
    set_stiffness(wire, c, section, width)
    u, mu, own = section.before, holes.friction[p], holes.wrap[p]
    for w in lanes(width):
        if section.holds[w] == 0.0:
            continue
        F = tension[c, w]
        rate = section.stiffness[w] * rates.longer[w] / (F if F > 0.0 else 1.0)
        if slips.last[2, w] >= 0.0:
            slips.jump[p, w] = abs(rate - slips.last[0, w])
            slips.turning[p, w] = slips.last[1, w]
            slips.limit[p, w] = slips.last[2, w]
        x = u[1, w] * v[2, w] - u[2, w] * v[1, w]
        y = u[2, w] * v[0, w] - u[0, w] * v[2, w]
        z = u[0, w] * v[1, w] - u[1, w] * v[0, w]
        sine, cosine, change = math.sqrt(x * x + y * y + z * z), 0.0, 0.0
        for r in range(3):
            cosine += u[r, w] * v[r, w]
            change -= rates.before[r, w] * v[r, w] + u[r, w] * rates.after[r, w]
        # a slack cable has no friction: any change of the load makes it slide
        limit = mu * (math.atan2(sine, cosine) + own) if F > 0.0 else 0.0
        slips.last[0, w], slips.last[2, w] = rate, limit
        slips.last[1, w] = mu * change / sine if sine > STRAIGHT else 0.0
        rates.longer[w] = 0.0
    open_next_section(section, width)


@inlined
def _set_loads(slips: SlipRates, load: Array, width: Width) -> None:
    """Fill ``load`` (W,) [N] with the breakaway load, the least load of all holes in ``slips``.

    It is inf if no cable ever slides, and 0 if no cable sticks.
    """
    for w in lanes(width):
        most, found, held = 0.0, math.inf, False
        for p in range(slips.limit.shape[0]):
            most = max(most, slips.jump[p, w])
        for p in range(slips.limit.shape[0]):
            limit, rate = slips.limit[p, w], slips.jump[p, w] - slips.turning[p, w]
            if limit >= 0.0:
                held = True
                if rate > ROUNDING * most:
                    found = min(found, limit / rate)
        load[w] = found if held else 0.0
