"""Compute a block of a sweep: all cases at some postures, with the status of each.

A case is a combination of an elasticity, a wrench and a lower bound of the tensions (a minimum).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdsm import batch
from cdsm.manipulator import Manipulator
from cdsm.measures.rows import (
    MEASURED,
    force_radii,
    friction_losses,
    measured,
    narrowed_bounds,
    payloads,
    require,
)
from cdsm.stiffness_matrix.principal import principal_stiffness
from cdsm.support.values import Array, ReadOnlyState
from cdsm.sweeps.arguments import Choice
from cdsm.sweeps.quantities import DIRECTIONAL, QUANTITIES
from cdsm.sweeps.status import SweepStatus, exists
from cdsm.wires.elasticity import Elasticity

BlockResult = dict[str, NDArray[Any]]
"""Outputs and ``status`` by name; the first axis is the posture, the next axes are the cases."""

Rows = dict[str, Array]
Statuses = NDArray[np.int8]

_BATCH_NAMES = {
    "tip_position": "tip",
    "gravity_stiffness": "gravity",
    "active_stiffness": "active",
    "passive_stiffness": "passive",
    "load_stiffness": "load",
    "joint_stiffness": "joint",
    "translational_compliance": "compliance",
}
"""Names of quantities in a batch, where the name in a sweep is different."""


@final
@dataclass(frozen=True, eq=False, kw_only=True)
class SweepTask(ReadOnlyState):
    """What a sweep computes at each posture: the arm, the outputs, the cases.

    Workers receive the task once, and postures with each block. Raises InvalidInput if an output
    needs an argument that is missing, or an argument is invalid.
    """

    arm: Manipulator
    laws: Choice[tuple[Elasticity | None, ...]]  # each for all cables; None keeps those of the arm
    wrenches: Choice[Array]  # (W, 6): force [N], then moment [N m]
    minima: Choice[Array]  # lower bounds of tension (M,) [N]
    maximum: float  # upper bound [N]
    directions: Choice[Array]  # unit directions (D, 3)
    outputs: tuple[str, ...]  # names from QUANTITIES
    worst_friction: bool  # whether all segments of the cables stay within the bounds
    diameter: float  # of the cables [m]

    def __post_init__(self) -> None:
        require(
            self.outputs,
            self.arm,
            self.maximum,
            worst_friction=self.worst_friction,
            diameter=self.diameter,
        )

    @property
    def cases(self) -> int:
        """Return the number of cases at each posture; each has a stiffness matrix of its own."""
        choices = self.laws.values, self.wrenches.values, self.minima.values
        return math.prod(map(len, choices))

    @cached_property
    def arms(self) -> tuple[Manipulator, ...]:
        """Return an arm for each elasticity; springs, leads and control stay unchanged."""
        return tuple(
            self.arm
            if law is None
            else self.arm.with_cables([replace(each, elasticity=law) for each in self.arm.cables])
            for law in self.laws.values
        )


def evaluate(task: SweepTask, q: Array, threads: int | None = None) -> BlockResult:
    """Compute all cases of ``task`` at joint angles q (P, nv) [rad]; a failure sets the status.

    Returns:
        ``status`` (P, E, W, M), for E elasticities, W wrenches and M minima, and all outputs. An
        output has the axis P, then those of the axes E, W and M on which it depends
        (:attr:`Quantity.cases`), then its own axes.
    """
    wrenches = task.wrenches.values
    shape = len(q), len(wrenches), len(task.minima.values)
    stages = {name: QUANTITIES[name].stage for name in task.outputs}
    of_pose = [name for name, stage in stages.items() if stage == "pose"]
    of_tension = [name for name, stage in stages.items() if stage == "tension"]
    of_law = [name for name in stages if name not in (*of_pose, *of_tension)]
    needed = _needed(of_law)

    # a row for each posture, wrench and minimum
    cases = shape[1] * shape[2]
    at = np.repeat(q, cases, axis=0)
    wrench = np.tile(np.repeat(wrenches, shape[2], axis=0), (shape[0], 1))
    low, high, bounded = _bounds(task, at, threads)
    one = shape[2] == 1 and not task.worst_friction  # a bound for all rows
    together = [*(name for name in of_pose if name not in MEASURED), *needed]
    rows, status = _rows(
        task,
        task.arms[0],
        together + ["tension"] * bool(of_tension or of_law),
        at,
        wrench,
        minimum=low[0, 0] if one else low,
        maximum=high[0, 0] if one else high,
        bounded=bounded,
        threads=threads,
    )
    answer: BlockResult = {name: rows[name][::cases] for name in of_pose if name in rows}
    exist = exists("pose", status[::cases])
    wanted = [name for name in of_pose if name in MEASURED]
    for name, values in measured(task.arm, q[exist], wanted, task.diameter).items():
        answer[name] = _spread(values, exist)

    held = exists("tension", status)
    if of_tension:
        F, bounds = rows["tension"][held], (task.arm, at[held], wrench[held], low[held], high[held])
        compute: dict[str, Callable[[], Array]] = {
            "tension": lambda: F,
            "payload": lambda: payloads(*bounds, task.directions.values),
            "force_radius": lambda: force_radii(*bounds),
        }
        for name in of_tension:
            answer[name] = _spread(compute[name](), held)

    by_law: list[BlockResult] = []
    for arm in task.arms:
        found, status_of_law = {name: rows[name] for name in needed}, status.copy()
        if of_law and by_law:
            some, status_of_law[held] = _rows(
                task, arm, needed, at[held], wrench[held], rows["tension"][held], threads=threads
            )
            found = {name: _spread(values, held) for name, values in some.items()}
        if of_law:
            _finish(found, status_of_law, of_law)
        by_law.append({name: found[name] for name in of_law} | {"status": status_of_law})
    for name in of_tension:
        answer[name] = answer[name].reshape(*shape, *answer[name].shape[1:])
    for name in (*of_law, "status"):
        several = [each[name].reshape(*shape, *each[name].shape[1:]) for each in by_law]
        answer[name] = np.stack(several, axis=1)
    return answer


def _bounds(
    task: SweepTask, q: Array, threads: int | None
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return bounds of the tensions at the motors for R rows q (R, nv) [rad].

    A row is a posture with a wrench and a minimum. The results are the lower and upper bounds
    (R, C) [N], and whether the lower bounds of a row are below its upper ones (R,).
    """
    lows = task.minima.values
    minima = np.tile(lows, len(q) // len(lows))
    shape = len(q), len(task.arm.cables)
    if not task.worst_friction:
        low, high = (np.broadcast_to(x, shape) for x in (minima[:, None], task.maximum))
        return low, high, np.broadcast_to(True, len(q))
    cases = len(task.wrenches.values) * len(lows)
    poses = q[::cases]
    exist = batch.evaluate(task.arm, poses, outputs=[], threads=threads).ok
    loss = np.ones((len(poses), shape[1]))
    loss[exist] = friction_losses(task.arm, poses[exist])
    loss = np.repeat(loss, cases, axis=0)
    return narrowed_bounds(task.arm, minima, task.maximum, loss)


def _needed(names: list[str]) -> list[str]:
    """Return the outputs that a batch must compute for the quantities ``names``.

    The margin is one of them, since the status UNSTABLE needs it. The result is empty if ``names``
    is.
    """
    if not names:
        return []
    extreme = [name for name in names if QUANTITIES[name].stage == "principal"]
    needed = [name for name in names if name not in extreme]
    needed += ["margin", "translational_compliance"] if extreme else ["margin"]
    return list(dict.fromkeys(needed))


def _finish(rows: Rows, status: Statuses, names: list[str]) -> None:
    """Add the extreme stiffnesses in ``names`` to ``rows``; set ``status`` where the arm buckles.

    They and their directions are the stage ``principal``, which a batch does not compute.
    """
    extreme = [name for name in names if QUANTITIES[name].stage == "principal"]
    if extreme:
        # extreme stiffnesses exist in stable rows; a margin may be NaN
        exist = (rows["margin"] > 0.0) & (status != SweepStatus.SINGULAR)
        found = principal_stiffness(rows["translational_compliance"][exist])
        rows |= {name: _spread(found[name], exist) for name in extreme}
    buckles = (rows["margin"] <= 0.0) & np.isin(status, (SweepStatus.OK, SweepStatus.IMMOBILE))
    status[buckles] = SweepStatus.UNSTABLE


def _rows(
    task: SweepTask,
    arm: Manipulator,
    names: list[str],
    q: Array,
    wrench: Array,
    tension: Array | None = None,
    *,
    minimum: ArrayLike | None = None,
    maximum: ArrayLike | None = None,
    bounded: NDArray[np.bool_] | None = None,
    threads: int | None,
) -> tuple[Rows, Statuses]:
    """Compute the quantities ``names`` and a status for R rows q (R, nv) [rad], wrench (R, 6).

    ``tension`` is (R, C) [N]; without it the least tensions within the bounds are computed. A
    quantity that does not exist is NaN. ``bounded`` (R,) is False where a lower bound is above the
    upper one; the status of these rows is INFEASIBLE.
    """
    outputs = [_BATCH_NAMES.get(name, name) for name in names]
    found = batch.evaluate(
        arm,
        q,
        tension,
        wrench,
        outputs,
        direction=None if DIRECTIONAL.isdisjoint(outputs) else task.directions.values,
        minimum=minimum,
        maximum=maximum,
        threads=threads,
    )
    status = found.status.astype(np.int8)
    if bounded is not None:
        status[~bounded] = SweepStatus.INFEASIBLE
    rows = {}
    for name, output in zip(names, outputs, strict=True):
        values = found[output]
        if name == "tip_position":
            values = values[:, :3, 3]
        elif name == "translational_compliance":
            values = values[:, :3, :3]
        # a batch holds the pseudoinverse even where K_θ is singular; a sweep does not
        rows[name] = values.copy()
        rows[name][~exists(QUANTITIES[name].stage, status)] = np.nan
    return rows, status


def _spread(values: Array, place: NDArray[np.bool_]) -> Array:
    """Return an array with ``values`` in the rows where ``place`` is True, NaN in all others."""
    full = np.full((len(place), *values.shape[1:]), np.nan)
    full[place] = values
    return full
