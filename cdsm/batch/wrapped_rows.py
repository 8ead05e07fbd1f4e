"""Rows of an arm whose cables run over pulleys: their contacts first, then one batch per pattern.

A contact is fixed to its link as a site is, but at another place in each row. The kernels let the
dimensions of an arm differ from row to row, so contacts are sites to them, and the arcs belong to
the lengths that no joint changes. Rows in which other pulleys touch have other segments; they are
solved together, pattern by pattern.

Beside the plane of a pulley, contacts shift (:mod:`cdsm.contact_shifts`). What this adds to K_θ is
computed for the rows that need it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.batch.quantities import Codes
from cdsm.batch.rows import BodyArrays, CableStiffness, Directions, Rows, ShiftsOfRows, tables_of
from cdsm.contact_shifts import Shifts
from cdsm.contacts import TOUCHES, Contacts, Pulleys, settle_postures, settle_row
from cdsm.routing import Indices, Spans
from cdsm.status import Status
from cdsm.support.values import Array
from cdsm.wraps import Pattern, Wraps

Solve = Callable[[Rows, int], tuple[dict[str, Array], Codes]]

_PLAIN = 2000  # rows up to which plain Python is faster than compiling, which takes 7 s once
_IN_PLANE = 1e-12  # sine of the angle to the plane of a groove that is rounding


class _Touching(NamedTuple):
    """The T pulleys that cables touch in N rows."""

    radial: Array  # from the centres to the contacts (N, 2T, 3) [m]
    axis: Array  # (N, T, 3)
    arc: Array  # wrapped length (N, T) [m]
    angle: Array  # wrap angle (N, T) [rad]
    slope: Array  # of the helix (N, T)


class _Places(NamedTuple):
    """Where all entries and pulleys are in N rows, and where cables touch."""

    entry: Array  # of all paths (N, E, 3) [m]
    axis: Array  # of all pulleys (N, P, 3)
    contacts: Contacts


class _Frames(NamedTuple):
    """Poses of the base and of the joints' frames."""

    rotation: Array  # (N, n+1, 3, 3)
    origin: Array  # (N, n+1, 3) [m]


def solve_wrapped(rows: Rows, threads: int, solve: Solve) -> tuple[dict[str, Array], Codes]:
    """Compute rows over pulleys by ``solve``, which computes the rows of one pattern."""
    arm = rows.arm
    wraps = arm.wraps
    assert wraps is not None
    frames = _frames(rows)
    axis = _turned(frames.rotation, wraps.row[wraps.entry], wraps.local_axis)
    entry = frames.origin[:, wraps.row] + _turned(frames.rotation, wraps.row, wraps.point)
    contacts, outcome = _settle(wraps, entry[:, wraps.entry], axis, entry)
    places = _Places(entry, axis, contacts)
    status = np.zeros(len(rows.q), np.uint8) if rows.status is None else rows.status.copy()
    status[(outcome != TOUCHES) & (status == Status.OK)] = Status.COINCIDENT_SITES
    values: dict[str, Array] = {}
    # rows with equal bits have the same pattern
    bits = np.packbits(contacts.touches, axis=1)
    keys = bits.view(np.dtype((np.void, bits.shape[1]))).ravel()
    _, first, pattern_of = np.unique(keys, return_index=True, return_inverse=True)
    for k, row in enumerate(first.tolist()):
        chosen = np.flatnonzero(pattern_of == k) if len(first) > 1 else slice(None)
        touches = tuple(contacts.touches[row].tolist())
        part = _part(rows, chosen, touches, frames, places, status)
        solved, codes = solve(part, threads)
        status[chosen] = codes
        for name, value in solved.items():
            if name not in values:
                values[name] = np.empty((len(rows.q), *value.shape[1:]), value.dtype)
            values[name][chosen] = value
    return values, status


def _frames(rows: Rows) -> _Frames:
    """Compute the poses of all frames, joint after joint."""
    table = tables_of(rows.arm)
    arm = table.arm
    q = table.coupling.angles(rows.q) if table.coupling else rows.q
    N, n = q.shape
    rotation = np.empty((N, n + 1, 3, 3))
    origin = np.empty((N, n + 1, 3))
    rotation[:, 0] = np.eye(3)
    origin[:, 0] = 0.0
    for j, parent in enumerate(arm.parent.tolist()):
        a, b, c = arm.turn[j]
        cosine, sine = np.cos(q[:, j, None, None]), np.sin(q[:, j, None, None])
        rotation[:, j + 1] = rotation[:, parent] @ (a + b * cosine + c * sine)
        step = table.dimensions.shift[j] + arm.slide[j] * q[:, j, None]
        origin[:, j + 1] = origin[:, parent] + np.einsum("nxy,ny->nx", rotation[:, parent], step)
    return _Frames(rotation, origin)


