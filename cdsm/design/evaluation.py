"""Evaluate many designs, in one process or in several, and explain why none is feasible."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from typing import Any, NoReturn, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm.design.problem import MISSED, DesignProblem
from cdsm.design.quantities import Measured, measure, quiet_arm
from cdsm.errors import CdsmError, FileError, unknown
from cdsm.limits import UNCHECKED
from cdsm.status import Status
from cdsm.stiffness_matrix import stiffness
from cdsm.stiffness_matrix.verdict import describe_buckling
from cdsm.support.format import plural
from cdsm.support.progress import progress_bar
from cdsm.support.tables import csv_text, read_table
from cdsm.support.validation import instance, number_array, whole_number
from cdsm.support.values import Array, IndexedByName, ReadOnlyState, frozen
from cdsm.tension import distribute_tension

_JOBS = 1000  # processes at most
_SAME = 1e-6  # relative difference of a quantity of the same design, computed on another machine


@final
@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Designs(ReadOnlyState, IndexedByName):
    """Designs of a problem with all their quantities; made by :func:`evaluate_designs`.

    Attributes:
        problem: The problem.
        designs: The designs (D, n) [m, rad, N, -], a column for each of ``problem.variables``.
        values: Quantities (D, m) in SI: [N/m], [N m/rad], [m], [N], [kg] or [-]; a column for each
            of ``problem.measures``. NaN if a quantity does not exist.
        faults: For each design the reason why no arm can be built from it; empty if one can.
    """

    problem: DesignProblem
    designs: Array
    values: Array
    faults: tuple[str, ...]

    def __getitem__(self, key: str) -> Array:
        """Return a quantity (D,) by its key, such as ``mass`` or ``along (0, 0, 1)``.

        Raises:
            InvalidInput: The quantity is not in ``problem.measures``.
        """
        if key not in self.keys():
            raise unknown("quantity of the problem", key, self.keys())
        return np.asarray(self.values[:, self.keys().index(key)])

    def keys(self) -> tuple[str, ...]:
        """Return the keys of the quantities."""
        return tuple(measure.key for measure in self.problem.measures)

    @property
    def violations(self) -> Array:
        """Violation of each constraint, divided by its limit (D, 1 + constraints) [-]; 0 if met.

        Column 0 is the fraction of all pairs of posture and load that are not held: not balanced,
        or unstable. It is 0 if the problem does not require that all are held.
        """
        held = np.nan_to_num(self[MISSED])
        columns = [self.problem.needs_all * (1.0 - held)]
        for constraint in self.problem.constraints:
            inside = constraint.distance(self[constraint.key])
            columns.append(np.where(np.isnan(inside), np.inf, np.maximum(-inside, 0.0)))
        return np.column_stack(columns)

    @property
    def goals(self) -> Array:
        """Objectives (D, objectives), negated if they are maximised: searches minimise them."""
        return np.column_stack(
            [objective.sign * self[objective.key] for objective in self.problem.objectives]
        )

    @property
    def feasible(self) -> NDArray[np.bool_]:
        """Whether each design meets all constraints (D,)."""
        return np.asarray((self.violations == 0.0).all(axis=1))

    def some(self, rows: NDArray[np.intp]) -> Designs:
        """Return some of the designs, by their indices (n,)."""
        return replace(
            self,
            designs=frozen(self.designs[rows]),
            values=frozen(self.values[rows]),
            faults=tuple(self.faults[i] for i in rows.tolist()),
        )

    def to_csv(self) -> str:
        """Return a table as CSV: a row for each design, with variables and all quantities in SI.

        The last columns are ``feasible``, 1 or 0, and ``fault``, the reason why no arm can be
        built.
        """
        columns = self.columns() | {"feasible": self.feasible.astype(int), "fault": self.faults}
        rows = enumerate(zip(*columns.values(), strict=True))
        return csv_text(["design", *columns], ([i, *row] for i, row in rows))

    @classmethod
    def read(cls, problem: DesignProblem, path: str | os.PathLike[str]) -> Designs:
        """Read the designs of a problem from a file that :meth:`to_csv` made.

        Raises:
            FileError: The file cannot be read, or its designs are those of another problem.
        """
        instance("problem", problem, DesignProblem)
        table = read_table(path, ",")
        count = len(problem.variables)
        width = count + len(problem.measures)
        none = gathered(problem, np.empty((0, count)), ())
        other = "holds no designs of this problem; repeat the search in another folder."
        head = ["design", *none.headings(), "feasible", "fault"]
        if not table.rows or table.header != head or len(table.rows) < 2:
            raise FileError(path, other)
        try:
            cells = [row[1 : 1 + width] for _, row in table.rows[1:]]
            chosen = [zip(problem.variables, row[:count], strict=True) for row in cells]
            rows = np.array([[v.number_of(cell) for v, cell in row] for row in chosen])
            values = np.array([[float(cell) for cell in row[count:]] for row in cells])
        except ValueError:
            raise FileError(path, other) from None
        faults = tuple(row[-1] for _, row in table.rows[1:])
        designs = replace(none, designs=frozen(rows), values=frozen(values), faults=faults)
        first = int(designs.feasible.argmax())  # the first one if none is feasible
        again = evaluate_designs(problem, rows[first : first + 1], progress=False)
        if not np.allclose(again.values, values[first], rtol=_SAME, equal_nan=True):
            raise FileError(path, other)
        return designs

    def headings(self) -> list[str]:
        """Return the heading of each variable and each quantity: its name and its unit."""
        units = {v.of: v.unit for v in self.problem.variables}
        units |= {m.key: m.quantity.si_unit for m in self.problem.measures}
        return [f"{name} [{unit}]" if unit else name for name, unit in units.items()]

    def columns(self) -> dict[str, Sequence[Any]]:
        """Return a column for each variable and quantity, by its heading."""
        chosen = [self.problem.values(design) for design in self.designs]
        columns = [*zip(*chosen, strict=True), *self.values.T.tolist()]
        return dict(zip(self.headings(), columns, strict=True))

    def __len__(self) -> int:
        return len(self.designs)

    def __repr__(self) -> str:
        return f"<Designs: {len(self)}, {int(self.feasible.sum())} feasible>"


def evaluate_designs(
    problem: DesignProblem, designs: ArrayLike, *, jobs: int = 1, progress: bool = True
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

    Example:
        >>> import cdsm
        >>> problem = cdsm.DesignProblem.read("examples/design.toml")
        >>> print(cdsm.evaluate_designs(problem, [problem.start], progress=False))
        <Designs: 1, 0 feasible>
    """
    instance("problem", problem, DesignProblem)
    rows = np.atleast_2d(number_array("designs", designs))
    for row in rows:
        problem.values(row)
    with workers(problem, jobs, progress, len(rows)) as compute:
        return gathered(problem, rows, compute(rows))


