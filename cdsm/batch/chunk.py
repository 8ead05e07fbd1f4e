"""The pipeline of a chunk of rows: pose → tensions → cable stiffness → K_θ → readings."""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from cdsm.batch.quantities import READINGS, TERMS, Codes, read
from cdsm.batch.rows import Body, Indices, Pose, one_by_one, rows_of, side_by_side
from cdsm.manipulator import LIMIT_SLACK
from cdsm.quantities import QUANTITIES
from cdsm.routing import SHORTEST_SEGMENT
from cdsm.status import Status
from cdsm.support.values import Array, frozen
from cdsm.tension.least_tensions import least_tensions
from cdsm.tension.solvers import DEFAULT_SOLVER, nondimensional

if TYPE_CHECKING:
    from cdsm.batch.solution import Rows

_Scalar = TypeVar("_Scalar", np.float64, np.bool_)

_LOST = (Status.BEYOND_LIMITS, Status.COINCIDENT_SITES)
_NO_TENSION = (*_LOST, Status.INFEASIBLE, Status.SOLVER_FAILED)
_NO_STIFFNESS = (*_NO_TENSION, Status.OUTSIDE_ELASTICITY)
_WITHOUT = {"posture": _LOST, "tension": _NO_TENSION, "stiffness": _NO_STIFFNESS}
_PIVOT = 1e-4  # smallest relative pivot with which K_θ is regular, and needs no exchange of rows


