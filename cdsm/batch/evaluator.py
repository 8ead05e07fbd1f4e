"""Evaluate the postures of a batch in ranges of rows; the arguments are already checked."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from cdsm._former.compiling import FULL, WIDTH, is_new
from cdsm._former.distribution import search_tensions
from cdsm._former.read import read
from cdsm._former.readings import IMMOBILE, READ, SINGULAR, UNREAD
from cdsm._former.tension import Balance
from cdsm._former.tree import Indices
from cdsm.batch import layout
from cdsm.batch.arguments import Asked, Kept, Rows
from cdsm.batch.fused_kernel import evaluate_rows
from cdsm.batch.inputs import checked_threads, kernel_arm, run_slices
from cdsm.batch.layout import OK, POSTPONED, QUANTITIES, UNDECIDED, Codes
from cdsm.errors import InfeasibleTension, SolverError
from cdsm.manipulator import Manipulator
from cdsm.support.status import Status
from cdsm.support.values import Array, frozen
from cdsm.tension import distribute_tension

_SHORT, _LONG = 2**11, 2**15
"""Size of a posture's record [numbers] from which a block has only 1/2, or 1/4, of :data:`WIDTH`
postures, so that it fits into the processor's cache. Blocks of smaller records are full."""

_CACHE, _FEWEST = 2**17, 4
"""Readings are computed for several blocks at a time: for as many as have K_θ and P of ``_CACHE``
numbers, which fit into the processor's cache, but for at least ``_FEWEST``."""

_BLOCK, _BATCH = 2**22, 2**27
"""While the kernel is not yet compiled, numpy computes batches whose records have at most
``_BATCH`` numbers, in blocks of about ``_BLOCK`` numbers."""

_CODES = np.array([OK, Status.INFEASIBLE, UNDECIDED], dtype=np.uint8)
"""Status of each outcome of a search: OPTIMAL, INFEASIBLE, UNDECIDED."""

_INVERSE = QUANTITIES[layout.PSEUDOINVERSE + 1 :]
"""Readings that need the inverse of K_θ."""


