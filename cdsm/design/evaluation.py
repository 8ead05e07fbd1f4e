"""Evaluation of designs: every quantity of a problem, over all its postures and loads."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any, NamedTuple, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.batch import evaluate
from cdsm.design.goals import Measure
from cdsm.design.problem import MISSED, DesignProblem
from cdsm.errors import CdsmError, CdsmWarning, GeometryError, InvalidInput
from cdsm.kernels.principal import principal_stiffness
from cdsm.manipulator import Manipulator
from cdsm.measures.clearance import KINDS as CLEARANCES
from cdsm.measures.rows import measured, payloads
from cdsm.support.progress import progress_bar
from cdsm.support.status import Status
from cdsm.support.validation import number_array, whole_number
from cdsm.support.values import Array, ReadOnlyState, frozen
from cdsm.tension import distribute_tension
from cdsm.tolerances.budget import uncertainty
from cdsm.tolerances.readings import Reading

if TYPE_CHECKING:
    from distributed import Client

_SURE: dict[str, tuple[Reading, float]] = {
    "stiffness": ("along", -1.0),
    "margin": ("margin", -1.0),
    "motor_force": ("tension", 1.0),
}
"""Readings with an uncertainty, and the side on which it counts."""


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Designs(ReadOnlyState):
    """Designs of a problem with all their quantities; made by :func:`evaluate_designs`.

    Attributes:
        problem: The problem.
        designs: The designs (D, n) [m, rad, N, -], a row each; see :meth:`DesignProblem.values`.
        values: Quantities (D, n) in SI: [N/m], [N m/rad], [m], [N], [kg] or [-]; a column for each
            of ``problem.measures``. NaN where one does not exist.
        faults: Why a design is no arm; else empty.
    """

    problem: DesignProblem
    designs: Array
    values: Array
    faults: tuple[str, ...]

    def __getitem__(self, key: str) -> Array:
        """Return a quantity (D,) by its key, as ``mass`` or ``stiffness (0, 0, 1)``.

        Raises:
            InvalidInput: The problem does not ask for it.
        """
        keys = [each.key for each in self.problem.measures]
        if key not in keys:
            raise InvalidInput("measure", f"{key!r} given; give {', '.join(keys)}.")
        return np.asarray(self.values[:, keys.index(key)])

    @property
    def violations(self) -> Array:
        """How far each design misses each constraint, over the limit (D, n) [-]; 0: not at all.

        The first column is the share of postures that are not held, if all must be.
        """
        return violations(self.problem, self.values)

    @property
    def feasible(self) -> Array:
        """Whether each design meets all constraints (D,) [-], as 0 and 1."""
        return np.asarray((self.violations == 0.0).all(axis=1), dtype=np.float64)

    def __len__(self) -> int:
        return len(self.designs)

    def __repr__(self) -> str:
        return f"<Designs: {len(self)}, {int(self.feasible.sum())} feasible>"


def violations(problem: DesignProblem, values: Array) -> Array:
    """Compute the violations (D, 1+n) of quantities (D, m): of holding all, of each constraint."""
    keys = [each.key for each in problem.measures]
    held = values[:, keys.index(MISSED)]
    found = [np.where(held == held, 1.0 - held, 1.0) if problem.needs_all else np.zeros(len(held))]
    for constraint in problem.constraints:
        column = values[:, keys.index(constraint.key)]
        found.append(np.array([constraint.violation(value) for value in column.tolist()]))
    return np.column_stack(found)


def evaluate_designs(
    problem: DesignProblem,
    designs: ArrayLike,
    *,
    jobs: int = 1,
    client: Client | None = None,
    progress: bool = True,
) -> Designs:
    """Compute all quantities of designs, each over all postures and loads of the problem.

    Args:
        problem: The problem.
        designs: (D, n) [m, rad, N, -], a row each; see :meth:`DesignProblem.values`.
        jobs: Number of processes. With more than one, a script needs the usual guard
            ``if __name__ == "__main__":``.
        client: Client of a dask cluster, in the place of processes.
        progress: Show a bar, if there is a terminal.

    Raises:
        InvalidInput: A design is outside its ranges, or ``jobs`` is below 1.
    """
    rows = number_array("designs", designs)
    if rows.ndim != 2:
        raise InvalidInput("designs", f"shape {rows.shape} given, (D, n) needed: a row each.")
    for row in rows:
        problem.values(row)
    found = []
    with (
        workers(problem, jobs, client) as compute,
        progress_bar("designs", len(rows), wanted=progress, rate=True) as advance,
    ):
        for each in compute(rows):
            found.append(each)
            advance(1)
    return gathered(problem, rows, found)


class Found(NamedTuple):
    """Quantities (m,) of one design, and why it is no arm."""

    values: Array
    fault: str = ""


def gathered(problem: DesignProblem, rows: Array, found: Sequence[Found]) -> Designs:
    """Collect the evaluations of designs."""
    width = len(problem.measures)
    return Designs(
        problem=problem,
        designs=frozen(rows.copy()),
        values=frozen(np.array([each.values for each in found]).reshape(-1, width)),
        faults=tuple(each.fault for each in found),
    )


class _Pool:
    """Computes designs in this process, in others, or on a cluster; answers in their order."""

    def __init__(self, problem: DesignProblem, pool: Any, client: Any) -> None:
        self._problem, self._pool, self._client = problem, pool, client

    def __call__(self, rows: Array) -> Iterator[Found]:
        if self._client is not None:
            sent = self._client.scatter(self._problem, broadcast=True)
            yield from self._client.gather(
                [self._client.submit(measure, sent, row, pure=False) for row in rows]
            )
        elif self._pool is not None:
            chunk = max(1, min(16, len(rows) // 8))
            yield from self._pool.map(_in_worker, rows, chunksize=chunk)
        else:
            yield from (measure(self._problem, row) for row in rows)


@contextmanager
def workers(problem: DesignProblem, jobs: int, client: Client | None) -> Iterator[_Pool]:
    """Yield a function of designs (D, n) that yields the evaluation of each."""
    if client is not None:
        from cdsm.sweeps.cluster import checked_client

        checked_client(client)
    if whole_number("jobs", jobs, 1) == 1 or client is not None:
        yield _Pool(problem, None, client)
        return
    # spawn: a forked process would inherit threads of BLAS
    with ProcessPoolExecutor(jobs, get_context("spawn"), _set_problem, (problem,)) as pool:
        try:
            yield _Pool(problem, pool, None)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


_problem: list[DesignProblem] = []
"""The problem of a worker process."""


def _set_problem(problem: DesignProblem) -> None:
    _problem[:] = [problem]


def _in_worker(row: Array) -> Found:
    return measure(_problem[0], row)


def measure(problem: DesignProblem, row: Array) -> Found:
    """Compute the quantities of one design (n,)."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", CdsmWarning)  # cables may share a hole
            arm = problem.arm_of(row)
    except GeometryError as error:
        return Found(np.full(len(problem.measures), math.nan), "; ".join(error.faults))
    except CdsmError as error:
        return Found(np.full(len(problem.measures), math.nan), str(error))
    return Found(_Arm(problem, row, arm).values())