class Chunk:
    """Some of the rows, in blocks of postures side by side."""

    def __init__(
        self,
        rows: Rows,
        kernels: ModuleType,
        part: slice,
        width: int,
        status: Codes,
        memory: dict[str, Array],
    ) -> None:
        self._rows = rows
        self._kernels = kernels
        self._part = part
        self._status = status
        self._memory = memory
        self._table = rows_of(rows.arm)
        self._names = set(rows.names)
        self._q = rows.q[part]
        self._width = width if kernels.COMPILED else len(self._q)

    def quantities(self) -> dict[str, Array]:
        """Compute the quantities (n, …); NaN where one does not exist, as the status says."""
        table = self._table
        rows = self._rows
        status = self._status
        if rows.check_limits:
            low = rows.arm.lower - LIMIT_SLACK
            high = rows.arm.upper + LIMIT_SLACK
            beyond = ((self._q < low) | (self._q > high)).any(axis=1)
            status[beyond] = Status.BEYOND_LIMITS
        every = table.coupling.angles(self._q) if table.coupling else self._q
        W = self._lanes(rows.wrench)
        q = side_by_side(every, self._width)
        at = Pose(*(self._empty(name, len(q), *shape) for name, shape in table.shapes.items()))
        self._kernels.pose(table.arm, self._body(), q, W, at)
        full = at
        at = self._reduced(at)
        short = self._alone(at.shortest) < SHORTEST_SEGMENT
        status[short & (status == Status.OK)] = Status.COINCIDENT_SITES
        found = self._of_posture(at)
        if not self._names <= found.keys():
            F = self._tensions(at)
            L = self._alone(at.length)
            pull = self._alone(F)
            laws = rows.arm.laws
            if all(QUANTITIES[name].needs != "stiffness" for name in self._names):
                k = np.zeros_like(pull)
            elif rows.springs is not None:
                k = rows.springs(L, pull, self._part)
            else:
                k = laws.stiffness_of(L, pull, laws.rigidities(pull))
            if k.min(initial=0.0) < 0.0:
                outside = (k < 0.0).any(axis=1) & (status == Status.OK)
                status[outside] = Status.OUTSIDE_ELASTICITY
            found |= {"tension": pull, "cable_stiffness": k}
            if "residual" in self._names:
                balance = np.einsum("bcjw,bcw->bjw", at.jacobian, F)
                found["residual"] = self._alone(balance - at.torque)
            found |= self._of_stiffness(full, at, F, side_by_side(k, self._width), W)
        return {name: self._finished(name, found[name]) for name in self._names}

    def _reduced(self, at: Pose) -> Pose:
        """Return derivatives by the independent joints in place of those by all."""
        if self._table.coupling is None:
            return at
        S = self._table.coupling.matrix
        return at._replace(
            jacobian=np.einsum("bcjw,jk->bckw", at.jacobian, S),
            gravity=np.einsum("bjw,jk->bkw", at.gravity, S),
            torque=np.einsum("bjw,jk->bkw", at.torque, S),
            tip_jacobian=np.einsum("bijxw,jk->bikxw", at.tip_jacobian, S),
        )

    def _of_posture(self, at: Pose) -> dict[str, Array]:
        found = {
            "cable_lengths": self._alone(at.length),
            "gravity_torque": self._alone(at.gravity),
        }
        if "tip" in self._names:  # from the columns of the rotation, and the position
            found["tip"] = pose = np.zeros((len(self._q), 4, 4))
            pose[:, :3], pose[:, 3, 3] = self._alone(at.tip).swapaxes(1, 2), 1.0
        if "jacobian" in self._names:
            found["jacobian"] = self._jacobian(at)
        if "length_jacobian" in self._names:
            found["length_jacobian"] = self._alone(at.jacobian)
        return found

    def _tensions(self, at: Pose) -> Array:
        """Return F (B, C, W): given, distributed, or any number where none exists or is needed."""
        rows = self._rows
        status = self._status
        shape = at.length.shape
        if rows.tension is not None:
            return np.nan_to_num(self._lanes(rows.tension))
        if rows.bounds is None:
            return np.zeros(shape)
        low, high = map(self._lanes, rows.bounds)
        F = np.empty(shape)
        good = np.zeros((shape[0], shape[2]), dtype=np.bool_)
        if len(self._table.arm.pairs):
            self._kernels.guess(self._table.arm, at, low, high, F, good)
        for n in np.flatnonzero(~self._alone(good) & (status == Status.OK)):
            b, w = divmod(int(n), self._width)
            row = at.jacobian[b, ..., w], at.torque[b, :, w], low[b, :, w], high[b, :, w]
            problem = nondimensional(*row, rows.arm.length)
            # most rows for which the kernel has no guess are infeasible
            solution = least_tensions(problem, DEFAULT_SOLVER, proof_first=True)
            F[b, :, w] = problem.force * (solution.x if solution.ok else problem.low)
            status[n] = solution.status
        return F

    def _of_stiffness(self, full: Pose, at: Pose, F: Array, k: Array, W: Array) -> dict[str, Array]:
        """Compute K_θ, its terms if they are needed, and what is read off it."""
        names = self._names
        status = self._status
        u = self._rows.directions
        wanted = names & set(READINGS)
        rows = np.flatnonzero(status == Status.OK)
        found: dict[str, Array] = {}
        if (
            self._kernels.COMPILED
            and self._table.coupling is None
            and names.isdisjoint(TERMS)
            and wanted <= {"along"}
        ):
            found, pivot = self._along(at, F, k, W)
            rows = rows[~(pivot[rows] > _PIVOT)]
            if not (wanted and rows.size):
                return found
            terms = self._terms(full, F, k, W, rows)
            K = terms.sum(axis=1)
        else:
            terms = self._terms(full, F, k, W, None)
            found = dict(zip(TERMS, terms.swapaxes(0, 1), strict=False))
            found["joint"] = terms.sum(axis=1)
            if not wanted:
                return found
            K = found["joint"][rows]
            terms = terms[rows]
        parts = abs(terms).sum(axis=1)
        read_off, status[rows] = read(wanted, K, parts, self._jacobian(at)[rows], u)
        for name, value in read_off.items():
            if name not in found:
                found[name] = np.full((len(status), *value.shape[1:]), np.nan)
            found[name][rows] = value
        return found

    def _along(self, at: Pose, F: Array, k: Array, W: Array) -> tuple[dict[str, Array], Array]:
        """Compute K_θ and ``along`` without the terms, and pivots (n,): where small, not exact."""
        K, size = self._stiffness(at, self._body(), F, k, W, 1)
        found = {"joint": self._alone(K[:, 0]).copy()} if "joint" in self._names else {}
        pivot = np.zeros((len(F), self._width))
        if "along" in self._names:
            u = self._rows.directions.copy()  # writable, whatever u is: the kernel compiles once
            along = np.empty((len(F), len(u), self._width))
            moment = bool(W[:, 3:].any())
            self._kernels.along(K, size, at.tip_jacobian, u, moment, along, pivot)
            found["along"] = self._alone(along)
        return found, self._alone(pivot)

    def _terms(self, at: Pose, F: Array, k: Array, W: Array, rows: Indices | None) -> Array:
        """Return the 4 or 5 terms (n, 5, nv, nv) of K_θ of some rows, or of all."""
        body = self._body()
        number = len(self._q)
        coupling = self._table.coupling

        def some(x: Array) -> Array:
            return side_by_side(self._alone(x)[rows], self._width)

        if rows is not None:
            at = Pose(*map(some, at))
            F = some(F)
            k = some(k)
            W = some(W)
            number = rows.size
            body = body if self._rows.body is None else Body(*map(some, body))
        count = 5 if self._rows.arm.has_springs or "springs" in self._names else 4
        terms = one_by_one(self._stiffness(at, body, F, k, W, count)[0], number)
        return coupling.square(terms) if coupling else terms

    def _stiffness(
        self, at: Pose, body: Body, F: Array, k: Array, W: Array, count: int
    ) -> tuple[Array, Array]:
        """Compute the 4 or 5 terms (B, 5, nv, nv, W) of K_θ, or 1: their sum."""
        B, nv, _ = at.gravity.shape
        K = self._empty(f"K{count}", B, count, nv, nv)
        size = self._empty("size", B, nv)
        self._kernels.stiffness(self._table.arm, body, at, F, k, W, K, size)
        return K, size

    def _finished(self, name: str, value: Array) -> Array:
        """Put NaN where the quantity does not exist."""
        status = self._status
        if not status.any():
            return value
        lost = np.isin(status, _WITHOUT[QUANTITIES[name].needs])
        return np.where(lost.reshape(-1, *[1] * (value.ndim - 1)), np.nan, value)

    def _empty(self, name: str, blocks: int, *shape: int) -> Array:
        """Return memory that the next chunk uses again: fresh pages cost as much as kernels."""
        kept = self._memory.get(name)
        if kept is None or len(kept) < blocks or kept.shape[1:] != (*shape, self._width):
            kept = self._memory[name] = np.empty((blocks, *shape, self._width))
        return kept[:blocks]

    def _body(self) -> Body:
        if self._rows.body is None:
            return self._table.body(self._width if self._kernels.COMPILED else 1)
        rows = (side_by_side(x[self._part], self._width) for x in self._rows.body)
        return Body(*map(frozen, rows))  # as those of the arm: kernels compile once

    def _lanes(self, x: Array) -> Array:
        """Put the rows of an array side by side, or repeat its only row."""
        shared = len(x) == 1 < len(self._rows.q)
        some = np.broadcast_to(x, (len(self._q), *x.shape[1:])) if shared else x[self._part]
        return side_by_side(some, self._width)

    def _alone(self, x: NDArray[_Scalar]) -> NDArray[_Scalar]:
        return one_by_one(x, len(self._q))

    def _jacobian(self, at: Pose) -> Array:
        """Return J_X (n, 6, nv)."""
        J = self._alone(at.tip_jacobian).swapaxes(2, 3)
        return np.ascontiguousarray(J).reshape(len(J), 6, -1)
