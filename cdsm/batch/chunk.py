"""The pipeline of a chunk of rows: pose → tensions → cable stiffness → K_θ → readings.

Kernels take blocks of W postures side by side, (B, …, W). All else takes one row after the other,
(n, …): :func:`side_by_side` and :func:`one_by_one` go from one to the other.
"""

from __future__ import annotations

from types import ModuleType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from cdsm import readings
from cdsm.batch.path_arrays import ContactArrays, paths_of, shapes_of_contacts
from cdsm.batch.quantities import READINGS, Codes, read
from cdsm.batch.rows import (
    BodyArrays,
    LoadArrays,
    PoseArrays,
    Rows,
    one_by_one,
    side_by_side,
    tables_of,
)
from cdsm.batch.smooth_rows import Directions, PulleyPlaces, smooth_shifts
from cdsm.batch.spring_rows import SpringRows
from cdsm.definition import TERMS_OF_K
from cdsm.quantities import QUANTITIES
from cdsm.readings import UNMOVED
from cdsm.routing import SHORTEST_SEGMENT, Indices
from cdsm.status import Status
from cdsm.support.values import Array, frozen
from cdsm.tension.least_tensions import least_tensions
from cdsm.tension.solvers import DEFAULT_SOLVER, nondimensional

_Scalar = TypeVar("_Scalar", np.float64, np.bool_)

_LOST = (Status.BEYOND_LIMITS, Status.COINCIDENT_SITES)
_NO_TENSION = (*_LOST, Status.INFEASIBLE, Status.SOLVER_FAILED)
_NO_STIFFNESS = (*_NO_TENSION, Status.OUTSIDE_ELASTICITY)
_WITHOUT = {"posture": _LOST, "tension": _NO_TENSION, "stiffness": _NO_STIFFNESS}
_PIVOT = 1e-4  # smallest relative pivot with which K_θ is regular, and needs no exchange of rows


class Scratch:
    """Memory that the chunks of one thread use in turn: fresh pages cost as much as kernels."""

    def __init__(self) -> None:
        self._arrays: dict[str, Array] = {}

    def empty(self, name: str, blocks: int, *shape: int) -> Array:
        """Return an array (blocks, …) of any numbers, valid until ``name`` is asked for again."""
        array = self._arrays.get(name)
        if array is None or len(array) < blocks or array.shape[1:] != shape:
            array = np.empty((blocks, *shape))
            self._arrays[name] = array
        return array[:blocks]


