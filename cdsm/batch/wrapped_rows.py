"""Rows of an arm whose cables run over pulleys: their contacts first, then one batch per pattern.

A contact is fixed to its link as a site is, but at another place in each row. The kernels let the
dimensions of an arm differ from row to row, so contacts are sites to them, and the arcs belong to
the lengths that no joint changes. Rows in which other pulleys touch have other segments; they are
solved together, pattern by pattern.

Beside the plane of a pulley, contacts shift (:mod:`cdsm.contact_shifts`). What this adds to K_θ is
computed row by row, for the rows that need it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cdsm.batch.quantities import Codes
from cdsm.batch.rows import BodyArrays, Rows, tables_of
from cdsm.contacts import TOUCHES, Contacts, Pulleys, settle_postures, settle_row
from cdsm.routing import Indices
from cdsm.status import Status
from cdsm.support.values import Array
from cdsm.wraps import Pattern, Wraps

Solve = Callable[[Rows, int], tuple[dict[str, Array], Codes]]

_PLAIN = 2000  # rows up to which plain Python is faster than compiling, which takes 7 s once
_IN_PLANE = 1e-12  # sine of the angle to the plane of a groove that is rounding


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
    centre, axis, entry = _places(wraps, frames)
    contacts, outcome = _settle(wraps, centre, axis, entry)
    status = np.zeros(len(rows.q), np.uint8) if rows.status is None else rows.status.copy()
    status[(outcome != TOUCHES) & (status == Status.OK)] = Status.COINCIDENT_SITES
    values: dict[str, Array] = {}
    # rows with equal bits have the same pattern
    bits = np.packbits(contacts.touches, axis=1)
    keys = bits.view(np.dtype((np.void, bits.shape[1]))).ravel()
    _, first, pattern_of = np.unique(keys, return_index=True, return_inverse=True)
    for k, row in enumerate(first.tolist()):
        chosen = np.flatnonzero(pattern_of == k)
        touches = tuple(contacts.touches[row].tolist())
        part = _part(rows, chosen, touches, frames, contacts, entry, status)
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


def _places(wraps: Wraps, frames: _Frames) -> tuple[Array, Array, Array]:
    """Return centres and axes of the pulleys (N, P, 3), and all entries of paths (N, E, 3)."""
    turned = np.einsum("nexy,ey->nex", frames.rotation[:, wraps.row], wraps.point)
    entry = frames.origin[:, wraps.row] + turned
    axis = np.einsum("npxy,py->npx", frames.rotation[:, wraps.row[wraps.entry]], wraps.local_axis)
    return entry[:, wraps.entry], axis, entry


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
    chosen: Indices,
    touches: tuple[bool, ...],
    frames: _Frames,
    contacts: Contacts,
    entry: Array,
    status: Codes,
) -> Rows:
    """Return the ``chosen`` rows, in which these pulleys touch, with the contacts as sites."""
    wraps = rows.arm.wraps
    assert wraps is not None
    pattern = wraps.pattern(touches)
    routing = pattern.routing
    contacts_here = Contacts(*(field[chosen] for field in contacts))
    points = np.concatenate([entry[chosen], contacts_here.arrival, contacts_here.departure], axis=1)
    node = points[:, pattern.source]
    # in the frames of the links
    apart = node - frames.origin[chosen][:, routing.row]
    site = np.einsum("npyx,npy->npx", frames.rotation[chosen][:, routing.row], apart)
    arcs = wraps.radius * contacts_here.angle * np.sqrt(1.0 + contacts_here.slope**2)
    fixed = np.repeat(routing.fixed[None], len(chosen), axis=0)
    np.add.at(fixed.T, pattern.cable, arcs[:, pattern.pulley].T)
    dimensions = tables_of(rows.arm).dimensions._replace(site=site, fixed=fixed)
    body = BodyArrays(
        *(x if x is site or x is fixed else _repeated(x, len(chosen)) for x in dimensions)
    )

    def some(values: Array) -> Array:
        return values if len(values) == 1 < len(rows.q) else values[chosen]

    part = replace(
        rows,
        q=rows.q[chosen],
        wrench=some(rows.wrench),
        tension=None if rows.tension is None else some(rows.tension),
        bounds=None if rows.bounds is None else (some(rows.bounds[0]), some(rows.bounds[1])),
        body=body,
        status=status[chosen],
        touches=touches,
        loads=None if rows.loads is None else rows.loads.of(chosen),
    )
    if (shifted := _shifted(wraps, pattern, node, contacts_here, frames, chosen)).any():
        return replace(part, shifts=_shifts(part, shifted))
    return part


def _repeated(x: Array, count: int) -> Array:
    return np.repeat(np.asarray(x)[None], count, axis=0)


def _shifted(
    wraps: Wraps,
    pattern: Pattern,
    node: Array,
    contacts: Contacts,
    frames: _Frames,
    chosen: Indices,
) -> NDArray[np.bool_]:
    """Return in which rows (N,) contacts may shift: beside a groove, or on a smooth cylinder."""
    if not wraps.groove[pattern.pulley].all():
        return np.ones(len(node), np.bool_)
    ends = pattern.ends
    segment = ends.segment[ends.piece[ends.free]]
    along = node[:, pattern.routing.second[segment]] - node[:, pattern.routing.first[segment]]
    pulley = np.concatenate([pattern.pulley, pattern.pulley])[ends.free]
    rotation = frames.rotation[chosen][:, wraps.row[wraps.entry[pulley]]]
    axis = np.einsum("npxy,py->npx", rotation, wraps.local_axis[pulley])
    sine = abs(np.einsum("npx,npx->np", axis, along)) / np.linalg.norm(along, axis=2)
    return np.asarray(sine.max(axis=1, initial=0.0) > _IN_PLANE)


def _shifts(rows: Rows, shifted: NDArray[np.bool_]) -> Callable[[Array, slice], Array]:
    """Return the function that computes what shifts add to H_L·F (n, nv, nv) of some rows."""
    arm = rows.arm

    def added(tension: Array, part: slice) -> Array:
        K = np.zeros((len(tension), arm.nv, arm.nv))
        for i, row in enumerate(range(len(rows.q))[part]):
            lost = rows.status is not None and rows.status[row] != Status.OK
            if shifted[row] and not lost:
                wrapping = arm.at(rows.q[row], check_limits=False).wrapping
                assert wrapping is not None
                weight = tension[i][wrapping.pattern.routing.cable]
                K[i] = wrapping.shifts.hessian(weight)
        return K

    return added
