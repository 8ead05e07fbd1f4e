"""Evaluate many designs: in this process or in several processes."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any, final

import numpy as np
from numpy.typing import ArrayLike

from cdsm.design.goals import KINDS
from cdsm.design.problem import MISSED, DesignProblem
from cdsm.design.quantities import Found, measure, with_margin
from cdsm.design.variables import UNITS
from cdsm.errors import InvalidInput
from cdsm.support.progress import progress_bar
from cdsm.support.tables import csv_text
from cdsm.support.validation import instance, number_array, whole_number
from cdsm.support.values import Array, Named, ReadOnlyState, frozen

if TYPE_CHECKING:
    from multiprocessing.synchronize import Semaphore


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Designs(ReadOnlyState, Named):
    """Designs of a problem with all their quantities; made by :func:`evaluate_designs`.

    Attributes:
        problem: The problem.
        designs: The designs (D, n) [m, rad, N, -], a column for each of ``problem.variables``.
        values: Quantities (D, m) in SI: [N/m], [N m/rad], [m], [N], [kg] or [-]; a column for each
            of ``problem.measures``. A constrained quantity includes its margin for
            ``problem.tolerances``. NaN if a quantity does not exist.
        faults: For each design the reason why no arm can be built from it; empty if one can.
    """

    problem: DesignProblem
    designs: Array
    values: Array
    faults: tuple[str, ...]

    def __getitem__(self, key: str) -> Array:
        """Return a quantity (D,) by its key, such as ``mass`` or ``stiffness (0, 0, 1)``.

        Raises:
            InvalidInput: The quantity is not in ``problem.measures``.
        """
        keys = self.keys()
        if key not in keys:
            raise InvalidInput("measure", f"{key!r} given; give {', '.join(keys)}.")
        return np.asarray(self.values[:, keys.index(key)])

    def keys(self) -> tuple[str, ...]:
        """Return the keys of the quantities."""
        return tuple(each.key for each in self.problem.measures)

    @property
    def violations(self) -> Array:
        """Violation of each constraint, divided by its limit (D, 1 + constraints) [-]; 0 if met.

        Column 0 is the fraction of all pairs of posture and load that are not held: not balanced,
        or unstable. It is 0 if the problem does not require that all are held.
        """
        return violations(self.problem, self.values)

    @property
    def _goals(self) -> Array:
        """Objectives (D, objectives), negated if they are maximised: searches minimise them."""
        return np.column_stack([each.sign * self[each.key] for each in self.problem.objectives])

    @property
    def feasible(self) -> Array:
        """Whether each design meets all constraints (D,): 1 or 0."""
        return np.asarray((self.violations == 0.0).all(axis=1), dtype=np.float64)

    def to_csv(self) -> str:
        """Return a table as CSV: a row for each design, with variables and all quantities in SI.

        The last columns are ``feasible``, 1 or 0, and ``fault``, the reason why no arm can be
        built.
        """
        columns = self._columns() | {"feasible": self.feasible.astype(int), "fault": self.faults}
        rows = enumerate(zip(*columns.values(), strict=True))
        return csv_text(["design", *columns], ([i, *row] for i, row in rows))

    def _columns(self) -> dict[str, Sequence[Any]]:
        """Return a column for each variable and quantity, by its heading.

        The heading has the name, the margin for tolerances if there is one, and the unit.
        """
        rows = [self.problem.values(each) for each in self.designs]
        found: dict[str, Sequence[Any]] = {}
        for variable, column in zip(self.problem.variables, zip(*rows, strict=True), strict=True):
            unit = UNITS.get(variable.of)
            found[variable.name + (f" [{unit}]" if unit else "")] = column
        for each in self.problem.measures:
            found[f"{with_margin(self.problem, each, each.key)} [{KINDS[each.of].unit}]"] = self[
                each.key
            ].tolist()
        return found

    def __len__(self) -> int:
        return len(self.designs)

    def __repr__(self) -> str:
        return f"<Designs: {len(self)}, {int(self.feasible.sum())} feasible>"


def violations(problem: DesignProblem, values: Array) -> Array:
    """Compute :attr:`Designs.violations` from the quantities (D, m) of D designs."""
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
    progress: bool = True,
) -> Designs:
    """Compute all quantities of designs over all postures and loads of the problem.

    Args:
        problem: The problem.
        designs: (D, n) [m, rad, N, -], a column for each of ``problem.variables``.
        jobs: Number of processes. With more than one, a script needs the usual guard
            ``if __name__ == "__main__":``.
        progress: Show a bar, if there is a terminal.

    Raises:
        InvalidInput: A design is outside its ranges, or ``jobs`` is below 1.
    """
    instance("problem", problem, DesignProblem)
    rows = number_array("designs", designs)
    if rows.ndim != 2:
        raise InvalidInput("designs", f"shape {rows.shape} given, (D, n) needed: a row each.")
    for row in rows:
        problem.values(row)
    found = []
    with (
        workers(problem, jobs) as compute,
        progress_bar("designs", len(rows), wanted=progress, rate=True) as advance,
    ):
        for each in compute(rows):
            found.append(each)
            advance(1)
    return gathered(problem, rows, found)


def gathered(problem: DesignProblem, rows: Array, found: Sequence[Found]) -> Designs:
    """Build :class:`Designs` from ``rows``, the designs (D, n), and ``found``, their quantities."""
    width = len(problem.measures)
    return Designs(
        problem=problem,
        designs=frozen(rows.copy()),
        values=frozen(np.array([each.values for each in found]).reshape(-1, width)),
        faults=tuple(each.fault for each in found),
    )


Compute = Callable[[Array], Iterable[Found]]
"""Function that evaluates designs (D, n), in their order."""


@contextmanager
def workers(problem: DesignProblem, jobs: int) -> Iterator[Compute]:
    """Open a context with a function that evaluates designs (D, n), and returns results in order.

    The function uses ``jobs`` processes.
    """
    whole_number("jobs", jobs, 1)
    if jobs == 1:
        yield lambda rows: (measure(problem, row) for row in rows)
    else:
        context = get_context("spawn")  # a forked process would inherit threads of BLAS
        given = problem, context.Semaphore(1)
        with ProcessPoolExecutor(jobs, context, _set_problem, given) as pool:
            try:
                yield lambda rows: pool.map(
                    _in_worker, rows, chunksize=max(1, min(16, len(rows) // 8))
                )
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise


_problem: list[DesignProblem] = []  # the problem of a worker process


def _set_problem(problem: DesignProblem, first: Semaphore) -> None:
    _problem[:] = [problem]
    if not first.acquire(block=False):  # one process says that it compiles kernels, for all
        logging.getLogger("cdsm").setLevel(logging.ERROR)


def _in_worker(row: Array) -> Found:
    return measure(_problem[0], row)