def gathered(problem: DesignProblem, rows: Array, results: Iterable[Measured]) -> Designs:
    """Build :class:`Designs` from ``rows``, the designs (D, n), and ``found``, their quantities."""
    values, faults = zip(*results, strict=True) if len(rows) else ((), ())
    return Designs(
        problem=problem,
        designs=frozen(rows.copy()),
        values=frozen(np.reshape(values, (len(rows), len(problem.measures)))),
        faults=faults,
    )


@contextmanager
def workers(
    problem: DesignProblem, jobs: int, progress: bool, total: int
) -> Iterator[Callable[[Array], Iterable[Measured]]]:
    """Open a context with a function that evaluates designs (D, n), and returns results in order.

    The function uses ``jobs`` processes, and moves the bar.
    """
    whole_number("jobs", jobs, 1, _JOBS)
    compute = partial(measure, problem)
    with progress_bar("designs", total, wanted=progress) as advance:

        def counted(results: Iterable[Measured]) -> Iterator[Measured]:
            for result in results:
                advance(1)
                yield result

        if jobs == 1:
            yield lambda rows: counted(map(compute, rows))
            return
        # a forked process would inherit threads of BLAS
        with ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
            yield lambda rows: counted(pool.map(compute, rows))  # Ctrl-C waits for each chunk


class InfeasibleDesign(CdsmError):
    """No design that a search tried meets all constraints of its problem.

    ``design`` has the smallest sum of violations, one number for each variable (none if no arm was
    valid); ``constraints`` names what it violates, ``held``: it is not balanced, or unstable.
    """

    status = Status.INFEASIBLE_DESIGN

    def __init__(self, message: str, constraints: Sequence[str], design: Sequence[float]) -> None:
        super().__init__(message)
        self.constraints = tuple(constraints)
        self.design = tuple(design)


def explain(designs: Designs) -> NoReturn:
    """Raise InfeasibleDesign: what the design of the smallest sum of violations misses."""
    problem = designs.problem
    count = plural(len(designs), "design")
    missed = np.nan_to_num(designs.violations, posinf=1e9)
    arms = np.array([not fault for fault in designs.faults])
    if not arms.any():
        raise InfeasibleDesign(f"none of {count} is an arm: {designs.faults[0]}", (), ())
    best = int(np.where(arms, missed.sum(axis=1), np.inf).argmin())
    row = designs.designs[best]
    misses = dict[str, str]()
    if missed[best, 0] > 0.0:
        share = f"{100.0 * missed[best, 0]:.3g} %"
        why = _first_reason(problem, row)
        misses["held"] = f"{share} of its postures and loads are not held: {why}"
    for constraint, miss in zip(problem.constraints, missed[best, 1:].tolist(), strict=True):
        if miss > 0.0:
            value = float(designs[constraint.key][best])
            now = "does not exist" if np.isnan(value) else constraint.shown(value)
            far = f", {100.0 * miss:.3g} % off" if miss < 1e9 else ""
            misses[constraint.key] = f"{constraint.words} {now}, {constraint.asked} is asked{far}"
    for objective in problem.objectives:
        value = float(designs[objective.key][best])
        if not np.isfinite(value):
            misses.setdefault(objective.key, f"{objective.words} is {objective.shown(value)}")
    values = zip(problem.variables, problem.values(row), strict=True)
    chosen = ", ".join(f"{variable.of} {variable.shown(value)}" for variable, value in values)
    raise InfeasibleDesign(
        f"none of {count} meets all constraints. The nearest one ({chosen}) misses: "
        f"{'; '.join(misses.values()).rstrip('.')}. Loosen what it misses, widen a variable, or "
        "search longer.",
        tuple(misses),
        tuple(row.tolist()),
    )


def _first_reason(problem: DesignProblem, row: Array) -> str:
    """Return which posture a design does not hold first, and why."""
    bounds = (problem.minimum_of(row), problem.maximum)
    worst = problem.worst_friction
    number = 0
    try:
        arm = quiet_arm(problem, row)
        for number, q in enumerate(problem.postures_of(arm)):
            pose = arm.at(q)
            for load in problem.loads:
                pull = distribute_tension(pose, *bounds, load, worst_friction=worst)
                K = stiffness(pose, pull)
                if not K.is_stable:
                    return f"posture {number}: {describe_buckling(K)}"
    except CdsmError as error:
        return f"posture {number}: {str(error).replace(UNCHECKED, '')}"
    return "its tensions are at the edge"