class Evaluator:
    """Evaluates a batch in ranges of rows; a row is a posture.

    Arguments are those of :func:`cdsm.evaluate`. ``tension`` is F (C,) or (B, C) [N]. With lower
    and upper ``bounds`` instead, (C,) or (B, C) [N], tensions are distributed. If neither is given,
    no output may depend on tensions. In the private methods, ``rows`` are the inputs of b postures,
    and ``wanted`` the numbers of the wanted quantities. The methods fill the status ``found`` (b,)
    and the outputs ``out`` (b, n).

    Attributes:
        values: The outputs in the order of ``names``, filled by :meth:`run`.
    """

    def __init__(
        self,
        arm: Manipulator,
        q: Array,
        wrench: Array,
        names: tuple[str, ...],
        *,
        tension: Array | None = None,
        bounds: tuple[Array, Array] | None = None,
        direction: Array | None = None,
        check_limits: bool = True,
    ) -> None:
        self._arm, nv, cables = arm, arm.nv, len(arm.cables)
        self._nothing = nothing = frozen(np.empty((0, cables)))
        low, high = bounds or (nothing, nothing)
        given = q, wrench, nothing if tension is None else tension, low, high, nothing
        self._rows = Rows(*(frozen(np.ascontiguousarray(np.atleast_2d(each))) for each in given))
        self._directions = frozen(
            np.zeros((0, 3)) if direction is None else direction.reshape(-1, 3)
        )
        self._kernel_arm = kernel_arm(arm, check_limits)
        count = len(self._directions)
        shapes = layout.shapes(nv, cables, count)
        self._start = layout.starts(shapes)
        self._wanted = np.array(sorted(map(QUANTITIES.index, names)), dtype=np.intp)
        ends = [0, *np.cumsum(np.diff(self._start)[self._wanted]).tolist()]
        self._place = {
            QUANTITIES[number]: slice(*place)
            for number, place in zip(self._wanted, pairwise(ends), strict=True)
        }
        # whether the kernel needs rigidities of laws that are not linear
        needs_springs = bool(self._wanted.size) and self._wanted[-1] > layout.LOAD
        self._asks = needs_springs and bool(arm._laws.nonlinear)
        record = int(self._start[-1])
        width = WIDTH // (2 if record < _LONG else 4)
        self._block = FULL if record < _SHORT else max(1, min(width, len(q)))
        if WIDTH // 2 < len(q) <= _BATCH // record and is_new(evaluate_rows):
            self._block = max(WIDTH, min(_BLOCK // record, len(q)))  # numpy runs wide blocks

        if direction is not None and direction.ndim == 1:
            shapes |= dict.fromkeys(layout.DIRECTIONAL, ())
        # one row for each posture, which the kernel fills; the outputs are views of it
        self._out = np.empty((len(q), ends[-1]))
        self.values = [
            self._out[:, self._place[name]].reshape(len(q), *shapes[name]) for name in names
        ]

    def run(self, status: Codes, threads: int | None) -> None:
        """Fill :attr:`values` and ``status`` (B,) in several threads; each takes ranges of rows."""
        count = checked_threads(threads)
        run_slices(lambda part: self._fill(part, status), len(self._out), self._block, count)

    def _fill(self, part: slice, status: Codes) -> None:
        """Fill :attr:`values` and ``status`` (B,) in the range of rows ``part``."""
        rows, found, out = self._rows.take(part), status[part], self._out[part]
        if len(rows.low):
            self._distribute(rows, found, out)
        else:
            self._evaluate(rows, self._wanted, found, out)
        if len(rows.tension) and "tension" in self._place:
            out[:, self._place["tension"]] = rows.tension

    def _distribute(self, rows: Rows, found: Codes, out: Array) -> None:
        """Distribute the tensions of the postures ``rows``; compute all wanted quantities."""
        balance = self._empty_balance(len(found))
        if self._asks:  # rigidities need the tensions first
            self._evaluate(rows, np.array([layout.TENSION]), found, balance.tension, balance)
        else:
            self._evaluate(rows, self._wanted, found, out, balance)
        left, postponed = (found == kind for kind in (UNDECIDED, POSTPONED))
        if left.any():
            found[left] = self._search(rows, np.flatnonzero(left), balance)
        found[postponed] = OK
        again = slice(None) if self._asks else np.flatnonzero((left | postponed) & (found == OK))
        codes, values = found[again], out[again]
        if codes.size:
            pulled, none = frozen(balance.tension[again]), self._nothing
            given = rows.take(again)._replace(tension=pulled, low=none, high=none)
            self._evaluate(given, self._wanted, codes, values)
            found[again], out[again] = codes, values

    def _search(self, rows: Rows, left: Indices, balance: Balance) -> Codes:
        """Search for the least tensions of the rows ``left`` (r,); return their status codes (r,).

        The tensions go to ``balance.tension``.
        """
        given, outcome = rows.take(left), np.empty(left.size, dtype=np.intp)
        arms, torque, tension = (each[left] for each in balance)
        search_tensions(arms, torque, given.low, given.high, tension, outcome)
        codes = _CODES[outcome]
        for n in np.flatnonzero(codes == UNDECIDED):
            row = given.take(slice(n, n + 1))
            pose, bounds = self._arm.at(row.q[0], check_limits=False), (row.low[0], row.high[0])
            try:
                tension[n] = distribute_tension(pose, *bounds, row.wrench[0]).values
                codes[n] = OK
            except (InfeasibleTension, SolverError) as error:
                codes[n] = Status.of(error) or Status.SOLVER_FAILED
        balance.tension[left] = tension
        return codes

    def _evaluate(
        self,
        rows: Rows,
        wanted: Indices,
        found: Codes,
        out: Array,
        balance: Balance | None = None,
    ) -> None:
        """Compute the quantities ``wanted`` of the postures ``rows``; fill ``found`` and ``out``.

        If ``rows`` have bounds, the kernel guesses the tensions and verifies them. ``balance`` then
        gets the moment arms and torques of UNDECIDED postures, and tensions of POSTPONED ones.
        """
        balance = balance or self._empty_balance(0)
        derived, (nv, width) = wanted > layout.JOINT, (self._arm.nv, self._block)
        blocks = -(-len(found) // width)
        if derived.any():  # K_θ of few blocks, for the cache, but not too few: calls take time
            blocks = min(blocks, max(_FEWEST, _CACHE // (2 * width * nv**2)))
        held = blocks * bool(derived.any())
        K, parts = np.empty((2, held, nv, nv, width))
        empty = Kept(K, parts, np.zeros((held, 6, nv, width)))
        names = [QUANTITIES[number] for number in wanted[derived]]
        stored = np.zeros(len(QUANTITIES), dtype=np.bool_)
        stored[wanted[~derived]] = True
        asked = Asked(self._start, stored, int(wanted[-1]) if wanted.size else 0)
        for first in range(0, len(found), blocks * width):
            part = slice(first, first + blocks * width)
            states, values = found[part], out[part]
            some = self._with_rigidities(rows.take(part))
            kept = empty.first(-(-len(states) // width))
            left = Balance(*(each[part] for each in balance))
            evaluate_rows(self._kernel_arm, some, asked, width, kept, left, values, states)
            if names and (states == OK).any():
                self._read(kept, names, states, values)
            else:
                for name in names:
                    values[:, self._place[name]] = math.nan

    def _with_rigidities(self, rows: Rows) -> Rows:
        """Return ``rows``, with rigidities, which numpy computes, if a law is not linear.

        Nothing is filled in if no output needs rigidities, or as long as the tensions are not
        known.
        """
        if not (self._asks and len(rows.tension)):
            return rows
        return rows._replace(rigidity=self._arm._laws.rigidities(rows.tension))

    def _read(self, kept: Kept, names: list[str], found: Codes, out: Array) -> None:
        """Compute the readings ``names`` from the arrays ``kept``; fill ``out`` and ``found``."""
        status = np.full(len(kept.jacobian) * self._block, UNREAD)
        status[: found.size][found == OK] = READ
        blocks = status.reshape(-1, self._block)
        values = read(*kept, self._directions, names, blocks, self._block)
        state = status[: found.size]
        unread, singular = state == UNREAD, state == SINGULAR
        for name in names:
            value = np.moveaxis(values[name], -1, 1)
            out[:, self._place[name]] = value.reshape(status.size, -1)[: found.size]
            lost = unread | singular if name in _INVERSE else unread
            if lost.any():
                out[lost, self._place[name]] = math.nan
        found[singular] = Status.SINGULAR
        found[state == IMMOBILE] = Status.IMMOBILE

    def _empty_balance(self, rows: int) -> Balance:
        nv, cables = self._arm.nv, len(self._arm.cables)
        return Balance(np.empty((rows, cables, nv)), np.empty((rows, nv)), np.empty((rows, cables)))