class Chunk:
    """Some of the rows, computed in blocks of postures side by side.

    Attributes:
        status: :class:`Status` (n,) of its rows, which :meth:`quantities` sets.
    """

    def __init__(
        self, rows: Rows, kernels: ModuleType, part: slice, width: int, scratch: Scratch
    ) -> None:
        self._rows = rows
        self._kernels = kernels
        self._part = part
        self._scratch = scratch
        touches = rows.touching.touches if rows.touching else None
        self._table = tables_of(rows.arm, touches)
        self._paths = None if touches is None else paths_of(rows.arm, touches)
        self._contacts: ContactArrays | None = None  # of an arm with pulleys, set with the posture
        self._names = set(rows.names)
        self._q = rows.q[part]
        self._width = width if kernels.COMPILED else len(self._q)
        self._loads = rows.all_loads
        lost = rows.status
        self.status: Codes = np.zeros(len(self._q), np.uint8) if lost is None else lost[part].copy()
        self._springs: SpringRows | None = None  # of an arm with laws, set with the posture

    def quantities(self) -> dict[str, NDArray[Any]]:
        """Compute the quantities (n, …); NaN where one does not exist, as the status says."""
        rows = self._rows
        if rows.check_limits:
            beyond = rows.arm.beyond_limits(self._q).any(axis=1)
            self.status[beyond] = Status.BEYOND_LIMITS
        W = self._blocks(rows.wrench)
        by_all_joints = self._pose(W)
        at = self._by_independent_joints(by_all_joints)
        short = self._one_by_one(at.shortest) < SHORTEST_SEGMENT
        self._fail(short, Status.COINCIDENT_SITES)
        values: dict[str, NDArray[Any]] = {**self._of_posture(at)}
        if not self._names <= values.keys():
            F = self._tensions(at)
            tension = self._one_by_one(F)
            k = self._cable_stiffness(self._one_by_one(at.length), tension)
            values |= {"tension": tension, "cable_stiffness": k}
            if "residual" in self._names:
                balance = np.einsum("bcjw,bcw->bjw", at.jacobian, F)
                values["residual"] = self._one_by_one(balance - at.torque)
            k = side_by_side(k, self._width)
            values |= self._of_stiffness(by_all_joints, at, F, k, W)
            if not self._names.isdisjoint(("along", "slack")):
                self._allow_slack(values, by_all_joints, at, F, k, W)
        return {name: self._where_it_exists(name, values[name]) for name in self._names}

    def _fail(self, failed: NDArray[np.bool_], status: Status) -> None:
        """Set the status of rows that failed, unless they failed before."""
        self.status[failed & (self.status == Status.OK)] = status

    # --- steps of the pipeline -------------------------------------------------------------------

    def _pose(self, W: Array) -> PoseArrays:
        """Compute what depends on the joint angles, with derivatives by all joints."""
        table = self._table
        angles = table.coupling.angles(self._q) if table.coupling else self._q
        q = side_by_side(angles, self._width)
        shapes = dict(table.shapes)
        if self._loads is not None:
            shapes |= dict.fromkeys(("turned", "moment"), (q.shape[1], 3))
        arrays = (
            self._scratch.empty(f"{name}{shape}", len(q), *shape, self._width)
            for name, shape in shapes.items()
        )
        at = PoseArrays(*arrays)
        body = self._body()
        given = self._rows.body
        k = table.dimensions.spring if given is None else given.spring[self._part]
        self._springs = laws = SpringRows.at(self._rows.arm.springs, angles, k)
        if laws:
            body = body._replace(spring=frozen(body.spring * laws.linear[:, None]))
        if self._paths is not None:
            contacts = self._contacts = self._find_contacts(q)
            fixed = contacts.fixed.view()
            site = contacts.site.view()
            body = body._replace(site=frozen(site), fixed=frozen(fixed))
        self._kernels.fill_pose(table.arm, body, q, W, self._load_arrays(), at)
        if laws:
            np.subtract(at.torque, side_by_side(laws.torque, self._width), out=at.torque)
        return at

    def _find_contacts(self, q: Array) -> ContactArrays:
        """Find the contacts with the pulleys, which are sites of the arm in each row."""
        assert self._paths is not None
        assert self._rows.touching is not None
        arrays = (
            self._scratch.empty(f"contacts {i}{shape}", len(q), *shape, self._width)
            for i, shape in enumerate(shapes_of_contacts(self._paths))
        )
        contacts = ContactArrays(*arrays)
        kernels = self._rows.touching.kernels
        shift = self._table.body(self._width if kernels.compiled else 1).shift
        kernels.fill_contacts(self._table.arm, shift, self._paths, q, True, contacts)
        return contacts

    def _load_arrays(self) -> LoadArrays:
        """Return the loads on links in blocks; read-only as :meth:`_body`, but for the wrenches."""
        points = () if self._loads is None else self._loads.points
        wrenches = np.zeros((1, 0, 6)) if self._loads is None else self._loads.wrenches
        frame = np.array([point.row for point in points], np.intp)
        offset = np.array([point.offset for point in points]).reshape(-1, 3)
        return LoadArrays(frozen(frame), frozen(offset), self._blocks(wrenches))

    def _by_independent_joints(self, at: PoseArrays) -> PoseArrays:
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

    def _of_posture(self, at: PoseArrays) -> dict[str, Array]:
        """Return the quantities that depend on the joint angles alone."""
        values = {
            "cable_lengths": self._one_by_one(at.length),
            "gravity_torque": self._one_by_one(at.gravity),
        }
        if "tip" in self._names:  # from the columns of the rotation, and the position
            tip = np.zeros((len(self._q), 4, 4))
            tip[:, :3] = self._one_by_one(at.tip).swapaxes(1, 2)
            tip[:, 3, 3] = 1.0
            values["tip"] = tip
        if "jacobian" in self._names:
            values["jacobian"] = self._tip_jacobian(at)
        if "length_jacobian" in self._names:
            values["length_jacobian"] = self._one_by_one(at.jacobian)
        return values

    def _tensions(self, at: PoseArrays) -> Array:
        """Return F (B, C, W): given, distributed, or any number where none exists or is needed."""
        rows = self._rows
        shape = at.length.shape
        if rows.tension is not None:
            return np.nan_to_num(self._blocks(rows.tension))
        if rows.bounds is None:
            return np.zeros(shape)
        low, high = map(self._blocks, rows.bounds)
        F = np.empty(shape)
        optimal = np.zeros((shape[0], shape[2]), dtype=np.bool_)
        if len(self._table.arm.pairs):
            self._kernels.guess_tensions(self._table.arm, at, low, high, F, optimal)
        for n in np.flatnonzero(~self._one_by_one(optimal) & (self.status == Status.OK)):
            b, w = divmod(int(n), self._width)
            row = at.jacobian[b, ..., w], at.torque[b, :, w], low[b, :, w], high[b, :, w]
            problem = nondimensional(*row, rows.arm.length)
            # most rows for which the kernel has no guess are infeasible
            solution = least_tensions(problem, DEFAULT_SOLVER, proof_first=True)
            F[b, :, w] = problem.force * (solution.x if solution.ok else problem.low)
            self.status[n] = solution.status
        return F

    def _cable_stiffness(self, L: Array, F: Array) -> Array:
        """Return k (n, C) [N/m]; any number where none exists or is needed."""
        rows = self._rows
        laws = rows.arm.laws
        if all(QUANTITIES[name].needs != "stiffness" for name in self._names):
            return np.zeros_like(F)
        if rows.cable_stiffness is not None:
            k = rows.cable_stiffness(L, F, self._part)
        else:
            k = laws.stiffness_of(L, F, laws.rigidities(F))
        if k.min(initial=0.0) < 0.0:
            self._fail(np.asarray((k < 0.0).any(axis=1)), Status.OUTSIDE_ELASTICITY)
        return k

    def _of_stiffness(
        self, by_all_joints: PoseArrays, at: PoseArrays, F: Array, k: Array, W: Array
    ) -> dict[str, Array]:
        """Compute K_θ, and its terms and readings if they are asked for.

        If ``along`` is the only reading, a kernel eliminates K_θ in place. It does not exchange
        rows, so rows with a small pivot are computed again in the general way: the terms of K_θ by
        the kernel, readings by numpy.
        """
        wanted = self._names & set(READINGS)
        fine = np.flatnonzero(self.status == Status.OK)
        if self._is_eliminated_in_place(wanted):
            values, pivot = self._eliminate(at, F, k, W)
            doubtful = fine[~(pivot[fine] > _PIVOT)]
            if wanted and doubtful.size:
                terms = self._terms(by_all_joints, F, k, W, doubtful)
                self._read(values, wanted, doubtful, terms, terms.sum(axis=1), at)
            return values
        terms = self._terms(by_all_joints, F, k, W)
        values = dict(zip(TERMS_OF_K, terms.swapaxes(0, 1), strict=False))
        values["joint"] = terms.sum(axis=1)
        if wanted:
            self._read(values, wanted, fine, terms[fine], values["joint"][fine], at)
        return values

    def _allow_slack(
        self,
        values: dict[str, NDArray[Any]],
        by_all_joints: PoseArrays,
        at: PoseArrays,
        F: Array,
        k: Array,
        W: Array,
    ) -> None:
        """Set ``slack``, and ``along`` of rows with cables at 0 N, which can only add tension."""
        cable_stiffness = self._one_by_one(k)
        slack = readings.slack_cables(self._one_by_one(F), cable_stiffness)
        any_slack = np.asarray(slack.any(axis=1))
        values["slack"] = any_slack
        exists = np.isin(self.status, (Status.OK, Status.IMMOBILE))
        rows = np.flatnonzero(any_slack & exists)
        if "along" not in self._names or not rows.size:
            return
        terms = self._terms(by_all_joints, F, k, W, rows)
        J_v = self._tip_jacobian(at)[rows, :3]
        torque = self._rows.directions @ J_v
        moves = readings.moves_tip(torque, J_v)
        K = terms.sum(axis=1)
        magnitudes = abs(terms).sum(axis=1)
        J = self._one_by_one(at.jacobian)[rows]
        soft = self._rows.arm.motors.yielding
        if soft is not None:
            K, magnitudes, J = soft.extended(K, magnitudes, J, cable_stiffness[rows])
            no_torque = np.zeros((*torque.shape[:-1], len(soft.names)))
            torque = np.concatenate([torque, no_torque], axis=-1)
        along, _, buckles = readings.one_sided_along(
            K, magnitudes, J, np.where(slack, cable_stiffness, 0.0)[rows], torque, moves
        )
        values["along"][rows] = along
        self.status[rows[buckles]] = Status.UNSTABLE

    def _is_eliminated_in_place(self, wanted: set[str]) -> bool:
        """Whether the kernel ``fill_along`` has all that is wanted of K_θ."""
        return (
            self._kernels.COMPILED
            and self._table.coupling is None
            and (self._paths is None or not self._paths.coupled)
            and self._names.isdisjoint(TERMS_OF_K)
            and self._rows.arm.motors.yielding is None
            and wanted <= {"along"}
        )

    def _eliminate(
        self, at: PoseArrays, F: Array, k: Array, W: Array
    ) -> tuple[dict[str, Array], Array]:
        """Compute K_θ and ``along`` without the terms, and pivots (n,): where small, not exact."""
        K, size = self._stiffness(at, self._body_with_tangents(), F, k, W, 1, self._contacts)
        values = {"joint": self._one_by_one(K[:, 0]).copy()} if "joint" in self._names else {}
        pivot = np.zeros((len(F), self._width))
        if "along" in self._names:
            u = self._rows.directions.copy()  # writable, whatever u is: the kernel compiles once
            along = np.empty((len(F), len(u), self._width))
            moment = bool(W[:, 3:].any() or at.moment.any())
            self._kernels.fill_along(K, size, at.tip_jacobian, u, moment, UNMOVED, along, pivot)
            values["along"] = self._one_by_one(along)
        return values, self._one_by_one(pivot)

    def _terms(
        self, at: PoseArrays, F: Array, k: Array, W: Array, rows: Indices | None = None
    ) -> Array:
        """Return the 4 or 5 terms (n, 5, nv, nv) of K_θ of some rows, or of all."""
        body = self._body_with_tangents()
        contacts = self._contacts
        number = len(self._q)
        coupling = self._table.coupling

        def some(x: Array) -> Array:
            return side_by_side(self._one_by_one(x)[rows], self._width)

        if rows is not None:
            at = PoseArrays(*map(some, at))
            contacts = contacts and ContactArrays(*map(some, contacts))
            F = some(F)
            k = some(k)
            W = some(W)
            number = rows.size
            if self._rows.body is not None:
                body = BodyArrays(*(frozen(some(x)) for x in body))
            elif self._springs:
                body = body._replace(spring=frozen(some(body.spring)))
        count = 5 if self._rows.arm.has_springs or "springs" in self._names else 4
        terms = one_by_one(self._stiffness(at, body, F, k, W, count, contacts)[0], number)
        terms = coupling.square(terms) if coupling else terms
        soft = self._rows.arm.motors.yielding
        if soft is not None:  # of rank m, beside the kernel
            J = one_by_one(at.jacobian, number)
            J = J @ coupling.matrix if coupling else J
            terms[:, TERMS_OF_K.index("passive")] -= soft.softening(J, one_by_one(k, number))
        return terms

    def _stiffness(
        self,
        at: PoseArrays,
        body: BodyArrays,
        F: Array,
        k: Array,
        W: Array,
        count: int,
        contacts: ContactArrays | None,
    ) -> tuple[Array, Array]:
        """Compute the 4 or 5 terms (B, 5, n, n, W) of K_θ, or 1: their sum, with its size."""
        B, n, _ = at.gravity.shape
        K = self._scratch.empty(f"K{count}", B, count, n, n, self._width)
        size = self._scratch.empty("size", B, n, self._width)
        self._kernels.fill_stiffness(self._table.arm, body, at, F, k, W, K, size)
        if contacts is not None:
            self._add_shifts(at, contacts, F, K, size)
        return K, size

    def _add_shifts(
        self, at: PoseArrays, contacts: ContactArrays, F: Array, K: Array, size: Array
    ) -> None:
        """Add to the active term what contacts shift beside the planes of their pulleys."""
        paths = self._paths
        touching = self._rows.touching
        assert paths is not None
        assert touching is not None
        if not paths.coupled:
            touching.kernels.add_shifts(self._table.arm, paths, at, contacts, F, K, size)
            return
        count = len(F) * F.shape[2]  # not eliminated in place, so the size is not needed

        def rows_of(x: Array) -> Array:
            return one_by_one(x, count)

        directions = Directions(*map(rows_of, (at.segment, at.motion, at.axis)))
        places = PulleyPlaces(*(rows_of(getattr(contacts, name)) for name in PulleyPlaces._fields))
        added = smooth_shifts(self._rows.arm, touching.touches, directions, places, rows_of(F))
        K[:, 0] += side_by_side(added, F.shape[2])

    def _read(
        self,
        values: dict[str, Array],
        names: set[str],
        rows: Indices,
        terms: Array,
        K: Array,
        at: PoseArrays,
    ) -> None:
        """Add to ``values`` what is read off K_θ of some rows, and set their status."""
        magnitudes = abs(terms).sum(axis=1)
        J = self._tip_jacobian(at)[rows]
        numbers, self.status[rows] = read(names, K, magnitudes, J, self._rows.directions)
        for name, value in numbers.items():
            if name not in values:
                values[name] = np.full((len(self._q), *value.shape[1:]), np.nan)
            values[name][rows] = value

    def _where_it_exists(self, name: str, value: NDArray[Any]) -> NDArray[Any]:
        """Put NaN, or False, where the quantity does not exist."""
        if not self.status.any():
            return value
        lost = np.isin(self.status, _WITHOUT[QUANTITIES[name].needs])
        if QUANTITIES[name].is_flag:
            return np.asarray(value & ~lost)
        return np.where(lost.reshape(-1, *[1] * (value.ndim - 1)), np.nan, value)

    # --- between rows and blocks -----------------------------------------------------------------

    def _body(self) -> BodyArrays:
        """Return the dimensions in blocks, read-only as those of the arm: kernels compile once."""
        if self._rows.body is None:
            return self._table.body(self._width if self._kernels.COMPILED else 1)
        blocks = (side_by_side(x[self._part], self._width) for x in self._rows.body)
        return BodyArrays(*map(frozen, blocks))

    def _body_with_tangents(self) -> BodyArrays:
        """Return the dimensions; springs with laws have their tangents in each row."""
        if self._springs is None:
            return self._body()
        k = side_by_side(self._springs.tangent, self._width)
        return self._body()._replace(spring=frozen(k))

    def _blocks(self, x: Array) -> Array:
        """Put the rows of an array side by side, or repeat its only row."""
        shared = len(x) == 1 < len(self._rows.q)
        some = np.broadcast_to(x, (len(self._q), *x.shape[1:])) if shared else x[self._part]
        return side_by_side(some, self._width)

    def _one_by_one(self, x: NDArray[_Scalar]) -> NDArray[_Scalar]:
        return one_by_one(x, len(self._q))

    def _tip_jacobian(self, at: PoseArrays) -> Array:
        """Return J_X (n, 6, nv)."""
        J = self._one_by_one(at.tip_jacobian).swapaxes(2, 3)
        return np.ascontiguousarray(J).reshape(len(J), 6, -1)
