"""Contacts of cables with pulleys: the same scalars as plain Python, or compiled.

A pulley is a cylinder of radius r about the unit axis a through the centre c. The cable runs around
it in the positive sense of the axis, arrives at one contact and departs from another; the wrap
angle Φ leads from the first to the second.

**Tangent** (:func:`tangent`). Seen from the centre, a point has the height h = a·(s − c) above the
plane of the pulley and the projection X = s − c − h a, R = |X|. A cable from there, whose
projection is a free piece of the length l, meets the plane at the contact

    c + (ρ² X ± ρ l a × X)/R²,   ρ² + l² = R²,   + on arrival, − on departure.

- On a smooth cylinder it touches the circle: ρ = r.
- In a narrow groove the cable keeps to the plane of the pulley, and a free piece leaves it at the
  angle γ, tan γ = h/l. Without friction the pulley takes no torque about its axis, so the cable
  keeps its moment r F: its line passes the axis at ρ = r/cos γ, by climbing the flank of the
  groove. Then l⁴ − (R² − r²) l² + r² h² = 0, of which l is the larger root. Without a real root the
  point is too far beside the groove.

**One pulley** (:func:`wrap`). Φ is known up to whole turns; it is taken from (−90°, 270°], plus the
whole turns that the user states. On a smooth cylinder the cable is a helix. Unrolled, all of it is
one straight line, and its slope against the plane is

    tan γ = (h₂ − h₁)/(l₁ + r Φ + l₂).

**Pulleys in a row** (:func:`settle_row`) share free pieces. The contacts of the neighbours
are held while each pulley is solved in closed form, one after the other, until none moves. In the
plane each sweep squares the error.

**Which pulleys touch.** A pulley can only push. All touch at first; while a pulley has Φ < 0, the
one with the least Φ is left out. Then a pulley that the straight cable would cut, Φ > 0, is taken
back. Where a cable leaves a groove beside its plane it snaps; there, neither may hold, and the
pulley is left out.

Arguments are lists in plain Python and arrays in compiled code. One posture needs no compiler, and
numba is not imported for it: :func:`settle_rows` compiles these functions when it is first called.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import atan2, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.cable_path import SURFACE
from cdsm.support.values import Array

TOUCHES = 0
"""Outcome: the contacts are found."""

INSIDE = 1
"""Outcome: a neighbouring point of the cable is inside the pulley."""

BESIDE = 2
"""Outcome: a neighbouring point of the cable is too far beside the groove of the pulley."""

UNSETTLED = 3
"""Outcome: the contacts of pulleys in a row do not converge."""

STILL = 1e-13
"""Motion of the contacts [m] that is still to come when they count as settled."""

SWEEPS = 500
"""Most sweeps; smooth pulleys that nearly touch each other needed 155 of them."""


class Pulleys(NamedTuple):
    """All n pulleys of an arm; those that follow each other between two sites are a row."""

    centre: Any  # c (n, 3) [m]
    axis: Any  # a (n, 3)
    radius: Any  # r (n,) [m]
    groove: Any  # whether each keeps the cable in its plane (n,)
    turns: Any  # whole turns beyond Φ in (−90°, 270°] (n,)


class Contacts(NamedTuple):
    """Contacts of n pulleys with their cable; :func:`settle_row` fills them in."""

    arrival: Any  # (n, 3) [m]
    departure: Any  # (n, 3) [m]
    angle: Any  # Φ (n,) [rad]; of a pulley that does not touch not positive
    slope: Any  # tan γ of the helix (n,); 0 in a groove
    touches: Any  # whether the cable touches each of them (n,)


def tangent(
    x: float,
    y: float,
    z: float,
    a: float,
    b: float,
    c: float,
    radius: float,
    groove: bool,
    way: float,
) -> tuple[float, float, float, float, float, int]:
    """Return the tangent from a point (x, y, z) to a pulley of the axis (a, b, c) through 0.

    ``way`` is +1 on arrival, −1 on departure. The first three numbers are the contact in the plane,
    seen from the centre; then the projected free length l and the height h [m], and the outcome.
    """
    # height above the plane of the pulley, and projection X onto it
    height = x * a + y * b + z * c
    x -= height * a
    y -= height * b
    z -= height * c
    distance2 = x * x + y * y + z * z
    free2 = distance2 - radius * radius  # l² on a smooth cylinder
    # a point on the rim is itself the contact
    if free2 <= 2.0 * radius * SURFACE:
        return x, y, z, 0.0, height, TOUCHES if free2 >= -2.0 * radius * SURFACE else INSIDE
    if groove:
        root = free2 * free2 - 4.0 * radius * radius * height * height
        if root < 0.0:
            return x, y, z, 0.0, height, BESIDE
        free2 = 0.5 * (free2 + sqrt(root))
    # turn X towards the side on which the cable passes
    lever2 = distance2 - free2
    free = sqrt(free2)
    turn = way * sqrt(lever2) * free
    return (
        (lever2 * x + turn * (b * z - c * y)) / distance2,
        (lever2 * y + turn * (c * x - a * z)) / distance2,
        (lever2 * z + turn * (a * y - b * x)) / distance2,
        free,
        height,
        TOUCHES,
    )


def wrap(
    centre: Any,
    axis: Any,
    r: float,
    groove: bool,
    turns: int,
    before: Any,
    after: Any,
    arrival: Any,
    departure: Any,
) -> tuple[float, float, float, int]:
    """Set the contacts of one pulley, from the points of the cable before and after it.

    Returns the wrap angle Φ [rad], the slope tan γ of the helix, how far the contacts moved [m],
    and the outcome.
    """
    cx = centre[0]
    cy = centre[1]
    cz = centre[2]
    a = axis[0]
    b = axis[1]
    c = axis[2]
    ux, uy, uz, free_u, height_u, outcome_u = tangent(
        before[0] - cx, before[1] - cy, before[2] - cz, a, b, c, r, groove, 1.0
    )
    vx, vy, vz, free_v, height_v, outcome_v = tangent(
        after[0] - cx, after[1] - cy, after[2] - cz, a, b, c, r, groove, -1.0
    )
    # Φ from the arrival to the departure about the axis
    sine = a * (uy * vz - uz * vy) + b * (uz * vx - ux * vz) + c * (ux * vy - uy * vx)
    angle = atan2(sine, ux * vx + uy * vy + uz * vz)
    if angle < -0.5 * pi:
        angle += 2.0 * pi
    if turns:
        angle += 2.0 * pi * turns
    # a helix climbs along the axis; |Φ|, since the length of an arc is no less than zero
    slope = 0.0
    x = cx + ux
    y = cy + uy
    z = cz + uz
    vx += cx
    vy += cy
    vz += cz
    if not groove:
        arc = r * abs(angle)
        unrolled = free_u + arc + free_v
        slope = (height_v - height_u) / unrolled if unrolled > 0.0 else 0.0
        low = height_u + slope * free_u
        high = low + slope * arc
        x += low * a
        y += low * b
        z += low * c
        vx += high * a
        vy += high * b
        vz += high * c
    # move the contacts there
    moved = abs(x - arrival[0]) + abs(y - arrival[1]) + abs(z - arrival[2])
    moved += abs(vx - departure[0]) + abs(vy - departure[1]) + abs(vz - departure[2])
    arrival[0] = x
    arrival[1] = y
    arrival[2] = z
    departure[0] = vx
    departure[1] = vy
    departure[2] = vz
    return angle, slope, moved, outcome_u if outcome_u != TOUCHES else outcome_v


def _after(i: int, high: int, touches: Any, arrival: Any, end: Any) -> Any:
    """Return the point to which the cable runs from pulley i of a row that ends before ``high``."""
    for j in range(i + 1, high):
        if touches[j]:
            return arrival[j]
    return end


def _sweep(
    touching: bool, start: Any, end: Any, low: int, high: int, pulleys: Pulleys, at: Contacts
) -> tuple[float, int, int]:
    """Solve each pulley that touches, or each one that does not, with its neighbours held.

    Returns how far the contacts moved at most [m], the outcome, and the pulley that it is about:
    the one that moved farthest if there is no fault.
    """
    centre, axis, radius, groove, turns = pulleys
    arrival, departure, angle, slope, touches = at
    farthest = 0.0
    outcome = TOUCHES
    culprit = low
    before = start
    for i in range(low, high):
        if touches[i] == touching:
            angle[i], slope[i], moved, fault = wrap(
                centre[i],
                axis[i],
                radius[i],
                groove[i],
                turns[i],
                before,
                _after(i, high, touches, arrival, end),
                arrival[i],
                departure[i],
            )
            if fault != TOUCHES and outcome != INSIDE:
                outcome = fault
                culprit = i
            if moved > farthest:
                farthest = moved
                if outcome == TOUCHES:
                    culprit = i
        if touches[i]:
            before = departure[i]
    return farthest, outcome, culprit


def _of_one(outcome: int, angle: float) -> int:
    """Return the outcome of a pulley alone: a straight cable passes a groove at any distance."""
    return TOUCHES if outcome == BESIDE and angle < 0.0 else outcome


def settle_row(
    start: Any, end: Any, low: int, high: int, pulleys: Pulleys, at: Contacts
) -> tuple[int, int]:
    """Find the contacts ``at`` the pulleys ``low`` to ``high``, a row between two sites.

    ``start`` and ``end`` are the sites (3,) [m]. Returns the outcome, and the pulley that it is
    about. Contacts of pulleys that do not touch have no meaning.
    """
    centre, axis, radius, groove, turns = pulleys
    arrival, departure, angle, slope, touches = at
    if high - low == 1:  # the closed form
        angle[low], slope[low], _, outcome = wrap(
            centre[low],
            axis[low],
            radius[low],
            groove[low],
            turns[low],
            start,
            end,
            arrival[low],
            departure[low],
        )
        touches[low] = angle[low] >= 0.0
        return _of_one(outcome, angle[low]), low
    count = high - low
    for i in range(low, high):
        touches[i] = True
    returned = 0  # times that a pulley was taken back
    while True:
        # begin at the centres, so that the result depends on nothing computed before
        for i in range(low, high):
            for k in range(3):
                arrival[i][k] = centre[i][k]
                departure[i][k] = centre[i][k]

        # solve pulley after pulley until no contact will move; one that is left alone, at once
        before = 0.0
        outcome = TOUCHES
        culprit = low
        settled = count <= 1
        for _ in range(SWEEPS if count > 1 else 1):
            moved, outcome, culprit = _sweep(True, start, end, low, high, pulleys, at)
            # motions fall by this sweep's ratio at least, or by its square in the plane
            if moved < STILL or moved * moved < STILL * before:
                settled = True
                break
            before = moved

        # leave out the pulley that would have to pull most
        worst = -1
        least = 0.0
        for i in range(low, high):
            if touches[i] and angle[i] < least:
                worst = i
                least = angle[i]
        if worst >= 0:
            touches[worst] = False
            count -= 1
            continue
        if outcome != TOUCHES:
            return outcome, culprit
        if not settled:
            return UNSETTLED, culprit
        if count == high - low:
            return TOUCHES, low

        # take the first pulley back that the straight cable cuts
        _, outcome, culprit = _sweep(False, start, end, low, high, pulleys, at)
        if outcome == INSIDE:
            return INSIDE, culprit
        cut = -1
        for i in range(high - 1, low - 1, -1):
            if not touches[i] and angle[i] > 0.0:
                cut = i
        # a cable that snaps out of a groove beside its plane cuts the pulley: it stays out
        if cut < 0 or returned == high - low:
            return TOUCHES, low
        touches[cut] = True
        count += 1
        returned += 1


def _settle_postures(
    first: NDArray[np.intp],
    start: Array,
    end: Array,
    pulleys: Pulleys,
    at: Contacts,
    outcome: NDArray[np.intp],
    culprit: NDArray[np.intp],
) -> None:
    centre, axis, radius, groove, turns = pulleys
    arrival, departure, angle, slope, touches = at
    for w in range(len(outcome)):
        posture = Pulleys(centre[w], axis[w], radius, groove, turns)
        contacts = Contacts(arrival[w], departure[w], angle[w], slope[w], touches[w])
        for r in range(len(first) - 1):
            pulley = first[r]
            if first[r + 1] - pulley == 1:  # to hand all arrays on takes three times as long
                angle[w, pulley], slope[w, pulley], _, fault = wrap(
                    centre[w, pulley],
                    axis[w, pulley],
                    radius[pulley],
                    groove[pulley],
                    turns[pulley],
                    start[w, r],
                    end[w, r],
                    arrival[w, pulley],
                    departure[w, pulley],
                )
                touches[w, pulley] = angle[w, pulley] >= 0.0
                fault = _of_one(fault, angle[w, pulley])
            else:
                fault, pulley = settle_row(
                    start[w, r], end[w, r], first[r], first[r + 1], posture, contacts
                )
            if fault != TOUCHES:
                outcome[w] = fault
                culprit[w] = pulley
                break


@cache
def _compiled() -> Callable[..., None]:
    """Compile :func:`_settle_postures`; numba keeps it on disk where a folder is writable."""
    from numba import njit
    from numba.extending import register_jitable

    for function in (tangent, wrap, _after, _sweep, _of_one, settle_row):
        register_jitable(function)
    try:
        compiled: Callable[..., None] = njit(cache=True, nogil=True, error_model="numpy")(
            _settle_postures
        )
    except RuntimeError:
        compiled = njit(nogil=True)(_settle_postures)
    return compiled


def settle_postures(
    first: NDArray[np.intp], start: Array, end: Array, pulleys: Pulleys
) -> tuple[Contacts, NDArray[np.intp], NDArray[np.intp]]:
    """Find the contacts at W postures, compiled: :func:`settle_row` for each of R rows of pulleys.

    Row r is made of the pulleys ``first[r]`` to ``first[r + 1]`` of P, between the sites
    ``start[:, r]`` and ``end[:, r]`` (W, R, 3) [m]. ``pulleys.centre`` and ``pulleys.axis`` are
    (W, P, 3), its other fields (P,).

    Returns the contacts, (W, P, …) each; the outcomes (W,); the pulleys that they are about (W,).
    """
    W, P = pulleys.centre.shape[:2]
    contacts = Contacts(
        arrival=np.zeros((W, P, 3)),
        departure=np.zeros((W, P, 3)),
        angle=np.zeros((W, P)),
        slope=np.zeros((W, P)),
        touches=np.zeros((W, P), np.bool_),
    )
    outcome = np.zeros(W, np.intp)
    culprit = np.zeros(W, np.intp)
    _compiled()(
        first,
        np.ascontiguousarray(start),
        np.ascontiguousarray(end),
        Pulleys(*map(np.ascontiguousarray, pulleys)),
        contacts,
        outcome,
        culprit,
    )
    return contacts, outcome, culprit
