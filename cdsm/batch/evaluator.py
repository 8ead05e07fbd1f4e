"""Evaluation of the postures of a batch in ranges of rows, with checked arguments."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from cdsm.batch import layout
from cdsm.batch.fused_kernel import evaluate_rows
from cdsm.batch.inputs import checked_threads, kernel_arm, run_slices
from cdsm.batch.layout import OK, QUANTITIES, UNDECIDED, Codes, Flags
from cdsm.batch.stuck_readings import STUCK, WITHOUT_FRICTION, Kept, read_stuck
from cdsm.cable_laws import CableLaws
from cdsm.elasticity import Elasticity
from cdsm.errors import ElasticityRangeError, InfeasibleTension, SolverError
from cdsm.kernels.compiling import WIDTH, is_new
from cdsm.kernels.distribution import search_tensions
from cdsm.kernels.read import read
from cdsm.kernels.readings import IMMOBILE, READ, SINGULAR, UNREAD
from cdsm.kernels.tension import Balance
from cdsm.kernels.tree import Indices
from cdsm.manipulator import Manipulator
from cdsm.support.status import Status
from cdsm.support.values import Array, frozen
from cdsm.tension import distribute_tension

_LONG = 2**15
"""Size of a posture's record (count of numbers) from which a block has half the width."""

_CACHE, _FEWEST = 2**16, 8
"""Count of numbers kept for readings (quantities that need K_θ⁻¹), and least count of blocks."""

_BLOCK, _BATCH = 2**22, 2**27
"""Numbers in the records of a block, and of a batch, up to which Python runs a new kernel."""

_CODES = np.array([OK, Status.INFEASIBLE, UNDECIDED], dtype=np.uint8)
"""Status of each outcome of a search: OPTIMAL, INFEASIBLE, UNDECIDED."""