class _Arm:
    """Quantities of the arm of one design."""

    def __init__(self, problem: DesignProblem, row: Array, arm: Manipulator) -> None:
        self.problem, self.arm, self.minimum = problem, arm, problem.minimum_of(row)
        q = problem.postures_of(arm)
        self.poses = q
        self.q = np.repeat(q, len(problem.loads), axis=0)
        self.loads = np.tile(problem.loads, (len(q), 1))
        wanted = {each.of for each in problem.measures}
        outputs = ["tip", "tension", "margin", "compliance", "cable_lengths"]
        self.found = evaluate(
            arm,
            self.q,
            None,
            self.loads,
            outputs,
            minimum=self.minimum,
            maximum=problem.maximum,
            threads=1,
        )
        known = np.isin(self.found.status, (Status.OK, Status.IMMOBILE))
        self.held = known & (self.found["margin"] > 0.0)
        self.of_pose: dict[str, Array] = {}
        if wanted & {*CLEARANCES, "tension_factor"}:
            inside = self.found.status[:: len(problem.loads)] != Status.BEYOND_LIMITS
            names = sorted(wanted & {*CLEARANCES, "tension_factor"})
            with_wire = {
                name: problem.diameter * (1.0 if name == CLEARANCES[0] else 0.5)
                for name in CLEARANCES
            }
            for name, values in measured(arm, q[inside], names, 1).items():
                self.of_pose[name] = values - with_wire.get(name, 0.0)

    def values(self) -> Array:
        """Return all quantities (m,)."""
        return np.array([self._value(each) for each in self.problem.measures])

    def rows(self, each: Measure) -> Array:
        """Return a quantity of the tensions at all postures and loads that are held."""
        C = self.found["compliance"][self.held][:, :3, :3]
        if each.of == "stiffness":
            u = np.array(each.direction)
            with np.errstate(divide="ignore"):
                return np.asarray(1.0 / np.maximum(np.einsum("i,nij,j->n", u, C, u), 0.0))
        if each.of == "deflection":
            moved = np.einsum("nij,nj->ni", C, self.loads[self.held, :3])
            return np.asarray(np.linalg.norm(moved, axis=1))
        if each.of == "motor_force":
            return np.asarray(self.found["tension"][self.held].max(axis=1))
        if each.of == "margin":
            return np.asarray(self.found["margin"][self.held])
        return principal_stiffness(C)[each.of]

    def _value(self, each: Measure) -> float:
        arm, held = self.arm, self.held
        if each.of == "held":
            return float(held.mean())
        if each.of == "mass":
            return sum(link.mass for link in arm.geometry.links)
        if each.of == "length":
            return arm.geometry.length
        if each.of == "cables":
            return float(len(arm.cables))
        if each.of == "workspace":
            return _volume(self.found["tip"][held][:, :3, 3])
        if each.of in self.of_pose:
            return float(self.of_pose[each.of].min(initial=math.inf))
        if not held.any():
            return math.nan
        if each.of == "wire_length":
            return float(self.found["cable_lengths"][held].max(axis=0).sum())
        if each.of == "payload":
            u = np.array(each.direction)[None]
            low = np.full(int(held.sum()), self.minimum)
            force = payloads(arm, self.q[held], self.loads[held], low, self.problem.maximum, u)
            return float(force.min())
        rows = self.rows(each)
        least = each.of in ("deflection", "motor_force")
        worst = int(rows.argmax() if least else rows.argmin())
        return float(rows[worst]) + self._margin(each, worst)

    def _margin(self, each: Measure, worst: int) -> float:
        """Return k u of a reading at its worst posture, with its sign; 0 without tolerances."""
        problem = self.problem
        bounded = any(constraint.key == each.key for constraint in problem.constraints)
        if problem.tolerances is None or each.of not in _SURE or not bounded:
            return 0.0
        n = int(np.flatnonzero(self.held)[worst])
        of, sign = _SURE[each.of]
        pose = self.arm.at(self.q[n])
        F = distribute_tension(pose, self.minimum, problem.maximum, self.loads[n])
        cable = self.arm.cables.names[int(F.values.argmax())] if of == "tension" else None
        found = uncertainty(
            pose,
            F,
            problem.tolerances,
            of=of,
            cable=cable,
            direction=each.direction,
        )
        return sign * problem.coverage * found.standard_uncertainty


def _volume(tips: Array) -> float:
    """Return the volume of the hull of points (n, 3) [m³]; 0 if they are flat."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return float(ConvexHull(tips).volume)
    except (QhullError, ValueError):
        return 0.0