def _turned(rotation: Array, row: Indices, local: Array) -> Array:
    """Turn vectors (E, 3) in the frames ``row`` (E,) into base axes (N, E, 3)."""
    turned = np.empty((len(rotation), len(row), 3))
    for frame in np.unique(row).tolist():
        at = np.flatnonzero(row == frame)
        turned[:, at] = local[at] @ rotation[:, frame].transpose(0, 2, 1)
    return turned


def _turned_back(rotation: Array, row: Indices, vectors: Array) -> Array:
    """Turn vectors (N, E, 3) in base axes into the frames ``row`` (E,)."""
    local = np.empty(vectors.shape)
    for frame in np.unique(row).tolist():
        at = np.flatnonzero(row == frame)
        local[:, at] = vectors[:, at] @ rotation[:, frame]
    return local


def _settle(wraps: Wraps, centre: Array, axis: Array, entry: Array) -> tuple[Contacts, Indices]:
    """Find the contacts (N, P, …) and outcomes (N,), plain for few rows and compiled for many."""
    starts = [row.start for row in wraps.rows]
    ends = [row.end for row in wraps.rows]
    turns = np.array([pulley.turns for pulley in wraps.pulleys], np.intp)
    pulleys = Pulleys(centre, axis, wraps.radius, wraps.groove, turns)
    if len(centre) > _PLAIN:
        first = np.array([*(row.low for row in wraps.rows), len(wraps.pulleys)], np.intp)
        contacts, outcome, _ = settle_postures(first, entry[:, starts], entry[:, ends], pulleys)
        return contacts, outcome
    N, P = centre.shape[:2]
    shapes = ((N, P, 3), (N, P, 3), (N, P), (N, P), (N, P))
    parts: list[list[object]] = [[], [], [], [], []]
    outcomes = np.zeros(N, np.intp)
    constants = [field.tolist() for field in pulleys[2:]]
    for w in range(N):
        points = entry[w].tolist()
        posture = Pulleys(centre[w].tolist(), axis[w].tolist(), *constants)
        at = Contacts(np.zeros((P, 3)).tolist(), np.zeros((P, 3)).tolist(), *_blank(P))
        for start, end, low, high in wraps.rows:
            outcome_of_row, _ = settle_row(points[start], points[end], low, high, posture, at)
            outcomes[w] = max(outcomes[w], outcome_of_row)
        for part, field in zip(parts, at, strict=True):
            part.append(field)
    arrays = [np.array(part).reshape(shape) for part, shape in zip(parts, shapes, strict=True)]
    return Contacts(*arrays), outcomes


def _blank(count: int) -> tuple[list[float], list[float], list[bool]]:
    return [0.0] * count, [0.0] * count, [True] * count


def _part(
    rows: Rows,
    chosen: Indices | slice,
    touches: tuple[bool, ...],
    frames: _Frames,
    places: _Places,
    status: Codes,
) -> Rows:
    """Return the ``chosen`` rows, in which these pulleys touch, with the contacts as sites."""
    wraps = rows.arm.wraps
    assert wraps is not None
    pattern = wraps.pattern(touches)
    routing = pattern.routing
    pulley = pattern.pulley
    contacts = Contacts(*(field[chosen][:, pulley] for field in places.contacts))
    entry = places.entry[chosen]
    count = len(entry)
    # contacts in the frames of the links; all other sites keep their places
    row = routing.row[pattern.contact]
    world = np.concatenate([contacts.arrival, contacts.departure], axis=1)
    apart = world - frames.origin[chosen][:, row]
    site = np.repeat(routing.point[None], count, axis=0)
    site[:, pattern.contact] = _turned_back(frames.rotation[chosen], row, apart)
    arcs = wraps.radius[pulley] * contacts.angle * np.sqrt(1.0 + contacts.slope**2)
    fixed = np.repeat(routing.fixed[None], count, axis=0)
    for i, cable in enumerate(pattern.cable.tolist()):
        fixed[:, cable] += arcs[:, i]
    dimensions = tables_of(rows.arm).dimensions._replace(site=site, fixed=fixed)
    body = BodyArrays(*(x if x is site or x is fixed else _repeated(x, count) for x in dimensions))

    def some(values: Array) -> Array:
        return values if len(values) == 1 < len(rows.q) else values[chosen]

    part = replace(
        rows,
        q=rows.q[chosen],
        wrench=some(rows.wrench),
        tension=None if rows.tension is None else some(rows.tension),
        bounds=None if rows.bounds is None else (some(rows.bounds[0]), some(rows.bounds[1])),
        body=body,
        cable_stiffness=_of_chosen(rows, chosen),
        status=status[chosen],
        touches=touches,
        loads=None if rows.loads is None else rows.loads.of(chosen),
    )
    axis = places.axis[chosen][:, pulley]
    every = entry, places.contacts.arrival[chosen], places.contacts.departure[chosen]
    shifted = _shifted(wraps, pattern, np.concatenate(every, axis=1), world, axis)
    if not shifted.any():
        return part
    centre = entry[:, wraps.entry[pulley]]
    radial = world - np.concatenate([centre, centre], axis=1)
    touching = _Touching(radial, axis, arcs, contacts.angle, contacts.slope)
    return replace(part, shifts=_shifts(part, pattern, touching, shifted))