class Evaluator:
    """Evaluation of ranges of rows (postures); arguments as in :func:`cdsm.batch.evaluate`.

    ``rows`` (b,) are the indices of postures; ``found`` (b,) and ``out`` (b, n) are their status
    and outputs, which the methods fill in place. ``wanted`` are the numbers of the requested
    quantities.
    ``tension`` is F (C,) or (B, C) [N]. ``bounds`` are the lower and the upper bounds of
    distributed tensions, (C,) or (B, C) [N]. If neither is given, no output depends on tensions.

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
        self._arm, self._q, self._wrench = arm, q, wrench
        self._tension, self._bounds = tension, bounds
        nv, cables = arm.nv, len(arm.cables)
        self._nothing = frozen(np.empty((0, cables)))
        self._no_balance = Balance(np.empty((0, cables, nv)), np.empty((0, nv)))
        self._directions = frozen(
            np.zeros((0, 3)) if direction is None else direction.reshape(-1, 3)
        )
        self._arrays = kernel_arm(arm, check_limits)
        count = len(self._directions)
        self._start = layout.starts(nv, cables, count)
        same = {} if arm.has_friction else WITHOUT_FRICTION
        numbers = {QUANTITIES.index(same.get(name, name)) for name in names}
        self._sticks = arm.has_friction and not numbers.isdisjoint(STUCK)
        if layout.BREAKAWAY in numbers:
            numbers.add(layout.TENSION)
        self._wanted = np.array(sorted(numbers), dtype=np.intp)
        ends = [0, *np.cumsum(np.diff(self._start)[self._wanted]).tolist()]
        self._place = {
            QUANTITIES[number]: slice(*place)
            for number, place in zip(self._wanted, pairwise(ends), strict=True)
        }
        # whether the kernel needs rigidities that only Python computes
        needs_springs = bool(self._wanted.size) and self._wanted[-1] > layout.LOAD
        laws = arm._model.wire_laws if self._sticks else arm._model.laws
        self._asks = needs_springs and bool(laws.nonlinear if self._sticks else laws.without_kernel)
        record = int(self._start[-1])
        widest = WIDTH if record < _LONG else WIDTH // 2
        if len(q) * record <= _BATCH and is_new(evaluate_rows):
            widest = max(widest, _BLOCK // record)
        self._block = max(1, min(widest, len(q)))

        shapes = dict(zip(QUANTITIES, layout.shapes(nv, cables, count), strict=True))
        if direction is not None and direction.ndim == 1:
            shapes |= dict.fromkeys(layout.DIRECTIONAL, ())
        # one row for each posture, which the kernel fills; the outputs are views of it
        self._out = np.empty((len(q), ends[-1]))
        self.values = [
            self._out[:, self._place[same.get(name, name)]].reshape(len(q), *shapes[name])
            for name in names
        ]

    def run(self, status: Codes, threads: int | None) -> None:
        """Fill the values and the status (B,) in several threads, each for ranges of rows."""
        count = checked_threads(threads)
        run_slices(lambda part: self._fill(part, status), len(self._q), self._block, count)

    def _fill(self, part: slice, status: Codes) -> None:
        """Fill the values and the status (B,) of the range of rows ``part``."""
        rows, found, out = np.arange(part.start, part.stop), status[part], self._out[part]
        if self._bounds is None:
            tension = self._nothing if self._tension is None else self._of(self._tension, rows)
            self._evaluate(rows, tension, self._wanted, found, out)
        else:
            self._distribute(rows, found, out)
        if self._tension is not None and "tension" in self._place:
            out[:, self._place["tension"]] = self._of(self._tension, rows)

    def _distribute(self, rows: Indices, found: Codes, out: Array) -> None:
        """Distribute the tensions of the postures ``rows``; fill their status and outputs."""
        nv, cables = self._arm.nv, len(self._arm.cables)
        balance = Balance(np.empty((rows.size, cables, nv)), np.empty((rows.size, nv)))
        tension = np.empty((rows.size, cables))
        if self._asks:  # rigidities that only Python computes need the tensions first
            self._evaluate(rows, None, np.array([layout.TENSION]), found, tension, balance)
        else:
            self._evaluate(rows, None, self._wanted, found, out, balance)
        left = np.flatnonzero(found == UNDECIDED)
        if left.size:
            kept = Balance(*(each[left] for each in balance))
            tension[left], found[left] = self._search(rows[left], kept)
        again = slice(None) if self._asks else left[found[left] == OK]
        codes, values = found[again], out[again]
        if codes.size:
            self._evaluate(rows[again], frozen(tension[again]), self._wanted, codes, values)
            found[again], out[again] = codes, values

    def _search(self, rows: Indices, balance: Balance) -> tuple[Array, Codes]:
        """Search for the tensions (b, C) [N] of postures whose guess is not optimal.

        ``balance`` is what they must balance. Also return status codes (b,).
        """
        low, high = (self._of(each, rows).copy() for each in self._bounds or ())
        tension, outcome = np.empty_like(low), np.empty(rows.size, dtype=np.intp)
        search_tensions(self._arm._model.blocks, *balance, low, high, tension, outcome)
        codes = _CODES[outcome]
        for r in np.flatnonzero(codes == UNDECIDED):
            wrench = self._of(self._wrench, rows[r : r + 1])[0]
            pose = self._arm.at(self._q[rows[r]], check_limits=False)
            try:
                tension[r] = distribute_tension(pose, low[r], high[r], wrench).values
                codes[r] = OK
            except (InfeasibleTension, SolverError) as error:
                codes[r] = Status.of(error) or Status.SOLVER_FAILED
        return tension, codes

    def _evaluate(
        self,
        rows: Indices,
        tension: Array | None,
        wanted: Indices,
        found: Codes,
        out: Array,
        balance: Balance | None = None,
    ) -> None:
        """Fill status and outputs of the postures ``rows`` at tensions (b, C) [N].

        Without tensions, they are guessed; postures whose guess is not optimal become UNDECIDED,
        and what their tensions must balance is written to ``balance``.
        """
        balance = balance or self._no_balance
        read = wanted[wanted > layout.STUCK_JOINT]
        if not read.size:
            self._evaluate_blocks(rows, tension, wanted, found, out, balance, 0)
            return
        # readings keep K_θ of several blocks: few enough for the cache, enough for few calls
        size = self._block * max(_FEWEST, _CACHE // (2 * self._block * self._arm.nv**2))
        for first in range(0, rows.size, size):
            part = slice(first, min(first + size, rows.size))
            given = None if tension is None else tension[part]
            blocks = -(-(part.stop - first) // self._block)
            parts = Balance(*(each[part] for each in balance))
            kept = self._evaluate_blocks(
                rows[part], given, wanted, found[part], out[part], parts, blocks
            )
            self._read(kept, rows[part], read, found[part], out[part])

    def _evaluate_blocks(
        self,
        rows: Indices,
        tension: Array | None,
        wanted: Indices,
        found: Codes,
        out: Array,
        balance: Balance,
        blocks: int,
    ) -> Kept:
        """Fill all quantities up to K_θ; return the arrays from which the readings follow.

        Readings are the quantities that are derived from K_θ, such as the margin and the
        compliance. The arrays have ``blocks`` blocks. Other arguments are those of
        :meth:`_evaluate`.
        """
        given = low = high = rigidity = wire = self._nothing
        model = self._arm._model
        if tension is not None:
            given = tension
            if self._asks and tension.size:
                rigidity = wire = _rigidities(model.laws, tension, found == OK)
                if self._sticks and model.wire_laws is not model.laws:
                    wire = _rigidities(model.wire_laws, tension, found == OK)
        elif self._bounds is not None:
            low, high = (self._of(each, rows) for each in self._bounds)
        nv, width = self._arm.nv, self._block
        stuck, read = np.isin(wanted, STUCK), wanted > layout.STUCK_JOINT
        free, held = blocks * bool((read & ~stuck).any()), blocks * bool((read & stuck).any())
        K, parts = np.empty((2, free, nv, nv, width))
        stuck_K, stuck_parts = np.empty((2, held, nv, nv, width))
        JX = np.empty((blocks, 6, nv, width))
        arguments: tuple[Any, ...] = (
            *self._arrays,
            self._of(self._q, rows),
            given,
            low,
            high,
            rigidity,
            wire,
            self._of(self._wrench, rows),
            self._start,
            wanted[wanted <= layout.STUCK_JOINT],
            wanted[-1] if wanted.size else 0,
            bool((~stuck & (wanted > layout.LOAD)).any()),
            self._sticks,
            width,
            K,
            parts,
            JX,
            stuck_K,
            stuck_parts,
            balance,
            out,
            found,
        )
        evaluate_rows(*arguments)
        return Kept(K, parts, JX, stuck_K, stuck_parts, wire)

    def _read(self, kept: Kept, rows: Indices, wanted: Indices, found: Codes, out: Array) -> None:
        """Fill the wanted readings, which are the quantities derived from the K_θ in ``kept``.

        Where one does not exist, also set the status of the posture.
        """
        status = np.full(kept.jacobian.shape[0] * self._block, UNREAD)
        status[: found.size][found == OK] = READ
        stuck = np.isin(wanted, STUCK)
        for numbers in (wanted[~stuck], wanted[stuck]):
            own, names = status.copy(), [QUANTITIES[number] for number in numbers]
            blocks = own.reshape(-1, self._block)
            if not names:
                continue
            if numbers[0] in STUCK:
                angles, F = self._of(self._q, rows), out[:, self._place.get("tension", slice(0))]
                values = read_stuck(self._arm, angles, F, kept, self._directions, names, blocks)
            else:
                values = read(*kept[:3], self._directions, names, blocks, self._block)
            state = own[: found.size]
            for number, name in zip(numbers, names, strict=True):
                value = np.moveaxis(values[name], -1, 1)
                out[:, self._place[name]] = value.reshape(own.size, -1)[: found.size]
                singular = (state == SINGULAR) & (number > layout.PSEUDOINVERSE)
                out[(state == UNREAD) | singular, self._place[name]] = math.nan
            found[state == SINGULAR] = Status.SINGULAR
            found[state == IMMOBILE] = Status.IMMOBILE

    def _of(self, values: Array, rows: Indices) -> Array:
        """Return the values (b, n) of some rows of (B, n); repeat values (n,) for all rows."""
        whole = np.broadcast_to(values, (len(self._q), *values.shape[-1:]))
        return frozen(np.ascontiguousarray(whole[rows]))


def _rigidities(laws: CableLaws, tension: Array, usable: Flags) -> Array:
    """Return EA (1 + ε) (b, C) [N] by ``laws`` at tensions (b, C) [N] of usable postures (b,).

    It is 0 under force control and in postures that are not usable, and −1 outside the domain.
    """
    if not usable.any():  # a user-defined law may fail on empty arrays
        return frozen(np.zeros_like(tension))
    given = tension if usable.all() else tension[usable]
    rigidity = np.zeros_like(given)
    for law, held in laws.held:
        rigidity[:, held] = _where_defined(laws, law, given[:, held])
    if given is tension:
        return frozen(rigidity)
    result = np.zeros_like(tension)
    result[usable] = rigidity
    return frozen(result)


def _where_defined(laws: CableLaws, law: Elasticity, tension: Array) -> Array:
    """Return EA (1 + ε) [N] at tensions of any shape; −1 outside the domain of the law."""
    try:
        return laws.stretched_rigidity(law, tension)
    except ElasticityRangeError:
        pass
    result, values = np.full(tension.size, -1.0), tension.ravel()
    left = np.arange(tension.size)
    while left.size:
        try:
            result[left] = laws.stretched_rigidity(law, values[left])
            break
        except ElasticityRangeError as error:
            if not error.indices:  # a user-defined law may not say which tensions are outside
                result[left] = [_one(laws, law, value) for value in values[left]]
                break
            left = np.delete(left, error.indices)
    return result.reshape(tension.shape)


def _one(laws: CableLaws, law: Elasticity, tension: float) -> float:
    try:
        return float(laws.stretched_rigidity(law, np.array([tension]))[0])
    except ElasticityRangeError:
        return -1.0
