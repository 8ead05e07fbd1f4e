"""Rows of an arm whose cables run over pulleys: which pulleys touch, then one batch per pattern.

A contact is fixed to its link as a site is, but at another place in each row. The kernels let the
dimensions of an arm differ from row to row, so contacts are sites to them, and the arcs belong to
the lengths that no joint changes. Rows in which other pulleys touch have other segments; they are
solved together, pattern by pattern.

Which pulleys touch is seen where the cables touch all of them: of a pulley alone by its wrap angle,
of several in a row if none has lifted. Rows in which one has are settled row by row.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cdsm.batch.chunk import Scratch
from cdsm.batch.path_arrays import ContactArrays, paths_of, shapes_of_contacts
from cdsm.batch.quantities import Codes
from cdsm.batch.rows import (
    CableStiffness,
    ContactKernels,
    Rows,
    Touching,
    one_by_one,
    side_by_side,
    tables_of,
)
from cdsm.manipulator import Manipulator
from cdsm.pulleys.contacts import TOUCHES, Contacts, Pulleys, settle_postures, settle_row
from cdsm.pulleys.wraps import Wraps
from cdsm.routing import Indices
from cdsm.status import Status
from cdsm.support.values import Array

Solve = Callable[[Rows, int], tuple[dict[str, Array], Codes]]

PLAIN = 2000
"""Rows up to which kernels of contacts run by numpy: to compile them takes 20 s, once."""

_ROWS = 8192  # whose contacts are computed at a time
_WIDTH = 64  # postures side by side
_OUTCOMES = ("turn", "fault", "unsettled")  # kept of all blocks


def solve_wrapped(
    rows: Rows, threads: int, kernels: ContactKernels, solve: Solve
) -> tuple[dict[str, Array], Codes]:
    """Compute rows over pulleys by ``solve``, which computes the rows of one pattern."""
    touches, outcome = _patterns(rows, kernels)
    status = np.zeros(len(rows.q), np.uint8) if rows.status is None else rows.status.copy()
    status[(outcome != TOUCHES) & (status == Status.OK)] = Status.COINCIDENT_SITES
    values: dict[str, Array] = {}
    first, pattern_of = _numbered(touches)
    for k, row in enumerate(first.tolist()):
        chosen = np.flatnonzero(pattern_of == k) if len(first) > 1 else slice(None)
        touching = Touching(tuple(touches[row].tolist()), kernels)
        solved, codes = solve(_part(rows, chosen, touching, status), threads)
        if len(first) == 1:
            return solved, codes
        status[chosen] = codes
        for name, value in solved.items():
            if name not in values:
                values[name] = np.empty((len(rows.q), *value.shape[1:]), value.dtype)
            values[name][chosen] = value
    return values, status


def _numbered(touches: NDArray[np.bool_]) -> tuple[Indices, Indices]:
    """Number the patterns (N, P): return the first row of each, and the number of each row (N,)."""
    first = np.zeros(1, np.intp)
    number = np.zeros(len(touches), np.intp)
    for column in touches.T[(touches != touches[:1]).any(axis=0)]:
        _, first, number = np.unique(2 * number + column, return_index=True, return_inverse=True)
    return first, number


def _part(rows: Rows, chosen: Indices | slice, touching: Touching, status: Codes) -> Rows:
    """Return the ``chosen`` rows, in which these pulleys touch."""

    def some(values: Array) -> Array:
        return values if len(values) == 1 < len(rows.q) else values[chosen]

    return replace(
        rows,
        q=rows.q[chosen],
        wrench=some(rows.wrench),
        tension=None if rows.tension is None else some(rows.tension),
        bounds=None if rows.bounds is None else (some(rows.bounds[0]), some(rows.bounds[1])),
        cable_stiffness=_of_chosen(rows, chosen),
        status=status[chosen],
        touching=touching,
        loads=None if rows.loads is None else rows.loads.of(chosen),
    )


def _of_chosen(rows: Rows, chosen: Indices | slice) -> CableStiffness | None:
    """Return the function of the stiffness of cables in the ``chosen`` rows, if rows have one."""
    stiffness = rows.cable_stiffness
    if stiffness is None:
        return None
    places = np.arange(len(rows.q))[chosen]
    return lambda L, F, part: stiffness(L, F, places[part])


def _patterns(rows: Rows, kernels: ContactKernels) -> tuple[NDArray[np.bool_], Indices]:
    """Return which pulleys touch in each row (N, P), and the outcomes (N,)."""
    arm = rows.arm
    wraps = arm.wraps
    assert wraps is not None
    table = tables_of(arm)
    q = table.coupling.angles(rows.q) if table.coupling else rows.q
    turned = np.array([pulley.turns > 0 for pulley in wraps.pulleys])
    alone = np.zeros(len(turned), np.bool_)
    alone[[row.low for row in wraps.rows if row.high - row.low == 1]] = True
    touches = np.empty((len(q), len(turned)), np.bool_)
    outcome = np.zeros(len(q), np.intp)
    scratch = Scratch()
    for low in range(0, len(q), _ROWS):
        part = q[low : low + _ROWS]
        at = _touching_all(arm, part, kernels, scratch)
        touching = (at.turn[:, :, 0] >= 0.0) | (at.turn[:, :, 1] < 0.0)
        found = (at.fault == TOUCHES).all(axis=1) & (at.unsettled == 0.0)
        touches[low : low + _ROWS] = here = one_by_one(touching, len(part)) | turned
        fine = one_by_one(found, len(part)) & (here | alone).all(axis=1)
        rest = np.flatnonzero(~fine)
        for first in range(0, len(rest), _WIDTH):  # in one block: all is kept
            some = rest[first : first + _WIDTH]
            at = _touching_all(arm, part[some], kernels, scratch)
            entry = one_by_one(at.entry, len(some))
            axis = one_by_one(at.axis, len(some))
            touches[low + some], outcome[low + some] = _settle(wraps, entry, axis, kernels)
    return touches, outcome


def _touching_all(
    arm: Manipulator, q: Array, kernels: ContactKernels, scratch: Scratch
) -> ContactArrays:
    """Find the contacts as if the cables touched all pulleys; places and contacts of one block."""
    assert arm.wraps is not None
    table = tables_of(arm)
    paths = paths_of(arm, (True,) * len(arm.wraps.pulleys))
    blocks = side_by_side(q, min(_WIDTH, len(q)))
    width = blocks.shape[2]
    count = len(blocks)
    at = ContactArrays(
        *(
            scratch.empty(f"{name} {width}", count if name in _OUTCOMES else 1, *shape, width)
            for name, shape in zip(ContactArrays._fields, shapes_of_contacts(paths), strict=True)
        )
    )
    shift = table.body(width if kernels.compiled else 1).shift
    with np.errstate(all="ignore"):
        kernels.fill_contacts(table.arm, shift, paths, blocks, False, at)
    return at


def _settle(
    wraps: Wraps, entry: Array, axis: Array, kernels: ContactKernels
) -> tuple[NDArray[np.bool_], Indices]:
    """Find which pulleys touch (N, P), and outcomes (N,), from entries (N, E, 3) and axes."""
    starts = [row.start for row in wraps.rows]
    ends = [row.end for row in wraps.rows]
    turns = np.array([pulley.turns for pulley in wraps.pulleys], np.intp)
    pulleys = Pulleys(entry[:, wraps.entry], axis, wraps.radius, wraps.groove, turns)
    if kernels.compiled:
        first = np.array([*(row.low for row in wraps.rows), len(wraps.pulleys)], np.intp)
        contacts, outcome, _ = settle_postures(first, entry[:, starts], entry[:, ends], pulleys)
        return contacts.touches, outcome
    N, P = axis.shape[:2]
    touches = np.empty((N, P), np.bool_)
    outcomes = np.zeros(N, np.intp)
    constants = [field.tolist() for field in pulleys[2:]]
    for w in range(N):
        points = entry[w].tolist()
        posture = Pulleys(pulleys.centre[w].tolist(), axis[w].tolist(), *constants)
        zeros = np.zeros((P, 3))
        at = Contacts(zeros.tolist(), zeros.tolist(), [0.0] * P, [0.0] * P, [True] * P)
        for start, end, low, high in wraps.rows:
            outcome_of_row, _ = settle_row(points[start], points[end], low, high, posture, at)
            outcomes[w] = max(outcomes[w], outcome_of_row)
        touches[w] = at.touches
    return touches, outcomes