def _of_chosen(rows: Rows, chosen: Indices | slice) -> CableStiffness | None:
    """Return the function of the stiffness of cables in the ``chosen`` rows, if rows have one."""
    stiffness = rows.cable_stiffness
    if stiffness is None:
        return None
    places = np.arange(len(rows.q))[chosen]
    return lambda L, F, part: stiffness(L, F, places[part])


def _repeated(x: Array, count: int) -> Array:
    return np.repeat(np.asarray(x)[None], count, axis=0)


def _shifted(
    wraps: Wraps, pattern: Pattern, points: Array, contact: Array, axis: Array
) -> NDArray[np.bool_]:
    """Return in which rows (N,) contacts may shift: beside a groove, or on a smooth cylinder.

    ``points`` are all entries, arrivals and departures; ``contact`` (N, 2T, 3) and ``axis``
    (N, T, 3) those of pulleys that touch.
    """
    if not wraps.groove[pattern.pulley].all():
        return np.ones(len(points), np.bool_)
    ends = pattern.ends
    T = len(pattern.pulley)
    some = np.flatnonzero(ends.free)
    segment = ends.segment[ends.piece[some]]
    far = np.where(some < T, pattern.routing.first[segment], pattern.routing.second[segment])
    along = points[:, np.array(pattern.source)[far]] - contact[:, some]
    height = np.einsum("npx,npx->np", axis[:, some % max(T, 1)], along)
    length2 = np.einsum("npx,npx->np", along, along)
    return np.asarray((height**2 > _IN_PLANE**2 * length2).any(axis=1))


def _shifts(
    rows: Rows, pattern: Pattern, touching: _Touching, shifted: NDArray[np.bool_]
) -> ShiftsOfRows:
    """Return the function that computes what shifts add to H_L·F (n, nv, nv) of some rows."""
    arm = rows.arm
    wraps = arm.wraps
    assert wraps is not None
    routing = pattern.routing
    segment = pattern.ends.segment
    pulley = pattern.pulley
    sign = routing.sign[segment]
    joint = np.where(sign == 0.0, 0, routing.path[segment])

    def added(at: Directions, tension: Array, part: slice) -> Array:
        K = np.zeros((len(tension), arm.nv, arm.nv))
        fine = shifted[part]
        if rows.status is not None:
            fine = fine & (rows.status[part] == Status.OK)
        some = np.flatnonzero(fine)
        if not some.size:
            return K
        N = some.size

        def one_behind_another(x: Array) -> Array:
            """Make (3, N·n, …) of vectors (N, n, …, 3)."""
            flat = x.reshape(-1, *x.shape[2:])
            return np.ascontiguousarray(np.moveaxis(flat, -1, 0))

        piece = at.segment[some][:, segment]
        of_rows = np.arange(len(shifted))[part][some]
        here = _Touching(*(x[of_rows] for x in touching))
        spans = Spans(
            length=1.0 / piece[:, :, 3].ravel(),
            direction=one_behind_another(piece[:, :, :3]),
            axis=one_behind_another(sign[:, :, None] * at.axis[some][:, joint]),
            motion=one_behind_another(at.motion[some][:, segment]),
            rate=np.zeros(0),
        )
        T = len(pulley)
        radial = here.radial.reshape(N, 2, T, 3).transpose(3, 1, 0, 2).reshape(3, -1)
        shifts = Shifts(
            routing=routing,
            spans=spans,
            ends=pattern.ends.repeated(N),
            radial=radial,
            axis=one_behind_another(here.axis),
            radius=np.tile(wraps.radius[pulley], N),
            groove=np.tile(wraps.groove[pulley], N),
            arc=here.arc.ravel(),
            angle=here.angle.ravel(),
            slope=here.slope.ravel(),
            postures=N,
        )
        K[some] = shifts.hessian_of_each(tension[some][:, routing.cable[segment]])
        return K

    return added
